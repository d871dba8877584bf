//! Metrics by inscribed balls: thickness, the largest pore, access from outside, and percolation.

use std::f64::consts::SQRT_2;

use glam::{DAffine3, DQuat, DVec3};
use ldi_ops::grid::Axis;
use ldi_ops::mesh::TriangleMesh;
use ldi_ops::metrics::access::{AccessCurve, Ends, access_sizes, bottlenecks, percolation};
use ldi_ops::metrics::components::{open_pores, rim};
use ldi_ops::metrics::distance::{Crossings, DistanceField};
use ldi_ops::metrics::thickness::{largest_balls, local_thickness, radii};
use ldi_ops::metrics::{BoundaryCondition, Distribution, NodeSet, Phase};
use ldi_ops::solids::{self, Surface};

use crate::convergence::{Within, converges};
use crate::scene::{Scene, ball, cuboid, moved, network, struts};
use crate::testing::meshes::{hollowed, together};

/// One pitch, the tolerance of the specification.
const PITCH: Within = Within::Pitches(1.0);

/// A phase of a scene, and the distances from its nodes to the surface.
struct Balls {
    nodes: NodeSet,
    field: DistanceField,
}

impl Balls {
    fn of(scene: &Scene, phase: Phase, edges: BoundaryCondition) -> Balls {
        let region = scene.region();
        let field = DistanceField::of(&Crossings::of_images(&scene.images, &region, edges), edges);
        Balls { nodes: phase.nodes(&scene.nodes(), region.nodes()), field }
    }

    /// Returns the distribution of the local thickness, in world units.
    fn thickness(&self, scene: &Scene) -> Distribution {
        Distribution::of_map(&local_thickness(&self.field, &self.nodes), scene.pitch()).unwrap()
    }

    fn largest(&self, scene: &Scene) -> f64 {
        let most = largest_balls(&self.field, &self.nodes).iter().fold(0.0, |most: f32, ball| most.max(ball.radius));
        2.0 * f64::from(most) * scene.pitch()
    }

    fn spans(&self, scene: &Scene, axis: Axis, edges: BoundaryCondition) -> f64 {
        let rooms = radii(self.field.values().to_vec(), &self.nodes, &largest_balls(&self.field, &self.nodes));
        let ends = Ends::of_raster(self.nodes.size(), axis);
        percolation(&rooms, &self.nodes, &ends, edges).unwrap().diameter * scene.pitch()
    }
}

fn mean_thickness(mesh: TriangleMesh, resolution: u32) -> crate::convergence::Measured {
    let scene = Scene::of(mesh, resolution);
    scene.measured(Balls::of(&scene, Phase::Solid, BoundaryCondition::Clip).thickness(&scene).mean())
}

/// A ball of radius R at R/h = 4, 8 and 24. Voxel programs give 0.60, 0.81 and 0.95 of 2R.
#[test]
fn thickness_of_a_ball_converges_to_its_diameter() {
    converges("thickness of a ball", 2.0, PITCH, [8, 16, 48], |n| mean_thickness(ball(1.0), n));
    // This centre avoids the symmetry planes of the nodes.
    converges("thickness of a turned box of rays, ball", 2.0, PITCH, [9, 17, 49], |n| {
        let speck = |at: DVec3| moved(ball(0.05), DAffine3::from_translation(at));
        let corners = [DVec3::splat(-1.37), DVec3::new(1.21, 1.43, 1.33)];
        let scene = Scene::of(together(&[ball(1.0), speck(corners[0]), speck(corners[1])]), n * 11 / 8);
        let balls = Balls::of(&scene, Phase::Solid, BoundaryCondition::Clip);
        scene.measured(balls.thickness(&scene).quantile(0.5))
    });
}

/// A parallelogram, extruded along y, whose ends are faces of its box. Such faces are no surface, so the plate has no end.
fn slab(thickness: f64, slope: f64) -> TriangleMesh {
    let rise = 0.5 * thickness / slope.cos();
    let mut mesh = cuboid(DVec3::ONE);
    for p in &mut mesh.positions {
        p.z = p.x * slope.tan() + 2.0 * p.z * rise;
    }
    mesh
}

#[test]
fn thickness_of_tilted_slabs_converges_to_their_width() {
    for degrees in [7.0f64, 20.0, 33.0, 45.0] {
        converges(&format!("thickness of a slab at {degrees}°"), 0.217, PITCH, [24, 48, 96], |n| {
            let scene = Scene::of(slab(0.217, degrees.to_radians()), n);
            // At the ends of the slab a ball that touches one face does not reach the other.
            scene.measured(Balls::of(&scene, Phase::Solid, BoundaryCondition::Clip).thickness(&scene).quantile(0.5))
        });
    }
}

#[test]
fn thickness_and_separation_of_plates_converge_to_their_distances() {
    let plate = |z, thickness| {
        moved(cuboid(DVec3::new(1.0, 1.0, thickness)), DAffine3::from_translation(DVec3::new(0.0, 0.0, z)))
    };
    // The box cuts the outer plates, so their thickness is unknown. The pores between the plates are 0.35 and 0.2 wide.
    let plates = || together(&[plate(-0.45, 0.1), plate(0.0, 0.1), plate(0.375, 0.25)]);
    converges("separation of plates, widest", 0.35, PITCH, [32, 64, 128], |n| {
        let scene = Scene::of(plates(), n);
        scene.measured(Balls::of(&scene, Phase::Pore, BoundaryCondition::Clip).thickness(&scene).quantile(0.9))
    });
    converges("separation of plates, narrowest", 0.2, PITCH, [32, 64, 128], |n| {
        let scene = Scene::of(plates(), n);
        scene.measured(Balls::of(&scene, Phase::Pore, BoundaryCondition::Clip).thickness(&scene).quantile(0.1))
    });
    converges("thinnest plate, 1st percentile", 0.1, PITCH, [32, 64, 128], |n| {
        let scene = Scene::of(plates(), n);
        scene.measured(Balls::of(&scene, Phase::Solid, BoundaryCondition::Clip).thickness(&scene).quantile(0.01))
    });
}

#[test]
fn thickness_of_rods_converges_to_their_diameter() {
    converges("thickness of a rod that the box cuts", 0.5, PITCH, [8, 16, 32], |n| {
        mean_thickness(solids::cylinder(0.25, 0.5, 180).unwrap(), n)
    });
    converges("thickness of a tilted rod", 0.4, PITCH, [24, 48, 96], |n| {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 0.3, 0.0).normalize(), 0.7);
        let scene = Scene::of(moved(solids::cylinder(0.2, 2.0, 180).unwrap(), DAffine3::from_quat(turn)), n);
        scene.measured(Balls::of(&scene, Phase::Solid, BoundaryCondition::Clip).thickness(&scene).quantile(0.5))
    });
}

/// Three struts hold a ball that touches the eight points where the sides of all three meet: its diameter is √6 of their
/// radius.
///
/// These points are the bottoms of notches, whose sides rise in proportion to the distance from the bottom. The offset of the
/// nearest crossing of a ray therefore counts linearly, not squared, and the error stays at about one pitch at every resolution.
#[test]
fn thickness_of_a_strut_node_converges_to_root_six_radii() {
    converges("thickness of a strut node", 6.0f64.sqrt() * 0.15, Within::Pitches(1.25), [32, 64, 128], |n| {
        let scene = Scene::of(struts(1, 0.15, 64), n);
        scene.measured(Balls::of(&scene, Phase::Solid, BoundaryCondition::Clip).thickness(&scene).max())
    });
}

#[test]
fn percolation_and_largest_pore_of_struts_converge_to_closed_forms() {
    for edges in [BoundaryCondition::Clip, BoundaryCondition::Periodic] {
        let balls = |n: u32| {
            let scene = Scene::of(struts(2, 0.15, 48), n);
            let balls = Balls::of(&scene, Phase::Pore, edges);
            (scene, balls)
        };
        let name = edges.name();
        for axis in Axis::ALL {
            let metric = format!("percolation of struts along {}, {name}", axis.name());
            converges(&metric, 1.0 - 0.3, PITCH, [32, 48, 96], |n| {
                let (scene, balls) = balls(n);
                scene.measured(balls.spans(&scene, axis, edges))
            });
        }
        if edges == BoundaryCondition::Periodic {
            converges(&format!("largest pore of struts, {name}"), SQRT_2 - 0.3, PITCH, [32, 48, 96], |n| {
                let (scene, balls) = balls(n);
                scene.measured(balls.largest(&scene))
            });
        }
    }
}

#[test]
fn percolation_and_largest_pore_of_a_gyroid_converge() {
    let balls = |n: u32| {
        let scene = Scene::of(network(Surface::Gyroid, 1, 64), n);
        let balls = Balls::of(&scene, Phase::Pore, BoundaryCondition::Periodic);
        (scene, balls)
    };
    // The middle of a pore is at (⅛, ⅛, ⅛) of a cell, where |f| is greatest. The surface is nearest to it at (0, 0, 0), √3/8
    // away; that point lies on the way through the pore.
    converges("percolation of a gyroid", 0.25 * 3.0f64.sqrt(), Within::Share(0.02), [48, 64, 96], |n| {
        let (scene, balls) = balls(n);
        scene.measured(balls.spans(&scene, Axis::X, BoundaryCondition::Periodic))
    });
    converges("largest pore of a gyroid", 0.459, PITCH, [32, 64, 96], |n| {
        let (scene, balls) = balls(n);
        scene.measured(balls.largest(&scene))
    });
}

/// No ball from outside enters the hollow of a ball; the share of the other pores that is reached falls as the entering ball
/// grows.
#[test]
fn access_starts_at_the_open_share_and_never_rises_with_ball_size() {
    for resolution in [24, 48, 96] {
        let scene = Scene::of(hollowed(ball(1.0), &ball(0.6)), resolution);
        let region = scene.region();
        let Balls { nodes, field } = Balls::of(&scene, Phase::Pore, BoundaryCondition::Clip);
        let balls = largest_balls(&field, &nodes);
        let gets_there = bottlenecks(
            &radii(field.values().to_vec(), &nodes, &balls),
            &nodes,
            &rim(region.nodes()),
            BoundaryCondition::Clip,
        );
        let open = open_pores(&nodes, region.nodes(), BoundaryCondition::Clip);
        let [columns, rows, _] = nodes.size();
        let is_reached = |[x, y, z]: [usize; 3]| gets_there[(z * rows + y) * columns + x] > 0.0;
        assert!(open == NodeSet::from_fn(nodes.size(), is_reached));
        let sizes = access_sizes(&balls, &gets_there, &open, BoundaryCondition::Clip);
        let curve = AccessCurve::of(&sizes, &open, &nodes, scene.pitch()).unwrap();
        let share = open.count() as f64 / nodes.count() as f64;
        assert!(
            curve.open_share() == share && curve.share(0.0) == share && share < 1.0,
            "{} {share}",
            curve.open_share()
        );
        let points: Vec<(f64, f64)> = curve.points().collect();
        assert!(points.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 >= pair[1].1));
        println!("| A(0) of a hollow ball | {share:.5} | {:.5} at {resolution} |", curve.open_share());
    }
}
