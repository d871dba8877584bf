//! Facets, shifted along their normals.

use std::ops::Range;

use glam::DVec3;

use super::view::{Footprint, View};
use super::{LEAST_WIDENED, WIDENED, difference};
use crate::grid::Axis;

/// Returns the unit normal of a triangle, zero where it has no area, and its least height. The cross product is an exact
/// integer, so that its components have the right signs, and are zero where they should be.
pub fn normal_and_height(a: [i32; 3], b: [i32; 3], c: [i32; 3]) -> (DVec3, f64) {
    let to = |p: [i32; 3]| -> [i64; 3] { std::array::from_fn(|i| i64::from(p[i]) - i64::from(a[i])) };
    let (u, v) = (to(b), to(c));
    let minor = |i: usize, j: usize| (u[i] * v[j] - u[j] * v[i]) as f64;
    let cross = DVec3::new(minor(1, 2), minor(2, 0), minor(0, 1));
    let longest = [(a, b), (b, c), (c, a)].map(|(from, to)| difference(from, to).length_squared());
    let height = cross.length() / longest.into_iter().fold(1.0, f64::max).sqrt();
    (cross.normalize_or_zero(), height)
}

/// A triangle and its unit normal, not zero.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    pub corners: [[i32; 3]; 3],
    pub normal: DVec3,
}

impl Facet {
    /// Returns the facet seen from its other side.
    pub fn turned(self) -> Facet {
        let [a, b, c] = self.corners;
        Facet { corners: [a, c, b], normal: -self.normal }
    }

    /// Returns the widening of the facet in the plane of the view.
    fn widened(across: f64) -> f64 {
        (WIDENED * across.abs()).max(LEAST_WIDENED)
    }

    /// Returns the rows and columns between which the facet lies.
    pub fn footprint(&self, view: &View, radius: f64) -> Footprint {
        let corners = self.corners.map(|corner| view.position(corner));
        let normal = view.direction(self.normal);
        let bounds = |i: usize| {
            let (low, high) = span(corners.map(|corner| corner[i]));
            (low + radius * normal[i] - WIDENED, high + radius * normal[i] + WIDENED)
        };
        let ((left, right), (low, high)) = (bounds(0), bounds(1));
        // A facet parallel to the rays meets none of them.
        let rows = if normal[2] == 0.0 { 0..0 } else { view.rows(low, high) };
        Footprint { columns: view.columns(left, right), rows }
    }

    /// Calls `meet` with column, row, depth and winding of each crossing in `rows`.
    pub fn sweep(&self, view: &View, radius: f64, rows: Range<i32>, mut meet: impl FnMut(i32, i32, f64, i32)) {
        let [origin, b, c] = self.corners.map(|corner| view.position(corner));
        let normal = view.direction(self.normal);
        // Positions are relative to the first corner, shifted.
        let relative = [origin, b, c].map(|corner| -> [f64; 3] { std::array::from_fn(|i| corner[i] - origin[i]) });
        let shift = normal.map(|n| radius * n);
        let widened = Facet::widened(normal[2]);
        // Along y the view's axes (x, z, y) are left-handed.
        let turns_left = (normal[2] > 0.0) != (view.axis == Axis::Y);
        let sides: [Side; 3] = std::array::from_fn(|k| {
            let (from, to) = (relative[k], relative[(k + 1) % 3]);
            if turns_left { Side::new(from, to, widened) } else { Side::new(to, from, widened) }
        });
        let (left, right) = span(relative.map(|corner| corner[0]));
        let (near, far) = span(relative.map(|corner| corner[2]));
        let slope = [-normal[0] / normal[2], -normal[1] / normal[2]];
        let winding = if normal[2] > 0.0 { -1 } else { 1 };
        for row in rows {
            let v = view.ray(row) - origin[1] - shift[1];
            let (mut low, mut high) = (left - widened, right + widened);
            for side in &sides {
                side.narrow(v, &mut low, &mut high);
            }
            let base = origin[0] + shift[0];
            for column in view.columns(base + low, base + high) {
                let u = view.ray(column) - origin[0] - shift[0];
                let depth = (slope[0] * u + slope[1] * v).clamp(near, far);
                meet(column, row, origin[2] + (shift[2] + depth), winding);
            }
        }
    }
}

/// A side of a triangle in the plane of the view, with the inside to its left, as a bound on columns in each row.
struct Side {
    start: [f64; 2],
    /// Columns per row; undefined for a side within one row, which is no bound.
    slope: f64,
    pad: f64,
    bound: Bound,
}

enum Bound {
    Left,
    Right,
    None,
}

impl Side {
    #[inline]
    fn new(from: [f64; 3], to: [f64; 3], widened: f64) -> Side {
        let (run, rise) = (to[0] - from[0], to[1] - from[1]);
        let per_rise = 1.0 / rise;
        let bound = match rise {
            rise if rise > 0.0 => Bound::Right,
            rise if rise < 0.0 => Bound::Left,
            _ => Bound::None,
        };
        let pad = widened * (run * run + rise * rise).sqrt() * per_rise.abs();
        Side { start: [from[0], from[1]], slope: run * per_rise, pad, bound }
    }

    #[inline]
    fn narrow(&self, v: f64, low: &mut f64, high: &mut f64) {
        let column = self.start[0] + self.slope * (v - self.start[1]);
        match self.bound {
            Bound::Left => *low = low.max(column - self.pad),
            Bound::Right => *high = high.min(column + self.pad),
            Bound::None => {}
        }
    }
}

/// Returns the least and the greatest.
fn span([a, b, c]: [f64; 3]) -> (f64, f64) {
    (a.min(b).min(c), a.max(b).max(c))
}
