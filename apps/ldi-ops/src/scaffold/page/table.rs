//! Metrics as rows of tables, group by group, and the few that come first.

use super::words;
use crate::scaffold::id;
use crate::scaffold::sheet::{Group, Metric, Sheet};

/// A group of metrics.
pub struct GroupTable {
    pub name: &'static str,
    pub anchor: &'static str,
    pub rows: Vec<Row>,
}

/// One metric.
pub struct Row {
    /// As HTML.
    pub symbol: String,
    pub name: &'static str,
    pub definition: &'static str,
    /// With its error, without its unit; `–` where there is none.
    pub value: String,
    /// Why there is no value.
    pub reason: Option<String>,
    pub bounds: Option<String>,
    pub unit: String,
    pub method: &'static str,
    pub parameters: String,
    pub reference: &'static str,
    pub id: &'static str,
    /// What to know of a value that is there.
    pub warnings: Vec<String>,
}

/// A metric that is shown large.
pub struct KeyFigure {
    /// As HTML.
    pub symbol: String,
    pub name: &'static str,
    pub value: String,
    pub unit: String,
    pub bounds: Option<String>,
    pub reason: Option<String>,
}

/// Those that are shown large, in this order, where they are there.
const KEY: [&str; 8] = [
    id::POROSITY,
    id::PERCOLATION,
    id::THICKNESS,
    id::SEPARATION,
    id::THINNEST_WALL,
    id::SURFACE_PER_SOLID,
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

/// The name of a group, and that of its anchor.
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

pub fn groups(sheet: &Sheet) -> Vec<GroupTable> {
    let table = |group| {
        let (name, anchor) = named(group);
        GroupTable { name, anchor, rows: rows(sheet, group) }
    };
    GROUPS.into_iter().map(table).filter(|table| !table.rows.is_empty()).collect()
}

pub fn rows(sheet: &Sheet, group: Group) -> Vec<Row> {
    sheet.metrics.iter().filter(|metric| metric.group == group).map(Row::of).collect()
}

/// The value of a metric, where it is one that can be said.
pub fn finite(value: Option<f64>) -> Option<f64> {
    value.filter(|value| value.is_finite())
}

impl Row {
    fn of(metric: &Metric) -> Row {
        let value = finite(metric.value);
        let parameters: Vec<String> = metric.parameters.iter().map(|(name, value)| format!("{name} {value}")).collect();
        Row {
            symbol: words::symbol(metric.symbol),
            name: metric.name,
            definition: metric.definition,
            value: value
                .map_or(words::NOTHING.to_owned(), |value| words::with_error(value, metric.error, &metric.unit)),
            reason: value.is_none().then(|| words::reason(metric)),
            bounds: words::bounds(finite(metric.lower), finite(metric.upper), &metric.unit),
            unit: metric.unit.for_people(),
            method: metric.method,
            parameters: parameters.join(", "),
            reference: metric.reference,
            id: metric.id,
            warnings: if value.is_some() { metric.warnings.clone() } else { Vec::new() },
        }
    }
}

pub fn key_figures(sheet: &Sheet) -> Vec<KeyFigure> {
    let found = KEY.iter().filter_map(|&id| sheet.metric(id));
    found
        .map(|metric| {
            let value = finite(metric.value);
            KeyFigure {
                symbol: words::symbol(metric.symbol),
                name: metric.name,
                value: value.map_or(words::NOTHING.to_owned(), |value| words::value(value, &metric.unit)),
                unit: if value.is_some() { metric.unit.for_people() } else { String::new() },
                bounds: words::bounds(finite(metric.lower), finite(metric.upper), &metric.unit),
                reason: value.is_none().then(|| words::reason(metric)),
            }
        })
        .collect()
}
