//! Meshes of sums and offsets, with finer cells where they lack details.

use glam::{DAffine3, DVec3};
use ldi_ops::driver::Bound;
use ldi_ops::ldi::NodePlanes;
use ldi_ops::mesh::{Precision, TriangleMesh};
use ldi_ops::surface::simplify::crossing_pairs;
use ldi_ops::{Axis, Mode, Sampled, Settings, Shape, Solid, solids};

use crate::crossings::model;
use crate::sampled::{assert_solid, nodes};
use crate::testing::images::closed;
use crate::testing::meshes::cube;
use crate::testing::random::Congruential;

/// Returns the number of walls and gaps that the full mesh with cells halved up to some times lacks, as its report says.
fn lost(sampled: &Sampled, levels: u32) -> u64 {
    let file = tempfile::Builder::new().suffix(".ply").tempfile().unwrap();
    let surface = sampled.surface().unwrap().within(Bound::ZERO).refined(levels);
    let report = surface.write(file.path()).unwrap();
    let lost = report.sampled().unwrap();
    lost.walls + lost.gaps
}

/// Returns the full mesh with cells halved up to some times, which is a manifold around the nodes of the images.
fn mesh(sampled: &Sampled, levels: u32, what: &str) -> TriangleMesh {
    let mesh = sampled.surface().unwrap().within(Bound::ZERO).refined(levels).mesh().unwrap();
    assert_solid(&mesh);
    let images = Axis::ALL.map(|axis| sampled.image(axis).unwrap());
    let planes: Vec<Vec<u64>> = NodePlanes::new(images, Mode::Exact).unwrap().planes().collect();
    assert!(nodes(&closed(mesh.clone()), sampled.grid()) == planes, "{what}: nodes at {levels} levels");
    mesh
}

fn solid(mesh: TriangleMesh) -> Solid {
    Solid::from_triangles(mesh.positions, mesh.triangles).unwrap()
}

#[test]
fn finer_cells_of_sums_keep_the_nodes_and_lack_less() {
    let gyroid = solid(model("gyroid_sheet.stl"));
    let bone = solid(model("bone.stl"));
    let mut die = cube(DVec3::splat(-0.2), 0.4);
    die.transform(&DAffine3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7));
    let die = solid(die);
    let cases: [(&str, Shape, u32); 6] = [
        ("gyroid + 0.2", gyroid.offset(0.2), 64),
        ("gyroid − 0.25", gyroid.offset(-0.25), 64),
        ("gyroid opened", gyroid.open(0.1), 64),
        ("gyroid ⊕ die", gyroid.minkowski_sum(&die), 48),
        ("gyroid ⊖ die", gyroid.minkowski_difference(&die), 64),
        ("bone − 0.5", bone.offset(-0.5), 64),
    ];
    let mut all = [0; 2];
    for (what, shape, rays) in cases {
        let sampled = shape.sample(&Settings::rays(rays)).unwrap();
        let plain = mesh(&sampled, 0, what);
        for levels in [1, 3] {
            let fine = mesh(&sampled, levels, what);
            let [crossing_plain, crossing] = [&plain, &fine].map(|mesh| crossing_pairs(mesh, Precision::Double));
            assert!(crossing <= crossing_plain, "{what}: {crossing} crossing pairs at {levels} levels");
        }
        let [before, after] = [0, 3].map(|levels| lost(&sampled, levels));
        assert!(after < before, "{what}: {before} walls and gaps are lost, with finer cells {after}");
        all = [all[0] + before, all[1] + after];
    }
    assert!(2 * all[1] < all[0], "{all:?}");
}

/// Where a surface folds over itself, the rays and the exact test of a point need not agree about the inside of an offset inwards.
#[test]
fn folded_surfaces_stay_as_they_are_where_finer_rays_disagree() {
    for (seed, distance) in [(4, -0.02), (4, -0.05), (5, -0.05), (6, -0.05)] {
        let (mut ball, mut noise) = (solids::geodesic(1.0, 20).unwrap(), Congruential::new(seed));
        ball.positions.iter_mut().for_each(|place| {
            (0..3).for_each(|i| place[i] += 0.12 * (noise.share() - 0.5));
        });
        let sampled = solid(ball).offset(distance).sample(&Settings::rays(60)).unwrap();
        assert!(lost(&sampled, 0) > 0, "{seed}");
        mesh(&sampled, 3, "a folded ball");
    }
}
