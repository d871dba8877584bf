//! Solids whose volumes and areas are known in closed form.

use glam::DVec3;
use ldi_ops::boolean::BooleanOperation;
use ldi_ops::boolean::Expression;
use ldi_ops::exact::mass_properties;
use ldi_ops::mesh::{ClosedMesh, MassProperties, TriangleMesh};
use ldi_ops::sampler::FillRule;
use ldi_ops::solids;

use super::OPERATIONS;

fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::check(mesh).unwrap()
}

fn volume(operation: BooleanOperation, meshes: &[&ClosedMesh]) -> MassProperties {
    let expression = Expression::of_inputs(operation, meshes.len());
    mass_properties(meshes, &expression, FillRule::NonZero).unwrap().mass
}

fn cube(corner: DVec3, side: f64) -> TriangleMesh {
    solids::cuboid(corner, corner + DVec3::splat(side)).unwrap()
}

fn together(meshes: &[TriangleMesh]) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|index| index + first)));
    }
    all
}

#[test]
fn cubes_have_exact_volumes() {
    let a = closed(cube(DVec3::ZERO, 2.0));
    for (corner, common) in [
        (DVec3::ONE, 1.0),
        (DVec3::ZERO, 8.0),
        (DVec3::new(1.0, 0.0, 0.0), 4.0),
        (DVec3::splat(2.0), 0.0),
        (DVec3::splat(0.5), 3.375),
        (DVec3::new(2.0, 0.0, 0.0), 0.0),
        (DVec3::splat(9.0), 0.0),
    ] {
        let b = closed(cube(corner, 2.0));
        let found = OPERATIONS.map(|operation| volume(operation, &[&a, &b]).volume);
        let expected = [common, 16.0 - common, 8.0 - common, 16.0 - 2.0 * common];
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-13, "{corner}: {found} {expected}");
        }
    }
}

#[test]
fn three_cubes_have_an_exact_volume() {
    let cubes =
        [DVec3::ZERO, DVec3::new(1.0, 0.5, 0.25), DVec3::new(0.25, 1.0, 0.5)].map(|corner| closed(cube(corner, 2.0)));
    let all: Vec<&ClosedMesh> = cubes.iter().collect();
    let side = |low: f64| 2.0 - low;
    let common = side(1.0) * side(1.0) * side(0.5);
    assert!((volume(BooleanOperation::Intersection, &all).volume - common).abs() < 1e-13);
    let pair = |x: f64, y: f64, z: f64| side(x) * side(y) * side(z);
    let union = 24.0 - pair(1.0, 0.5, 0.25) - pair(0.25, 1.0, 0.5) - pair(0.75, 0.5, 0.25) + common;
    assert!((volume(BooleanOperation::Union, &all).volume - union).abs() < 1e-12);
}

#[test]
fn overlapping_shells_follow_the_fill_rule() {
    let mesh = closed(together(&[cube(DVec3::ZERO, 2.0), cube(DVec3::ONE, 2.0)]));
    let of = |fill| mass_properties(&[&mesh], &Expression::input(0), fill).unwrap().mass.volume;
    assert!((of(FillRule::NonZero) - 15.0).abs() < 1e-13);
    assert!((of(FillRule::EvenOdd) - 14.0).abs() < 1e-13);
}

#[test]
fn spheres_meet_in_a_lens() {
    let ball = solids::geodesic(1.0, 20).unwrap();
    let a = closed(ball.clone());
    let mut moved = ball;
    moved.positions.iter_mut().for_each(|p| *p += DVec3::new(0.7, 0.1, 0.2));
    let b = closed(moved);
    let [common, union, ..] = OPERATIONS.map(|operation| volume(operation, &[&a, &b]).volume);
    assert!((common + union - 2.0 * a.signed_volume()).abs() < 1e-12, "{common} {union}");
}

#[test]
fn coincident_faces_bound_the_result_only_where_it_ends() {
    let a = closed(cube(DVec3::ZERO, 2.0));
    // In order: common part, union, difference, symmetric difference.
    for (corner, areas) in [
        (DVec3::new(2.0, 0.0, 0.0), [0.0, 40.0, 24.0, 40.0]),
        (DVec3::new(-2.0, 1.0, 0.0), [0.0, 44.0, 24.0, 44.0]),
        (DVec3::ZERO, [24.0, 24.0, 0.0, 0.0]),
        (DVec3::new(1.0, 0.0, 0.0), [16.0, 32.0, 16.0, 32.0]),
    ] {
        let b = closed(cube(corner, 2.0));
        for pair in [[&a, &b], [&b, &a]] {
            let found = OPERATIONS.map(|operation| volume(operation, &pair).area);
            for (found, expected) in found.into_iter().zip(areas) {
                assert!((found - expected).abs() < 1e-12, "{corner}: {found} {expected}");
            }
        }
    }
}
