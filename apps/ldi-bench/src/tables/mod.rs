//! The tables of Leung and Wang (see [`SeedModel`]) again, on the CPU, with the [`rivals`](crate::rivals) beside them: sampling by
//! model, deep solids, LOD-C, intersections and Minkowski sums.

mod by_model;
mod depth;
mod intersection;
mod lod;
mod plot;
mod sums;

use std::path::Path;
use std::time::Instant;

use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::{Map, Value, json};

use crate::BenchError;
use crate::clock::median;
use crate::machine::Machine;
#[cfg(doc)]
use crate::models::SeedModel;
use crate::models::seed_models_named;
use plot::Plot;

/// The settings of a run.
pub struct Plan {
    /// Whether the solids and rasters are the small ones.
    is_quick: bool,
    /// Timed rounds of each case.
    runs: usize,
    /// Rays along the longest side.
    resolution: u32,
    /// Names of the models; the first serves the table of LOD-C.
    models: Vec<&'static str>,
    /// Rings along the chains of the table by layers.
    columns: Vec<u32>,
    /// Rays across these chains.
    across: u32,
    /// Values of LOD-C.
    lods: Vec<u32>,
    /// Resolutions of the gyroid and the organic solid that are intersected.
    intersected: [&'static str; 2],
    /// Names of Minkowski sums.
    sums: Vec<&'static str>,
}

impl Plan {
    /// Returns the plan of the published models at 512 rays.
    pub fn full(runs: usize) -> Plan {
        Plan {
            is_quick: false,
            runs,
            resolution: 512,
            models: vec!["trabecular bone", "hyperboloid", "nylon lattice", "chain", "brush", "geodesic structure"],
            columns: vec![8, 16, 24, 32, 40, 48],
            across: 64,
            lods: (6..=12).map(|log| 1 << log).collect(),
            intersected: ["26", "75"],
            sums: vec!["organic-ball", "skull-knot", "star-torus"],
        }
    }

    /// Returns a plan of fewer and smaller solids and fewer rays.
    pub fn quick(runs: usize) -> Plan {
        Plan {
            is_quick: true,
            resolution: 128,
            models: vec!["hyperboloid", "geodesic structure"],
            columns: vec![16, 40],
            across: 32,
            lods: vec![64, 512, 4096],
            intersected: ["8", "24"],
            sums: vec!["knot-torus"],
            ..Plan::full(runs)
        }
    }
}

/// LOD-C of all tables but that by LOD-C.
const LOD: u32 = 1024;

/// One table with its text.
struct Part {
    /// Its name in the JSON.
    name: &'static str,
    title: String,
    markdown: String,
    text: String,
    rows: Value,
    plots: Vec<Plot>,
}

/// Pools of one and of two threads.
struct Pools {
    one: ThreadPool,
    two: ThreadPool,
}

impl Pools {
    fn new() -> Pools {
        let pool = |n| ThreadPoolBuilder::new().num_threads(n).build().expect("a machine has room for two threads");
        Pools { one: pool(1), two: pool(2) }
    }
}

/// Work of more seconds than this has one round after its warm-up, and the lesser time of both counts.
const LONG: f64 = 1.0;

/// Does some work in a pool; returns the result of the last round, and the median wall time after a warm-up in milliseconds.
fn timed<T: Send>(plan: &Plan, pool: &ThreadPool, mut work: impl FnMut() -> T + Send) -> (T, f64) {
    pool.install(|| {
        let mut once = || {
            let start = Instant::now();
            let result = work();
            (result, 1e3 * start.elapsed().as_secs_f64())
        };
        let warm_up = once().1;
        let (mut result, first) = once();
        if warm_up > 1e3 * LONG {
            return (result, warm_up.min(first));
        }
        let mut times = vec![first];
        while times.len() < plan.runs {
            let (next, time) = once();
            result = next;
            times.push(time);
        }
        (result, median(times))
    })
}

const OVER: Mode = Mode::Estimate(Estimate::Over);
const UNDER: Mode = Mode::Estimate(Estimate::Under);

/// Returns the even-odd images along three axes.
fn images(solid: &LatticeSolid, mode: Mode) -> Vec<Ldi> {
    let images = CpuSampler::default().sample_along(solid, &Axis::ALL, mode, FillRule::EvenOdd);
    images.expect("the model is closed and its samples can be counted")
}

/// Runs the plan, and prints each table when it is done.
pub fn run(plan: &Plan, json: Option<&Path>, svg: Option<&Path>) -> Result<(), BenchError> {
    let (machine, pools) = (Machine::ask(), Pools::new());
    let models = seed_models_named(|name| plan.models.contains(&name))?;
    if let Some(folder) = svg {
        std::fs::read_dir(folder).map_err(BenchError::io(folder.display().to_string()))?;
    }
    let flag = if plan.is_quick { " --quick" } else { "" };
    println!("### The published tables and the rivals\n\n`ldi-bench tables{flag} --runs {}`\n", plan.runs);
    println!(
        "All times are wall times on the CPU; no GPU takes part. Published figures are those of Leung and Wang on a GeForce \
         GTX 580 at 512² rays and LOD-C 1024; – stands where there is none. Their solids are not ours: ours are of the same \
         kind and size. Work of more than {LONG} s has one round after its warm-up, and the lesser time counts. Images are \
         even-odd, of {} rays along the longest side and LOD-C {LOD} unless a table says otherwise.\n",
        plan.resolution
    );
    let parts: [&dyn Fn() -> Result<Part, BenchError>; 6] = [
        &|| by_model::sampling(plan, &models, &pools),
        &|| by_model::rivals(plan, &models, &pools),
        &|| depth::chains(plan, &pools),
        &|| lod::sweep(plan, &models[0].solid, &pools),
        &|| intersection::placements(plan, &pools),
        &|| sums::sums(plan),
    ];
    let mut document = Map::new();
    document.insert("quick".into(), json!(plan.is_quick));
    document.insert("runs".into(), json!(plan.runs));
    document.insert("resolution".into(), json!(plan.resolution));
    document.insert("machine".into(), json!(machine));
    for part in parts {
        let part = part()?;
        println!("#### {}\n\n{}\n{}\n", part.title, part.markdown, part.text);
        document.insert(part.name.into(), part.rows);
        for plot in part.plots {
            svg.map_or(Ok(()), |folder| plot.write(folder))?;
        }
    }
    println!("{}", machine.describe());
    crate::process::write_json(json, &Value::Object(document))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tiny_run_writes_every_table_and_plot() {
        let folder = tempfile::tempdir().unwrap();
        let json = folder.path().join("tables.json");
        let models = vec!["geodesic structure"];
        let plan = Plan { resolution: 32, models, columns: vec![2, 40], across: 16, ..Plan::quick(1) };
        run(&plan, Some(&json), Some(folder.path())).unwrap();
        let document: Value = serde_json::from_reader(std::fs::File::open(json).unwrap()).unwrap();
        let at = |pointer: &str| document.pointer(pointer).and_then(Value::as_f64).expect(pointer);

        assert_eq!(at("/sampling/0/published_ms"), 62.3);
        assert_eq!(document["rivals"].as_array().unwrap().len(), crate::rivals::all().len());
        let uncapped = document["rivals"].as_array().unwrap().iter().find(|row| row["rival"] == "FreePipe, compact");
        assert_eq!(uncapped.unwrap()["difference"]["differing"], 0);

        assert!(at("/chains/0/layers") < 255.0 && at("/chains/1/layers") > 255.0);
        assert_eq!(at("/chains/0/lost_at_8_bits"), 0.0);
        assert!(at("/chains/1/lost_at_8_bits") > 0.0);

        let [coarse, fine] = [0, 2].map(|i| {
            let volume = |mode: &str| at(&format!("/lod/{i}/volume/{mode}"));
            assert!(volume("under") < volume("exact") && volume("exact") < volume("over"));
            volume("over") - volume("under")
        });
        assert!(fine < coarse);

        for i in 0..3 {
            let volume = |way: &str| at(&format!("/intersections/{i}/volume/{way}"));
            assert!(volume("under") < volume("exact") && volume("exact") < volume("over"));
            assert!((volume("contact") / volume("exact") - 1.0).abs() < 0.01);
        }
        assert!(at("/sums/0/volume") > 0.0);
        for name in ["layers", "lod-volume", "lod-time"] {
            let text = std::fs::read_to_string(folder.path().join(format!("tables-{name}.svg"))).unwrap();
            assert!(text.contains("<polyline"), "{name}");
        }
    }
}
