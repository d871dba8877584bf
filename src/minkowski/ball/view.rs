//! Positions and rays in the view along one axis.

use std::ops::Range;

use glam::DVec3;

use crate::fixed::Pixels;
use crate::grid::{Axis, FineBox, Grid};

/// Rays along one axis: column, row and depth in place of x, y and z. Positions are those of the lattice that patches lie on.
#[derive(Clone, Debug)]
pub struct View {
    pub axis: Axis,
    /// The columns and the rows of the rays.
    pub columns: Range<i32>,
    pub rows: Range<i32>,
    /// The nodes along the rays.
    pub nodes: Pixels,
    /// What is added to a depth for the lattice of the nodes.
    pub nodes_by: i32,
    /// Length of the lattice along the rays, in steps.
    pub length: f64,
    /// The position of ray 0.
    first: i32,
    per_step: f64,
}

impl View {
    /// Returns all rays of a grid.
    pub fn new(grid: &Grid, axis: Axis) -> View {
        let (columns, rows) = grid.image_size(axis);
        View::of(grid, axis, [0..columns, 0..rows], (Pixels::new(grid.shift()), 0))
    }

    /// Returns the rays through a box of finer pixels of a grid, numbered on the finer raster.
    pub fn in_box(grid: &Grid, axis: Axis, fine: &FineBox) -> View {
        let through = [axis.column(), axis.row()].map(|i| fine.pixels()[i].clone());
        View::of(grid, axis, through, (Pixels::new(fine.grid().shift()), fine.refined_by()))
    }

    fn of(grid: &Grid, axis: Axis, through: [Range<u32>; 2], (nodes, nodes_by): (Pixels, i32)) -> View {
        let [columns, rows] = through.map(|range| range.start as i32..range.end as i32);
        let length = f64::from(grid.length(axis.depth()));
        let (first, per_step) = (nodes.first - nodes_by, 1.0 / f64::from(1u32 << nodes.shift));
        View { axis, columns, rows, nodes, nodes_by, length, first, per_step }
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
        f64::from((index << self.nodes.shift) + self.first)
    }

    /// Returns the columns whose rays lie between two lattice positions.
    #[inline]
    pub fn columns(&self, low: f64, high: f64) -> Range<i32> {
        self.between(low, high, &self.columns)
    }

    /// Returns the rows whose rays lie between two lattice positions.
    #[inline]
    pub fn rows(&self, low: f64, high: f64) -> Range<i32> {
        self.between(low, high, &self.rows)
    }

    #[inline]
    fn between(&self, low: f64, high: f64, all: &Range<i32>) -> Range<i32> {
        let first = f64::from(self.first);
        let place =
            |position: f64| ((position - first) * self.per_step).clamp(f64::from(all.start - 1), f64::from(all.end));
        let (low, high) = (place(low), place(high));
        // Both are at least −1, and conversion truncates.
        let start = low as i32 + i32::from(f64::from(low as i32) < low);
        let end = (high + 1.0) as i32;
        start.max(all.start)..end.min(all.end)
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
