//! The share of the pores that balls reach, by their diameter.

use crate::parallel::*;

use crate::bits::ones;
use crate::metrics::NodeSet;

/// Number of diameters at which the curve is tabulated.
const STEPS: usize = 512;

/// A(d): the share of the pores' volume that a ball of diameter d reaches from outside and covers.
///
/// It is exact at 0 and at equal steps up to the largest finite access size, and is monotonically non-increasing.
#[derive(Clone, Debug, PartialEq)]
pub struct AccessCurve {
    step: f64,
    shares: Vec<f64>,
}

impl AccessCurve {
    /// Computes the curve from the access sizes of nodes, which are diameters, each times `scale` (the pitch, for world units).
    /// `open` are the pores' nodes that are connected with the outside: A(0) is their share, and the rest of `pores` counts as
    /// unreachable whatever its size. `None` without pores.
    ///
    /// # Panics
    /// If there is not a size for each node, or the sets are of rasters of different sizes.
    pub fn of(sizes: &[f32], open: &NodeSet, pores: &NodeSet, scale: f64) -> Option<AccessCurve> {
        assert_eq!(sizes.len(), pores.volume(), "an access size for each node");
        let total = pores.count();
        if total == 0 {
            return None;
        }
        let open = open.and(pores);
        let [width, height, depth] = open.size();
        // The sizes of the open nodes of a row.
        let row = |row: usize| {
            let sizes = &sizes[row * width..(row + 1) * width];
            ones(open.row(row % height, row / height)).map(|x| sizes[x])
        };
        let rows = || (0..depth * height).into_par_iter().with_min_len(64);
        let finite = rows().map(|y| row(y).filter(|size| size.is_finite()).fold(0.0, f32::max));
        let largest = f64::from(finite.reduce(|| 0.0, f32::max));
        let step = if largest > 0.0 { largest / (STEPS - 1) as f64 } else { 1.0 };
        // Number of nodes that reach each step and no further.
        let count = |mut counts: Vec<u64>, y: usize| {
            row(y).for_each(|size| counts[((f64::from(size) / step) as usize).min(STEPS - 1)] += 1);
            counts
        };
        let none = || vec![0u64; STEPS];
        let add = |a: Vec<u64>, b: Vec<u64>| a.iter().zip(b).map(|(a, b)| a + b).collect();
        let counts = rows().fold(none, count).reduce(none, add);
        let mut reached = 0;
        let mut shares: Vec<f64> = counts
            .iter()
            .rev()
            .map(|count| {
                reached += count;
                reached as f64 / total as f64
            })
            .collect();
        shares.reverse();
        Some(AccessCurve { step: step * scale, shares })
    }

    /// Returns the open share of the pores: A(0).
    pub fn open_share(&self) -> f64 {
        self.shares[0]
    }

    /// Returns diameters and shares, from d = 0 to the largest access size.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.shares.iter().enumerate().map(|(i, &share)| (i as f64 * self.step, share))
    }

    /// Returns A(d) at any diameter: linearly interpolated between two steps, 0 above the largest.
    pub fn share(&self, diameter: f64) -> f64 {
        let at = (diameter / self.step).max(0.0);
        let low = at.floor() as usize;
        match (self.shares.get(low), self.shares.get(low + 1)) {
            (Some(here), Some(next)) => here + (next - here) * (at - low as f64),
            (Some(&last), None) if at == low as f64 => last,
            _ => 0.0,
        }
    }
}
