//! `clash`: the parts of an assembly that overlap, touch or come too near.
//!
//! `parts` reads files, folders and assemblies; `plan` finds the pairs to compare, by the [`rules`], and joins what is found of
//! them; `compare` classifies pairs by the geometry of `crate::clash`; `overlap` measures the volume that two parts share.

#[cfg(feature = "report")]
mod assembly;
mod build;
mod compare;
mod overlap;
mod parts;
mod plan;
pub mod rules;

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;

use super::input::{InputRequirements, Sides, Solid};
use super::job::{Backend, Input, Openness, Spacing};
use crate::length::Length;
use crate::mesh::{Aabb, LengthUnit};
use crate::progress::Monitor;
use crate::sampler::FillRule;
use crate::{Error, Warning};
use rules::{Finding, Rules};

pub use build::{Clash, DEFAULT_RAYS};
pub use overlap::{Overlap, OverlapMethod};
pub use plan::{ClashPlan, ComparedPair};

/// Comparison of the parts of an assembly.
#[derive(Clone, Debug)]
pub struct ClashJob {
    /// Mesh files, assemblies and folders, and where to place their parts.
    pub inputs: Vec<Input>,
    /// A list of parts with their places, `.toml`.
    pub assembly: Option<PathBuf>,
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The settings of the comparison.
    pub settings: Settings,
}

/// The settings of a comparison.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The fill rule.
    pub fill: FillRule,
    /// The least distance that two parts must keep.
    pub clearance: Option<Length>,
    /// The largest gap or depth that counts as touching; by default, the rounding of 32-bit coordinates.
    pub touching: Option<Length>,
    /// The raster where an overlap is sampled; a resolution is that along the longest side of the box that two parts share.
    pub spacing: Spacing<Length>,
    /// The device that samples; `auto` is the CPU, as the images are small.
    pub backend: Backend,
    /// What is allowed.
    pub rules: Rules,
    /// The most bytes that the process may hold; a share of the free memory without it.
    pub memory: Option<u64>,
}

/// The result of a comparison.
#[derive(Clone)]
pub struct Clashes {
    /// The parts.
    pub parts: Vec<Part>,
    /// The unit of all lengths, where it is known.
    pub unit: Option<LengthUnit>,
    /// The least distance that two parts must keep, if one was given.
    pub clearance: Option<f64>,
    /// The pairs whose boxes come near one another, the worst first.
    pub pairs: Vec<Pair>,
    /// The number of near pairs that were ignored by a rule.
    pub ignored: usize,
    /// Times by stage.
    pub seconds: ClashSeconds,
    /// Warnings about the inputs and the overlaps.
    pub warnings: Vec<Warning>,
}

/// A part.
#[derive(Clone)]
pub struct Part {
    /// Its name: that of its file, and its own within an assembly.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// The placed solid.
    pub solid: Solid,
}

/// Two parts whose boxes come near one another.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The numbers of the parts.
    pub parts: [usize; 2],
    /// How they lie to one another.
    pub relation: Relation,
    /// The rule that the pair breaks.
    pub finding: Option<Finding>,
}

/// How two parts lie to one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relation {
    /// They share no point.
    Separate {
        /// Their distance, a lower bound but for the rounding of the last digit.
        distance: f64,
        /// The nearest points.
        points: [DVec3; 2],
    },
    /// They come so near, or overlap by so little, as coordinates are rounded.
    Touching {
        /// Their distance; 0 where their surfaces meet.
        distance: f64,
        /// An upper bound of the depth of the overlap, or the tolerance where the common volume is that of so thin a layer; 0 where
        /// they share no region.
        depth_bound: f64,
        /// The nearest points.
        points: [DVec3; 2],
    },
    /// They share a volume.
    Overlapping(Common),
}

/// The region that two parts share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Common {
    /// Its volume.
    pub volume: Overlap,
    /// The box around it.
    pub bounds: Aabb,
    /// The centre of the largest ball in it that was found.
    pub deepest: DVec3,
    /// The diameter of that ball, a lower bound of the depth.
    pub depth: f64,
    /// An upper bound of the depth.
    pub depth_bound: f64,
    /// The place of the part, in the pair, that lies wholly in the other.
    pub contained: Option<usize>,
    /// True if the depth or the volume proves that the parts overlap by more than they may touch.
    pub is_certain: bool,
}

/// Times by stage.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "report", derive(serde::Serialize))]
pub struct ClashSeconds {
    /// Reading and checking.
    pub read: f64,
    /// The hierarchies of all parts, and the pairs of near boxes.
    pub prepare: f64,
    /// The comparison of all near pairs.
    pub compare: f64,
    /// Pictures and files.
    pub write: f64,
    /// The total.
    pub total: f64,
}

impl Relation {
    /// Returns the name of the state: `separate`, `touching` or `overlapping`.
    pub fn name(&self) -> &'static str {
        match self {
            Relation::Separate { .. } => "separate",
            Relation::Touching { .. } => "touching",
            Relation::Overlapping(_) => "overlapping",
        }
    }

    /// Returns the deepest place of the overlap, or the middle of the nearest points.
    pub fn place(&self) -> DVec3 {
        match self {
            Relation::Separate { points: [p, q], .. } | Relation::Touching { points: [p, q], .. } => 0.5 * (p + q),
            Relation::Overlapping(common) => common.deepest,
        }
    }
}

impl Clashes {
    /// Returns the pairs that break a rule, the worst first.
    pub fn findings(&self) -> impl Iterator<Item = &Pair> {
        self.pairs.iter().filter(|pair| pair.finding.is_some())
    }

    /// Returns the number of pairs of all parts.
    pub fn possible_pairs(&self) -> usize {
        self.parts.len() * (self.parts.len() - 1) / 2
    }

    /// Returns the place of a pair, without the rounding of coordinates that are zero.
    pub fn place(&self, pair: &Pair) -> DVec3 {
        let boxes = pair.parts.map(|part| self.parts[part].solid.bounds());
        let least = 1e-12 * boxes.map(|b| b.min.abs().max(b.max.abs()).max_element()).into_iter().fold(0.0, f64::max);
        let place = pair.relation.place().to_array();
        DVec3::from_array(place.map(|value| if value.abs() < least { 0.0 } else { value }))
    }

    /// Returns the names of the parts of a pair.
    pub fn names(&self, pair: &Pair) -> [&str; 2] {
        pair.parts.map(|part| self.parts[part].name.as_str())
    }
}

/// Reads the parts of a job and compares them. The total time counts from `start`.
///
/// # Errors
/// Inputs that cannot be read or bound no solid, fewer than two parts, and parts that would not fit into memory.
pub fn clash_files(job: &ClashJob, start: Instant, progress: &Monitor) -> Result<Clashes, Error> {
    progress.stage("reading")?;
    let (parts, warnings) = parts::read(job, progress)?;
    progress.detail(format_args!("read {} parts in {:.4} s", parts.len(), start.elapsed().as_secs_f64()));
    ClashPlan::new(parts, warnings, job.settings.clone(), start)?.compare_all(progress)
}

/// Returns whether a path is that of a list of parts.
fn is_list(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// Returns the requirements on the parts of a job.
fn requirements(unit: Option<LengthUnit>, fill: FillRule) -> InputRequirements {
    InputRequirements { unit, openness: Openness::Refused, sides: Sides::NotNeeded, fill, hashes: false }
}
