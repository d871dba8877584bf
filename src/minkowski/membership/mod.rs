//! Whether a point is in A ⊕ B, exactly, from the two solids alone.
//!
//! x ∈ A ⊕ B ⇔ A ∩ B′ ≠ ∅ with B′ = x − B, the second solid reflected and moved to the point. Two solids meet if and only if
//! their boundaries cross, or one of them has a whole shell of the other inside. So three questions decide:
//!
//! 1. Does any triangle of A cross any of B′? All pairs are asked by a descent through two hierarchies of boxes at once
//!    ([`tree`]), which ends at the first pair that does.
//! 2. Does a vertex of B′ lie in A: one of each shell, for where nothing crosses, a shell is on one side as a whole?
//! 3. Does a vertex of A lie in B′?
//!
//! Any yes proves that the point is in. Points in doubt lie close to one another, so that the pair that crossed last often
//! crosses again; it is asked first.
//!
//! **Exactness** ([`predicates`]). The point stands for x + ε with ε₁ ≫ ε₂ ≫ ε₃ > 0, a movement of B′ as a whole. Every sign
//! that the questions need is of n·(d + ε), n a normal or a product of two edges, and d a difference of positions: where n·d
//! is 0, the first component of n that is not 0 decides, and where all are 0, the question would have to be about a triangle
//! without area or about edges that are parallel, and does not come up. Since ε is one and the same small movement in all
//! signs, they are those of solids in general position, and need no rules to agree with one another. Signs are taken from
//! `f64` where its error bound proves them right, and from integers of 128 bits where not.
//!
//! **What counts as inside.** The winding number is not 0: shells that overlap unite, and inverted ones are cavities. Walls
//! that rounding has left without thickness, and needles without area, are part of the solid, as they are of the primitives.
//! Of a complement ([`Outer::In`](super::Outer::In)) all that the solid leaves is inside; there, shells may lie in one another
//! but must not overlap, since a wall between two of them bounds no complement.

pub mod predicates;
mod shells;
mod sum;
#[cfg(test)]
mod tests;
pub mod tree;

pub use sum::{SumMembership, SumMemory};
