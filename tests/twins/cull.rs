//! Compares culling on the device, which tests all pairs, with culling on the CPU, which tests the pairs that meet on the Gauss
//! map.

use std::fmt::Display;

use ldi_ops::grid::Grid;
use ldi_ops::mesh::ClosedMesh;
use ldi_ops::minkowski::cull::gpu::GpuCuller;
use ldi_ops::minkowski::{Polyhedron, Primitives, cull};
use ldi_ops::sampler::gpu::{Arithmetic, Route};
use ldi_ops::solids;

use crate::lattice::generators;
use crate::on_lattice::{closed, grid};
use crate::soups::Frame;
use crate::testing::random::Random;
use crate::twin;

/// A frame whose positions add up to less than 2^30.
fn half_a_frame(random: &mut Random) -> Frame {
    let shift = random.choose(&[2, 2, 2, 3, 7, 16, 25]);
    Frame { shift, rays: std::array::from_fn(|_| random.between(6, 9) as u32) }
}

fn polyhedron(soup: &crate::soups::Soup, frame: &Frame) -> Polyhedron {
    Polyhedron::new(&grid(frame, 64).quantise(&closed(soup)).unwrap())
}

/// Returns the triangles by their corners, sorted: only their order depends on the backend.
fn sorted(primitives: &Primitives) -> Vec<[[i32; 3]; 3]> {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| primitives.positions[vertex as usize]);
    let mut triangles: Vec<[[i32; 3]; 3]> = primitives.triangles.iter().map(corners).collect();
    triangles.sort_unstable();
    triangles
}

/// Compares in each arithmetic that the adapter has; returns the number of pairs kept.
fn compare(what: impl Display, a: &Polyhedron, b: &Polyhedron) -> u64 {
    let (expected, counts) = cull(a, b);
    let expected = sorted(&expected);
    let mut in_order = None;
    for twin in twin::all().iter().filter(|twin| twin.options.route == Route::Lists) {
        let arithmetic = twin.options.arithmetic.unwrap_or(Arithmetic::Pairs);
        let culler = GpuCuller::prefilled(twin.gpu.device(), arithmetic, Some(0xa5a5_a5a5));
        let (found, found_counts) = culler.cull(a, b).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(sorted(&found) == expected, "{what}, {arithmetic:?}: other primitives");
        let of = |counts: &ldi_ops::minkowski::CullCounts| (counts.candidates, counts.kept, counts.distinct);
        assert_eq!(of(&found_counts), of(&counts), "{what}, {arithmetic:?}");
        assert_eq!(in_order.get_or_insert_with(|| found.clone()), &found, "{what}: another order");
    }
    counts.kept
}

#[test]
fn soups_keep_equal_pairs() {
    let mut kept = 0;
    for (name, generator) in generators() {
        for seed in 500..503 {
            let mut random = Random::new(seed);
            let frame = half_a_frame(&mut random);
            let [a, b] = [(); 2].map(|()| polyhedron(&generator(&mut random, &frame), &frame));
            kept += compare(format_args!("{name}, seed {seed}"), &a, &b);
            kept += compare(format_args!("{name}, seed {seed}, inside out"), &a, &b.complement());
        }
    }
    assert!(kept > 10_000, "{kept}");
}

/// There are more pairs than the initial buffer holds, and all directions of one operand tie with those of the other.
#[test]
fn ties_keep_equal_pairs() {
    let frame = Frame { shift: 4, rays: [60; 3] };
    let mut random = Random::new(3);
    let mut soup = crate::soups::Soup::default();
    for cell in 0..27 {
        let from = [cell % 3, cell / 3 % 3, cell / 9].map(|at: i32| 100 * at);
        let size = [(); 3].map(|()| random.even(20, 60));
        soup.add(&crate::soups::cuboid(from, [0, 1, 2].map(|i| from[i] + size[i])));
    }
    let boxes = polyhedron(&soup, &frame);
    let kept = compare("boxes", &boxes, &boxes);
    assert!(kept > 5000, "{kept}");
}

/// Edges of one operand lie within two lattice steps of the facets of the other, 2^27 long: f32 cannot decide the side.
#[test]
fn near_ties_keep_equal_pairs() {
    const REACH: i32 = 1 << 27;
    let frame = Frame { shift: 25, rays: [9; 3] };
    let mut random = Random::new(11);
    let mut kept = 0;
    for case in 0..60 {
        let corners: [[i32; 3]; 4] = [(); 4].map(|()| [(); 3].map(|()| random.even(0, REACH - 4)));
        let beside = corners.map(|corner| {
            let along = [0, 1, 2].map(|i| REACH + corner[i] - corners[0][i]);
            along.map(|position| position + random.even(-2, 2))
        });
        let [a, b] = [corners, beside].map(|corners| polyhedron(&crate::soups::tetrahedron(corners), &frame));
        kept += compare(format_args!("case {case}"), &a, &b);
        kept += compare(format_args!("case {case}, inside out"), &a, &b.complement());
    }
    assert!(kept > 500, "{kept}");
}

#[test]
fn models_keep_equal_pairs() {
    let quantised = |mesh: ldi_ops::mesh::TriangleMesh, resolution: u32| {
        let mesh = ClosedMesh::check(mesh).unwrap();
        let bounds = mesh.bounds();
        // Positions reach half the lattice.
        let grid = Grid::with_resolution(bounds, resolution, 64).unwrap();
        let grid = Grid::from_parts(grid.origin(), grid.pitch(), grid.rays(), grid.shift() - 1, 64).unwrap();
        Polyhedron::new(&grid.quantise(&mesh).unwrap())
    };
    let ball = quantised(solids::geodesic(1.0, 4).unwrap(), 100);
    let ring = quantised(solids::torus(3.0, 1.0, 24, 12).unwrap(), 300);
    assert!(compare("a ball and a ring", &ball, &ring) > 500);
    assert!(compare("two rings", &ring, &ring) > 5000);
}

#[test]
fn empty_operands_keep_no_pairs() {
    let empty = Polyhedron::from_parts(Vec::new(), Vec::new());
    let frame = Frame { shift: 4, rays: [6; 3] };
    let cube = polyhedron(&crate::soups::cuboid([0; 3], [40; 3]), &frame);
    assert_eq!(compare("nothing and a cube", &empty, &cube), 0);
    assert_eq!(compare("nothing and nothing", &empty, &empty), 0);
}
