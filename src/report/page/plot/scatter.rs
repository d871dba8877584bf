//! Scatter plots: a point for each design, and the line through those that no other dominates.

use super::{AxisOf, Frame};

/// A point.
pub struct Point {
    pub at: [f64; 2],
    /// Its style.
    pub class: &'static str,
    /// Its tooltip.
    pub says: String,
}

/// Draws points, later ones on top, and a line through `front`. `says` is the text for screen readers.
pub fn scatter([x, y]: [&str; 2], points: &[Point], front: &[[f64; 2]], says: &str) -> String {
    let range = |axis: usize| {
        let values = points.iter().map(|point| point.at[axis]);
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        let room = if high > low { 0.06 * (high - low) } else { 0.06 * high.abs().max(1.0) };
        [low - room, high + room]
    };
    let mut frame =
        Frame::new(&AxisOf { title: x, range: range(0) }, &AxisOf { title: y, range: range(1) }, Vec::new());
    let mut line: Vec<[f64; 2]> = front.to_vec();
    line.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let line: Vec<[f64; 2]> = line.into_iter().map(|at| frame.at(at)).collect();
    if line.len() > 1 {
        frame.svg.polyline("series s0", line);
    }
    for point in points {
        let at = frame.at(point.at);
        frame.svg.circle(point.class, at, 4.5, Some(&point.says));
    }
    frame.finish(says)
}
