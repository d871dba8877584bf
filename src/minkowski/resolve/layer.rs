//! Nodes as bits, and the connections between neighbouring nodes.

use std::ops::Range;

use super::ResolveError;
use super::sets::{Contradiction, IN, OUT};
use crate::bits::Ones;
use crate::fixed::Pixels;
use crate::grid::Grid;

/// Planes of a slab. Its masks stay in the second-level cache at 512² nodes a plane, and every ray along z is looked up once
/// for each slab.
const SLAB: usize = 32;

/// The nodes of a grid: bit `x % 64` of word `x / 64` of a row; a plane is its rows in order.
#[derive(Clone, Copy, Debug)]
pub struct Raster {
    /// The number of nodes along x, y and z.
    pub nodes: [usize; 3],
    /// The number of words of a row.
    pub words: usize,
    /// The mapping from a crossing to the nodes around it.
    pub pixels: Pixels,
}

/// Some nodes, row after row, and the sets of the open ones. A run of open nodes along x without a crossing between them is an
/// element of the sets.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// Neither in nor out.
    pub open: &'a [u64],
    /// Certainly in.
    pub inside: &'a [u64],
    /// Open, and the first of a run.
    pub starts: &'a [u64],
    /// The element of the last run that begins before each word.
    pub elements: &'a [u32],
}

impl Raster {
    /// Creates the raster of a grid.
    pub fn new(grid: &Grid) -> Raster {
        let nodes = grid.rays().map(|n| n as usize);
        Raster { nodes, words: nodes[0].div_ceil(64), pixels: Pixels::new(grid.shift()) }
    }

    /// Returns the number of words of a plane.
    pub fn plane(&self) -> usize {
        self.nodes[1] * self.words
    }

    /// Returns the planes of all slabs.
    pub fn slabs(&self) -> Vec<Range<usize>> {
        let planes = self.nodes[2];
        (0..planes).step_by(SLAB).map(|first| first..planes.min(first + SLAB)).collect()
    }

    /// Returns the node at a bit of a word, counted from the first word of a plane.
    pub fn node(&self, plane: usize, word: usize, bit: u32) -> [u32; 3] {
        let (z, within) = (plane + word / self.plane(), word % self.plane());
        [(within % self.words * 64) as u32 + bit, (within / self.words) as u32, z as u32]
    }

    /// Returns the error for a contradiction at that node.
    pub fn contradiction(&self, plane: usize, word: usize, bit: u32) -> ResolveError {
        ResolveError::Contradiction { node: self.node(plane, word, bit) }
    }
}

impl Layer<'_> {
    fn outside(&self, word: usize) -> u64 {
        !(self.open[word] | self.inside[word])
    }

    /// Returns the element of the last run that begins at or before a bit: for an open node, of its own run.
    #[inline]
    fn run(&self, word: usize, bit: u32) -> u32 {
        self.elements[word] + (self.starts[word] & (u64::MAX >> (63 - bit))).count_ones()
    }

    /// Returns the word and the bit that a run begins at.
    pub fn start_of(&self, element: u32) -> (usize, u32) {
        let word = self.elements.partition_point(|&before| before < element) - 1;
        let mut starts = self.starts[word];
        (self.elements[word] + 1..element).for_each(|_| starts &= starts - 1);
        (word, starts.trailing_zeros())
    }

    /// Returns the element that a node belongs to.
    pub fn element(&self, word: usize, bit: u32) -> u32 {
        match (self.open[word] >> bit & 1, self.inside[word] >> bit & 1) {
            (1, _) => self.run(word, bit),
            (_, inside) => inside as u32,
        }
    }
}

/// Finds the runs of open nodes along x: their starts, and their elements, numbered from `next` on. Returns the element of the
/// run after the last.
pub fn find_runs(open: &[u64], walls: &[u64], starts: &mut [u64], elements: &mut [u32], mut next: u32) -> u32 {
    let mut before = 0;
    for (word, (&open, &walls)) in open.iter().zip(walls).enumerate() {
        starts[word] = open & !((open << 1 | before) & !walls);
        before = open >> 63;
        elements[word] = next - 1;
        next += starts[word].count_ones();
    }
    next
}

/// Unites each run of a row with its neighbours along x. A wall bit stands for a crossing before its node. Fails at the first
/// node where an inside node touches an outside one.
pub fn link_row(
    row: Layer,
    walls: &[u64],
    mut unite: impl FnMut(u32, u32) -> Result<(), Contradiction>,
) -> Result<(), (usize, u32)> {
    // Beyond the row's ends nothing is connected: the nodes there have the state of the first one.
    let (mut open_before, mut inside_before) = (row.open[0] & 1, row.inside[0] & 1);
    let mut outside_before = row.outside(0) & 1;
    for (word, &walls) in walls.iter().enumerate() {
        let (open, inside, outside) = (row.open[word], row.inside[word], row.outside(word));
        let open_left = open << 1 | std::mem::replace(&mut open_before, open >> 63);
        let inside_left = inside << 1 | std::mem::replace(&mut inside_before, inside >> 63);
        let outside_left = outside << 1 | std::mem::replace(&mut outside_before, outside >> 63);
        let clash = (inside & outside_left | outside & inside_left) & !walls;
        if clash != 0 {
            return Err((word, clash.trailing_zeros()));
        }
        if open | open_left == 0 {
            continue;
        }
        // The last run that begins at or before a node is its own, or that of the node before it.
        for_bits((open & outside_left | outside & open_left) & !walls, word, |bit| unite(row.run(word, bit), OUT))?;
        for_bits((open & inside_left | inside & open_left) & !walls, word, |bit| unite(row.run(word, bit), IN))?;
    }
    Ok(())
}

/// Unites each run of a layer with its neighbours in the next layer, along y or z. A wall bit stands for a crossing before the
/// node of the next layer. `unite` takes an element of each. Fails at the first node where an inside node touches an outside
/// one.
pub fn link(
    a: Layer,
    b: Layer,
    walls: &[u64],
    mut unite: impl FnMut(u32, u32) -> Result<(), Contradiction>,
) -> Result<(), (usize, u32)> {
    for (word, &walls) in walls.iter().enumerate() {
        let (open_a, open_b, joined) = (a.open[word], b.open[word], !walls);
        let (inside_a, inside_b) = (a.inside[word], b.inside[word]);
        let (outside_a, outside_b) = (a.outside(word), b.outside(word));
        let clash = (inside_a & outside_b | outside_a & inside_b) & joined;
        if clash != 0 {
            return Err((word, clash.trailing_zeros()));
        }
        if open_a | open_b == 0 {
            continue;
        }
        // Of neighbouring nodes of one run only the first is united.
        let (starts_a, starts_b) = (a.starts[word], b.starts[word]);
        let first = |bits: u64, starts: u64| bits & (!(bits << 1) | starts);
        for_bits(first(open_a & open_b & joined, starts_a | starts_b), word, |bit| {
            unite(a.run(word, bit), b.run(word, bit))
        })?;
        for_bits(first(open_a & outside_b & joined, starts_a), word, |bit| unite(a.run(word, bit), OUT))?;
        for_bits(first(open_a & inside_b & joined, starts_a), word, |bit| unite(a.run(word, bit), IN))?;
        for_bits(first(outside_a & open_b & joined, starts_b), word, |bit| unite(OUT, b.run(word, bit)))?;
        for_bits(first(inside_a & open_b & joined, starts_b), word, |bit| unite(IN, b.run(word, bit)))?;
    }
    Ok(())
}

/// Calls `unite` for each set bit of a word; fails with the position of the bit.
#[inline]
fn for_bits(
    bits: u64,
    word: usize,
    mut unite: impl FnMut(u32) -> Result<(), Contradiction>,
) -> Result<(), (usize, u32)> {
    Ones(bits).try_for_each(|bit| unite(bit).map_err(|Contradiction| (word, bit)))
}
