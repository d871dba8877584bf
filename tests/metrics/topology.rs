//! Counts of components and closed pores, and Euler characteristics. Counts are exact at every resolution.

use std::f64::consts::PI;

use ldi_ops::metrics::components::{Components, Connectivity, open_pores};
use ldi_ops::metrics::euler::{Betti, SurfaceCharacteristic, Topology, characteristic};
use ldi_ops::metrics::{BoundaryCondition, NodeSet, Phase};
use ldi_ops::solids::Surface;

use crate::convergence::{Within, converges};
use crate::scene::{Scene, ball, network, struts};
use crate::testing::meshes::hollowed;

const EXACT: Within = Within::Difference(0.0);

fn hollow_ball(resolution: u32) -> (Scene, [NodeSet; 2]) {
    let scene = Scene::of(hollowed(ball(1.0), &ball(0.6)), resolution);
    let phases = Phase::BOTH.map(|phase| phase.nodes(&scene.nodes(), scene.region().nodes()));
    (scene, phases)
}

#[test]
fn a_hollow_is_a_closed_pore() {
    converges(
        "closed pores of a hollow ball",
        4.0 / 3.0 * PI * 0.6f64.powi(3),
        Within::Share(0.01),
        [48, 96, 192],
        |n| {
            let (scene, [_, pore]) = hollow_ball(n);
            let open = open_pores(&pore, scene.region().nodes(), BoundaryCondition::Clip);
            scene.measured(pore.minus(&open).count() as f64 * scene.pitch().powi(3))
        },
    );
    type Count = fn(&NodeSet, &NodeSet) -> f64;
    let counts: [(&str, f64, Count); 5] = [
        ("pieces", 1.0, |solid, _| Components::of(solid, Connectivity::All, BoundaryCondition::Clip).count() as f64),
        // The pores are the hollow and the space around the ball.
        ("pores", 2.0, |_, pore| Components::of(pore, Connectivity::Faces, BoundaryCondition::Clip).count() as f64),
        ("χ", 2.0, |solid, _| characteristic(solid, Connectivity::All, BoundaryCondition::Clip) as f64),
        ("cavities", 1.0, |solid, _| Betti::of(solid, Connectivity::All, BoundaryCondition::Clip).cavities as f64),
        ("tunnels", 0.0, |solid, _| Betti::of(solid, Connectivity::All, BoundaryCondition::Clip).tunnels as f64),
    ];
    for (name, exact, count) in counts {
        converges(&format!("{name} of a hollow ball"), exact, EXACT, [24, 48, 96], |n| {
            let (scene, [solid, pore]) = hollow_ball(n);
            scene.measured(count(&solid, &pore))
        });
    }
}

/// k³ nodes and the 3k²(k − 1) struts between them; struts that end in a face of the box change nothing.
#[test]
fn euler_characteristic_of_strut_blocks_is_nodes_less_struts() {
    for (cells, exact) in [(1, 1.0), (2, -4.0), (3, -27.0)] {
        let resolutions = [24, 32, 48].map(|n| n * cells);
        converges(&format!("χ of {cells}³ cells of struts"), exact, EXACT, resolutions, |n| {
            let scene = Scene::of(struts(cells, 0.15, n / cells), n);
            scene.measured(characteristic(&scene.nodes(), Connectivity::All, BoundaryCondition::Clip) as f64)
        });
        converges(&format!("χ of {cells}³ cells of struts, of the mesh"), exact, EXACT, resolutions, |n| {
            let scene = Scene::of(struts(cells, 0.15, n / cells), 16);
            let mesh = scene.mesh.mesh();
            scene.measured(SurfaceCharacteristic::of(&mesh.positions, &mesh.triangles).of_solid().unwrap())
        });
        converges(&format!("χ of {cells}³ cells of struts, of their box"), -2.0, EXACT, resolutions, |n| {
            let scene = Scene::of(struts(cells, 0.15, n / cells), n);
            let topology = Topology::of(&scene.nodes(), &scene.region(), BoundaryCondition::Clip);
            scene.measured(topology.contribution / f64::from(cells).powi(3))
        });
    }
    converges("connectivity density of 2³ cells of struts", 17.0 / 8.0, Within::Share(1e-6), [32, 48, 64], |n| {
        let scene = Scene::of(struts(2, 0.15, n / 2), n);
        scene.measured(Topology::of(&scene.nodes(), &scene.region(), BoundaryCondition::Clip).connectivity_density)
    });
}

#[test]
fn euler_characteristic_of_periodic_cells_is_exact() {
    let cells = [
        ("gyroid", -4.0, Some(Surface::Gyroid)),
        ("primitive", -2.0, Some(Surface::Primitive)),
        ("diamond", -8.0, Some(Surface::Diamond)),
        ("struts", -2.0, None),
    ];
    for (name, exact, surface) in cells {
        converges(&format!("χ of a cell, {name}"), exact, EXACT, [24, 32, 48], |n| {
            let mesh = surface.map_or_else(|| struts(1, 0.15, n), |surface| network(surface, 1, n));
            let scene = Scene::of(mesh, n);
            scene.measured(characteristic(&scene.nodes(), Connectivity::All, BoundaryCondition::Periodic) as f64)
        });
    }
}
