//! The cells that the surface crosses, layer by layer, and their vertices.

use std::collections::HashMap;

use glam::DVec3;

use super::border::Border;
use super::cuts::Cuts;
use super::edges::EdgeSlab;
use super::feature::Feature;
use super::pairing::JoinedFaces;
use super::part::Part;
use super::qef::{Bounds, Loop, Place};
use crate::bits::{Ones, after};
use crate::cancel::checkpoint;
use crate::cell::{Signs, UPPER, edge_ends, loops};
use crate::grid::Grid;

/// A cell that the surface crosses.
#[derive(Clone, Copy, Debug)]
struct Cell {
    first_vertex: u32,
    signs: Signs,
}

/// The cells of one layer that the surface crosses, and their vertices.
#[derive(Debug, Default)]
pub struct CellLayer {
    words: usize,
    /// The cells that the surface crosses as bits, row after row.
    passed: Vec<u64>,
    /// The number of such cells before each word.
    ranks: Vec<u32>,
    cells: Vec<Cell>,
    /// The vertices in coordinates of cells: the index of the cell plus the position in it.
    pub vertices: Vec<DVec3>,
    /// The vertices that are not plain vertices of one gently bent sheet, numbered within the layer.
    pub features: Vec<Feature>,
    /// For each cell beside a block of finer cells, by its number, the loops of the crossings of its whole edges.
    on_whole_edges: HashMap<u32, [u16; 12]>,
    /// The vertices of such cells.
    pub of_borders: Vec<OfBorder>,
}

/// Consecutive vertices of the border of a block of finer cells.
#[derive(Clone, Copy, Debug)]
pub struct OfBorder {
    pub block: usize,
    /// The first of them in the border, and their number.
    pub first: u32,
    pub count: u32,
    /// The first of them in the layer.
    pub vertex: u32,
}

/// Least distance of a vertex from the faces of its cell, in pitches: enough for 32-bit coordinates to keep it inside.
pub const MARGIN: f64 = 1e-4;

/// Distances below this, in pitches, are rounding.
const ROUNDED: f64 = 1e-6;

/// Greatest distance beyond its cell at which a vertex may belong, in pitches.
pub const REACH: f64 = 1.0;

/// Greatest distance of a plain vertex of a gently bent sheet from the mean of its crossings, in pitches.
const PLAIN: f64 = 0.05;

/// Two vertices of one cell nearer than this, in pitches, are not placed on edges or corners but aside, or at the means of
/// their crossings.
pub const APART: f64 = 1e-2;

/// The share of their way to the means of their crossings by which the vertices of several loops go aside if that is enough.
const ASIDE: f64 = 1.0 / 16.0;

/// Returns the position of a vertex on its feature, if that is beyond its cell, but not beyond the grid.
pub fn target_of(place: &Place, whole: &Bounds) -> Option<DVec3> {
    let beyond = place.beyond?;
    let target = beyond.clamp(whole.least, whole.greatest);
    // At the end of the grid the held position may equal the target.
    (target.distance(beyond) < MARGIN && target.distance(place.held) > ROUNDED).then_some(target)
}

impl CellLayer {
    /// Finds the cells of layer `k` and their vertices.
    pub fn new(slab: &EdgeSlab, joined: &JoinedFaces, cuts: &Cuts, grid: &Grid, part: Part, k: i32) -> CellLayer {
        let nodes = &slab.nodes;
        let mut layer = CellLayer { words: nodes.words(), ..CellLayer::default() };
        let whole = part.border().map_or_else(|| grid_bounds(grid), |border| border.limits);
        let mut cut_cells = cuts.cells_in_layer(k).into_iter().peekable();
        let mut border_cells = part.border_cells_in_layer(k).iter().copied().peekable();
        for y in 0..nodes.rows() - 1 {
            checkpoint();
            let rows = [nodes.row(y, k), nodes.row(y + 1, k), nodes.row(y, k + 1), nodes.row(y + 1, k + 1)];
            for word in 0..nodes.words() {
                // The nodes at the lower and the upper x of each cell.
                let lower = rows.map(|row| row[word]);
                let upper = rows.map(|row| after(row, word));
                let all = lower.into_iter().chain(upper);
                let mut passed =
                    all.clone().fold(0, |any, nodes| any | nodes) & !all.fold(u64::MAX, |all, nodes| all & nodes);
                let is_here = |&[row, column]: &[i32; 2]| [row, column / 64] == [y as i32, word as i32];
                while let Some([_, column]) = cut_cells.next_if(is_here) {
                    passed |= 1 << (column % 64);
                }
                while let Some([_, column]) = border_cells.next_if(is_here) {
                    passed |= 1 << (column % 64);
                }
                let at = |bit: u32| [(64 * word) as i32 + bit as i32, y as i32, k];
                if !matches!(part, Part::Whole) {
                    passed = Ones(passed).filter(|&bit| part.makes(at(bit))).fold(0, |bits, bit| bits | 1 << bit);
                }
                layer.ranks.push(layer.cells.len() as u32);
                layer.passed.push(passed);
                for bit in Ones(passed) {
                    let corners = |i: usize| (lower[i] >> bit & 1) | (upper[i] >> bit & 1) << 1;
                    let inside = corners(0) | corners(1) << 2 | corners(2) << 4 | corners(3) << 6;
                    let cell = at(bit);
                    if let Part::Around(blocks) = part
                        && let Some((block, border)) = blocks.beside(cell)
                    {
                        layer.add_border_cell(block, border, cell);
                        continue;
                    }
                    let signs = joined.signs(inside as u8, cell, cuts);
                    layer.add_cell(slab, cuts, &whole, cell, signs);
                }
            }
        }
        layer
    }

    /// Adds a cell beside a block of finer cells.
    fn add_border_cell(&mut self, block: usize, border: &Border, cell: [i32; 3]) {
        let first_vertex = self.vertices.len() as u32;
        let of_cell = &border.cells[&cell];
        self.of_borders.push(OfBorder { block, first: of_cell.first, count: of_cell.count, vertex: first_vertex });
        self.on_whole_edges.insert(self.cells.len() as u32, of_cell.of_whole);
        self.cells.push(Cell { first_vertex, signs: Signs::default() });
        for vertex in &border.vertices[of_cell.first as usize..][..of_cell.count as usize] {
            self.features.push(vertex.feature(self.vertices.len() as u32, [vertex.place; 2]));
            self.vertices.push(vertex.place);
        }
    }

    fn add_cell(&mut self, slab: &EdgeSlab, cuts: &Cuts, whole: &Bounds, cell: [i32; 3], signs: Signs) {
        let first_vertex = self.vertices.len() as u32;
        self.cells.push(Cell { first_vertex, signs });
        let loops = loops(signs);
        let (mut few, mut many) = ([Loop::default(); 4], Vec::new());
        let of_cell = match usize::from(loops.count) {
            count @ 0..=4 => &mut few[..count],
            count => {
                many.resize(count, Loop::default());
                &mut many[..]
            }
        };
        for (number, of_crossing) in loops.of_crossing.into_iter().enumerate().filter(|(_, of)| *of < loops.count) {
            let edge = number % UPPER;
            let (low, _) = edge_ends(edge);
            let corner = [low & 1, low >> 1 & 1, low >> 2].map(|i| i as i32);
            let node = [cell[0] + corner[0], cell[1] + corner[1], cell[2] + corner[2]];
            let crossing = match signs.cut >> edge & 1 {
                0 => slab.crossing(edge / 4, node),
                _ => cuts.crossings(cell, edge)[number / UPPER],
            };
            of_cell[usize::from(of_crossing)].add(DVec3::from_array(corner.map(f64::from)), edge / 4, &crossing);
        }
        let base = DVec3::from_array(cell.map(f64::from));
        let (bounds, whole) = (bounds_of(cell, whole), whole.from(base));
        for of_loop in of_cell.iter() {
            let place = of_loop.place(&bounds, REACH);
            let target = target_of(&place, &whole).map(|target| base + target);
            let is_alone = loops.count == 1;
            // At the rim of a wall, triangles of both its sides lie above one another.
            if signs.cut != 0
                || !place.is_gentle
                || !is_alone
                || target.is_some()
                || place.held.distance(place.mean) > PLAIN
            {
                self.features.push(Feature {
                    vertex: self.vertices.len() as u32,
                    held: base + place.held,
                    mean: base + place.mean,
                    target,
                    facing: place.facing.as_vec3(),
                    is_alone,
                    is_between: false,
                });
            }
            self.vertices.push(base + place.held);
        }
        // Two sheets meet in a point, as where the planes of both pass through it, or along a line where solids touch. Their
        // vertices go aside, no further than they must: the line may be a sharp edge.
        let is_parted = signs.cut != 0 && loops.count > 1;
        let shares = if is_parted { &[1.0][..] } else { &[ASIDE, 1.0] };
        for &share in shares {
            let range = first_vertex as usize..self.vertices.len();
            let near = |i: usize, j: usize| self.vertices[i].distance(self.vertices[j]) < APART;
            if !is_parted && !range.clone().any(|i| (range.start..i).any(|j| near(i, j))) {
                break;
            }
            // In a cell with several loops all vertices are features.
            let first = self.features.len() - range.len();
            for (vertex, feature) in self.vertices[range].iter_mut().zip(&mut self.features[first..]) {
                *vertex = feature.held.lerp(feature.mean, share);
                (feature.held, feature.target) = (*vertex, None);
            }
        }
    }

    /// Returns the vertex, by its number in the layer, of the loop that a crossing of a cell belongs to.
    pub fn vertex(&self, x: i32, y: i32, crossing: usize) -> u32 {
        let word = y as usize * self.words + x as usize / 64;
        let below = self.passed[word] & ((1 << (x % 64)) - 1);
        let place = self.ranks[word] + below.count_ones();
        let cell = self.cells[place as usize];
        if !self.on_whole_edges.is_empty()
            && let Some(of_edge) = self.on_whole_edges.get(&place)
        {
            return cell.first_vertex + u32::from(of_edge[crossing]);
        }
        cell.first_vertex + u32::from(loops(cell.signs).of_crossing[crossing])
    }
}

/// Returns the box that a vertex is held in: its cell less a margin, within the box of the grid, which may end in that margin. In
/// coordinates of the cell.
pub fn bounds_of(cell: [i32; 3], whole: &Bounds) -> Bounds {
    let whole = whole.from(DVec3::from_array(cell.map(f64::from)));
    let (least, greatest) = (DVec3::splat(MARGIN), DVec3::splat(1.0 - MARGIN));
    let (least, greatest) = (least.max(whole.least), greatest.min(whole.greatest));
    Bounds { least: least.min(whole.greatest), greatest: greatest.max(whole.least) }
}

/// Returns the box of the grid, in coordinates of cells. Cell i in x and y, with their margin of one, begins at node i − 1 of the grid;
/// layer k at plane k.
pub fn grid_bounds(grid: &Grid) -> Bounds {
    let pixel = f64::from(1u32 << grid.shift());
    let first = f64::from(grid.node(0)) / pixel;
    let origin = DVec3::new(1.0 - first, 1.0 - first, -first);
    let [x, y, z] = grid.rays().map(f64::from);
    Bounds { least: origin, greatest: origin + DVec3::new(x, y, z) }
}

/// Converts coordinates of cells to a world position.
pub fn world_from_cells(grid: &Grid, place: DVec3) -> DVec3 {
    let of_grid = grid_bounds(grid).least;
    grid.origin() + grid.pitch() * (place - of_grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_held_in_the_grid_where_it_ends_in_the_margin_of_their_cell() {
        let beyond = 0.01 * MARGIN;
        let whole = Bounds { least: DVec3::splat(-beyond), greatest: DVec3::splat(8.0 + beyond) };
        let ends = [MARGIN, 1.0 - MARGIN];
        for (cell, expected) in [(-1, [1.0 - beyond; 2]), (0, ends), (7, ends), (8, [beyond; 2])] {
            let Bounds { least, greatest } = bounds_of([cell; 3], &whole);
            for (found, expected) in [least, greatest].into_iter().zip(expected) {
                assert!(found.distance(DVec3::splat(expected)) < 1e-12, "{cell}: {found} {expected}");
            }
        }
    }
}
