//! Surfaces made from images: they are manifold, keep sharp edges, and contain exactly the nodes that they were made from.

mod crossings;
mod sampled;
mod shapes;
mod simplified;
mod sums;
#[path = "../../src/testing/mod.rs"]
mod testing;
mod topology;
