//! Tables of metrics by group, and the key figures.

use super::words;
use crate::report::id::Group;
use crate::report::id::{self, MetricId, Statistic};
use crate::report::scaffold_report::{Metric, ScaffoldReport};

/// A group of metrics.
pub struct GroupTable {
    pub name: &'static str,
    pub anchor: &'static str,
    /// True if it is initially expanded.
    pub open: bool,
    pub count: usize,
    pub tables: Vec<Table>,
}

/// Metrics with the same columns.
pub struct Table {
    pub caption: &'static str,
    pub columns: &'static [&'static str],
    pub rows: Vec<Row>,
}

/// One metric, or several that differ by axis or by statistic, a cell each.
pub struct Row {
    /// HTML.
    pub symbol: String,
    pub name: &'static str,
    pub definition: &'static str,
    pub cells: Vec<Cell>,
    pub unit: String,
    pub method: &'static str,
    pub parameters: String,
    pub reference: &'static str,
    pub ids: String,
    /// Warnings about the values, and reasons for missing ones.
    pub notes: Vec<String>,
}

/// The value of one metric.
pub struct Cell {
    pub column: &'static str,
    /// The value with its error, without its unit; `–` if missing.
    pub value: String,
    pub bounds: Option<String>,
}

/// A metric shown in large type.
pub struct KeyFigure {
    /// HTML.
    pub symbol: String,
    pub name: &'static str,
    /// The value with its error, without its unit.
    pub value: String,
    pub unit: String,
    pub reason: Option<String>,
}

/// The key figures, in this order, each shown if present.
const KEY: [MetricId; 8] = [
    id::POROSITY,
    id::PERCOLATION,
    id::SOLID_THICKNESS.of(Statistic::Mean),
    id::PORE_THICKNESS.of(Statistic::Mean),
    id::WALL_THINNEST,
    id::SURFACE_SPECIFIC,
    id::ANISOTROPY,
    id::CONNECTIVITY,
];

/// The groups in the order of the table.
pub const GROUPS: [Group; 10] = [
    Group::Volume,
    Group::Surface,
    Group::Access,
    Group::Thickness,
    Group::Chords,
    Group::Anisotropy,
    Group::Topology,
    Group::Transport,
    Group::Moments,
    Group::Manufacture,
];

/// Returns the name and the anchor of a group.
pub const fn named(group: Group) -> (&'static str, &'static str) {
    match group {
        Group::Volume => ("Volume and porosity", "metrics-volume"),
        Group::Surface => ("Surface", "metrics-surface"),
        Group::Access => ("Access and percolation", "metrics-access"),
        Group::Thickness => ("Thickness, separation, pore size", "metrics-thickness"),
        Group::Chords => ("Chords", "metrics-chords"),
        Group::Anisotropy => ("Anisotropy", "metrics-anisotropy"),
        Group::Topology => ("Topology", "metrics-topology"),
        Group::Transport => ("Transport", "metrics-transport"),
        Group::Moments => ("Moments", "metrics-moments"),
        Group::Manufacture => ("Manufacture", "metrics-manufacture"),
    }
}

/// Returns whether a group is initially expanded: not those that other sections repeat, nor those for specialists.
pub const fn is_open(group: Group) -> bool {
    !matches!(group, Group::Chords | Group::Anisotropy | Group::Topology | Group::Moments)
}

/// Endings of ids that form the columns of one row, the names of the columns, and the caption of the table.
struct Series {
    ends: &'static [&'static str],
    columns: &'static [&'static str],
    caption: &'static str,
}

const SINGLE: Series = Series { ends: &[""], columns: &["Value"], caption: "" };
const AXES: Series =
    Series { ends: &[".x", ".y", ".z"], columns: &["x", "y", "z"], caption: "Along the axes x, y and z" };
const STATISTICS: Series = Series {
    ends: &[".mean", ".sd", ".min", ".p1", ".p5", ".p50", ".p95", ".max"],
    columns: &["mean", "SD", "least", "1 %", "5 %", "median", "95 %", "largest"],
    caption: "Distributions: mean, standard deviation, percentiles by volume",
};

pub fn groups(report: &ScaffoldReport) -> Vec<GroupTable> {
    let table = |group| {
        let (name, anchor) = named(group);
        let metrics: Vec<&Metric> = report.metrics.iter().filter(|metric| metric.group == group).collect();
        GroupTable { name, anchor, open: is_open(group), count: metrics.len(), tables: tables(&metrics) }
    };
    GROUPS.into_iter().map(table).filter(|group| group.count > 0).collect()
}

/// Returns the tables: single metrics first, then those of several columns.
fn tables(mut metrics: &[&Metric]) -> Vec<Table> {
    let kinds = [&SINGLE, &STATISTICS, &AXES];
    let mut rows = kinds.map(|_| Vec::new());
    while let [first, ..] = metrics {
        let fits = |series: &Series| series_of(metrics, series).is_some();
        let kind = (1..kinds.len()).find(|&kind| fits(kinds[kind])).unwrap_or(0);
        let (row, rest) = metrics.split_at(kinds[kind].ends.len());
        rows[kind].push(Row::of(row, kinds[kind], series_of(row, kinds[kind]).unwrap_or(first.id)));
        metrics = rest;
    }
    let made = kinds.into_iter().zip(rows).filter(|(_, rows)| !rows.is_empty());
    made.map(|(kind, rows)| Table { caption: kind.caption, columns: kind.columns, rows }).collect()
}

/// Returns the common stem of the ids of the first metrics, if their endings are those of a series.
fn series_of<'s>(metrics: &[&'s Metric], series: &Series) -> Option<&'s str> {
    let stem = metrics.first()?.id.strip_suffix(series.ends[0])?;
    let is_next = |(metric, end): (&&Metric, &&str)| metric.id.strip_suffix(end) == Some(stem);
    (metrics.len() >= series.ends.len() && metrics.iter().zip(series.ends).all(is_next)).then_some(stem)
}

/// Returns the metrics of a group, a row each.
pub fn rows(report: &ScaffoldReport, group: Group) -> Vec<Row> {
    let of_group = report.metrics.iter().filter(|metric| metric.group == group);
    of_group.map(|metric| Row::of(&[metric], &SINGLE, metric.id)).collect()
}

/// Returns the value if it is finite.
pub fn finite(value: Option<f64>) -> Option<f64> {
    value.filter(|value| value.is_finite())
}

impl Row {
    fn of(metrics: &[&Metric], series: &Series, stem: &str) -> Row {
        let first = metrics[0];
        let alone = metrics.len() == 1;
        let cell = |(metric, &column): (&&Metric, &&'static str)| Cell {
            column,
            value: finite(metric.value)
                .map_or(words::NOTHING.to_owned(), |value| words::with_error(value, metric.error, &metric.unit)),
            bounds: words::bounds(finite(metric.lower), finite(metric.upper), &metric.unit),
        };
        let parameters = |metric: &Metric| -> Vec<String> {
            let all = metric.parameters.iter().map(|(name, value)| format!("{name} {value}")).collect::<Vec<_>>();
            if all.is_empty() { Vec::new() } else { vec![all.join(", ")] }
        };
        let notes = |metric: &Metric| match finite(metric.value) {
            None => vec![words::reason(metric)],
            Some(_) => metric.warnings.clone(),
        };
        let ends: Vec<&str> = series.ends.iter().map(|end| end.trim_start_matches('.')).collect();
        Row {
            symbol: words::symbol(if alone { first.symbol } else { first.symbol.trim_end_matches(" x") }),
            name: if alone { first.name } else { first.name.trim_end_matches(" along x").trim_end_matches(", mean") },
            definition: first.definition,
            cells: metrics.iter().zip(series.columns).map(cell).collect(),
            unit: first.unit.for_people(),
            method: first.method,
            parameters: together(metrics, series, parameters).join("; "),
            reference: first.reference,
            ids: if alone { first.id.to_owned() } else { format!("{stem}.{{{}}}", ends.join(", ")) },
            notes: together(metrics, series, notes),
        }
    }

    /// Returns the value of a single metric.
    pub fn value(&self) -> &str {
        &self.cells[0].value
    }
}

/// Returns the texts on some metrics, each once, with its columns if it does not apply to all.
fn together(metrics: &[&Metric], series: &Series, said: impl Fn(&Metric) -> Vec<String>) -> Vec<String> {
    let mut texts: Vec<(String, Vec<&str>)> = Vec::new();
    for (metric, column) in metrics.iter().zip(series.columns) {
        for text in said(metric) {
            match texts.iter_mut().find(|(known, _)| *known == text) {
                Some((_, columns)) => columns.push(column),
                None => texts.push((text, vec![column])),
            }
        }
    }
    let named = |(text, columns): (String, Vec<&str>)| match columns.len() == metrics.len() {
        true => text,
        false => format!("{}: {text}", columns.join(", ")),
    };
    texts.into_iter().map(named).collect()
}

pub fn key_figures(report: &ScaffoldReport) -> Vec<KeyFigure> {
    let found = KEY.iter().filter_map(|id| report.metric(id.id));
    found
        .map(|metric| {
            let value = finite(metric.value);
            KeyFigure {
                symbol: words::symbol(metric.symbol),
                name: metric.name,
                value: value
                    .map_or(words::NOTHING.to_owned(), |value| words::with_error(value, metric.error, &metric.unit)),
                unit: if value.is_some() { metric.unit.for_people() } else { String::new() },
                reason: value.is_none().then(|| words::reason(metric)),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;
    use crate::report::measure::unmeasured;

    #[test]
    fn metrics_that_differ_by_axis_or_statistic_share_a_row() {
        let mut report = fixture::rich();
        report.metrics = unmeasured(report.unit);
        for metric in &mut report.metrics {
            metric.value = Some(1.0);
        }
        let groups = groups(&report);
        let rows: Vec<&Row> = groups.iter().flat_map(|group| &group.tables).flat_map(|table| &table.rows).collect();
        assert_eq!(rows.iter().map(|row| row.cells.len()).sum::<usize>(), report.metrics.len());
        let row = |ids: &str| *rows.iter().find(|row| row.ids == ids).unwrap_or_else(|| panic!("no row {ids}"));
        let tortuosity = row("tortuosity.pore.diffusive.{x, y, z}");
        assert_eq!((tortuosity.name, tortuosity.cells.len()), ("Diffusive tortuosity of the pores", 3));
        assert_eq!(row("solid.thickness.{mean, sd, min, p1, p5, p50, p95, max}").name, "Thickness of the solid");
        assert_eq!((row("percolation").cells.len(), row("percolation.{x, y, z}").cells.len()), (1, 3));
        let ends = [".x", ".y", ".z"];
        assert!(rows.iter().all(|row| row.cells.len() > 1 || !ends.iter().any(|end| row.ids.ends_with(end))));
    }

    #[test]
    fn what_is_said_of_some_columns_names_them() {
        let mut report = fixture::rich();
        report.metrics = unmeasured(report.unit);
        let of = |report: &ScaffoldReport| {
            let found = groups(report).into_iter().flat_map(|group| group.tables).flat_map(|table| table.rows);
            found.filter(|row| row.ids.starts_with("percolation.")).flat_map(|row| row.notes).collect::<Vec<_>>()
        };
        assert_eq!(of(&report), ["not measured"]);
        let metric = report.metrics.iter_mut().find(|metric| metric.id == "percolation.y").unwrap();
        (metric.value, metric.warnings) = (Some(0.5), vec!["narrow".to_owned()]);
        assert_eq!(of(&report), ["x, z: not measured", "y: narrow"]);
    }
}
