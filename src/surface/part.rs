//! The cells that one contour makes where a surface has blocks of finer cells.

use std::collections::{HashMap, HashSet};
use std::hash::{BuildHasherDefault, Hasher};

use super::border::Border;
use super::cuts::{cells_around, edge_of};

/// A set of cells.
pub type CellSet = HashSet<[i32; 3], BuildHasherDefault<CellHasher>>;

/// A map from cells.
pub type CellMap<T> = HashMap<[i32; 3], T, BuildHasherDefault<CellHasher>>;

/// A hash of coordinates: the default one, which resists chosen keys, takes several times as long.
#[derive(Default)]
pub struct CellHasher(u64);

impl Hasher for CellHasher {
    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }

    fn write(&mut self, bytes: &[u8]) {
        for four in bytes.chunks(4) {
            let word = four.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
            self.0 = (self.0.rotate_left(21) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
    }

    fn write_usize(&mut self, _length: usize) {}
}

/// A block of cells that are replaced by finer ones, and its border.
pub struct Block {
    /// The cells that are replaced.
    pub cells: CellSet,
    pub border: Border,
}

/// Blocks of finer cells, by the cells that they replace and those of their borders.
pub struct Blocks<'a> {
    blocks: Vec<&'a Block>,
    replaced: CellSet,
    /// For each cell of a border the number of its block.
    of_border: CellMap<usize>,
    /// Rows and columns of these cells by layer, in order.
    by_layer: HashMap<i32, Vec<[i32; 2]>>,
}

impl<'a> Blocks<'a> {
    pub fn new(blocks: Vec<&'a Block>) -> Blocks<'a> {
        let replaced = blocks.iter().flat_map(|block| block.cells.iter().copied()).collect();
        let of_block = |(number, block): (usize, &&Block)| {
            block.border.cells.keys().map(|&cell| (cell, number)).collect::<Vec<_>>()
        };
        let of_border: CellMap<usize> = blocks.iter().enumerate().flat_map(of_block).collect();
        let mut by_layer: HashMap<i32, Vec<[i32; 2]>> = HashMap::new();
        for [x, y, z] in of_border.keys() {
            by_layer.entry(*z).or_default().push([*y, *x]);
        }
        by_layer.values_mut().for_each(|cells| cells.sort_unstable());
        Blocks { blocks, replaced, of_border, by_layer }
    }

    /// Returns the number of the block beside a cell, and its border.
    pub fn beside(&self, cell: [i32; 3]) -> Option<(usize, &'a Border)> {
        self.of_border.get(&cell).map(|&number| (number, &self.blocks[number].border))
    }
}

/// The cells that a contour makes.
#[derive(Clone, Copy)]
pub enum Part<'a> {
    /// All.
    Whole,
    /// All that are not replaced.
    Around(&'a Blocks<'a>),
    /// The finer ones of a block.
    Within(&'a Block),
}

impl<'a> Part<'a> {
    /// Returns whether the contour makes a cell.
    pub fn makes(self, cell: [i32; 3]) -> bool {
        match self {
            Part::Whole => true,
            Part::Around(blocks) => !blocks.replaced.contains(&cell),
            Part::Within(block) => block.cells.contains(&block.border.scale.coarse(cell)),
        }
    }

    /// Returns whether the contour makes the triangles of an edge: coarse ones those of whole edges, and blocks those of all edges of
    /// their cells.
    pub fn has_edge(self, axis: usize, node: [i32; 3]) -> bool {
        let mut cells = cells_around(axis, node).into_iter().map(|(cell, _)| self.makes(cell));
        match self {
            Part::Whole => true,
            Part::Around(_) => cells.all(|makes| makes),
            Part::Within(_) => cells.any(|makes| makes),
        }
    }

    /// Returns whether an edge may be cut: none on the border of a block may.
    pub fn may_cut(self, axis: usize, node: [i32; 3]) -> bool {
        let mut cells = cells_around(axis, node).into_iter().map(|(cell, _)| cell);
        match self {
            Part::Whole => true,
            Part::Around(blocks) => cells.all(|cell| self.makes(cell) && blocks.beside(cell).is_none()),
            Part::Within(_) => cells.all(|cell| self.makes(cell)),
        }
    }

    /// Returns the loop of a border that a crossing of a finer cell beyond the block belongs to.
    pub fn border_vertex(self, cell: [i32; 3], crossing: usize) -> Option<u32> {
        let Part::Within(block) = self else { return None };
        if self.makes(cell) {
            return None;
        }
        let (axis, node) = edge_of(cell, crossing);
        Some(block.border.vertex(cell, axis, node))
    }

    /// Returns the border of a block.
    pub fn border(self) -> Option<&'a Border> {
        if let Part::Within(block) = self { Some(&block.border) } else { None }
    }

    /// Returns rows and columns of the cells of layer `k` that belong to borders of blocks, in order.
    pub fn border_cells_in_layer(self, k: i32) -> &'a [[i32; 2]] {
        let Part::Around(blocks) = self else { return &[] };
        blocks.by_layer.get(&k).map_or(&[], |cells| cells)
    }
}
