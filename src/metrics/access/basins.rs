//! Basins: nodes from which ascent leads to the same peak.
//!
//! From a node p one can step to the neighbour with the largest radius, and on from there, up to a local maximum M(p). No
//! radius on that path is less than that at p, so that a ball that reaches p reaches M and back: with radii r and bottlenecks
//! b,
//!
//! > b(p) = min { r(p), b(M(p)) }.
//!
//! So only basins, of which there are few, need be searched, through the widest of the steps between each two. All other work
//! consists of passes over the raster in which every node is independent.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use crate::parallel::*;

use super::steps::{Cube, LEAST, MIDDLE, Steps, bits};
use crate::bits::ones;
use crate::cancel::checkpoint;
use crate::metrics::NodeSet;

/// Marks a node outside the set.
const NONE: u32 = u32::MAX;

/// The flag that marks the number of a basin, not that of a node.
const BASIN: u32 = 1 << 31;

/// The neighbours that come before a node in the order of numbers, except when wrapping: each step is one of these from one
/// end.
const BEFORE: Cube = (1 << MIDDLE) - 1;

/// Number of pairs of basins whose last pass is remembered.
const RECENT: usize = 1 << 10;

/// Number of steps between basins after which all but the widest of each pair are dropped.
const WAITING: usize = 1 << 16;

/// The nodes of a set grouped by basins.
pub(super) struct Basins<'a> {
    steps: &'a Steps<'a>,
    radii: &'a [f32],
    /// The basin of each node.
    of: Vec<AtomicU32>,
    count: usize,
}

impl<'a> Basins<'a> {
    pub fn new(steps: &'a Steps<'a>, radii: &'a [f32]) -> Basins<'a> {
        assert!(radii.len() < BASIN as usize, "{} nodes; fewer than 2³¹ are possible", radii.len());
        let of = (0..radii.len()).into_par_iter().with_min_len(1 << 14).map(|_| AtomicU32::new(NONE)).collect();
        let mut basins = Basins { steps, radii, of, count: 0 };
        basins.go_up();
        basins.follow();
        basins.number();
        basins
    }

    /// Makes each node point to the neighbour with the largest radius, or to itself if none has a larger one. Of equal radii,
    /// the later node counts as larger.
    fn go_up(&self) {
        self.each_row(&|y, z| {
            let row = self.steps.row(y, z);
            for x in self.steps.members(y, z) {
                let own = row.number(x, MIDDLE);
                let order = |node: u32| (self.radii[node as usize], node);
                let highest = bits(row.from(x))
                    .map(|bit| order(row.number(x, bit)))
                    .fold(order(own), |most, other| if other > most { other } else { most });
                self.of[own as usize].store(highest.1, Relaxed);
            }
        });
    }

    /// Makes each node point to the end of its ascent. Other threads may do the same with nodes on the path meanwhile, which
    /// only shortens it.
    fn follow(&self) {
        self.each_row(&|y, z| {
            for x in self.steps.members(y, z) {
                let own = self.steps.index([x, y, z]);
                let mut node = own;
                loop {
                    let next = self.of[node as usize].load(Relaxed);
                    if next == node {
                        break;
                    }
                    node = next;
                }
                self.of[own as usize].store(node, Relaxed);
            }
        });
    }

    /// Numbers basins in the order of their highest nodes.
    fn number(&mut self) {
        let [_, height, depth] = self.steps.size();
        let steps = self.steps;
        let tops: Vec<Vec<u32>> = (0..depth)
            .into_par_iter()
            .map(|z| {
                let row = |y| steps.members(y, z).map(move |x| steps.index([x, y, z]));
                (0..height).flat_map(row).filter(|&node| self.of[node as usize].load(Relaxed) == node).collect()
            })
            .collect();
        for top in tops.into_iter().flatten() {
            *self.of[top as usize].get_mut() = BASIN | self.count as u32;
            self.count += 1;
        }
        self.each_row(&|y, z| {
            for x in self.steps.members(y, z) {
                let node = self.steps.index([x, y, z]) as usize;
                let top = self.of[node].load(Relaxed);
                if top & BASIN == 0 {
                    self.of[node].store(self.of[top as usize].load(Relaxed), Relaxed);
                }
            }
        });
    }

    /// Returns the basin of a node of the set.
    #[inline]
    fn of(&self, node: u32) -> u32 {
        self.of[node as usize].load(Relaxed) & !BASIN
    }

    #[inline]
    fn room(&self, node: u32) -> f32 {
        self.radii[node as usize].max(LEAST)
    }

    fn each_row(&self, work: &(dyn Fn(usize, usize) + Sync)) {
        let [_, height, depth] = self.steps.size();
        (0..depth * height).into_par_iter().with_min_len(16).for_each(|row| {
            checkpoint();
            work(row % height, row / height);
        });
    }

    /// Returns the bottlenecks of all nodes, from sources that belong to the set.
    pub fn bottlenecks(self, sources: &NodeSet) -> Vec<f32> {
        let of_basins = self.search(self.begins(sources), &self.passes());
        let bottleneck = |(basin, &radius): (AtomicU32, &f32)| match basin.into_inner() {
            NONE => 0.0,
            basin => of_basins[(basin & !BASIN) as usize].min(radius.max(LEAST)),
        };
        self.of.into_par_iter().zip(self.radii).with_min_len(1 << 14).map(bottleneck).collect()
    }

    /// Returns for each basin the largest radius at a source, 0 where there is none.
    fn begins(&self, sources: &NodeSet) -> Vec<f32> {
        let [_, height, depth] = self.steps.size();
        let mut begins = vec![0.0f32; self.count];
        for (y, z) in (0..depth).flat_map(|z| (0..height).map(move |y| (y, z))) {
            for node in ones(sources.row(y, z)).map(|x| self.steps.index([x, y, z])) {
                let begin = &mut begins[self.of(node) as usize];
                *begin = begin.max(self.room(node));
            }
        }
        begins
    }

    /// Returns the widest step between each two basins, in the order of the basins.
    fn passes(&self) -> Vec<Pass> {
        let [_, height, depth] = self.steps.size();
        let of_planes: Vec<Vec<Pass>> = (0..depth).into_par_iter().map(|z| self.passes_of_plane(height, z)).collect();
        widest_of_each(of_planes.into_iter().flatten().collect())
    }

    fn passes_of_plane(&self, height: usize, z: usize) -> Vec<Pass> {
        let mut passes: Vec<Pass> = Vec::new();
        let mut limit = WAITING;
        // The last pass between some of the pairs: neighbouring nodes mostly lead over the same.
        let mut last = [u32::MAX; RECENT];
        for y in 0..height {
            let row = self.steps.row(y, z);
            for x in self.steps.members(y, z) {
                let own = self.steps.index([x, y, z]);
                let basin = self.of(own);
                for other in bits(row.from(x) & BEFORE).map(|bit| row.number(x, bit)) {
                    let beyond = self.of(other);
                    if beyond != basin {
                        let between = [basin.min(beyond), basin.max(beyond)];
                        let room = self.room(own).min(self.room(other));
                        let place = &mut last[(between[0].wrapping_mul(31) ^ between[1]) as usize % RECENT];
                        match passes.get_mut(*place as usize).filter(|pass| pass.between == between) {
                            Some(pass) => pass.room = pass.room.max(room),
                            None => {
                                *place = passes.len() as u32;
                                passes.push(Pass { between, room });
                            }
                        }
                    }
                }
            }
            if passes.len() > limit {
                passes = widest_of_each(passes);
                limit = WAITING.max(2 * passes.len());
            }
        }
        widest_of_each(passes)
    }

    /// Returns the bottlenecks of basins, from those that hold sources.
    fn search(&self, begins: Vec<f32>, passes: &[Pass]) -> Vec<f32> {
        let mut starts = vec![0usize; self.count + 1];
        passes.iter().flat_map(|pass| pass.between).for_each(|basin| starts[basin as usize + 1] += 1);
        (0..self.count).for_each(|basin| starts[basin + 1] += starts[basin]);
        let mut filled = starts.clone();
        let mut beside = vec![(0u32, 0.0f32); 2 * passes.len()];
        for pass in passes {
            for (own, other) in [(0, 1), (1, 0)].map(|(a, b)| (pass.between[a] as usize, pass.between[b])) {
                beside[filled[own]] = (other, pass.room);
                filled[own] += 1;
            }
        }
        // Positive numbers are in the order of their bits.
        let entry = |room: f32, basin: usize| (room.to_bits(), Reverse(basin as u32));
        let sources = begins.iter().enumerate().filter(|&(_, &begin)| begin > 0.0);
        let mut waiting: BinaryHeap<_> = sources.map(|(basin, &begin)| entry(begin, basin)).collect();
        let mut reached = begins;
        while let Some((bits, Reverse(basin))) = waiting.pop() {
            checkpoint();
            let so_far = f32::from_bits(bits);
            if so_far < reached[basin as usize] {
                continue;
            }
            for &(other, room) in &beside[starts[basin as usize]..starts[basin as usize + 1]] {
                let there = so_far.min(room);
                if there > reached[other as usize] {
                    reached[other as usize] = there;
                    waiting.push(entry(there, other as usize));
                }
            }
        }
        reached
    }
}

/// A step from one basin to another, and the radius at its narrower end.
#[derive(Clone, Copy)]
struct Pass {
    between: [u32; 2],
    room: f32,
}

/// Keeps the widest of the steps between each two basins.
fn widest_of_each(mut passes: Vec<Pass>) -> Vec<Pass> {
    passes.par_sort_unstable_by(|a, b| a.between.cmp(&b.between).then(b.room.total_cmp(&a.room)));
    passes.dedup_by_key(|pass| pass.between);
    passes
}
