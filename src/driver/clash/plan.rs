//! The plan of a comparison: the pairs to compare, and the join of what is found of them.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Instant;

use crate::parallel::*;

use super::compare::{self, Comparison, WITHIN_ROUNDING};
use super::rules::{self, Limits};
use super::{ClashSeconds, Clashes, Pair, Part, Relation, Settings};
use crate::clash::{near_pairs, tiles};
use crate::driver::fill::PARTS_INSIDE_OUT;
use crate::driver::measured::{IMPRECISE, NOT_RESOLVED};
use crate::driver::refine::TOLERANCE_NOT_REACHED;
use crate::mesh::{Aabb, LengthUnit};
use crate::progress::Monitor;
use crate::{Error, Warning};

/// The parts of an assembly, in one unit, and the pairs of them to compare. Several processes may compare some pairs each; the
/// [join](ClashPlan::join) of their results is that of one.
///
/// ```
/// use glam::DVec3;
/// use ldi_ops::{Clash, Settings, Solid, solids};
///
/// let settings = Settings::default();
/// let cube = |x: f64| {
///     let mesh = solids::cuboid(DVec3::X * x, DVec3::X * x + DVec3::ONE)?;
///     Ok::<Solid, Box<dyn std::error::Error>>(Solid::from_triangles(mesh.positions, mesh.triangles)?)
/// };
/// let plan = Clash::of([("a", &cube(0.0)?), ("b", &cube(0.75)?), ("c", &cube(1.5)?)]).plan(&settings)?;
/// let mut compared = Vec::new();
/// for tile in plan.tiles(2) {
///     compared.extend(plan.compare(&tile, &settings)?);
/// }
/// assert_eq!(plan.join(compared)?.findings().count(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct ClashPlan {
    parts: Vec<Part>,
    settings: Settings,
    limits: Limits,
    /// The largest gap or depth that counts as touching, if one was given.
    touching: Option<f64>,
    /// The near pairs that no rule leaves out, in order.
    pairs: Vec<[usize; 2]>,
    /// The number of near pairs that a rule leaves out.
    ignored: usize,
    /// Warnings about the parts and the rules.
    warnings: Vec<Warning>,
    start: Instant,
    seconds: ClashSeconds,
}

/// Two parts that were compared.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ComparedPair {
    /// The numbers of the parts.
    pub parts: [usize; 2],
    /// How they lie to one another.
    pub relation: Relation,
    /// Warnings about their overlap.
    pub warnings: Vec<Warning>,
}

/// The codes of the warnings about a pair.
const WARNINGS: [&str; 7] = [
    "exact-volume-memory",
    "fill-rules-differ",
    IMPRECISE,
    NOT_RESOLVED,
    PARTS_INSIDE_OUT,
    TOLERANCE_NOT_REACHED,
    WITHIN_ROUNDING,
];

impl ComparedPair {
    pub(super) fn new(parts: [usize; 2], relation: Relation, warnings: Vec<Warning>) -> ComparedPair {
        let is_known = |warning: &Warning| WARNINGS.contains(&warning.code);
        debug_assert!(warnings.iter().all(is_known), "a code that `received` does not know: {warnings:?}");
        ComparedPair { parts, relation, warnings }
    }

    /// Returns a pair that another process compared, with the codes and messages of its warnings.
    ///
    /// # Errors
    /// Codes that no warning about a pair has.
    pub fn received(
        parts: [usize; 2],
        relation: Relation,
        warnings: impl IntoIterator<Item = (String, String)>,
    ) -> Result<ComparedPair, Error> {
        let warning = |(code, message): (String, String)| match WARNINGS.into_iter().find(|known| *known == code) {
            Some(code) => Ok(Warning::new(code, message)),
            None => Err(Error::Usage(format!("there is no warning `{code}` about a pair"))),
        };
        let warnings = warnings.into_iter().map(warning).collect::<Result<_, _>>()?;
        Ok(ComparedPair { parts, relation, warnings })
    }
}

/// The least length of a part and the greatest of all together, in file units: distances are roots of products of six lengths, with
/// errors of 2^-104, which `f64` must hold.
const SIDES: [f64; 2] = [1e-45, 1e45];

impl ClashPlan {
    /// Finds the pairs to compare, of parts in one unit; `warnings` are those about the parts. Times count from `start`.
    ///
    /// # Errors
    /// Fewer than two parts, open meshes, parts too small or too large, and lengths in a unit that the parts do not have.
    pub(super) fn new(
        parts: Vec<Part>,
        mut warnings: Vec<Warning>,
        settings: Settings,
        start: Instant,
    ) -> Result<ClashPlan, Error> {
        let read = start.elapsed().as_secs_f64();
        let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
        if parts.len() < 2 {
            return Err(Error::input(format!(
                "{}: one part alone clashes with nothing; name two files, a folder or an assembly of several parts",
                names.join(", ")
            )));
        }
        if let Some(open) = parts.iter().find(|part| !part.solid.is_closed()) {
            return Err(Error::input(format!("{}: the mesh is not closed, so it bounds no solid", open.name)));
        }
        let boxes = boxes(&parts);
        let longest = |bounds: &Aabb| bounds.extent().max_element();
        let all = boxes.iter().copied().reduce(Aabb::union).expect("there are parts");
        let refused = |name: &str, bounds: &Aabb| {
            let (side, [least, most]) = (longest(bounds), SIDES);
            Error::input(format!(
                "{name}: the longest side of the box is {side:e}, and distances are computed for sides from {least:e} to \
                 {most:e}; scale all parts"
            ))
        };
        if let Some((part, bounds)) = parts.iter().zip(&boxes).find(|(_, bounds)| longest(bounds) < SIDES[0]) {
            return Err(refused(&part.name, bounds));
        }
        if longest(&all) > SIDES[1] {
            return Err(refused(&format!("all {} parts", parts.len()), &all));
        }
        let unit = parts[0].solid.unit;
        let limits = settings.rules.limits(settings.clearance, unit)?;
        settings.spacing.in_unit(unit)?;
        let touching = settings.touching.map(|length| length.in_unit(unit, "--touching")).transpose()?;
        let (ignored, about_rules) = settings.rules.ignored(&names)?;
        warnings.extend(about_rules);
        let reach = limits.clearance.unwrap_or(0.0).max(touching.unwrap_or_else(|| compare::rounding(&boxes)));
        let (left_out, pairs): (Vec<_>, Vec<_>) =
            near_pairs(&boxes, reach).into_iter().partition(|&pair| ignored.contains(pair));
        let prepare = start.elapsed().as_secs_f64() - read;
        let seconds = ClashSeconds { read, prepare, ..ClashSeconds::default() };
        let ignored = left_out.len();
        Ok(ClashPlan { parts, settings, limits, touching, pairs, ignored, warnings, start, seconds })
    }

    /// Returns the unit of all parts, where it is known.
    pub fn unit(&self) -> Option<LengthUnit> {
        self.parts[0].solid.unit
    }

    /// Returns the pairs to compare, in order.
    pub fn pairs(&self) -> &[[usize; 2]] {
        &self.pairs
    }

    /// Returns the pairs to compare in at most `count` groups of about equal cost. The pairs of a group lie close together, so that
    /// they have few parts.
    pub fn tiles(&self, count: usize) -> Vec<Vec<[usize; 2]>> {
        let triangles = |part: usize| self.parts[part].solid.mesh().triangles.len() as f64;
        tiles(&boxes(&self.parts), &self.pairs, |[i, j]| triangles(i) + triangles(j), count)
    }

    /// Returns a hash of the mesh of each part in the unit of the plan, by which processes check that they compare the same parts.
    /// It is the same in all processes of one build.
    pub fn fingerprints(&self) -> Vec<u64> {
        self.parts.par_iter().map(fingerprint).collect()
    }

    /// Compares pairs of parts.
    pub(super) fn compared(&self, pairs: &[[usize; 2]], progress: &Monitor) -> Result<Vec<ComparedPair>, Error> {
        if let Some([i, j]) = pairs.iter().find(|[i, j]| !(i < j && *j < self.parts.len())) {
            let count = self.parts.len();
            return Err(Error::Usage(format!("the parts {i} and {j} are no pair of {count} parts, in order")));
        }
        self.comparison(pairs, progress)?.run(progress)
    }

    fn comparison<'p>(&'p self, pairs: &'p [[usize; 2]], progress: &Monitor) -> Result<Comparison<'p>, Error> {
        Comparison::new(&self.parts, pairs, self.touching, &self.settings, progress)
    }

    /// Compares all pairs of the plan.
    pub(super) fn compare_all(mut self, progress: &Monitor) -> Result<Clashes, Error> {
        let (left_out, near) = (self.ignored, self.pairs.len() + self.ignored);
        progress.detail(format_args!("{near} near pairs, {left_out} of them ignored"));
        let comparison = self.comparison(&self.pairs, progress)?;
        let prepare = self.start.elapsed().as_secs_f64() - self.seconds.read;
        let compared = comparison.run(progress)?;
        drop(comparison);
        self.seconds.prepare = prepare;
        self.join(compared)
    }

    /// Returns the comparison of all pairs, in whatever order and by whichever process they were compared.
    ///
    /// # Errors
    /// Pairs of which one is missing, occurs twice, or is not of this plan.
    pub fn join(self, compared: impl IntoIterator<Item = ComparedPair>) -> Result<Clashes, Error> {
        let mut compared: Vec<ComparedPair> = compared.into_iter().collect();
        compared.sort_by_key(|pair| pair.parts);
        if !compared.iter().map(|pair| &pair.parts).eq(&self.pairs) {
            let (given, planned) = (compared.len(), self.pairs.len());
            return Err(Error::Usage(format!("{given} pairs are not the {planned} pairs of the plan, each once")));
        }
        let unit = self.unit();
        let ClashPlan { parts, limits, ignored, mut warnings, start, mut seconds, .. } = self;
        let mut pairs = Vec::with_capacity(compared.len());
        for ComparedPair { parts, relation, warnings: found } in compared {
            pairs.push(Pair { parts, relation, finding: limits.finding(&relation) });
            for warning in found {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
        }
        pairs.sort_by(rules::by_severity);
        seconds.total = start.elapsed().as_secs_f64();
        seconds.compare = seconds.total - seconds.read - seconds.prepare;
        Ok(Clashes { parts, unit, clearance: limits.clearance, pairs, ignored, seconds, warnings })
    }
}

fn boxes(parts: &[Part]) -> Vec<Aabb> {
    parts.iter().map(|part| part.solid.bounds()).collect()
}

fn fingerprint(part: &Part) -> u64 {
    let mesh = part.solid.mesh();
    let mut hasher = DefaultHasher::new();
    mesh.triangles.hash(&mut hasher);
    for position in &mesh.positions {
        position.to_array().map(f64::to_bits).hash(&mut hasher);
    }
    hasher.finish()
}
