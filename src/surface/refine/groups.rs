//! The cells that finer ones replace: those around lost pairs of crossings, in groups.

use std::collections::{BTreeSet, HashMap};

use glam::DVec3;

use super::super::cuts::{Cuts, cells_around, edge_of};
use super::super::edges::{DroppedPair, Source};
use super::super::part::{CellMap, CellSet, Part};
use crate::cancel::checkpoint;
use crate::cell::{edge_between, face_corners, is_ambiguous};
use crate::parallel::*;
use crate::union_find::UnionFind;

/// Cells that are replaced together, and those beside them.
pub struct Group {
    pub cells: CellSet,
    pub beside: CellSet,
    /// The places of the dropped pairs in it.
    pub pairs: Vec<[DVec3; 2]>,
    /// How many of them are lost.
    pub lost: usize,
}

/// Returns the cells around a cell that share a face, an edge or a corner with it, and itself.
fn neighbours(cell: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(move |i| [cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 - 1])
}

/// Returns the cells around a cell that share a face with it, and itself.
fn neighbours_by_faces(cell: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    neighbours(cell).filter(move |other| (0..3).filter(|&i| cell[i] != other[i]).count() < 2)
}

/// Returns the cells that share a face or an edge with some, and are not among all that are replaced.
fn beside(cells: &CellSet, replaced: &CellSet) -> CellSet {
    let shares = |cell: [i32; 3], other: &[i32; 3]| (0..3).any(|i| cell[i] == other[i]);
    let of_cell = |&cell: &[i32; 3]| neighbours(cell).filter(move |other| shares(cell, other));
    cells.iter().flat_map(of_cell).filter(|cell| !replaced.contains(cell)).collect()
}

/// Returns the cells to be replaced around lost pairs, in groups that share no cell beside them.
pub fn groups(source: &Source, dropped: &[DroppedPair], lost: &[usize]) -> Vec<Group> {
    let cuts = Cuts::of_thin(source, Part::Whole);
    let around = lost.iter().flat_map(|&pair| {
        let (axis, node) = dropped[pair].edge();
        cells_around(axis, node).map(|(cell, _)| cell)
    });
    let mut cells: CellSet = around.flat_map(neighbours_by_faces).collect();
    // What is cut or ambiguous beside them is replaced, too; the more is replaced, the fewer faces beside it are whole.
    let mut beside_last: Vec<[i32; 3]> = beside(&cells, &cells).into_iter().collect();
    while !beside_last.is_empty() {
        checkpoint();
        let is_intricate = |&cell: &[i32; 3]| is_intricate(source, &cuts, &cells, cell);
        let more: CellSet = beside_last.into_par_iter().filter(is_intricate).collect::<Vec<_>>().into_iter().collect();
        cells.extend(&more);
        beside_last = beside(&more, &cells).into_iter().collect();
    }
    let sorted: Vec<[i32; 3]> = cells.iter().copied().collect::<BTreeSet<_>>().into_iter().collect();
    let number: CellMap<u32> = sorted.iter().copied().zip(0..).collect();
    let sets = UnionFind::new(sorted.len() as u32);
    for (&cell, own) in sorted.iter().zip(0..) {
        // Those before it in order.
        for i in 0..62 {
            let other = [cell[0] + i / 25 - 2, cell[1] + i / 5 % 5 - 2, cell[2] + i % 5 - 2];
            if let Some(&other) = number.get(&other) {
                sets.join(own, other);
            }
        }
    }
    let mut of_root: HashMap<u32, usize> = HashMap::new();
    let mut groups: Vec<CellSet> = Vec::new();
    for (&cell, own) in sorted.iter().zip(0..) {
        let group = *of_root.entry(sets.find(own)).or_insert_with(|| {
            groups.push(CellSet::default());
            groups.len() - 1
        });
        groups[group].insert(cell);
    }
    let mut groups: Vec<Group> = groups
        .into_par_iter()
        .map(|cells| Group { beside: beside(&cells, &cells), cells, pairs: Vec::new(), lost: 0 })
        .collect();
    let group_of = |pair: &DroppedPair| {
        let (axis, node) = pair.edge();
        cells_around(axis, node).iter().find_map(|(cell, _)| Some(of_root[&sets.find(*number.get(cell)?)]))
    };
    for pair in dropped {
        if let Some(group) = group_of(pair) {
            groups[group].pairs.push(pair.places());
        }
    }
    lost.iter().filter_map(|&pair| group_of(&dropped[pair])).for_each(|group| groups[group].lost += 1);
    groups
}

/// Returns whether a cell has cut edges, or an ambiguous face whose edges are all whole.
fn is_intricate(source: &Source, cuts: &Cuts, replaced: &CellSet, cell: [i32; 3]) -> bool {
    let inside = source.corners_inside(cell);
    let is_whole = |edge: usize| {
        let (axis, node) = edge_of(cell, edge);
        cells_around(axis, node).iter().all(|(cell, _)| !replaced.contains(cell))
    };
    let is_open = |face: usize| {
        let corners = face_corners(face / 2, face % 2);
        is_ambiguous(inside, face / 2, face % 2)
            && (0..4).all(|i| is_whole(edge_between(corners[i], corners[(i + 1) % 4])))
    };
    cuts.in_cell(cell).cut != 0 || (0..6).any(is_open)
}
