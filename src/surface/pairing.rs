//! The pairing of arcs on ambiguous faces: those with inside corners on one diagonal alone.

use std::collections::HashMap;

use crate::parallel::*;
use glam::Vec3;

use super::cuts::{CutCell, Cuts, edge_of};
use super::edges::{EdgeSlab, Source};
use super::part::Part;
use crate::bits::{Ones, after};
use crate::cell::{Signs, arcs, at_fault, is_ambiguous};

/// A face is joined only if the ends of its arcs are then nearer to each other's planes by this factor than if it were not.
const FLATTER: f64 = 0.5;

/// The ambiguous faces that are joined, by cell; see [`cell`](crate::cell).
///
/// Either a wedge thinner than the diagonal passes through such a face, or two edges end beside it. The planes at the four crossings
/// decide: an arc should end at two crossings of one plane.
#[derive(Debug, Default)]
pub struct JoinedFaces {
    of_cell: HashMap<[i32; 3], u8>,
    /// The layer above those whose faces are proposed.
    next: Option<i32>,
}

/// A face: the cell above it, and its axis.
pub type Face = ([i32; 3], usize);

impl JoinedFaces {
    /// Creates the faces of a block of finer cells, of which those on its border are decided.
    pub fn of(part: Part) -> JoinedFaces {
        let mut joined = JoinedFaces::default();
        part.border().into_iter().flat_map(|border| &border.joined).for_each(|&face| joined.turn(face));
        joined
    }

    /// Returns the signs of a cell with some corners inside.
    pub fn signs(&self, inside: u8, cell: [i32; 3], cuts: &Cuts) -> Signs {
        let CutCell { cut, joined, .. } = cuts.in_cell(cell);
        let own = if self.of_cell.is_empty() { 0 } else { self.of_cell.get(&cell).copied().unwrap_or(0) };
        Signs { inside, joined: joined | own, cut }
    }

    /// Takes the other pairing of a face.
    fn turn(&mut self, (above, axis): Face) {
        *self.of_cell.entry(below((above, axis))).or_default() ^= 2 << (2 * axis);
        *self.of_cell.entry(above).or_default() ^= 1 << (2 * axis);
    }

    /// Decides all faces of the layers of a slab that are still undecided: those within each layer and those above it.
    ///
    /// Planes propose a pairing for each face, one layer ahead. Where four quadrilaterals would meet in one edge the other is
    /// taken: plane after plane, those across z below a layer, then those across x and y in it. So the decisions do not depend on
    /// where slabs begin.
    ///
    /// Faces on the border of a block of finer cells are decided with that.
    pub fn decide(&mut self, source: &Source, slab: &EdgeSlab, cuts: &Cuts, part: Part) {
        let layers = slab.layers();
        // Older layers are not queried again.
        self.of_cell.retain(|cell, _| cell[2] >= layers.start);
        let ambiguous: Vec<Vec<Face>> =
            (layers.start..layers.end + 1).into_par_iter().map(|k| of_part(ambiguous(slab, k), part)).collect();
        let new = ambiguous.iter().zip(layers.start..).filter(|&(_, k)| self.next.is_none_or(|next| k >= next));
        let new: Vec<Face> = new.flat_map(|(faces, _)| faces.iter().copied()).collect();
        // The plane of the upper cell's other corners may lie beyond the slab.
        let inside = |(above, axis): Face| nodes_inside(slab, above, (0..8).filter(|corner| corner >> axis & 1 == 0));
        let joined: Vec<Face> = new.into_par_iter().filter(|&face| are_joined(source, inside(face), face)).collect();
        joined.into_iter().for_each(|face| self.turn(face));
        self.next = Some(layers.end + 1);
        for face in ambiguous.into_iter().take(layers.len()).flatten() {
            let of_cell = |cell| self.signs(nodes_inside(slab, cell, 0..8), cell, cuts);
            if at_fault(face.1, of_cell(below(face)), of_cell(face.0)) {
                self.turn(face);
            }
        }
    }
}

/// Returns the faces that a contour decides.
fn of_part(mut faces: Vec<Face>, part: Part) -> Vec<Face> {
    if let Part::Within(_) = part {
        faces.retain(|&face| part.makes(face.0) && part.makes(below(face)));
    }
    faces
}

/// Returns the cell below a face.
fn below((above, axis): Face) -> [i32; 3] {
    let mut cell = above;
    cell[axis] -= 1;
    cell
}

/// Returns the ambiguous faces of a cell whose arcs agree better with the planes at their ends if they are joined, as bits.
pub fn joined_faces(source: &Source, inside: u8, cell: [i32; 3]) -> u8 {
    (0..6).fold(0, |bits, face| {
        let (axis, side) = (face / 2, face % 2);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let of_face = inside >> (side << axis) & (1 | 1 << u | 1 << v | 1 << (u | v));
        let mut above = cell;
        above[axis] += side as i32;
        bits | u8::from(is_ambiguous(inside, axis, side) && are_joined(source, of_face, (above, axis))) << face
    })
}

/// Returns whether the arcs of an ambiguous face agree better with the planes at their ends if it is joined.
pub fn are_joined(source: &Source, inside: u8, (above, axis): Face) -> bool {
    let place = |edge: usize| {
        let (along, node) = edge_of(above, edge);
        let crossing = source.first_crossing(along, node)?;
        Some((crossing.place(along, node), Vec3::from_array(crossing.normal).as_dvec3()))
    };
    // The worst arc of a pairing: the least cosine between normals, and the farthest end from the plane at the other.
    let worst = |joined: u8| {
        let arcs = arcs(Signs { inside, joined, cut: 0 }, axis, 0);
        arcs.into_iter().flatten().try_fold((1.0_f64, 0.0_f64), |(cosine, away), ends| {
            let [(p, m), (q, n)] = [place(ends[0])?, place(ends[1])?];
            Some((cosine.min(m.dot(n)), away.max(m.dot(q - p).abs()).max(n.dot(q - p).abs())))
        })
    };
    worst(0)
        .zip(worst(1 << (2 * axis)))
        .is_some_and(|(apart, joined)| joined.0 > apart.0 && joined.1 < FLATTER * apart.1)
}

/// Returns the ambiguous faces across x and y of a layer and across z on top of it.
fn ambiguous(slab: &EdgeSlab, k: i32) -> Vec<Face> {
    let nodes = &slab.nodes;
    let mut found = Vec::new();
    let diagonal = |a: u64, b: u64, c: u64, d: u64| !(a ^ c) & !(b ^ d) & (a ^ b);
    for y in 0..nodes.rows() {
        let (low, high) = (nodes.row(y, k), nodes.row(y, k + 1));
        for word in 0..nodes.words() {
            let at = |bit: u32| (64 * word) as i32 + bit as i32;
            if y + 1 < nodes.rows() {
                let (low_next, high_next) = (nodes.row(y + 1, k), nodes.row(y + 1, k + 1));
                let across_x = diagonal(low[word], low_next[word], high_next[word], high[word]);
                found.extend(Ones(across_x).map(|bit| ([at(bit), y as i32, k], 0)));
            }
            let across_y = diagonal(low[word], after(low, word), after(high, word), high[word]);
            found.extend(Ones(across_y).map(|bit| ([at(bit), y as i32, k], 1)));
        }
    }
    for y in 0..nodes.rows() - 1 {
        let (row, above) = (nodes.row(y, k + 1), nodes.row(y + 1, k + 1));
        for word in 0..nodes.words() {
            let across_z = diagonal(row[word], after(row, word), after(above, word), above[word]);
            found.extend(Ones(across_z).map(|bit| ([(64 * word) as i32 + bit as i32, y as i32, k + 1], 2)));
        }
    }
    found
}

/// Returns which of some corners of a cell are inside, as bits.
fn nodes_inside(slab: &EdgeSlab, [x, y, z]: [i32; 3], corners: impl Iterator<Item = i32>) -> u8 {
    let corner = |c: i32| slab.is_inside([x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)]);
    corners.fold(0, |bits, c| bits | u8::from(corner(c)) << c)
}
