//! designs.csv: a row for each design and a column for each metric, for spreadsheets.

use csv::WriterBuilder;

use crate::mesh::LengthUnit;
use crate::report::page::summary::Unmeasured;
use crate::report::scaffold_report::{Metric, ScaffoldReport};
use crate::report::write::{BYTE_ORDER_MARK, table};

/// Returns the table; a cell is empty if there is no finite number. Lengths are in the unit of the first design if every design
/// has one; otherwise in that of each design, which the second column names.
pub fn designs(reports: &[&ScaffoldReport], failures: &[Unmeasured]) -> String {
    let mut metrics: Vec<&Metric> = Vec::new();
    for metric in reports.iter().flat_map(|report| &report.metrics) {
        if !metrics.iter().any(|known| known.id == metric.id) {
            metrics.push(metric);
        }
    }
    let common: Option<LengthUnit> =
        reports.first().and_then(|first| first.unit).filter(|_| reports.iter().all(|report| report.unit.is_some()));
    let header = |metric: &&Metric| {
        let unit = metric.unit.quantity.of(common);
        let name = unit.to_string();
        format!("{} [{}]", metric.id, if name.is_empty() { unit.for_people() } else { name })
    };
    let value = |report: &ScaffoldReport, metric: &Metric| {
        let metric = report.metric(metric.id)?;
        let factor = common.and_then(|unit| metric.unit.factor_to(&metric.unit.quantity.of(Some(unit)))).unwrap_or(1.0);
        metric.value.map(|value| value * factor).filter(|value| value.is_finite()).map(|value| value.to_string())
    };
    let rows = table(&mut WriterBuilder::new(), |writer| {
        let first = ["design", "length unit", "limits", "not measured because"].map(str::to_owned);
        writer.write_record(first.into_iter().chain(metrics.iter().map(header)))?;
        for report in reports {
            let limits = report.verdict.as_ref().map_or("", |verdict| if verdict.passed { "kept" } else { "broken" });
            let unit = common.or(report.unit).map_or("unknown", LengthUnit::symbol);
            let first = [report.title.as_str(), unit, limits, ""].map(str::to_owned);
            let values = metrics.iter().map(|metric| value(report, metric).unwrap_or_default());
            writer.write_record(first.into_iter().chain(values))?;
        }
        for Unmeasured { path, message } in failures {
            let first = [path.as_str(), "", "", message.as_str()].map(str::to_owned);
            writer.write_record(first.into_iter().chain(metrics.iter().map(|_| String::new())))?;
        }
        Ok(())
    });
    BYTE_ORDER_MARK.to_owned() + &rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    #[test]
    fn each_design_has_a_row_and_each_metric_a_column() {
        let rich = fixture::rich();
        let mut in_metres = fixture::rich();
        in_metres.title = fixture::AWKWARD.to_owned();
        in_metres.unit = Some(LengthUnit::Metre);
        in_metres.metrics.iter_mut().for_each(|metric| metric.unit = metric.unit.quantity.of(Some(LengthUnit::Metre)));
        let failure = Unmeasured { path: "broken.stl".to_owned(), message: "not closed:\n  12 open edges".to_owned() };
        let text = designs(&[&rich, &in_metres], &[failure]);
        let text = text.strip_prefix('\u{feff}').expect("a byte order mark");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().unwrap().clone();
        let column = |name: &str| header.iter().position(|known| known == name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(header.len(), 4 + rich.metrics.len());
        let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().unwrap();
        assert_eq!(rows.len(), 3);
        assert_eq!((&rows[0][0], &rows[1][0]), (rich.title.as_str(), fixture::AWKWARD));
        assert_eq!((&rows[0][2], &rows[0][column("porosity [1]")]), ("broken", "0.69873"));
        assert_eq!(&rows[0][column("volume.total [mm^3]")], "1000");
        assert_eq!(rows[1][column("volume.total [mm^3]")].parse::<f64>().unwrap().log10().round(), 12.0);
        assert_eq!((&rows[2][0], &rows[2][3]), ("broken.stl", "not closed:\n  12 open edges"));
        let poor = designs(&[&rich, &fixture::poor()], &[]);
        assert!(poor.contains("volume.total [units³]") && poor.contains("unknown"));
    }
}
