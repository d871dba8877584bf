//! What metrics make of voxel arrays that other programs are given, too, and how long each takes.
//!
//! Arrays come from `.npy` files of uint8, `a[i, j, k]` being the voxel (x, y, z) in whichever order they stand, and not 0
//! where solid; a voxel is 1 wide. All is said as JSON on stdout, in pitches. `tests/reference/metrics_peers.py` sets it
//! beside what PoreSpy, localthickness, scikit-image and scipy say.

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

/// What can be left out.
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
    /// All of them, in the order in which they are made.
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

/// What to measure.
pub struct Plan {
    /// Arrays, as `.npy`.
    pub arrays: Vec<PathBuf>,
    /// Balls of these radii in pitches, measured from their meshes.
    pub balls: Vec<u32>,
    /// What of arrays.
    pub measures: Vec<Measure>,
    /// Times that each is done; what is said is the median.
    pub rounds: usize,
    /// Where to write values of all voxels.
    pub maps: Option<PathBuf>,
    /// Threads; all there are by default.
    pub threads: Option<usize>,
}

/// Measures all arrays, and balls.
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
