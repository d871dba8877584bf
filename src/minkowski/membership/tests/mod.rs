//! Membership compared with counts of cells and with hulls.

mod cells;
mod hulls;
mod tori;
mod walls;

use cells::Cells;

use super::SumMembership;
use crate::minkowski::{Exterior, Membership, Polyhedron};
use crate::testing::random::Random;

/// Returns the answers for points, each found twice: by itself, and with the memory of the points before it.
fn answers(sum: &SumMembership, points: impl IntoIterator<Item = [i32; 3]>) -> Vec<([i32; 3], bool)> {
    let mut memory = Default::default();
    let answer = |point| {
        let alone = sum.contains(point, &mut Default::default());
        assert_eq!(alone, sum.contains(point, &mut memory), "at {point:?} memory changes the answer");
        (point, alone)
    };
    points.into_iter().map(answer).collect()
}

/// Returns the union of several polyhedra without shared vertices.
fn together(parts: &[Polyhedron]) -> Polyhedron {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for part in parts {
        let base = positions.len() as u32;
        positions.extend_from_slice(part.positions());
        triangles.extend(part.triangles().iter().map(|triangle| triangle.map(|vertex| vertex + base)));
    }
    Polyhedron::from_parts(positions, triangles)
}

/// Returns a box between even positions.
fn cuboid(min: [i32; 3], max: [i32; 3]) -> Polyhedron {
    let side: [i32; 3] = std::array::from_fn(|i| max[i] - min[i]);
    Cells::solid([1; 3]).surface().map(|[x, y, z]| [min[0] + x * side[0], min[1] + y * side[1], min[2] + z * side[2]])
}

/// Returns a box with a smaller one cut out.
fn hollow([min, max]: [i32; 2], [inner_min, inner_max]: [i32; 2]) -> Polyhedron {
    together(&[cuboid([min; 3], [max; 3]), cuboid([inner_min; 3], [inner_max; 3]).complement()])
}
