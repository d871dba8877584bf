//! Coplanar faces of two bodies, whose area the displacement counts not at all, once or twice.
//!
//! Where a face of each body lies at the same place, the displacement puts one behind the other, and both may bound the
//! displaced result although neither bounds the true one, or the reverse. The volume between them is zero, but the area is
//! not.

use glam::{DVec2, DVec3};

use super::Rule;
use super::bodies::Body;
use super::numbers::Numbers;
use super::signs::Plane;

/// A face of each of two bodies that overlap in their common plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coincident {
    pub faces: [u32; 2],
    /// The area in which they overlap, in square lattice steps, rounded.
    pub area: f64,
    /// True if the faces have the same front.
    pub is_parallel: bool,
    /// True if the second is displaced to the front of the first.
    pub second_is_in_front: bool,
}

/// The share of the smaller face below which an overlap is the rounding of a common side.
const LEAST_OVERLAP: f64 = 1e-9;

impl Coincident {
    /// Returns the overlap of faces of two bodies if they are coplanar.
    pub fn of(faces: [u32; 2], f: &Plane, g: &Plane) -> Option<Coincident> {
        let overlap = overlap(f, g)?;
        Some(Coincident {
            faces,
            area: overlap.area,
            is_parallel: overlap.is_parallel,
            second_is_in_front: f.is_in_front(&g.corners[0]),
        })
    }
}

/// The overlap of two coplanar faces.
pub(super) struct Overlap {
    /// In square lattice steps, rounded.
    pub area: f64,
    is_parallel: bool,
}

/// Returns the overlap of two faces if they are coplanar.
pub(super) fn overlap(f: &Plane, g: &Plane) -> Option<Overlap> {
    if !g.contains(&f.corners) {
        return None;
    }
    let normal = f.unit_normal();
    let is_parallel = normal.dot(g.unit_normal()) > 0.0;
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let origin = f.corners[0].at;
    let flat = |point: DVec3| DVec2::new((point - origin).dot(u), (point - origin).dot(v));
    let [a, b, c] = g.positions().map(flat);
    let other = if is_parallel { [a, b, c] } else { [a, c, b] };
    let own = f.positions().map(flat);
    let common = other
        .iter()
        .zip([other[1], other[2], other[0]])
        .fold(own.to_vec(), |polygon, (&from, to)| left_of(&polygon, from, to));
    let found = area(&common);
    (found > LEAST_OVERLAP * area(&own).min(area(&other))).then_some(Overlap { area: found, is_parallel })
}

/// Returns the part of a convex polygon to the left of a line.
fn left_of(polygon: &[DVec2], from: DVec2, to: DVec2) -> Vec<DVec2> {
    let side = |p: DVec2| (to - from).perp_dot(p - from);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (s, t) = (side(p), side(q));
        if s >= 0.0 {
            kept.push(p);
        }
        if s * t < 0.0 {
            kept.push(p + s / (s - t) * (q - p));
        }
    }
    kept
}

fn area(polygon: &[DVec2]) -> f64 {
    (2..polygon.len()).map(|i| 0.5 * (polygon[i - 1] - polygon[0]).perp_dot(polygon[i] - polygon[0])).sum()
}

/// Returns the area of the true result less that of the displaced one, where the faces of two bodies coincide.
/// The numbers of both bodies on either side must be proved.
pub(super) fn area_change<'p>(
    pairs: impl Iterator<Item = &'p Coincident>,
    bodies: [&Body; 2],
    rule: &Rule,
    solids: usize,
) -> f64 {
    let mut numbers = Numbers::of(rule, solids);
    let mut holds = |behind: [bool; 2]| {
        numbers.set(&[]);
        for (body, behind) in bodies.iter().zip(behind) {
            numbers.add(body.solid, body.front + i32::from(behind));
        }
        numbers.holds()
    };
    let change = |pair: &Coincident| {
        // From behind the first face to its front.
        let (start, end) = ([true, pair.is_parallel], [false, !pair.is_parallel]);
        let between = if pair.second_is_in_front { [end[0], start[1]] } else { [start[0], end[1]] };
        let [a, b, c] = [start, between, end].map(&mut holds);
        pair.area * (f64::from(a != c) - f64::from(a != b) - f64::from(b != c))
    };
    pairs.map(change).sum()
}
