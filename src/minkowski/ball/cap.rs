//! Parts of spheres about vertices.

use std::ops::Range;

use glam::DVec3;

use super::view::{Footprint, View};
use super::{WIDENED, exact};

/// A part of a sphere: the outward normals of a vertex, which make no acute angle with any edge there.
#[derive(Clone, Copy, Debug)]
pub struct Cap {
    pub vertex: [i32; 3],
    /// The first of the unit vectors along edges that bound the cap, and their number.
    pub spokes: (u32, u32),
    /// A box around its unit normals.
    pub least: DVec3,
    pub most: DVec3,
}

/// A cap in one view.
pub struct CapView {
    vertex: [f64; 3],
    radius: f64,
    columns: [f64; 2],
    rows: [f64; 2],
    /// For leaving and for entering crossings, true if the cap may have them.
    sheets: [bool; 2],
}

impl Cap {
    /// Returns the unit normal at a position on the cap.
    pub fn normal(&self, point: DVec3) -> DVec3 {
        (point - exact(self.vertex)).normalize_or_zero()
    }

    /// Projects the cap into one view.
    pub fn seen(&self, view: &View, radius: f64) -> CapView {
        let vertex = view.position(self.vertex);
        let (least, most) = (view.direction(self.least), view.direction(self.most));
        let reach = |i: usize| [radius * least[i] - WIDENED, radius * most[i] + WIDENED];
        let [low, high] = reach(2);
        CapView { vertex, radius, columns: reach(0), rows: reach(1), sheets: [high >= 0.0, low <= 0.0] }
    }
}

impl CapView {
    /// Returns the rows and columns between which it lies.
    pub fn footprint(&self, view: &View) -> Footprint {
        let [[left, right], [low, high]] = [self.columns, self.rows];
        Footprint {
            columns: view.columns(self.vertex[0] + left, self.vertex[0] + right),
            rows: view.rows(self.vertex[1] + low, self.vertex[1] + high),
        }
    }

    /// Calls `meet` with column, row, depth and winding of each crossing in `rows`. `spokes` are those of the cap.
    pub fn sweep(&self, view: &View, spokes: &[DVec3], rows: Range<i32>, mut meet: impl FnMut(i32, i32, f64, i32)) {
        let squared_radius = self.radius * self.radius;
        for row in rows {
            let v = view.ray(row) - self.vertex[1];
            let half = squared_radius - v * v;
            if half < 0.0 {
                continue;
            }
            let half_width = half.sqrt() + 1.0;
            let (left, right) = (self.columns[0].max(-half_width), self.columns[1].min(half_width));
            for column in view.columns(self.vertex[0] + left, self.vertex[0] + right) {
                let u = view.ray(column) - self.vertex[0];
                let squared = half - u * u;
                if squared < 0.0 {
                    continue;
                }
                let k = squared.sqrt();
                for (height, winding) in [(k, -1), (-k, 1)] {
                    let is_seen = self.sheets[usize::from(winding > 0)];
                    let in_cone = |spoke: &DVec3| {
                        let [a, b, c] = view.direction(*spoke);
                        u * a + v * b + height * c <= WIDENED
                    };
                    if is_seen && spokes.iter().all(in_cone) {
                        meet(column, row, self.vertex[2] + height, winding);
                    }
                }
            }
        }
    }
}
