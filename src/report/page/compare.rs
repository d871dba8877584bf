//! The page that compares two designs.

use askama::Template;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::plot::{curve, histogram, profile};
use super::report::Figure;
use super::slices::{self, Shown};
use super::summary::{Entry, address};
use super::table::{GROUPS, finite, is_open, named};
use super::verdict::Strip;
use super::{FOOT, STYLE, words};
use crate::report::id::Group;
use crate::report::quantity::{Quantity, Unit};
use crate::report::scaffold_report::{Metric, ScaffoldReport};

#[derive(Template)]
#[template(path = "compare.html", config = "src/report/askama.toml")]
struct Page<'s> {
    style: &'static str,
    foot: &'static str,
    designs: Vec<Design<'s>>,
    groups: Vec<GroupTable>,
    pictures: Vec<Picture>,
    /// Title and drawing of the colour bar.
    colour_bar: Option<(String, String)>,
    figures: Vec<Figure>,
    /// True if plots are left out because the designs have different units.
    apart: bool,
}

struct Design<'s> {
    letter: &'static str,
    title: &'s str,
    link: String,
    strip: Strip,
    view: Option<String>,
    facts: String,
}

struct GroupTable {
    name: &'static str,
    open: bool,
    rows: Vec<Row>,
}

struct Row {
    /// HTML.
    symbol: String,
    name: &'static str,
    values: [String; 2],
    bounds: [Option<String>; 2],
    unit: String,
    difference: String,
    percent: String,
    /// True if the bounds of A and B do not overlap.
    apart: bool,
}

struct Picture {
    caption: String,
    drawings: Vec<(&'static str, String, String)>,
}

const LETTERS: [&str; 2] = ["A", "B"];

/// Returns the page; differences are those of B from A.
pub fn html(a: &Entry, b: &Entry) -> String {
    let reports = [a.report, b.report];
    let length = Quantity::Length(1).of(a.report.unit);
    let same_unit = a.report.unit == b.report.unit;
    let page = Page {
        style: STYLE,
        foot: FOOT,
        designs: LETTERS.into_iter().zip([a, b]).map(|(letter, entry)| design(letter, entry)).collect(),
        groups: GROUPS.into_iter().map(|group| table(reports, group)).filter(|table| !table.rows.is_empty()).collect(),
        pictures: if same_unit { pictures(reports, &length) } else { Vec::new() },
        colour_bar: thicknesses(reports).filter(|_| same_unit).map(|range| {
            let title = format!("Thickness ({})", length.for_people());
            (title, slices::colour_bar(Shown::Solid, range, &length))
        }),
        figures: if same_unit { figures(reports, &length) } else { Vec::new() },
        apart: !same_unit,
    };
    super::rendered(&page)
}

fn design<'s>(letter: &'static str, entry: &'s Entry) -> Design<'s> {
    let report = entry.report;
    let length = Quantity::Length(1).of(report.unit);
    Design {
        letter,
        title: &report.title,
        link: address(&entry.link),
        strip: Strip::of(report.verdict.as_ref()),
        view: report.pictures.view.as_ref().map(|png| format!("data:image/png;base64,{}", STANDARD.encode(png))),
        facts: format!(
            "pitch {}, edges: {}, region: {}",
            words::with_unit(report.provenance.pitch, &length),
            report.provenance.edges,
            report.provenance.region
        ),
    }
}

fn table([a, b]: [&ScaffoldReport; 2], group: Group) -> GroupTable {
    let in_a =
        a.metrics.iter().filter(|metric| metric.group == group).map(|metric| (Some(metric), b.metric(metric.id)));
    let only_b = b.metrics.iter().filter(|metric| metric.group == group && a.metric(metric.id).is_none());
    let pairs = in_a.chain(only_b.map(|metric| (None, Some(metric))));
    GroupTable { name: named(group).0, open: is_open(group), rows: pairs.filter_map(|(a, b)| row(a, b)).collect() }
}

/// Returns the row of a metric; differences are in the unit of A, if both units are known.
fn row(a: Option<&Metric>, b: Option<&Metric>) -> Option<Row> {
    let shown = a.or(b)?;
    let unit = shown.unit;
    let factor = b.and_then(|b| b.unit.factor_to(&unit));
    let text = |metric: Option<&Metric>| match metric.and_then(|metric| Some((metric, finite(metric.value)?))) {
        Some((metric, value)) if metric.unit == unit => words::with_error(value, metric.error, &unit),
        // In the metric's own unit.
        Some((metric, value)) => words::with_unit(value, &metric.unit),
        None => words::NOTHING.to_owned(),
    };
    let ends = |metric: Option<&Metric>| -> Option<String> {
        metric.and_then(|metric| words::bounds(finite(metric.lower), finite(metric.upper), &metric.unit))
    };
    let value = |metric: Option<&Metric>| metric.and_then(|metric| finite(metric.value));
    let difference = match (value(a), value(b), factor) {
        (Some(a), Some(b), Some(factor)) => {
            let b = b * factor;
            let change = b - a;
            // A change within rounding counts as 0.
            let is_rounding = change.abs() <= 1e-9 * a.abs().max(b.abs());
            Some((if is_rounding { 0.0 } else { change }, a))
        }
        _ => None,
    };
    let apart = match (a, b, factor) {
        (Some(a), Some(b), Some(factor)) => {
            let beyond =
                |low: Option<f64>, high: Option<f64>| matches!((low, high), (Some(low), Some(high)) if low > high);
            beyond(b.lower.map(|v| v * factor), a.upper) || beyond(a.lower, b.upper.map(|v| v * factor))
        }
        _ => false,
    };
    Some(Row {
        symbol: words::symbol(shown.symbol),
        name: shown.name,
        values: [text(a), text(b)],
        bounds: [ends(a), ends(b)],
        unit: unit.for_people(),
        difference: difference
            .map_or(words::NOTHING.to_owned(), |(change, _)| signed(words::value(change, &unit), change)),
        percent: match difference {
            Some((change, a)) if a != 0.0 => {
                let percent = 100.0 * change / a.abs();
                signed(words::significant(percent, 3), percent) + "\u{a0}%"
            }
            _ => words::NOTHING.to_owned(),
        },
        apart,
    })
}

fn signed(text: String, value: f64) -> String {
    if value > 0.0 { format!("+{text}") } else { text }
}

/// Returns the range of thickness that the colours of both designs cover.
fn thicknesses(reports: [&ScaffoldReport; 2]) -> Option<[f64; 2]> {
    slices::range(reports.into_iter().flat_map(|report| &report.pictures.slices), Shown::Solid)
}

/// Returns slices of both designs across the same axes, in the same colours.
fn pictures(reports: [&ScaffoldReport; 2], length: &Unit) -> Vec<Picture> {
    let Some(range) = thicknesses(reports) else { return Vec::new() };
    let of_axis = |axis: &str| {
        let drawings: Vec<_> = LETTERS
            .into_iter()
            .zip(reports)
            .filter_map(|(letter, report)| {
                let slice = report.pictures.slices.iter().find(|slice| slice.across == axis)?;
                let drawing = slices::drawing(slice, Shown::Solid, range, length);
                Some((letter, drawing, slices::finding(slice, Shown::Solid, length)))
            })
            .collect();
        Picture { caption: format!("Slices across {axis}"), drawings }
    };
    ["x", "y", "z"].into_iter().map(of_axis).filter(|picture| !picture.drawings.is_empty()).collect()
}

/// Returns plots of both designs in one frame each, where both have the data.
fn figures([a, b]: [&ScaffoldReport; 2], length: &Unit) -> Vec<Figure> {
    let mut figures = Vec::new();
    for in_a in &a.histograms {
        let Some(in_b) = b.histograms.iter().find(|plot| plot.id == in_a.id) else { continue };
        figures.push(Figure {
            title: in_a.title.clone(),
            drawing: histogram::histograms([in_a, in_b]),
            finding: format!("A: {} B: {}", histogram::finding(in_a), histogram::finding(in_b)),
            reading: in_a.reading,
        });
    }
    if let (Some(in_a), Some(in_b)) = (&a.access, &b.access) {
        figures.push(Figure {
            title: "Interconnectivity A(d)".to_owned(),
            drawing: curve::accesses([in_a, in_b], length),
            finding: format!("A: {} B: {}", curve::finding(in_a, length), curve::finding(in_b, length)),
            reading: "The curve further right lets larger balls in; where the two cross, one has wider throats, the other more \
                of its pores behind them.",
        });
    }
    for in_a in &a.profiles {
        let Some(in_b) = b.profiles.iter().find(|profile| profile.axis == in_a.axis) else { continue };
        figures.push(Figure {
            title: format!("Porosity along {}", in_a.axis),
            drawing: profile::profiles([in_a, in_b], length),
            finding: format!("A: {} B: {}", profile::finding(in_a), profile::finding(in_b)),
            reading: "Level curves are graded evenly; a slope that both share comes from the design space rather than from the design.",
        });
    }
    figures
}
