//! Cells: boxes that are halved along their longest side.

use glam::DVec3;

/// A box with corners that are exact `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub min: DVec3,
    pub max: DVec3,
}

/// Relative error bound of [`Cell::volume`]: three differences and two products are rounded.
const VOLUME_ROUNDING: f64 = 8.0 * f64::EPSILON;

impl Cell {
    /// Returns the sides, each rounded once.
    pub fn sides(&self) -> DVec3 {
        self.max - self.min
    }

    pub fn longest_side(&self) -> f64 {
        self.sides().max_element()
    }

    /// Returns the volume and a bound of its rounding error.
    pub fn volume(&self) -> (f64, f64) {
        let volume = self.sides().element_product();
        (volume, VOLUME_ROUNDING * volume)
    }

    /// Returns the halves across the longest side, or nothing where `f64` has no number between its ends.
    pub fn halves(&self) -> Option<[Cell; 2]> {
        let sides = self.sides().to_array();
        let longest = (1..3).fold(0, |best, axis| if sides[axis] > sides[best] { axis } else { best });
        let (low, high) = (self.min[longest], self.max[longest]);
        let middle = low + 0.5 * (high - low);
        if !(low < middle && middle < high) {
            return None;
        }
        let mut halves = [*self; 2];
        halves[0].max[longest] = middle;
        halves[1].min[longest] = middle;
        Some(halves)
    }
}
