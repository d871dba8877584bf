//! Vertices at edges, corners and pinches of a surface.

use glam::{DVec3, Vec3};

/// A vertex that is not just one of a gently bent sheet, in coordinates of cells.
#[derive(Clone, Copy, Debug)]
pub struct Feature {
    pub vertex: u32,
    /// The target of the vertex, if that is beyond its cell.
    pub target: Option<DVec3>,
    /// The position of the vertex, held within its cell.
    pub held: DVec3,
    /// The mean of its crossings.
    pub mean: DVec3,
    /// The direction of the sum of its normals; zero where none is known.
    pub facing: Vec3,
    /// True if its cell has no other vertex.
    pub is_alone: bool,
    /// True if it lies between cells and finer ones: it stays where it is, and its triangles may leave its cells.
    pub is_between: bool,
}
