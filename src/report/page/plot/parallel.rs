//! Parallel coordinates: an upright axis for each quantity, and a line across all of them for each design.

use super::scale::Scale;
use super::svg::{Anchor, Svg};
use super::width_of;

/// An axis.
pub struct ParallelAxis {
    /// The quantity.
    pub title: String,
    /// Its unit; empty for numbers.
    pub unit: String,
    /// The value of each line.
    pub values: Vec<Option<f64>>,
    /// The texts along the axis and their values, from the bottom.
    pub ticks: Vec<(f64, String)>,
}

/// A line.
pub struct ParallelLine {
    /// Its style.
    pub class: &'static str,
    /// Its tooltip.
    pub says: String,
}

const HEIGHT: f64 = 280.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 16.0;
/// Between titles.
const APART: f64 = 14.0;
/// Between axes, at least.
const STEP: f64 = 92.0;

/// Draws the axes and lines, later lines on top. A line is interrupted where it has no value. `says` is the text for screen
/// readers.
pub fn parallel(axes: &[ParallelAxis], lines: &[ParallelLine], says: &str) -> String {
    let wide = |axis: &ParallelAxis| {
        let texts = [&axis.title, &axis.unit].into_iter().chain(axis.ticks.iter().map(|(_, text)| text));
        texts.map(|text| width_of(text)).fold(STEP - APART, f64::max) + APART
    };
    let widths: Vec<f64> = axes.iter().map(wide).collect();
    let places: Vec<f64> = (0..axes.len()).map(|i| widths[..i].iter().sum::<f64>() + widths[i] / 2.0).collect();
    let mut svg = Svg::new(widths.iter().sum(), HEIGHT);
    let scales: Vec<Scale> = axes.iter().map(|axis| Scale::new(range(axis), [HEIGHT - BOTTOM, TOP])).collect();
    for &x in &places {
        svg.line("axis", [x, HEIGHT - BOTTOM], [x, TOP]);
    }
    for (i, line) in lines.iter().enumerate() {
        let points =
            axes.iter().enumerate().map(|(k, axis)| axis.values[i].map(|value| [places[k], scales[k].at(value)]));
        let points: Vec<Option<[f64; 2]>> = points.collect();
        for run in points.split(Option::is_none).filter(|run| run.len() > 1) {
            svg.polyline_that_says(line.class, run.iter().copied().flatten(), &line.says);
        }
    }
    for ((axis, scale), &x) in axes.iter().zip(&scales).zip(&places) {
        svg.text("mark-label", Anchor::Middle, [x, 14.0], &axis.title);
        svg.text("title", Anchor::Middle, [x, 29.0], &axis.unit);
        for (value, text) in &axis.ticks {
            let y = scale.at(*value);
            svg.line("axis", [x - 3.0, y], [x + 3.0, y]);
            svg.text("mark-label", Anchor::Middle, [x, y + if y < HEIGHT / 2.0 { -4.0 } else { 13.0 }], text);
        }
    }
    svg.finish(says)
}

/// Returns the least and greatest value of an axis.
fn range(axis: &ParallelAxis) -> [f64; 2] {
    let all = axis.values.iter().flatten().copied().chain(axis.ticks.iter().map(|(value, _)| *value));
    let [low, high] =
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    if low <= high { [low, high] } else { [0.0, 1.0] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_interrupted_where_it_has_no_value() {
        let axis = |values: [Option<f64>; 2]| ParallelAxis {
            title: "porosity".to_owned(),
            unit: "%".to_owned(),
            values: values.to_vec(),
            ticks: Vec::new(),
        };
        let some = [Some(1.0), Some(2.0)];
        let axes = [axis(some), axis(some), axis([None, Some(1.0)]), axis(some), axis(some)];
        let line = |says: &str| ParallelLine { class: "design", says: says.to_owned() };
        let drawn = parallel(&axes, &[line("first"), line("second")], "");
        assert_eq!((drawn.matches("first").count(), drawn.matches("second").count()), (2, 1));
    }
}
