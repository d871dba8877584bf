//! Meshes of images with fewer triangles, within a bound of the distance.

use glam::DVec3;

use super::SimplifiedReport;
use crate::Error;
use crate::bits::Ones;
use crate::grid::{Axis, Grid};
use crate::ldi::NodePlanes;
use crate::mesh::{Precision, TriangleMesh};
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, Sampler};
use crate::surface::simplify::{Limits, simplify};

/// Removes triangles within a bound for a file of a precision, so that sampling the mesh again gives the same nodes of the grid.
pub(super) fn simplified(
    mesh: TriangleMesh,
    grid: &Grid,
    bound: f64,
    precision: Precision,
) -> Result<(TriangleMesh, SimplifiedReport), Error> {
    let expected = planes_of(&mesh, grid)?;
    let result = simplify(&mesh, &Limits { bound, grid: Some(grid), precision }, |mesh| {
        // If the mesh cannot be sampled on this grid, every vertex has to be restored.
        let Ok(found) = planes_of(mesh, grid) else { return mesh.positions.clone() };
        differences(grid, &expected, &found)
    });
    let result = result.map_err(Error::input)?;
    let report = SimplifiedReport { bound, distance: result.distance, triangles: mesh.triangles.len() };
    Ok((result.mesh, report))
}

/// Returns the nodes inside a mesh, plane after plane.
fn planes_of(mesh: &TriangleMesh, grid: &Grid) -> Result<Vec<Vec<u64>>, Error> {
    // The mesh is closed, as the contour and each step of the simplification keep it closed.
    let solid = grid.quantise_open(mesh).map_err(Error::input)?;
    // All three images of one mesh agree about nodes, so one is enough.
    let image = CpuSampler::default().sample(&solid, Axis::X, Mode::Exact, FillRule::EvenOdd)?;
    Ok(NodePlanes::new([&image], Mode::Exact).map_err(Error::input)?.planes().collect())
}

/// Returns the world positions of nodes that differ.
fn differences(grid: &Grid, expected: &[Vec<u64>], found: &[Vec<u64>]) -> Vec<DVec3> {
    let [columns, ..] = grid.rays().map(|n| n as usize);
    let words = columns.div_ceil(64);
    let mut places = Vec::new();
    for (z, (expected, found)) in expected.iter().zip(found).enumerate() {
        for (at, (expected, found)) in expected.iter().zip(found).enumerate() {
            for bit in Ones(expected ^ found) {
                let node = [at % words * 64 + bit as usize, at / words, z].map(|i| f64::from(grid.node(i as u32)));
                places.push(grid.origin() + grid.step() * DVec3::from_array(node));
            }
        }
    }
    places
}
