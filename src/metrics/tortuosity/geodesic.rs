//! Shortest paths by fast marching.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::TortuosityError;
use crate::allocation::filled;
use crate::cancel::checkpoint;
use crate::grid::Axis;
use crate::metrics::access::steps::{MIDDLE, Steps, bits};
use crate::metrics::{BoundaryCondition, NodeSet};

/// Computes the geodesic tortuosity of a phase in a box that is the whole raster: the mean, over the nodes of its last plane
/// across `axis`, of the length of the shortest path within `nodes` from its first plane, over the distance of the planes. A
/// number of at least 1, and exactly 1 for straight pores; `None` where no path leads to the last plane (the tortuosity is
/// infinite). Nodes of the last plane that no path leads to do not count.
///
/// With [`BoundaryCondition::Periodic`] paths continue at the opposite lateral face; otherwise those faces are walls. Lengths
/// are computed by fast marching to first order: too long by a fraction of a pitch where paths bend around an edge. Needs 4
/// bytes for each node and 8 for each entry of the queue, in one thread; the order of nodes at the same distance makes no
/// difference.
///
/// # Errors
/// Fewer than two nodes along the axis.
///
/// # Panics
/// If there are 2³² nodes or more.
pub fn geodesic(nodes: &NodeSet, axis: Axis, edges: BoundaryCondition) -> Result<Option<f64>, TortuosityError> {
    let side = nodes.size()[axis.depth()];
    if side < 2 {
        return Err(TortuosityError::TooThin { axis, nodes: side, least: 2 });
    }
    let lengths = Front::new(nodes, axis, edges).march();
    let last = plane(nodes.size(), axis, side - 1).map(|node| lengths[index(nodes.size(), node)].abs());
    let (sum, count) = last
        .filter(|length| length.is_finite())
        .fold((0.0, 0u64), |(sum, count), length| (sum + f64::from(length), count + 1));
    Ok((count > 0).then(|| sum / count as f64 / (side - 1) as f64))
}

/// Returns the nodes of a plane across an axis.
pub(super) fn plane(size: [usize; 3], axis: Axis, at: usize) -> impl Iterator<Item = [usize; 3]> {
    let (columns, rows) = (size[axis.column()], size[axis.row()]);
    (0..rows * columns).map(move |i| {
        let mut node = [at; 3];
        node[axis.column()] = i % columns;
        node[axis.row()] = i / columns;
        node
    })
}

fn index(size: [usize; 3], [x, y, z]: [usize; 3]) -> usize {
    (z * size[1] + y) * size[0] + x
}

/// Slots of the queue in a pitch.
const SLOTS_IN_PITCH: f32 = 16.0;

/// Slots of the queue: those of four pitches. No step is longer than √3, the diagonal of a cell, or than 2 after rounding.
const SLOTS: usize = 64;

/// A priority queue of nodes by length, the shortest first; no node is nearer than the one that was popped last. Lengths are not
/// negative, so their bits are in their order. Only the nodes of the nearest slot are kept in order.
struct Waiting {
    /// The slot of the nearest nodes, of 1/16 of a pitch, counted from length 0.
    slot: usize,
    nearest: BinaryHeap<Reverse<u64>>,
    slots: [Vec<Reverse<u64>>; SLOTS],
}

impl Waiting {
    fn new() -> Waiting {
        Waiting { slot: 0, nearest: BinaryHeap::new(), slots: std::array::from_fn(|_| Vec::new()) }
    }

    fn push(&mut self, length: f32, node: u32) {
        let entry = Reverse(u64::from(length.to_bits()) << 32 | u64::from(node));
        match (length * SLOTS_IN_PITCH) as usize {
            slot if slot == self.slot => self.nearest.push(entry),
            slot => self.slots[slot % SLOTS].push(entry),
        }
    }

    fn pop(&mut self) -> Option<(f32, u32)> {
        if self.nearest.is_empty() {
            self.slot = (self.slot..self.slot + SLOTS).find(|slot| !self.slots[slot % SLOTS].is_empty())?;
            let emptied = std::mem::take(&mut self.nearest).into_vec();
            self.nearest = BinaryHeap::from(std::mem::replace(&mut self.slots[self.slot % SLOTS], emptied));
        }
        let Reverse(entry) = self.nearest.pop()?;
        Some((f32::from_bits((entry >> 32) as u32), entry as u32))
    }
}

/// A front that advances from the first plane.
struct Front<'a> {
    steps: Steps<'a>,
    /// The lengths of paths, negative where they are final.
    lengths: Vec<f32>,
    waiting: Waiting,
}

/// The eight nodes around the middle in a plane through the middle of the cube, in a circle that begins with one across a face,
/// as bits of the cube. By the axis across the plane.
const CIRCLES: [[u32; 8]; 3] = [circle(3, 9), circle(1, 9), circle(1, 3)];

const fn circle(u: u32, v: u32) -> [u32; 8] {
    let m = MIDDLE;
    [m + u, m + u + v, m + v, m + v - u, m - u, m - u - v, m - v, m + u - v]
}

/// Lower bounds of [`further`] by bit, rounded down: √(1 − 2/3) across a face, √(2 · (1 − 1/3)) across an edge, √3 across a corner.
/// [`gain`] is at most 2/3, and the square of a lead that counts across an edge at most 1/3.
const LEAST_FURTHER: [f32; 27] = {
    let mut least = [0.0; 27];
    let mut bit = 0;
    while bit < 27 {
        let across = (bit % 3 != 1) as usize + (bit / 3 % 3 != 1) as usize + (bit / 9 != 1) as usize;
        least[bit] = [0.0, 0.577, 1.154, 1.732][across];
        bit += 1;
    }
    least
};

/// The change of a bit of the cube by one step along an axis.
const STRIDES: [u32; 3] = [1, 3, 9];

impl<'a> Front<'a> {
    fn new(nodes: &'a NodeSet, axis: Axis, edges: BoundaryCondition) -> Front<'a> {
        let steps = Steps::between_ends(nodes, edges, axis);
        let mut lengths = filled(nodes.volume(), f32::INFINITY);
        let mut waiting = Waiting::new();
        for node in plane(nodes.size(), axis, 0).filter(|&node| nodes.contains(node)) {
            let node = steps.index(node);
            lengths[node as usize] = 0.0;
            waiting.push(0.0, node);
        }
        Front { steps, lengths, waiting }
    }

    /// Returns the lengths of the shortest paths to all nodes, as negative numbers; infinite where there is none.
    fn march(mut self) -> Vec<f32> {
        while let Some((length, index)) = self.waiting.pop() {
            checkpoint();
            if !self.lengths[index as usize].is_sign_negative() {
                self.lengths[index as usize] = -length;
                self.pass_on(index, length);
            }
        }
        self.lengths
    }

    /// Updates the neighbours of a node that was just accepted. Of the accepted corners of a tetrahedron the one nearest to its
    /// tip is the last to be accepted where the path comes through the tetrahedron: so here, from the nearest corner, every
    /// tetrahedron is visited once.
    fn pass_on(&mut self, index: u32, length: f32) {
        let [x, y, z] = self.steps.place(index);
        let row = self.steps.row(y, z);
        // The lead of the front at accepted neighbours; NaN for the others.
        let mut earlier = [f32::NAN; 27];
        let mut others = [0u32; 27];
        let mut open = 0u32;
        for bit in bits(row.from(x)) {
            let other = row.number(x, bit);
            others[bit as usize] = other;
            let there = self.lengths[other as usize];
            if there.is_sign_negative() {
                earlier[bit as usize] = length + there;
            } else if there > length + LEAST_FURTHER[bit as usize] {
                open |= 1 << bit;
            }
        }
        for bit in bits(open) {
            let arrival = length + further(&earlier, bit);
            let other = others[bit as usize];
            if arrival < self.lengths[other as usize] {
                self.lengths[other as usize] = arrival;
                self.waiting.push(arrival, other);
            }
        }
    }
}

/// Returns the additional length of the path to the neighbour `bit` relative to that to the middle of the cube, given the leads
/// of the accepted neighbours.
///
/// On the triangle of the middle f (which is at distance 1 from the tip), a node e beside it and c beside e, with a = T(f) −
/// T(e) and b = T(e) − T(c), the minimum of the length on the triangle, taken as linear, plus the distance from there to the
/// tip is T(f) + √(1 − a² − b²), if it is within the triangle. On its sides it is √(1 − a²), √(1 − (a + b)²/2), and from an
/// edge of the cube √2 · √(1 − b²).
fn further(earlier: &[f32; 27], bit: u32) -> f32 {
    let by = [bit % 3, bit / 3 % 3, bit / 9];
    let across = |axis: usize| by[axis] != 1;
    match (0..3).filter(|&axis| across(axis)).count() {
        1 => (1.0
            - gain(
                earlier,
                &CIRCLES[if across(0) {
                    0
                } else if across(1) {
                    1
                } else {
                    2
                }],
            ))
        .sqrt(),
        2 => {
            let stride = STRIDES[if !across(0) {
                0
            } else if !across(1) {
                1
            } else {
                2
            }];
            let saved = [MIDDLE - stride, MIDDLE + stride].map(|c| {
                let b = earlier[c as usize];
                // Comparisons with nodes that are not accepted are false.
                if b >= 0.0 && 3.0 * b * b <= 1.0 { b * b } else { 0.0 }
            });
            (2.0 * (1.0 - saved[0].max(saved[1]))).sqrt()
        }
        _ => 3.0f32.sqrt(),
    }
}

/// Returns the greatest a² + b² of the triangles around the middle in one plane.
fn gain(earlier: &[f32; 27], circle: &[u32; 8]) -> f32 {
    let mut most = 0.0f32;
    for corner in [1, 3, 5, 7] {
        let whole = earlier[circle[corner] as usize];
        if whole >= 0.0 && 3.0 * whole * whole <= 4.0 {
            most = most.max(0.5 * whole * whole);
        }
        for beside in [corner - 1, (corner + 1) % 8] {
            let a = earlier[circle[beside] as usize];
            let b = whole - a;
            let square = a * a + b * b;
            if b >= 0.0 && a >= b && a * a + square <= 1.0 {
                most = most.max(square);
            }
        }
    }
    for beside in [0, 2, 4, 6] {
        let a = earlier[circle[beside] as usize];
        if a >= 0.0 && 2.0 * a * a <= 1.0 {
            most = most.max(a * a);
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn the_queue_pops_in_the_order_of_lengths_and_nodes() {
        let mut random = Random::new(29);
        let (mut waiting, mut sorted) = (Waiting::new(), BinaryHeap::new());
        for node in 0..200 {
            waiting.push(0.0, node);
            sorted.push(Reverse(u64::from(node)));
        }
        let (mut popped, mut next) = (0, 200);
        while let Some((length, node)) = waiting.pop() {
            assert_eq!(sorted.pop(), Some(Reverse(u64::from(length.to_bits()) << 32 | u64::from(node))));
            popped += 1;
            for _ in 0..if next < 5_000 { 1 + random.below(2) } else { 0 } {
                // Quarters make ties, and 0 an entry of the slot at hand.
                let further = length + (random.share() * 7.0).floor() as f32 / 4.0;
                waiting.push(further, next);
                sorted.push(Reverse(u64::from(further.to_bits()) << 32 | u64::from(next)));
                next += 1;
            }
        }
        assert!(sorted.is_empty() && popped == next, "{popped} of {next}");
    }

    /// The pruned neighbours could not have become nearer, whatever the leads of the accepted ones.
    #[test]
    fn no_step_is_shorter_than_the_least() {
        let mut random = Random::new(31);
        let mut nearest = [f32::INFINITY; 4];
        for _ in 0..200_000 {
            let share = random.share();
            let earlier: [f32; 27] = std::array::from_fn(|_| match random.below(4) {
                0 => f32::NAN,
                // Leads of about 1/√3, which save most.
                1 => 0.577 + 0.002 * (random.share() as f32 - 0.5),
                _ => (1.8 * random.share() * share) as f32,
            });
            for bit in (0..27).filter(|&bit| bit != MIDDLE) {
                let (length, least) = (further(&earlier, bit), LEAST_FURTHER[bit as usize]);
                assert!(length > least, "{length} to {bit}: {earlier:?}");
                let across = [bit % 3, bit / 3 % 3, bit / 9].iter().filter(|&&by| by != 1).count();
                nearest[across] = nearest[across].min(length - least);
            }
        }
        assert!(nearest[1..].iter().all(|&above| above < 0.01), "{nearest:?}");
    }
}
