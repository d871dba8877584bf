//! Rounded shapes as implicit solids, near enough to distances, and the smooth minimum that merges them (Quílez' quadratic
//! one): what organic solids are put together from.

use glam::DVec3;

/// The lesser of two distances with the edge between them rounded off over a width.
pub(super) fn smooth_min(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - h * h * width / 4.0
}

/// A solid with another taken out of it, the edge rounded off over a width.
pub(super) fn smooth_difference(solid: f64, tool: f64, width: f64) -> f64 {
    -smooth_min(-solid, tool, width)
}

/// About the distance to a capsule whose radius changes evenly from one end to the other.
pub(super) fn capsule(p: DVec3, a: DVec3, b: DVec3, radius_a: f64, radius_b: f64) -> f64 {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    p.distance(a + t * axis) - (radius_a + t * (radius_b - radius_a))
}

/// About the distance to an ellipsoid about the origin: exact on it and in its direction, near enough elsewhere.
pub(super) fn ellipsoid(p: DVec3, radii: DVec3) -> f64 {
    let k = (p / radii).length();
    let slope = (p / (radii * radii)).length();
    if slope > 0.0 { k * (k - 1.0) / slope } else { -radii.min_element() }
}
