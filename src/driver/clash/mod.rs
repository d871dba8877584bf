//! `clash`: the parts of an assembly that overlap, touch or come too near.
//!
//! `parts` reads files, folders and assemblies; [`rules`] says which pairs are compared and what is a finding; `compare`
//! classifies a pair by the geometry of `crate::clash`; `overlap` measures the volume that two parts share.

#[cfg(feature = "report")]
mod assembly;
mod build;
mod compare;
mod overlap;
mod parts;
pub mod rules;

use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use super::input::{InputRequirements, Sides, Solid};
use super::job::Openness;
use super::memory::{self, Cost, Limit};
use super::{machine, raster};
use crate::clash::{self, Body};
use crate::length::Length;
use crate::mesh::{Aabb, LengthUnit};
use crate::progress::Monitor;
use crate::sampler::FillRule;
use crate::{Error, Warning};
use compare::Comparison;
use overlap::Room;
use rules::{Finding, Rules};

pub use build::Clash;
pub use overlap::{Overlap, OverlapMethod};

/// Comparison of the parts of an assembly.
#[derive(Clone, Debug)]
pub struct ClashJob {
    /// Mesh files, assemblies and folders.
    pub inputs: Vec<PathBuf>,
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
    /// Rays along the longest side of the box that two parts share, where their overlap is sampled.
    pub resolution: u32,
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
    let read = start.elapsed().as_secs_f64();
    progress.detail(format_args!("read {} parts in {read:.4} s", parts.len()));
    let mut clashes = compare_parts(parts, &job.settings, progress)?;
    clashes.warnings.splice(0..0, warnings);
    clashes.seconds.read = read;
    clashes.seconds.total = start.elapsed().as_secs_f64();
    Ok(clashes)
}

/// Compares parts.
///
/// # Errors
/// Fewer than two parts, open meshes, lengths in a unit that the parts do not have, and parts that would not fit into memory.
pub fn compare_parts(parts: Vec<Part>, settings: &Settings, progress: &Monitor) -> Result<Clashes, Error> {
    if parts.len() < 2 {
        let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
        return Err(Error::input(format!(
            "{}: one part alone clashes with nothing; name two files, a folder or an assembly of several parts",
            names.join(", ")
        )));
    }
    if let Some(open) = parts.iter().find(|part| !part.solid.is_closed()) {
        return Err(Error::input(format!("{}: the mesh is not closed, so it bounds no solid", open.name)));
    }
    let unit = parts[0].solid.unit;
    let limits = settings.rules.limits(settings.clearance, unit)?;
    let touching = settings.touching.map(|length| length.in_unit(unit, "--touching")).transpose()?;
    let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
    let (ignored, mut distinct) = settings.rules.ignored(&names)?;
    admit(&parts, settings.memory)?;

    let preparing = Instant::now();
    progress.stage(format!("hierarchies of {} parts", parts.len()))?;
    let bodies: Vec<Body> = parts.par_iter().map(|part| Body::new(part.solid.mesh(), settings.fill)).collect();
    let boxes: Vec<Aabb> = parts.iter().map(|part| part.solid.bounds()).collect();
    let reach = limits.clearance.unwrap_or(0.0).max(touching.unwrap_or_else(|| compare::rounding(&boxes)));
    let near = clash::near_pairs(&boxes, reach);
    let (left_out, compared): (Vec<_>, Vec<_>) = near.into_iter().partition(|&pair| ignored.contains(pair));
    let prepare = preparing.elapsed().as_secs_f64();
    progress.detail(format_args!("{} near pairs, {} of them ignored", compared.len() + left_out.len(), left_out.len()));

    let comparing = Instant::now();
    progress.stage(format!("comparing {} pairs", compared.len()))?;
    progress.expect(compared.len())?;
    let fill_warnings = parts.iter().map(|_| OnceLock::new()).collect();
    let comparison = Comparison { parts: &parts, bodies: &bodies, touching, settings, fill_warnings };
    let room = Room { held: machine::held_memory(), limit: Limit::new(settings.memory), beside: 0 };
    let compare = |indices: [usize; 2], beside: usize| -> Result<Option<(Pair, Vec<Warning>)>, Error> {
        let Some((relation, warnings)) = comparison.relation(indices, Room { beside, ..room })? else {
            return Ok(None);
        };
        progress.step()?;
        let finding = limits.finding(&relation);
        Ok(Some((Pair { parts: indices, relation, finding }, warnings)))
    };
    let others = rayon::current_num_threads().min(compared.len()).saturating_sub(1);
    let at_once = compared.par_iter().map(|&indices| compare(indices, others)).collect::<Result<Vec<_>, Error>>()?;
    // Pairs too large to be compared beside others follow one after another.
    let alone = |(found, &indices)| match found {
        Some(found) => Ok(found),
        None => compare(indices, 0).map(|found| found.expect("a pair alone is compared")),
    };
    let compared = at_once.into_iter().zip(&compared).map(alone).collect::<Result<Vec<_>, Error>>()?;
    let (mut pairs, warnings): (Vec<Pair>, Vec<Vec<Warning>>) = compared.into_iter().unzip();
    pairs.sort_by(rules::by_severity);
    for warning in warnings.into_iter().flatten() {
        if !distinct.contains(&warning) {
            distinct.push(warning);
        }
    }
    drop(bodies);
    let compare = comparing.elapsed().as_secs_f64();
    let seconds = ClashSeconds { prepare, compare, ..ClashSeconds::default() };
    let clearance = limits.clearance;
    Ok(Clashes { parts, unit, clearance, pairs, ignored: left_out.len(), seconds, warnings: distinct })
}

/// Refuses parts whose hierarchies would not fit into memory.
fn admit(parts: &[Part], limit: Option<u64>) -> Result<(), Error> {
    let triangles: usize = parts.iter().map(|part| part.solid.mesh().triangles.len()).sum();
    let fixed = machine::held_memory() as f64 + clash::bytes_of_triangle() * triangles as f64;
    let cost = Cost { fixed, ..Cost::default() };
    let subject = format_args!("the {triangles} triangles of {} parts", parts.len());
    memory::admit(&[cost], Limit::new(limit), subject, |_| "compare fewer parts at a time".to_owned())
}

/// Returns the requirements on the parts of a job.
fn requirements(unit: Option<LengthUnit>, fill: FillRule) -> InputRequirements {
    InputRequirements { unit, openness: Openness::Refused, sides: Sides::NotNeeded, fill, hashes: false }
}
