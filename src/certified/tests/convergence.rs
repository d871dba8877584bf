//! The width of bounds against the pitch.

use super::*;
use crate::solids::{self, LatticeForm, StrutLattice, StrutPattern};
use crate::testing::meshes::{cube, together};

fn pairs() -> Vec<(&'static str, [TriangleMesh; 2])> {
    let torus = || solids::torus(1.0, 0.35, 48, 24).unwrap();
    let sphere = |radius| solids::sphere(radius, 24).unwrap();
    let lattice = |form| {
        let pattern = StrutPattern::Cubic;
        StrutLattice { pattern, form, cells: [2, 2, 2], cell_size: 1.0, radius: 0.2 }.build().unwrap()
    };
    let cubes = together(&[cube(DVec3::splat(-0.6), 1.0), cube(DVec3::splat(-0.1), 0.9)]);
    vec![
        (
            "cubes",
            [cube(DVec3::splat(-0.5), 1.0), turned(cube(DVec3::splat(-0.5), 1.0), DVec3::new(1.0, 2.0, 3.0), 0.7)],
        ),
        ("tori", [torus(), moved(turned(torus(), DVec3::new(1.0, 0.2, 0.1), 1.0), DVec3::new(0.31, 0.17, 0.23))]),
        ("spheres", [sphere(1.0), moved(sphere(0.8), DVec3::new(0.5, 0.4, 0.3))]),
        (
            "lattices",
            [
                lattice(LatticeForm::Union { resolution: 12 }),
                turned(lattice(LatticeForm::Union { resolution: 12 }), DVec3::new(0.3, 0.2, 1.0), 0.5),
            ],
        ),
        ("sphere and torus", [sphere(0.9), moved(torus(), DVec3::new(0.3, 0.2, 0.1))]),
        ("overlapping cubes and sphere", [cubes, moved(sphere(0.6), DVec3::splat(0.1))]),
    ]
}

#[test]
fn the_width_falls_with_the_square_of_the_pitch() {
    let mut worst = f64::INFINITY;
    for (name, [a, b]) in pairs() {
        for operation in OPERATIONS {
            let expression = Expression::of_inputs(operation, 2);
            let bounds = [1.0 / 24.0, 1.0 / 192.0]
                .map(|pitch| certified(&expression, &[&a, &b], FillRule::NonZero, Refine::ToPitch(pitch)));
            let [coarse, fine] = bounds;
            // Both contain the volume, so they have a point in common.
            assert!(coarse.lower <= fine.upper && fine.lower <= coarse.upper, "{name}");
            let [coarse, fine] = bounds.map(|found| found.upper - found.lower);
            // Rounding alone.
            if coarse < 1e-9 {
                continue;
            }
            let order = (coarse / fine).log2() / 3.0;
            println!("{name}, {operation:?}: {coarse:.3e} to {fine:.3e}, order {order:.3}");
            worst = worst.min(order);
        }
    }
    assert!(worst >= 1.9, "{worst}");
}

#[test]
fn a_tolerance_is_reached_and_not_exceeded_much() {
    for (name, [a, b]) in &pairs()[..3] {
        let expression = Expression::of_inputs(BooleanOperation::Intersection, 2);
        for share in [1e-1, 1e-3, 1e-5] {
            let found = certified(&expression, &[a, b], FillRule::NonZero, Refine::ToTolerance(share));
            let width = (found.upper - found.lower) / found.upper;
            println!("{name}, {share}: {width:.2e} with {} cells", found.cells);
            assert!(width <= share, "{name}");
        }
    }
}

#[test]
fn refinement_to_a_tolerance_ends_for_empty_and_touching_results() {
    let expression = Expression::of_inputs(BooleanOperation::Intersection, 2);
    let a = cube(DVec3::splat(-0.5), 1.0);
    let turn = |mesh| turned(mesh, DVec3::new(1.0, 2.0, 3.0), 0.7);
    let [one, other] =
        [turn(a.clone()), turn(moved(a.clone(), DVec3::new(1.05, 0.0, 0.0)))].map(|m| ClosedMesh::check(m).unwrap());
    let found = certified_volume(&expression, &[&one, &other], FillRule::EvenOdd, Refine::ToTolerance(0.01)).unwrap();
    assert_eq!((found.lower, found.upper, found.reached), (0.0, 0.0, true));
    // The rounding of a needle's volume is more than a millionth of a millionth of it.
    let needle = crate::solids::cuboid(DVec3::new(-9.0, 0.1, 0.1), DVec3::new(9.0, 0.1 + 1e-6, 0.1 + 1e-6)).unwrap();
    let [needle, other] = [needle, turn(a)].map(|m| ClosedMesh::check(m).unwrap());
    let found =
        certified_volume(&expression, &[&needle, &other], FillRule::EvenOdd, Refine::ToTolerance(1e-15)).unwrap();
    assert!(!found.reached && found.lower <= found.upper, "{found:?}");
}

#[test]
fn bounds_depend_neither_on_threads_nor_on_the_order_of_triangles() {
    let (_, [a, b]) = pairs().swap_remove(1);
    let expression = Expression::of_inputs(BooleanOperation::Xor, 2);
    let of = |threads: usize, a: &TriangleMesh| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| certified(&expression, &[a, &b], FillRule::NonZero, Refine::ToPitch(0.05)))
    };
    let one = of(1, &a);
    assert_eq!(one, of(3, &a));
    let mut backwards = a.clone();
    backwards.triangles.reverse();
    let other = of(2, &backwards);
    // Sums of shares are rounded in another order.
    assert!((one.lower - other.lower).abs() < 1e-11 && (one.upper - other.upper).abs() < 1e-11, "{one:?} {other:?}");
}
