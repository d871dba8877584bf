//! The access curve: the share of the pores that a ball reaches from outside, by its diameter.

use super::{AxisOf, Frame, Mark};
use crate::report::page::words;
use crate::report::quantity::Unit;
use crate::report::scaffold_report::AccessCurve;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Draws the curve of one solid, with the largest balls that pass along the axes.
pub fn access(curve: &AccessCurve, length: &Unit) -> String {
    let mut frame = frame(&[curve], length, marks(curve, length));
    let points: Vec<_> = curve.points.iter().map(|&[d, share]| frame.at([d, 100.0 * share])).collect();
    let floor = frame.y.places()[0];
    if let (Some(first), Some(last)) = (points.first(), points.last()) {
        let closed = points.iter().copied().chain([[last[0], floor], [first[0], floor]]);
        frame.svg.polygon("area pore", closed);
    }
    frame.svg.polyline("series pore", points.iter().copied());
    for (i, &[d, share]) in curve.points.iter().enumerate() {
        let ends = [i.saturating_sub(1), (i + 1).min(curve.points.len() - 1)].map(|j| (curve.points[j][0] + d) / 2.0);
        frame.hint(ends, says(d, share, length));
    }
    frame.finish(&finding(curve, length))
}

/// Draws the curves of two solids.
pub fn accesses(curves: [&AccessCurve; 2], length: &Unit) -> String {
    let mut frame = frame(&curves, length, Vec::new());
    for (curve, class) in curves.into_iter().zip(["series a", "series b"]) {
        let points: Vec<_> = curve.points.iter().map(|&[d, share]| frame.at([d, 100.0 * share])).collect();
        frame.svg.polyline(class, points);
    }
    frame.finish(&format!("A: {} B: {}", finding(curves[0], length), finding(curves[1], length)))
}

/// Summarises the curve in a sentence.
pub fn finding(curve: &AccessCurve, length: &Unit) -> String {
    let open = curve.points.first().map_or(0.0, |&[_, share]| share);
    let half = curve.points.iter().take_while(|&&[_, share]| share >= 0.5).last();
    let mut text = format!("{}\u{a0}% of the pore volume is open", words::significant(100.0 * open, 3));
    if let Some(&[d, _]) = half {
        text += &format!("; half of it is reached by balls of up to {}", words::with_unit(d, length));
    }
    let through: Vec<String> = AXES
        .into_iter()
        .zip(curve.percolation)
        .map(|(axis, d)| match d {
            Some(d) if d.is_finite() => format!("{axis} {}", words::with_unit(d, length)),
            _ => format!("{axis} none"),
        })
        .collect();
    format!("{text}; the largest ball that passes through: {}.", through.join(", "))
}

fn says(d: f64, share: f64, length: &Unit) -> String {
    format!("{}: {}\u{a0}%", words::with_unit(d, length), words::significant(100.0 * share, 3))
}

fn frame(curves: &[&AccessCurve], length: &Unit, marks: Vec<Mark>) -> Frame {
    let last = |curve: &&AccessCurve| curve.points.last().map_or(0.0, |&[d, _]| d);
    let widest = curves.iter().map(last).chain(marks.iter().map(|mark| mark.at)).fold(0.0, f64::max);
    Frame::new(
        &AxisOf { title: &format!("Diameter of the ball ({})", length.for_people()), range: [0.0, 1.03 * widest] },
        &AxisOf { title: "Reached from outside (%)", range: [0.0, 100.0] },
        marks,
    )
}

/// Returns the percolation marks; axes whose printed values agree share one.
fn marks(curve: &AccessCurve, length: &Unit) -> Vec<Mark> {
    let mut marks: Vec<(String, String, f64)> = Vec::new();
    for (axis, d) in AXES.into_iter().zip(curve.percolation) {
        let Some(d) = d.filter(|d| d.is_finite()) else { continue };
        let text = words::value(d, length);
        match marks.iter_mut().find(|(_, same, _)| *same == text) {
            Some((axes, _, _)) => *axes += &format!(", {axis}"),
            None => marks.push((axis.to_owned(), text, d)),
        }
    }
    let mark =
        |(axes, text, at): (String, String, f64)| Mark { at, label: format!("{axes}: {text}"), class: "mark mean" };
    marks.into_iter().map(mark).collect()
}
