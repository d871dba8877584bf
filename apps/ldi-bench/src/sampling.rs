//! Benchmark of the sampler alone: meshes are read, checked and quantised before the clock starts.

use std::path::Path;

use ldi_ops::grid::{Axis, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use serde_json::json;

use crate::BenchError;
use crate::clock::{Times, median_times};
use crate::fit::{LinearCost, Observation, exponent, linear_cost};
use crate::machine::Machine;
use crate::models::{self, NamedSolid, grid_around, quantise};
use crate::table::{Table, count, number};

/// The settings of a run.
pub struct Plan {
    /// Timed rounds of each case.
    pub runs: usize,
    /// Rays along the longest side of the tables by model.
    pub resolution: u32,
}

/// LOD-C of the estimates.
const LOD: u32 = 1024;

/// Threads of the speed-up.
const THREADS: usize = 2;

/// A way to sample.
#[derive(Clone, Copy)]
struct Way {
    name: &'static str,
    mode: Mode,
    fill: FillRule,
}

const WAYS: [Way; 4] = [
    Way { name: "exact", mode: Mode::Exact, fill: FillRule::EvenOdd },
    Way { name: "over", mode: Mode::Estimate(Estimate::Over), fill: FillRule::EvenOdd },
    Way { name: "under", mode: Mode::Estimate(Estimate::Under), fill: FillRule::EvenOdd },
    Way { name: "exact nonzero", mode: Mode::Exact, fill: FillRule::NonZero },
];

impl Way {
    fn sample(self, solid: &LatticeSolid, axis: Axis) -> Ldi {
        CpuSampler::default().sample(solid, axis, self.mode, self.fill).expect("the model is closed and oriented")
    }
}

/// One case of the table by model.
#[derive(Serialize)]
struct Case {
    model: &'static str,
    triangles: u64,
    crossings: u64,
    rays: u64,
    axis: &'static str,
    mode: &'static str,
    one_thread: Times,
    two_threads: Times,
    /// Bytes of the mesh on the lattice and of the image.
    bytes: u64,
}

/// One point of a growth table.
#[derive(Serialize)]
struct Growth {
    size: u64,
    triangles: u64,
    crossings: u64,
    seconds: Times,
}

/// Runs the benchmark and prints the tables.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    let machine = Machine::ask();
    let pools = [1, THREADS].map(|threads| {
        ThreadPoolBuilder::new().num_threads(threads).build().expect("a machine has room for two threads")
    });
    let solids = models::for_sampling()?;

    println!("### Sampling alone\n\n`ldi-bench sampling --runs {} --resolution {}`\n", plan.runs, plan.resolution);
    let cases = by_model(plan, &solids, &pools)?;
    print_cases(&cases, &machine);
    let about: Vec<String> = solids.iter().map(|solid| format!("{}: {}", solid.name, solid.about)).collect();
    println!("{}.\n", about.join("; "));
    let costs = costs(plan, &solids, &pools[0])?;
    print_costs(&costs);
    let by_triangles = growth_in_triangles(plan, &pools[0])?;
    print_growth("triangles", "Gyroid of growing fineness, exact, along z, one thread", &by_triangles);
    let by_rays = growth_in_rays(plan, &solids[0], &pools[0])?;
    print_growth("rays", "Gyroid on growing rasters, exact, along z, one thread", &by_rays);
    println!("{}", machine.describe());

    let document = json!({
        "runs": plan.runs, "resolution": plan.resolution, "lod": LOD, "machine": machine, "cases": cases, "costs": costs,
        "growth_in_triangles": by_triangles, "growth_in_rays": by_rays,
    });
    crate::process::write_json(json, &document)
}

fn by_model(plan: &Plan, solids: &[NamedSolid], pools: &[ThreadPool; 2]) -> Result<Vec<Case>, BenchError> {
    let mut cases = Vec::new();
    for NamedSolid { name, mesh, .. } in solids {
        let solid = quantise(name, mesh, &grid_around(name, mesh, plan.resolution, LOD)?)?;
        for axis in Axis::ALL {
            for way in WAYS {
                let crossings = WAYS[0].sample(&solid, axis).depths().len() as u64;
                let image = way.sample(&solid, axis);
                let words = 3 * (solid.positions().len() + solid.triangles().len());
                let bytes = 4 * (words + image.offsets().len() + image.depths().len()) as u64;
                let rays = u64::from(image.rays());
                drop(image);
                let times =
                    pools.each_ref().map(|pool| pool.install(|| median_times(plan.runs, || way.sample(&solid, axis))));
                cases.push(Case {
                    model: name,
                    triangles: mesh.mesh().triangles.len() as u64,
                    crossings,
                    rays,
                    axis: axis.name(),
                    mode: way.name,
                    one_thread: times[0],
                    two_threads: times[1],
                    bytes,
                });
            }
        }
    }
    Ok(cases)
}

fn print_cases(cases: &[Case], machine: &Machine) {
    let mut table = Table::new(&[
        "model",
        "triangles",
        "crossings",
        "axis",
        "mode",
        "1 thread ms",
        "CPU ms",
        "2 threads ms",
        "CPU ms",
        "speed-up",
        "ns/(triangle + crossing)",
        "GB/s",
        "of copying",
    ]);
    for case in cases {
        let speed = case.bytes as f64 / case.one_thread.cpu;
        table.row(vec![
            case.model.to_owned(),
            count(case.triangles),
            count(case.crossings),
            case.axis.to_owned(),
            case.mode.to_owned(),
            number(1e3 * case.one_thread.wall),
            number(1e3 * case.one_thread.cpu),
            number(1e3 * case.two_threads.wall),
            number(1e3 * case.two_threads.cpu),
            number(case.one_thread.wall / case.two_threads.wall),
            number(1e9 * case.one_thread.cpu / (case.triangles + case.crossings) as f64),
            number(1e-9 * speed),
            format!("{} %", number(100.0 * speed / machine.copy_bandwidth[0])),
        ]);
    }
    println!("{}", table.markdown());
    println!(
        "Crossings are those of the exact image. ns and GB/s are of one thread's processor time; bytes are those of the \
         mesh on the lattice, read once, and of the image, written once.\n"
    );
}

/// The models behind a fit.
#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Meshes {
    /// Models of at least [`FINE`] triangles, each of a few pixels or less, as in scans and scaffolds.
    Fine,
    /// All models. The cost of a large triangle depends on the rows it covers, which three numbers cannot express.
    All,
}

const FINE: usize = 10_000;

/// The fitted cost of one way to sample.
#[derive(Serialize)]
struct Cost {
    mode: &'static str,
    meshes: Meshes,
    nanoseconds: LinearCost,
}

/// Fits the cost of triangles, crossings and rays by mode, from several models on several rasters along z, on one thread.
///
/// One model does not suffice: on finer rasters its crossings grow in proportion to its rays, and the fit cannot separate the
/// two costs.
fn costs(plan: &Plan, solids: &[NamedSolid], pool: &ThreadPool) -> Result<Vec<Cost>, BenchError> {
    let mut observations = [const { Vec::new() }; WAYS.len()];
    for NamedSolid { name, mesh, .. } in solids {
        for resolution in [64, 128, 256, 512, 1024] {
            let solid = quantise(name, mesh, &grid_around(name, mesh, resolution, LOD)?)?;
            let image = WAYS[0].sample(&solid, Axis::Z);
            let (crossings, rays) = (image.depths().len() as f64, f64::from(image.rays()));
            drop(image);
            for (way, observations) in WAYS.iter().zip(&mut observations) {
                let times = pool.install(|| median_times(plan.runs, || way.sample(&solid, Axis::Z)));
                let triangles = mesh.mesh().triangles.len() as f64;
                observations.push(Observation { triangles, crossings, rays, seconds: times.cpu });
            }
        }
    }
    let mut costs = Vec::new();
    for meshes in [Meshes::Fine, Meshes::All] {
        for (way, observations) in WAYS.iter().zip(&observations) {
            let is_in = |o: &&Observation| meshes == Meshes::All || o.triangles >= FINE as f64;
            let taken: Vec<Observation> = observations.iter().filter(is_in).copied().collect();
            costs.extend(linear_cost(&taken).map(|nanoseconds| Cost { mode: way.name, meshes, nanoseconds }));
        }
    }
    Ok(costs)
}

fn print_costs(costs: &[Cost]) {
    let mut table =
        Table::new(&["mode", "models", "ns a triangle", "ns a crossing", "ns a ray", "residual (rms)", "worst"]);
    for Cost { mode, meshes, nanoseconds: cost } in costs {
        table.row(vec![
            (*mode).to_owned(),
            match meshes {
                Meshes::Fine => "of small triangles".to_owned(),
                Meshes::All => "all".to_owned(),
            },
            number(cost.per_triangle),
            number(cost.per_crossing),
            number(cost.per_ray),
            format!("{} %", number(100.0 * cost.residual)),
            format!("{} %", number(100.0 * cost.worst)),
        ]);
    }
    println!("#### What a triangle, a crossing and a ray cost\n\n{}", table.markdown());
    println!(
        "Least squares of relative errors over models at 64, 128, 256, 512 and 1024 rays along the longest side, along z, \
         processor time of one thread. Of small triangles are the models of {FINE} triangles and more.\n"
    );
}

fn growth_in_triangles(plan: &Plan, pool: &ThreadPool) -> Result<Vec<Growth>, BenchError> {
    let point = |fineness: u32| {
        let mesh = models::closed("gyroid", models::thick_gyroid(fineness)?)?;
        growth(plan, pool, &mesh, plan.resolution, |triangles, _| triangles)
    };
    [8, 16, 26, 40, 64, 94].into_iter().map(point).collect()
}

fn growth_in_rays(plan: &Plan, gyroid: &NamedSolid, pool: &ThreadPool) -> Result<Vec<Growth>, BenchError> {
    let point = |resolution: u32| growth(plan, pool, &gyroid.mesh, resolution, |_, rays| rays);
    [128, 256, 512, 1024, 2048, 4096].into_iter().map(point).collect()
}

fn growth(
    plan: &Plan,
    pool: &ThreadPool,
    mesh: &ClosedMesh,
    resolution: u32,
    size: impl Fn(u64, u64) -> u64,
) -> Result<Growth, BenchError> {
    let solid = quantise("gyroid", mesh, &grid_around("gyroid", mesh, resolution, LOD)?)?;
    let image = WAYS[0].sample(&solid, Axis::Z);
    let (rays, crossings) = (u64::from(image.rays()), image.depths().len() as u64);
    drop(image);
    let seconds = pool.install(|| median_times(plan.runs, || WAYS[0].sample(&solid, Axis::Z)));
    let triangles = mesh.mesh().triangles.len() as u64;
    Ok(Growth { size: size(triangles, rays), triangles, crossings, seconds })
}

fn print_growth(what: &str, title: &str, growth: &[Growth]) {
    let each = "ns per triangle + crossing";
    let mut table = Table::new(&[what, "crossings", "wall ms", "CPU ms", each, "exponent since the row above"]);
    let point = |g: &Growth| (g.size as f64, g.seconds.cpu);
    for (i, g) in growth.iter().enumerate() {
        let slope = i.checked_sub(1).map_or(f64::NAN, |before| exponent(&[point(&growth[before]), point(g)]));
        table.row(vec![
            count(g.size),
            count(g.crossings),
            number(1e3 * g.seconds.wall),
            number(1e3 * g.seconds.cpu),
            number(1e9 * g.seconds.cpu / (g.triangles + g.crossings) as f64),
            number(slope),
        ]);
    }
    let points: Vec<_> = growth.iter().map(point).collect();
    println!("#### Cost by {what}\n\n{title}: cost ∝ {what}^{:.2} by processor time.\n", exponent(&points));
    println!("{}", table.markdown());
}
