//! What a step will find, told by the same step with a raster of an eighth of the rays along each side or fewer.
//!
//! The lattice stays, so that nothing is culled or rounded again: a pixel of the coarse raster is eight of the fine one.
//! Crossings, gaps and samples go with the number of rays, so that those of the coarse raster, times 64, are near to those
//! to come: within a tenth or so, where the result is not thinner than a coarse pixel.

use glam::DVec3;
use rayon::prelude::*;

use crate::Error;
use crate::fixed::Crossing;
use crate::grid::{Axis, Grid};
use crate::ldi::TooManySamples;
use crate::minkowski::RaySpans;

/// Rays along the longest side of the coarse raster, at least.
const FEWEST: u32 = 64;

/// What is expected along all axes together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Ends of spans and of what may be gaps.
    pub kept: f64,
    /// Samples of the result's exact images.
    pub samples: f64,
}

/// A raster of fewer rays on the same lattice; nothing where the lattice has no room for one.
fn coarser(grid: &Grid) -> Option<Grid> {
    let longest = grid.rays().into_iter().max().unwrap_or(1);
    (1..=(longest / FEWEST).max(2).ilog2()).rev().find_map(|halvings| {
        let rays = grid.rays().map(|n| n.div_ceil(1 << halvings));
        let pitch = grid.pitch() * f64::from(1u32 << halvings);
        Grid::from_parts(grid.origin(), pitch, rays, grid.shift() + halvings, grid.lod()).ok()
    })
}

impl Forecast {
    /// Samples on a coarser raster. `resolve` removes gaps that are none, as far as it can be done there; `surface` is what is
    /// sampled where there is no room for a coarser raster, and how many of its crossings are then taken to be kept.
    pub fn of<E: From<Error>>(
        grid: &Grid,
        spans: impl Fn(&Grid, Axis) -> Result<RaySpans<Crossing>, TooManySamples>,
        resolve: impl FnOnce(&Grid, [RaySpans<Crossing>; 3]) -> Result<[RaySpans<Crossing>; 3], E>,
        surface: (&[[i32; 3]], &[[u32; 3]], f64),
    ) -> Result<Forecast, E> {
        let Some(coarse) = coarser(grid) else {
            let (positions, triangles, share) = surface;
            let kept = share * crossings(positions, triangles, grid);
            return Ok(Forecast { kept, samples: kept });
        };
        let [x, y, z] = Axis::ALL.map(|axis| spans(&coarse, axis).map_err(Error::machine));
        let spans = [x?, y?, z?];
        let scale = (coarse.pitch() / grid.pitch()).powi(2);
        let count = |spans: &[RaySpans<Crossing>; 3]| spans.iter().map(|along| along.hits.len()).sum::<usize>() as f64;
        let kept = scale * count(&spans);
        Ok(Forecast { kept, samples: scale * count(&resolve(&coarse, spans)?) })
    }
}

/// How many crossings of rays with triangles there will be, along all axes: their areas as the rays see them, over that of
/// a pixel.
fn crossings(positions: &[[i32; 3]], triangles: &[[u32; 3]], grid: &Grid) -> f64 {
    let pixel = f64::from(1u32 << grid.shift());
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| DVec3::from_array(positions[vertex as usize].map(f64::from)));
        0.5 * (b - a).cross(c - a).abs().element_sum()
    };
    triangles.par_iter().map(area).sum::<f64>() / (pixel * pixel)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Aabb;

    #[test]
    fn coarser_rasters_lie_on_the_same_lattice() {
        for resolution in [64, 100, 500, 512, 1000, 4096] {
            let bounds = Aabb { min: DVec3::splat(-1.0), max: DVec3::new(2.0, 1.0, 0.0) };
            let grid = Grid::with_resolution(bounds, resolution, 1024).unwrap();
            let coarse = coarser(&grid).unwrap();
            assert_eq!(coarse.step(), grid.step());
            assert_eq!(coarse.origin(), grid.origin());
            assert!((0..3).all(|i| coarse.length(i) >= grid.length(i)));
            let rays = coarse.rays()[0];
            assert!(rays < resolution && (32..2 * FEWEST).contains(&rays), "{resolution}: {rays}");
        }
        // A raster of 511 fills its lattice, and one of 512 would not fit.
        let bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
        assert_eq!(coarser(&Grid::with_resolution(bounds, 511, 1024).unwrap()), None);
    }
}
