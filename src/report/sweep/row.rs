//! The row of a design: its parameters and metrics, or why it has none. Each is a JSON file, written completely or not at all.

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::plan::{Design, Plan};
use crate::driver::output;
use crate::mesh::LengthUnit;
use crate::report::scaffold_report::{Alert, Metric, Status};
use crate::{Error, Report, unit};

/// The outcome of one design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The key of the design: a hash of its parameters, the settings and the version.
    pub design: String,
    /// What all designs of the plan are measured by: model, limits, region, settings.
    pub plan: Map<String, Value>,
    /// The parameters, in the order of the plan.
    pub parameters: Map<String, Value>,
    /// The reason why there are no metrics.
    pub error: Option<String>,
    /// Whether all limits are kept, if any were given.
    pub passed: Option<bool>,
    /// The symbol of the unit of length.
    pub length_unit: Option<String>,
    /// The version of the program that measured.
    pub version: String,
    /// Facts that limit the trust in metrics, as code and message.
    pub warnings: Vec<[String; 2]>,
    /// The metrics by their ids.
    pub metrics: BTreeMap<String, Cell>,
}

/// A metric of a design, in the unit of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// The value.
    pub value: Option<f64>,
    /// The lower bound.
    pub lower: Option<f64>,
    /// The upper bound.
    pub upper: Option<f64>,
    /// The status of the value.
    pub status: Status,
}

impl Row {
    /// Returns the row of a design that was measured, or failed.
    pub(super) fn of(plan: &Plan, design: &Design, report: Result<Report, Error>) -> Row {
        let row = Row {
            design: design.key.clone(),
            plan: plan.facts().clone(),
            parameters: design.parameters.clone(),
            error: None,
            passed: None,
            length_unit: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            warnings: Vec::new(),
            metrics: BTreeMap::new(),
        };
        let warning = |alert: &Alert| [alert.code.to_owned(), alert.message.clone()];
        let cell = |&Metric { value, lower, upper, status, .. }: &Metric| Cell { value, lower, upper, status };
        match report {
            Err(error) => Row { error: Some(error.to_string()), ..row },
            Ok(report) => Row {
                passed: report.verdict().map(|verdict| verdict.passed),
                length_unit: report.scaffold_report().unit.map(|unit| unit.symbol().to_owned()),
                warnings: report.scaffold_report().alerts.iter().map(warning).collect(),
                metrics: report.metrics().iter().map(|metric| (metric.id.to_owned(), cell(metric))).collect(),
                ..row
            },
        }
    }

    /// Returns the parameters in words.
    pub fn name(&self) -> String {
        named(&self.parameters)
    }

    /// Returns whether the design could not be measured.
    pub fn is_failed(&self) -> bool {
        self.error.is_some()
    }

    /// Returns the code of each kind of warning.
    pub fn warning_codes(&self) -> Vec<&str> {
        let mut codes: Vec<&str> = Vec::new();
        for [code, _] in &self.warnings {
            if !codes.contains(&code.as_str()) {
                codes.push(code);
            }
        }
        codes
    }

    /// Returns whether a metric is measured on a raster that resolves it.
    pub fn is_resolved(&self, id: &str) -> bool {
        self.metrics.get(id).is_some_and(|cell| cell.status == Status::Measured)
    }

    /// Returns the finite value of a metric.
    pub fn value(&self, id: &str) -> Option<f64> {
        self.metrics.get(id)?.value.filter(|value| value.is_finite())
    }
}

/// Returns the unit of length of designs.
pub(super) fn length_unit(rows: &[Row]) -> Option<LengthUnit> {
    rows.iter().find_map(|row| row.length_unit.as_deref()).and_then(|symbol| unit::parse(symbol).ok())
}

/// Returns whether a design has a row, readable or not.
pub(super) fn exists(folder: &Path, design: &Design) -> bool {
    file(folder, &design.key).exists()
}

fn file(folder: &Path, key: &str) -> PathBuf {
    folder.join(format!("{key}.json"))
}

/// Returns parameters as they are shown: `wall 0.4, cells 2`.
pub(super) fn named<'p>(parameters: impl IntoIterator<Item = (&'p String, &'p Value)>) -> String {
    let parameters = parameters.into_iter().map(|(name, value)| format!("{name} {}", shown(value)));
    parameters.collect::<Vec<_>>().join(", ")
}

/// Returns a parameter as it is shown: 0.4, or 2,2,3 of a list.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(parts) => parts.iter().map(shown).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}

/// Reads the row of a design from a folder; `None` if there is none that can be read and has its parameters, in whatever order.
pub(super) fn read(folder: &Path, design: &Design) -> Option<Row> {
    let mut row: Row = serde_json::from_slice(&fs::read(file(folder, &design.key)).ok()?).ok()?;
    let same = row.design == design.key && row.parameters.keys().all(|name| design.parameters.contains_key(name));
    row.parameters = design.parameters.clone();
    same.then_some(row)
}

/// Writes a row to a folder.
///
/// # Errors
/// If the file cannot be written.
pub(super) fn write(folder: &Path, row: &Row) -> Result<(), Error> {
    let text = serde_json::to_string(row).expect("keys are texts");
    output::add(&file(folder, &row.design), |file| file.write_all(text.as_bytes()))
}
