//! The record of measured metrics: values by id, sorted by the catalogue at the end.

use std::collections::HashMap;

use crate::mesh::LengthUnit;
use crate::report::id::{self, MetricId};
use crate::report::scaffold_report::{Metric, Status};

/// The metrics measured so far.
#[derive(Default)]
pub struct Record {
    entries: HashMap<&'static str, Entry>,
}

/// The measured data of one metric.
#[derive(Clone, Debug, Default)]
pub struct Entry {
    value: Option<f64>,
    error: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
    parameters: Vec<(&'static str, String)>,
    unresolved: bool,
    warnings: Vec<String>,
}

impl Record {
    /// Records a value. One that is not finite becomes a missing value with a warning.
    pub fn put(&mut self, id: MetricId, value: f64) -> &mut Entry {
        let entry = self.entry(id);
        entry.value = value.is_finite().then_some(value);
        if !value.is_finite() {
            entry.warnings.push("not a finite number".to_owned());
        }
        entry
    }

    /// Records that a value is missing, and the reason.
    pub fn lacks(&mut self, id: MetricId, why: impl Into<String>) -> &mut Entry {
        let entry = self.entry(id);
        entry.value = None;
        entry.warnings.push(why.into());
        entry
    }

    /// Records a value, or the reason why it is missing.
    pub fn put_or(&mut self, id: MetricId, value: Option<f64>, why: &str) -> &mut Entry {
        match value {
            Some(value) => self.put(id, value),
            None => self.lacks(id, why),
        }
    }

    /// Marks a metric as unresolved: the raster is too coarse.
    pub fn unresolved(&mut self, id: MetricId, why: impl Into<String>) {
        self.entry(id).unresolved(why);
    }

    /// Returns whether the raster is too coarse for a metric.
    pub fn is_unresolved(&self, id: MetricId) -> bool {
        self.entries.get(id.id).is_some_and(|entry| entry.unresolved)
    }

    fn entry(&mut self, id: MetricId) -> &mut Entry {
        self.entries.entry(id.id).or_default()
    }

    /// Returns the entry of a metric that has a value.
    pub fn found(&mut self, id: MetricId) -> Option<&mut Entry> {
        self.entries.get_mut(id.id).filter(|entry| entry.value.is_some())
    }

    /// Returns the value of a metric, if any.
    pub fn value(&self, id: MetricId) -> Option<f64> {
        self.entries.get(id.id)?.value
    }

    /// Returns all recorded metrics, in the order of the catalogue.
    pub fn into_metrics(mut self, length: Option<LengthUnit>) -> Vec<Metric> {
        let all = id::all().filter_map(|id| Some((id, self.entries.remove(id.id)?)));
        all.map(|(id, entry)| Metric {
            id: id.id,
            group: id.group,
            symbol: id.symbol,
            name: id.name,
            definition: id.definition,
            value: entry.value,
            error: entry.error,
            lower: entry.lower,
            upper: entry.upper,
            unit: id.quantity.of(length),
            method: id.method,
            parameters: entry.parameters,
            reference: id.reference,
            status: match (entry.value, entry.unresolved) {
                (_, true) => Status::NotResolved,
                (Some(_), false) => Status::Measured,
                (None, false) => Status::NotApplicable,
            },
            warnings: entry.warnings,
        })
        .collect()
    }
}

impl Entry {
    /// Sets the estimated error of the value.
    pub fn error(&mut self, error: f64) -> &mut Entry {
        self.error = error.is_finite().then_some(error);
        self
    }

    /// Sets the lower and upper bound of the value.
    pub fn bounds(&mut self, lower: Option<f64>, upper: Option<f64>) -> &mut Entry {
        (self.lower, self.upper) = (lower, upper);
        self
    }

    /// Adds a parameter that the value depends on.
    pub fn with(&mut self, name: &'static str, value: impl ToString) -> &mut Entry {
        self.parameters.push((name, value.to_string()));
        self
    }

    /// Adds a warning about the value.
    pub fn warn(&mut self, warning: impl Into<String>) -> &mut Entry {
        self.warnings.push(warning.into());
        self
    }

    /// Marks the value as unresolved: the raster is too coarse.
    pub fn unresolved(&mut self, why: impl Into<String>) -> &mut Entry {
        self.unresolved = true;
        self.warn(why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metrics_come_in_the_order_of_the_catalogue_with_their_units() {
        let mut record = Record::default();
        record.put(id::CONNECTIVITY, 2.0).with("edges", "clip");
        record.put(id::VOLUME_SOLID, 3.0).error(0.1).bounds(Some(2.0), None);
        record.lacks(id::PORE_LARGEST, "there are no pores");
        record.put(id::NUMBER, f64::NAN);
        let metrics = record.into_metrics(Some(LengthUnit::Millimetre));
        let ids: Vec<&str> = metrics.iter().map(|metric| metric.id).collect();
        assert_eq!(ids, ["volume.solid", "pore.largest", "number", "connectivity"]);
        assert_eq!(metrics.iter().map(|m| m.unit.to_string()).collect::<Vec<_>>(), ["mm^3", "mm", "1/mm", "1/mm^3"]);
        assert_eq!((metrics[1].value, metrics[1].status), (None, Status::NotApplicable));
        assert_eq!((metrics[2].value, metrics[2].warnings.len()), (None, 1));
    }
}
