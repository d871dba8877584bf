//! What a ball reaches from outside, and the largest that spans the region.
//!
//! # Bottlenecks
//! The largest ball that gets to a place is that of the widest way there: of all paths from outside, the one whose
//! narrowest place is widest. What is narrowest on the widest way is found for all nodes at once by a flood in which the
//! widest node that was met goes on first (a Dijkstra search in which lengths do not add up but the least counts; the
//! minimax path of Pollack, 1960). With radii in steps of 1/64 of a pitch each node is put into a queue and taken from it
//! once, in O(1). No sphere is dilated and no map is thresholded radius by radius, as where porosimetry is simulated size
//! by size.
//!
//! A node stands for its cell: its radius is that of the largest ball whose centre lies in the cell, which is what
//! [`thickness`](super::thickness) finds, not the distance at the node. With distances at nodes a window whose middle falls
//! between four rays would seem narrower by more than a pitch. Steps go to the 26 neighbours, but never from one
//! 6-connected piece of the pores to another, so that what is closed stays closed.
//!
//! # Access
//! M. J. Moore, E. Jabbari, E. L. Ritman, L. Lu, B. L. Currier, A. J. Windebank, M. J. Yaszemski, Quantitative analysis of
//! interconnectivity of porous biodegradable scaffolds with micro-computed tomography, J. Biomed. Mater. Res. A 71 (2004)
//! 258–267: the share of the pores' volume that a ball of diameter d, moving in from outside, sweeps over, as a curve A(d).
//! Here each point of the pores has an access size, the diameter of the largest ball from outside that covers it: the
//! balls of the local thickness are [lowered](lower) to what gets to their centres, painted again, and A(d) is the share of
//! sizes that are at least d. So it falls monotonically by its making, and A(0) is the open share of the pores.
//!
//! # Percolation
//! The largest ball that gets from one end of the region to the other (the percolation diameter of bone research: M. Nair,
//! J. H. Shepherd, S. M. Best, R. E. Cameron, MicroCT analysis of connectivity in porous structures, J. R. Soc. Interface 17
//! (2020) 20190833), and where it is stopped.
//!
//! # Faces
//! What comes from outside comes through the faces of the region, so radii for [`bottlenecks`] must not take those faces for
//! walls.

mod curve;
mod ends;
mod flood;
mod percolation;
mod queue;
pub(in crate::metrics) mod steps;
#[cfg(test)]
mod tests;

pub use curve::AccessCurve;
pub use ends::{Ends, boundary};
pub use flood::{bottlenecks, lower, reached};
pub use percolation::{Percolation, percolation};
