//! Sets of voxels on a common, sheared grid: thousands of coincident faces and edges of four faces, and volumes that are counts.

use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::FillRule;
use proptest::prelude::*;

use super::exact;

const SIDE: usize = 4;

/// Returns the surface of a set of voxels, or `None` of an empty one.
fn surface(voxels: &[bool], shear: [[f64; 3]; 3]) -> Option<ClosedMesh> {
    let is_full = |cell: [i64; 3]| {
        cell.iter().all(|&c| (0..SIDE as i64).contains(&c))
            && voxels[(cell[0] as usize * SIDE + cell[1] as usize) * SIDE + cell[2] as usize]
    };
    let mut mesh = TriangleMesh::default();
    for index in 0..SIDE.pow(3) {
        let cell = [index / (SIDE * SIDE), index / SIDE % SIDE, index % SIDE].map(|c| c as i64);
        for (axis, step) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 1), (axis, -1)]) {
            let mut beside = cell;
            beside[axis] += step;
            if !is_full(cell) || is_full(beside) {
                continue;
            }
            let first = mesh.positions.len() as u32;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (s, t) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                let mut corner = cell;
                corner[axis] += (step + 1) / 2;
                corner[u] += s;
                corner[v] += t;
                let p = corner.map(|c| c as f64);
                mesh.positions.push(DVec3::from_array([0, 1, 2].map(|i| (0..3).map(|j| shear[i][j] * p[j]).sum())));
            }
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| first + i);
            mesh.triangles.extend(if step > 0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    (!mesh.triangles.is_empty()).then(|| ClosedMesh::check(mesh).unwrap())
}

/// Returns the area of the surface of a set of voxels.
fn area(voxels: &[bool], shear: [[f64; 3]; 3]) -> f64 {
    surface(voxels, shear).map_or(0.0, |mesh| mesh.mesh().area())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, max_shrink_iters: 50, ..ProptestConfig::default() })]

    #[test]
    fn voxel_sets_have_counted_volumes(
        a in prop::collection::vec(any::<bool>(), SIDE.pow(3)),
        b in prop::collection::vec(any::<bool>(), SIDE.pow(3)),
        shears in [-2i8..3, -2i8..3, -2i8..3],
    ) {
        let [x, y, z] = shears.map(f64::from);
        let shear = [[1.0, x, y], [0.0, 1.0, z], [0.0, 0.0, 1.0]];
        let (Some(first), Some(second)) = (surface(&a, shear), surface(&b, shear)) else { return Ok(()) };
        let inputs = [first, second];
        for operation in super::OPERATIONS {
            let result: Vec<bool> = a.iter().zip(&b).map(|(&a, &b)| match operation {
                BooleanOperation::Intersection => a && b,
                BooleanOperation::Union => a || b,
                BooleanOperation::Difference => a && !b,
                BooleanOperation::Xor => a != b,
            }).collect();
            let count = result.iter().filter(|&&is_full| is_full).count();
            let found = exact(&inputs, &Expression::of_inputs(operation, 2), FillRule::EvenOdd);
            prop_assert!((found.volume - count as f64).abs() <= found.volume_rounding, "{operation:?}: {} {count}", found.volume);
            prop_assert!(found.volume_rounding < 1e-9, "{}", found.volume_rounding);
            let area = area(&result, shear);
            prop_assert!((found.area - area).abs() <= 1e-9 * area, "{operation:?}: {} instead of {area}", found.area);
        }
    }
}
