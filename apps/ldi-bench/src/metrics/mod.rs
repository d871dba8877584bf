//! Metrics of voxel arrays that other programs also measure, with their times.
//!
//! Arrays come from `.npy` files of uint8; `a[i, j, k]` is the voxel (x, y, z) in any memory order, nonzero where solid; a
//! voxel is 1 wide. All results are printed as JSON on stdout, in pitches. `tests/reference/metrics_peers.py` compares them
//! with those of PoreSpy, localthickness, scikit-image and scipy.

mod array;
mod ball;
mod phase;

use std::path::PathBuf;
use std::time::Instant;

use ldi_ops::metrics::Phase;
use ldi_ops::metrics::profiles::profiles;
use serde_json::{Map, Value, json};

use self::array::Array;
use crate::BenchError;

/// A selectable measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Measure {
    /// Components, Euler characteristics, open pores
    Topology,
    /// Chords along each axis, by length
    Chords,
    /// Distances to the surface
    Distance,
    /// Local thickness
    Thickness,
    /// The largest ball that gets to each pore from outside, and through along each axis
    Access,
    /// Tortuosity of diffusion through the pores along each axis
    Diffusion,
    /// Tortuosity of the shortest ways through the pores along each axis
    Geodesic,
}

impl Measure {
    /// All measures, in the order of execution.
    pub const ALL: [Measure; 7] = [
        Measure::Topology,
        Measure::Chords,
        Measure::Distance,
        Measure::Thickness,
        Measure::Access,
        Measure::Diffusion,
        Measure::Geodesic,
    ];
}

/// The settings of a run.
pub struct Plan {
    /// Arrays, as `.npy` files.
    pub arrays: Vec<PathBuf>,
    /// Radii of balls in pitches, measured from their meshes.
    pub balls: Vec<u32>,
    /// Measures of arrays.
    pub measures: Vec<Measure>,
    /// Repetitions of each measure; the time is the median.
    pub rounds: usize,
    /// The folder for values of all voxels.
    pub maps: Option<PathBuf>,
    /// Number of threads; all by default.
    pub threads: Option<usize>,
}

/// Measures all arrays and balls.
pub fn run(plan: &Plan) -> Result<Value, BenchError> {
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(threads) = plan.threads {
        pool = pool.num_threads(threads);
    }
    let pool = pool.build().map_err(|error| BenchError::io("threads")(std::io::Error::other(error)))?;
    pool.install(|| {
        let arrays = plan.arrays.iter().map(|path| of_array(plan, path)).collect::<Result<Vec<Value>, BenchError>>()?;
        let balls =
            plan.balls.iter().map(|&radius| ball::of_ball(radius)).collect::<Result<Vec<Value>, BenchError>>()?;
        Ok(json!({"threads": rayon::current_num_threads(), "arrays": arrays, "balls": balls}))
    })
}

fn of_array(plan: &Plan, path: &PathBuf) -> Result<Value, BenchError> {
    let array = Array::read(path)?;
    let start = Instant::now();
    let solid = array.nodes.count();
    let porosity = (array.nodes.volume() as u64 - solid) as f64 / array.nodes.volume() as f64;
    let seconds = start.elapsed().as_secs_f64();
    let slices = profiles(&array.images, &array.region());
    let slices: Map<String, Value> =
        slices.into_iter().map(|profile| (profile.axis.name().to_owned(), json!(profile.porosities))).collect();
    let mut phases = Map::new();
    for phase in Phase::BOTH {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let maps = plan.maps.as_ref().map(|folder| folder.join(format!("{stem}.{}", phase.name())));
        let said = phase::measure(&array, phase, plan, maps.as_deref())?;
        phases.insert(phase.name().to_owned(), said);
    }
    Ok(json!({
        "array": path, "size": array.nodes.size(), "solid": solid, "porosity": porosity, "seconds": seconds,
        "profiles": slices, "phases": phases,
    }))
}
