//! One sum by stages, in its own process, so that its peak memory is known.

use std::time::Instant;

use ldi_ops::grid::{Axis, Grid, SumGrid};
use ldi_ops::integrate::volume;
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::minkowski::{CullCounts, Exterior, Interior, Polyhedron, ResolveCounts, SumMembership};
use ldi_ops::sampler::Mode;
use ldi_ops::sampler::cpu::CpuSampler;
use serde_json::{Value, json};

use super::backend::Backend;
use super::pairs::Pair;
use crate::BenchError;
use crate::clock::median;
use crate::machine;

/// LOD-C, which exact images do not use.
const LOD: u32 = 1024;

/// The timed stages, in this order.
pub const STAGES: [&str; 8] = ["quantise", "cull", "interior", "spans_x", "spans_y", "spans_z", "resolve", "retrieve"];

/// A sum with its statistics.
struct Sum {
    seconds: [f64; STAGES.len()],
    rays: [u32; 3],
    pairs: CullCounts,
    /// Number of primitives that are not certainly inside.
    sampled: usize,
    crossings: [u64; 3],
    resolved: ResolveCounts,
    images: [Ldi; 3],
}

/// Adds a pair `runs` times after a warm-up, and returns its costs as JSON: medians, and the process's peak memory. A named
/// adapter culls, samples and resolves gaps.
pub fn run(name: &str, resolution: u32, runs: usize, adapter: Option<&str>) -> Result<Value, BenchError> {
    let pair = Pair::named(name)?;
    let (a, b) = (pair.a.mesh()?, pair.b.mesh()?);
    let backend = Backend::named(adapter)?;
    let mut sum = add(name, &a, &b, resolution, &backend)?;
    let mut seconds = Vec::with_capacity(runs);
    for _ in 0..runs {
        drop(sum);
        sum = add(name, &a, &b, resolution, &backend)?;
        seconds.push(sum.seconds);
    }
    let mut of_stages: serde_json::Map<String, Value> = STAGES
        .iter()
        .enumerate()
        .map(|(i, stage)| ((*stage).to_owned(), json!(median(seconds.iter().map(|run| run[i]).collect()))))
        .collect();
    of_stages.insert("whole".to_owned(), json!(median(seconds.iter().map(|run| run.iter().sum()).collect())));
    let CullCounts { candidates, visited, kept, distinct } = sum.pairs;
    Ok(json!({
        "pair": name,
        "adapter": backend.name(),
        "triangles": [a.mesh().triangles.len(), b.mesh().triangles.len()],
        "rays": sum.rays,
        "pairs": {"candidates": candidates as u64, "visited": visited, "kept": kept, "distinct": distinct},
        "triangles_sampled": sum.sampled,
        "crossings": sum.crossings,
        "components": sum.resolved.components,
        "cavities": sum.resolved.cavities,
        "gaps": sum.resolved.gaps,
        "gaps_tested": sum.resolved.gaps_tested,
        "samples": sum.images.iter().map(|image| image.depths().len() as u64).collect::<Vec<_>>(),
        "volume": sum.images.iter().map(volume).sum::<f64>() / 3.0,
        "seconds": of_stages,
        "peak_memory_bytes": machine::peak_memory(),
    }))
}

fn add(name: &str, a: &ClosedMesh, b: &ClosedMesh, resolution: u32, backend: &Backend) -> Result<Sum, BenchError> {
    let mut clock = Clock { since: Instant::now(), seconds: Vec::with_capacity(STAGES.len()) };
    let extent = a.bounds().extent() + b.bounds().extent();
    let pitch = extent.max_element() / f64::from(resolution);
    let failed = |error: &dyn std::fmt::Display| BenchError::model(name, error);
    let SumGrid { sum: grid, a: grid_a, b: grid_b } =
        SumGrid::with_pitch(a.bounds(), b.bounds(), pitch, LOD).map_err(|error| failed(&error))?;
    let polyhedron = |grid: &Grid, mesh| grid.quantise(mesh).map(|solid| Polyhedron::new(&solid));
    let a = polyhedron(&grid_a, a).map_err(|error| failed(&error))?;
    let b = polyhedron(&grid_b, b).map_err(|error| failed(&error))?;
    clock.lap();

    let (primitives, pairs) = backend.cull(&a, &b)?;
    clock.lap();

    let sampler = CpuSampler::default();
    let primitives = primitives.outside(&Interior::new(&grid, &a, Exterior::Out, &b, &sampler));
    let sampled = primitives.triangles.len();
    clock.lap();

    let mut along = |axis| {
        let found = backend.spans(name, &primitives, &grid, axis);
        clock.lap();
        found
    };
    let [(x, met_x), (y, met_y), (z, met_z)] = [along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?];

    let membership = SumMembership::new(&a, Exterior::Out, &b);
    let resolved = backend.resolve(name, &grid, [x, y, z], &membership)?;
    clock.lap();

    let image = |axis: usize| resolved.spans[axis].image(&grid, Mode::Exact, &sampler).map_err(|error| failed(&error));
    let images = [image(0)?, image(1)?, image(2)?];
    clock.lap();
    let seconds = clock.seconds.try_into().expect("the clock was read once a stage");
    let (rays, crossings) = (grid.rays(), [met_x, met_y, met_z]);
    Ok(Sum { seconds, rays, pairs, sampled, crossings, resolved: resolved.counts, images })
}

/// A clock of the seconds between laps.
struct Clock {
    since: Instant,
    seconds: Vec<f64>,
}

impl Clock {
    fn lap(&mut self) {
        self.seconds.push(self.since.elapsed().as_secs_f64());
        self.since = Instant::now();
    }
}
