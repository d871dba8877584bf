//! What holds of every image, whatever the solid: nesting of the three modes, the algebra of sets, the same bits however
//! the work is divided, shifts and scales; and the right volume where a closed form tells it, degenerate meshes included.
//!
//! Nothing here knows how a sampler works. The oracle test says what every sample must be; these say what must be true of
//! all of them together, on solids too large for the oracle as well.

mod algebra;
mod closed_forms;
mod conservative;
mod degeneracies;
mod expressions;
mod images;
mod invariance;
mod material;
mod nodes;
#[path = "../oracle/soups.rs"]
mod soups;
