//! One sum by stages, in its own process, so that its peak memory is known.

use ldi_ops::driver::certainty::Certainty;
use ldi_ops::driver::input::Solid;
use ldi_ops::driver::job::{Backend, Keep, Operand, Spacing, SumJob, SumOperation};
use ldi_ops::driver::measured::{Measured, StepReport};
use ldi_ops::driver::sum::{SumBackend, sum};
use ldi_ops::grid::Axis;
use ldi_ops::integrate::volume;
use ldi_ops::minkowski::CullCounts;
use ldi_ops::{FillRule, Mode, Monitor};
use serde_json::{Value, json};

use super::pairs::Pair;
use crate::BenchError;
use crate::clock::median;
use crate::machine;

/// LOD-C, which exact images do not use.
const LOD: u32 = 1024;

/// The stages of a sum as the library names them, in order.
pub const STAGES: [&str; 9] =
    ["cull", "interior", "forecast", "spans_x", "spans_y", "spans_z", "resolve", "spot_check", "retrieve"];

/// Adds a pair `runs` times after a warm-up, and returns its costs as JSON: medians, and the process's peak memory. A named
/// adapter samples and resolves gaps.
pub fn run(name: &str, resolution: u32, runs: usize, adapter: Option<&str>) -> Result<Value, BenchError> {
    let pair = Pair::named(name)?;
    let failed = |error: ldi_ops::Error| BenchError::model(name, error);
    let solids = [("a", &pair.a), ("b", &pair.b)]
        .map(|(side, operand)| operand.mesh().map(|mesh| Solid::from_closed(mesh, &format!("{name}-{side}"))));
    let [a, b] = solids;
    let solids = vec![a?, b?];
    let backend = match adapter {
        None => Backend::Cpu,
        Some(adapter) => Backend::Gpu(Some(adapter.to_owned())),
    };
    let job = SumJob {
        operation: SumOperation::Sum(Operand::AsItIs),
        unit: None,
        spacing: Spacing::Resolution(resolution),
        lod: LOD,
        axes: Axis::ALL.to_vec(),
        mode: Mode::Exact,
        fill: FillRule::EvenOdd,
        backend: backend.clone(),
        memory: None,
        hashes: false,
        certainty: Certainty::default(),
        keep: Keep::Images,
    };
    let device = SumBackend::open(&backend).map_err(failed)?;
    let add = || sum(&job, solids.clone(), &device, &Monitor::new(None)).map_err(failed);
    let mut last = add()?;
    let mut seconds = Vec::with_capacity(runs);
    for _ in 0..runs {
        drop(last);
        last = add()?;
        seconds.push(times(&last));
    }
    let of_stages: serde_json::Map<String, Value> = (0..seconds[0].len())
        .map(|i| (seconds[0][i].0.to_owned(), json!(median(seconds.iter().map(|run| run[i].1).collect()))))
        .collect();
    let step = step(&last);
    let CullCounts { candidates, visited, kept, distinct } = step.pairs.expect("a sum has pairs");
    Ok(json!({
        "pair": name,
        "adapter": last.ran.as_ref().and_then(|ran| ran.gpu.clone()),
        "triangles": solids.iter().map(|solid| solid.mesh().triangles.len()).collect::<Vec<_>>(),
        "rays": last.grid.rays(),
        "pairs": {"candidates": candidates as u64, "visited": visited, "kept": kept, "distinct": distinct},
        "triangles_sampled": step.sampled,
        "crossings": step.crossings,
        "components": step.resolved.components,
        "cavities": step.resolved.cavities,
        "gaps": step.resolved.gaps,
        "gaps_tested": step.resolved.gaps_tested,
        "samples": last.images.iter().map(|image| image.depths().len() as u64).collect::<Vec<_>>(),
        "volume": last.images.iter().map(volume).sum::<f64>() / 3.0,
        "seconds": of_stages,
        "peak_memory_bytes": machine::peak_memory(),
    }))
}

/// Returns the report of the one step of a sum.
fn step(measured: &Measured) -> &StepReport {
    let report = measured.sum.as_ref().expect("a sum reports its steps");
    report.steps.first().expect("a sum has a step")
}

/// Returns the seconds of all stages, of the three images (`images`) and of the whole sum with its checks of orientation and its
/// coarser rasters (`whole`).
fn times(measured: &Measured) -> Vec<(&'static str, f64)> {
    let mut times = step(measured).seconds.clone();
    times.push(("images", times.iter().map(|(_, seconds)| seconds).sum()));
    times.push(("whole", measured.seconds.total));
    times
}
