//! Columns and cells of sortable tables.

use super::words;
use crate::report::id::MetricId;

/// The heading of a metric's column.
pub struct Column {
    /// HTML.
    pub symbol: String,
    pub name: &'static str,
    pub unit: String,
}

impl Column {
    /// Returns the column of a metric; `unit` is empty where values state their own.
    pub fn of(metric: MetricId, unit: String) -> Column {
        Column { symbol: words::symbol(metric.symbol), name: metric.name, unit }
    }
}

/// A value of a metric or of a parameter.
pub struct Cell {
    pub text: String,
    /// The sort key; an empty one sorts last.
    pub key: String,
}

impl Cell {
    /// Returns the cell of what has no value.
    pub fn nothing() -> Cell {
        Cell { text: words::NOTHING.to_owned(), key: String::new() }
    }

    /// Returns the sort key of a number.
    pub fn key(value: f64) -> String {
        format!("{value:e}")
    }
}
