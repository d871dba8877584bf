//! The Euler characteristic χ, Betti numbers, and connectivity density.
//!
//! # From nodes
//! A node stands for the closed cube of one pitch around it. The union of cubes has χ = V − E + F − C: corners, edges, faces
//! and cubes, each counted once however many cubes share it. Along a row of corners one more corner than cubes lies on each run
//! of cubes, and likewise for edges, faces and cubes, so that all four counts together are a count of *runs*: with the four
//! rows of cubes a, b, c, d around a row of edges,
//!
//! χ = Σ runs(a ∪ b ∪ c ∪ d) − runs(b ∪ d) − runs(c ∪ d) + runs(d),
//!
//! where b and c are d's neighbours and a lies across. Runs are counted 64 nodes at a time, as bits whose lower neighbour is
//! not set. The solid of 26 neighbours ([`Connectivity::All`]) is this union; that of 6 ([`Connectivity::Faces`]), which the
//! pores are, has χ = nodes − pairs + squares − cubes of neighbouring nodes, which is the same formula with ∩ for ∪. In a
//! periodic cell ([`BoundaryCondition::Periodic`]) opposite faces are identified, rows are rings, and a full ring has no run.
//!
//! # Betti numbers
//! β₀ counts pieces, β₂ cavities, and β₁, the tunnels, follows from χ = β₀ − β₁ + β₂. A cavity is a piece of the complement, in
//! the other connectivity, that does not reach the outside of the raster. In a periodic cell there is no outside: by duality in
//! the 3-torus β₂ is one less than the pieces of the complement, plus one for each direction in which no piece of the
//! complement is endless (a wall across the cell encloses nothing and yet separates).
//!
//! # Connectivity density
//! A sample cut from a larger structure has ends that the structure has not. Odgaard and Gundersen ("Quantification of
//! connectivity in cancellous bone, with special emphasis on 3-D reconstructions", Bone 14, 1993) weight the faces of the
//! sample by a half, its edges by a quarter and its corners by an eighth, as adjacent samples share them: see [`contribution`].
//! Then Conn.D = (1 − Δχ) / TV.
//!
//! # From a mesh
//! The surface of a solid has twice its χ ([`SurfaceCharacteristic`]).

mod region;
mod surface;

use crate::parallel::*;

use super::components::{Components, Connectivity};
use super::{BoundaryCondition, NodeSet};
use crate::cancel::checkpoint;

pub use region::{Topology, contribution};
pub use surface::SurfaceCharacteristic;

/// Returns χ of a set of nodes.
pub fn characteristic(set: &NodeSet, connectivity: Connectivity, edges: BoundaryCondition) -> i64 {
    let [columns, rows, planes] = set.size();
    if set.volume() == 0 {
        return 0;
    }
    let none = vec![0; set.words()];
    // The row at (y − 1, z − 1), counted from 0, so that 0 and the one after the last lie outside, or at the other end.
    let row = |y: usize, z: usize| match edges {
        BoundaryCondition::Periodic => set.row((y + rows - 1) % rows, (z + planes - 1) % planes),
        BoundaryCondition::Clip | BoundaryCondition::Border if (1..=rows).contains(&y) && (1..=planes).contains(&z) => {
            set.row(y - 1, z - 1)
        }
        BoundaryCondition::Clip | BoundaryCondition::Border => &none,
    };
    let combine: fn(u64, u64) -> u64 = match connectivity {
        Connectivity::All => |a, b| a | b,
        Connectivity::Faces => |a, b| a & b,
    };
    let last = match edges {
        BoundaryCondition::Periodic => [rows, planes],
        BoundaryCondition::Clip | BoundaryCondition::Border => [rows + 1, planes + 1],
    };
    let of_plane = |z: usize| -> i64 {
        checkpoint();
        let of_row = |y: usize| {
            let around = [row(y - 1, z - 1), row(y, z - 1), row(y - 1, z), row(y, z)];
            let by_word = |word: usize| {
                let [a, b, c, d] = around.map(|row| row[word]);
                [combine(combine(a, b), combine(c, d)), combine(b, d), combine(c, d), d]
            };
            let mut before = match edges {
                BoundaryCondition::Periodic => by_word((columns - 1) / 64).map(|word| word >> ((columns - 1) % 64) & 1),
                BoundaryCondition::Clip | BoundaryCondition::Border => [0; 4],
            };
            let mut runs = [0; 4];
            for word in 0..set.words() {
                let words = by_word(word);
                for i in 0..4 {
                    runs[i] += i64::from((words[i] & !(words[i] << 1 | before[i])).count_ones());
                    before[i] = words[i] >> 63;
                }
            }
            runs[0] - runs[1] - runs[2] + runs[3]
        };
        (1..=last[0]).map(of_row).sum()
    };
    (1..last[1] + 1).into_par_iter().map(of_plane).sum()
}

/// The numbers of pieces, tunnels and cavities of a set: β₀, β₁ and β₂.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Betti {
    /// β₀: connected pieces.
    pub pieces: u64,
    /// β₁: independent loops that the set does not fill.
    pub tunnels: u64,
    /// β₂: cavities; in a periodic cell also separating surfaces that enclose nothing.
    pub cavities: u64,
}

impl Betti {
    /// Computes the Betti numbers of a set of nodes.
    pub fn of(set: &NodeSet, connectivity: Connectivity, edges: BoundaryCondition) -> Betti {
        let pieces = Components::of(set, connectivity, edges).count() as u64;
        Betti::of_pieces(set, pieces, connectivity, edges)
    }

    /// Computes the same for a set whose pieces are known.
    fn of_pieces(set: &NodeSet, pieces: u64, connectivity: Connectivity, edges: BoundaryCondition) -> Betti {
        let rest = NodeSet::full(set.size()).minus(set);
        let of_rest = Components::of(&rest, connectivity.dual(), edges);
        let (cavities, filled) = match edges {
            BoundaryCondition::Clip | BoundaryCondition::Border => {
                let outer = of_rest.touched_by(&super::components::rim(&NodeSet::full(set.size())));
                (outer.iter().filter(|&&is_outer| !is_outer).count(), 0)
            }
            // All of the 3-torus, whose own Betti numbers are 1, 3, 3, 1.
            BoundaryCondition::Periodic if of_rest.count() == 0 && pieces > 0 => (3, 1),
            BoundaryCondition::Periodic if pieces == 0 => (0, 0),
            BoundaryCondition::Periodic => (of_rest.count() - 1 + 3 - of_rest.all_directions(), 0),
        };
        let tunnels = pieces as i64 + cavities as i64 - filled - characteristic(set, connectivity, edges);
        Betti { pieces, tunnels: tunnels as u64, cavities: cavities as u64 }
    }
}

#[cfg(test)]
mod tests;
