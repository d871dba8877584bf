//! Bounds compared with volumes that are known by other means.

mod adversarial;
mod boxes;
mod convergence;
mod offsets;
mod parts;
mod phases;

use glam::{DMat3, DVec3};

use super::*;
use crate::boolean::BooleanOperation;
use crate::mesh::TriangleMesh;
use crate::testing::random::Random;

const OPERATIONS: [BooleanOperation; 4] =
    [BooleanOperation::Intersection, BooleanOperation::Union, BooleanOperation::Difference, BooleanOperation::Xor];

/// Returns bounds of an expression over meshes.
fn certified(expression: &Expression, meshes: &[&TriangleMesh], fill: FillRule, refine: Refine) -> CertifiedVolume {
    let closed: Vec<ClosedMesh> = meshes.iter().map(|&mesh| ClosedMesh::check(mesh.clone()).unwrap()).collect();
    let operands: Vec<&ClosedMesh> = closed.iter().collect();
    let found = certified_volume(expression, &operands, fill, refine).unwrap();
    assert!(found.lower <= found.upper && found.lower >= 0.0 && found.reached, "{found:?}");
    found
}

/// Returns bounds of an operation on two meshes under the even-odd rule.
fn of_two(operation: BooleanOperation, [a, b]: [&TriangleMesh; 2], pitch: f64) -> CertifiedVolume {
    certified(&Expression::of_inputs(operation, 2), &[a, b], FillRule::EvenOdd, Refine::ToPitch(pitch))
}

/// Asserts that bounds contain a volume, which is known but for a share of 10⁻¹² of `scale`.
fn assert_contains(found: CertifiedVolume, volume: f64, scale: f64, case: &dyn std::fmt::Debug) {
    let rounding = 1e-12 * scale;
    assert!(
        found.lower <= volume + rounding && volume - rounding <= found.upper,
        "{case:?}: {volume} is not in {found:?}"
    );
}

fn turned(mut mesh: TriangleMesh, about: DVec3, angle: f64) -> TriangleMesh {
    let turn = DMat3::from_axis_angle(about.normalize(), angle);
    mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
    mesh
}

fn moved(mut mesh: TriangleMesh, by: DVec3) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p += by);
    mesh
}

/// Draws a turn about a random axis.
fn random_turn(random: &mut Random) -> DMat3 {
    let axis = DVec3::from_array([(); 3].map(|()| random.unit())) + DVec3::splat(1e-3);
    DMat3::from_axis_angle(axis.normalize(), 3.0 * random.unit())
}

fn mapped(mut mesh: TriangleMesh, map: DMat3) -> TriangleMesh {
    mesh.positions.iter_mut().for_each(|p| *p = map * *p);
    mesh
}
