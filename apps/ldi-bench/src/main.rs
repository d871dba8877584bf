//! Benchmarks of ldi-ops that print tables fit for a README: [`sampling`] alone, whole [`process`]es, [`exact`] volumes and meshes
//! beside those of other programs, [`minkowski`] sums, the [`gpu`]'s sampler by stages, [`metrics`] of voxel arrays that other
//! programs also measure, and the [`tables`] of Leung and Wang beside earlier methods, the [`rivals`]. The tables show medians; on
//! request, all data goes to a JSON file.

#![expect(clippy::print_stdout, reason = "tables on stdout, as each is done, are what this program is for")]

mod boolean_runner;
mod clash;
mod clock;
mod exact;
mod fit;
#[cfg(feature = "gpu")]
mod gpu;
mod machine;
mod metrics;
mod minkowski;
mod models;
mod peers;
mod process;
mod rivals;
mod sampling;
mod stop;
mod table;
mod tables;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

/// An error of a benchmark.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// An operation on a file or a process failed.
    #[error("{what}: {source}")]
    Io {
        /// The operation.
        what: String,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A program failed, or its output was unexpected.
    #[error("{program}: {said}")]
    Program {
        /// The program.
        program: String,
        /// Its output, or the fault in it.
        said: String,
    },
    /// A model could not be built, written or sampled.
    #[error("model {model}: {reason}")]
    Model {
        /// The model's name.
        model: String,
        /// The reason.
        reason: String,
    },
    /// A GPU could not be used.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Device(ldi_ops::gpu::DeviceError),
    /// The images of GPU and CPU differ.
    #[cfg(feature = "gpu")]
    #[error("model {model}: the image along {axis}, {way}, is not the same on the GPU as on the CPU")]
    Twins {
        /// The model's name.
        model: String,
        /// The axis.
        axis: &'static str,
        /// The kind of image and its algorithm.
        way: &'static str,
    },
}

impl BenchError {
    fn io(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> BenchError {
        |source| BenchError::Io { what: what.into(), source }
    }

    fn model(model: &str, reason: impl std::fmt::Display) -> BenchError {
        BenchError::Model { model: model.to_owned(), reason: reason.to_string() }
    }
}

/// Benchmarks of ldi-ops: tables in markdown on stdout.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    benchmark: Benchmark,
}

/// Whole processes of several programs.
#[derive(Args)]
struct Contest {
    /// The command line program, built for release
    #[arg(long, value_name = "PATH")]
    ldi_ops: PathBuf,
    /// A Python that has apps/ldi-bench/peers/requirements.txt; without it ldi-ops runs alone
    #[arg(long, value_name = "PATH")]
    python: Option<PathBuf>,
    /// The program that times the peers
    #[arg(long, value_name = "FILE", default_value = "apps/ldi-bench/peers/peers.py")]
    peers: PathBuf,
    /// Rounds; each runs every program once, in turn, so that slow spells of the machine hit all
    #[arg(long, default_value_t = 7)]
    runs: usize,
    /// Runs of a peer within one process, of which its medians are taken: its allocator is warm after the first
    #[arg(long, default_value_t = 3)]
    peer_runs: usize,
    /// Also write everything as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Contest {
    fn run(self, contest: impl Fn(&process::Plan, Option<&Path>) -> Result<(), BenchError>) -> Result<(), BenchError> {
        let Contest { ldi_ops, python, peers, runs, peer_runs, json } = self;
        let plan = process::Plan { ldi_ops, python, peers, runs: runs.max(1), peer_runs: peer_runs.max(1) };
        contest(&plan, json.as_deref())
    }
}

#[derive(Subcommand)]
enum Benchmark {
    /// The sampler by itself: time by model, axis, mode and threads; cost of a triangle, a crossing and a ray; growth
    Sampling {
        /// Timed runs of each case after the warm-up; medians are printed
        #[arg(long, default_value_t = 7)]
        runs: usize,
        /// Rays along the longest side of the tables by model
        #[arg(long, default_value_t = 512)]
        resolution: u32,
        /// Also write everything as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Whole processes, from files to a volume, beside manifold3d and trueform
    Process(Contest),
    /// Whole processes, from files to an exact volume, beside manifold3d, trueform and MeshLib
    Exact(Contest),
    /// Exact volumes and areas of the intersection, the union and the difference of two files, as JSON on stdout
    #[command(hide = true)]
    ExactProperties {
        /// The first file.
        a: PathBuf,
        /// The second file.
        b: PathBuf,
    },
    /// Whole processes, from files to a file with the exact mesh of the intersection, beside manifold3d, trueform and MeshLib
    Meshes(Contest),
    /// Time to a volume of 0.1 % and of 0.01 %, beside programs of meshes and of voxels, on six pairs
    Peers {
        /// Only the pairs of which one file has one of these names, with commas between
        #[arg(long, value_name = "NAMES", value_delimiter = ',')]
        only: Vec<String>,
        #[command(flatten)]
        contest: Contest,
    },
    /// Minkowski sums by stages, on pairs like those of Leung and Wang, beside manifold3d
    Minkowski {
        /// Only these pairs, by name, with commas between; a wrong name lists all
        #[arg(long, value_name = "NAMES", value_delimiter = ',')]
        pairs: Vec<String>,
        /// Rays along the longest side of the sum
        #[arg(long, default_value_t = 512)]
        resolution: u32,
        /// Timed rounds of each sum after the warm-up; medians are printed
        #[arg(long, default_value_t = 5)]
        runs: usize,
        /// GPU for crossings and gap resolution, by its name or a part of it [default: the CPU]
        #[arg(long, value_name = "NAME")]
        adapter: Option<String>,
        /// A Python that has apps/ldi-bench/peers/requirements.txt; without it ldi-ops runs alone
        #[arg(long, value_name = "PATH")]
        python: Option<PathBuf>,
        /// The program that times the peers
        #[arg(long, value_name = "FILE", default_value = "apps/ldi-bench/peers/peers.py")]
        peers: PathBuf,
        /// Seconds after which a peer is given up
        #[arg(long, value_name = "SECONDS", default_value_t = 300)]
        peer_timeout: u32,
        /// Also write everything as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// One sum of `minkowski`, as JSON on stdout
    #[command(hide = true)]
    MinkowskiCase {
        /// The pair's name.
        pair: String,
        #[arg(long)]
        resolution: u32,
        #[arg(long)]
        runs: usize,
        #[arg(long)]
        adapter: Option<String>,
    },
    /// The GPU's sampler by stages, on solids like those of Leung and Wang, beside the limit of its memory bandwidth and their
    /// table.
    ///
    /// Needs nothing but this binary and the GPU's driver. Every image is first compared with the CPU's.
    #[cfg(feature = "gpu")]
    Gpu {
        /// The GPU's name or part of it; the first by default, and a wrong name lists all
        #[arg(long, value_name = "NAME")]
        adapter: Option<String>,
        /// Only these models, by name or part of it, with commas between
        #[arg(long, value_name = "NAMES", value_delimiter = ',')]
        models: Vec<String>,
        /// Rays along the longest side
        #[arg(long, default_value_t = 512)]
        resolution: u32,
        /// Timed rounds of each case after the warm-up; medians are printed
        #[arg(long, default_value_t = 15)]
        rounds: usize,
        /// Also write everything as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// The whole process of `clash` on an assembly of bolts, plates and lattices
    Clash {
        /// The command line program, built for release
        #[arg(long, value_name = "PATH")]
        ldi_ops: PathBuf,
        /// Number of parts
        #[arg(long, default_value_t = 1000)]
        parts: usize,
        /// Runs; medians are printed
        #[arg(long, default_value_t = 3)]
        runs: usize,
        /// Also write everything as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Long operations, each stopped by its listener at random moments: how long they go on
    Stop {
        /// Only these operations, by name, with commas between; a wrong name lists all
        #[arg(long, value_name = "NAMES", value_delimiter = ',')]
        only: Vec<String>,
        /// Random moments for each operation
        #[arg(long, default_value_t = 50)]
        rounds: usize,
        /// Also write everything as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
    },
    /// Metrics of voxel arrays, as JSON on stdout, with how long each took
    Metrics {
        /// Arrays of uint8, not 0 where solid; a[i, j, k] is the voxel (x, y, z)
        #[arg(value_name = "ARRAY.npy", required_unless_present = "balls")]
        arrays: Vec<PathBuf>,
        /// Also the thickness of balls of these radii in pitches, from where rays meet their meshes
        #[arg(long, value_name = "RADII", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(2..=512))]
        balls: Vec<u32>,
        /// Only these, with commas between
        #[arg(long, value_name = "MEASURES", value_delimiter = ',', value_enum)]
        only: Vec<metrics::Measure>,
        /// Number of runs of each case; the median is reported
        #[arg(long, default_value_t = 1)]
        rounds: usize,
        /// Write values of all voxels to this folder, as ARRAY.PHASE.MEASURE.f32: little-endian, x fastest
        #[arg(long, value_name = "FOLDER")]
        maps: Option<PathBuf>,
        /// Threads; all that there are by default
        #[arg(long)]
        threads: Option<usize>,
    },
    /// The Booleans of a request of the open Boolean benchmark (solidean/boolean-benchmark-runners)
    BooleanRunner {
        /// The request, as JSON
        #[arg(long, value_name = "FILE")]
        request: PathBuf,
        /// Where the result is written, as JSON
        #[arg(long, value_name = "FILE")]
        result: PathBuf,
        /// Rays along the longest side where a mesh is made from images
        #[arg(long, default_value_t = 512)]
        rays: u32,
        /// Make every mesh from images, also where there is an exact one
        #[arg(long)]
        sampled: bool,
    },
    /// The tables of Leung and Wang on the CPU, beside earlier methods and what those lose
    #[command(after_help = "Examples:
  ldi-bench tables --quick                    smaller solids and rasters: a minute
  ldi-bench tables --json t.json --svg plots  everything, with its data and its plots")]
    Tables {
        /// Fewer and smaller solids and rasters
        #[arg(long)]
        quick: bool,
        /// Timed runs of each case after the warm-up, of which the medians are printed; a case of over a second has one
        #[arg(long, default_value_t = 3)]
        runs: usize,
        /// Also write everything as JSON
        #[arg(long, value_name = "FILE")]
        json: Option<PathBuf>,
        /// Write the plots to this folder, which exists, as tables-*.svg
        #[arg(long, value_name = "FOLDER")]
        svg: Option<PathBuf>,
    },
    /// Write the models of `process` to a folder
    #[command(hide = true)]
    Models {
        /// The folder, which exists.
        folder: PathBuf,
    },
    /// Write the models of `exact` and `meshes` to a folder
    #[command(hide = true)]
    ExactModels {
        /// The folder, which exists.
        folder: PathBuf,
    },
    /// Write the models like those of Leung and Wang to a folder, with a table of their sizes
    #[command(hide = true)]
    SeedModels {
        /// The folder, which exists.
        folder: PathBuf,
    },
}

fn main() -> ExitCode {
    let done = match Arguments::parse().benchmark {
        Benchmark::Sampling { runs, resolution, json } => {
            sampling::run(&sampling::Plan { runs: runs.max(1), resolution }, json.as_deref())
        }
        Benchmark::Process(contest) => contest.run(process::run),
        Benchmark::Exact(contest) => contest.run(exact::run),
        Benchmark::ExactProperties { a, b } => exact::properties([&a, &b]).map(|told| println!("{told}")),
        Benchmark::Meshes(contest) => contest.run(exact::run_meshes),
        Benchmark::Peers { only, contest } => contest.run(|plan, json| peers::run(plan, &only, json)),
        Benchmark::Minkowski { pairs, resolution, runs, adapter, python, peers, peer_timeout, json } => {
            let plan = minkowski::Plan { pairs, resolution, runs: runs.max(1), adapter, python, peers, peer_timeout };
            minkowski::run(&plan, json.as_deref())
        }
        Benchmark::MinkowskiCase { pair, resolution, runs, adapter } => {
            minkowski::run_case(&pair, resolution, runs.max(1), adapter.as_deref()).map(|told| println!("{told}"))
        }
        #[cfg(feature = "gpu")]
        Benchmark::Gpu { adapter, models, resolution, rounds, json } => {
            gpu::run(&gpu::Plan { adapter, models, resolution, rounds: rounds.max(1) }, json.as_deref())
        }
        Benchmark::Clash { ldi_ops, parts, runs, json } => {
            clash::run(&clash::Plan { ldi_ops, parts: parts.max(2), runs: runs.max(1) }, json.as_deref())
        }
        Benchmark::Stop { only, rounds, json } => stop::run(&only, rounds.max(1), json.as_deref()),
        Benchmark::Metrics { arrays, balls, only, rounds, maps, threads } => {
            let measures = if only.is_empty() { metrics::Measure::ALL.to_vec() } else { only };
            metrics::run(&metrics::Plan { arrays, balls, measures, rounds, maps, threads })
                .map(|told| println!("{told}"))
        }
        Benchmark::BooleanRunner { request, result, rays, sampled } => {
            boolean_runner::run(boolean_runner::Plan { rays, sampled }, &request, &result)
        }
        Benchmark::Tables { quick, runs, json, svg } => {
            let plan = if quick { tables::Plan::quick } else { tables::Plan::full };
            tables::run(&plan(runs.max(1)), json.as_deref(), svg.as_deref())
        }
        Benchmark::Models { folder } => models::write_all(&folder),
        Benchmark::ExactModels { folder } => models::write_for_exact(&folder),
        Benchmark::SeedModels { folder } => models::write_seeds(&folder).map(|table| print!("{}", table.markdown())),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("ldi-bench: error: {error}");
            ExitCode::FAILURE
        }
    }
}
