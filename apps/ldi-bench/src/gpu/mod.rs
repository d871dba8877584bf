//! The GPU's sampler by stages, on solids like the six that Leung and Wang timed, beside their published figures.
//!
//! # On a machine with a GPU
//! ```text
//! $ cargo build --release -p ldi-bench              # anywhere with the same system
//! $ ldi-bench gpu --json gpu.json > gpu.md          # there; it needs only target/release/ldi-bench
//! ```
//! The binary needs the GPU's driver and its Vulkan loader (Debian: `libvulkan1`), and builds its models itself. It first
//! compares every image with the CPU's; one that differs ends the run with an error.
//!
//! # Timed quantities
//! Stages, by the device's own clock, summed over the three directions; for each stage the median over all rounds. Their sum
//! without the readback to the host is called the whole: Leung and Wang stated this figure, as their images stayed on the GPU
//! too. The span is the time from the beginning of the first stage to the end of the last, with all pauses between them.
//!
//! Wall times are those of a program, taken while no stage is timed: of all three images, with all work of the host, and of the
//! sums over them alone, which stay on the device. The dispatches, submissions and bytes over the bus are counted beside them.

mod account;
mod report;

use std::path::Path;
use std::time::Instant;

use ldi_ops::gpu::{Adapter, Counters, Device, Needs, StageTime, adapters, choose};
use ldi_ops::grid::{Axis, Grid, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::gpu::{GpuOptions, GpuSampler, Route};
use ldi_ops::sampler::{Estimate, FillRule, Mode, Sampler};
use serde::Serialize;
use serde_json::json;

use crate::BenchError;
use crate::clock::median;
use crate::machine::Machine;
use crate::models::{self, NamedSolid, SeedModel};
use account::{Moved, Size};

/// The settings of a run.
pub struct Plan {
    /// Name of an adapter, or part of one; the first adapter if `None`.
    pub adapter: Option<String>,
    /// Names of models, or parts of them; all models if empty.
    pub models: Vec<String>,
    /// Rays along the longest side.
    pub resolution: u32,
    /// Timed rounds of each case.
    pub rounds: usize,
}

/// LOD-C of the estimates.
const LOD: u32 = 1024;

/// Untimed rounds, in which clock rates rise and buffers grow.
const WARM_UP: usize = 3;

/// Sizes in bytes of the copies that measure the bandwidth; the last is larger than any cache, and the reference.
const COPIED: [u64; 4] = [4 << 20, 16 << 20, 64 << 20, 256 << 20];

/// The stage that transfers images to the host.
const READ_BACK: &str = "read back";

/// A kind of image and the algorithm that samples it.
#[derive(Clone, Copy)]
struct Way {
    name: &'static str,
    mode: Mode,
    route: Route,
}

const WAYS: [Way; 3] = [
    Way { name: "over by masks", mode: Mode::Estimate(Estimate::Over), route: Route::Masks },
    Way { name: "over by lists", mode: Mode::Estimate(Estimate::Over), route: Route::Lists },
    Way { name: "exact by lists", mode: Mode::Exact, route: Route::Lists },
];

impl Way {
    fn account(self, sizes: &[Size]) -> Vec<Vec<(&'static str, Moved)>> {
        let of_axis = |(axis, size): (usize, &Size)| match self.route {
            Route::Masks => size.by_masks(),
            Route::Lists => size.by_lists(axis == 0, self.mode == Mode::Exact),
        };
        sizes.iter().enumerate().map(of_axis).collect()
    }
}

/// One model sampled in one way.
#[derive(Serialize)]
struct Case {
    model: &'static str,
    way: &'static str,
    /// Sizes by axis.
    sizes: [Size; 3],
    layers: [u32; 3],
    /// Wall-clock time of all three images.
    wall: f64,
    /// Time on the device from the first stage to the last; zero if the adapter does not time them.
    span: f64,
    /// The work of the device for the images.
    images: Work,
    /// Wall-clock time of the sums over all three images, and what they took.
    sums_wall: f64,
    sums: Work,
    stages: Vec<Stage>,
    published_milliseconds: f64,
}

/// The work that the device was given.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Work {
    dispatches: u64,
    submissions: u64,
    uploaded: u64,
    read_back: u64,
}

impl From<Counters> for Work {
    fn from(Counters { dispatches, submissions, uploaded, read_back }: Counters) -> Work {
        Work { dispatches, submissions, uploaded, read_back }
    }
}

/// One stage, summed over three directions.
#[derive(Clone, Debug, Serialize)]
struct Stage {
    name: &'static str,
    /// The medians of its dispatches by name; empty if the adapter does not time them.
    dispatches: Vec<(&'static str, f64)>,
    #[serde(flatten)]
    moved: Moved,
}

impl Stage {
    fn is_timed(&self) -> bool {
        !self.dispatches.is_empty()
    }

    /// Returns the seconds of the stage; zero if it is not timed.
    fn seconds(&self) -> f64 {
        self.dispatches.iter().map(|(_, seconds)| seconds).sum()
    }
}

impl Case {
    /// Returns the stages that produce an image on the device.
    fn on_device(&self) -> impl Iterator<Item = &Stage> {
        self.stages.iter().filter(|stage| stage.name != READ_BACK)
    }

    /// Returns the seconds of all stages on the device; the wall time if those are not timed.
    fn whole(&self) -> f64 {
        match self.on_device().any(Stage::is_timed) {
            true => self.on_device().map(Stage::seconds).sum(),
            false => self.wall,
        }
    }

    /// Returns the compulsory traffic of the stages in [`whole`](Self::whole).
    fn moved(&self) -> Moved {
        let is_timed = self.on_device().any(Stage::is_timed);
        let mut moved = Moved::default();
        self.on_device().filter(|stage| stage.is_timed() || !is_timed).for_each(|stage| moved += stage.moved);
        moved
    }
}

/// Runs the benchmark and prints the tables.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    let adapters = adapters();
    let adapter = choose(&adapters, plan.adapter.as_deref()).map_err(BenchError::Device)?;
    let mut models = models::seed_models()?;
    let names: Vec<&str> = models.iter().map(|model| model.solid.name).collect();
    let names = chosen(&names, &plan.models)?;
    models.retain(|model| names.contains(&model.solid.name));
    let device = Device::open(adapter, Needs::default()).map_err(BenchError::Device)?;
    let costs = device.costs().map_err(BenchError::Device)?;
    let bandwidth_of = |bytes: u64| Ok((bytes, device.copy_bandwidth(bytes).map_err(BenchError::Device)?));
    let sizes = COPIED.iter().copied().filter(|&bytes| bytes <= adapter.limits.buffer);
    let copies: Vec<(u64, f64)> = sizes.map(bandwidth_of).collect::<Result<_, BenchError>>()?;
    let &(_, bandwidth) = copies.last().expect("every adapter has buffers of the least size");
    report::print_head(plan, adapter, &copies);
    report::print_costs(&costs);
    let machine = Machine::ask();
    let mut cases = Vec::new();
    for model in &models {
        cases.extend(of_model(plan, adapter, model)?);
    }
    report::print_wholes(&cases, bandwidth);
    report::print_work(&cases);
    report::print_stages(&cases, bandwidth);
    println!("{}", machine.describe());
    let document = json!({
        "rounds": plan.rounds, "resolution": plan.resolution, "lod": LOD, "machine": machine,
        "adapter": {
            "name": adapter.name, "kind": adapter.kind.name(), "api": adapter.api, "driver": adapter.driver,
            "int64": adapter.int64, "timestamps": adapter.timestamps,
            "limits": {
                "buffer": adapter.limits.buffer, "binding": adapter.limits.binding, "bindings": adapter.limits.bindings,
                "workgroup": adapter.limits.workgroup, "workgroup_memory": adapter.limits.workgroup_memory,
            },
        },
        "copies": copies, "costs": report::costs_as_json(&costs),
        "copy_bandwidth": bandwidth, "cases": report::with_ratios(&cases, bandwidth),
    });
    crate::process::write_json(json, &document)
}

/// Returns the known names that contain a wanted text; all of them if none is wanted.
fn chosen<'n>(known: &[&'n str], wanted: &[String]) -> Result<Vec<&'n str>, BenchError> {
    let is_called = |name: &str, wanted: &String| name.contains(&wanted.to_lowercase());
    if let Some(unknown) = wanted.iter().find(|wanted| !known.iter().any(|name| is_called(name, wanted))) {
        return Err(BenchError::model(unknown, format!("there is none of this name among {}", known.join(", "))));
    }
    let is_chosen = |name: &&&str| wanted.is_empty() || wanted.iter().any(|wanted| is_called(name, wanted));
    Ok(known.iter().filter(is_chosen).copied().collect())
}

fn of_model(plan: &Plan, adapter: &Adapter, model: &SeedModel) -> Result<Vec<Case>, BenchError> {
    let NamedSolid { name, mesh, .. } = &model.solid;
    let grid = Grid::with_resolution(mesh.bounds(), plan.resolution, LOD);
    let grid = grid.map_err(|error| BenchError::model(name, error))?;
    let solid = grid.quantise(mesh).map_err(|error| BenchError::model(name, error))?;
    let cpu = CpuSampler::default();
    let surface =
        |axis| cpu.sample_surface(&solid, axis, FillRule::EvenOdd).map_err(|error| BenchError::model(name, error));
    let exact: Vec<Ldi> = Axis::ALL.into_iter().map(surface).collect::<Result<_, _>>()?;
    let mut cases = Vec::new();
    for way in WAYS {
        eprintln!("{name}, {}", way.name);
        let options = GpuOptions { route: way.route, ..GpuOptions::default() };
        let sampler = GpuSampler::open(adapter, options).map_err(BenchError::Device)?;
        let expected = images(name, &cpu, &solid, way.mode)?;
        for (image, expected) in images(name, &sampler, &solid, way.mode)?.iter().zip(&expected) {
            check_twins(name, way.name, image, expected)?;
        }
        let sizes: Vec<Size> = exact
            .iter()
            .zip(&expected)
            .map(|(exact, image)| Size::of(&solid, exact, image.depths().len() as u64))
            .collect();
        let measured = rounds(plan.rounds, name, &sampler, &solid, way.mode)?;
        cases.push(Case {
            model: name,
            way: way.name,
            sizes: [sizes[0], sizes[1], sizes[2]],
            layers: [0, 1, 2].map(|axis| exact[axis].layers()),
            wall: measured.wall,
            span: measured.span,
            images: measured.images,
            sums_wall: measured.sums_wall,
            sums: measured.sums,
            stages: stages(&way.account(&sizes), &measured.dispatches),
            published_milliseconds: model.milliseconds,
        });
    }
    Ok(cases)
}

/// Returns the images along all axes.
fn images(name: &str, sampler: &dyn Sampler, solid: &LatticeSolid, mode: Mode) -> Result<Vec<Ldi>, BenchError> {
    sampler.sample_along(solid, &Axis::ALL, mode, FillRule::EvenOdd).map_err(|error| BenchError::model(name, error))
}

/// Checks that the images of GPU and CPU are identical to the bit.
fn check_twins(model: &str, way: &'static str, gpu: &Ldi, cpu: &Ldi) -> Result<(), BenchError> {
    match gpu == cpu {
        true => Ok(()),
        false => Err(BenchError::Twins { model: model.to_owned(), axis: gpu.axis().name(), way }),
    }
}

/// Medians over rounds of three images each, in seconds.
struct Measured {
    wall: f64,
    span: f64,
    images: Work,
    sums_wall: f64,
    sums: Work,
    /// Device times by dispatch.
    dispatches: Vec<(&'static str, f64)>,
}

/// Times three images in each round: stage by stage, then as a whole, then their sums.
fn rounds(
    rounds: usize,
    name: &str,
    sampler: &GpuSampler,
    solid: &LatticeSolid,
    mode: Mode,
) -> Result<Measured, BenchError> {
    let device = sampler.device();
    device.keep_stage_times(true);
    let (mut spans, mut times) = (Vec::new(), Vec::new());
    for round in 0..WARM_UP + rounds {
        images(name, sampler, solid, mode)?;
        let taken = device.take_stage_times();
        if round >= WARM_UP {
            let begin = taken.iter().map(|time| time.begin).fold(f64::INFINITY, f64::min);
            let end = taken.iter().map(|time| time.begin + time.seconds).fold(f64::NEG_INFINITY, f64::max);
            spans.push((end - begin).max(0.0));
            times.push(taken);
        }
    }
    device.keep_stage_times(false);
    let (wall, images) = walls(rounds, device, || images(name, sampler, solid, mode))?;
    let sums = || sampler.volume_sums_along(solid, &Axis::ALL, mode, FillRule::EvenOdd);
    let (sums_wall, sums) = walls(rounds, device, || sums().map_err(|error| BenchError::model(name, error)))?;
    Ok(Measured { wall, span: median(spans), images, sums_wall, sums, dispatches: medians_by_name(&times) })
}

/// Returns the median wall time of some work, and what the device was given to do for it.
fn walls<T>(
    rounds: usize,
    device: &Device,
    run: impl Fn() -> Result<T, BenchError>,
) -> Result<(f64, Work), BenchError> {
    let (mut walls, mut work) = (Vec::new(), Work::default());
    for round in 0..1 + rounds {
        device.take_counters();
        let start = Instant::now();
        drop(run()?);
        let wall = start.elapsed().as_secs_f64();
        work = device.take_counters().into();
        if round > 0 {
            walls.push(wall);
        }
    }
    Ok((median(walls), work))
}

/// Returns the median over rounds of each name's sum within a round, in the order of first appearance.
fn medians_by_name(rounds: &[Vec<StageTime>]) -> Vec<(&'static str, f64)> {
    let mut names: Vec<&'static str> = Vec::new();
    for time in rounds.iter().flatten() {
        if !names.contains(&time.stage) {
            names.push(time.stage);
        }
    }
    let sum = |name: &str, round: &Vec<StageTime>| -> f64 {
        round.iter().filter(|time| time.stage == name).map(|time| time.seconds).sum()
    };
    names.into_iter().map(|name| (name, median(rounds.iter().map(|round| sum(name, round)).collect()))).collect()
}

/// Returns the stages of all directions: those in the accounts, then those that are only timed.
fn stages(accounts: &[Vec<(&'static str, Moved)>], times: &[(&'static str, f64)]) -> Vec<Stage> {
    let mut stages: Vec<Stage> = Vec::new();
    let mut of_name = |name: &'static str, moved: Moved, dispatch: Option<(&'static str, f64)>| {
        let place = stages.iter().position(|stage| stage.name == name).unwrap_or_else(|| {
            stages.push(Stage { name, dispatches: Vec::new(), moved: Moved::default() });
            stages.len() - 1
        });
        stages[place].moved += moved;
        stages[place].dispatches.extend(dispatch);
    };
    accounts.iter().flatten().for_each(|&(name, moved)| of_name(name, moved, None));
    for &(dispatch, seconds) in times {
        // A dispatch is named by its stage, with its part of it in brackets.
        let name = dispatch.split(" (").next().unwrap_or(dispatch);
        of_name(name, Moved::default(), Some((dispatch, seconds)));
    }
    stages
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use ldi_ops::mesh::ClosedMesh;

    fn time(stage: &'static str, seconds: f64) -> StageTime {
        StageTime { stage, begin: 0.0, seconds }
    }

    #[test]
    fn medians_are_of_the_sums_of_rounds() {
        let round = |a: f64, b: f64| vec![time("masks", a), time("scan", 0.5), time("masks", b)];
        let rounds = [round(1.0, 2.0), round(5.0, 5.0), round(0.0, 4.0)];
        assert_eq!(medians_by_name(&rounds), [("masks", 4.0), ("scan", 0.5)]);
        assert_eq!(medians_by_name(&[Vec::new(), Vec::new()]), []);
    }

    #[test]
    fn dispatches_meet_the_account_of_their_stage() {
        let moved = Moved { bytes: 10, atomics: 2, contended: 1 };
        let account = vec![("masks", moved), (READ_BACK, moved)];
        let times = [("masks", 1.0), ("identities", 0.25), ("masks (rows)", 2.0), (READ_BACK, 8.0)];
        let stages = stages(&[account.clone(), account], &times);
        let told: Vec<_> = stages.iter().map(|stage| (stage.name, stage.seconds(), stage.moved.bytes)).collect();
        assert_eq!(told, [("masks", 3.0, 20), (READ_BACK, 8.0, 20), ("identities", 0.25, 0)]);
        let size = Size {
            triangles: 0,
            positions: 0,
            rays: 0,
            mask_words: 0,
            crossings: 0,
            crossed_rays: 0,
            crossed_words: 0,
            samples: 0,
        };
        let mut case = Case {
            model: "box",
            way: "over by masks",
            sizes: [size; 3],
            layers: [2; 3],
            wall: 20.0,
            span: 0.0,
            images: Work::default(),
            sums_wall: 10.0,
            sums: Work::default(),
            stages,
            published_milliseconds: 1.0,
        };
        // The readback is not part of the whole.
        assert_eq!((case.whole(), case.moved().bytes), (3.25, 20));
        case.stages.iter_mut().for_each(|stage| stage.dispatches.clear());
        assert_eq!((case.whole(), case.moved().bytes), (20.0, 20));
    }

    #[test]
    fn images_that_differ_are_told() {
        let cube = |side| ClosedMesh::check(ldi_ops::solids::cuboid(DVec3::ZERO, DVec3::splat(side)).unwrap()).unwrap();
        let (cube, smaller) = (cube(8.0), cube(7.0));
        let grid = Grid::with_resolution(cube.bounds(), 16, 64).unwrap();
        let image = |mesh| {
            let solid = grid.quantise(mesh).unwrap();
            CpuSampler::default().sample(&solid, Axis::Y, Mode::Exact, FillRule::EvenOdd).unwrap()
        };
        assert!(check_twins("box", "exact by lists", &image(&cube), &image(&cube)).is_ok());
        let told = check_twins("box", "exact by lists", &image(&cube), &image(&smaller)).unwrap_err().to_string();
        for part in ["box", "along y", "exact by lists"] {
            assert!(told.contains(part), "{told}");
        }
    }

    #[test]
    fn models_are_chosen_by_part_of_their_name() {
        let known = ["chain", "brush", "geodesic structure"];
        let names = |wanted: &[&str]| chosen(&known, &wanted.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        assert_eq!(names(&["Geodesic", "chain"]).unwrap(), ["chain", "geodesic structure"]);
        assert_eq!(names(&[]).unwrap(), known);
        assert!(names(&["chain", "teapot"]).unwrap_err().to_string().contains("teapot"));
    }
}
