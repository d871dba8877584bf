//! Exact point membership in A ⊕ B, from the two solids alone.
//!
//! x ∈ A ⊕ B ⇔ A ∩ B′ ≠ ∅ with B′ = x − B, the second solid reflected and moved to the point. Two solids meet if and only if
//! their boundaries cross, or one of them has a whole shell of the other inside. So three tests decide:
//!
//! 1. Does any triangle of A cross any of B′? All pairs are tested by a descent through two hierarchies of boxes at once
//!    ([`tree`]), which ends at the first pair that crosses.
//! 2. Does a vertex of B′ lie in A? One vertex of each shell suffices, since where nothing crosses, a shell is on one side as a
//!    whole.
//! 3. Does a vertex of A lie in B′?
//!
//! Any positive answer proves that the point is in. Points in doubt lie close to one another, so that the pair that crossed
//! last often crosses again; it is tested first.
//!
//! **Exactness** ([`predicates`]). The point stands for x + ε with ε₁ ≫ ε₂ ≫ ε₃ > 0, a movement of B′ as a whole. Every sign
//! that the tests need is of n·(d + ε), n a normal or a product of two edges, and d a difference of positions: where n·d is 0,
//! the first component of n that is not 0 decides, and where all are 0, the test would concern a triangle without area or
//! parallel edges, and does not arise. Since ε is one and the same small movement in all signs, they are those of solids in
//! general position, and are consistent without further rules. Signs are taken from `f64` where its error bound proves them
//! right, and from integers of 128 bits otherwise.
//!
//! **Inside.** The winding number is not 0: shells that overlap unite, and inverted ones are cavities. Walls that rounding has
//! left without thickness, and needles without area, are part of the solid, as they are of the primitives. For a complement
//! ([`Exterior::In`](super::Exterior::In)) everything outside the solid is inside; there, shells may be nested but must not overlap,
//! since a wall between two of them bounds no complement.

pub mod predicates;
mod probe;
mod shells;
mod sum;
#[cfg(test)]
mod tests;
pub mod tree;

pub use probe::{Shell, SumProbe};
pub use sum::{SumMembership, SumMemory};
