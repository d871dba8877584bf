//! Collapses of edges: a vertex is removed, and a neighbour takes its place in the triangles around it.
//!
//! The order is that of quadric error metrics (Garland & Heckbert 1997): the sum of squared distances from the planes of the
//! triangles of the patch that a vertex stands for, by their areas. It is settled pass by pass: in each, every vertex proposes its best
//! neighbour, and the cheapest third of the proposals is carried out. So no queue is kept, and a proposal costs little.
//!
//! What is carried out must hold for itself:
//! - **Topology**: the ends of the edge have exactly two neighbours in common (the link condition, Dey et al. 1999), so that the
//!   surface stays a manifold of the same genus; and no edge joins two locked vertices that were not joined, as another patch may
//!   have that edge.
//! - **Direction**: no triangle turns by more than 60°, or becomes a sliver.
//! - **Sides**: no node of a lattice changes its side of the surface ([`NodeGuard`]).
//! - **Distance**: the new triangles are within the bound of the part of the original that they stand for, and this of them
//!   (`distance`).

mod distance;

use std::cell::LazyCell;
use std::ops::Deref;

use glam::DVec3;
use smallvec::SmallVec;

use super::face::Face;
use super::fan::Fan;
use super::nodes::NodeGuard;
use super::original::Original;
use super::quadric::Quadric;
use super::samples::Samples;
use crate::cancel::checkpoint;

/// The index that denotes no triangle, vertex or sample.
pub(super) const NONE: u32 = u32::MAX;

/// A vertex proposes a neighbour where the root mean square of the distances from its planes is up to so many bounds. Planes
/// extend beyond their triangles, so that the surface is nearer.
const PLANES: f64 = 2.0;

/// The number of neighbours that a vertex proposes, one after another, before triangles around it change.
const PROPOSALS: usize = 3;

/// One in this number of proposals is carried out in a pass.
const SHARE: usize = 3;

/// Number of proposals between two checkpoints.
const BETWEEN_CHECKPOINTS: usize = 256;

/// Least cosine of the angle by which a triangle turns.
const TURN: f64 = 0.5;

/// Rounding of a distance, as a share.
const ROUNDED: f64 = 1e-9;

/// A cost, as a share of the squared bound and for each squared unit of length, so that of equal proposals the shorter wins.
const LENGTH_COST: f64 = 1e-9;

/// Whether a vertex may be removed.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    /// Yes.
    Open,
    /// Once triangles around it change: all that it proposed was refused.
    Refused,
    /// No.
    Locked,
}

/// What a triangle is to the verification of crossings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Age {
    /// It is of the mesh as given, or was verified after an earlier pass.
    Verified,
    /// An earlier pass made it, and it was not verified since.
    Unverified,
    /// A collapse made it.
    New,
}

/// The part of a surface on which edges are collapsed.
pub(super) struct Collapser<'a> {
    points: &'a [DVec3],
    /// For each vertex, whether it may be removed.
    standings: &'a [Standing],
    /// The largest distance, and that up to which a triangle is as good as the original.
    bound: f64,
    flat: f64,
    /// The triangles; `NONE` where one was removed.
    triangles: Vec<[u32; 3]>,
    ages: Vec<Age>,
    /// For each triangle a bound of its distance from the original that it stands for, in either direction.
    errors: Vec<f64>,
    /// The largest distance measured.
    distance: f64,
    /// The triangles around each vertex, seldom more than eight.
    around: Vec<SmallVec<[u32; 8]>>,
    quadrics: Vec<Quadric>,
    samples: Samples<'a>,
    scratch: Scratch,
}

/// Scratch space of the tests of a collapse.
#[derive(Default)]
struct Scratch {
    /// For each vertex the number of the last test that it was a neighbour in.
    seen: Vec<u32>,
    test: u32,
    /// The triangles that a collapse would make, and their numbers.
    faces: Vec<(u32, Face)>,
    /// The errors of these.
    errors: Vec<f64>,
    /// The errors of the triangles around the vertex; infinite where they must be measured.
    old_errors: Vec<f64>,
    /// The largest distance measured.
    distance: f64,
    fan: Fan,
    /// Whether distances must be measured.
    is_measured: bool,
    /// The old triangles whose samples are measured; the others are nearly as flat as the new ones.
    measured: Vec<u32>,
    /// Samples measured, and the new triangles that they are assigned to.
    moved: Vec<(u32, u32)>,
    hashes: Vec<u64>,
}

/// Returns a number that orders the proposals of vertices by their cost, which is not negative, to a millionth, and then by the vertex,
/// which is its lower half.
fn rank(cost: f64, vertex: u32) -> u64 {
    cost.to_bits() & !u64::from(u32::MAX) | u64::from(vertex)
}

/// The result of collapses.
#[derive(Default)]
pub(super) struct Collapsed {
    /// The triangles that are left.
    pub triangles: Vec<[u32; 3]>,
    pub ages: Vec<Age>,
    /// For each triangle a bound of its distance from the original that it stands for, in either direction.
    pub errors: Vec<f64>,
    /// The largest of these, or distance measured.
    pub distance: f64,
    /// For each sample the triangle that it is assigned to.
    pub homes: Vec<u32>,
}

impl<'a> Collapser<'a> {
    /// Prepares triangles, with their ages and errors, and with the number of the triangle that each sample is assigned to.
    pub fn new(
        points: &'a [DVec3],
        triangles: Vec<[u32; 3]>,
        (ages, errors): (Vec<Age>, Vec<f64>),
        standings: &'a [Standing],
        (samples, homes): (&'a [DVec3], &[u32]),
        [bound, flat]: [f64; 2],
    ) -> Collapser<'a> {
        let mut around = vec![SmallVec::new(); points.len()];
        let mut quadrics = vec![Quadric::default(); points.len()];
        for (number, triangle) in (0..).zip(&triangles) {
            let [a, b, c] = triangle.map(|vertex| points[vertex as usize]);
            let cross = (b - a).cross(c - a);
            let area = cross.length();
            let quadric = if area > 0.0 { Quadric::plane(cross / area, a, area) } else { Quadric::default() };
            for &vertex in triangle {
                around[vertex as usize].push(number);
                quadrics[vertex as usize].add(&quadric);
            }
        }
        let samples = Samples::new(samples, homes, triangles.len());
        let scratch = Scratch { seen: vec![0; points.len()], ..Scratch::default() };
        Collapser {
            points,
            standings,
            bound,
            flat,
            triangles,
            ages,
            errors,
            distance: 0.0,
            around,
            quadrics,
            samples,
            scratch,
        }
    }

    /// Collapses edges until no proposal passes the tests: near the original, and so that the nodes of a guard keep their sides.
    ///
    /// `original` is called at most once, if something must be measured; without it, what would have to be measured is refused.
    pub fn run(mut self, original: Option<impl FnOnce() -> Original>, guard: Option<&NodeGuard>) -> Collapsed {
        let original = original.map(LazyCell::new);
        let count = self.points.len();
        let mut refused: Vec<usize> =
            self.standings.iter().map(|&standing| if standing == Standing::Open { 0 } else { PROPOSALS }).collect();
        // The last pass in which the triangles around a vertex changed, or in which its proposal was refused.
        let mut changed = vec![0u32; count];
        let mut proposals: Vec<(u64, u32)> = Vec::new();
        for pass in 1.. {
            proposals.clear();
            for vertex in 0..count as u32 {
                let refused = &mut refused[vertex as usize];
                let may_go = !self.is_locked(vertex) && !self.around[vertex as usize].is_empty();
                if may_go && *refused < PROPOSALS {
                    match self.proposal(vertex, *refused) {
                        Some((cost, into)) => proposals.push((rank(cost, vertex), into)),
                        None => *refused = PROPOSALS,
                    }
                }
            }
            if proposals.is_empty() {
                break;
            }
            proposals.sort_unstable_by_key(|(rank, _)| *rank);
            let mut left = proposals.len().div_ceil(SHARE);
            for (number, &(rank, into)) in proposals.iter().enumerate() {
                let from = rank as u32;
                let ends = [from, into];
                if number % BETWEEN_CHECKPOINTS == 0 {
                    checkpoint();
                }
                if left == 0 {
                    break;
                }
                if ends.iter().any(|&end| changed[end as usize] == pass) {
                    continue;
                }
                changed[from as usize] = pass;
                if !self.holds(ends, original.as_ref(), guard) {
                    refused[from as usize] += 1;
                    continue;
                }
                self.collapse(ends);
                changed[into as usize] = pass;
                left -= 1;
                for &triangle in &self.around[into as usize] {
                    self.triangles[triangle as usize].iter().for_each(|&vertex| refused[vertex as usize] = 0);
                }
            }
        }
        self.finish()
    }

    fn is_locked(&self, vertex: u32) -> bool {
        self.standings[vertex as usize] == Standing::Locked
    }

    fn at(&self, vertex: u32) -> DVec3 {
        self.points[vertex as usize]
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.at(vertex))
    }

    /// Returns the other corners of a triangle, in its direction.
    #[inline]
    fn opposite(&self, triangle: u32, vertex: u32) -> [u32; 2] {
        let [a, b, c] = self.triangles[triangle as usize];
        if a == vertex {
            [b, c]
        } else if b == vertex {
            [c, a]
        } else {
            [a, b]
        }
    }

    /// Returns the neighbour that takes the place of a vertex at the least cost, but for the `refused` best ones, with the cost.
    fn proposal(&self, vertex: u32, refused: usize) -> Option<(f64, u32)> {
        let own = &self.quadrics[vertex as usize];
        let mut best = [(f64::INFINITY, NONE); PROPOSALS];
        for &triangle in &self.around[vertex as usize] {
            let [into, _] = self.opposite(triangle, vertex);
            let (place, other) = (self.at(into), &self.quadrics[into as usize]);
            let cost = (own.at(place) + other.at(place)).max(0.0);
            if cost <= (PLANES * self.bound).powi(2) * (own.weight + other.weight) {
                let length = place.distance_squared(self.at(vertex));
                let mut next = (cost + LENGTH_COST * self.bound * self.bound * length, into);
                for slot in &mut best {
                    if next.0 < slot.0 {
                        std::mem::swap(slot, &mut next);
                    }
                }
            }
        }
        Some(best[refused]).filter(|(_, into)| *into != NONE)
    }

    /// Returns whether the first end may be removed and the second take its place. Notes what the collapse will need.
    fn holds(
        &mut self,
        [from, into]: [u32; 2],
        original: Option<&impl Deref<Target = Original>>,
        guard: Option<&NodeGuard>,
    ) -> bool {
        let mut scratch = std::mem::take(&mut self.scratch);
        let holds = self.keeps_topology([from, into], &mut scratch)
            && self.keeps_direction([from, into], &mut scratch)
            && self.adds_up([from, into], &mut scratch)
            && (!scratch.is_measured || (original.is_some() && self.keeps_samples([from, into], &mut scratch)))
            && (!scratch.is_measured || original.is_some_and(|original| self.is_near(into, original, &mut scratch)))
            && guard.is_none_or(|guard| self.keeps_sides(from, guard, &mut scratch));
        self.scratch = scratch;
        holds
    }

    fn keeps_topology(&self, [from, into]: [u32; 2], scratch: &mut Scratch) -> bool {
        scratch.test += 1;
        for &triangle in &self.around[into as usize] {
            for vertex in self.opposite(triangle, into) {
                scratch.seen[vertex as usize] = scratch.test;
            }
        }
        let around = &self.around[from as usize];
        let is_new = |vertex: u32| scratch.seen[vertex as usize] != scratch.test;
        let neighbours = || around.iter().map(|&triangle| self.opposite(triangle, from)[0]).filter(|&v| v != into);
        let common = neighbours().filter(|&vertex| !is_new(vertex)).count();
        let is_locked = |vertex: u32| self.is_locked(vertex);
        let joins_locked = || is_locked(into) && neighbours().any(|vertex| is_new(vertex) && is_locked(vertex));
        // What is left of three triangles may be there already: the fourth of a tetrahedron, maybe in another patch.
        let may_be_there = || {
            around.len() == 3
                && (self.around[into as usize].len() == 3 || (is_locked(into) && neighbours().all(is_locked)))
        };
        common == 2 && !may_be_there() && !joins_locked()
    }

    /// Finds the new triangles.
    fn keeps_direction(&self, [from, into]: [u32; 2], scratch: &mut Scratch) -> bool {
        scratch.faces.clear();
        for &number in &self.around[from as usize] {
            let [b, c] = self.opposite(number, from);
            if b == into || c == into {
                continue;
            }
            let [u, v, b, c] = [from, into, b, c].map(|vertex| self.at(vertex));
            let (before, face) = ((b - u).cross(c - u), Face::new([v, b, c]));
            if face.is_sliver() || face.normal.dot(before) < TURN * before.length() {
                return false;
            }
            scratch.faces.push((number, face));
        }
        true
    }

    fn keeps_sides(&self, from: u32, guard: &NodeGuard, scratch: &mut Scratch) -> bool {
        let before = self.around[from as usize].iter().map(|&t| self.triangles[t as usize].map(|v| self.at(v)));
        let after = scratch.faces.iter().map(|(_, face)| face.corners);
        guard.keeps_sides(before, after, &mut scratch.hashes)
    }

    /// Carries out the collapse that was tested last.
    fn collapse(&mut self, [from, into]: [u32; 2]) {
        let scratch = std::mem::take(&mut self.scratch);
        scratch.faces.iter().for_each(|&(number, _)| self.samples.mark_stale(number));
        if scratch.is_measured {
            // Their samples were assigned to new triangles.
            for &number in &scratch.measured {
                self.samples.take(number);
            }
            scratch.moved.iter().for_each(|&(sample, home)| self.samples.add(home, sample));
            self.distance = self.distance.max(scratch.distance);
        }
        for number in std::mem::take(&mut self.around[from as usize]) {
            let [b, c] = self.opposite(number, from);
            if b == into || c == into {
                [b, c].into_iter().for_each(|v| self.around[v as usize].retain(|other| *other != number));
                self.triangles[number as usize] = [NONE; 3];
                // Its samples go to a new triangle at the side that is left of it.
                let other = if b == into { c } else { b };
                let mut heirs = scratch.faces.iter().map(|(heir, _)| *heir);
                let heir = heirs.find(|&heir| self.triangles[heir as usize].contains(&other));
                self.samples.join(number, heir.expect("every neighbour is in a new triangle"));
            } else {
                // From the new vertex on, as its distance was measured.
                self.triangles[number as usize] = [into, b, c];
                self.around[into as usize].push(number);
            }
        }
        for (&(number, _), &error) in scratch.faces.iter().zip(&scratch.errors) {
            self.ages[number as usize] = Age::New;
            self.errors[number as usize] = error;
        }
        let quadric = self.quadrics[from as usize];
        self.quadrics[into as usize].add(&quadric);
        self.scratch = scratch;
    }

    /// Returns the triangles that are left.
    fn left(&self) -> impl Iterator<Item = u32> {
        (0..).zip(&self.triangles).filter(|(_, triangle)| triangle[0] != NONE).map(|(number, _)| number)
    }

    fn finish(mut self) -> Collapsed {
        self.refresh_from(self.left().collect());
        debug_assert!(self.left().all(|number| self.errors[number as usize] <= self.bound * (1.0 + ROUNDED)));
        let homes = vec![NONE; self.samples.points.len()];
        let mut collapsed = Collapsed { homes, distance: self.distance, ..Collapsed::default() };
        for number in self.left() {
            let place = collapsed.triangles.len() as u32;
            self.samples.of(number).for_each(|sample| collapsed.homes[sample as usize] = place);
            collapsed.triangles.push(self.triangles[number as usize]);
            collapsed.ages.push(self.ages[number as usize]);
            let error = self.errors[number as usize];
            collapsed.errors.push(error);
            if error < self.bound {
                collapsed.distance = collapsed.distance.max(error);
            }
        }
        collapsed
    }
}
