//! The comparison of pairs of parts.

use std::sync::OnceLock;

use crate::parallel::*;

use super::overlap::{Found, Room, overlap};
use super::plan::ComparedPair;
use super::{Common, Part, Relation, Settings};
use crate::clash::{Body, Nearest, Region, bytes_of_triangle, nearest, region};
use crate::driver::backend::Backends;
use crate::driver::fill::FillDifference;
use crate::driver::input::Solid;
use crate::driver::job::Backend;
use crate::driver::machine;
use crate::driver::memory::{self, Cost, Limit};
use crate::mesh::{Aabb, TriangleMesh};
use crate::progress::Monitor;
use crate::{Error, Warning, unit};

/// The parts and what they are compared by.
pub struct Comparison<'c> {
    parts: &'c [Part],
    /// The pairs to compare.
    pairs: &'c [[usize; 2]],
    /// The hierarchies of the parts of these pairs.
    bodies: Vec<Option<Body<'c>>>,
    /// The thickness of each of these parts.
    thickness: Vec<Option<f64>>,
    /// The largest gap or depth that counts as touching, if one was given.
    touching: Option<f64>,
    settings: &'c Settings,
    backends: Backends,
    /// The warning of each part whose fill rules matter, found when it is first needed.
    fill_warnings: Vec<OnceLock<Option<Warning>>>,
}

/// How two parts meet, before the volume that they share is known.
enum Meeting {
    /// They share none.
    Known(Relation),
    /// They share a region.
    Shares(Shared),
}

/// The region that two parts share.
struct Shared {
    region: Region,
    /// The place of the part, in the pair, that lies wholly in the other.
    whole: Option<usize>,
    /// The largest gap or depth that counts as touching.
    tolerance: f64,
    /// The distance of the surfaces, if one part holds shells of the other.
    distance: f64,
    /// What the pair is if its common volume may come from rounding.
    touching: Relation,
}

/// The rounding of a coordinate, as a share of the largest: two units in the last place of a 32-bit number, once for each
/// part.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64 / 2.0;

/// The largest gap or depth of touching parts, as a share of the thickness of either. Beside a far larger part, or far from the
/// origin, the rounding of 32-bit coordinates is more than a small part can be off by without being out of shape.
const SHARE_OF_PART: f64 = 0.01;

/// The code of the warning about a gap or an overlap that coordinates of 32 bits do not tell from a contact.
pub const WITHIN_ROUNDING: &str = "within-rounding";

/// Returns the largest gap or depth that comes from coordinates that were rounded to 32 bits.
pub fn rounding(boxes: &[Aabb]) -> f64 {
    let largest = boxes.iter().map(|b| b.min.abs().max(b.max.abs()).max_element()).fold(0.0, f64::max);
    ROUNDING * largest
}

/// Returns the mean thickness of a solid: what a plate of its volume and area has. It does not depend on how the solid is turned.
fn thickness(solid: &Solid) -> f64 {
    2.0 * solid.volume.abs() / solid.mesh().area()
}

impl<'c> Comparison<'c> {
    /// Builds the hierarchies of the parts of some pairs.
    ///
    /// # Errors
    /// Parts whose hierarchies would not fit into memory, and a device that does not exist.
    pub fn new(
        parts: &'c [Part],
        pairs: &'c [[usize; 2]],
        touching: Option<f64>,
        settings: &'c Settings,
        progress: &Monitor,
    ) -> Result<Comparison<'c>, Error> {
        let backends = Backends::open(match &settings.backend {
            Backend::Auto => &Backend::Cpu,
            backend => backend,
        })?;
        let mut is_compared = vec![false; parts.len()];
        pairs.iter().flatten().for_each(|&part| is_compared[part] = true);
        let compared: Vec<Option<&Part>> =
            parts.iter().zip(is_compared).map(|(part, is_compared)| is_compared.then_some(part)).collect();
        let count = admit(compared.iter().flatten().copied(), settings.memory)?;
        progress.stage(format!("hierarchies of {count} parts"))?;
        let body = |part: &Option<&'c Part>| part.map(|part| Body::new(part.solid.mesh(), settings.fill));
        let bodies = compared.par_iter().map(body).collect();
        let thickness = compared.par_iter().map(|part| part.map(|part| thickness(&part.solid))).collect();
        let fill_warnings = parts.iter().map(|_| OnceLock::new()).collect();
        Ok(Comparison { parts, pairs, bodies, thickness, touching, settings, backends, fill_warnings })
    }

    /// Compares the pairs.
    ///
    /// # Errors
    /// Parts that no lattice holds.
    pub fn run(&self, progress: &Monitor) -> Result<Vec<ComparedPair>, Error> {
        progress.stage(format!("comparing {} pairs", self.pairs.len()))?;
        progress.expect(self.pairs.len())?;
        let room = Room { held: machine::held_memory(), limit: Limit::new(self.settings.memory), beside: 0 };
        let done = |parts, relation, mut warnings: Vec<Warning>| -> Result<ComparedPair, Error> {
            progress.step()?;
            warnings.extend(self.rounding_warning(parts, &relation));
            Ok(ComparedPair::new(parts, relation, warnings))
        };
        let others = rayon::current_num_threads().min(self.pairs.len()).saturating_sub(1);
        let beside_others = |&pair: &[usize; 2]| -> Result<Result<ComparedPair, Shared>, Error> {
            let shared = match self.meeting(pair) {
                Meeting::Known(relation) => return Ok(Ok(done(pair, relation, Vec::new())?)),
                Meeting::Shares(shared) => shared,
            };
            Ok(match self.overlapping(pair, &shared, Room { beside: others, ..room })? {
                Some((relation, warnings)) => Ok(done(pair, relation, warnings)?),
                None => Err(shared),
            })
        };
        let compared = self.pairs.par_iter().map(beside_others).collect::<Result<Vec<_>, Error>>()?;
        // Pairs whose volume does not fit beside others follow one after another.
        let alone = |(compared, &pair): (Result<ComparedPair, Shared>, _)| match compared {
            Ok(compared) => Ok(compared),
            Err(shared) => {
                let found = self.overlapping(pair, &shared, room)?;
                let (relation, warnings) = found.expect("a pair alone has a volume");
                done(pair, relation, warnings)
            }
        };
        compared.into_iter().zip(self.pairs).map(alone).collect()
    }

    /// Returns how two parts meet.
    fn meeting(&self, [i, j]: [usize; 2]) -> Meeting {
        let [a, b] = [i, j].map(|part| self.bodies[part].as_ref().expect("the parts of the pairs have hierarchies"));
        let boxes = [i, j].map(|part| self.parts[part].solid.bounds());
        // That of rounding, but no noticeable share of either part.
        let thickness = [i, j].into_iter().filter_map(|part| self.thickness[part]).fold(f64::INFINITY, f64::min);
        let tolerance = self.touching.unwrap_or_else(|| rounding(&boxes).min(SHARE_OF_PART * thickness));
        let Nearest { distance, points } = nearest(a, b);
        let Held { any, whole } = if distance > 0.0 { held(a, b) } else { Held { any: true, whole: None } };
        if !any {
            return Meeting::Known(match distance <= tolerance {
                true => Relation::Touching { distance, depth_bound: 0.0, points },
                false => Relation::Separate { distance, points },
            });
        }
        let touching = |depth_bound| Relation::Touching { distance, depth_bound, points };
        match region(a, b) {
            Some(Region { depth_bound, .. }) if distance <= tolerance && depth_bound <= tolerance => {
                Meeting::Known(touching(depth_bound))
            }
            // If it touches, then because the common volume is that of so thin a layer.
            Some(region) => {
                Meeting::Shares(Shared { region, whole, tolerance, distance, touching: touching(tolerance) })
            }
            None => Meeting::Known(touching(0.0)),
        }
    }

    /// Returns how two parts lie to one another that share a region, and warnings about their overlap; `None` if the common volume
    /// does not fit while other pairs that take as much memory are compared.
    fn overlapping(
        &self,
        [i, j]: [usize; 2],
        &Shared { region, whole, tolerance, distance, touching }: &Shared,
        room: Room,
    ) -> Result<Option<(Relation, Vec<Warning>)>, Error> {
        let solids = [&self.parts[i].solid, &self.parts[j].solid];
        let names = [i, j].map(|part| self.parts[part].name.as_str());
        let Region { bounds, deepest, depth, depth_bound } = region;
        let Some(found) = overlap(solids, names, bounds, (self.settings, &self.backends), room)? else {
            return Ok(None);
        };
        let Found { volume, with_meeting_shells, mut warnings } = found;
        for place in with_meeting_shells {
            warnings.extend(self.fill_warning([i, j][place])?);
        }
        // A layer of the depth of touching, on the surface of the part that has less of it there.
        let layer = tolerance
            * solids.map(|solid| area_within(solid.mesh(), &bounds)).into_iter().fold(f64::INFINITY, f64::min);
        // However thin a shell is, it does not touch what it lies in at a distance.
        let is_certain = depth > tolerance || volume.lower > layer || distance > tolerance;
        if !is_certain && volume.value <= layer {
            return Ok(Some((touching, warnings)));
        }
        let common = Common { volume, bounds, deepest, depth, depth_bound, contained: whole, is_certain };
        Ok(Some((Relation::Overlapping(common), warnings)))
    }

    /// Returns a warning if two parts would touch, were it not for the share of a part that a contact may take.
    fn rounding_warning(&self, parts: [usize; 2], relation: &Relation) -> Option<Warning> {
        let [a, b] = parts.map(|part| &self.parts[part]);
        let rounding = rounding(&[a.solid.bounds(), b.solid.bounds()]);
        let (what, amount) = match relation {
            Relation::Overlapping(common) if common.contained.is_none() => ("a depth of about", common.depth),
            Relation::Separate { distance, .. } => ("a distance of", *distance),
            Relation::Overlapping(_) | Relation::Touching { .. } => return None,
        };
        // Nothing is known of the depth where no ball was found.
        if self.touching.is_some() || amount > rounding || amount == 0.0 {
            return None;
        }
        let length = |length| unit::rounded(length, self.parts[0].solid.unit);
        let message = format!(
            "{} : {}: {what} {} is within {}, by which coordinates of this size are rounded in files of 32-bit numbers, but more \
             than {} % of the thickness of a part; set --touching to the largest gap or depth that counts as touching",
            a.name,
            b.name,
            length(amount),
            length(rounding),
            100.0 * SHARE_OF_PART,
        );
        Some(Warning::new(WITHIN_ROUNDING, message))
    }

    /// Returns the warning of a part whose volume depends on the fill rule.
    fn fill_warning(&self, part: usize) -> Result<Option<Warning>, Error> {
        let (cell, solid) = (&self.fill_warnings[part], &self.parts[part].solid);
        if let Some(found) = cell.get() {
            return Ok(found.clone());
        }
        let difference = FillDifference::exact(solid)?;
        let warning = difference.and_then(|difference| difference.warning(solid, self.settings.fill));
        Ok(cell.get_or_init(|| warning).clone())
    }
}

/// Refuses parts whose hierarchies would not fit into memory, and returns the number of parts.
fn admit<'p>(parts: impl Iterator<Item = &'p Part>, limit: Option<u64>) -> Result<usize, Error> {
    let (count, triangles) =
        parts.fold((0, 0), |(count, sum), part| (count + 1, sum + part.solid.mesh().triangles.len()));
    let fixed = machine::held_memory() as f64 + bytes_of_triangle() * triangles as f64;
    let cost = Cost { fixed, ..Cost::default() };
    let subject = format_args!("the {triangles} triangles of {count} parts");
    memory::admit(&[cost], Limit::new(limit), subject, |_| "compare fewer parts at a time".to_owned())?;
    Ok(count)
}

/// The shells of bodies whose surfaces do not meet that lie in the other body.
struct Held {
    /// True if any shell lies in the other body.
    any: bool,
    /// The body whose shells all lie in the other, if none of the other's lies in it.
    whole: Option<usize>,
}

fn held(a: &Body, b: &Body) -> Held {
    let inside = |body: &Body, other: &Body| {
        let points = body.points_of_shells();
        let count = points.iter().filter(|point| other.contains(**point)).count();
        (count, points.len())
    };
    let (of_a, of_b) = (inside(a, b), inside(b, a));
    let whole = match (of_a, of_b) {
        ((count, all), (0, _)) if count == all => Some(0),
        ((0, _), (count, all)) if count == all => Some(1),
        _ => None,
    };
    Held { any: of_a.0 + of_b.0 > 0, whole }
}

/// Returns the area of the triangles whose boxes meet a box.
fn area_within(mesh: &TriangleMesh, bounds: &Aabb) -> f64 {
    let corners = mesh.triangles.iter().map(|triangle| triangle.map(|index| mesh.positions[index as usize]));
    corners
        .filter(|[a, b, c]| a.min(*b).min(*c).cmple(bounds.max).all() && a.max(*b).max(*c).cmpge(bounds.min).all())
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length())
        .sum()
}
