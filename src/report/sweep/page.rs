//! The page on a sweep: the designs that no other dominates, all designs in parallel coordinates, and a sortable table.

use askama::Template;
use serde_json::Value;

use super::front::{Direction, Objective, unresolved};
use super::row::{Row, length_unit, named, shown};
use crate::mesh::LengthUnit;
use crate::report::id::{self, MetricId, Statistic};
use crate::report::page::plot::parallel::{ParallelAxis, ParallelLine, parallel};
use crate::report::page::plot::scatter::{Point, scatter};
use crate::report::page::sortable::{Cell, Column};
use crate::report::page::{FOOT, SORT, STYLE, rendered, words};
use crate::report::quantity::Unit;

/// The metrics of table and axes beside the objectives, each shown if any design has a value.
const SHOWN: [MetricId; 7] = [
    id::POROSITY,
    id::PERCOLATION,
    id::SOLID_THICKNESS.of(Statistic::Mean),
    id::WALL_THINNEST,
    id::PORE_THICKNESS.of(Statistic::Mean),
    id::SURFACE_SPECIFIC,
    id::OVERHANG,
];

/// The most designs in table and drawings; sweep.csv has all of them.
const MOST_ROWS: usize = 2000;

/// The most designs of the front that are listed.
const MOST_OF_FRONT: usize = 100;

/// The most texts along an axis.
const MOST_TEXTS: usize = 16;

/// The most designs without metrics that are listed.
const MOST_FAILURES: usize = 100;

#[derive(Template)]
#[template(path = "sweep.html", config = "src/report/askama.toml")]
struct Page<'s> {
    style: &'static str,
    sort: &'static str,
    foot: &'static str,
    title: &'s str,
    headline: String,
    state: &'static str,
    /// The parameters that all designs share, and what they are measured by.
    fixed: String,
    objectives: String,
    fronts: Vec<String>,
    front: Vec<String>,
    front_left_out: usize,
    /// The designs that take no part in the front because of the raster.
    unresolved: usize,
    parallel: Option<String>,
    parameters: Vec<Parameter<'s>>,
    columns: Vec<Column>,
    rows: Vec<Line>,
    left_out: usize,
    judged: bool,
    failures: Vec<(String, &'s str)>,
    failures_left_out: usize,
}

struct Parameter<'s> {
    name: &'s str,
    /// How its column is sorted: `number` or `text`.
    order: &'static str,
}

struct Line {
    number: usize,
    /// The values of the parameters that differ.
    parameters: Vec<Cell>,
    /// The state and the word of the limits.
    verdict: [&'static str; 2],
    is_front: bool,
    /// The number of warnings, and their texts.
    warnings: (usize, String),
    cells: Vec<Cell>,
}

/// The rows of a sweep and what is shown of them.
struct Designs<'s> {
    rows: &'s [Row],
    /// The places of the designs on the front, rising.
    front: &'s [usize],
    /// The places of the designs that are drawn and listed: the front, and others in the order of the plan.
    shown: Vec<usize>,
    /// The parameters that differ.
    parameters: Vec<&'s str>,
    metrics: Vec<MetricId>,
    length: Option<LengthUnit>,
    objectives: &'s [Objective],
}

/// Returns the page, which loads nothing from elsewhere; `front` is that of the rows and objectives.
pub fn html(title: &str, rows: &[Row], objectives: &[Objective], front: &[usize]) -> String {
    let designs = Designs::of(rows, objectives, front);
    let measured = rows.iter().filter(|row| !row.is_failed()).count();
    let judged = rows.iter().any(|row| row.passed.is_some());
    let kept = rows.iter().filter(|row| row.passed == Some(true)).count();
    let (state, headline) = match (judged, kept) {
        (false, _) => ("none", format!("{measured} of {} designs were measured; no limits were given", rows.len())),
        (true, 0) => ("broken", format!("None of {measured} measured designs keeps its limits")),
        (true, kept) => ("kept", format!("{kept} of {measured} measured designs keep their limits")),
    };
    let failures: Vec<(String, &str)> =
        rows.iter().enumerate().filter_map(|(i, row)| Some((designs.name(i), row.error.as_deref()?))).collect();
    let list = |words: Vec<String>| words.join(" · ");
    let page = Page {
        style: STYLE,
        sort: SORT,
        foot: FOOT,
        title,
        headline,
        state,
        fixed: list(designs.fixed()),
        objectives: objectives.iter().map(wanted).collect::<Vec<_>>().join(", "),
        fronts: designs.fronts(),
        front: designs.front.iter().take(MOST_OF_FRONT).map(|&i| designs.sentence(i)).collect(),
        unresolved: unresolved(rows, objectives),
        front_left_out: designs.front.len().saturating_sub(MOST_OF_FRONT),
        parallel: designs.parallel(),
        columns: designs.metrics.iter().map(|&metric| designs.column(metric)).collect(),
        rows: designs.shown.iter().map(|&i| designs.line(i)).collect(),
        left_out: measured.saturating_sub(MOST_ROWS),
        judged,
        failures_left_out: failures.len().saturating_sub(MOST_FAILURES),
        failures: failures.into_iter().take(MOST_FAILURES).collect(),
        parameters: designs.parameters.iter().map(|name| designs.parameter(name)).collect(),
    };
    rendered(&page)
}

/// Returns an objective in words: `large porosity`.
fn wanted(objective: &Objective) -> String {
    let word = match objective.direction {
        Direction::Max => "large",
        Direction::Min => "small",
    };
    format!("{word} {}", in_words(short(objective.metric)))
}

/// Returns a name within a sentence.
fn in_words(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}

impl<'s> Designs<'s> {
    fn of(rows: &'s [Row], objectives: &'s [Objective], front: &'s [usize]) -> Designs<'s> {
        let all: Vec<&str> =
            rows.first().map(|row| row.parameters.keys().map(String::as_str).collect()).unwrap_or_default();
        let differs = |name: &&str| rows.iter().any(|row| row.parameters[*name] != rows[0].parameters[*name]);
        let mut metrics: Vec<MetricId> = objectives.iter().map(|objective| objective.metric).collect();
        metrics.extend(SHOWN.into_iter().filter(|id| !objectives.iter().any(|objective| objective.metric == *id)));
        metrics.retain(|id| rows.iter().any(|row| row.value(id.id).is_some()));
        let others = (0..rows.len()).filter(|i| front.binary_search(i).is_err() && !rows[*i].is_failed());
        let mut shown: Vec<usize> = front.iter().copied().chain(others).take(MOST_ROWS).collect();
        shown.sort_unstable();
        Designs {
            rows,
            front,
            shown,
            parameters: all.into_iter().filter(differs).collect(),
            metrics,
            length: length_unit(rows),
            objectives,
        }
    }

    fn is_front(&self, i: usize) -> bool {
        self.front.binary_search(&i).is_ok()
    }

    fn unit(&self, metric: MetricId) -> Unit {
        metric.quantity.of(self.length)
    }

    /// Returns the parameters that all designs share, and what they are measured by.
    fn fixed(&self) -> Vec<String> {
        let Some(first) = self.rows.first() else { return Vec::new() };
        let shared = first.parameters.iter().filter(|(name, _)| !self.parameters.contains(&name.as_str()));
        let facts = first.plan.iter().filter(|(name, _)| !["model", "make"].contains(&name.as_str()));
        let facts = facts.flat_map(|(name, fact)| match fact {
            Value::Object(settings) => settings.iter().collect(),
            fact => vec![(name, fact)],
        });
        shared.chain(facts).map(|parameter| named([parameter])).collect()
    }

    /// Returns the name of a design: its number and the parameters that differ.
    fn name(&self, i: usize) -> String {
        let all = &self.rows[i].parameters;
        let parameters = named(all.iter().filter(|(name, _)| self.parameters.contains(&name.as_str())));
        format!("Design {}{}{parameters}", i + 1, if parameters.is_empty() { "" } else { ": " })
    }

    /// Returns a design with its values of the objectives.
    fn sentence(&self, i: usize) -> String {
        let value = |objective: &Objective| {
            let (metric, value) = (objective.metric, self.rows[i].value(objective.metric.id)?);
            Some(format!("{} {}", in_words(short(metric)), words::with_unit(value, &self.unit(metric))))
        };
        format!("{}; {}", self.name(i), self.objectives.iter().filter_map(value).collect::<Vec<_>>().join(", "))
    }

    /// Returns the style of a design's point or line.
    fn class(&self, i: usize) -> &'static str {
        match (self.is_front(i), self.rows[i].passed) {
            (true, _) => "design best",
            (false, Some(false)) => "design breaks",
            (false, _) => "design",
        }
    }

    /// Returns the places of the shown designs in the order in which they are drawn: the front on top.
    fn by_importance(&self) -> Vec<usize> {
        let mut places = self.shown.clone();
        places.sort_by_key(|&i| (self.is_front(i), self.rows[i].passed != Some(false)));
        places
    }

    /// Draws each pair of objectives.
    fn fronts(&self) -> Vec<String> {
        let pairs = (0..self.objectives.len()).flat_map(|a| (a + 1..self.objectives.len()).map(move |b| [a, b]));
        pairs.filter_map(|pair| self.scatter(pair.map(|i| self.objectives[i].metric))).collect()
    }

    fn scatter(&self, metrics: [MetricId; 2]) -> Option<String> {
        let at = |i: usize| {
            let [x, y] =
                metrics.map(|metric| Some(self.rows[i].value(metric.id)? * self.unit(metric).scale_for_people()));
            Some([x?, y?])
        };
        let point = |i: usize| Some(Point { at: at(i)?, class: self.class(i), says: self.sentence(i) });
        let points: Vec<Point> = self.by_importance().into_iter().filter_map(point).collect();
        // Through more than two objectives, the front is no line.
        let line: Vec<[f64; 2]> = match self.objectives.len() {
            2 => self.shown.iter().filter(|&&i| self.is_front(i)).filter_map(|&i| at(i)).collect(),
            _ => Vec::new(),
        };
        let titles = metrics.map(|metric| titled(short(metric), &self.unit(metric).for_people()));
        let says = format!("{} against {} of {} designs", titles[1], titles[0], points.len());
        (!points.is_empty()).then(|| scatter([&titles[0], &titles[1]], &points, &line, &says))
    }

    /// Draws the parameters that differ and the metrics of all designs.
    fn parallel(&self) -> Option<String> {
        let places = self.by_importance();
        let mut axes: Vec<ParallelAxis> =
            self.parameters.iter().map(|name| self.parameter_axis(name, &places)).collect();
        axes.extend(self.metrics.iter().map(|&metric| self.metric_axis(metric, &places)));
        let lines: Vec<ParallelLine> =
            places.iter().map(|&i| ParallelLine { class: self.class(i), says: self.sentence(i) }).collect();
        let says = format!("{} designs along {} axes", lines.len(), axes.len());
        (axes.len() > 1 && !lines.is_empty()).then(|| parallel(&axes, &lines, &says))
    }

    /// Returns the axis of a parameter: numbers, or texts one above the other in the order of the plan.
    fn parameter_axis(&self, name: &str, places: &[usize]) -> ParallelAxis {
        let of = |i: usize| &self.rows[i].parameters[name];
        let (title, unit) = (name.to_owned(), String::new());
        if let Some(numbers) = places.iter().map(|&i| of(i).as_f64()).collect::<Option<Vec<f64>>>() {
            let values: Vec<Option<f64>> = numbers.into_iter().map(Some).collect();
            let ticks = ends(&values, |value| words::significant(value, 4));
            return ParallelAxis { title, unit, values, ticks };
        }
        let mut texts: Vec<String> = Vec::new();
        for &i in &self.shown {
            let text = shown(of(i));
            if !texts.contains(&text) {
                texts.push(text);
            }
        }
        let place = |text: String| texts.iter().position(|known| *known == text).map(|place| place as f64);
        let values = places.iter().map(|&i| place(shown(of(i)))).collect();
        let every = texts.len().div_ceil(MOST_TEXTS);
        let ticks = texts.iter().enumerate().step_by(every).map(|(i, text)| (i as f64, text.clone())).collect();
        ParallelAxis { title, unit, values, ticks }
    }

    fn metric_axis(&self, metric: MetricId, places: &[usize]) -> ParallelAxis {
        let unit = self.unit(metric);
        let values: Vec<Option<f64>> = places.iter().map(|&i| self.rows[i].value(metric.id)).collect();
        let ticks = ends(&values, |value| words::value(value, &unit));
        ParallelAxis { title: short(metric).to_owned(), unit: unit.for_people(), values, ticks }
    }

    fn parameter(&self, name: &'s str) -> Parameter<'s> {
        let are_numbers = self.rows.iter().all(|row| row.parameters[name].is_number());
        Parameter { name, order: if are_numbers { "number" } else { "text" } }
    }

    fn column(&self, metric: MetricId) -> Column {
        Column::of(metric, self.unit(metric).for_people())
    }

    fn line(&self, i: usize) -> Line {
        let row = &self.rows[i];
        let cell = |metric: &MetricId| match row.value(metric.id) {
            Some(value) => {
                let doubt = if row.is_resolved(metric.id) { "" } else { "\u{a0}▲" };
                Cell { text: words::value(value, &self.unit(*metric)) + doubt, key: Cell::key(value) }
            }
            None => Cell::nothing(),
        };
        Line {
            number: i + 1,
            parameters: self.parameters.iter().map(|name| parameter_cell(&row.parameters[*name])).collect(),
            verdict: match row.passed {
                Some(true) => ["kept", "kept"],
                Some(false) => ["broken", "broken"],
                None => ["none", words::NOTHING],
            },
            is_front: self.is_front(i),
            warnings: (
                row.warnings.len(),
                row.warnings.iter().map(|[_, message]| message.as_str()).collect::<Vec<_>>().join("\n"),
            ),
            cells: self.metrics.iter().map(cell).collect(),
        }
    }
}

/// Returns the name of a metric for an axis: without what stands in brackets.
fn short(metric: MetricId) -> &'static str {
    metric.name.split(" (").next().unwrap_or_default()
}

fn parameter_cell(value: &Value) -> Cell {
    let text = shown(value);
    Cell { key: value.as_f64().map_or_else(|| text.clone(), Cell::key), text }
}

/// Returns a title with its unit: `Porosity (%)`.
fn titled(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} ({unit})") }
}

/// Returns the least and the greatest value with their texts; one if they are equal.
fn ends(values: &[Option<f64>], text: impl Fn(f64) -> String) -> Vec<(f64, String)> {
    let mut ends: Vec<f64> = values.iter().flatten().copied().collect();
    ends.sort_by(f64::total_cmp);
    let mut ends: Vec<f64> = [ends.first(), ends.last()].into_iter().flatten().copied().collect();
    ends.dedup();
    ends.into_iter().map(|value| (value, text(value))).collect()
}
