//! The plot of a convergence study: differences of metrics over the pitch or the size of the region.

use super::svg::Anchor;
use super::{AxisOf, Frame};
use crate::report::page::words;
use crate::report::quantity::Unit;
use crate::report::scaffold_report::{Convergence, ConvergenceSeries, Varied};

/// The space for the number of a curve.
const NUMBER: f64 = 14.0;

/// Number of classes of series in the style sheet.
pub const SERIES: usize = 6;

/// Draws differences from the last value in percent, over the pitch or the size of the region; `None` if no metric has two
/// known values.
pub fn convergence(study: &Convergence, length: &Unit) -> Option<String> {
    let curves: Vec<(usize, Vec<[f64; 2]>)> = study
        .series
        .iter()
        .enumerate()
        .map(|(i, series)| (i, changes(study, series)))
        .filter(|(_, c)| c.len() > 1)
        .collect();
    let largest = curves.iter().flat_map(|(_, curve)| curve).map(|[_, change]| change.abs()).fold(0.0, f64::max);
    if curves.is_empty() {
        return None;
    }
    let widest = study.at.iter().copied().fold(0.0, f64::max);
    let title = match study.over {
        Varied::Pitch => format!("Pitch ({})", length.for_people()),
        Varied::Region => "Side of the region (% of the whole)".to_owned(),
    };
    let scale = scale(study.over);
    let reach = |sign: f64| {
        let furthest = curves.iter().flat_map(|(_, curve)| curve).map(|[_, change]| sign * change).fold(0.0, f64::max);
        // All-zero curves still need a frame; the margin leaves space for the numbers of the curves.
        if largest > 0.0 { sign * (furthest + 0.15 * largest) } else { sign }
    };
    let mut frame = Frame::new(
        &AxisOf { title: &title, range: [0.0, scale * widest * 1.04] },
        &AxisOf { title: "Difference from the last (%)", range: [reach(-1.0), reach(1.0)] },
        Vec::new(),
    );
    let [left, right] = frame.x.places();
    let zero = frame.y.at(0.0);
    frame.svg.line("axis", [left, zero], [right, zero]);
    let mut numbers: Vec<[f64; 2]> = Vec::new();
    for (i, curve) in curves {
        let class = i % SERIES;
        let places: Vec<_> = curve.iter().map(|&[at, change]| frame.at([scale * at, change])).collect();
        frame.svg.polyline(&format!("series s{class}"), places.iter().copied());
        for (place, [at, change]) in places.iter().zip(&curve) {
            let says = format!(
                "{} at {}: {}\u{a0}%",
                study.series[i].metric.id,
                words::significant(scale * at, 3),
                words::significant(*change, 2)
            );
            frame.svg.circle(&format!("dot s{class}"), *place, 3.5, Some(&says));
        }
        // Numbers identify the curves without colour.
        if let Some(&[x, y]) = places.first() {
            // A number that would overlap another one moves left.
            let near = |x: f64, other: &[f64; 2]| (other[0] - x).abs() < NUMBER && (other[1] - y).abs() < NUMBER;
            let mut x = x;
            while numbers.iter().any(|other| near(x, other)) {
                x -= NUMBER;
            }
            numbers.push([x, y]);
            frame.svg.text("mark-label", Anchor::Middle, [x, y - 7.0], &(i + 1).to_string());
        }
    }
    Some(
        frame.finish(&format!(
            "The largest difference from the last value is {}\u{a0}%.",
            words::significant(largest, 2)
        )),
    )
}

/// Returns the factor of values on the horizontal axis.
fn scale(over: Varied) -> f64 {
    match over {
        Varied::Pitch => 1.0,
        Varied::Region => 100.0,
    }
}

/// Returns the varied quantity, and the difference of the metric from its last value in percent, for each known value.
fn changes(study: &Convergence, series: &ConvergenceSeries) -> Vec<[f64; 2]> {
    let Some(last) = series.values.last().copied().flatten().filter(|last| last.is_finite() && *last != 0.0) else {
        return Vec::new();
    };
    let known = study.at.iter().zip(&series.values).filter_map(|(&at, value)| value.map(|value| [at, value]));
    known.filter(|[_, value]| value.is_finite()).map(|[at, value]| [at, 100.0 * (value - last) / last.abs()]).collect()
}

/// Returns the difference of the last value from the one before, in percent.
pub fn last_change(study: &Convergence, series: &ConvergenceSeries) -> Option<f64> {
    match changes(study, series).as_slice() {
        [.., [_, before], _] => Some(-before),
        _ => None,
    }
}
