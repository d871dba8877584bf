//! Steps from a node to those around it; none leaves the 6-connected piece that it starts in.
//!
//! A path of 6-neighbours alone is jagged: a ball that moves along a diagonal would have to pass corners of the lattice, where
//! it has less clearance. So paths step to all 26 neighbours, but to one across an edge or a corner only where 6-neighbours
//! lead there too, within the cube of the 27. Then two pieces that touch only at a corner stay separate.

use crate::bits::{Ones, after, before, is_set, ones};
use crate::grid::Axis;
use crate::metrics::{BoundaryCondition, NodeSet};

/// Nodes of the cube around a node: bit 9·(dz + 1) + 3·(dy + 1) + dx + 1.
pub(in crate::metrics) type Cube = u32;

/// The bit of the node in the middle of the cube.
pub(in crate::metrics) const MIDDLE: u32 = 13;

const ALL: Cube = (1 << 27) - 1;
const X_LOW: Cube = 0o111_111_111;
const X_HIGH: Cube = X_LOW << 2;
const Y_LOW: Cube = 0o007_007_007;
const Y_HIGH: Cube = Y_LOW << 6;

/// The steps within a set of nodes.
pub(in crate::metrics) struct Steps<'a> {
    nodes: &'a NodeSet,
    size: [usize; 3],
    wraps: [bool; 3],
}

impl<'a> Steps<'a> {
    /// Creates the steps; with [`BoundaryCondition::Periodic`] a step over one face of the raster enters at the opposite one.
    ///
    /// # Panics
    /// If the raster has 2³² nodes or more.
    pub fn new(nodes: &'a NodeSet, edges: BoundaryCondition) -> Steps<'a> {
        assert!(u32::try_from(nodes.volume()).is_ok(), "{} nodes; fewer than 2³² are possible", nodes.volume());
        Steps { nodes, size: nodes.size(), wraps: [edges == BoundaryCondition::Periodic; 3] }
    }

    /// Creates the same steps without wrapping along an axis.
    pub fn between_ends(nodes: &'a NodeSet, edges: BoundaryCondition, axis: Axis) -> Steps<'a> {
        let mut steps = Steps::new(nodes, edges);
        steps.wraps[axis.depth()] = false;
        steps
    }

    /// Returns the number of nodes along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// Returns the position of a node from its number.
    #[inline]
    pub fn place(&self, index: u32) -> [usize; 3] {
        place(self.size, index)
    }

    /// Returns the nodes of the set in row (y, z), ascending.
    pub fn members(&self, y: usize, z: usize) -> impl Iterator<Item = usize> + use<'a> {
        ones(self.nodes.row(y, z))
    }

    /// Returns the number of a node, `(z · size[1] + y) · size[0] + x`.
    #[inline]
    pub fn index(&self, [x, y, z]: [usize; 3]) -> u32 {
        ((z * self.size[1] + y) * self.size[0] + x) as u32
    }

    /// Returns the node for bit `bit` of the cube around `node`. It must be in the raster, or steps must wrap.
    #[inline]
    pub fn neighbour(&self, node: [usize; 3], bit: u32) -> [usize; 3] {
        let by = [bit % 3, bit / 3 % 3, bit / 9];
        std::array::from_fn(|axis| wrapped(node[axis] + by[axis] as usize, self.size[axis]))
    }

    /// Returns the neighbours of a node that a step leads to.
    #[inline]
    pub fn from(&self, [x, y, z]: [usize; 3]) -> Cube {
        self.row(y, z).from(x)
    }

    /// Returns the nodes of row (y, z), with the rows around it.
    #[inline]
    pub fn row(&self, y: usize, z: usize) -> Row<'a> {
        let rows = std::array::from_fn(|i| {
            let (y, z) = (self.beside(y, i % 3, 1)?, self.beside(z, i / 3, 2)?);
            Some((self.nodes.row(y, z), self.index([0, y, z])))
        });
        Row { rows, side: self.size[0], wraps: self.wraps[0] }
    }

    /// Returns the coordinate offset by `by` − 1, if it is in the raster.
    #[inline]
    fn beside(&self, at: usize, by: usize, axis: usize) -> Option<usize> {
        let side = self.size[axis];
        match at + by {
            0 => self.wraps[axis].then(|| side - 1),
            beyond if beyond > side => self.wraps[axis].then_some(0),
            within => Some(within - 1),
        }
    }
}

/// A row of nodes and the eight around it that are in the raster, each with the number of its first node.
pub(in crate::metrics) struct Row<'a> {
    rows: [Option<(&'a [u64], u32)>; 9],
    side: usize,
    wraps: bool,
}

impl<'a> Row<'a> {
    /// Returns the nodes of the row as bits.
    pub fn words(&self) -> &'a [u64] {
        self.rows[4].expect("a row of the raster").0
    }

    /// Returns whether the ends of rows are neighbours.
    pub fn wraps(&self) -> bool {
        self.wraps
    }

    /// Returns the numbers of the first nodes of the nine rows, in the order of the cube; `None` outside of the raster.
    pub fn firsts(&self) -> [Option<usize>; 9] {
        self.rows.map(|row| row.map(|(_, first)| first as usize))
    }

    /// Returns the nodes of a word of the row whose whole cube belongs to the set, as bits, except nodes at its ends.
    pub fn inner(&self, word: usize) -> u64 {
        self.rows.iter().fold(u64::MAX, |inner, row| {
            row.map_or(0, |(words, _)| inner & words[word] & before(words, word) & after(words, word))
        })
    }

    /// Returns the neighbours of node x of the row that a step leads to.
    #[inline]
    pub fn from(&self, x: usize) -> Cube {
        let within = self.cube(x);
        if within == ALL {
            return ALL & !(1 << MIDDLE);
        }
        let mut reached: Cube = 1 << MIDDLE;
        for _ in 0..3 {
            reached |= spread(reached) & within;
        }
        reached & !(1 << MIDDLE)
    }

    /// Returns the nodes of the cube around node x that belong to the set.
    #[inline]
    pub fn cube(&self, x: usize) -> Cube {
        let rows = self.rows.iter().enumerate();
        rows.fold(0, |cube, (i, row)| row.map_or(cube, |(words, _)| cube | self.triple(x, words) << (3 * i)))
    }

    /// Returns the number of the neighbour of node x for a bit of its cube.
    #[inline]
    pub fn number(&self, x: usize, bit: u32) -> u32 {
        let (_, first) = self.rows[bit as usize / 3].expect("a neighbour in the raster");
        first + wrapped(x + bit as usize % 3, self.side) as u32
    }

    /// Returns nodes x − 1, x and x + 1 of a row, as three bits.
    #[inline]
    fn triple(&self, x: usize, row: &[u64]) -> u32 {
        let bit = |x: usize| u32::from(is_set(row, x));
        if x > 0 && x + 1 < self.side {
            let (word, shift) = ((x - 1) / 64, (x - 1) % 64);
            let mut bits = row[word] >> shift;
            if shift > 61 {
                bits |= row[word + 1] << (64 - shift);
            }
            return bits as u32 & 7;
        }
        let beyond = |at: usize| u32::from(self.wraps) & bit(at);
        let low = if x > 0 { bit(x - 1) } else { beyond(self.side - 1) };
        let high = if x + 1 < self.side { bit(x + 1) } else { beyond(0) };
        low | bit(x) << 1 | high << 2
    }
}

/// Returns a coordinate from one more than itself, wrapped if it is beyond the side.
#[inline]
fn wrapped(one_more: usize, side: usize) -> usize {
    match one_more {
        0 => side - 1,
        beyond if beyond > side => 0,
        within => within - 1,
    }
}

/// Returns the position of a node of a raster from its number.
#[inline]
pub(in crate::metrics) fn place(size: [usize; 3], index: u32) -> [usize; 3] {
    let (width, height) = (size[0] as u32, size[1] as u32);
    let row = index / width;
    [(index % width) as usize, (row % height) as usize, (row / height) as usize]
}

/// Returns the bits that are set in a cube, ascending.
#[inline]
pub(in crate::metrics) fn bits(cube: Cube) -> Ones {
    Ones(u64::from(cube))
}

/// The least bottleneck radius: nodes of an open piece are reached, however narrow it is.
pub(super) const LEAST: f32 = f32::MIN_POSITIVE;

/// Returns the 6-neighbours of nodes of a cube that are in the cube.
#[inline]
fn spread(cube: Cube) -> Cube {
    let x = (cube & !X_HIGH) << 1 | (cube & !X_LOW) >> 1;
    let y = (cube & !Y_HIGH) << 3 | (cube & !Y_LOW) >> 3;
    (x | y | cube << 9 | cube >> 9) & ALL
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a set that is neither dense nor sparse, the same every time.
    fn scattered(size: [usize; 3]) -> NodeSet {
        NodeSet::from_fn(size, |[x, y, z]| (x * 7 + y * 13 + z * 29 + x * y * z) % 5 < 3)
    }

    #[test]
    fn neighbourhood_cubes_agree_with_the_node_set() {
        let rasters = [[131, 4, 3], [1, 2, 3], [2, 1, 1], [64, 1, 2]];
        let conditions = [BoundaryCondition::Clip, BoundaryCondition::Periodic];
        for (size, edges) in rasters.into_iter().flat_map(|size| conditions.map(|edges| (size, edges))) {
            let nodes = scattered(size);
            let steps = Steps::new(&nodes, edges);
            for index in 0..nodes.volume() as u32 {
                let node = steps.place(index);
                assert_eq!(steps.index(node), index);
                let row = steps.row(node[1], node[2]);
                let cube = row.cube(node[0]);
                for bit in 0..27 {
                    let by = [bit % 3, bit / 3 % 3, bit / 9];
                    let inside = (0..3).all(|a| (1..=size[a]).contains(&(node[a] + by[a] as usize)));
                    let other: [usize; 3] = std::array::from_fn(|a| (node[a] + by[a] as usize + size[a] - 1) % size[a]);
                    let held = (inside || edges == BoundaryCondition::Periodic) && nodes.contains(other);
                    assert_eq!(cube >> bit & 1 == 1, held, "{edges:?}, {node:?}, {bit}");
                    if held {
                        assert_eq!(steps.neighbour(node, bit), other);
                        assert_eq!(row.number(node[0], bit), steps.index(other));
                    }
                }
            }
        }
    }

    #[test]
    fn no_step_leads_through_a_corner() {
        // In the plane through the middle: itself, and one across an edge, first alone and then with one between them.
        let alone = NodeSet::from_fn([3; 3], |node| node == [1, 1, 1] || node == [2, 2, 1]);
        assert_eq!(Steps::new(&alone, BoundaryCondition::Clip).from([1, 1, 1]), 0);
        let between = NodeSet::from_fn([3; 3], |node| node == [1, 1, 1] || node == [2, 2, 1] || node == [2, 1, 1]);
        assert_eq!(Steps::new(&between, BoundaryCondition::Clip).from([1, 1, 1]).count_ones(), 2);
        // Three steps lead to a corner of the cube, and no fewer.
        let way = [[1, 1, 1], [1, 1, 2], [1, 2, 2], [2, 2, 2]];
        let corner = |skipped: usize| {
            let nodes =
                NodeSet::from_fn([3; 3], |node| way.iter().enumerate().any(|(i, &w)| i != skipped && w == node));
            Steps::new(&nodes, BoundaryCondition::Clip).from([1, 1, 1]) >> 26 & 1
        };
        assert_eq!([1, 2, 9].map(corner), [0, 0, 1]);
        assert_eq!(Steps::new(&NodeSet::full([3; 3]), BoundaryCondition::Clip).from([1, 1, 1]).count_ones(), 26);
    }
}
