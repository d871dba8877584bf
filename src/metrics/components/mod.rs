//! The connected pieces of a set of nodes, and the open pores.
//!
//! # Method
//! Consecutive nodes along x form a *run*. Runs of neighbouring rows that overlap belong to one piece, and a second pass
//! numbers the pieces (Wu, Otoo and Suzuki, "Optimizing two-pass connected-component labeling algorithms", Pattern Analysis and
//! Applications 12, 2009; He, Chao and Suzuki, "A run-based two-scan labeling algorithm", IEEE Transactions on Image Processing
//! 17, 2008). Runs are found 64 nodes at a time and joined by all threads in parallel; the memory is that of the runs, 16 bytes
//! each, not that of the nodes.
//!
//! # Neighbours
//! The solid is taken with 26 neighbours ([`Connectivity::All`]) and pores with 6 ([`Connectivity::Faces`]): then a connection
//! of one separates the other, as in the continuum, and the numbers agree with the Euler characteristic
//! ([`euler`](super::euler)).
//!
//! # Periodic cells
//! With [`BoundaryCondition::Periodic`] the raster is one cell: nodes of opposite faces are neighbours. A piece may then meet
//! its own image in another cell, and so be endless; [`Components::directions`] counts the independent directions.

mod lattice;
mod pores;
mod runs;

use std::sync::atomic::{AtomicBool, Ordering};

use crate::parallel::*;

use self::lattice::{Displaced, Windings};
use self::runs::Runs;
use super::{BoundaryCondition, NodeSet};
use crate::cancel::checkpoint;
use crate::union_find::UnionFind;

pub use pores::{open_pores, rim};

/// The neighbourhood of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Connectivity {
    /// The 6 whose cubes share a face.
    Faces,
    /// The 26 whose cubes share a face, an edge or a corner.
    All,
}

impl Connectivity {
    /// Returns the connectivity of the complement that is consistent with this one.
    pub const fn dual(self) -> Connectivity {
        match self {
            Connectivity::Faces => Connectivity::All,
            Connectivity::All => Connectivity::Faces,
        }
    }

    /// Returns the greatest distance along x at which runs of neighbouring rows are connected.
    fn reach(self) -> u32 {
        match self {
            Connectivity::Faces => 0,
            Connectivity::All => 1,
        }
    }

    /// Returns the rows with neighbours of a row, along y and z; with their opposites they are all.
    fn rows(self) -> &'static [[isize; 2]] {
        match self {
            Connectivity::Faces => &[[-1, 0], [0, -1]],
            Connectivity::All => &[[-1, 0], [0, -1], [-1, -1], [1, -1]],
        }
    }
}

/// The connected pieces of a set of nodes.
///
/// Pieces are numbered from 0 in the order of their first nodes, x running fastest.
#[derive(Clone, Debug)]
pub struct Components {
    size: [usize; 3],
    runs: Runs,
    /// The piece of each run.
    labels: Vec<u32>,
    sizes: Vec<u64>,
    /// The windings of each piece; empty where the raster is not periodic.
    windings: Vec<Windings>,
}

impl Components {
    /// Finds the pieces of a set. Nodes of opposite faces of the raster are neighbours with [`BoundaryCondition::Periodic`]
    /// only.
    pub fn of(set: &NodeSet, connectivity: Connectivity, edges: BoundaryCondition) -> Components {
        let size = set.size();
        let runs = Runs::of(set);
        let union_find = UnionFind::new(runs.count());
        let (reach, rows) = (connectivity.reach(), connectivity.rows());
        (0..size[2]).into_par_iter().for_each(|z| {
            checkpoint();
            for y in 0..size[1] {
                for &step in rows {
                    if let (other, [0, 0]) = neighbour(size, [y, z], step) {
                        runs.overlapping(z * size[1] + y, other, reach, |a, b| union_find.join(a, b));
                    }
                }
            }
        });
        let (labels, count) = numbered(&union_find.roots());
        let (labels, windings) = match edges {
            BoundaryCondition::Clip | BoundaryCondition::Border => (labels, Vec::new()),
            BoundaryCondition::Periodic => joined_across_faces(size, &runs, labels, count, connectivity),
        };
        let count = labels.iter().max().map_or(0, |&most| most as usize + 1);
        let mut sizes = vec![0; count];
        for (run, &label) in runs.all().iter().zip(&labels) {
            sizes[label as usize] += run.length();
        }
        Components { size, runs, labels, sizes, windings }
    }

    /// Returns the number of pieces.
    pub fn count(&self) -> usize {
        self.sizes.len()
    }

    /// Returns the number of nodes of each piece.
    pub fn sizes(&self) -> &[u64] {
        &self.sizes
    }

    /// Returns the piece with the most nodes, the first of several; `None` for an empty set.
    pub fn largest(&self) -> Option<u32> {
        let most = *self.sizes.iter().max()?;
        self.sizes.iter().position(|&size| size == most).map(|label| label as u32)
    }

    /// Returns the largest piece's share of all nodes of the set; `None` for an empty set.
    pub fn largest_share(&self) -> Option<f64> {
        let largest = self.largest()?;
        Some(self.sizes[largest as usize] as f64 / self.sizes.iter().sum::<u64>() as f64)
    }

    /// Returns the piece that a node belongs to; `None` for a node outside the set.
    pub fn piece_of(&self, [x, y, z]: [usize; 3]) -> Option<u32> {
        self.runs.at(z * self.size[1] + y, x as u32).map(|run| self.labels[run as usize])
    }

    /// Returns the number of independent directions in which a piece meets its own images: 0 for a finite one, 3 for one that
    /// is endless in all. 0 where the raster is not periodic.
    pub fn directions(&self, piece: u32) -> usize {
        self.windings.get(piece as usize).map_or(0, Windings::rank)
    }

    /// Returns the number of independent directions in which pieces meet their own images, for all pieces together.
    pub fn all_directions(&self) -> usize {
        let mut all = Windings::default();
        self.windings.iter().for_each(|windings| all.extend(windings));
        all.rank()
    }

    /// Returns for each piece whether one of its nodes belongs to another set.
    ///
    /// # Panics
    /// If the set is of a raster of another size.
    pub fn touched_by(&self, set: &NodeSet) -> Vec<bool> {
        assert_eq!(set.size(), self.size, "sets of nodes of one raster");
        let touched: Vec<AtomicBool> = self.sizes.iter().map(|_| AtomicBool::new(false)).collect();
        self.runs.rows().into_par_iter().with_min_len(256).for_each(|row| {
            let words = set.row(row % self.size[1], row / self.size[1]);
            for run in self.runs.row(row) {
                if self.runs.get(run).masks().any(|(word, mask)| words[word] & mask != 0) {
                    touched[self.labels[run as usize] as usize].store(true, Ordering::Relaxed);
                }
            }
        });
        touched.into_iter().map(AtomicBool::into_inner).collect()
    }

    /// Returns the nodes of the pieces for which `belongs` is true.
    pub fn nodes(&self, belongs: impl Fn(u32) -> bool + Sync) -> NodeSet {
        let mut set = NodeSet::empty(self.size);
        for row in self.runs.rows() {
            let words = set.row_mut(row % self.size[1], row / self.size[1]);
            for run in self.runs.row(row).filter(|&run| belongs(self.labels[run as usize])) {
                self.runs.get(run).masks().for_each(|(word, mask)| words[word] |= mask);
            }
        }
        set
    }
}

/// Returns the nodes of all pieces of a set that have a node among `from`.
///
/// # Panics
/// If the sets are of rasters of different sizes.
pub fn reached(set: &NodeSet, connectivity: Connectivity, edges: BoundaryCondition, from: &NodeSet) -> NodeSet {
    let pieces = Components::of(set, connectivity, edges);
    let touched = pieces.touched_by(from);
    pieces.nodes(|piece| touched[piece as usize])
}

/// Returns the row a step along y and z away, and the number of cells crossed along y and z where the raster is periodic.
fn neighbour(size: [usize; 3], [y, z]: [usize; 2], [dy, dz]: [isize; 2]) -> (usize, [i64; 2]) {
    let along = |at: usize, step: isize, count: usize| {
        let (at, count) = (at as isize + step, count as isize);
        (at.rem_euclid(count) as usize, at.div_euclid(count) as i64)
    };
    let ((y, cells_y), (z, cells_z)) = (along(y, dy, size[1]), along(z, dz, size[2]));
    (z * size[1] + y, [cells_y, cells_z])
}

/// Numbers roots from 0, in ascending order, and returns the labels with their count.
fn numbered(roots: &[u32]) -> (Vec<u32>, u32) {
    let mut labels = vec![0; roots.len()];
    let mut count = 0;
    for (at, &root) in roots.iter().enumerate() {
        // A root is the lowest of its set, so it has been numbered before all other elements of the set.
        if root as usize == at {
            labels[at] = count;
            count += 1;
        } else {
            labels[at] = labels[root as usize];
        }
    }
    (labels, count)
}

/// Joins pieces that meet across the faces of the cell. Returns the labels of runs and the windings of pieces.
fn joined_across_faces(
    size: [usize; 3],
    runs: &Runs,
    labels: Vec<u32>,
    count: u32,
    connectivity: Connectivity,
) -> (Vec<u32>, Vec<Windings>) {
    let mut pieces = Displaced::new(count);
    let label = |run: u32| labels[run as usize];
    let far = size[0] as u32 - u32::from(size[0] > 0);
    for row in runs.rows().filter(|&row| !runs.row(row).is_empty()) {
        let at = [row % size[1], row / size[1]];
        let own = runs.row(row);
        for &step in [[0, 0]].iter().chain(connectivity.rows()) {
            let (other, [cells_y, cells_z]) = neighbour(size, at, step);
            if [cells_y, cells_z] != [0, 0] {
                let cells = [0, cells_y, cells_z];
                runs.overlapping(row, other, connectivity.reach(), |a, b| pieces.meet(label(a), label(b), cells));
            }
            let others = runs.row(other);
            if others.is_empty() || (step != [0, 0] && connectivity == Connectivity::Faces) {
                continue;
            }
            // The ends of rows: the last node beside the first of the next cell, and the first beside the last.
            let (first, last) = (own.start, own.end - 1);
            let (other_first, other_last) = (others.start, others.end - 1);
            if runs.get(last).last == far && runs.get(other_first).first == 0 {
                pieces.meet(label(last), label(other_first), [1, cells_y, cells_z]);
            }
            if runs.get(first).first == 0 && runs.get(other_last).last == far {
                pieces.meet(label(first), label(other_last), [-1, cells_y, cells_z]);
            }
        }
    }
    let roots: Vec<u32> = (0..count).map(|piece| pieces.find(piece).0).collect();
    let (of_pieces, _) = numbered(&roots);
    let windings = (0..count).filter(|&piece| roots[piece as usize] == piece).map(|root| pieces.windings(root).clone());
    let windings = windings.collect();
    (labels.into_iter().map(|label| of_pieces[label as usize]).collect(), windings)
}

#[cfg(test)]
mod tests;
