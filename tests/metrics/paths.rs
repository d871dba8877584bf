//! Tortuosity: the length of the shortest ways through a phase relative to straight ones, and the slow-down of diffusion.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use ldi_ops::grid::Axis;
use ldi_ops::mesh::{Aabb, TriangleMesh};
use ldi_ops::metrics::tortuosity::{EndCondition, diffusive, geodesic};
use ldi_ops::metrics::{BoundaryCondition, Phase};
use ldi_ops::solids;

use crate::convergence::{Within, converges};
use crate::scene::{Scene, moved};
use crate::testing::meshes::together;

const RESOLUTIONS: [u32; 3] = [32, 64, 128];

/// The cube of side 1 about the origin.
fn scene(mesh: TriangleMesh, resolution: u32) -> Scene {
    Scene::within(mesh, Aabb { min: DVec3::splat(-0.5), max: DVec3::splat(0.5) }, resolution)
}

fn diffusion(scene: &Scene, phase: Phase, axis: Axis, edges: BoundaryCondition) -> Option<f64> {
    let nodes = phase.nodes(&scene.nodes(), scene.region().nodes());
    diffusive(&nodes, axis, edges, EndCondition::Faces, 1e-8, &|_| ()).unwrap().map(|found| found.tortuosity)
}

fn shortest(scene: &Scene, phase: Phase, axis: Axis, edges: BoundaryCondition) -> Option<f64> {
    geodesic(&phase.nodes(&scene.nodes(), scene.region().nodes()), axis, edges).unwrap()
}

/// A plate through the cube that rises along x and is cut by the faces of the cube.
fn slit(thickness: f64, slope: f64) -> TriangleMesh {
    let rise = 0.5 * thickness / slope.cos();
    let mut mesh = solids::cuboid(DVec3::splat(-0.5), DVec3::splat(0.5)).unwrap();
    for p in &mut mesh.positions {
        p.z = p.x * slope.tan() + 2.0 * p.z * rise;
    }
    mesh
}

#[test]
fn a_straight_tube_has_tortuosity_one() {
    let tube = || solids::cylinder(0.3, 1.0, 64).unwrap();
    converges("diffusion along a tube", 1.0, Within::Difference(1e-6), RESOLUTIONS, |n| {
        let scene = scene(tube(), n);
        scene.measured(diffusion(&scene, Phase::Solid, Axis::Z, BoundaryCondition::Clip).unwrap())
    });
    converges("shortest way along a tube", 1.0, Within::Difference(1e-6), RESOLUTIONS, |n| {
        let scene = scene(tube(), n);
        scene.measured(shortest(&scene, Phase::Solid, Axis::Z, BoundaryCondition::Clip).unwrap())
    });
}

#[test]
fn tortuosity_of_a_tilted_slit_follows_from_its_angle() {
    let slope = 30.0f64.to_radians();
    // The value is exact for a long slit: the ends of this one are not at right angles to the flow. And 32 rays see only 9 nodes
    // across it.
    converges("diffusion in a slit at 30°", 1.0 / slope.cos().powi(2), Within::Share(0.05), RESOLUTIONS, |n| {
        let scene = scene(slit(0.25, slope), n);
        scene.measured(diffusion(&scene, Phase::Solid, Axis::X, BoundaryCondition::Clip).unwrap())
    });
    // A shortest way starts at the upper edge of the entrance, up to one slit width above the point that a parallel way would
    // start at.
    let width = 0.25 / slope.cos();
    let steps = (0..1000).map(|i| 1.0f64.hypot(slope.tan() - width * (f64::from(i) + 0.5) / 1000.0));
    converges("shortest way in a slit at 30°", steps.sum::<f64>() / 1000.0, Within::Share(0.02), RESOLUTIONS, |n| {
        let scene = scene(slit(0.25, slope), n);
        scene.measured(shortest(&scene, Phase::Solid, Axis::X, BoundaryCondition::Clip).unwrap())
    });
}

#[test]
fn dead_ends_have_no_tortuosity() {
    for resolution in RESOLUTIONS {
        let stub = |z| {
            let stub = solids::cylinder(0.2, 0.45, 32).unwrap();
            moved(stub, DAffine3::from_translation(DVec3::new(0.0, 0.0, z)))
        };
        let scene = scene(together(&[stub(-0.275), stub(0.275)]), resolution);
        for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
            assert_eq!(diffusion(&scene, Phase::Solid, Axis::Z, edges), None);
            assert_eq!(shortest(&scene, Phase::Solid, Axis::Z, edges), None);
            assert!(diffusion(&scene, Phase::Pore, Axis::Z, edges).is_some());
        }
        println!("| dead end | ∞ | ∞ at {resolution} |");
    }
}

/// Diffusion across a square array of cylinders; Rayleigh gives it as a series in their share f (Phil. Mag. 34, 1892).
#[test]
fn diffusion_round_cylinders_matches_rayleighs_series() {
    let f = PI * 0.04;
    let series = 1.0 - 2.0 * f / (1.0 + f - 0.305827 * f.powi(4));
    let exact = (1.0 - f) / series;
    assert!((exact - 1.1257).abs() < 1e-4);
    for axis in [Axis::X, Axis::Y] {
        converges(
            &format!("diffusion round cylinders, along {}", axis.name()),
            exact,
            // Voxel walls are stairs: the error is of first order, 1.4 % at 32 nodes a period and 0.2 % at 256.
            Within::Share(0.015),
            RESOLUTIONS,
            |n| {
                let scene = scene(solids::cylinder(0.2, 1.0, 96).unwrap(), n);
                scene.measured(diffusion(&scene, Phase::Pore, axis, BoundaryCondition::Periodic).unwrap())
            },
        );
    }
}
