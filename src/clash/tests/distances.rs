//! Distances of triangles against the oracle, and of bodies against all pairs of their triangles.

use glam::DVec3;

use super::super::body::Body;
use super::super::nearest::nearest;
use super::super::triangles::{Nearest, distance, do_meet};
use super::oracle::squared_distance;
use crate::closest;
use crate::mesh::TriangleMesh;
use crate::sampler::FillRule;
use crate::solids;
use crate::testing::random::Random;

fn triangle_distance(a: &[DVec3; 3], b: &[DVec3; 3]) -> Nearest {
    let found = distance(a, b);
    if do_meet(a, b) { Nearest { distance: 0.0, ..found } } else { found }
}

/// Checks the distance of two triangles with integer corners, and that the nearest points lie on them.
fn check(a: [[i64; 3]; 3], b: [[i64; 3]; 3]) {
    let [points_a, points_b] = [a, b].map(|triangle| triangle.map(|corner| DVec3::from(corner.map(|c| c as f64))));
    let found = triangle_distance(&points_a, &points_b);
    let exact = squared_distance(a, b).sqrt();
    assert!((found.distance - exact).abs() <= 1e-12 * exact, "{a:?} {b:?}: {} for {exact}", found.distance);
    let size = points_a.iter().chain(&points_b).map(|p| p.abs().max_element()).fold(0.0, f64::max);
    if exact > 0.0 {
        let apart = found.points[0].distance(found.points[1]);
        assert!((apart - exact).abs() <= 1e-9 * exact + 1e-14 * size, "{a:?} {b:?}: {apart} for {exact}");
    }
    for (point, triangle) in found.points.into_iter().zip([points_a, points_b]) {
        // Those of the library for points are less accurate on slivers.
        let off = distance(&[point; 3], &triangle).distance;
        assert!(off <= 1e-15 * size || exact == 0.0, "{a:?} {b:?}: {off}");
    }
}

#[test]
fn distances_of_small_triangles_are_those_of_rational_arithmetic() {
    // Few positions: triangles that are degenerate, coplanar, parallel, identical and touching are frequent.
    for (most, count) in [(1, 20_000), (3, 20_000), (20, 20_000)] {
        let mut random = Random::new(most as u64);
        for _ in 0..count {
            let mut triangle = || [0; 3].map(|_| random.point(-most..most + 1).map(i64::from));
            check(triangle(), triangle());
        }
    }
}

#[test]
fn distances_of_large_triangles_are_those_of_rational_arithmetic() {
    let mut random = Random::new(5);
    for _ in 0..20_000 {
        let mut triangle = || [0; 3].map(|_| random.point(-(1 << 24)..1 << 24).map(i64::from));
        check(triangle(), triangle());
    }
}

#[test]
fn distances_of_nearly_touching_triangles_are_those_of_rational_arithmetic() {
    let mut random = Random::new(9);
    for _ in 0..20_000 {
        let a = [0; 3].map(|_| random.point(-(1 << 24)..1 << 24).map(i64::from));
        // Corners on or near the sides and corners of the first, or far beyond in the same direction.
        let b = [0; 3].map(|_| {
            let [i, j] = [random.below(3), random.below(3)];
            let share = i64::from(random.between(-1, 3));
            let off = random.point(-2..3);
            [0, 1, 2].map(|k| a[i][k] + (a[j][k] - a[i][k]) / 2 * share + i64::from(off[k]))
        });
        check(a, b);
    }
}

#[test]
fn distances_of_slivers_and_nearly_parallel_sides_are_those_of_rational_arithmetic() {
    let mut random = Random::new(13);
    for _ in 0..20_000 {
        let along = random.point(-(1 << 24)..1 << 24).map(i64::from);
        let mut sliver = |shift: i64| {
            let near = |random: &mut Random, share: i64| {
                let off = random.point(-3..4);
                [0, 1, 2].map(|k| along[k] / 4 * share + i64::from(off[k]) + shift)
            };
            [near(&mut random, 0), near(&mut random, 4), near(&mut random, 2)]
        };
        let a = sliver(0);
        let b = sliver([0, 1, 100][a[0][0].rem_euclid(3) as usize]);
        check(a, b);
    }
}

fn moved(mesh: &TriangleMesh, by: DVec3) -> TriangleMesh {
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|position| *position += by);
    mesh
}

#[test]
fn distances_of_bodies_are_the_least_of_all_pairs() {
    let meshes = [
        solids::geodesic(1.0, 4).unwrap(),
        solids::torus(1.0, 0.3, 14, 7).unwrap(),
        solids::cuboid(DVec3::ZERO, DVec3::new(1.0, 0.2, 0.7)).unwrap(),
    ];
    let mut random = Random::new(21);
    for round in 0..60 {
        let a = &meshes[random.below(3)];
        let by = DVec3::new(random.unit(), random.unit(), random.unit());
        let b = moved(&meshes[random.below(3)], if round % 2 == 0 { 3.0 * by } else { by });
        let [body_a, body_b] = [a, &b].map(|mesh| Body::new(mesh, FillRule::EvenOdd));
        let mut least = f64::INFINITY;
        for i in 0..a.triangles.len() {
            for j in 0..b.triangles.len() {
                least = least.min(triangle_distance(&body_a.corners(i as u32), &body_b.corners(j as u32)).distance);
            }
        }
        let found = nearest(&body_a, &body_b);
        assert_eq!(found.distance, least);
        if least > 0.0 {
            assert!((found.points[0].distance(found.points[1]) - least).abs() < 1e-12);
        }
    }
}

#[test]
fn bodies_that_touch_are_at_distance_0() {
    let cube = crate::testing::meshes::cube;
    for by in [DVec3::X, DVec3::ONE, DVec3::new(1.0, 1.0, 0.25), DVec3::new(1.0, 0.5, 0.25)] {
        let (a, b) = (cube(DVec3::ZERO, 1.0), cube(by, 1.0));
        let [body_a, body_b] = [&a, &b].map(|mesh| Body::new(mesh, FillRule::EvenOdd));
        let found = nearest(&body_a, &body_b);
        assert_eq!((found.distance, found.points[0]), (0.0, found.points[1]));
        assert!(closest::squared_distance(found.points[0], body_a.corners(0)) < 3.0);
    }
}
