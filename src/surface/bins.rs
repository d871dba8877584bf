//! Bins of space, by which boxes far from some others are left out.

use glam::DVec3;

use crate::box_tree::Box32;

/// The number of bins along each axis.
const SIDE: usize = 128;

/// The bins of a box, each marked if a box was added that touches it.
pub struct Bins {
    least: DVec3,
    per_length: DVec3,
    /// The bins along x, row by row and plane by plane.
    rows: Vec<u128>,
}

impl Bins {
    /// Divides a box.
    pub fn new(whole: &Box32) -> Bins {
        let [least, greatest] = whole.corners();
        Bins { least, per_length: SIDE as f64 / (greatest - least), rows: vec![0; SIDE * SIDE] }
    }

    /// Marks the bins that a box touches.
    pub fn add(&mut self, extent: &Box32) {
        let (mask, rows) = self.place(extent);
        rows.for_each(|row| self.rows[row] |= mask);
    }

    /// Returns whether a box touches a marked bin, as each does that touches an added one.
    pub fn may_touch(&self, extent: &Box32) -> bool {
        let (mask, mut rows) = self.place(extent);
        rows.any(|row| self.rows[row] & mask != 0)
    }

    /// Returns the bins along x, and the rows, that a box touches. What lies outside counts for the bins at the border.
    fn place(&self, extent: &Box32) -> (u128, impl Iterator<Item = usize> + use<>) {
        let bins =
            |corner: DVec3| ((corner - self.least) * self.per_length).to_array().map(|at| (at as usize).min(SIDE - 1));
        let [[x, y, z], [end_x, end_y, end_z]] = extent.corners().map(bins);
        let mask = u128::MAX << x & u128::MAX >> (SIDE - 1 - end_x);
        (mask, (z..=end_z).flat_map(move |z| (y..=end_y).map(move |y| z * SIDE + y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn no_box_that_touches_another_is_left_out() {
        let mut random = Random::new(5);
        let whole = Box32::around([DVec3::new(-1.0, 0.0, -8.0), DVec3::new(3.0, 2.0, 8.0)]);
        // Also with sides of no length, and beyond the whole; at multiples of a bin, so that many merely touch.
        let mut around = |size: f64| {
            let mut vector = || DVec3::from_array([0; 3].map(|_| random.share()));
            let (from, along) = (2.0 * vector() - 1.5, size * (vector() - 0.3).max(DVec3::ZERO));
            let [from, to] = [from, from + along].map(|at| (32.0 * at).round() / 32.0);
            Box32::around([from, to])
        };
        let (mut touching, mut left_out) = (0, 0);
        for _ in 0..200 {
            let added: Vec<Box32> = (0..5).map(|_| around(1.5)).collect();
            let mut bins = Bins::new(&whole);
            assert!(!added.iter().any(|one| bins.may_touch(one)));
            added.iter().for_each(|one| bins.add(one));
            for _ in 0..20 {
                let other = around(1.0);
                let touches = added.iter().any(|one| one.touches(&other));
                assert!(!touches || bins.may_touch(&other), "{added:?} {other:?}");
                touching += usize::from(touches);
                left_out += usize::from(!bins.may_touch(&other));
            }
        }
        assert!(touching > 100 && left_out > 1000, "{touching} {left_out}");
    }

    #[test]
    fn a_box_without_length_has_bins() {
        let flat = Box32::around([DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0)]);
        let mut bins = Bins::new(&flat);
        bins.add(&Box32::around([DVec3::new(0.2, 0.2, 0.0)]));
        assert!(bins.may_touch(&flat) && !bins.may_touch(&Box32::around([DVec3::new(0.8, 0.2, 0.0)])));
        assert!(!bins.may_touch(&Box32::EMPTY));
    }
}
