//! The thickness of balls, from the crossings of rays with their meshes, which voxels do not have.

use std::time::Instant;

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::NodePlanes;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::metrics::distance::{Crossings, DistanceField};
use ldi_ops::metrics::thickness::local_thickness;
use ldi_ops::metrics::{BoundaryCondition, Distribution, NodeSet, Region};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};
use ldi_ops::solids;
use serde_json::{Value, json};

use crate::BenchError;

/// Subdivisions of an edge of the icosahedron behind a ball's mesh: its deviation is below 10⁻⁴ of the radius.
const FREQUENCY: u32 = 96;

/// Measures the local thickness of a ball with a radius of whole pitches, on the raster of the array with the ball in the
/// middle of an even number of voxels.
pub fn of_ball(radius: u32) -> Result<Value, BenchError> {
    let name = format!("ball of {radius}");
    let wrong = |reason: &dyn std::fmt::Display| BenchError::model(&name, reason);
    let mesh = solids::geodesic(f64::from(radius), FREQUENCY).map_err(|error| wrong(&error))?;
    let mesh = ClosedMesh::check(mesh).map_err(|error| wrong(&error))?;
    let grid = Grid::with_resolution(mesh.bounds(), 2 * radius, 1024).map_err(|error| wrong(&error))?;
    let solid = grid.quantise(&mesh).map_err(|error| wrong(&error))?;
    let start = Instant::now();
    let image = |axis| CpuSampler::default().sample(&solid, axis, Mode::Exact, FillRule::EvenOdd);
    let [x, y, z] = Axis::ALL.map(image);
    let images = [x, y, z].into_iter().collect::<Result<Vec<_>, _>>().map_err(|error| wrong(&error))?;
    let images = images.try_into().expect("an image for each of three axes");
    let nodes = NodeSet::of_planes(&NodePlanes::new(&images, Mode::Exact).map_err(|error| wrong(&error))?);
    let crossings = Crossings::of_images(&images, &Region::of_box(&grid, *solid.bounds()), BoundaryCondition::Clip);
    let thickness = local_thickness(&DistanceField::of(&crossings, BoundaryCondition::Clip), &nodes);
    let seconds = start.elapsed().as_secs_f64();
    let mean = Distribution::of_map(&thickness, grid.pitch()).map(|of| of.mean());
    Ok(json!({"radius": radius, "thickness": mean, "seconds": seconds}))
}
