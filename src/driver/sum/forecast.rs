//! Forecasts of the crossings and samples of a step, from the same step on a coarser raster.
//!
//! The lattice stays the same, so nothing is culled or rounded again; only the pitch grows by a power of two. Crossings, gaps and
//! samples are proportional to the number of rays. Scaled by the ratio of rays, the counts of the coarse raster agree with those
//! of the fine one within about a tenth, if the result is not thinner than a coarse pixel.

use crate::parallel::*;
use glam::DVec3;

use crate::Error;
use crate::fixed::Crossing;
use crate::grid::{Axis, Grid};
use crate::ldi::TooManySamples;
use crate::minkowski::RaySpans;

/// Least number of rays along the longest side of the coarse raster.
const FEWEST: u32 = 64;

/// The expected counts of a step, summed over all axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// The number of ends of spans and possible gaps.
    pub kept: f64,
    /// The number of samples of the result's exact images.
    pub samples: f64,
}

/// Returns a raster of fewer rays on the same lattice; `None` where the lattice has no room for one.
fn coarser(grid: &Grid) -> Option<Grid> {
    let longest = grid.rays().into_iter().max().unwrap_or(1);
    (1..=(longest / FEWEST).max(2).ilog2()).rev().find_map(|halvings| {
        let rays = grid.rays().map(|n| n.div_ceil(1 << halvings));
        let pitch = grid.pitch() * f64::from(1u32 << halvings);
        Grid::from_parts(grid.origin(), pitch, rays, grid.shift() + halvings, grid.lod()).ok()
    })
}

impl Forecast {
    /// Returns the forecast from a coarser raster, where `resolve` resolves gaps as far as possible. Without room for a coarser
    /// raster, it counts the crossings of `surface`: positions, triangles, and the share of crossings that is kept.
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

/// Returns the expected number of crossings of rays with triangles along all axes: the projected areas over that of a pixel.
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
