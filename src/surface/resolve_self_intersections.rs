//! Separation of triangles that cross one another.
//!
//! # Causes
//! A surface whose vertices are the means of their crossings hardly ever crosses itself. It does so where a vertex has a
//! position that is right for its own normals and wrong for its neighbours: where crossings of two sheets, or of detail finer
//! than the lattice, were taken for the faces of one edge, and far more so beyond its cell than in it.
//!
//! # Search
//! While all vertices are in their cells, the triangles of a lattice edge lie in its four cells; so two that cross one another
//! do so in a cell that both edges belong to. If it has one vertex, that is a corner of both quadrilaterals. The quadrilaterals
//! around one vertex lie side by side if there is a direction that the triangles of all corners of each of them face: in
//! projection along it they do not even overlap. For a vertex of a gently bent sheet its mean normal is such a direction if all
//! of its quadrilaterals are regular (see [`Cut::is_regular`]), which is known when they are cut; for a feature it is tested.
//! That leaves **suspects**: vertices that fail, those that share their cell, those beyond theirs, and all in cells that the
//! triangles of the latter touch. Two triangles cross one another only where both belong to a suspect, and those are tested
//! exactly, both exact and rounded for the file.
//!
//! # Resolution
//! First quadrilaterals in crossing pairs are cut along their other diagonal, if it fits their normals nearly as well and
//! separates the pair. Then in each round one feature of each pair is pulled back: one beyond its cell rather than one in it,
//! then the one in most pairs. It moves back by half its way to its held position in the cell, then all of it, then on to the
//! mean of its crossings, if no sign of a node changes by it (see `features`).
//!
//! Pairs that remain when no feature can be pulled back any more are **cut finer**: all vertices around them return to their
//! cells, whatever they lie on, and each of their quadrilaterals becomes four triangles around a new vertex on its lattice edge
//! (Ju & Udeshi, Intersection-free contouring on an octree grid, 2006). The part of the surface within a cell is then the cone
//! from its vertex over a closed line on the faces of the cell, and a cone over a line on the boundary of a convex body does
//! not cross itself. Only cones of one cell with several loops can, and those that do are counted.

use std::collections::{HashMap, HashSet};

use crate::parallel::*;
use glam::DVec3;

use super::cells::{MARGIN, world_from_cells};
use super::feature::Feature;
use super::features::{CellFilter, Features};
use super::intersect::{Candidate, Placed, pairs};
use super::quads::Cut;
use crate::bits;
use crate::cancel::checkpoint;
use crate::grid::Grid;
use crate::mesh::Precision;

/// Most rounds; chains of neighbours of more than four steps are rare.
const ROUNDS: usize = 32;

/// Steps of the way back: to the held position and to the mean, each in two.
const STEPS: u8 = 4;

/// Most rounds of finer cutting; each begins with the result of the last.
const FINE_ROUNDS: usize = 16;

/// Least distance of a new vertex from the ends of its lattice edge, as a share of the edge.
const EDGE_MARGIN: f64 = 0.01;

/// Most attempts to pull back a vertex that is blocked.
const REFUSALS: u8 = 4;

/// The result of separating triangles that crossed one another.
pub struct Parted {
    /// Vertices that were pulled back.
    pub pulled: u64,
    /// Pairs that still cross.
    pub left: u64,
    /// For each quadrilateral of the features the distance of its crossing from its triangles, in pitches.
    pub distances: Vec<f32>,
}

/// The world coordinates of a surface.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub grid: &'a Grid,
    /// The precision of the output file.
    pub precision: Precision,
}

impl View<'_> {
    /// Returns the world coordinates of a point in coordinates of cells: exact, and rounded for the file.
    pub fn places(&self, point: DVec3) -> [DVec3; 2] {
        let exact = world_from_cells(self.grid, point);
        [exact, self.precision.round(exact)]
    }
}

/// A surface whose triangles may cross one another.
pub struct Tangle<'a> {
    features: &'a Features<'a>,
    view: View<'a>,
    rounding: f64,
    /// Greatest movement of a vertex by the file's precision, in pitches.
    blur: f64,
    vertices: &'a mut Vec<DVec3>,
    triangles: &'a mut Vec<[u32; 3]>,
    distances: Vec<f32>,
    /// Vertices whose triangles may cross one another.
    unsound: Chosen,
    /// The quadrilaterals, by number, of features that lie beyond their cells.
    far: Vec<u32>,
    /// Quadrilaterals that are cut finer, by number, and those that stand for their additional triangles.
    fine: HashSet<u32>,
    /// For each feature its position before any step back, and the number of its steps back.
    start: Vec<DVec3>,
    steps: Vec<u8>,
    /// For each feature the number of refused steps.
    refusals: Vec<u8>,
}

/// A subset of the vertices or of the quadrilaterals, as bits.
#[derive(Clone)]
struct Chosen {
    bits: Vec<u64>,
}

impl Chosen {
    fn of(count: usize) -> Chosen {
        Chosen { bits: vec![0; count.div_ceil(64)] }
    }

    fn all(&self) -> impl Iterator<Item = u32> + '_ {
        bits::ones(&self.bits).map(|vertex| vertex as u32)
    }

    fn has(&self, vertex: u32) -> bool {
        bits::is_set(&self.bits, vertex as usize)
    }

    fn add(&mut self, vertex: u32) {
        let word = vertex as usize / 64;
        if word >= self.bits.len() {
            self.bits.resize(word + 1, 0);
        }
        self.bits[word] |= 1 << (vertex % 64);
    }
}

impl<'a> Tangle<'a> {
    /// Creates a tangle from features at their first positions; their quadrilaterals are not cut yet. `rounding` is the
    /// greatest movement of a surface by the lattice's rounding, in pitches.
    pub fn new(
        features: &'a Features<'a>,
        view: View<'a>,
        rounding: f64,
        vertices: &'a mut Vec<DVec3>,
        triangles: &'a mut Vec<[u32; 3]>,
    ) -> Tangle<'a> {
        let start = features.all.iter().map(|feature| vertices[feature.vertex as usize]).collect();
        let (steps, refusals) = (vec![0; features.all.len()], vec![0; features.all.len()]);
        let unsound = Chosen::of(vertices.len());
        let grid = view.grid;
        let size = DVec3::from_array(grid.rays().map(f64::from)) * grid.pitch();
        let furthest = grid.origin().abs().max((grid.origin() + size).abs()).max_element();
        let blur = furthest * view.precision.epsilon() / grid.pitch();
        Tangle {
            features,
            view,
            rounding,
            blur,
            vertices,
            triangles,
            distances: Vec::new(),
            unsound,
            far: Vec::new(),
            fine: HashSet::new(),
            start,
            steps,
            refusals,
        }
    }

    /// Cuts the quadrilaterals of the features and separates crossing triangles. `irregular` holds the first triangles of other
    /// quadrilaterals that are irregular.
    pub fn part(&mut self, irregular: &[u32]) -> Parted {
        self.cut_all().into_iter().for_each(|vertex| self.unsound.add(vertex));
        for &first in irregular {
            let corners = [self.triangles[first as usize], self.triangles[first as usize + 1]];
            corners.as_flattened().iter().for_each(|&vertex| self.unsound.add(vertex));
        }
        let mut suspects = self.unsound.clone();
        self.features.all.iter().filter(|feature| !feature.is_alone).for_each(|feature| suspects.add(feature.vertex));
        let mut active = self.quads_of(&suspects);
        let beyond = (0..self.features.all.len()).filter(|&i| self.is_beyond(i) || self.features.all[i].is_between);
        self.far = beyond
            .flat_map(|i| self.features.around(i))
            .map(|&at| self.features.quads[at as usize].triangle / 2)
            .collect();
        self.far.sort_unstable();
        self.far.dedup();
        self.far.iter().for_each(|&quad| active.add(quad));
        let mut crossing = self.crossing_among(&active, &self.far);
        for round in 0..ROUNDS {
            if crossing.is_empty() {
                break;
            }
            let changed = if round == 0 { self.flip(&crossing) } else { self.pull_back(&crossing) };
            if changed.is_empty() && round > 0 {
                break;
            }
            crossing = self.crossing_after(changed, &crossing);
        }
        for _ in 0..FINE_ROUNDS {
            let changed = self.cut_finer(&crossing);
            if changed.is_empty() {
                break;
            }
            crossing = self.crossing_after(changed, &crossing);
        }
        Parted { pulled: self.pulled(), left: crossing.len() as u64, distances: std::mem::take(&mut self.distances) }
    }

    /// Returns the quadrilaterals, by number, that have any of some vertices for a corner.
    fn quads_of(&self, vertices: &Chosen) -> Chosen {
        checkpoint();
        let quad = |at: usize, bit: usize| self.triangles.get(128 * at + 2 * bit..128 * at + 2 * bit + 2);
        let has = |quad: &[[u32; 3]]| quad.as_flattened().iter().any(|&vertex| vertices.has(vertex));
        let word = |at: usize| (0..64).fold(0, |bits, bit| bits | u64::from(quad(at, bit).is_some_and(has)) << bit);
        let words = (self.triangles.len() / 2).div_ceil(64);
        Chosen { bits: (0..words).into_par_iter().with_min_len(64).map(word).collect() }
    }

    /// Cuts the quadrilaterals of the features, and returns the suspects among their corners.
    fn cut_all(&mut self) -> Vec<u32> {
        checkpoint();
        let (features, vertices) = (self.features, &*self.vertices);
        let cuts: Vec<Cut> = features.quads.par_iter().with_min_len(256).map(|open| open.quad.cut(vertices)).collect();
        for (open, cut) in features.quads.iter().zip(&cuts) {
            self.triangles[open.triangle as usize..][..2].copy_from_slice(&cut.triangles);
        }
        self.distances = cuts.iter().map(|cut| cut.distance).collect();
        let suspect = |(open, cut): (&super::quads::OpenQuad, &Cut)| {
            let is_suspect = |vertex: &u32| match features.of_vertex(*vertex) {
                None => !cut.is_regular,
                Some(i) => {
                    let feature = &features.all[i];
                    !open.quad.faces(feature.facing, vertices)
                }
            };
            open.quad.corners.into_iter().filter(is_suspect).collect::<Vec<u32>>()
        };
        features.quads.par_iter().zip(&cuts).with_min_len(256).flat_map_iter(suspect).collect()
    }

    /// Returns the vertices whose held positions are in some cells.
    fn at_home_in(&self, cells: &CellFilter) -> Chosen {
        checkpoint();
        let features = self.features;
        let is_in = |vertex: usize| {
            let home = features.of_vertex(vertex as u32).map_or(self.vertices[vertex], |i| features.all[i].held);
            cells.may_hold(home)
        };
        let count = self.vertices.len();
        let word = |at: usize| {
            (64 * at..count.min(64 * at + 64)).fold(0, |bits, vertex| bits | u64::from(is_in(vertex)) << (vertex % 64))
        };
        Chosen { bits: (0..count.div_ceil(64)).into_par_iter().with_min_len(64).map(word).collect() }
    }

    /// Returns the pairs of triangles that cross one another, at least one being of an `active` quadrilateral. Inactive ones
    /// are searched in the cells that the triangles of the quadrilaterals `touching` touch, given by number.
    fn crossing_among(&self, active: &Chosen, touching: &[u32]) -> Vec<[u32; 2]> {
        checkpoint();
        let mut cells = CellFilter::new(16 * touching.len());
        for triangle in touching.iter().flat_map(|quad| [2 * quad, 2 * quad + 1]) {
            self.candidate(triangle, true).cells().for_each(|cell| cells.add(cell));
        }
        let mut quads = self.quads_of(&self.at_home_in(&cells));
        // Features with a home elsewhere may reach there.
        let reaches = |&&quad: &&u32| {
            let mut triangles = [2 * quad, 2 * quad + 1].into_iter();
            !active.has(quad) && triangles.any(|t| self.candidate(t, false).cells().any(|cell| cells.may_be(cell)))
        };
        let far: Vec<u32> = self.far.par_iter().with_min_len(64).filter(reaches).copied().collect();
        far.into_iter().for_each(|quad| quads.add(quad));
        quads.bits.iter_mut().zip(&active.bits).for_each(|(bits, active)| *bits |= active);
        let of_quad = |quad: u32| [2 * quad, 2 * quad + 1].map(|triangle| self.candidate(triangle, active.has(quad)));
        let candidates: Vec<Candidate> = quads.all().flat_map(of_quad).filter(has_corners).collect();
        let is_sound = |vertex: &u32| !self.unsound.has(*vertex);
        let do_meet = |one: &Candidate, other: &Candidate| {
            !one.vertices.iter().any(|vertex| other.vertices.contains(vertex) && is_sound(vertex))
                && !are_clearly_parted(one, other, self.blur)
                && self.do_meet(one.vertices, other.vertices)
        };
        pairs(&candidates, |candidate, cell| candidate.is_active || cells.may_be(cell), do_meet)
    }

    fn candidate(&self, triangle: u32, is_active: bool) -> Candidate {
        let vertices = self.triangles[triangle as usize];
        Candidate::new(triangle, is_active, vertices, vertices.map(|vertex| self.vertices[vertex as usize]))
    }

    /// Returns the pairs that cross after some quadrilaterals, given by number, have changed; before, the pairs `crossing` did.
    fn crossing_after(&mut self, mut changed: Vec<u32>, crossing: &[[u32; 2]]) -> Vec<[u32; 2]> {
        changed.extend(crossing.as_flattened().iter().map(|triangle| triangle / 2));
        changed.sort_unstable();
        changed.dedup();
        let mut active = Chosen::of(self.triangles.len() / 2);
        for &quad in &changed {
            active.add(quad);
            let corners = &self.triangles[2 * quad as usize..][..2];
            corners.as_flattened().iter().for_each(|&vertex| self.unsound.add(vertex));
        }
        self.crossing_among(&active, &changed)
    }

    /// Cuts quadrilaterals of crossing triangles along the other diagonal where that separates them, and returns their numbers.
    fn flip(&mut self, crossing: &[[u32; 2]]) -> Vec<u32> {
        let quads = self.features.quads;
        let mut flipped = HashSet::new();
        for pair in crossing {
            let pair = pair.map(|triangle| triangle / 2);
            if pair[0] == pair[1] || pair.iter().any(|quad| flipped.contains(quad)) {
                continue;
            }
            for (quad, other) in [(pair[0], pair[1]), (pair[1], pair[0])] {
                let Ok(at) = quads.binary_search_by_key(&(2 * quad), |open| open.triangle) else { continue };
                let Some(cut) = quads[at].quad.cut_otherwise(self.vertices) else { continue };
                let others = &self.triangles[2 * other as usize..][..2];
                let is_crossed = |triangle| others.iter().any(|&other| self.do_meet(triangle, other));
                if !cut.triangles.into_iter().any(is_crossed) {
                    self.triangles[2 * quad as usize..][..2].copy_from_slice(&cut.triangles);
                    self.distances[at] = cut.distance;
                    flipped.insert(quad);
                    break;
                }
            }
        }
        flipped.into_iter().collect()
    }

    /// Returns whether two triangles cross one another, exact or rounded.
    fn do_meet(&self, one: [u32; 3], other: [u32; 3]) -> bool {
        let places = |vertex: u32| self.view.places(self.vertices[vertex as usize]);
        let [one, other] = [one, other].map(|triangle| Placed::new(triangle, self.view.precision, places));
        one.meets(&other)
    }

    /// Pulls back some of the features in pairs of crossing triangles, and returns the numbers of their quadrilaterals.
    fn pull_back(&mut self, crossing: &[[u32; 2]]) -> Vec<u32> {
        let features = self.features;
        let can_go = |&i: &usize| self.steps[i] < STEPS && self.refusals[i] < REFUSALS;
        let of_pair = |pair: &[u32; 2]| -> Vec<usize> {
            checkpoint();
            let vertices = pair.map(|triangle| self.triangles[triangle as usize]);
            let mut of_pair: Vec<usize> = vertices
                .as_flattened()
                .iter()
                .filter_map(|&vertex| features.of_vertex(vertex))
                .filter(can_go)
                .collect();
            of_pair.sort_unstable();
            of_pair.dedup();
            of_pair
        };
        let of_pairs: Vec<Vec<usize>> = crossing.par_iter().map(of_pair).collect();
        let mut votes: HashMap<usize, u32> = HashMap::new();
        of_pairs.iter().flatten().for_each(|&i| *votes.entry(i).or_default() += 1);
        // Vertices beyond their cells go first, then those of most votes, then those furthest from their means; those beside blocks of
        // finer cells, whose triangles are large, go last.
        let weight = |i: usize| {
            let feature = &features.all[i];
            (
                !feature.is_between,
                self.is_beyond(i),
                votes[&i],
                self.vertices[feature.vertex as usize].distance(feature.mean),
            )
        };
        let weights: HashMap<usize, (bool, bool, u32, f64)> = votes.keys().map(|&i| (i, weight(i))).collect();
        let mut chosen: Vec<usize> = of_pairs
            .iter()
            .filter_map(|of_pair| {
                of_pair
                    .iter()
                    .copied()
                    .max_by(|a, b| weights[a].partial_cmp(&weights[b]).unwrap_or(std::cmp::Ordering::Equal))
            })
            .collect();
        chosen.sort_unstable();
        chosen.dedup();
        let mut changed = Vec::new();
        for i in chosen {
            if self.step_back(i) {
                changed.extend_from_slice(features.around(i));
                continue;
            }
            // Neighbours beyond their cells may be in the way.
            let quads = features.around(i).iter().map(|&at| &features.quads[at as usize].quad);
            let mut near: Vec<usize> = quads.flat_map(|quad| features.features_of(quad)).collect();
            near.sort_unstable();
            near.dedup();
            for j in near {
                if j != i && self.is_beyond(j) && self.step_back(j) {
                    changed.extend_from_slice(features.around(j));
                }
            }
        }
        self.cut_again(changed)
    }

    /// Cuts quadrilaterals of features whose vertices have moved, and returns their numbers among all.
    fn cut_again(&mut self, mut moved: Vec<u32>) -> Vec<u32> {
        moved.sort_unstable();
        moved.dedup();
        for &at in &moved {
            let open = &self.features.quads[at as usize];
            if !self.fine.contains(&(open.triangle / 2)) {
                let cut = open.quad.cut(self.vertices);
                self.triangles[open.triangle as usize..][..2].copy_from_slice(&cut.triangles);
                self.distances[at as usize] = cut.distance;
            }
        }
        moved.into_iter().map(|at| self.features.quads[at as usize].triangle / 2).collect()
    }

    /// Takes all vertices of crossing triangles and their neighbours back to their cells, cuts the quadrilaterals around the
    /// former finer, and returns the numbers of all that changed.
    ///
    /// No sign of a node changes by this: the triangles of an edge whose vertices are all in its cells lie in the block of
    /// these.
    fn cut_finer(&mut self, crossing: &[[u32; 2]]) -> Vec<u32> {
        checkpoint();
        if crossing.is_empty() {
            return Vec::new();
        }
        let features = self.features;
        let is_of_cell = |vertex: &u32| (*vertex as usize) < features.marks.len();
        let mut crossed = Chosen::of(self.vertices.len());
        for triangle in crossing.as_flattened() {
            let corners = self.triangles[*triangle as usize & !1..][..2].as_flattened();
            corners.iter().copied().filter(is_of_cell).for_each(|vertex| crossed.add(vertex));
        }
        let quads: Vec<u32> = self.quads_of(&crossed).all().collect();
        let corners = |&quad: &u32| self.triangles[2 * quad as usize..][..2].as_flattened();
        let mut waiting: Vec<usize> =
            quads.iter().flat_map(corners).filter_map(|&vertex| features.of_vertex(vertex)).collect();
        // Where a vertex may not return by itself, its neighbours return with it.
        let mut moved = Vec::new();
        while let Some(i) = waiting.pop() {
            let Feature { vertex, held, mean, .. } = features.all[i];
            let (place, steps) = if crossed.has(vertex) { (mean, STEPS) } else { (held, 2) };
            if self.steps[i] >= steps || (!crossed.has(vertex) && !self.is_beyond(i)) {
                continue;
            }
            if !features.may_go(i, place, self.rounding.min(MARGIN), self.vertices) {
                let quads = features.around(i).iter().map(|&at| &features.quads[at as usize].quad);
                waiting.extend(quads.flat_map(|quad| features.features_of(quad)));
            }
            self.vertices[vertex as usize] = place;
            self.steps[i] = steps;
            moved.extend_from_slice(features.around(i));
        }
        let mut changed = self.cut_again(moved);
        for quad in quads {
            if self.fine.insert(quad) {
                let further = (self.triangles.len() / 2) as u32;
                self.fine.insert(further);
                changed.extend([quad, further]);
                self.cut_to_edge(quad);
            }
        }
        changed
    }

    /// Cuts a quadrilateral whose vertices are all in their cells into four triangles around a new vertex on its edge.
    fn cut_to_edge(&mut self, quad: u32) {
        let [one, other] = [0, 1].map(|i| self.triangles[2 * quad as usize + i]);
        let corners @ [a, b, c, d] = match other[0] == one[0] {
            true => [one[0], one[1], one[2], other[2]],
            false => [one[0], one[1], other[1], one[2]],
        };
        let new = self.vertices.len() as u32;
        let places = corners.map(|vertex| self.vertices[vertex as usize]);
        let at = self.features.quads.binary_search_by_key(&(2 * quad), |open| open.triangle);
        self.vertices.push(match at {
            Ok(at) => self.features.quads[at].quad.crossing_within(EDGE_MARGIN),
            Err(_) => on_edge(places),
        });
        self.triangles[2 * quad as usize..][..2].copy_from_slice(&[[a, b, new], [b, c, new]]);
        self.triangles.extend([[c, d, new], [d, a, new]]);
    }

    /// Moves a feature to the next allowed place on its way back.
    fn step_back(&mut self, feature: usize) -> bool {
        let Feature { vertex, held, mean, .. } = self.features.all[feature];
        let start = self.start[feature];
        let from = self.vertices[vertex as usize];
        let places = [start.lerp(held, 0.5), held, held.lerp(mean, 0.5), mean];
        let mut refused = false;
        for (step, to) in (1u8..).zip(places).skip(usize::from(self.steps[feature])) {
            if from.distance(to) <= MARGIN {
                continue;
            }
            let margins = [MARGIN, self.rounding.min(MARGIN)];
            if margins.into_iter().any(|margin| self.features.may_go(feature, to, margin, self.vertices)) {
                self.vertices[vertex as usize] = to;
                self.steps[feature] = step;
                return true;
            }
            refused = true;
        }
        self.refusals[feature] = if refused { self.refusals[feature] + 1 } else { REFUSALS };
        false
    }

    /// Returns the number of vertices that were pulled back.
    fn pulled(&self) -> u64 {
        let features = self.features.all.iter().filter(|feature| !feature.is_between);
        features.zip(&self.steps).filter(|&(_, &steps)| steps > 0).count() as u64
    }

    /// Returns whether a feature is still beyond its cell.
    fn is_beyond(&self, feature: usize) -> bool {
        let Feature { held, is_between, .. } = self.features.all[feature];
        !is_between && self.start[feature] != held && self.steps[feature] < 2
    }
}

/// Returns a point on the lattice edge that four cells have in common, at the mean coordinate along it of a point in each cell.
fn on_edge(places: [DVec3; 4]) -> DVec3 {
    let cells = places.map(|place| place.floor());
    let (least, greatest) = cells.into_iter().fold((cells[0], cells[0]), |(a, b), cell| (a.min(cell), b.max(cell)));
    let along = greatest
        + (places.into_iter().sum::<DVec3>() / 4.0 - greatest)
            .clamp(DVec3::splat(EDGE_MARGIN), DVec3::splat(1.0 - EDGE_MARGIN));
    DVec3::select(least.cmpeq(greatest), along, greatest)
}

/// Returns whether the corners of a triangle differ: beside a block of finer cells, those of one triangle of a pair may not.
fn has_corners(candidate: &Candidate) -> bool {
    let [a, b, c] = candidate.vertices;
    a != b && b != c && c != a
}

/// Returns whether a plane clearly separates two triangles except at shared vertices, wherever vertices are moved by `blur`:
/// the plane of either, or one perpendicular to either through a side.
fn are_clearly_parted(one: &Candidate, other: &Candidate, blur: f64) -> bool {
    let parts = |one: &Candidate, other: &Candidate| {
        let [a, b, c] = one.corners;
        let (ab, ac) = (b - a, c - a);
        let normal = ab.cross(ac);
        let from_a = other.corners.map(|place| place - a);
        let lengths = [ab, ac, from_a[0], from_a[1], from_a[2]].map(|v| v.length_squared());
        let reach = lengths.into_iter().fold(0.0, f64::max);
        let least = 8.0 * blur * reach;
        let shared = other.vertices.map(|vertex| one.vertices.iter().position(|&corner| corner == vertex));
        let volumes = from_a.map(|place| normal.dot(place));
        if (0..3).all(|j| shared[j].is_some() || volumes[j] > least)
            || (0..3).all(|j| shared[j].is_some() || volumes[j] < -least)
        {
            return true;
        }
        let least = 3.0 * least * reach.sqrt();
        (0..3).any(|i| {
            let next = (i + 1) % 3;
            let outwards = (one.corners[next] - one.corners[i]).cross(normal);
            (0..3).all(|j| match shared[j] {
                Some(corner) => corner == i || corner == next,
                None => outwards.dot(other.corners[j] - one.corners[i]) > least,
            })
        })
    };
    parts(one, other) || parts(other, one)
}
