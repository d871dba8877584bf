//! Shapes that are known.

use glam::{DAffine3, DQuat, DVec3};
use ldi_ops::grid::Grid;
use ldi_ops::mesh::TriangleMesh;
use ldi_ops::solids;

use crate::sampled::{assert_solid, closed, nodes, surface_of};

fn turned_cube(turn: DQuat, side: f64) -> (TriangleMesh, [DVec3; 8]) {
    let mut mesh = solids::cuboid(DVec3::splat(-0.5 * side), DVec3::splat(0.5 * side)).unwrap();
    mesh.transform(&DAffine3::from_quat(turn));
    let corner = |i: usize| turn * (DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) - 0.5) * side;
    (mesh, std::array::from_fn(corner))
}

#[test]
fn turned_cubes_stay_cubes() {
    let (mut worst, mut stayed, mut moved) = (0.0f64, 0, 0);
    for seed in 0..60u32 {
        let angle = |k: u32| f64::from(seed * 7 + k * 13 + 1) * 0.7310;
        let turn = if seed == 0 {
            DQuat::IDENTITY
        } else {
            DQuat::from_euler(glam::EulerRot::XYZ, angle(1), angle(2), angle(3))
        };
        let (mesh, corners) = turned_cube(turn, 1.0);
        let mesh = closed(mesh);
        let grid = Grid::with_resolution(mesh.bounds(), 23 + seed % 11, 1024).unwrap();
        let surface = surface_of(&mesh, &grid);
        assert_solid(&surface.mesh);
        moved += surface.moved;
        stayed += surface.stayed;
        for corner in corners {
            let nearest = surface.mesh.positions.iter().map(|p| p.distance(corner)).fold(f64::INFINITY, f64::min);
            if nearest > 1e-3 * grid.pitch() {
                println!("seed {seed}: corner off by {:.4}", nearest / grid.pitch());
            }
            worst = worst.max(nearest / grid.pitch());
        }
        let again = closed(surface.mesh.clone());
        if nodes(&again, &grid) != nodes(&mesh, &grid) {
            println!("seed {seed}: nodes differ");
        }
        let volume = surface.mesh.signed_volume();
        println!(
            "seed {seed} volume {volume} distance {} moved {} stayed {}",
            surface.distance / grid.pitch(),
            surface.moved,
            surface.stayed
        );
    }
    println!("worst corner {worst}, moved {moved} stayed {stayed}");
    panic!();
}
