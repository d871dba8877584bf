//! The designs that no other dominates: the Pareto front of objectives.

use std::cmp::Ordering::Equal;

use serde_json::{Map, Value};

use super::row::Row;
use crate::report::id::{self, MetricId};
use crate::report::limits::metric_named;
use crate::report::measure::unmeasured;

/// The better direction of a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Larger values.
    Max,
    /// Smaller values.
    Min,
}

/// A metric that designs are compared by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Objective {
    /// The metric.
    pub metric: MetricId,
    /// The better direction.
    pub direction: Direction,
}

impl Objective {
    /// Returns the trade of scaffolds: open space against walls that can be printed.
    fn defaults() -> Vec<Objective> {
        [id::POROSITY, id::WALL_THINNEST].map(|metric| Objective { metric, direction: Direction::Max }).to_vec()
    }

    /// Reads objectives: names of metrics, and `max` or `min`. Without any, those are porosity and thinnest wall, the larger the
    /// better.
    ///
    /// # Errors
    /// A name that no metric has, and another word; the text names the nearest metrics.
    pub fn read(words: &Map<String, Value>) -> Result<Vec<Objective>, String> {
        if words.is_empty() {
            return Ok(Objective::defaults());
        }
        let mut objectives: Vec<Objective> = Vec::new();
        for (name, word) in flat("", words) {
            let metrics = unmeasured(None);
            let found = metric_named(&name, &metrics).map_err(|problem| format!("pareto: {problem}"))?.id;
            let metric = id::all().find(|metric| metric.id == found).expect("metrics are those of the catalogue");
            if objectives.iter().any(|objective| objective.metric == metric) {
                return Err(format!("pareto: {} is named twice", metric.id));
            }
            let direction = match word.as_str() {
                Some("max") => Direction::Max,
                Some("min") => Direction::Min,
                _ => return Err(format!("pareto: {name} is {word}, but must be max or min")),
            };
            objectives.push(Objective { metric, direction });
        }
        Ok(objectives)
    }

    /// Returns the value of a design, turned such that smaller is better; `None` if the raster does not resolve it.
    fn cost(&self, row: &Row) -> Option<f64> {
        let value = row.value(self.metric.id).filter(|_| row.is_resolved(self.metric.id))?;
        Some(if self.direction == Direction::Max { -value } else { value })
    }
}

/// Returns the names and words of a table, and of the tables in it: `wall.thinnest` leads into one.
fn flat<'w>(path: &str, words: &'w Map<String, Value>) -> Vec<(String, &'w Value)> {
    let entries = |(name, word): (&String, &'w Value)| {
        let name = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
        match word {
            Value::Object(inner) => flat(&name, inner),
            word => vec![(name, word)],
        }
    };
    words.iter().flat_map(entries).collect()
}

/// Returns the number of designs that would take part in the front if the raster resolved all objectives.
pub fn unresolved(rows: &[Row], objectives: &[Objective]) -> usize {
    let takes_part = |row: &&Row| !row.is_failed() && row.passed != Some(false);
    let has_none = |row: &&Row| objectives.iter().any(|objective| objective.cost(row).is_none());
    rows.iter().filter(takes_part).filter(has_none).count()
}

/// Returns the places of the designs that no other dominates: none is at least as good in all objectives and better in one. Designs
/// that break a limit, or lack a value of an objective that the raster resolves, take no part.
pub fn front(rows: &[Row], objectives: &[Objective]) -> Vec<usize> {
    let costs = |row: &Row| objectives.iter().map(|objective| objective.cost(row)).collect::<Option<Vec<f64>>>();
    let judged = rows.iter().enumerate().filter(|(_, row)| row.passed != Some(false));
    let mut candidates: Vec<(Vec<f64>, usize)> = judged.filter_map(|(i, row)| Some((costs(row)?, i))).collect();
    // A design is dominated only by one that comes before it in this order, and then by one of the front.
    candidates
        .sort_by(|(a, _), (b, _)| a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|o| o.is_ne()).unwrap_or(Equal));
    let dominates = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a <= b) && a != b;
    let mut front: Vec<(Vec<f64>, usize)> = Vec::new();
    for (costs, i) in candidates {
        if !front.iter().any(|(other, _)| dominates(other, &costs)) {
            front.push((costs, i));
        }
    }
    let mut places: Vec<usize> = front.into_iter().map(|(_, i)| i).collect();
    places.sort_unstable();
    places
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::report::scaffold_report::Status;
    use crate::report::sweep::row::Cell;

    /// Returns the row of a design with a porosity and a thinnest wall.
    fn row(porosity: Option<f64>, wall: f64, passed: Option<bool>) -> Row {
        let cell = |value| Cell { value, lower: None, upper: None, status: Status::Measured };
        let metrics = [("porosity", cell(porosity)), ("wall.thinnest", cell(Some(wall)))];
        Row {
            design: String::new(),
            plan: Map::new(),
            parameters: Map::new(),
            error: None,
            passed,
            length_unit: None,
            version: String::new(),
            warnings: Vec::new(),
            metrics: BTreeMap::from(metrics.map(|(id, cell)| (id.to_owned(), cell))),
        }
    }

    #[test]
    fn a_design_that_no_other_beats_is_on_the_front() {
        let rows = [
            row(Some(0.5), 0.3, None),
            row(Some(0.6), 0.2, Some(true)),
            row(Some(0.5), 0.2, None),
            row(None, 9.0, None),
            row(Some(0.9), 0.9, Some(false)),
            row(Some(0.5), 0.3, None),
        ];
        let mut rows = rows.to_vec();
        rows.push(row(Some(0.7), 0.7, None));
        rows[6].metrics.get_mut("wall.thinnest").unwrap().status = Status::NotResolved;
        assert_eq!(unresolved(&rows, &Objective::defaults()), 2);
        assert_eq!(front(&rows, &Objective::defaults()), [0, 1, 5]);
        let least: Map<String, Value> = serde_json::from_str(r#"{"porosity": "min"}"#).unwrap();
        assert_eq!(
            front(&rows, &Objective::read(&least).unwrap()),
            [0, 2, 5],
            "the metric that is asked for is resolved"
        );
    }

    #[test]
    fn the_front_is_that_of_all_comparisons() {
        let mut random = crate::testing::random::Random::new(7);
        for _ in 0..50 {
            let mut share = || (random.share() * 6.0).round() / 6.0;
            let rows: Vec<Row> = (0..40).map(|_| row(Some(share()), share(), None)).collect();
            let of = |i: usize| [rows[i].value("porosity").unwrap(), rows[i].value("wall.thinnest").unwrap()];
            let dominates = |a: [f64; 2], b: [f64; 2]| a[0] >= b[0] && a[1] >= b[1] && a != b;
            let best: Vec<usize> = (0..40).filter(|&i| !(0..40).any(|j| dominates(of(j), of(i)))).collect();
            assert_eq!(front(&rows, &Objective::defaults()), best);
        }
    }
}
