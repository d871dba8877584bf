//! Positions and rays in the view along one axis.

use std::ops::Range;

use glam::DVec3;

use crate::fixed::Pixels;
use crate::grid::{Axis, Grid};

/// The rays of a grid along one axis: column, row and depth in place of x, y and z.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub axis: Axis,
    pixels: Pixels,
    per_step: f64,
    columns: i32,
    rows: i32,
}

impl View {
    pub fn new(grid: &Grid, axis: Axis) -> View {
        let (columns, rows) = grid.image_size(axis);
        let per_step = 1.0 / f64::from(1u32 << grid.shift());
        let pixels = Pixels::new(grid.shift());
        View { axis, pixels, per_step, columns: columns as i32, rows: rows as i32 }
    }

    /// Converts a lattice position.
    #[inline]
    pub fn position(&self, p: [i32; 3]) -> [f64; 3] {
        [p[self.axis.column()], p[self.axis.row()], p[self.axis.depth()]].map(f64::from)
    }

    /// Converts a direction.
    #[inline]
    pub fn direction(&self, d: DVec3) -> [f64; 3] {
        let d = d.to_array();
        [d[self.axis.column()], d[self.axis.row()], d[self.axis.depth()]]
    }

    /// Returns the lattice position of a column or row.
    #[inline]
    pub fn ray(&self, index: i32) -> f64 {
        f64::from(self.pixels.ray(index))
    }

    /// Returns the columns whose rays lie between two lattice positions.
    #[inline]
    pub fn columns(&self, low: f64, high: f64) -> Range<i32> {
        self.between(low, high, self.columns)
    }

    /// Returns the rows whose rays lie between two lattice positions.
    #[inline]
    pub fn rows(&self, low: f64, high: f64) -> Range<i32> {
        self.between(low, high, self.rows)
    }

    #[inline]
    fn between(&self, low: f64, high: f64, count: i32) -> Range<i32> {
        let first = f64::from(self.pixels.first);
        let place = |position: f64| ((position - first) * self.per_step).clamp(-1.0, f64::from(count));
        let (low, high) = (place(low), place(high));
        // Both are above −2, and conversion truncates.
        let start = low as i32 + i32::from(f64::from(low as i32) < low);
        let end = (high + 1.0) as i32;
        start.max(0)..end.min(count)
    }
}

/// Rows and columns that a patch may meet.
#[derive(Clone, Debug)]
pub struct Footprint {
    pub columns: Range<i32>,
    pub rows: Range<i32>,
}

impl Footprint {
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty() || self.rows.is_empty()
    }
}
