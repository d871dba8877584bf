//! Rounded shapes as implicit solids, approximately distance functions, and the smooth minimum that blends them
//! (Quílez' quadratic one): the building blocks of organic solids.

use glam::DVec3;

/// Returns the smaller of two distances, with the edge between them rounded over a width.
pub(super) fn smooth_min(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - h * h * width / 4.0
}

/// Returns a solid minus another, with the edge rounded over a width.
pub(super) fn smooth_difference(solid: f64, tool: f64, width: f64) -> f64 {
    -smooth_min(-solid, tool, width)
}

/// Returns the approximate distance to a capsule whose radius changes linearly from one end to the other.
pub(super) fn capsule(p: DVec3, a: DVec3, b: DVec3, radius_a: f64, radius_b: f64) -> f64 {
    let axis = b - a;
    let t = ((p - a).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    p.distance(a + t * axis) - (radius_a + t * (radius_b - radius_a))
}

/// Returns the approximate distance to an ellipsoid about the origin: exact on it and in its gradient there.
pub(super) fn ellipsoid(p: DVec3, radii: DVec3) -> f64 {
    let k = (p / radii).length();
    let slope = (p / (radii * radii)).length();
    if slope > 0.0 { k * (k - 1.0) / slope } else { -radii.min_element() }
}
