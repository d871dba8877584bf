//! How much longer paths through a phase are than straight ones, and how much slower diffusion is.
//!
//! Both are of a phase in a box that is the whole raster, from its face across an axis to the opposite one.
//!
//! # Geodesic tortuosity
//! The mean, over the nodes of the far face, of the length of the shortest path within the phase from the near face,
//! divided by the straight distance. A path may turn anywhere, not only at nodes: lengths are the solution of |∇T| = 1 by
//! J. A. Sethian's fast marching (A fast marching level set method for monotonically advancing fronts, PNAS 93 (1996)
//! 1591–1595), on the 48 tetrahedra that a node makes with its 26 neighbours instead of the usual 8 with the 6. On those, plane
//! fronts of *every* direction are exact, and a front that enters a staircase of nodes need not walk along its steps.
//!
//! # Diffusive tortuosity
//! τ = φ D₀ / D_eff, where φ is the share of the box that is of pieces of the phase which reach from face to face, closed and
//! blind pieces left out, and D_eff is what diffuses through the box when its two faces are held at two concentrations and
//! its others let nothing pass. Nodes are cells of a pitch, between which a difference of concentration of 1 drives a flux of 1.
//! This is the tortuosity that some call its factor or its square; for a straight duct at angle θ it is 1/cos²θ, where the
//! geodesic one is 1/cos θ. The formation factor is D₀ / D_eff.
//!
//! Conjugate gradients are preconditioned by aggregation multigrid in which each coarser level is solved by up to two
//! conjugate gradient steps of its own (the K-cycle: Y. Notay, P. S. Vassilevski, Recursive Krylov-based multigrid cycles,
//! Numer. Linear Algebra Appl. 15 (2008) 473–487). Aggregates are the connected parts of blocks of 2 × 2 × 2, so that the
//! levels know which pores are apart, down to the last, where each piece of the phase is one unknown and nothing remains
//! but a division. The multigrid is in f32; residuals, solution and sums in f64.

mod aggregate;
mod cycle;
mod diffusion;
mod geodesic;
mod krylov;
mod operator;
mod spanning;
mod sums;
#[cfg(test)]
mod tests;

pub use diffusion::{Diffusion, EndCondition, diffusive};
pub use geodesic::geodesic;

use crate::grid::Axis;

/// Why a tortuosity could not be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TortuosityError {
    /// The raster is too thin for a distance between its ends.
    #[error("{nodes} nodes along {axis}; {least} are needed", axis = axis.name())]
    TooThin {
        /// From end to end.
        axis: Axis,
        /// Nodes along the axis.
        nodes: usize,
        /// How many there must be.
        least: usize,
    },
    /// A residual that cannot be reached.
    #[error("a residual of {tolerance:e} was asked for; from {least:e} to {most:e} are possible")]
    Tolerance {
        /// What was asked for.
        tolerance: f64,
        /// The least that can be.
        least: f64,
        /// The most that makes sense.
        most: f64,
    },
    /// The residual stayed too large.
    #[error(
        "after {iterations} iterations the residual is {residual:e} of the right-hand side; {tolerance:e} was asked for"
    )]
    NotConverged {
        /// As many as there may be.
        iterations: usize,
        /// The norm of the residual over that of the right-hand side.
        residual: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// What goes in is not what comes out.
    #[error("a flux of {into} enters and {out} leaves: they differ by more than {limit:e} of it")]
    Flux {
        /// Through the near face.
        into: f64,
        /// Through the far face.
        out: f64,
        /// By how much they may differ, over what enters.
        limit: f64,
    },
}
