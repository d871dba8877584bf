//! Tortuosity: the lengthening of paths through a phase, and the slowing of diffusion.
//!
//! Both are for a phase in a box that is the whole raster, from its face across an axis to the opposite one.
//!
//! # Geodesic tortuosity
//! The mean, over the nodes of the far face, of the length of the shortest path within the phase from the near face, divided by
//! the straight distance. A path may turn anywhere, not only at nodes: lengths are the solution of |∇T| = 1 by J. A. Sethian's
//! fast marching (A fast marching level set method for monotonically advancing fronts, PNAS 93 (1996) 1591–1595), on the 48
//! tetrahedra that a node makes with its 26 neighbours instead of the usual 8 with the 6. On those, plane fronts of *every*
//! direction are exact, and a front that enters a staircase of nodes need not follow its steps.
//!
//! # Diffusive tortuosity
//! τ = φ D₀ / D_eff, where φ is the share of the box in pieces of the phase that reach from face to face, without closed and
//! blind pieces, and D_eff is the diffusivity of the box when its two faces are held at two concentrations and its others are
//! impermeable. Nodes are cells of a pitch, between which a difference of concentration of 1 drives a flux of 1. This is the
//! tortuosity that some call its factor or its square; for a straight duct at angle θ it is 1/cos²θ, where the geodesic one is
//! 1/cos θ. The formation factor is D₀ / D_eff.
//!
//! Conjugate gradients are preconditioned by aggregation multigrid in which each coarser level is solved by up to two conjugate
//! gradient steps of its own (the K-cycle: Y. Notay, P. S. Vassilevski, Recursive Krylov-based multigrid cycles, Numer. Linear
//! Algebra Appl. 15 (2008) 473–487). Aggregates are the connected parts of blocks of 2 × 2 × 2, so that the levels keep
//! separate pores separate, down to the last, where each piece of the phase is one unknown and only a division remains. The
//! multigrid is in f32; residuals, solution and sums in f64.

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

/// The reason why a tortuosity could not be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TortuosityError {
    /// The raster is too thin for a distance between its ends.
    #[error("{nodes} nodes along {axis}; at least {least} are needed", axis = axis.name())]
    TooThin {
        /// The axis from end to end.
        axis: Axis,
        /// Nodes along the axis.
        nodes: usize,
        /// The least number of nodes.
        least: usize,
    },
    /// A tolerance that cannot be reached or is too large.
    #[error("the tolerance {tolerance:e} of diffusion is outside {least:e} to {most:e}")]
    Tolerance {
        /// The requested tolerance.
        tolerance: f64,
        /// The least possible tolerance.
        least: f64,
        /// The greatest useful tolerance.
        most: f64,
    },
    /// The error stayed too large.
    #[error(
        "no convergence after {iterations} iterations: the relative error is {error:e}, the tolerance {tolerance:e}"
    )]
    NotConverged {
        /// The limit of iterations.
        iterations: usize,
        /// The estimated error of the diffusivity, over itself.
        error: f64,
        /// The requested tolerance.
        tolerance: f64,
    },
    /// The fluxes in and out differ.
    #[error(
        "Internal check failed: the flux in, {into}, and the flux out, {out}, differ by more than {limit:e} of it. Please report this"
    )]
    Flux {
        /// Through the near face.
        into: f64,
        /// Through the far face.
        out: f64,
        /// The greatest difference, relative to the flux that enters.
        limit: f64,
    },
}
