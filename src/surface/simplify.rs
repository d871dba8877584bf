//! Mesh simplification within a bound that is proved or measured, not merely requested.
//!
//! Edges are collapsed (`collapse`): the vertices of the result are some of the given ones, to the last bit. Each collapse is
//! tested: the surface stays a manifold with the same components and the same genus; it stays within the bound of the original, and
//! the original of it; no collapse turns a triangle by more than 60°; and the nodes of a grid keep their sides. The rest is verified
//! afterwards:
//! - no new triangle crosses another, whether exact or rounded to the precision of a file;
//! - the caller's own criterion: a function that takes the mesh and returns the places where it is not acceptable.
//!
//! # Patches
//! The surface is split into patches of some thousand triangles, at medians of centroids, with their borders locked. Each is
//! decimated by itself, in parallel and in coordinates of its own. Where a verification fails, vertices nearby are locked and the
//! patches there are decimated again; those that fail too often stay what they were before the pass, and if that does not help,
//! so do all. The borders are decimated in later passes, four at most, which split what is near them elsewhere, until a pass gains
//! little. Distances are always from the original, or from triangles within 1/256 of the bound of it.
//!
//! Where a fair share of the mesh is flat, a first pass removes what is flat within 1/256 of the bound; it only adds differences up.
//! The surface that it leaves takes the place of the original. It is verified with what the next pass makes of it, as few of its
//! triangles stay; if that fails, both are made anew, and the first pass is verified by itself.
//!
//! # Limitations
//! Where distances are measured, the original is measured at the vertices that the first pass leaves and at points of its large
//! triangles. Of new triangles, all sides are within the bound at every point, and the inside is measured at up to 4 points:
//! between these, it may be somewhat farther away, for which a tenth of the bound is left. Distances are from the corresponding
//! part of the surface, or from one beside it within the bound, and no less than the distance from the nearest part of all.

mod collapse;
mod face;
mod fan;
mod nodes;
mod original;
mod patch;
mod quadric;
mod samples;

use std::borrow::Cow;

use crate::parallel::*;
use glam::{DVec3, Vec3};
use rayon::iter::Either;
use thiserror::Error;

use self::collapse::{Age, NONE, Standing};
use self::original::{along, inside};
use self::patch::{Near, Patch, Share};
use super::bins::Bins;
use super::intersect::Placed;
use super::manifold::{Faults, ManifoldFailure, ManifoldReport};
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::face_tree::FaceTree;
use crate::grid::Grid;
use crate::mesh::{Aabb, Precision, TriangleMesh};

/// Most triangles in a patch.
const PATCH: usize = 1 << 13;

/// The split of each pass: the share of the triangles that goes to the lower side.
const SPLITS: [f64; 4] = [0.5, 0.37, 0.59, 0.45];

/// Number of edges from a vertex that may still be removed, up to which a pass divides the surface into patches; triangles farther
/// away stay as they are.
const RINGS: usize = 1;

/// A pass that removes less than this share of the triangles is the last.
const LEAST_GAIN: f64 = 0.08;

/// A triangle whose distance from the original is at most this share of the bound takes its place in measurements.
const FLAT: f64 = 1.0 / 256.0;

/// One in this number of pairs of triangles is looked at to see whether a mesh is flat in parts, and one in that number of those must
/// be flat.
const PAIRS: usize = 8;
const FLAT_PAIRS: usize = 2;

/// Triangles with sides of more than this number of mean sides are measured at points of their own, too.
const LARGE: f64 = 4.0;

/// Where at most one in this number of triangles is tested, crossings are looked for among those near them, not among all.
const FEW_TESTED: usize = 4;

/// After this number of rounds of a pass, patches with a failed check are restored.
const ROUNDS: usize = 10;

/// The limits of a simplification.
#[derive(Clone, Copy, Debug)]
pub struct Limits<'a> {
    /// The largest distance between the surfaces, in either direction, in world units.
    pub bound: f64,
    /// The grid whose nodes keep their sides, as far as the rounding of coordinates allows.
    pub grid: Option<&'a Grid>,
    /// The precision of the file: triangles that do not cross exactly do not cross when rounded to it either.
    pub precision: Precision,
}

/// A decimated mesh.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// The mesh; its positions are those of the original that it uses, in their order.
    pub mesh: TriangleMesh,
    /// The largest distance found between the two surfaces, in either direction; never more than the bound. The true one may be
    /// smaller, as parts are compared with those that they correspond to, and where that is certain, with bounds.
    pub distance: f64,
    /// The number of verifications of the whole mesh, or of what changed in it, also of an attempt that failed.
    pub rounds: usize,
    /// The number of passes over the mesh, or over what may still change, without the first one over what is flat.
    pub passes: usize,
}

/// The reason why a mesh cannot be simplified.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimplifyError {
    /// The bound is not a positive length.
    #[error("the bound of the distance must be a positive number, not {bound}")]
    Bound {
        /// The bound as given.
        bound: f64,
    },
    /// The given mesh does not pass the manifold check.
    #[error("the mesh to simplify fails the manifold check: {}", .failures.iter().map(ManifoldFailure::to_string).collect::<Vec<_>>().join(" "))]
    NotManifold {
        /// The failures of the check.
        failures: Vec<ManifoldFailure>,
    },
}

/// Removes triangles from a mesh while it stays within the limits, passes the [manifold check](ManifoldReport) in `f64` with the
/// same components and genus, and is acceptable.
///
/// `acceptable` returns the places (world units) at or near which a mesh is not acceptable; an empty list accepts it. It is
/// called at most once a round, with a mesh that passes all other checks. Its findings should depend on the surface nearby
/// alone, and it must accept the original: the triangles around a place are restored.
///
/// The result does not depend on the thread count, if `acceptable` does not. Needs eight to twelve times the memory of the mesh.
pub fn simplify(
    mesh: &TriangleMesh,
    limits: &Limits,
    acceptable: impl Fn(&TriangleMesh) -> Vec<DVec3>,
) -> Result<Simplified, SimplifyError> {
    let &Limits { bound, .. } = limits;
    if !(bound > 0.0 && bound.is_finite()) {
        return Err(SimplifyError::Bound { bound });
    }
    if mesh.triangles.is_empty() {
        return Ok(Simplified { mesh: mesh.clone(), distance: 0.0, rounds: 0, passes: 0 });
    }
    let manifold = ManifoldReport::of(mesh, Precision::Double);
    if !manifold.passed() {
        return Err(SimplifyError::NotManifold { failures: manifold.failures() });
    }
    let mut rounds = 0;
    // If a mesh fails with what is flat removed before it is verified, it is verified at once.
    let mut attempts = [false, true].into_iter();
    let simplified =
        attempts.find_map(|verifies_flat| decimated(mesh, limits, &acceptable, verifies_flat, &mut rounds));
    Ok(simplified.expect("the second attempt begins from a verified mesh"))
}

/// Decimates a mesh, in all passes. `verifies_flat` verifies a first pass over what is flat by itself; else returns `None` where
/// verification fails while triangles of that pass are left.
fn decimated(
    mesh: &TriangleMesh,
    limits: &Limits,
    acceptable: &impl Fn(&TriangleMesh) -> Vec<DVec3>,
    verifies_flat: bool,
    rounds: &mut usize,
) -> Option<Simplified> {
    let &Limits { bound, .. } = limits;
    let spacing = mean_side(mesh);
    let verified = verifies_flat.then_some((acceptable, &mut *rounds));
    let flat = without_flat(mesh, &Limits { bound: FLAT * bound, ..*limits }, verified);
    let slack = if flat.is_some() { FLAT * bound } else { 0.0 };
    let (flat, standing) = match flat {
        Some((flat, ages, errors)) => (Cow::Owned(flat), (ages, errors)),
        None => (Cow::Borrowed(mesh), as_given(mesh)),
    };
    let (inner, homes) = points_of(&flat, spacing);
    let target = Target { original: &flat, inner, slack, measures: true, spacing, limits };
    let mut state = Surface::new(&flat, standing, homes);
    let mut passes = 0;
    for split in SPLITS {
        let before = state.triangles.len();
        let mut division = state.divide(&target, split);
        if division.patches.is_empty() {
            break;
        }
        let kept = resolve(&mut division, &target, acceptable, rounds);
        passes += 1;
        if !kept {
            if state.ages.contains(&Age::Unverified) {
                return None;
            }
            break;
        }
        state.take(&division, Age::Verified);
        if state.triangles.len() as f64 >= (1.0 - LEAST_GAIN) * before as f64 {
            break;
        }
    }
    let (mesh, _) = flat.of_triangles(state.triangles);
    Some(Simplified { mesh, distance: (state.distance + slack).min(bound), rounds: *rounds, passes })
}

/// Returns the ages and errors of triangles of a mesh as given.
fn as_given(mesh: &TriangleMesh) -> (Vec<Age>, Vec<f64>) {
    (vec![Age::Verified; mesh.triangles.len()], vec![0.0; mesh.triangles.len()])
}

/// Returns a mesh without the triangles that it does not need within a small bound, the ages of its triangles, and a bound of the
/// distance of each. As only differences are added up, this is quick, and later passes have less to measure where the mesh is flat.
/// Where little of it is, returns `None`. The mesh is verified with a criterion, if there is one, and rounds are counted.
fn without_flat(
    mesh: &TriangleMesh,
    limits: &Limits,
    verified: Option<(&impl Fn(&TriangleMesh) -> Vec<DVec3>, &mut usize)>,
) -> Option<(TriangleMesh, Vec<Age>, Vec<f64>)> {
    if !is_flat_in_parts(mesh, limits.bound) {
        return None;
    }
    let target = Target { original: mesh, inner: Vec::new(), slack: 0.0, measures: false, spacing: 0.0, limits };
    let mut state = Surface::new(mesh, as_given(mesh), Vec::new());
    let mut division = state.divide(&target, SPLITS[SPLITS.len() - 1]);
    let new = match verified {
        Some((acceptable, rounds)) => resolve(&mut division, &target, acceptable, rounds).then_some(Age::Verified)?,
        None => {
            let all = vec![true; division.patches.len()];
            decimate(&mut division.patches, &all, &target);
            Age::Unverified
        }
    };
    if division.triangles().count() as f64 >= (1.0 - LEAST_GAIN) * mesh.triangles.len() as f64 {
        return None;
    }
    state.take(&division, new);
    Some((mesh.of_triangles(state.triangles).0, state.ages, state.errors))
}

/// Returns whether a fair share of a mesh is flat, by pairs of triangles that follow one another, as those of a quadrilateral do.
fn is_flat_in_parts(mesh: &TriangleMesh, flat: f64) -> bool {
    let is_flat = |pair: &&[[u32; 3]]| {
        let corners = pair[0].map(|vertex| mesh.positions[vertex as usize]);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let heights = pair[1].map(|vertex| normal.dot(mesh.positions[vertex as usize] - corners[0]).abs());
        pair[1].iter().filter(|vertex| pair[0].contains(vertex)).count() == 2
            && heights.iter().all(|height| *height <= flat * normal.length())
    };
    let pairs = || mesh.triangles.chunks_exact(2).step_by(PAIRS);
    FLAT_PAIRS * pairs().filter(is_flat).count() >= pairs().len()
}

/// Returns points on the large triangles of a mesh; and for each of its vertices, and of these points, a triangle that it lies on.
fn points_of(mesh: &TriangleMesh, spacing: f64) -> (Vec<DVec3>, Vec<u32>) {
    let (mut points, mut homes) = (Vec::new(), vec![NONE; mesh.positions.len()]);
    for (triangle, indices) in (0..).zip(&mesh.triangles) {
        indices.iter().for_each(|&vertex| homes[vertex as usize] = triangle);
        let corners = indices.map(|vertex| mesh.positions[vertex as usize]);
        let sides = [0, 1, 2].map(|side| [side, (side + 1) % 3]);
        if sides.iter().any(|side| corners[side[0]].distance(corners[side[1]]) > LARGE * spacing) {
            // Of the two triangles at a side, one has its points.
            let own = sides.into_iter().filter(|&[from, to]| indices[from] < indices[to]);
            points.extend(own.flat_map(|side| along(side.map(|end| corners[end]), spacing)));
            points.extend(inside(corners, spacing));
            homes.resize(mesh.positions.len() + points.len(), triangle);
        }
    }
    (points, homes)
}

/// Returns the mean length of the sides of triangles.
fn mean_side(mesh: &TriangleMesh) -> f64 {
    let length = |indices: &[u32; 3]| {
        let [a, b, c] = indices.map(|vertex| mesh.positions[vertex as usize]);
        a.distance(b) + b.distance(c) + c.distance(a)
    };
    mesh.triangles.iter().map(length).sum::<f64>() / (3 * mesh.triangles.len()) as f64
}

/// The surface that patches must stay near, and how near.
struct Target<'a> {
    original: &'a TriangleMesh,
    /// The points at which it is measured besides its vertices.
    inner: Vec<DVec3>,
    /// A bound of its distance from the mesh as given.
    slack: f64,
    /// Whether anything is measured, and not only added up.
    measures: bool,
    /// The mean length of sides of the mesh as given.
    spacing: f64,
    limits: &'a Limits<'a>,
}

impl Target<'_> {
    /// Returns one of the points at which the original is measured, its vertices first.
    fn point(&self, point: u32) -> DVec3 {
        let positions = &self.original.positions;
        (point as usize)
            .checked_sub(positions.len())
            .map_or_else(|| positions[point as usize], |inner| self.inner[inner])
    }

    /// Returns the error up to which a triangle takes the place of the original.
    fn flat(&self) -> f64 {
        FLAT * self.limits.bound
    }
}

/// The surface between two passes.
struct Surface {
    /// Triangles of original vertices.
    triangles: Vec<[u32; 3]>,
    /// For each point of the original the near triangle that it is assigned to; `NONE` for unused vertices.
    homes: Vec<u32>,
    ages: Vec<Age>,
    /// For each triangle, a bound of its distance from the original, in either direction.
    errors: Vec<f64>,
    /// For each original vertex, whether it was refused with nothing locked nearby, and no triangle changed there since: another
    /// division would not help.
    is_refused: Vec<bool>,
    /// The largest error, or distance measured.
    distance: f64,
}

/// The surface in a pass: its patches, and the triangles that stay as they are.
struct Division {
    patches: Vec<Patch>,
    /// The numbers of the triangles that stay, all of them verified, and their vertices.
    rest: Vec<(u32, [u32; 3])>,
}

impl Division {
    /// Returns the triangles, by original vertices.
    fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.rest.iter().map(|(_, indices)| *indices).chain(self.patches.iter().flat_map(Patch::triangles))
    }

    /// Returns the ages of the triangles.
    fn ages(&self) -> impl Iterator<Item = Age> {
        self.rest.iter().map(|_| Age::Verified).chain(self.patches.iter().flat_map(Patch::ages).copied())
    }

    /// Returns for each triangle the number of its patch; `NONE` for those that stay.
    fn patch_of_triangle(&self) -> impl Iterator<Item = u32> {
        let of_patch = |(number, patch): (u32, &Patch)| std::iter::repeat_n(number, patch.errors().len());
        self.rest.iter().map(|_| NONE).chain((0..).zip(&self.patches).flat_map(of_patch))
    }
}

/// The index that denotes several patches, or triangles that stay.
const MANY: u32 = u32::MAX - 1;

impl Surface {
    fn new(mesh: &TriangleMesh, (ages, errors): (Vec<Age>, Vec<f64>), homes: Vec<u32>) -> Surface {
        let is_refused = vec![false; mesh.positions.len()];
        let distance = errors.iter().copied().fold(0.0, f64::max);
        Surface { triangles: mesh.triangles.clone(), homes, ages, errors, is_refused, distance }
    }

    /// Divides the surface into patches, with the vertices and triangles assigned to each, and triangles away from all vertices that
    /// may still be removed.
    fn divide(&self, target: &Target, split: f64) -> Division {
        let original = target.original;
        let centroid = |indices: &[u32; 3]| {
            let [a, b, c] = indices.map(|vertex| original.positions[vertex as usize]);
            ((a + b + c) / 3.0 - original.positions[0]).as_vec3()
        };
        let mut is_near: Vec<bool> = self.is_refused.iter().map(|is_refused| !is_refused).collect();
        (0..RINGS).for_each(|_| spread(&mut is_near, &self.triangles));
        let (mut order, rest): (Vec<_>, Vec<_>) =
            self.triangles.par_iter().enumerate().partition_map(|(number, indices)| {
                match indices.iter().any(|&vertex| is_near[vertex as usize]) {
                    true => Either::Left((centroid(indices), number as u32)),
                    false => Either::Right((number as u32, *indices)),
                }
            });
        debug_assert!(rest.iter().all(|(number, _)| self.ages[*number as usize] == Age::Verified));
        let groups = split_at(&mut order, split);
        drop(order);

        let mut patch_of_triangle = vec![NONE; self.triangles.len()];
        let mut place_of_triangle = vec![NONE; self.triangles.len()];
        let mut patch_of_vertex = vec![NONE; original.positions.len()];
        rest.iter().flat_map(|(_, indices)| indices).for_each(|&vertex| patch_of_vertex[vertex as usize] = MANY);
        for (patch, group) in (0..).zip(&groups) {
            for (place, &triangle) in (0..).zip(group) {
                patch_of_triangle[triangle as usize] = patch;
                place_of_triangle[triangle as usize] = place;
                for vertex in self.triangles[triangle as usize] {
                    let known = &mut patch_of_vertex[vertex as usize];
                    *known = if [NONE, patch].contains(known) { patch } else { MANY };
                }
            }
        }
        let mut shares: Vec<Share> = groups.iter().map(|_| Share::default()).collect();
        let patch_of = |home: u32| if home == NONE { NONE } else { patch_of_triangle[home as usize] };
        for (point, &home) in (0..).zip(&self.homes).filter(|(_, home)| patch_of(**home) != NONE) {
            let share = &mut shares[patch_of(home) as usize];
            share.points.push(point);
            share.homes.push(place_of_triangle[home as usize]);
        }
        let is_flat = |triangle: u32| self.errors[triangle as usize] <= target.flat();
        let measured = if target.measures { &original.triangles[..] } else { &[] };
        for indices in measured {
            let homes = indices.map(|vertex| self.homes[vertex as usize]);
            let patches = homes.map(patch_of);
            for (i, patch) in patches.into_iter().enumerate() {
                let is_known = (0..i).any(|j| patches[j] == patch && !is_flat(homes[j]));
                if patch != NONE && !is_flat(homes[i]) && !is_known {
                    shares[patch as usize].triangles.push(*indices);
                }
            }
        }
        let patches = groups.into_par_iter().zip(shares).map(|(group, share)| {
            let triangles: Vec<[u32; 3]> = group.iter().map(|&triangle| self.triangles[triangle as usize]).collect();
            let ages = group.iter().map(|&triangle| self.ages[triangle as usize]).collect();
            let errors = group.iter().map(|&triangle| self.errors[triangle as usize]).collect();
            let standing = |vertex: u32| match patch_of_vertex[vertex as usize] {
                MANY => Standing::Locked,
                _ if self.is_refused[vertex as usize] => Standing::Refused,
                _ => Standing::Open,
            };
            Patch::new(&triangles, (ages, errors), standing, share)
        });
        Division { patches: patches.collect(), rest }
    }

    /// Replaces the surface by the patches and the triangles that stay; those that a collapse made have an age from now on, and all
    /// others are verified.
    fn take(&mut self, division: &Division, new: Age) {
        let Division { patches, rest } = division;
        let mut number_of_rest = vec![NONE; self.triangles.len()];
        (0..).zip(rest).for_each(|(number, &(before, _))| number_of_rest[before as usize] = number);
        for home in self.homes.iter_mut().filter(|home| **home != NONE) {
            // Those in patches follow.
            *home = number_of_rest[*home as usize];
        }
        self.triangles = division.triangles().collect();
        self.ages = division.ages().map(|age| if age == Age::New { new } else { Age::Verified }).collect();
        self.errors = rest.iter().map(|(before, _)| self.errors[*before as usize]).collect();
        for patch in patches {
            let first = self.errors.len() as u32;
            patch.homes().for_each(|(point, home)| self.homes[point as usize] = first + home);
            self.errors.extend(patch.errors());
            self.distance = self.distance.max(patch.distance());
        }
        let beside_locked = patches.iter().flat_map(Patch::beside_locked);
        let open = beside_locked.filter(|&(vertex, is_new)| is_new || !self.is_refused[vertex as usize]);
        let open: Vec<u32> = open.map(|(vertex, _)| vertex).collect();
        self.is_refused.fill(true);
        open.into_iter().for_each(|vertex| self.is_refused[vertex as usize] = false);
    }
}

/// Marks the vertices of triangles that have a marked one.
fn spread(marked: &mut [bool], triangles: &[[u32; 3]]) {
    let inner = marked.to_vec();
    for indices in triangles {
        if indices.iter().any(|&vertex| inner[vertex as usize]) {
            indices.iter().for_each(|&vertex| marked[vertex as usize] = true);
        }
    }
}

/// Splits triangles at a quantile of their centroids along the longest side of their bounding box, until all groups are small;
/// each group is sorted.
fn split_at(order: &mut [(Vec3, u32)], split: f64) -> Vec<Vec<u32>> {
    if order.is_empty() {
        return Vec::new();
    }
    if order.len() <= PATCH {
        let mut group: Vec<u32> = order.iter().map(|(_, triangle)| *triangle).collect();
        group.sort_unstable();
        return vec![group];
    }
    let (min, max) = order.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), (centroid, _)| {
        (min.min(*centroid), max.max(*centroid))
    });
    let axis = (max - min).max_position();
    let at = (order.len() as f64 * split) as usize;
    order.select_nth_unstable_by(at, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (low, high) = order.split_at_mut(at);
    let (mut groups, rest) = join(|| split_at(low, split), || split_at(high, split));
    groups.extend(rest);
    groups
}

/// Decimates all patches and verifies the whole, round after round, until all checks pass; from the second round on, crossings are
/// looked for only in what changed. Returns false if they fail even with all affected patches restored, or where that may be because of
/// an earlier pass.
fn resolve(
    division: &mut Division,
    target: &Target,
    acceptable: &impl Fn(&TriangleMesh) -> Vec<DVec3>,
    rounds: &mut usize,
) -> bool {
    let mut stale = vec![true; division.patches.len()];
    // Patches that changed since their triangles were found to cross none.
    let mut is_open = vec![false; division.patches.len()];
    let mut round = 0;
    loop {
        round += 1;
        decimate(&mut division.patches, &stale, target);
        let (mesh, _) = target.original.of_triangles(division.triangles().collect());
        debug_assert!(Faults::of(&mesh).are_none(), "collapses keep a manifold");
        let ages: Vec<Age> = division.ages().collect();
        let is_unverified: Vec<bool> = ages.iter().map(|age| *age != Age::Verified).collect();
        if !is_unverified.contains(&true) {
            return true;
        }
        *rounds += 1;
        is_open.iter_mut().zip(&stale).for_each(|(is_open, stale)| *is_open |= stale);
        let patch_of: Vec<u32> = division.patch_of_triangle().collect();
        let is_in_open = |patch: u32| patch != NONE && is_open[patch as usize];
        // A triangle that was restored may cross a new one.
        let is_tested = |(&patch, &is_unverified): (&u32, &bool)| is_in_open(patch) && (round > 1 || is_unverified);
        let is_tested: Vec<bool> = patch_of.iter().zip(&is_unverified).map(is_tested).collect();
        let pairs = crossing(&mesh, [&is_unverified, &is_tested], target.limits.precision);
        let is_new = |triangle: &u32| ages[*triangle as usize] == Age::New;
        let is_older = |pair: &[u32; 2]| !pair.iter().any(is_new);
        if pairs.iter().any(is_older) || (round >= ROUNDS && ages.contains(&Age::Unverified)) {
            return false;
        }
        is_open.fill(false);
        let crossed = pairs.as_flattened().iter().map(|&triangle| patch_of[triangle as usize]);
        crossed.filter(|&patch| patch != NONE).for_each(|patch| is_open[patch as usize] = true);
        let corners = pairs
            .as_flattened()
            .iter()
            .filter(|&triangle| is_new(triangle))
            .flat_map(|&triangle| mesh.triangles[triangle as usize]);
        let mut places: Vec<DVec3> = corners.map(|vertex| mesh.positions[vertex as usize]).collect();
        if places.is_empty() {
            places = acceptable(&mesh);
        }
        if places.is_empty() {
            return true;
        }
        drop(mesh);
        let patches = &mut division.patches;
        let locked: Vec<usize> = patches.iter().map(Patch::locked).collect();
        let concerned = lock_near(patches, target, &places, round);
        if round >= ROUNDS {
            patches.par_iter_mut().zip(concerned).filter(|(_, concerned)| *concerned).for_each(|(patch, _)| {
                checkpoint();
                patch.leave(target);
            });
        }
        stale = patches.iter().zip(locked).map(|(patch, before)| patch.locked() > before).collect();
        // Without new locks, the next round locks more around the places.
        if round > ROUNDS && !stale.contains(&true) {
            return false;
        }
    }
}

/// Decimates those patches that are marked; one by one, as they differ in their work.
fn decimate(patches: &mut [Patch], is_marked: &[bool], target: &Target) {
    let marked = patches.par_iter_mut().zip(is_marked).with_max_len(1).filter(|(_, is_marked)| **is_marked);
    marked.for_each(|(patch, _)| {
        checkpoint();
        patch.decimate(target);
    });
}

/// Returns the number of pairs of triangles of a mesh that meet elsewhere than in what they share, exactly or rounded.
pub fn crossing_pairs(mesh: &TriangleMesh, precision: Precision) -> u64 {
    let all = vec![true; mesh.triangles.len()];
    crossing(mesh, [&all, &all], precision).len() as u64
}

/// Returns the pairs of triangles that meet elsewhere than in what they share, exactly or rounded, of which at least one is new and at
/// least one is tested.
pub(super) fn crossing(mesh: &TriangleMesh, [is_new, is_tested]: [&[bool]; 2], precision: Precision) -> Vec<[u32; 2]> {
    checkpoint();
    let places = |vertex: u32| {
        let place = mesh.positions[vertex as usize];
        [place, precision.round(place)]
    };
    let extent = |triangle: u32| {
        let corners = mesh.triangles[triangle as usize].map(places);
        Box32::around(corners.into_iter().flatten())
    };
    let Some(bounds) = mesh.bounds().filter(|_| is_tested.contains(&true)) else { return Vec::new() };
    let whole =
        Box32::around([bounds.min, bounds.max].into_iter().flat_map(|corner| [corner, precision.round(corner)]));
    let numbers = (0..mesh.triangles.len() as u32).into_par_iter().with_min_len(1 << 10);
    let extents = numbers.map(|triangle| (triangle, extent(triangle)));
    let tested = || (0..).zip(is_tested).filter(|(_, is_tested)| **is_tested).map(|(triangle, _)| triangle);
    let near = match FEW_TESTED * tested().count() <= mesh.triangles.len() {
        false => Either::Left(extents),
        true => {
            let mut bins = Bins::new(&whole);
            tested().for_each(|triangle| bins.add(&extent(triangle)));
            Either::Right(extents.filter(move |(_, extent)| bins.may_touch(extent)))
        }
    };
    let tree = FaceTree::new(&whole, near, extent);
    let prepare = |place: usize| {
        let triangle = tree.faces()[place];
        (triangle, Placed::new(mesh.triangles[triangle as usize], precision, places))
    };
    let look = |one: &(u32, Placed), other: &(u32, Placed)| {
        // New ones have an area.
        let [one, other] = if is_new[one.0 as usize] { [one, other] } else { [other, one] };
        (is_new[one.0 as usize] && one.1.meets(&other.1)).then_some([one.0, other.0])
    };
    tree.own_pairs(|place| is_tested[tree.faces()[place] as usize], prepare, look)
}

/// Locks vertices near places, in a neighbourhood that grows with the round. Returns for each patch whether it is affected.
fn lock_near(patches: &mut [Patch], target: &Target, places: &[DVec3], round: usize) -> Vec<bool> {
    let bound = target.limits.bound;
    let boxes: Vec<Aabb> = patches.par_iter().map(|patch| patch.bounds(target)).collect();
    let from_box = |point: DVec3, around: &Aabb| point.distance(point.clamp(around.min, around.max));
    let least = |point: DVec3| boxes.iter().map(|around| from_box(point, around)).fold(f64::INFINITY, f64::min);
    let reach: Vec<f64> = places.par_iter().map(|&place| least(place) + 2.0 * bound).collect();
    let near = patches.par_iter().zip(&boxes).map(|(patch, around)| {
        checkpoint();
        let is_near = |&place: &usize| from_box(places[place], around) <= reach[place];
        let candidates: Vec<usize> = (0..places.len()).filter(is_near).collect();
        if candidates.is_empty() {
            return Vec::new();
        }
        let points: Vec<DVec3> = candidates.iter().map(|&place| places[place]).collect();
        candidates.into_iter().zip(patch.near(target, &points, bound)).collect()
    });
    let near: Vec<Vec<(usize, Near)>> = near.collect();
    let mut closest = vec![f64::INFINITY; places.len()];
    for (place, near) in near.iter().flatten() {
        closest[*place] = closest[*place].min(near.distance);
    }
    let concerned = patches.par_iter_mut().zip(near).map(|(patch, near)| {
        checkpoint();
        let mut near = near.into_iter().filter(|(place, near)| near.distance <= closest[*place] + bound).peekable();
        let is_near = near.peek().is_some();
        patch.lock(near.flat_map(|(_, near)| near.places), round - 1);
        is_near
    });
    concerned.collect()
}

#[cfg(test)]
mod tests;
