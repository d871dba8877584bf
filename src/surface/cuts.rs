//! Lattice edges with both ends inside that the surface crosses twice nevertheless: the gap in between is kept.
//!
//! Where two solids touch along an oblique edge, or nearly do, nodes of both are neighbours in places. By signs alone each such
//! pair of nodes is a bridge, and any two bridges form a handle that the solids do not have. The samples resolve this: between
//! the two nodes the ray leaves the solid and enters it again. So such an edge is *cut* ([`cell`](crate::cell)), and both
//! solids end there. The signs of nodes are unchanged.
//!
//! # Choice of cut edges
//! A gap finer than the lattice cannot end within the solid, as its end is unknown. So edges with a gap are grouped in clusters
//! that share cells, and a cluster is cut if in each of its cells every cut separates its two ends, and the surface stays
//! manifold; then the gap reaches the outside on all sides. Otherwise the gap is closed, as where a cell lies within the solid
//! altogether but for the gap.
//!
//! Solids that touch *exactly* leave no gap in a ray through the contact. A **neck** is an edge with both ends inside whose
//! four neighbours on either side are all outside. It is cut where the planes beside its lower end meet the edge in the same
//! point as those beside its upper end: there two wedges or tips touch. A strut does not end like this.

use std::collections::{BTreeMap, HashMap, HashSet};

use rayon::prelude::*;

use super::edges::{Crossing, EdgeSlab, Source};
use crate::bits::{Ones, after, before};
use crate::cell::{Signs, at_fault, edge_at, edge_ends, is_ambiguous};

/// Greatest distance between the tips on both sides of a neck, in pitches, at which they touch.
const TOUCHING: f32 = 1e-3;

/// The least gap between the two crossings of an edge, as a share of it, so that the surfaces on both sides stay separate.
const LEAST_GAP: f32 = 0.02;

/// The key of an edge: plane or layer, axis, row and column of its lower node.
type Place = [i32; 4];

/// The edges that are cut.
#[derive(Debug, Default)]
pub struct Cuts {
    of_edge: BTreeMap<Place, [Crossing; 2]>,
    of_cell: HashMap<[i32; 3], u16>,
}

fn place(axis: usize, [x, y, z]: [i32; 3]) -> Place {
    [z, axis as i32, y, x]
}

/// Returns the four cells around an edge, and its number in each.
fn cells_around(axis: usize, node: [i32; 3]) -> [([i32; 3], usize); 4] {
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(u, v)| {
        let mut cell = node;
        cell[(axis + 1) % 3] -= u;
        cell[(axis + 2) % 3] -= v;
        (cell, edge_at(axis, u as usize, v as usize))
    })
}

/// Converts an edge of a cell to its axis and lower node.
fn edge_of([x, y, z]: [i32; 3], edge: usize) -> (usize, [i32; 3]) {
    let (low, _) = edge_ends(edge);
    let [dx, dy, dz] = [low & 1, low >> 1 & 1, low >> 2].map(|i| i as i32);
    (edge / 4, [x + dx, y + dy, z + dz])
}

/// Returns whether each cut edge separates its two ends in a cell.
fn parts_all(inside: u8, cut: u16) -> bool {
    let mut class: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
    let kept = |edge: &usize| {
        let (a, b) = edge_ends(*edge);
        inside >> a & inside >> b & 1 == 1 && cut >> edge & 1 == 0
    };
    for (a, b) in (0..12).filter(kept).map(edge_ends) {
        let (from, to) = (class[a], class[b]);
        class.iter_mut().filter(|class| **class == from).for_each(|class| *class = to);
    }
    (0..12).filter(|edge| cut >> edge & 1 == 1).map(edge_ends).all(|(a, b)| class[a] != class[b])
}

impl Cuts {
    /// Finds the gaps of images that reach the outside.
    pub fn of_gaps(source: &Source) -> Cuts {
        let mut gaps = source.gaps();
        let both_inside = |axis: usize, node: [i32; 3]| {
            let mut end = node;
            end[axis] += 1;
            source.is_inside(node) && source.is_inside(end)
        };
        gaps.retain(|&(axis, node, _)| both_inside(axis, node));
        let mut cuts = Cuts::default();
        gaps.into_iter().for_each(|(axis, node, crossings)| cuts.add(axis, node, crossings));
        let signs = |cell: [i32; 3]| {
            let corner = |c: i32| source.is_inside([cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)]);
            let inside = (0..8).fold(0, |bits, c| bits | u8::from(corner(c)) << c);
            Signs { inside, joined: 0, cut: cuts.in_cell(cell) }
        };
        let is_wrong = |(cell, cut): (&[i32; 3], &u16)| {
            let own = signs(*cell);
            let at_faces = || {
                (0..3).any(|axis| {
                    let beside = |step: i32| {
                        let mut beside = *cell;
                        beside[axis] += step;
                        signs(beside)
                    };
                    // Ambiguous faces at fault will be joined.
                    let is_clear = |side: usize| !is_ambiguous(own.inside, axis, side);
                    (is_clear(0) && at_fault(axis, beside(-1), own)) || (is_clear(1) && at_fault(axis, own, beside(1)))
                })
            };
            own.inside == u8::MAX || !parts_all(own.inside, *cut) || at_faces()
        };
        let wrong: Vec<[i32; 3]> =
            cuts.of_cell.par_iter().filter(|&(cell, cut)| is_wrong((cell, cut))).map(|(cell, _)| *cell).collect();
        let mut closed: HashSet<[i32; 3]> = wrong.iter().copied().collect();
        let mut waiting = wrong;
        while let Some(cell) = waiting.pop() {
            let cut = cuts.in_cell(cell);
            for edge in (0..12).filter(|edge| cut >> edge & 1 == 1) {
                let (axis, node) = edge_of(cell, edge);
                cuts.of_edge.remove(&place(axis, node));
                waiting
                    .extend(cells_around(axis, node).map(|(cell, _)| cell).into_iter().filter(|&c| closed.insert(c)));
            }
        }
        cuts.of_cell.retain(|cell, _| !closed.contains(cell));
        cuts
    }

    /// Cuts the necks of the layers of a slab and of the planes above each; those of its first plane are known from the
    /// previous slab.
    pub fn add_necks(&mut self, source: &Source, slab: &EdgeSlab) {
        let layers = slab.layers();
        let found: Vec<(usize, [i32; 3])> = layers.into_par_iter().flat_map_iter(|k| necks(slab, k)).collect();
        for (axis, node) in found {
            let mut end = node;
            end[axis] += 1;
            let tips = source.tip(axis, node, true).zip(source.tip(axis, end, false));
            let Some(((up, lower), (down, upper))) = tips else { continue };
            if (up + down - 1.0).abs() < TOUCHING
                && (0.0..1.0).contains(&up)
                && !self.of_edge.contains_key(&place(axis, node))
            {
                let [lower, upper] = [lower, upper].map(|normal| Crossing { at: up, normal });
                self.add(axis, node, [lower, upper]);
            }
        }
    }

    fn add(&mut self, axis: usize, node: [i32; 3], [mut lower, mut upper]: [Crossing; 2]) {
        let lack = 0.5 * (LEAST_GAP - (upper.at - lower.at)).max(0.0);
        lower.at = (lower.at - lack).max(0.25 * LEAST_GAP);
        upper.at = (upper.at + lack).min(1.0 - 0.25 * LEAST_GAP);
        self.of_edge.insert(place(axis, node), [lower, upper]);
        for (cell, edge) in cells_around(axis, node) {
            *self.of_cell.entry(cell).or_default() |= 1 << edge;
        }
    }

    /// Returns the edges of a cell that are cut.
    pub fn in_cell(&self, cell: [i32; 3]) -> u16 {
        if self.of_cell.is_empty() { 0 } else { self.of_cell.get(&cell).copied().unwrap_or(0) }
    }

    /// Returns the crossings of a cut edge of a cell, the lower first.
    pub fn crossings(&self, cell: [i32; 3], edge: usize) -> [Crossing; 2] {
        let (axis, node) = edge_of(cell, edge);
        self.of_edge[&place(axis, node)]
    }

    /// Returns the cut edges along x and y in a plane, or along z in a layer: lower node and crossings.
    pub fn in_layer(&self, axis: usize, z: i32) -> impl Iterator<Item = ([i32; 3], [Crossing; 2])> + '_ {
        let from = [z, axis as i32, i32::MIN, i32::MIN];
        let to = [z, axis as i32, i32::MAX, i32::MAX];
        self.of_edge.range(from..=to).map(|(&[z, _, y, x], &crossings)| ([x, y, z], crossings))
    }

    /// Returns the number of cut edges.
    pub fn len(&self) -> usize {
        self.of_edge.len()
    }
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
