//! Primitives that differ, and their triangles.

use std::collections::HashSet;

use super::Primitives;

/// A primitive: the same for the same positions in the same sense of rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Shape {
    /// Beginning with the least of its corners.
    Triangle([[i32; 3]; 3]),
    /// Beginning with the least of its corners, with the greatest opposite to it.
    Parallelogram([[i32; 3]; 4]),
}

impl Shape {
    /// A triangle that is counter-clockwise from outside.
    pub fn triangle(corners: [[i32; 3]; 3]) -> Shape {
        Shape::Triangle(least_first(corners))
    }

    /// A parallelogram that is counter-clockwise from outside.
    pub fn parallelogram(corners: [[i32; 3]; 4]) -> Shape {
        Shape::Parallelogram(least_first(corners))
    }

    /// Its corners in turn.
    pub fn corners(&self) -> &[[i32; 3]] {
        match self {
            Shape::Triangle(corners) => corners,
            Shape::Parallelogram(corners) => corners,
        }
    }
}

fn least_first<const N: usize>(mut corners: [[i32; 3]; N]) -> [[i32; 3]; N] {
    let least = (1..N).fold(0, |least, i| if corners[i] < corners[least] { i } else { least });
    corners.rotate_left(least);
    corners
}

/// The first of each that are the same.
pub fn distinct(mut shapes: Vec<Shape>) -> Vec<Shape> {
    let mut seen = HashSet::with_capacity(shapes.len());
    shapes.retain(|shape| seen.insert(*shape));
    shapes
}

/// Their triangles, which share the positions of their primitive.
pub fn primitives(shapes: &[Shape]) -> Primitives {
    let mut primitives = Primitives::default();
    for shape in shapes {
        let first = primitives.positions.len() as u32;
        primitives.positions.extend(shape.corners());
        primitives.triangles.push([first, first + 1, first + 2]);
        if let Shape::Parallelogram(_) = shape {
            primitives.triangles.push([first, first + 2, first + 3]);
        }
    }
    primitives
}
