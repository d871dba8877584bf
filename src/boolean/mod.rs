//! Boolean operations on images: set expressions over any number of operands, evaluated ray by ray in one sweep.
//!
//! Intervals are half-open and stand for point sets: touching ones unite, empty ones vanish, and the result of any expression
//! lists the maximal spans of each ray with strictly increasing depths. In integers
//! |A| + |B| = |A ∪ B| + |A ∩ B|, to the last lattice step.
//!
//! # Evaluation of an expression
//! An [`Expression`] combines operands that it refers to by index; [`Expression::parse`] reads one from text. A [`Plan`]
//! compiles it for the sweep and lists the images it needs ([`Plan::leaves`]). [`Plan::sweep`] computes the result from those
//! images, without intermediate images: the samples of all operands on a ray are merged into one order, each toggles a leaf of
//! the expression, and where the root toggles with it the result has a sample.
//!
//! # Estimates
//! An over-estimate of A − B subtracts an under-estimate of B, one of A xor B is (A − B) ∪ (B − A) with both estimates of each.
//! So a [`Leaf`] is an input in a mode: the requested estimate or the opposite one. For each input a point is in both
//! estimates, in neither, or between them, where nothing is known. A pair of truth values carried through the expression keeps
//! these three cases apart (Kleene's logic), in time linear in the expression however xors nest.
//!
//! # Rays that matter
//! [`Expression::regions`] returns, for each input, the box outside of which it cannot change the result.

mod expression;
mod network;
mod parse;
mod plan;
mod region;
mod state;
mod sweep;
#[cfg(test)]
mod tests;
mod volume_bounds;

pub use expression::Expression;
pub use parse::{ExpressionError, Found};
pub use plan::{Leaf, Plan};
pub(crate) use state::State;
pub use sweep::Operand;
pub use volume_bounds::VolumeBounds;
pub(crate) use volume_bounds::box_volume;

pub use crate::diagram::Diagram;
use crate::grid::Axis;
use crate::ldi::{Ldi, Mode, TooManySamples};

/// An operation on point sets. More than two operands are taken from left to right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BooleanOperation {
    /// The points in all operands.
    Intersection,
    /// The points in any operand.
    Union,
    /// The points in the first operand and in none of the others.
    Difference,
    /// The points in an odd number of operands: of two, in exactly one.
    Xor,
}

impl BooleanOperation {
    /// Returns whether a point is in the result, given whether it is in each operand.
    #[inline]
    pub fn holds(self, in_a: bool, in_b: bool) -> bool {
        match self {
            BooleanOperation::Intersection => in_a & in_b,
            BooleanOperation::Union => in_a | in_b,
            BooleanOperation::Difference => in_a & !in_b,
            BooleanOperation::Xor => in_a ^ in_b,
        }
    }
}

/// The reason why images cannot be combined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BooleanError {
    /// The images have different rays.
    #[error("the images lie on different rays: along {first} at pitch {first_pitch} and along {second} at pitch {second_pitch}",
        first = first.name(), second = second.name())]
    RaysDiffer {
        /// Direction of the first image.
        first: Axis,
        /// Pitch of its grid.
        first_pitch: f64,
        /// Direction of the first image that differs from it.
        second: Axis,
        /// Pitch of its grid.
        second_pitch: f64,
    },
    /// The triangles of all inputs together cannot be numbered in 32 bits.
    #[error("triangle {triangle} of input {input}, counted from {first}, exceeds the limit of {limit} triangles in all inputs", limit = u32::MAX)]
    TooManyTriangles {
        /// Index of the input.
        input: usize,
        /// The number of the input's first triangle.
        first: u32,
        /// The triangle's number within the input.
        triangle: u32,
    },
    /// The result is too large.
    #[error(transparent)]
    TooManySamples(#[from] TooManySamples),
}

/// Returns the result of an operation on two images of the same rays. A ray that is unclosed in either operand is unclosed in
/// the result. This is [`Plan::sweep`] for two images.
pub fn merge(operation: BooleanOperation, a: &Ldi, b: &Ldi) -> Result<Ldi, BooleanError> {
    let expression = Expression::of_inputs(operation, 2);
    Plan::new(&expression, Mode::Exact).sweep(&[Operand::from(a), Operand::from(b)])
}
