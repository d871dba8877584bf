//! Lattice edges between nodes of the same sign that the surface crosses twice nevertheless: walls and gaps thinner than the
//! lattice.
//!
//! Two plates that nearly touch have nodes that are neighbours, and a thin wall may have no node at all: by signs alone the plates
//! are one, and the wall is missing. The samples resolve this: between the two nodes the ray leaves the solid and enters it again,
//! or enters it and leaves it. So such an edge is *cut* ([`cell`](crate::cell)). The signs of nodes are unchanged. `choice` finds
//! the edges that are cut.
//!
//! # Necks
//! Solids that touch *exactly* leave no gap in a ray through the contact. A **neck** is an edge with both ends inside whose
//! four neighbours on either side are all outside. It is cut where the planes beside its lower end meet the edge in the same
//! point as those beside its upper end: there two wedges or tips touch. A strut does not end like this. Beside ambiguous faces that
//! are joined ([`pairing`](super::pairing)) no neck is cut.

mod choice;

use std::collections::{BTreeMap, HashMap};

use crate::parallel::*;

use super::edges::{Crossing, EdgeSlab, Source};
use super::pairing::joined_faces;
use super::part::Part;
use crate::bits::Ones;
use crate::bits::{after, before};
use crate::cell::{edge_at, edge_ends};
use crate::ldi::Mode;

/// Greatest distance between the tips on both sides of a neck, in pitches, at which they touch.
const TOUCHING: f32 = 1e-3;

/// The least distance of the two crossings of an edge, as a share of it, so that the surfaces on both sides stay separate.
const LEAST_GAP: f32 = 0.02;

/// The key of an edge: plane or layer, axis, row and column of its lower node.
type Place = [i32; 4];

/// The cut edges and the joined faces of a cell; see [`Signs`](crate::cell::Signs).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CutCell {
    pub cut: u16,
    pub joined: u8,
    /// The cut edges between corners that are outside, and those between corners that are inside and no necks.
    walls: u16,
    gaps: u16,
}

/// The edges that are cut.
#[derive(Debug, Default)]
pub struct Cuts {
    of_edge: BTreeMap<Place, [Crossing; 2]>,
    of_cell: HashMap<[i32; 3], CutCell>,
}

fn place(axis: usize, [x, y, z]: [i32; 3]) -> Place {
    [z, axis as i32, y, x]
}

/// Returns the four cells around an edge, and its number in each.
pub fn cells_around(axis: usize, node: [i32; 3]) -> [([i32; 3], usize); 4] {
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(u, v)| {
        let mut cell = node;
        cell[(axis + 1) % 3] -= u;
        cell[(axis + 2) % 3] -= v;
        (cell, edge_at(axis, u as usize, v as usize))
    })
}

/// Converts an edge of a cell to its axis and lower node.
pub fn edge_of([x, y, z]: [i32; 3], edge: usize) -> (usize, [i32; 3]) {
    let (low, _) = edge_ends(edge);
    let [dx, dy, dz] = [low & 1, low >> 1 & 1, low >> 2].map(|i| i as i32);
    (edge / 4, [x + dx, y + dy, z + dz])
}

/// Returns whether planes join an ambiguous face of a cell. Beside it a neck might merge loops.
fn has_joined_faces(source: &Source, cell: [i32; 3]) -> bool {
    joined_faces(source, source.corners_inside(cell), cell) != 0
}

impl Cuts {
    /// Cuts the necks of the layers of a slab and of the planes above each; those of its first plane are known from the
    /// previous slab.
    pub fn add_necks(&mut self, source: &Source, slab: &EdgeSlab, part: Part) {
        let layers = slab.layers();
        let found: Vec<(usize, [i32; 3])> = layers.into_par_iter().flat_map_iter(|k| necks(slab, k)).collect();
        for (axis, node) in found {
            let mut end = node;
            end[axis] += 1;
            let tips = source.tip(axis, node, true).zip(source.tip(axis, end, false));
            let Some(((up, lower), (down, upper))) = tips else { continue };
            let around = cells_around(axis, node);
            if (up + down - 1.0).abs() < TOUCHING
                && (0.0..1.0).contains(&up)
                && around.iter().all(|&(cell, _)| self.in_cell(cell).walls == 0 && !has_joined_faces(source, cell))
                && !self.of_edge.contains_key(&place(axis, node))
                && part.may_cut(axis, node)
            {
                let crossings = [lower, upper].map(|normal| Crossing { at: up, normal });
                self.of_edge.insert(place(axis, node), apart(crossings));
                for (cell, edge) in around {
                    self.of_cell.entry(cell).or_default().cut |= 1 << edge;
                }
            }
        }
    }

    /// Returns the edges of a cell that are cut, and the faces that are joined for their sake.
    pub fn in_cell(&self, cell: [i32; 3]) -> CutCell {
        if self.of_cell.is_empty() { CutCell::default() } else { self.of_cell.get(&cell).copied().unwrap_or_default() }
    }

    /// Returns the crossings of a cut edge of a cell, the lower first.
    pub fn crossings(&self, cell: [i32; 3], edge: usize) -> [Crossing; 2] {
        let (axis, node) = edge_of(cell, edge);
        self.of_edge[&place(axis, node)]
    }

    /// Returns the mode by which to choose between the crossings of an edge with more than one: beside gaps that of an image within
    /// the solid, so that no gap is closed, and beside walls that of one around it.
    pub fn mode_beside(&self, axis: usize, node: [i32; 3]) -> Mode {
        // Necks do not count: they are known slab by slab.
        let [mut walls, mut gaps] = [0; 2];
        for (cell, edge) in cells_around(axis, node) {
            let parallel = (0xf << (4 * axis)) & !(1 << edge);
            let cut = self.in_cell(cell);
            (walls, gaps) = (walls | cut.walls & parallel, gaps | cut.gaps & parallel);
        }
        match (walls, gaps) {
            (1.., 0) => Mode::OVER,
            (0, 1..) => Mode::UNDER,
            _ => Mode::Exact,
        }
    }

    /// Returns the cut edges along x and y in a plane, or along z in a layer: lower node and crossings.
    pub fn in_layer(&self, axis: usize, z: i32) -> impl Iterator<Item = ([i32; 3], [Crossing; 2])> + '_ {
        let from = [z, axis as i32, i32::MIN, i32::MIN];
        let to = [z, axis as i32, i32::MAX, i32::MAX];
        self.of_edge.range(from..=to).map(|(&[z, _, y, x], &crossings)| ([x, y, z], crossings))
    }

    /// Returns row and column of the cells of a layer that have cut edges, in order.
    pub fn cells_in_layer(&self, k: i32) -> Vec<[i32; 2]> {
        let edges = [(0, k), (0, k + 1), (1, k), (1, k + 1), (2, k)];
        let of_layer = |(axis, z): (usize, i32)| {
            let cells = self.in_layer(axis, z).flat_map(move |(node, _)| cells_around(axis, node));
            cells.filter(|(cell, _)| cell[2] == k).map(|(cell, _)| [cell[1], cell[0]])
        };
        let mut cells: Vec<[i32; 2]> = edges.into_iter().flat_map(of_layer).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Returns whether an edge is cut for a wall or a gap.
    pub fn has_thin(&self, axis: usize, node: [i32; 3]) -> bool {
        let [(cell, edge), ..] = cells_around(axis, node);
        let CutCell { walls, gaps, .. } = self.in_cell(cell);
        (walls | gaps) >> edge & 1 == 1
    }
}

/// Moves two crossings apart to the least distance, within their edge.
fn apart([mut lower, mut upper]: [Crossing; 2]) -> [Crossing; 2] {
    let lack = 0.5 * (LEAST_GAP - (upper.at - lower.at)).max(0.0);
    lower.at = (lower.at - lack).max(0.25 * LEAST_GAP);
    upper.at = (upper.at + lack).min(1.0 - 0.25 * LEAST_GAP);
    [lower, upper]
}

/// Returns the necks along z in layer `k`, and along x and y in the plane above it.
fn necks(slab: &EdgeSlab, k: i32) -> Vec<(usize, [i32; 3])> {
    let nodes = &slab.nodes;
    let mut found = Vec::new();
    for y in 1..nodes.rows() - 1 {
        let row = |dy: usize, dz: i32| nodes.row(y + dy - 1, k + dz);
        for word in 0..nodes.words() {
            let here = row(1, 1)[word];
            if here == 0 {
                continue;
            }
            let beside = |row: &[u64]| before(row, word) | after(row, word);
            let mut add = |axis: usize, necks: u64, z: i32| {
                found.extend(Ones(necks).map(|bit| (axis, [(64 * word) as i32 + bit as i32, y as i32, z])));
            };
            // Adjacent nodes of a row.
            let pair = |row: &[u64]| row[word] | after(row, word);
            let around_x = pair(row(0, 1)) | pair(row(2, 1)) | pair(row(1, 0)) | pair(row(1, 2));
            add(0, here & after(row(1, 1), word) & !around_x, k + 1);
            let around_y = beside(row(1, 1))
                | beside(row(2, 1))
                | row(1, 0)[word]
                | row(2, 0)[word]
                | row(1, 2)[word]
                | row(2, 2)[word];
            add(1, here & row(2, 1)[word] & !around_y, k + 1);
            let around_z = beside(row(1, 0))
                | beside(row(1, 1))
                | row(0, 0)[word]
                | row(0, 1)[word]
                | row(2, 0)[word]
                | row(2, 1)[word];
            add(2, here & row(1, 0)[word] & !around_z, k);
        }
    }
    found
}
