//! Turns and lines of three positions, decided exactly in the whole range of floating-point numbers.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// Returns whether three positions lie on one line, exactly.
pub(super) fn are_collinear([a, b, c]: [DVec3; 3]) -> bool {
    if ![a, b, c].iter().all(|p| p.is_finite()) {
        return false;
    }
    let (u, v) = (b - a, c - a);
    let products = (DVec3::new(u.y * v.z, u.z * v.x, u.x * v.y), DVec3::new(u.z * v.y, u.x * v.z, u.y * v.x));
    let bound = (products.0.abs() + products.1.abs()) * (8.0 * f64::EPSILON) + DVec3::splat(1e-290);
    if (products.0 - products.1).abs().cmpgt(bound).any() {
        return false;
    }
    let flat = |axes: fn(DVec3) -> DVec2| orientation(axes(a), axes(b), axes(c)) == 0.0;
    flat(|p| DVec2::new(p.x, p.y)) && flat(|p| DVec2::new(p.y, p.z)) && flat(|p| DVec2::new(p.z, p.x))
}

/// Returns a number with the sign of the turn from a by b to c: positive to the left, zero if and only if they are on
/// one line.
///
/// Exact for finite coordinates unless those along one axis differ in magnitude by a factor of more than 2⁴⁰⁰.
pub(super) fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    // Collinearity does not change when an axis is scaled. Powers of two that bring the largest coordinate near 2⁴⁵⁰
    // leave room for the products and for their rounding errors.
    let scale = |largest: f64| {
        let exponent = (largest.to_bits() >> 52) as i64 - 1023;
        let half = |shift: i64| f64::from_bits(((1023 + shift) as u64) << 52);
        let shift = 450 - exponent;
        (half(shift / 2), half(shift - shift / 2))
    };
    let (x1, x2) = scale(a.x.abs().max(b.x.abs()).max(c.x.abs()));
    let (y1, y2) = scale(a.y.abs().max(b.y.abs()).max(c.y.abs()));
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x * x1 * x2, y: p.y * y1 * y2 });
    orient2d(a, b, c)
}
