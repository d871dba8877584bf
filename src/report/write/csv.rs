//! metrics.csv: a line for each metric of each solid, following RFC 4180.

use csv::WriterBuilder;
use serde::Serialize;

use crate::report::scaffold_report::{Metric, ScaffoldReport, Status};
use crate::report::write::table;

/// A line; its fields name the columns.
#[derive(Serialize)]
struct Line<'s> {
    input: &'s str,
    id: &'s str,
    symbol: &'s str,
    name: &'s str,
    value: Option<f64>,
    error: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
    unit: String,
    status: Status,
    method: &'s str,
    parameters: String,
    reference: &'s str,
}

/// Returns the table of the metrics of all reports; a cell is empty if there is no finite number.
pub fn csv(reports: &[&ScaffoldReport]) -> String {
    table(&mut WriterBuilder::new(), |writer| {
        let mut metrics = reports.iter().flat_map(|report| report.metrics.iter().map(|metric| line(report, metric)));
        metrics.try_for_each(|line| writer.serialize(line))
    })
}

fn line<'s>(report: &'s ScaffoldReport, metric: &'s Metric) -> Line<'s> {
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    let parameters: Vec<String> = metric.parameters.iter().map(|(name, value)| format!("{name}={value}")).collect();
    Line {
        input: &report.title,
        id: metric.id,
        symbol: metric.symbol,
        name: metric.name,
        value: finite(metric.value),
        error: finite(metric.error),
        lower: finite(metric.lower),
        upper: finite(metric.upper),
        unit: metric.unit.to_string(),
        status: metric.status,
        method: metric.method,
        parameters: parameters.join("; "),
        reference: metric.reference,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    #[test]
    fn every_metric_has_a_line_that_reads_back() {
        let (rich, poor) = (fixture::rich(), fixture::poor());
        let text = csv(&[&rich, &poor]);
        assert!(
            text.starts_with(
                "input,id,symbol,name,value,error,lower,upper,unit,status,method,parameters,reference\r\n"
            )
        );
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let lines: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().unwrap();
        assert_eq!(lines.len(), rich.metrics.len() + poor.metrics.len());
        let of = |input: &str, id: &str| lines.iter().find(|line| &line[0] == input && &line[1] == id).unwrap();
        let porosity = of(&rich.title, "porosity");
        assert_eq!((&porosity[4], &porosity[8], &porosity[9]), ("0.69873", "1", "measured"));
        let total = of(fixture::AWKWARD, "volume.total");
        assert_eq!((&total[4], &total[8]), ("", ""));
        assert_eq!(&of(&rich.title, "tortuosity.pore.diffusive.z")[9], "not-applicable");
    }
}
