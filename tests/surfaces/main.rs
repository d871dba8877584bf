//! Surfaces made from images: manifold, sharp, true to the nodes they were made from.

mod crossings;
mod sampled;
mod shapes;
mod topology;
