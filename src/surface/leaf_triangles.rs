//! Triangles at the vertices of leaves, and their repair.
//!
//! Leaves differ in size, so that triangles may be turned over although their vertices lie in the right cells, and the planes of
//! its own crossings say nothing of those of its neighbours. Three steps mend that, while the surface of the next slabs is made:
//! 1. A leaf is flat, and its vertex **slides** in it towards the middle of its neighbours where that turns triangles back.
//! 2. Of triangles that are still turned over, a side is **turned** to join the two corners opposite.
//! 3. Crossings further than the bound from the triangles around their leaf become vertices: each is **inserted** in the
//!    triangle nearest to it, or in its side (Garland & Heckbert, Fast polygonal approximation of terrains, 1995).
//!
//! At the end the distances of all crossings are measured anew, and triangles that cross others are searched. Blocks that fail
//! have single cells in another attempt.

use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::intersect::cell_of;
use super::leaves::{Leaf, Leaves};
use super::resolve_self_intersections::View;
use crate::box_tree::{Box32, BoxTree};
use crate::cancel::checkpoint;
use crate::closest::squared_distance;

/// Least cosine between a triangle's normal and the mean normal of its leaf.
const UPRIGHT: f64 = 0.25;

/// That cosine for each of its leaves, exact and rounded, above which no pair of triangles around a leaf is tested.
const SOUND: f64 = 0.1;

/// Share by which a distance may exceed the bound, as it is rounded.
const ROUNDED: f64 = 1e-9;

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

/// A block of cells: the lowest, and the number along a side.
pub type Block = ([i32; 3], i32);

/// A crossing, and the vertex of a leaf beside it.
pub type Sample = (u32, DVec3);

/// The triangles that have a vertex of a leaf.
#[derive(Default)]
pub struct LeafTriangles {
    all: Vec<[u32; 3]>,
    slabs: Vec<Slab>,
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
        if let Some(older) = self.slabs.len().checked_sub(2) {
            self.slabs[older].leaves.forget_cells();
        }
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

    /// Does what [`settle`](LeafTriangles::settle) has not yet done, and tests the result: the distances of all crossings, and
    /// whether triangles cross one another or `others`, which are those without a leaf.
    pub fn finish(mut self, bound: f64, view: View, others: &[[u32; 3]], vertices: &mut Vec<DVec3>) -> Finished {
        let count = self.slabs.len();
        if count > 0 {
            self.slide(count - 1, view, vertices);
        }
        (count.saturating_sub(2)..count).for_each(|slab| self.repair(slab, bound, vertices));
        if self.all.is_empty() {
            return Finished { failed: Vec::new(), triangles: self.all, distance: 0.0 };
        }
        checkpoint();
        let corners = |triangle: u32| self.all[triangle as usize].map(|vertex| vertices[vertex as usize]);
        let tree = BoxTree::new(self.all.len(), |triangle| Box32::around(corners(triangle)));
        let samples: Vec<Sample> = self.slabs.iter_mut().flat_map(|slab| std::mem::take(&mut slab.samples)).collect();
        // What is further is as far as any.
        let most = (bound * (1.0 + ROUNDED)).powi(2);
        let distance = |&(leaf, point): &Sample| {
            let squared = Cell::new(most);
            let is_open = |bounds: &Box32| {
                squared.get() > (NEAR * bound).powi(2) && bounds.squared_distance_to(point) < squared.get()
            };
            let measure = |triangle: &u32| squared_distance(point, corners(*triangle));
            tree.visit(is_open, |items| squared.set(items.iter().map(measure).fold(squared.get(), f64::min)));
            (squared.get(), leaf)
        };
        let distances: Vec<(f64, u32)> = samples.par_iter().with_min_len(256).map(distance).collect();
        let far = distances.iter().filter(|(squared, _)| *squared >= most);
        let mut failed: Vec<Block> =
            far.filter_map(|(_, leaf)| self.leaf(*leaf)).map(|leaf| (leaf.origin, leaf.size)).collect();
        if failed.is_empty() {
            failed = self.crossing(view, others, vertices);
        }
        failed.sort_unstable();
        failed.dedup();
        let distance = distances.iter().map(|(squared, _)| squared.sqrt()).fold(0.0, f64::max);
        Finished { failed, triangles: self.all, distance }
    }

    /// Returns how well a triangle faces where its leaves do: at best 1, below [`UPRIGHT`] it fails.
    fn upright(&self, triangle: [u32; 3], at: impl Fn(u32) -> DVec3) -> f64 {
        let facing: DVec3 = triangle.iter().filter_map(|&v| self.leaf(v)).map(|leaf| leaf.facing.as_dvec3()).sum();
        upright(facing.normalize_or_zero(), triangle.map(at))
    }

    /// Returns the triangles from the first on that are turned over, at vertices of some leaves.
    fn turned(&self, leaves: &Range<u32>, first: usize, vertices: &[DVec3]) -> Vec<u32> {
        let is_turned = |&number: &u32| {
            let triangle = self.all[number as usize];
            let is_own = triangle.iter().any(|vertex| leaves.contains(vertex));
            is_own && self.upright(triangle, |vertex| vertices[vertex as usize]) < UPRIGHT
        };
        (first as u32..self.all.len() as u32).into_par_iter().with_min_len(1 << 10).filter(is_turned).collect()
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
            let turned = self.turned(&range, *first_triangle, vertices);
            let corners = turned.into_iter().flat_map(|triangle| self.all[triangle as usize]);
            let mut movers: Vec<u32> = corners.filter(|vertex| range.contains(vertex)).collect();
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
        let own = self.slabs[slab].leaves.vertices();
        // Crossings of the lowest plane may be those of leaves of the slab below, whose triangles may reach one slab further.
        let [below, lowest] = [1, 2].map(|step| &self.slabs[slab.saturating_sub(step)]);
        let (start, first) = (below.leaves.vertices().start, lowest.first_triangle);
        let fans = Fans::of(start..own.end, &self.all, first);
        let turned = self.turned(&own, first, vertices);
        let parts = vec![Vec::new(); self.all.len() - first];
        let mut repair = Repair { triangles: self, vertices, first, sides: HashMap::new(), parts };
        for triangle in turned {
            repair.turn(triangle);
        }
        let mut measured: Vec<u32> = (0..samples.len() as u32).collect();
        for _ in 0..INSERTIONS {
            let is_far = |&&sample: &&u32| {
                let (leaf, point) = samples[sample as usize];
                repair.nearest(&fans, leaf, point, NEAR * bound).0 > bound
            };
            let far: Vec<u32> = measured.par_iter().with_min_len(1 << 10).filter(is_far).copied().collect();
            let mut touched = HashSet::new();
            for sample in far {
                let (leaf, point) = samples[sample as usize];
                repair.insert(&fans, leaf, point, bound, &mut touched);
            }
            if touched.is_empty() {
                break;
            }
            measured = (0..samples.len() as u32).filter(|&i| touched.contains(&samples[i as usize].0)).collect();
        }
        self.slabs[slab].samples = samples;
    }

    /// Returns blocks around triangles that meet others elsewhere than in what they share.
    fn crossing(&self, view: View, others: &[[u32; 3]], vertices: &[DVec3]) -> Vec<Block> {
        checkpoint();
        let places: Vec<[DVec3; 2]> = vertices.par_iter().with_min_len(1 << 12).map(|&v| view.places(v)).collect();
        let at = |triangle: [u32; 3]| triangle.map(|vertex| places[vertex as usize]);
        let box_of = |triangle: [u32; 3]| Box32::around(at(triangle).into_iter().flatten());
        let tree = BoxTree::new(self.all.len(), |item| box_of(self.all[item as usize]));
        // If all triangles around the vertex of a leaf face one direction, they lie side by side.
        let pitch = view.grid.pitch();
        let faces = |triangle: [u32; 3], facing: Vec3| {
            (0..2).all(|rounded| {
                let corners = at(triangle).map(|place| place[rounded] / pitch);
                upright(facing.as_dvec3(), corners) >= SOUND
            })
        };
        let mut is_sound: Vec<bool> = vec![false; vertices.len()];
        for slab in &self.slabs {
            slab.leaves.vertices().for_each(|vertex| is_sound[vertex as usize] = true);
        }
        let turned = |triangle: &[u32; 3]| {
            let triangle = *triangle;
            triangle.into_iter().filter(move |&v| self.leaf(v).is_some_and(|leaf| !faces(triangle, leaf.facing)))
        };
        let turned: Vec<u32> = self.all.par_iter().with_min_len(256).flat_map_iter(turned).collect();
        turned.into_iter().for_each(|vertex| is_sound[vertex as usize] = false);
        let share_leaf = |one: [u32; 3], other: [u32; 3]| {
            one.iter().any(|vertex| is_sound[*vertex as usize] && other.contains(vertex))
        };
        let around = |triangles: [[u32; 3]; 2]| {
            let corners = || triangles.as_flattened().iter().map(|&vertex| vertices[vertex as usize]);
            let (least, greatest) = corners()
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(least, greatest), place| {
                    (least.min(place), greatest.max(place))
                });
            let origin = cell_of(least);
            (origin, cell_of(greatest).into_iter().zip(origin).map(|(end, start)| end - start + 1).max().unwrap_or(1))
        };
        let meets = |(number, triangle): (usize, &[u32; 3])| {
            let bounds = box_of(*triangle);
            let mut met = Vec::new();
            let each = |items: &[u32]| {
                for &item in items.iter().filter(|&&item| (item as usize) < number) {
                    let other = self.all[item as usize];
                    if !share_leaf(*triangle, other) && view.do_meet(*triangle, other, |vertex| places[vertex as usize])
                    {
                        met.push(around([*triangle, other]));
                    }
                }
            };
            tree.visit(|node| node.touches(&bounds), each);
            met
        };
        let mut found: Vec<Block> = self.all.par_iter().with_min_len(256).enumerate().flat_map_iter(meets).collect();
        let with_others = others.par_iter().with_min_len(256).flat_map_iter(|t| meets((usize::MAX, t)));
        found.extend(with_others.collect::<Vec<Block>>());
        found
    }
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

    /// Turns a side of a triangle that is turned over, if it and its neighbour are not afterwards.
    fn turn(&mut self, triangle: u32) {
        let corners = self.triangles.all[triangle as usize];
        if self.is_upright(corners) {
            return;
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
                return;
            }
        }
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

    /// Makes a point a vertex of the triangle nearest to it, if it is further than the bound and turns none over. Appends the
    /// leaves of the triangles that changed.
    fn insert(&mut self, fans: &Fans, leaf: u32, point: DVec3, bound: f64, touched: &mut HashSet<u32>) {
        let (distance, number) = self.nearest(fans, leaf, point, 0.0);
        if distance <= bound {
            return;
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
            return;
        };
        let corners = old.iter().flat_map(|&number| self.triangles.all[number as usize]);
        touched.extend(corners.filter(|&corner| self.triangles.leaf(corner).is_some()));
        self.replace(&old, &new);
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
    /// The blocks that fail.
    pub failed: Vec<Block>,
    pub triangles: Vec<[u32; 3]>,
    /// The largest distance of a crossing from the triangles, in pitches.
    pub distance: f64,
}
