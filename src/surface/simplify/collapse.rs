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
//! - **Distance**: every vertex of the original that the triangles around the vertex stand for is within the bound of one of the
//!   new triangles, and is assigned to it; and points of these are within the bound of the original ([`Original`]).

use glam::DVec3;

use super::face::Face;
use super::nodes::NodeGuard;
use super::original::Original;
use crate::cancel::checkpoint;
use crate::closest::squared_distance;

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

/// Rounding of a distance, as a share.
const ROUNDED: f64 = 1e-6;

/// Least cosine of the angle by which a triangle turns.
const TURN: f64 = 0.5;

/// A cost, as a share of the squared bound and for each squared unit of length, so that of equal proposals the shorter wins.
const LENGTH_COST: f64 = 1e-9;

/// The error of a vertex: the weighted sum of squared distances from planes, as a polynomial.
#[derive(Clone, Copy, Default)]
struct Quadric {
    /// The second-order coefficients: of xx, yy, zz, and of yz, zx, xy.
    squares: DVec3,
    products: DVec3,
    /// Half of the first-order coefficients.
    linear: DVec3,
    constant: f64,
    weight: f64,
}

impl Quadric {
    /// Returns the error from the plane through a point with a unit normal.
    fn plane(normal: DVec3, through: DVec3, weight: f64) -> Quadric {
        let offset = -normal.dot(through);
        let n = normal;
        Quadric {
            squares: n * n * weight,
            products: DVec3::new(n.y * n.z, n.z * n.x, n.x * n.y) * weight,
            linear: n * (offset * weight),
            constant: offset * offset * weight,
            weight,
        }
    }

    fn add(&mut self, other: &Quadric) {
        self.squares += other.squares;
        self.products += other.products;
        self.linear += other.linear;
        self.constant += other.constant;
        self.weight += other.weight;
    }

    fn at(&self, p: DVec3) -> f64 {
        let mixed = DVec3::new(p.y * p.z, p.z * p.x, p.x * p.y);
        self.squares.dot(p * p) + 2.0 * (self.products.dot(mixed) + self.linear.dot(p)) + self.constant
    }
}

/// The part of a surface on which edges are collapsed.
pub(super) struct Collapser<'a> {
    points: &'a [DVec3],
    /// For each vertex, whether it must stay.
    locked: &'a [bool],
    samples: &'a [DVec3],
    bound: f64,
    /// The triangles; `NONE` where one was removed.
    triangles: Vec<[u32; 3]>,
    /// For each triangle, whether it is new.
    is_new: Vec<bool>,
    /// The triangles around each vertex.
    around: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// The first sample of each triangle, and the next of each sample.
    first: Vec<u32>,
    next: Vec<u32>,
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
    /// Samples, and the triangles that they are assigned to.
    moved: Vec<(u32, u32)>,
    hashes: Vec<u64>,
}

/// The result of collapses.
#[derive(Default)]
pub(super) struct Collapsed {
    /// The triangles that are left.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, whether a collapse made it.
    pub is_new: Vec<bool>,
    /// For each sample the triangle that it is assigned to.
    pub homes: Vec<u32>,
    /// The largest distance of a sample from its triangle, or of a new triangle from the original.
    pub distance: f64,
}

impl<'a> Collapser<'a> {
    /// Prepares triangles, with the number of the triangle that each sample is assigned to.
    pub fn new(
        points: &'a [DVec3],
        triangles: Vec<[u32; 3]>,
        locked: &'a [bool],
        (samples, homes): (&'a [DVec3], &[u32]),
        bound: f64,
    ) -> Collapser<'a> {
        let mut around = vec![Vec::new(); points.len()];
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
        let (mut first, mut next) = (vec![NONE; triangles.len()], vec![NONE; samples.len()]);
        for (sample, &home) in (0..).zip(homes) {
            next[sample as usize] = std::mem::replace(&mut first[home as usize], sample);
        }
        let scratch = Scratch { seen: vec![0; points.len()], ..Scratch::default() };
        let is_new = vec![false; triangles.len()];
        Collapser { points, locked, samples, bound, triangles, is_new, around, quadrics, first, next, scratch }
    }

    /// Collapses edges until no proposal passes the tests: near the original, and so that the nodes of a guard keep their sides.
    pub fn run(mut self, original: Original, guard: Option<&NodeGuard>) -> Collapsed {
        let count = self.points.len();
        let mut refused = vec![0; count];
        // The last pass in which the triangles around a vertex changed, or in which its proposal was refused.
        let mut changed = vec![0u32; count];
        let mut proposals: Vec<(f64, [u32; 2])> = Vec::new();
        for pass in 1.. {
            proposals.clear();
            for vertex in 0..count as u32 {
                let refused = &mut refused[vertex as usize];
                let may_go = !self.locked[vertex as usize] && !self.around[vertex as usize].is_empty();
                if may_go && *refused < PROPOSALS {
                    match self.proposal(vertex, *refused) {
                        Some((cost, into)) => proposals.push((cost, [vertex, into])),
                        None => *refused = PROPOSALS,
                    }
                }
            }
            if proposals.is_empty() {
                break;
            }
            proposals.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
            let mut left = proposals.len().div_ceil(SHARE);
            for (number, &(_, ends @ [from, into])) in proposals.iter().enumerate() {
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
                if !self.holds(ends, &original, guard) {
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
        self.finish(&original)
    }

    fn at(&self, vertex: u32) -> DVec3 {
        self.points[vertex as usize]
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

    /// Returns whether the first end may be removed and the second take its place. Notes the triangles that its samples are then
    /// assigned to.
    fn holds(&mut self, [from, into]: [u32; 2], original: &Original, guard: Option<&NodeGuard>) -> bool {
        let mut scratch = std::mem::take(&mut self.scratch);
        let holds = self.keeps_topology([from, into], &mut scratch)
            && self.keeps_direction([from, into], &mut scratch)
            && self.keeps_distance(from, &mut scratch)
            && guard.is_none_or(|guard| self.keeps_sides(from, guard, &mut scratch))
            && scratch.faces.iter().all(|(_, face)| original.is_near(face));
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
        let is_locked = |vertex: u32| self.locked[vertex as usize];
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

    fn keeps_distance(&self, from: u32, scratch: &mut Scratch) -> bool {
        let squared_bound = self.bound * self.bound;
        scratch.moved.clear();
        for &number in &self.around[from as usize] {
            let mut sample = self.first[number as usize];
            while sample != NONE {
                let point = self.samples[sample as usize];
                let mut best = (f64::INFINITY, NONE);
                for (number, face) in &scratch.faces {
                    if let Some(squared) = face.squared_height(point).filter(|&squared| squared < best.0) {
                        best = (squared, *number);
                    }
                }
                if best.0 > squared_bound {
                    let distances = scratch.faces.iter().map(|(number, face)| (face.squared_distance(point), *number));
                    best = distances.fold(best, |best, other| if other.0 < best.0 { other } else { best });
                }
                if best.0 > squared_bound {
                    return false;
                }
                scratch.moved.push((sample, best.1));
                sample = self.next[sample as usize];
            }
        }
        true
    }

    /// Carries out the collapse that was tested last.
    fn collapse(&mut self, [from, into]: [u32; 2]) {
        for number in std::mem::take(&mut self.around[from as usize]) {
            self.first[number as usize] = NONE;
            let [b, c] = self.opposite(number, from);
            if b == into || c == into {
                [b, c].into_iter().for_each(|v| self.around[v as usize].retain(|&other| other != number));
                self.triangles[number as usize] = [NONE; 3];
            } else {
                // From the new vertex on, as its distance was measured.
                self.triangles[number as usize] = [into, b, c];
                self.around[into as usize].push(number);
            }
        }
        for &(sample, home) in &self.scratch.moved {
            self.next[sample as usize] = std::mem::replace(&mut self.first[home as usize], sample);
        }
        for (number, _) in &self.scratch.faces {
            self.is_new[*number as usize] = true;
        }
        let quadric = self.quadrics[from as usize];
        self.quadrics[into as usize].add(&quadric);
    }

    fn finish(self, original: &Original) -> Collapsed {
        let mut collapsed = Collapsed { homes: vec![NONE; self.samples.len()], ..Collapsed::default() };
        let mut largest = 0.0f64;
        for (number, &triangle) in self.triangles.iter().enumerate().filter(|(_, triangle)| triangle[0] != NONE) {
            let corners = triangle.map(|vertex| self.at(vertex));
            if self.is_new[number] {
                largest = largest.max(original.squared_distance(corners));
            }
            let mut sample = self.first[number];
            while sample != NONE {
                collapsed.homes[sample as usize] = collapsed.triangles.len() as u32;
                largest = largest.max(squared_distance(self.samples[sample as usize], corners));
                sample = self.next[sample as usize];
            }
            collapsed.triangles.push(triangle);
            collapsed.is_new.push(self.is_new[number]);
        }
        debug_assert!(largest <= (self.bound * (1.0 + ROUNDED)).powi(2), "{largest} {}", self.bound);
        // Heights are rounded otherwise than distances.
        collapsed.distance = largest.sqrt().min(self.bound);
        collapsed
    }
}
