//! The layout that all backends share: mask words and the division of a depth into voxels.

use std::ops::Range;

use crate::fixed::{Crossing, Pixels};
use crate::grid::{Axis, Grid, LatticeBox};

/// Bits of one mask word. Voxel `z` of a ray is bit `z % 32` of its word `z / 32`.
pub const WORD_BITS: u32 = 32;

/// The division of rays into voxels: a crossing belongs to voxel `min(floor / V, LOD-C − 1)`.
#[derive(Clone, Copy, Debug)]
pub struct Voxels {
    last: u32,
    multiplier: u64,
    shift: u32,
}

impl Voxels {
    /// Returns the voxels of the rays along `axis`.
    pub fn new(grid: &Grid, axis: Axis) -> Voxels {
        // Halves of floors and of V are whole, and below 2^29. For numerators below 2^n, multiplying by
        // ceil(2^(n + l) / V) with l = ceil(log2 V) and shifting by n + l is division by V (Granlund & Montgomery 1994).
        let half_voxel = grid.voxel(axis) / 2;
        let log = half_voxel.next_power_of_two().ilog2();
        let shift = 29 + log;
        Voxels { last: grid.lod() - 1, multiplier: (1u64 << shift).div_ceil(u64::from(half_voxel)), shift }
    }

    /// Returns the voxel of a crossing.
    #[inline]
    pub fn of(&self, crossing: Crossing) -> u32 {
        let voxel = (u64::from(crossing.half_floor()) * self.multiplier) >> self.shift;
        (voxel as u32).min(self.last)
    }

    /// Returns the number of mask words of a ray.
    pub fn words(&self) -> usize {
        (self.last / WORD_BITS) as usize + 1
    }
}

/// The columns and rows of an image whose rays meet the region of a solid.
#[derive(Clone, Debug)]
pub struct Window {
    /// Range of column indices.
    pub columns: Range<i32>,
    /// Range of row indices.
    pub rows: Range<i32>,
}

impl Window {
    /// Returns the rays along `axis` that meet a box.
    pub fn new(grid: &Grid, region: &LatticeBox, axis: Axis) -> Window {
        let pixels = Pixels::new(grid.shift());
        let range = |i: usize| pixels.index_from(region.min[i])..pixels.index_from(region.max[i]);
        Window { columns: range(axis.column()), rows: range(axis.row()) }
    }

    /// Returns the part of the window in some rows.
    pub fn in_rows(self, rows: &Range<u32>) -> Window {
        Window { rows: self.rows.start.max(rows.start as i32)..self.rows.end.min(rows.end as i32), ..self }
    }

    /// Returns the least window with the rays of both.
    #[cfg(feature = "gpu")]
    pub fn around(self, other: Window) -> Window {
        if self.is_empty() {
            return other;
        }
        if other.is_empty() {
            return self;
        }
        let around = |a: Range<i32>, b: Range<i32>| a.start.min(b.start)..a.end.max(b.end);
        Window { columns: around(self.columns, other.columns), rows: around(self.rows, other.rows) }
    }

    /// Returns whether the window has no ray.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty() || self.rows.is_empty()
    }
}
