//! The lattices of a Minkowski sum and of its operands: the same step, and origins that add up.

use super::{Grid, GridError, LATTICE_MAX};
use crate::mesh::Aabb;

/// The grid of A ⊕ B and those on which A and B are quantised.
///
/// A lattice position of A plus one of B is one of the sum. Each operand is rounded relative to its own box, so that
/// the sum depends neither on where the operands lie nor on their order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SumGrid {
    /// The grid of the sum; images lie on it.
    pub sum: Grid,
    /// The grid of the first operand.
    pub a: Grid,
    /// The grid of the second operand.
    pub b: Grid,
}

impl SumGrid {
    /// Returns grids for operands in the given boxes, with the given distance between the rays of the sum, in world
    /// units.
    pub fn with_pitch(a: Aabb, b: Aabb, pitch: f64, lod: u32) -> Result<SumGrid, GridError> {
        let bounds = Aabb { min: a.min + b.min, max: a.max + b.max };
        let around_sum = Grid::with_pitch(bounds, pitch, lod)?;
        // The raster is slightly longer than the box, by the same on both sides; each operand takes half of that.
        let margin = 0.5 * (around_sum.origin() - bounds.min);
        let (origin_a, origin_b) = (a.min + margin, b.min + margin);
        let rays = around_sum.rays();
        // The raster of an operand has room for its margin, and is no longer than that of the sum, which holds both
        // margins.
        let rays_of = |bounds: Aabb| {
            let along = bounds.extent() / pitch;
            std::array::from_fn(|i| (along[i].ceil() as u32 + 1).min(rays[i]))
        };
        let (rays_a, rays_b) = (rays_of(a), rays_of(b));
        let most = rays.into_iter().max().unwrap_or(1);
        let shift = (LATTICE_MAX as u32 / most).ilog2().min(29);
        let grid = |origin, rays| Grid::from_parts(origin, pitch, rays, shift, lod);
        Ok(SumGrid { sum: grid(origin_a + origin_b, rays)?, a: grid(origin_a, rays_a)?, b: grid(origin_b, rays_b)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::RAYS_MAX;
    use glam::DVec3;

    /// Operands of which one is nearly as long as their sum, at the largest possible number of rays.
    #[test]
    fn operand_grids_have_no_more_rays_than_the_sum() {
        let long = Aabb { min: DVec3::splat(-3.0), max: DVec3::new(7.0, -2.99, -2.99) };
        for size in [1e-9, 1e-5, 1e-3] {
            let short = Aabb { min: DVec3::ZERO, max: DVec3::splat(size) };
            let pitch = (10.0 + size) / f64::from(RAYS_MAX);
            for [a, b] in [[long, short], [short, long]] {
                let grids = SumGrid::with_pitch(a, b, pitch, 1024).unwrap();
                assert_eq!(grids.sum.rays()[0], RAYS_MAX);
                for (grid, bounds) in [(grids.a, a), (grids.b, b)] {
                    assert_eq!(grid.shift(), grids.sum.shift());
                    for i in 0..3 {
                        let [first, last] = [bounds.min, bounds.max].map(|p| (p[i] - grid.origin()[i]) / grid.step());
                        assert!(first > -0.5 && last < f64::from(grid.length(i)) + 0.5, "{first} to {last} along {i}");
                    }
                }
            }
        }
    }
}
