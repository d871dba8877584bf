//! The ellipsoid of mean intercept lengths: its half axes as bars, and its outlines seen along x, y and z.

use super::WIDTH;
use super::svg::{Anchor, Svg};
use crate::report::page::words;
use crate::report::quantity::Unit;
use crate::report::scaffold_report::Anisotropy;

const AXES: [&str; 3] = ["x", "y", "z"];
const NAMES: [&str; 3] = ["a", "b", "c"];

/// Draws the half axes as bars from 0.
pub fn bars(anisotropy: &Anisotropy, length: &Unit) -> String {
    const ROW: f64 = 34.0;
    let mut svg = Svg::new(WIDTH, 3.0 * ROW + 8.0);
    let longest = anisotropy.lengths.iter().copied().filter(|length| length.is_finite()).fold(0.0, f64::max);
    let room = WIDTH - 30.0 - 110.0;
    for (i, (&value, name)) in anisotropy.lengths.iter().zip(NAMES).enumerate() {
        let top = ROW * i as f64 + 8.0;
        // An infinite axis fills the width.
        let share = if value.is_finite() && longest > 0.0 { value / longest } else { 1.0 };
        svg.text("mark-label", Anchor::Start, [6.0, top + 16.0], name);
        svg.rect("bar solid", [30.0, top], [room * share, ROW - 12.0], Some(&words::with_unit(value, length)));
        svg.text("tick", Anchor::Start, [38.0 + room * share, top + 16.0], &words::with_unit(value, length));
    }
    svg.finish(&finding(anisotropy, length))
}

/// Draws the three outlines; `None` if an axis is infinite.
pub fn outlines(anisotropy: &Anisotropy) -> Option<String> {
    const SIDE: f64 = WIDTH / 3.0;
    if !anisotropy.lengths.iter().all(|length| length.is_finite() && *length > 0.0) {
        return None;
    }
    let longest = anisotropy.lengths.iter().copied().fold(0.0, f64::max);
    let mut svg = Svg::new(WIDTH, SIDE + 22.0);
    for (i, [across, up]) in [[0, 1], [0, 2], [1, 2]].into_iter().enumerate() {
        let centre = [SIDE * (i as f64 + 0.5), SIDE / 2.0];
        let radius = SIDE / 2.0 - 14.0;
        svg.line("grid", [centre[0] - radius - 6.0, centre[1]], [centre[0] + radius + 6.0, centre[1]]);
        svg.line("grid", [centre[0], centre[1] - radius - 6.0], [centre[0], centre[1] + radius + 6.0]);
        svg.circle("circle", centre, radius, None);
        let (half_axes, turned) = projected(anisotropy, across, up);
        // Rows of a drawing go down.
        svg.ellipse(
            "area solid outline",
            centre,
            half_axes.map(|length| length / longest * radius),
            -turned.to_degrees(),
        );
        svg.text("tick", Anchor::End, [centre[0] + radius + 10.0, centre[1] - 4.0], AXES[across]);
        svg.text("tick", Anchor::Start, [centre[0] + 4.0, centre[1] - radius - 2.0], AXES[up]);
        svg.text("tick", Anchor::Middle, [centre[0], SIDE + 16.0], &format!("{}–{}", AXES[across], AXES[up]));
    }
    Some(svg.finish("The ellipsoid of mean intercept lengths seen along z, y and x, each against a circle as large as its longest half axis."))
}

/// Returns the half axes of the projection of the ellipsoid onto a plane of two axes, and the angle from the first axis to the
/// longer one. With Q = Σ l² d dᵀ the projection is {y : yᵀ Q₂⁻¹ y ≤ 1} with the block Q₂ of the two axes.
fn projected(anisotropy: &Anisotropy, across: usize, up: usize) -> ([f64; 2], f64) {
    let sum = |i: usize, j: usize| -> f64 {
        anisotropy.lengths.iter().zip(&anisotropy.directions).map(|(length, d)| length * length * d[i] * d[j]).sum()
    };
    let (p, q, r) = (sum(across, across), sum(across, up), sum(up, up));
    let (middle, spread) = ((p + r) / 2.0, ((p - r) / 2.0).hypot(q));
    let half_axes = [middle + spread, middle - spread].map(|square| square.max(0.0).sqrt());
    (half_axes, 0.5 * (2.0 * q).atan2(p - r))
}

/// Summarises the ellipsoid in a sentence.
pub fn finding(anisotropy: &Anisotropy, length: &Unit) -> String {
    let [a, b, c] = anisotropy.lengths.map(|value| words::with_unit(value, length));
    let degree = words::significant(anisotropy.degree, 3);
    format!("Degree of anisotropy {degree}; half axes a = {a}, b = {b}, c = {c}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadows_are_those_of_the_ellipsoid() {
        let (c, s) = (0.6, 0.8);
        let turned = Anisotropy {
            degree: 0.0,
            lengths: [3.0, 2.0, 1.0],
            directions: [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]],
        };
        let (half_axes, angle) = projected(&turned, 0, 1);
        assert!((half_axes[0] - 3.0).abs() < 1e-12 && (half_axes[1] - 2.0).abs() < 1e-12);
        assert!((angle - s.atan2(c)).abs() < 1e-12);
        let (half_axes, _) = projected(&turned, 0, 2);
        assert!(
            (half_axes[0] - (9.0 * c * c + 4.0 * s * s).sqrt()).abs() < 1e-12 && (half_axes[1] - 1.0).abs() < 1e-12
        );
    }

    #[test]
    fn plates_have_no_outlines() {
        let plates = Anisotropy {
            degree: 1.0,
            lengths: [f64::INFINITY, f64::INFINITY, 1.0],
            directions: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        };
        assert!(outlines(&plates).is_none());
        let text = bars(&plates, &crate::report::quantity::Quantity::Length(1).of(None));
        assert!(text.contains('∞') && !text.contains("inf"));
    }
}
