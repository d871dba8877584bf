//! Plots: a frame with two axes, and the content drawn into it. Not built on plotters, which writes colours into the SVG as
//! attributes, so that a drawing cannot adapt to a dark page or to paper, and does not keep labels apart.

pub mod convergence;
pub mod curve;
pub mod ellipsoid;
pub mod histogram;
pub mod parallel;
pub mod profile;
pub mod scale;
pub mod scatter;
pub mod svg;

use scale::{Scale, Ticks};
use svg::{Anchor, Svg};

/// The width of a phone, so that type keeps its size there.
pub const WIDTH: f64 = 400.0;
const HEIGHT: f64 = 216.0;
const LEFT: f64 = 52.0;
const RIGHT: f64 = 12.0;
const BOTTOM: f64 = 40.0;
const TOP: f64 = 10.0;
/// The height of a line of mark labels.
const LABEL_LINE: f64 = 15.0;

/// The title and the range of an axis.
pub struct AxisOf<'t> {
    pub title: &'t str,
    pub range: [f64; 2],
}

/// A highlighted value on the horizontal axis.
pub struct Mark {
    pub at: f64,
    pub label: String,
    pub class: &'static str,
}

/// A frame to draw into. Marks and hints lie on top of the drawing, regardless of the order of calls.
pub struct Frame {
    pub svg: Svg,
    pub x: Scale,
    pub y: Scale,
    marks: Vec<PlacedMark>,
    hints: Vec<([f64; 2], String)>,
}

/// A mark, the top of its line and the position of its label.
struct PlacedMark {
    class: &'static str,
    x: f64,
    top: f64,
    label_at: [f64; 2],
    label: String,
}

impl Frame {
    pub fn new(x: &AxisOf, y: &AxisOf, marks: Vec<Mark>) -> Frame {
        let inner = [LEFT, WIDTH - RIGHT];
        let x_scale = Scale::new(x.range, inner);
        let (rows, lines) = lines_of_labels(&x_scale, &marks);
        let top = TOP + LABEL_LINE * lines as f64;
        let height = HEIGHT + LABEL_LINE * lines as f64;
        let y_scale = Scale::new(y.range, [height - BOTTOM, top]);
        let mut svg = Svg::new(WIDTH, height);
        rules(&mut svg, &x_scale, &y_scale);
        svg.text("title", Anchor::Middle, [(inner[0] + inner[1]) / 2.0, height - 5.0], x.title);
        svg.upright("title", [12.0, (top + height - BOTTOM) / 2.0], y.title);
        let placed = marks.into_iter().zip(rows).map(|(mark, row)| {
            let (x, base) = (x_scale.within(mark.at), top - 4.0 - LABEL_LINE * row as f64);
            let label_at = [place_of_label(x, &mark.label), base];
            PlacedMark { class: mark.class, x, top: base + 2.0, label_at, label: mark.label }
        });
        Frame { svg, x: x_scale, y: y_scale, marks: placed.collect(), hints: Vec::new() }
    }

    /// Returns the position of a point.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.x.at(x), self.y.within(y)]
    }

    /// Adds a stripe of the frame with a tooltip.
    pub fn hint(&mut self, ends: [f64; 2], says: String) {
        self.hints.push((ends.map(|end| self.x.within(end)), says));
    }

    /// Returns the SVG element; `says` is its text for screen readers.
    pub fn finish(self, says: &str) -> String {
        let Frame { mut svg, y, marks, hints, .. } = self;
        let [bottom, top] = y.places();
        for mark in &marks {
            svg.line(mark.class, [mark.x, bottom], [mark.x, mark.top]);
        }
        for mark in &marks {
            svg.text("mark-label", Anchor::Middle, mark.label_at, &mark.label);
        }
        for ([left, right], says) in &hints {
            svg.rect("hint", [*left, top], [right - left, bottom - top], Some(says));
        }
        svg.finish(says)
    }
}

/// Draws grid lines, axes, ticks and tick labels.
fn rules(svg: &mut Svg, x: &Scale, y: &Scale) {
    let ([left, right], [bottom, _]) = (x.places(), y.places());
    let ticks: Ticks = y.ticks(4);
    for (&value, label) in ticks.values.iter().zip(ticks.labels()) {
        let at = y.at(value);
        svg.line("grid", [left, at], [right, at]);
        svg.text("tick", Anchor::End, [left - 6.0, at + 4.0], &label);
    }
    let ticks = x.ticks(6);
    // Wide labels skip ticks.
    let labels = ticks.labels();
    let room = (right - left) / labels.len().max(1) as f64;
    let widest = labels.iter().map(|label| width_of(label)).fold(0.0, f64::max);
    let every = ((widest + APART) / room).ceil().max(1.0) as usize;
    for (i, (&value, label)) in ticks.values.iter().zip(&labels).enumerate() {
        let at = x.at(value);
        svg.line("axis", [at, bottom], [at, bottom + 4.0]);
        if i % every == 0 {
            svg.text("tick", Anchor::Middle, [at, bottom + 17.0], label);
        }
    }
    svg.line("axis", [left, bottom], [right, bottom]);
}

fn place_of_label(at: f64, label: &str) -> f64 {
    let half = width_of(label) / 2.0;
    at.clamp(LEFT + half - 8.0, (WIDTH - half).max(LEFT + half - 8.0))
}

/// Least distance of labels.
const APART: f64 = 8.0;

/// Returns an upper bound of a label's width: that in DejaVu Sans, the widest of the typefaces in the style sheet.
fn width_of(label: &str) -> f64 {
    const SIZE: f64 = 12.0;
    let width = |letter: char| match letter {
        '.' | ',' | ':' | ';' | ' ' | '\u{a0}' | 'i' | 'j' | 'l' | '\'' => 0.36,
        'm' | 'w' | 'M' | 'W' | '%' | '×' | '−' => 1.0,
        _ => 0.69,
    };
    SIZE * label.chars().map(width).sum::<f64>()
}

/// Returns the line of each mark's label, 0 next to the frame, such that labels do not touch; and the number of lines.
fn lines_of_labels(x: &Scale, marks: &[Mark]) -> (Vec<usize>, usize) {
    let mut order: Vec<usize> = (0..marks.len()).collect();
    order.sort_by(|&a, &b| marks[a].at.total_cmp(&marks[b].at));
    let mut ends: Vec<f64> = Vec::new();
    let mut rows = vec![0; marks.len()];
    for i in order {
        let half = width_of(&marks[i].label) / 2.0;
        let middle = place_of_label(x.within(marks[i].at), &marks[i].label);
        let row = ends.iter().position(|&end| end < middle - half - APART).unwrap_or(ends.len());
        if row == ends.len() {
            ends.push(0.0);
        }
        ends[row] = middle + half;
        rows[i] = row;
    }
    (rows, ends.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_marks_do_not_touch() {
        let mark = |at: f64| Mark { at, label: "median 0.25".to_owned(), class: "mark" };
        let x = Scale::new([0.0, 1.0], [LEFT, WIDTH - RIGHT]);
        let (rows, lines) = lines_of_labels(&x, &[mark(0.5), mark(0.52), mark(0.9), mark(0.51)]);
        assert_eq!((rows, lines), (vec![0, 2, 0, 1], 3));
        assert_eq!(lines_of_labels(&x, &[]), (vec![], 0));
    }
}
