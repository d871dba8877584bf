//! Surfaces of shapes whose geometry is known.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec3, EulerRot};
use ldi_ops::grid::Grid;
use ldi_ops::mesh::TriangleMesh;
use ldi_ops::solids;

use crate::crossings::assert_uncrossed;
use crate::sampled::{assert_solid, distance, nodes, sharp_edges, surface_of, surface_of_expression};
use crate::testing::images::closed;

fn turned_cube(turn: DQuat, side: f64) -> (TriangleMesh, [DVec3; 8]) {
    let mut mesh = solids::cuboid(DVec3::splat(-0.5 * side), DVec3::splat(0.5 * side)).unwrap();
    mesh.transform(&DAffine3::from_quat(turn));
    let corner = |i: usize| turn * (DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) - 0.5) * side;
    (mesh, std::array::from_fn(corner))
}

#[test]
fn surfaces_of_turned_cubes_keep_faces_edges_and_corners() {
    for seed in 0..60u32 {
        let angle = |k: u32| f64::from(seed * 7 + k * 13 + 1) * 0.7310;
        let turn = match seed {
            0 => DQuat::IDENTITY,
            _ => DQuat::from_euler(EulerRot::XYZ, angle(1), angle(2), angle(3)),
        };
        let (mesh, corners) = turned_cube(turn, 1.0);
        let mesh = closed(mesh);
        let grid = Grid::with_resolution(mesh.bounds(), 23 + seed % 11, 1024).unwrap();
        let surface = surface_of(&mesh, &grid);
        assert_solid(&surface.mesh);
        assert_eq!(surface.stayed, 0, "{seed}");
        assert_uncrossed(&surface, &grid, &format!("{seed}"));
        for corner in corners {
            let distances = surface.mesh.positions.iter().map(|p| p.distance(corner));
            assert!(distances.fold(f64::INFINITY, f64::min) < 1e-6 * grid.pitch(), "{seed}: {corner}");
        }
        // Every vertex that is not on an edge is on a face.
        let volume = surface.mesh.signed_volume();
        assert!((volume - 1.0).abs() < 1e-6, "{seed}: {volume}");
        assert!((surface.mesh.area() - 6.0).abs() < 1e-2, "{seed}: {}", surface.mesh.area());
        let far = |p: &DVec3| (turn.inverse() * *p).abs().max_element() - 0.5;
        let off = surface.mesh.positions.iter().map(|p| far(p).abs()).fold(0.0, f64::max);
        // Vertices are kept 1e-4 of a pitch off the faces of their cells.
        assert!(off < 2e-4 * grid.pitch(), "{seed}: {}", off / grid.pitch());
        assert!(surface.distance < 0.05 * grid.pitch(), "{seed}: {}", surface.distance / grid.pitch());
        assert!(nodes(&closed(surface.mesh), &grid) == nodes(&mesh, &grid), "{seed}");
    }
}

/// A turned cube and a ball around the middle of one of its faces; the ball cuts no edge. The surface replaces the circle where
/// they meet by chords of up to two pitches; for a radius of 20 pitches these stay within 0.025 pitches of the circle.
#[test]
fn a_turned_cube_cut_by_a_ball_keeps_its_edges() {
    let (radius, frequency) = (0.35, 48);
    for seed in 0..12u32 {
        let turn = DQuat::from_euler(
            EulerRot::XYZ,
            f64::from(seed) * 1.37 + 0.2,
            f64::from(seed) * 0.71 + 0.5,
            f64::from(seed) * 2.3,
        );
        let (cube, corners) = turned_cube(turn, 1.0);
        let mut ball = solids::geodesic(radius, frequency).unwrap();
        let middle = turn * DVec3::new(0.5, 0.0, 0.0);
        ball.transform(&DAffine3::from_translation(middle));
        let (surface, grid) = surface_of_expression("a - b", &[&closed(cube), &closed(ball)], 96 + seed);
        assert_solid(&surface.mesh);
        let pitch = grid.pitch();
        for corner in corners {
            let distances = surface.mesh.positions.iter().map(|p| p.distance(corner));
            assert!(distances.fold(f64::INFINITY, f64::min) < 1e-3 * pitch, "{seed}: {corner}");
        }
        let sharp = sharp_edges(&surface.mesh, 0.8);
        for (i, &from) in corners.iter().enumerate() {
            for to in (0..3).map(|axis| i ^ 1 << axis).filter(|&to| to > i) {
                for step in 0..=500 {
                    let point = from.lerp(corners[to], f64::from(step) / 500.0);
                    let off = distance(point, &sharp) / pitch;
                    assert!(off < 0.05, "{seed}: {off} at {point}");
                }
            }
        }
        for step in 0..720 {
            let (sin, cos) = (f64::from(step) * 0.5).to_radians().sin_cos();
            let off = distance(middle + turn * DVec3::new(0.0, cos, sin) * radius, &sharp) / pitch;
            assert!(off < 0.05, "{seed}: {off} on the circle");
        }
        let exact = 1.0 - 2.0 / 3.0 * PI * radius.powi(3);
        assert!((surface.mesh.signed_volume() - exact).abs() < 2e-3 * pitch, "{seed}");
    }
}
