//! The lattices of a sum and of its operands: one step, and origins that add up.

use super::{Grid, GridError, LATTICE_MAX};
use crate::mesh::Aabb;

/// The grid of A ⊕ B and those that A and B are quantised on.
///
/// A lattice position of A and one of B add up to one of the sum. Each operand is rounded relative to its own box, so that
/// the sum does not depend on where the operands lie nor on which is first.
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
    /// Grids for operands in the given boxes, with the given distance between the rays of the sum, in world units.
    pub fn with_pitch(a: Aabb, b: Aabb, pitch: f64, lod: u32) -> Result<SumGrid, GridError> {
        let bounds = Aabb { min: a.min + b.min, max: a.max + b.max };
        let around_sum = Grid::with_pitch(bounds, pitch, lod)?;
        // The raster is a little longer than the box, by the same on both sides, of which each operand takes half.
        let margin = 0.5 * (around_sum.origin() - bounds.min);
        let (origin_a, origin_b) = (a.min + margin, b.min + margin);
        let rays_of = |bounds: Aabb| {
            let rays = bounds.extent() / pitch;
            [rays.x, rays.y, rays.z].map(|rays| rays.ceil() as u32 + 1)
        };
        let (rays_a, rays_b, rays) = (rays_of(a), rays_of(b), around_sum.rays());
        let most = [rays, rays_a, rays_b].into_iter().flatten().max().unwrap_or(1);
        let shift = (LATTICE_MAX as u32 / most).ilog2().min(29);
        let grid = |origin, rays| Grid::from_parts(origin, pitch, rays, shift, lod);
        Ok(SumGrid { sum: grid(origin_a + origin_b, rays)?, a: grid(origin_a, rays_a)?, b: grid(origin_b, rays_b)? })
    }
}
