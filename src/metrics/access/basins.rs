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

use super::steps::{Cube, LEAST, MIDDLE, Row, Steps, bits};
use crate::allocation::zeroed;
use crate::bits::{Ones, ones};
use crate::cancel::checkpoint;
use crate::metrics::NodeSet;

/// Marks a node outside the set.
const NONE: u32 = u32::MAX;

/// The flag that marks the number of a basin, not that of a node.
const BASIN: u32 = 1 << 31;

/// The neighbours that come before a node in the order of numbers, except when wrapping: each step is one of these from one
/// end.
const BEFORE: Cube = (1 << MIDDLE) - 1;

/// Neighbouring nodes of a row that are looked at side by side.
const LANES: usize = 8;

/// Number of pairs of basins whose last pass is remembered.
const RECENT: usize = 1 << 10;

/// Number of steps between basins after which all but the widest of each pair are dropped.
const WAITING: usize = 1 << 16;

/// The nodes of a set grouped by basins.
pub(super) struct Basins<'a> {
    steps: &'a Steps<'a>,
    radii: &'a [f32],
    /// The basin of each node with the flag [`BASIN`], or [`NONE`].
    of: Vec<u32>,
    count: usize,
}

impl<'a> Basins<'a> {
    pub fn new(steps: &'a Steps<'a>, radii: &'a [f32]) -> Basins<'a> {
        assert!(radii.len() < BASIN as usize, "{} nodes; fewer than 2³¹ are possible", radii.len());
        let mut of = go_up(steps, radii);
        let count = number(&mut of, steps.size());
        Basins { steps, radii, of: follow(steps, of), count }
    }

    /// Returns the basin of a node of the set.
    #[inline]
    fn of(&self, node: u32) -> u32 {
        self.of[node as usize] & !BASIN
    }

    #[inline]
    fn room(&self, node: u32) -> f32 {
        self.radii[node as usize].max(LEAST)
    }

    /// Returns the bottlenecks of all nodes, from sources that belong to the set.
    pub fn bottlenecks(self, sources: &NodeSet) -> Vec<f32> {
        let of_basins = self.search(self.begins(sources), &self.passes());
        let mut of = self.of;
        let values = of.par_iter_mut().zip(self.radii).with_min_len(1 << 14);
        values.for_each(|(value, &radius)| {
            let bottleneck = match *value {
                NONE => 0.0,
                basin => of_basins[(basin & !BASIN) as usize].min(radius.max(LEAST)),
            };
            *value = bottleneck.to_bits();
        });
        bytemuck::cast_vec(of)
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
            for x in self.perhaps_beside_others(&row) {
                let own = row.number(x, MIDDLE);
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

    /// Returns all nodes of a row that have a neighbour before them in another basin, and some that have none.
    fn perhaps_beside_others<'r>(&'r self, row: &'r Row) -> impl Iterator<Item = usize> + use<'r, 'a> {
        let firsts = row.firsts();
        row.words().iter().enumerate().flat_map(move |(word, &members)| {
            let groups = (0..64 / LANES).filter(move |group| members >> (group * LANES) & ((1 << LANES) - 1) != 0);
            groups.flat_map(move |group| {
                let x = 64 * word + LANES * group;
                let here = members >> (group * LANES) & self.beside_others(row, &firsts, x);
                Ones(here).map(move |bit| x + bit as usize)
            })
        })
    }

    /// Returns which of [`LANES`] nodes of a row, from x on, may have a neighbour before them in another basin, as bits.
    fn beside_others(&self, row: &Row, firsts: &[Option<usize>; 9], x: usize) -> u64 {
        const ALL: u64 = (1 << LANES) - 1;
        let place = |first: usize, by: usize| (first + x + by).checked_sub(1);
        let at = |first: usize, by: usize| self.of.get(place(first, by)?..)?.first_chunk::<LANES>();
        let Some(own) = firsts[4].and_then(|first| at(first, 1)) else { return ALL };
        // Beyond an end of the row are other rows.
        if row.wraps() && (x == 0 || x + LANES >= self.steps.size()[0]) {
            return ALL;
        }
        let mut beside = [0u32; LANES];
        for (place, first) in firsts.iter().enumerate().take(5) {
            let Some(first) = *first else { continue };
            for by in 0..if place == 4 { 1 } else { 3 } {
                let Some(other) = at(first, by) else { return ALL };
                for lane in 0..LANES {
                    beside[lane] |= u32::from(other[lane] != own[lane]) & u32::from(other[lane] != NONE);
                }
            }
        }
        (0..LANES).fold(0, |bits, lane| bits | u64::from(beside[lane]) << lane)
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

/// Returns for each node of the set the number of the neighbour with the largest radius, or its own if none has a larger one, and
/// [`NONE`] for others. Of equal radii, that of the later node counts as larger.
fn go_up(steps: &Steps, radii: &[f32]) -> Vec<u32> {
    let [width, height, _] = steps.size();
    let mut highest = zeroed(radii.len());
    highest.par_chunks_mut(width.max(1)).enumerate().with_min_len(16).for_each(|(row, highest): (_, &mut [u32])| {
        checkpoint();
        highest.fill(NONE);
        let row = steps.row(row % height, row / height);
        // The last of equal radii in the order of the cube has the greatest number, unless rows wrap.
        let firsts = row.firsts();
        let in_order = firsts.is_sorted().then(|| firsts.map(|first| first.unwrap_or(0)));
        let order = |node: u32| (key(radii[node as usize]), node);
        for (word, &members) in row.words().iter().enumerate() {
            let inner = if in_order.is_some() { row.inner(word) } else { 0 };
            let mut rest = members;
            for group in (0..64).step_by(LANES).filter(|group| inner >> group & ((1 << LANES) - 1) != 0) {
                let x = 64 * word + group;
                let here = inner & ((1 << LANES) - 1) << group;
                if let Some(found) = in_order.and_then(|firsts| highest_around(radii, firsts, x)) {
                    Ones(here).for_each(|bit| highest[64 * word + bit as usize] = found[bit as usize - group]);
                    rest &= !here;
                }
            }
            for x in Ones(rest).map(|bit| 64 * word + bit as usize) {
                let around = bits(row.from(x)).map(|bit| order(row.number(x, bit)));
                let own = order(row.number(x, MIDDLE));
                highest[x] = around.fold(own, |most, other| if other > most { other } else { most }).1;
            }
        }
    });
    highest
}

/// Returns a number in the order of radii: those of positive numbers are in the order of their bits. All others count as [`LEAST`].
fn key(radius: f32) -> i32 {
    radius.to_bits() as i32
}

/// Returns for each of [`LANES`] nodes of a row, from x on, the number of the node with the largest radius of the 27 around it, the
/// last of several. The rows begin at the given nodes. `None` where they end within the cubes.
fn highest_around(radii: &[f32], firsts: [usize; 9], x: usize) -> Option<[u32; LANES]> {
    let (mut most, mut highest) = ([i32::MIN; LANES], [0; LANES]);
    for first in firsts {
        let before = (first + x).checked_sub(1)?;
        let around: &[f32; LANES + 2] = radii.get(before..)?.first_chunk()?;
        for by in 0..3 {
            for lane in 0..LANES {
                let radius = key(around[lane + by]);
                let is_higher = (i32::from(radius >= most[lane])).wrapping_neg();
                most[lane] = radius & is_higher | most[lane] & !is_higher;
                let number = (before + by + lane) as i32;
                highest[lane] = number & is_higher | highest[lane] & !is_higher;
            }
        }
    }
    Some(highest.map(|number| number as u32))
}

/// Numbers the nodes that point to themselves in their order, marked by [`BASIN`]. Returns their count.
fn number(highest: &mut [u32], [width, height, _]: [usize; 3]) -> usize {
    let plane = (width * height).max(1);
    let tops = |(plane_number, highest): (usize, &[u32])| -> Vec<usize> {
        let first = plane_number * plane;
        let is_top = |&(place, &node): &(usize, &u32)| node as usize == first + place;
        highest.iter().enumerate().filter(is_top).map(|(place, _)| first + place).collect()
    };
    let tops: Vec<Vec<usize>> = highest.par_chunks(plane).enumerate().map(tops).collect();
    let tops = tops.into_iter().flatten();
    (0..).zip(tops).map(|(basin, top)| highest[top] = BASIN | basin).count()
}

/// Follows the way up from each node of the set to the basin at its end.
fn follow(steps: &Steps, highest: Vec<u32>) -> Vec<u32> {
    let of: Vec<AtomicU32> = highest.into_iter().map(AtomicU32::new).collect();
    let [_, height, depth] = steps.size();
    let up = |node: u32| of[node as usize].load(Relaxed);
    (0..depth * height).into_par_iter().with_min_len(16).for_each(|row| {
        checkpoint();
        let (y, z) = (row % height, row / height);
        for own in steps.members(y, z).map(|x| steps.index([x, y, z])) {
            let mut basin = up(own);
            while basin & BASIN == 0 {
                basin = up(basin);
            }
            // Other threads may do the same with nodes on the way meanwhile, which only shortens it.
            let mut node = own;
            loop {
                let next = up(node);
                if next & BASIN != 0 {
                    break;
                }
                of[node as usize].store(basin, Relaxed);
                node = next;
            }
        }
    });
    of.into_iter().map(AtomicU32::into_inner).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::BoundaryCondition;

    /// Compares each node's step with the definition, on rasters of any width and depth, in rooms and in the open, with many equal
    /// radii and with some that are not positive.
    #[test]
    fn ways_go_up_to_the_largest_radius_and_then_the_greatest_number() {
        let sizes = [
            [72, 5, 4],
            [128, 4, 3],
            [64, 3, 3],
            [75, 11, 9],
            [75, 1, 1],
            [75, 1, 6],
            [75, 6, 1],
            [10, 3, 3],
            [12, 5, 5],
        ];
        let conditions = [BoundaryCondition::Clip, BoundaryCondition::Periodic];
        for (size, edges) in sizes.into_iter().flat_map(|size| conditions.map(|edges| (size, edges))) {
            let rooms = NodeSet::from_fn(size, |[x, y, z]| (x % 37 != 20 || y % 5 == 2) && (y != 6 || z < 3));
            for (nodes, levels) in [(NodeSet::full(size), 3), (rooms, 1009)] {
                let radii: Vec<f32> = (0..nodes.volume()).map(|i| (i * 7919 % 10_007 % levels) as f32 - 1.0).collect();
                let steps = Steps::new(&nodes, edges);
                let found = go_up(&steps, &radii);
                for node in 0..nodes.volume() as u32 {
                    let place = steps.place(node);
                    let around = bits(steps.from(place)).map(|bit| steps.index(steps.neighbour(place, bit)));
                    let order = |&node: &u32| (key(radii[node as usize]), node);
                    let highest = || around.chain([node]).max_by_key(order).expect("the node itself");
                    let exact = if nodes.contains(place) { highest() } else { NONE };
                    assert_eq!(found[node as usize], exact, "{size:?}, {edges:?}, {levels} levels, {place:?}");
                }
            }
        }
    }

    #[test]
    fn inner_nodes_are_compared_side_by_side() {
        let size = [24, 3, 3];
        let nodes = NodeSet::full(size);
        let steps = Steps::new(&nodes, BoundaryCondition::Clip);
        let radii: Vec<f32> = (0..nodes.volume()).map(|i| (i * 31 % 7) as f32).collect();
        let firsts = steps.row(1, 1).firsts().map(|first| first.unwrap());
        let found = highest_around(&radii, firsts, 8).unwrap();
        assert_eq!(found, go_up(&steps, &radii)[steps.index([8, 1, 1]) as usize..][..LANES]);
        // Beyond the last row there are no more nodes.
        assert_eq!(highest_around(&radii, firsts, 16), None);
    }
}
