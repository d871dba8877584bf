//! Solids whose volumes and areas are known in closed form.

use glam::DVec3;
use ldi_ops::boolean::BooleanOperation;
use ldi_ops::boolean::Expression;
use ldi_ops::exact::{Solution, Source, mass_properties, of_solid};
use ldi_ops::mesh::{ClosedMesh, MassProperties, Precision, TriangleMesh};
use ldi_ops::sampler::FillRule;
use ldi_ops::solids;
use ldi_ops::surface::Coordinates;

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

/// Returns a mesh with other corners first, which is no copy: of a copy, no face counts.
fn turned(mut mesh: TriangleMesh) -> TriangleMesh {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.rotate_left(1));
    mesh
}

pub fn together(meshes: &[TriangleMesh]) -> TriangleMesh {
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
        let b = closed(turned(cube(corner, 2.0)));
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
        let b = closed(turned(cube(corner, 2.0)));
        for pair in [[&a, &b], [&b, &a]] {
            let found = OPERATIONS.map(|operation| volume(operation, &pair).area);
            for (found, expected) in found.into_iter().zip(areas) {
                assert!((found - expected).abs() < 1e-12, "{corner}: {found} {expected}");
            }
        }
    }
}

#[test]
fn a_copy_of_an_input_is_that_input_again() {
    let [torus, other] = [solids::torus(3.0, 1.0, 40, 24), solids::geodesic(2.0, 8)].map(|mesh| closed(mesh.unwrap()));
    let copy = torus.clone();
    let of = |inputs: &[&ClosedMesh], text: &str| {
        let expression = Expression::parse(text, &["a", "b", "c"][..inputs.len()]).unwrap();
        let solution = Solution::of(inputs, &expression, FillRule::NonZero).unwrap();
        (solution.properties(), solution.mesh(Coordinates { precision: Precision::Double, ..Coordinates::default() }))
    };
    let (alone, mesh) = of(&[&torus], "a");
    for text in ["a & b", "a | b", "b & a"] {
        let (found, same) = of(&[&torus, &copy], text);
        assert_eq!((found, &same.mesh), (alone.clone(), &mesh.mesh), "{text}");
        assert_eq!(same.mesh.triangles.len(), torus.mesh().triangles.len());
        assert!(same.sources.iter().all(|source| source.input == 0));
    }
    for text in ["a - b", "b ^ a"] {
        let (found, none) = of(&[&torus, &copy], text);
        assert_eq!((found.mass.volume, found.mass.area, none.mesh.triangles.len()), (0.0, 0.0, 0), "{text}");
    }
    // The other input keeps its number, and its triangles theirs.
    let (expected, without) = of(&[&torus, &other], "a - b");
    let (found, with) = of(&[&torus, &copy, &other], "(a | b) - c");
    assert_eq!((found, &with.mesh), (expected, &without.mesh));
    // Beside a copy, another input may have faces that coincide with both.
    let [cube, copy, beside] = [DVec3::ZERO, DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0)].map(|at| closed(cube(at, 2.0)));
    let (found, flush) = of(&[&cube, &copy, &beside], "a | b | c");
    assert!((found.mass.volume - 16.0).abs() < 1e-12 && (found.mass.area - 40.0).abs() < 1e-12, "{found:?}");
    assert!((flush.mesh.area() - 40.0).abs() < 1e-12);
    let numbered = |sources: &[Source], number| sources.iter().filter(|source| source.input == number).count();
    let count = numbered(&without.sources, 1);
    assert_eq!((numbered(&with.sources, 1), numbered(&with.sources, 2)), (0, count));
    assert!(count > 0);
}

#[test]
fn a_copy_of_an_input_has_its_shells_and_its_faults() {
    let crossing = closed(together(&[cube(DVec3::ZERO, 2.0), cube(DVec3::ONE, 2.0)]));
    let (copy, far) = (crossing.clone(), closed(cube(DVec3::splat(9.0), 1.0)));
    let union = Expression::of_inputs(BooleanOperation::Union, 3);
    let found = mass_properties(&[&far, &crossing, &copy], &union, FillRule::NonZero).unwrap();
    assert_eq!(found.with_meeting_shells, [1, 2]);
    assert!((found.mass.volume - 16.0).abs() < 1e-12);
    // Closed, but not oriented.
    let mut turned = cube(DVec3::ZERO, 2.0);
    turned.triangles[0].swap(1, 2);
    let turned = closed(turned);
    let fault = |inputs: &[&ClosedMesh]| mass_properties(inputs, &union, FillRule::NonZero).unwrap_err().input;
    assert_eq!([fault(&[&far, &turned, &turned]), fault(&[&far, &far, &turned])], [1, 2]);
}

#[test]
fn shells_may_meet_where_the_result_does_not_depend_on_them() {
    let far = together(&[cube(DVec3::splat(10.0), 2.0), cube(DVec3::splat(11.0), 2.0)]);
    let a = closed(together(&[cube(DVec3::ZERO, 4.0), far]));
    let b = closed(cube(DVec3::splat(2.0), 4.0));
    for fill in [FillRule::NonZero, FillRule::EvenOdd] {
        let of = |operation| mass_properties(&[&a, &b], &Expression::of_inputs(operation, 2), fill).unwrap();
        let common = of(BooleanOperation::Intersection);
        assert!((common.mass.volume - 8.0).abs() < 1e-12);
        assert!(common.with_meeting_shells.is_empty());
        let all = of(BooleanOperation::Union);
        let far = if fill == FillRule::NonZero { 15.0 } else { 14.0 };
        assert!((all.mass.volume - (120.0 + far)).abs() < 1e-11);
        assert_eq!(all.with_meeting_shells, [0]);
    }
}

#[test]
fn a_single_shell_may_cross_itself() {
    // One corner of a torus is pulled through the far side, at x < 0.
    let mut torus = solids::torus(3.0, 1.0, 24, 12).unwrap();
    let at = (0..torus.positions.len()).max_by(|&i, &j| torus.positions[i].x.total_cmp(&torus.positions[j].x)).unwrap();
    let pulled = torus.positions[at];
    torus.positions[at] = DVec3::new(-9.0, 0.1, 0.05);
    let (torus, ball) = (closed(torus), solids::geodesic(1.0, 8).unwrap());
    let moved = |by: DVec3| {
        let positions = ball.positions.iter().map(|&p| p + by).collect();
        closed(TriangleMesh { positions, ..ball.clone() })
    };
    let of = |ball: &ClosedMesh| {
        let common = Expression::of_inputs(BooleanOperation::Intersection, 2);
        mass_properties(&[&torus, ball], &common, FillRule::NonZero)
    };
    let whole = closed(solids::torus(3.0, 1.0, 24, 12).unwrap());
    let away = moved(DVec3::new(0.0, 3.0, 0.5));
    let expected = volume(BooleanOperation::Intersection, &[&whole, &away]).volume;
    assert!(expected > 1.0 && (of(&away).unwrap().mass.volume - expected).abs() < 1e-12);
    // The cone to the corner crosses the far side of the tube, within this ball, inside out.
    let within = moved(DVec3::new(-3.0, 0.0, 0.0));
    let (found, tube) = (of(&within).unwrap(), volume(BooleanOperation::Intersection, &[&whole, &within]).volume);
    assert!(tube - found.mass.volume > 0.5, "{found:?} {tube}");
    assert_eq!(found.with_meeting_shells, [0]);
    assert!(of(&moved(-pulled)).is_ok());
}

#[test]
fn nested_shells_that_face_the_same_way_are_counted() {
    // The inner cube has a winding number of 1 in front.
    let a = closed(together(&[cube(DVec3::ZERO, 4.0), cube(DVec3::ONE, 2.0)]));
    for (corner, within) in [(DVec3::splat(1.5), 1.0), (DVec3::new(2.5, 1.5, 1.5), 0.5), (DVec3::splat(2.75), 0.015625)]
    {
        let b = closed(cube(corner, 1.0));
        let of = |fill| {
            let common = Expression::of_inputs(BooleanOperation::Intersection, 2);
            mass_properties(&[&a, &b], &common, fill).unwrap().mass.volume
        };
        assert!((of(FillRule::NonZero) - 1.0).abs() < 1e-13, "{corner}");
        assert!((of(FillRule::EvenOdd) - (1.0 - within)).abs() < 1e-13, "{corner}");
    }
}

#[test]
fn walls_along_every_axis_are_counted_from_outside() {
    // Only walls along one axis bound the common part, seen from either of the others.
    for axis in 0..3 {
        let mut corners = [DVec3::splat(1.0), DVec3::splat(2.0)];
        (corners[0][axis], corners[1][axis]) = (-50.0, 50.0);
        let bar = solids::cuboid(corners[0], corners[1]).unwrap();
        let hollow = |mesh: &TriangleMesh| TriangleMesh {
            triangles: mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
            ..mesh.clone()
        };
        let outer = solids::cuboid(corners[0] - DVec3::ONE, corners[1] + DVec3::ONE).unwrap();
        let tube = closed(together(&[outer, hollow(&bar)]));
        let b = closed(cube(DVec3::splat(-1.0), 5.0));
        let found = volume(BooleanOperation::Intersection, &[&tube, &b]).volume;
        assert!((found - (9.0 - 1.0) * 5.0).abs() < 1e-11, "{axis}: {found}");
    }
}

#[test]
fn flat_triangles_near_another_solid_count_for_nothing() {
    let mut mesh = cube(DVec3::ZERO, 4.0);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([DVec3::splat(3.0), DVec3::splat(3.5), DVec3::splat(3.25)]);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 1]]);
    let a = closed(mesh);
    let common = Expression::of_inputs(BooleanOperation::Intersection, 2);
    let of = |corner: f64| mass_properties(&[&a, &closed(cube(DVec3::splat(corner), 2.0))], &common, FillRule::NonZero);
    assert!((of(-1.0).unwrap().mass.volume - 1.0).abs() < 1e-13);
    assert!((of(2.5).unwrap().mass.volume - 3.375).abs() < 1e-13);
}

#[test]
fn a_solid_inside_out_is_the_solid() {
    let mut mesh = cube(DVec3::ZERO, 2.0);
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    let mass = of_solid(&closed(mesh), FillRule::NonZero).unwrap().mass;
    assert!((mass.volume - 8.0).abs() < 1e-14 && (mass.inertia.x_axis.x - 16.0 / 3.0).abs() < 1e-13);
}

#[test]
fn faces_that_cross_far_from_the_other_solid_are_found() {
    // A long bar that another shell crosses in its middle, far from the cube about its end, and many cubes farther away.
    let bar = solids::cuboid(DVec3::ZERO, DVec3::new(100.0, 1.0, 1.0)).unwrap();
    let across = solids::cuboid(DVec3::new(50.0, -1.0, -1.0), DVec3::new(51.0, 2.0, 2.0)).unwrap();
    let far = (0..40).map(|i| cube(DVec3::new(200.0 + 2.0 * f64::from(i), 0.0, 0.0), 1.0));
    let shells: Vec<TriangleMesh> = [bar, across].into_iter().chain(far).collect();
    let (a, b) = (closed(together(&shells)), closed(cube(DVec3::splat(-1.0), 2.5)));
    let common = Expression::of_inputs(BooleanOperation::Intersection, 2);
    let found = mass_properties(&[&a, &b], &common, FillRule::NonZero).unwrap();
    assert!((found.mass.volume - 1.5).abs() < 1e-13);
    assert_eq!(found.with_meeting_shells, [0]);
}

#[test]
fn rounding_to_the_lattice_is_within_the_bound() {
    // A tip 0.4 steps of the lattice above a lattice point.
    let off = 0.4 * (2.0f64).powi(-39);
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.0, 0.0, 1.0 + off)];
    for turn in 0..3 {
        let triangles =
            [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|face| [0, 1, 2].map(|i| face[(i + turn) % 3]));
        let mesh = closed(TriangleMesh { positions: positions.clone(), triangles: triangles.to_vec() });
        let found = mass_properties(&[&mesh], &Expression::input(0), FillRule::NonZero).unwrap().mass;
        let error = (found.volume - (1.0 + off) / 6.0).abs();
        assert!(
            error > 0.1 * off && error <= found.volume_rounding && found.volume_rounding < 4.0 * off,
            "{turn}: {error}"
        );
    }
}
