//! Triangles at the vertices of leaves, and their repair.
//!
//! Leaves differ in size, so that triangles may be turned over although their vertices lie in the right cells, and the planes of
//! its own crossings say nothing of those of its neighbours. Three steps mend that, while the surface of the next slabs is made:
//! 1. A leaf is flat, and its vertex **slides** in it towards the middle of its neighbours where that turns triangles back.
//! 2. Of triangles that are still turned over, a side is **turned** to join the two corners opposite.
//! 3. Crossings further than the bound from the triangles around their leaf become vertices: each is **inserted** in the
//!    triangle nearest to it, or in its side (Garland & Heckbert, Fast polygonal approximation of terrains, 1995).
//!
//! What remains too far, and triangles that cross others, fail: their leaves are left out of another attempt.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::leaves::{Leaf, Leaves};
use super::resolve_self_intersections::View;
use crate::box_tree::{Box32, BoxTree};
use crate::cancel::checkpoint;
use crate::closest::squared_distance;
use crate::mesh::meet::{are_parted, meet, widest_axis};

/// Least cosine between a triangle's normal and the mean normal of its leaf.
const UPRIGHT: f64 = 0.25;

/// Least area of a triangle, in square pitches: smaller ones turn over when rounded.
const LEAST_AREA: f64 = 1e-4;

/// Attempts to slide a vertex.
const ROUNDS: usize = 4;

/// Rounds of inserting crossings.
const INSERTIONS: usize = 6;

/// The share of the bound within which a triangle is near enough to a crossing.
const NEAR: f64 = 0.25;

/// Least distance of a point from the sides of a triangle, as a share of a side, at which it is inserted in its middle.
const CENTRAL: f64 = 0.1;

/// Shares of the way to the middle of its neighbours that a vertex tries.
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// The leaves of a slab, with the first triangle at any of them, and the crossings that they stand for.
#[derive(Default)]
struct Slab {
    leaves: Leaves,
    first_triangle: usize,
    samples: Vec<Sample>,
}

/// A crossing, and the vertex of a leaf beside it.
pub type Sample = (u32, DVec3);

/// The triangles that have a vertex of a leaf.
#[derive(Default)]
pub struct LeafTriangles {
    all: Vec<[u32; 3]>,
    slabs: Vec<Slab>,
    /// Leaves with a triangle that is turned over.
    unsound: HashSet<u32>,
    /// Leaves with a crossing that is too far, as it could not be inserted.
    failed: Vec<u32>,
    /// The largest distance of a crossing, in pitches.
    distance: f64,
}

/// The triangles around the vertices of some leaves.
struct Fans {
    first: u32,
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl Fans {
    fn of(leaves: Range<u32>, triangles: &[[u32; 3]], first_triangle: usize) -> Fans {
        let mut starts = vec![0; leaves.len() + 1];
        let of_leaf = |vertex: &&u32| leaves.contains(vertex);
        let corners = || triangles[first_triangle..].as_flattened().iter().enumerate();
        corners().filter(|(_, vertex)| of_leaf(vertex)).for_each(|(_, v)| starts[(v - leaves.start) as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let (mut next, mut around) = (starts.clone(), vec![0; starts[leaves.len()] as usize]);
        for (corner, vertex) in corners().filter(|(_, vertex)| of_leaf(vertex)) {
            let free = &mut next[(vertex - leaves.start) as usize];
            around[*free as usize] = (first_triangle + corner / 3) as u32;
            *free += 1;
        }
        Fans { first: leaves.start, starts, around }
    }

    fn at(&self, leaf: u32) -> &[u32] {
        let at = (leaf - self.first) as usize;
        &self.around[self.starts[at] as usize..self.starts[at + 1] as usize]
    }
}

impl LeafTriangles {
    /// Returns the leaves of the last slab, or none.
    pub fn last(&self) -> Option<&Leaves> {
        self.slabs.last().map(|slab| &slab.leaves)
    }

    /// Returns the leaf of a vertex.
    fn leaf(&self, vertex: u32) -> Option<&Leaf> {
        let slab = self.slabs.partition_point(|slab| slab.leaves.vertices().start <= vertex).checked_sub(1)?;
        let leaves = &self.slabs[slab].leaves;
        leaves.all.get((vertex - leaves.vertices().start) as usize)
    }

    /// Adds the leaves of a slab whose first triangles follow, with the crossings beside them.
    pub fn add_slab(&mut self, leaves: Leaves, triangles: impl Iterator<Item = [u32; 3]>, samples: Vec<Sample>) {
        self.slabs.push(Slab { leaves, first_triangle: self.all.len(), samples });
        self.all.extend(triangles);
    }

    /// Slides the vertices of the slab before the last, all of whose triangles are known, and repairs the triangles of the one
    /// before it.
    pub fn settle(&mut self, bound: f64, view: View, vertices: &mut Vec<DVec3>) {
        let count = self.slabs.len();
        if let Some(slab) = count.checked_sub(2) {
            self.slide(slab, view, vertices);
        }
        if let Some(slab) = count.checked_sub(3) {
            self.repair(slab, bound, vertices);
        }
    }

    /// Does what [`settle`](LeafTriangles::settle) has not yet done, and looks for triangles that cross one another or `others`,
    /// which are those without a leaf.
    pub fn finish(mut self, bound: f64, view: View, others: &[[u32; 3]], vertices: &mut Vec<DVec3>) -> Finished {
        let count = self.slabs.len();
        if count > 0 {
            self.slide(count - 1, view, vertices);
        }
        (count.saturating_sub(2)..count).for_each(|slab| self.repair(slab, bound, vertices));
        if self.failed.is_empty() {
            self.failed = self.crossing(view, others, vertices);
        }
        self.failed.sort_unstable();
        self.failed.dedup();
        let failed = self.failed.iter().filter_map(|&vertex| self.leaf(vertex)).map(|leaf| (leaf.origin, leaf.size));
        Finished { failed: failed.collect(), triangles: self.all, distance: self.distance }
    }

    /// Returns how well a triangle faces where its leaves do: at best 1, below [`UPRIGHT`] it fails.
    fn upright(&self, triangle: [u32; 3], at: impl Fn(u32) -> DVec3) -> f64 {
        let facing: DVec3 = triangle.iter().filter_map(|&v| self.leaf(v)).map(|leaf| leaf.facing.as_dvec3()).sum();
        upright(facing.normalize_or_zero(), triangle.map(at))
    }

    /// Slides vertices of leaves of a slab where triangles are turned over.
    fn slide(&self, slab: usize, view: View, vertices: &mut [DVec3]) {
        checkpoint();
        let Slab { leaves, first_triangle, .. } = &self.slabs[slab];
        if leaves.all.is_empty() {
            return;
        }
        let range = leaves.vertices();
        let mut fans = None;
        for _ in 0..ROUNDS {
            let fails = |triangle: &[u32; 3]| {
                let is_own = triangle.iter().any(|vertex| range.contains(vertex));
                is_own && self.upright(*triangle, |vertex| vertices[vertex as usize]) < UPRIGHT
            };
            let failing =
                self.all[*first_triangle..].par_iter().with_min_len(1 << 10).filter(|triangle| fails(triangle));
            let failing: Vec<&[u32; 3]> = failing.collect();
            let mut movers: Vec<u32> = failing.into_iter().flatten().copied().filter(|v| range.contains(v)).collect();
            movers.sort_unstable();
            movers.dedup();
            if movers.is_empty() {
                return;
            }
            let fans = fans.get_or_insert_with(|| Fans::of(range.clone(), &self.all, *first_triangle));
            for mover in movers {
                let leaf = &leaves.all[(mover - range.start) as usize];
                let fan = fans.at(mover);
                let worst = |place: DVec3| {
                    let at = |vertex: u32| if vertex == mover { place } else { vertices[vertex as usize] };
                    fan.iter().map(|&t| self.upright(self.all[t as usize], at)).fold(1.0, f64::min)
                };
                let here = vertices[mover as usize];
                let around = || fan.iter().flat_map(|&t| self.all[t as usize]).filter(|&vertex| vertex != mover);
                let middle = around().map(|v| vertices[v as usize]).sum::<DVec3>() / around().count() as f64;
                let way = (middle - here).reject_from(leaf.facing.as_dvec3());
                let bounds = leaf.bounds(view.grid);
                let places = SHARES.map(|share| bounds.hold(here + way * share));
                let best = places
                    .into_iter()
                    .map(|place| (worst(place), place))
                    .fold((worst(here), here), |best, other| if other.0 > best.0 { other } else { best });
                vertices[mover as usize] = best.1;
            }
        }
    }

    /// Turns sides of triangles of a slab that are turned over, and inserts crossings that are further than the bound from the
    /// triangles around their leaf.
    fn repair(&mut self, slab: usize, bound: f64, vertices: &mut Vec<DVec3>) {
        checkpoint();
        let samples = std::mem::take(&mut self.slabs[slab].samples);
        let Slab { leaves, first_triangle, .. } = &self.slabs[slab];
        let own = leaves.vertices();
        // Crossings of the lowest plane may be those of leaves of the slab below.
        let below = slab.checked_sub(1).map(|below| &self.slabs[below]);
        let start = below.map_or(own.start, |below| below.leaves.vertices().start);
        let first = below.map_or(*first_triangle, |below| below.first_triangle);
        let fans = Fans::of(start..own.end, &self.all, first);
        let turned: Vec<u32> = (first as u32..self.all.len() as u32)
            .into_par_iter()
            .with_min_len(1 << 10)
            .filter(|&triangle| {
                let triangle = self.all[triangle as usize];
                let is_own = triangle.iter().any(|vertex| own.contains(vertex));
                is_own && self.upright(triangle, |vertex| vertices[vertex as usize]) < UPRIGHT
            })
            .collect();
        let parts = vec![Vec::new(); self.all.len() - first];
        let mut repair = Repair { triangles: self, vertices, first, sides: HashMap::new(), parts };
        for &triangle in &turned {
            if !repair.turn(triangle) {
                let corners = repair.triangles.all[triangle as usize];
                repair.triangles.unsound.extend(corners);
            }
        }
        let (mut measured, mut largest) = (samples, 0.0);
        for round in 0..=INSERTIONS {
            let distance = |&(leaf, point): &Sample| repair.nearest(&fans, leaf, point, NEAR * bound).0;
            let distances: Vec<f64> = measured.par_iter().with_min_len(1 << 10).map(distance).collect();
            let (far, near): (Vec<usize>, Vec<usize>) = (0..measured.len()).partition(|&i| distances[i] > bound);
            largest = near.iter().fold(largest, |most: f64, &i| most.max(distances[i]));
            if far.is_empty() {
                break;
            }
            let mut touched = HashSet::new();
            for i in far {
                let (leaf, point) = measured[i];
                if round == INSERTIONS || !repair.insert(&fans, leaf, point, bound, &mut touched) {
                    repair.triangles.failed.push(leaf);
                }
            }
            measured.retain(|(leaf, _)| touched.contains(leaf));
        }
        self.distance = self.distance.max(largest);
    }

    /// Returns the leaves whose triangles meet others elsewhere than in what they share.
    fn crossing(&self, view: View, others: &[[u32; 3]], vertices: &[DVec3]) -> Vec<u32> {
        if self.all.is_empty() {
            return Vec::new();
        }
        checkpoint();
        let places: Vec<[DVec3; 2]> = vertices.par_iter().with_min_len(1 << 12).map(|&v| view.places(v)).collect();
        let at = |triangle: [u32; 3]| triangle.map(|vertex| places[vertex as usize]);
        let box_of = |triangle: [u32; 3]| Box32::around(at(triangle).into_iter().flatten());
        let tree = BoxTree::new(self.all.len(), |item| box_of(self.all[item as usize]));
        let is_sound = |vertex: u32| self.leaf(vertex).is_some() && !self.unsound.contains(&vertex);
        let is_sound: Vec<bool> = (0..vertices.len() as u32).into_par_iter().map(is_sound).collect();
        // If all triangles around the vertex of a leaf face one direction, they lie side by side.
        let share_leaf = |one: [u32; 3], other: [u32; 3]| {
            one.iter().any(|vertex| is_sound[*vertex as usize] && other.contains(vertex))
        };
        let meets = |(number, triangle): (usize, &[u32; 3])| {
            let bounds = box_of(*triangle);
            let mut met = Vec::new();
            let each = |items: &[u32]| {
                for &item in items.iter().filter(|&&item| (item as usize) < number) {
                    let other = self.all[item as usize];
                    if !share_leaf(*triangle, other) && do_meet([*triangle, other], &places) {
                        met.extend(triangle.iter().chain(&other).copied().filter(|&v| self.leaf(v).is_some()));
                    }
                }
            };
            tree.visit(|node| node.touches(&bounds), each);
            met
        };
        let own = self.all.par_iter().with_min_len(256).enumerate().flat_map_iter(meets);
        let mut found: Vec<u32> = own.collect();
        let with_others = others.par_iter().with_min_len(256).flat_map_iter(|t| meets((usize::MAX, t)));
        found.extend(with_others.collect::<Vec<u32>>());
        found
    }
}

/// Returns whether two triangles meet elsewhere than in what they share, exact or rounded, which are the places of vertices.
fn do_meet([one, other]: [[u32; 3]; 2], places: &[[DVec3; 2]]) -> bool {
    let shared = other.map(|vertex| one.iter().position(|&corner| corner == vertex).unwrap_or(3));
    (0..2).any(|rounded| {
        let at = |vertex: u32| places[vertex as usize][rounded];
        let [a, b] = [one.map(at), other.map(at)];
        !are_parted(&a, &b, shared, widest_axis(a)) && meet(one, other, at)
    })
}

/// The repair of the triangles of a slab, from the first triangle on.
struct Repair<'a> {
    triangles: &'a mut LeafTriangles,
    vertices: &'a mut Vec<DVec3>,
    first: usize,
    /// The triangle at each side, by the ends in the triangle's direction; empty until it is needed.
    sides: HashMap<[u32; 2], u32>,
    /// For each triangle from the first on those that cover, with it, what it covered alone.
    parts: Vec<Vec<u32>>,
}

impl Repair<'_> {
    fn at(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize]
    }

    fn is_upright(&self, triangle: [u32; 3]) -> bool {
        self.triangles.upright(triangle, |vertex| self.at(vertex)) >= UPRIGHT
    }

    /// Returns the triangle beyond a side, with its corner opposite.
    fn beyond(&mut self, [u, v]: [u32; 2]) -> Option<(u32, u32)> {
        if self.sides.is_empty() {
            for (number, triangle) in (self.first as u32..).zip(&self.triangles.all[self.first..]) {
                sides(*triangle).into_iter().for_each(|side| _ = self.sides.insert(side, number));
            }
        }
        let other = *self.sides.get(&[v, u])?;
        let corner = self.triangles.all[other as usize].into_iter().find(|&corner| corner != u && corner != v)?;
        Some((other, corner))
    }

    /// Replaces triangles by others that cover the same part of the surface.
    fn replace(&mut self, old: &[u32], new: &[[u32; 3]]) {
        for &number in old {
            for side in sides(self.triangles.all[number as usize]) {
                self.sides.remove(&side);
            }
        }
        let first = self.triangles.all.len() as u32;
        let further = new.len() - old.len();
        self.triangles.all.extend(&new[old.len()..]);
        let numbers: Vec<u32> = old.iter().copied().chain(first..first + further as u32).collect();
        for (&number, &triangle) in numbers.iter().zip(new) {
            self.triangles.all[number as usize] = triangle;
            sides(triangle).into_iter().for_each(|side| _ = self.sides.insert(side, number));
        }
        self.parts.resize(self.triangles.all.len() - self.first, Vec::new());
        for &number in old {
            let others = numbers.iter().copied().filter(|&other| other != number);
            self.parts[number as usize - self.first].extend(others);
        }
    }

    /// Turns a side of a triangle that is turned over, so that it and its neighbour are no longer; returns whether it did.
    fn turn(&mut self, triangle: u32) -> bool {
        let corners = self.triangles.all[triangle as usize];
        if self.is_upright(corners) {
            return true;
        }
        for i in 0..3 {
            let [a, b, c] = [0, 1, 2].map(|j| corners[(i + j) % 3]);
            let Some((other, d)) = self.beyond([a, b]) else { continue };
            let new = [[a, d, c], [d, b, c]];
            // All triangles of a leaf's vertex are known, so that the new side is new.
            let is_known = [c, d].into_iter().any(|vertex| self.triangles.leaf(vertex).is_some());
            let is_new = !self.sides.contains_key(&[c, d]) && !self.sides.contains_key(&[d, c]);
            if is_known && is_new && new.into_iter().all(|triangle| self.is_upright(triangle)) {
                self.replace(&[triangle, other], &new);
                return true;
            }
        }
        false
    }

    /// Returns the distance of a point from the triangles around a leaf, and the nearest of these, or any within a distance of
    /// `enough`.
    fn nearest(&self, fans: &Fans, leaf: u32, point: DVec3, enough: f64) -> (f64, u32) {
        let mut best = (f64::INFINITY, 0);
        let mut look = |number: u32| {
            let corners = self.triangles.all[number as usize].map(|vertex| self.at(vertex));
            let squared = squared_distance(point, corners);
            if squared < best.0 {
                best = (squared, number);
            }
            squared <= enough * enough
        };
        let fan = fans.at(leaf);
        let parts = |number: u32| &self.parts[number as usize - self.first];
        if !fan.iter().any(|&number| look(number)) && fan.iter().any(|&number| !parts(number).is_empty()) {
            let mut seen = fan.to_vec();
            let mut at = 0;
            while at < seen.len() {
                for &part in parts(seen[at]) {
                    if !seen.contains(&part) {
                        look(part);
                        seen.push(part);
                    }
                }
                at += 1;
            }
        }
        (best.0.sqrt(), best.1)
    }

    /// Makes a point a vertex of the triangle nearest to it, if it is further than the bound; returns whether it is near.
    /// Appends the leaves of the triangles that changed.
    fn insert(&mut self, fans: &Fans, leaf: u32, point: DVec3, bound: f64, touched: &mut HashSet<u32>) -> bool {
        let (distance, number) = self.nearest(fans, leaf, point, 0.0);
        if distance <= bound {
            return true;
        }
        let vertex = self.vertices.len() as u32;
        self.vertices.push(point);
        let corners @ [a, b, c] = self.triangles.all[number as usize];
        // First across the side that is nearest.
        let away = |[u, v]: [u32; 2]| squared_distance(point, [self.at(u), self.at(v), self.at(v)]);
        let mut by_distance = sides(corners);
        by_distance.sort_by(|one, other| away(*one).total_cmp(&away(*other)));
        let face = [[a, b, vertex], [b, c, vertex], [c, a, vertex]];
        let nearest = by_distance[0];
        let is_central = away(nearest) > CENTRAL * CENTRAL * self.at(a).distance_squared(self.at(b));
        let mut ways = Vec::with_capacity(4);
        for [u, v] in by_distance {
            let w = corners.into_iter().find(|&corner| corner != u && corner != v).unwrap_or(u);
            if let Some((other, x)) = self.beyond([u, v]) {
                ways.push((vec![number, other], vec![[u, vertex, w], [vertex, v, w], [v, vertex, x], [vertex, u, x]]));
            }
        }
        ways.insert(if is_central { 0 } else { ways.len().min(1) }, (vec![number], face.to_vec()));
        let facing = self.triangles.leaf(leaf).map_or(DVec3::ZERO, |leaf| leaf.facing.as_dvec3());
        let worst = |(_, new): &(Vec<u32>, Vec<[u32; 3]>)| {
            new.iter().map(|triangle| upright(facing, triangle.map(|v| self.at(v)))).fold(1.0, f64::min)
        };
        let sound = ways.iter().position(|way| worst(way) >= UPRIGHT);
        let best = sound.or_else(|| (0..ways.len()).max_by(|&a, &b| worst(&ways[a]).total_cmp(&worst(&ways[b]))));
        let Some((old, new)) = best.map(|way| ways.swap_remove(way)).filter(|way| worst(way) > 0.0) else {
            self.vertices.pop();
            return false;
        };
        if sound.is_none() {
            self.triangles.unsound.extend(new.as_flattened());
        }
        let corners = old.iter().flat_map(|&number| self.triangles.all[number as usize]);
        touched.extend(corners.filter(|&corner| self.triangles.leaf(corner).is_some()));
        self.replace(&old, &new);
        true
    }
}

fn sides([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Returns the cosine between a triangle's normal and a direction; −1 for one without area.
fn upright(facing: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let cross = (b - a).cross(c - a);
    let length = cross.length();
    if length < 2.0 * LEAST_AREA { -1.0 } else { cross.dot(facing) / length }
}

/// The result of the tests.
pub struct Finished {
    /// Leaves that fail: their lowest cell, and cells along a side.
    pub failed: Vec<([i32; 3], i32)>,
    pub triangles: Vec<[u32; 3]>,
    /// The largest distance of a crossing from the triangles, in pitches.
    pub distance: f64,
}
