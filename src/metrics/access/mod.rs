//! Access of balls from outside, and percolation: the largest ball that spans the region.
//!
//! # Bottlenecks
//! The largest ball that reaches a point is limited by the widest path there: of all paths from outside, the one whose
//! narrowest point is widest (the minimax path of M. Pollack, 1960). For all nodes at once it follows from those of the local
//! maxima of the radius, of which there are few (`basins`). No sphere is dilated and no map is thresholded radius by radius, as
//! in simulations of porosimetry size by size. Where only one path is needed, and not the bottlenecks of all nodes, a flood
//! proceeds from the widest node that it met, in levels of 1/64 of a pitch, until it arrives.
//!
//! A node stands for its cell: its radius is that of the largest ball whose centre lies in the cell, which
//! [`thickness`](super::thickness) finds, not the distance at the node. With distances at nodes a window whose middle falls
//! between four rays would seem narrower by more than a pitch. Steps go to the 26 neighbours, but never from one 6-connected
//! piece of the pores to another, so that closed pores stay closed.
//!
//! # Access
//! M. J. Moore, E. Jabbari, E. L. Ritman, L. Lu, B. L. Currier, A. J. Windebank, M. J. Yaszemski, Quantitative analysis of
//! interconnectivity of porous biodegradable scaffolds with micro-computed tomography, J. Biomed. Mater. Res. A 71 (2004)
//! 258–267: the share of the pores' volume that a ball of diameter d, moving in from outside, sweeps over, as a curve A(d).
//! Here each point of the pores has an access size, the diameter of the largest ball from outside that covers it: 2 · max {
//! b(c) : |p − c| ≤ b(c) } over centres c with bottlenecks b. A ball that reaches the centre of one of the balls of the local
//! thickness can go anywhere inside it that it fits; so those balls are painted again at their full radius, but with a size
//! limited by the bottleneck at their centres ([`access_sizes`]). A(d) is the share of sizes that are at least d
//! ([`AccessCurve`]): it is monotonic by construction, and A(0) is the open share of the pores.
//!
//! # Percolation
//! The largest ball that passes from one end of the region to the other (the percolation diameter of bone research: M. Nair, J.
//! H. Shepherd, S. M. Best, R. E. Cameron, MicroCT analysis of connectivity in porous structures, J. R. Soc. Interface 17
//! (2020) 20190833), and the position of its bottleneck.
//!
//! # Faces
//! Balls from outside enter through the faces of the region, so radii for [`bottlenecks`] must not treat those faces as walls.

mod basins;
mod curve;
mod ends;
mod flood;
mod percolation;
mod queue;
pub(in crate::metrics) mod steps;
#[cfg(test)]
mod tests;

pub use curve::AccessCurve;
pub use ends::Ends;
pub use flood::{access_sizes, bottlenecks};
pub(crate) use percolation::percolation_between_walls;
pub use percolation::{Percolation, percolation};
