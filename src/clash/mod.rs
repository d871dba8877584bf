//! The geometry of clashes: which bodies come near one another, how far apart they are, and where they overlap.
//!
//! [`near_pairs`] compares boxes, and [`tiles`] groups the pairs by place; [`nearest`] finds the distance of two surfaces,
//! through hierarchies of boxes, and 0 where triangles meet by exact signs; [`Body::contains`] tells which body holds which shell
//! where no triangles meet; [`region`] finds the box of an overlap and the largest ball in it. Volumes are for the driver.

mod body;
mod nearest;
mod overlap;
mod pairs;
mod real;
#[cfg(test)]
mod tests;
mod tiles;
mod triangles;

pub use body::Body;
pub use nearest::nearest;
pub use overlap::{Region, region};
pub use pairs::near_pairs;
pub use tiles::tiles;
pub use triangles::Nearest;

/// Returns the bytes that a body holds for each triangle of its mesh.
pub fn bytes_of_triangle() -> f64 {
    crate::box_tree::BoxTree::bytes_of_triangle()
}
