//! Parts of cylinders about convex edges.
//!
//! Across an edge with unit direction d, a ray along the unit vector z has the frame c ∥ z × d and g = (z − (z·d) d) / s, where
//! s is the sine of the angle between them. The ray passes the edge's line at a distance h along c, and meets the cylinder of
//! radius r at the normals (h c ± k g) / r, k = √(r² − h²), leaving with the upper sign. On either sheet h is monotonic in the
//! normal's angle, so that a range of normals is a range of h.

use std::ops::Range;

use glam::DVec3;

use super::view::{Footprint, View};
use super::{LEAST_WIDENED, WIDENED, exact};

/// A part of a cylinder about an edge.
#[derive(Clone, Copy, Debug)]
pub struct Tube {
    pub start: [i32; 3],
    /// The unit vector along the edge, and the edge's length.
    pub direction: DVec3,
    pub length: f64,
    /// The unit normals at its borders, less than half a turn apart.
    pub borders: [DVec3; 2],
}

/// A tube in one view.
pub struct TubeView {
    start: [f64; 3],
    radius: f64,
    /// d along the depth.
    along: f64,
    /// The sine s.
    slant: f64,
    /// d in the plane of the view over s; c is at right angles to it.
    forward: [f64; 2],
    /// Length of the edge in the plane of the view.
    length: f64,
    widened: f64,
    sheets: [Option<Sheet>; 2],
}

/// The part of a tube where rays leave it, or where they enter it.
struct Sheet {
    /// +1 where rays leave.
    side: f64,
    /// Least and greatest h.
    across: [f64; 2],
    /// The least and the greatest position along `forward`, with zero at the edge's start.
    forward: [f64; 2],
}

impl Tube {
    /// Returns the unit normal at a position on the tube.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        let from = point - exact(self.start);
        (from - self.direction * self.direction.dot(from)).normalize_or_zero()
    }

    /// Projects the tube into one view; `None` where it is parallel to the rays.
    pub fn seen(&self, view: &View, radius: f64) -> Option<TubeView> {
        let direction = view.direction(self.direction);
        let slant = direction[0].hypot(direction[1]);
        if slant == 0.0 {
            return None;
        }
        let forward = [direction[0] / slant, direction[1] / slant];
        let mut seen = TubeView {
            start: view.position(self.start),
            radius,
            along: direction[2],
            slant,
            forward,
            length: self.length * slant,
            widened: (WIDENED * slant).max(LEAST_WIDENED),
            sheets: [None, None],
        };
        // h and k at the borders.
        let borders = self.borders.map(|normal| {
            let normal = view.direction(normal);
            [radius * (forward[0] * normal[1] - forward[1] * normal[0]), radius * normal[2] / slant]
        });
        seen.sheets = [1.0, -1.0].map(|side| seen.sheet(side, borders));
        Some(seen)
    }
}

impl TubeView {
    fn sheet(&self, side: f64, borders: [[f64; 2]; 2]) -> Option<Sheet> {
        let [[h0, k0], [h1, k1]] = borders.map(|[h, k]| [h, side * k]);
        if k0 <= 0.0 && k1 <= 0.0 {
            return None;
        }
        // Where the normals change to the other sheet, the ray touches the cylinder.
        let turn = self.radius.copysign(h0 * k1.abs() + h1 * k0.abs());
        let end = |h: f64, k: f64| if k < 0.0 { [turn, 0.0] } else { [h, k] };
        let ([h0, k0], [h1, k1]) = (end(h0, k0), end(h1, k1));
        let across = [h0.min(h1) - WIDENED, h0.max(h1) + WIDENED];
        let highest = if across[0] <= 0.0 && across[1] >= 0.0 { self.radius } else { k0.max(k1) };
        let shifts = [k0.min(k1), highest].map(|k| -side * k * self.along);
        let (least, most) = (shifts[0].min(shifts[1]), shifts[0].max(shifts[1]));
        Some(Sheet { side, across, forward: [least - WIDENED, self.length + most + WIDENED] })
    }

    /// Returns the rows and columns between which both sheets lie.
    pub fn footprint(&self, view: &View) -> Footprint {
        let (mut columns, mut rows) = (0..0, 0..0);
        let join = |all: &mut Range<i32>, one: Range<i32>| match all.start < all.end {
            false => *all = one,
            true => *all = all.start.min(one.start)..all.end.max(one.end),
        };
        for sheet in self.sheets.iter().flatten() {
            let [left, right] = self.bounds(sheet, 0);
            let [low, high] = self.bounds(sheet, 1);
            let of_sheet = Footprint { columns: view.columns(left, right), rows: view.rows(low, high) };
            if !of_sheet.is_empty() {
                join(&mut columns, of_sheet.columns);
                join(&mut rows, of_sheet.rows);
            }
        }
        Footprint { columns, rows }
    }

    /// Returns c in the plane of the view.
    fn sideways(&self) -> [f64; 2] {
        [-self.forward[1], self.forward[0]]
    }

    /// Returns the least and the greatest position of a sheet along columns or rows.
    fn bounds(&self, sheet: &Sheet, i: usize) -> [f64; 2] {
        let ends = |range: [f64; 2], by: f64| (range[0] * by, range[1] * by);
        let (a, b) = (ends(sheet.across, self.sideways()[i]), ends(sheet.forward, self.forward[i]));
        [self.start[i] + a.0.min(a.1) + b.0.min(b.1), self.start[i] + a.0.max(a.1) + b.0.max(b.1)]
    }

    /// Calls `meet` with column, row, depth and winding of each crossing in `rows`.
    pub fn sweep(&self, view: &View, rows: Range<i32>, mut meet: impl FnMut(i32, i32, f64, i32)) {
        for sheet in self.sheets.iter().flatten() {
            let [left, right] = self.bounds(sheet, 0);
            let [low, high] = self.bounds(sheet, 1);
            let of_sheet = view.rows(low, high);
            for row in rows.start.max(of_sheet.start)..rows.end.min(of_sheet.end) {
                self.sweep_row(sheet, view, row, [left - self.start[0], right - self.start[0]], &mut meet);
            }
        }
    }

    #[inline]
    fn sweep_row(
        &self,
        sheet: &Sheet,
        view: &View,
        row: i32,
        [mut left, mut right]: [f64; 2],
        meet: &mut impl FnMut(i32, i32, f64, i32),
    ) {
        let (forward, sideways) = (self.forward, self.sideways());
        let v = view.ray(row) - self.start[1];
        for (range, [by_column, by_row]) in [(sheet.across, sideways), (sheet.forward, forward)] {
            // Nearly level strips give no bound that could be calculated accurately.
            if by_column.abs() > 1e-6 {
                let ends = range.map(|end| (end - v * by_row) / by_column);
                left = left.max(ends[0].min(ends[1]));
                right = right.min(ends[0].max(ends[1]));
            }
        }
        for column in view.columns(self.start[0] + left, self.start[0] + right) {
            let u = view.ray(column) - self.start[0];
            let h = u * sideways[0] + v * sideways[1];
            let squared = (self.radius - h) * (self.radius + h);
            if h < sheet.across[0] || h > sheet.across[1] || squared < 0.0 {
                continue;
            }
            let k = sheet.side * squared.sqrt();
            let along = u * forward[0] + v * forward[1] + k * self.along;
            if along >= -self.widened && along <= self.length + self.widened {
                let along = along.clamp(0.0, self.length) / self.slant;
                meet(column, row, self.start[2] + (along * self.along + k * self.slant), -(sheet.side as i32));
            }
        }
    }
}
