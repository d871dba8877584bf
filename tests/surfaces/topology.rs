//! The mesh is a manifold for any content of the images.

use std::collections::BTreeSet;

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::{Ldi, Mode};
use ldi_ops::mesh::{ClosedMesh, Precision, TriangleMesh};
use ldi_ops::solids;
use ldi_ops::surface::manifold::ManifoldReport;
use ldi_ops::surface::{Surface, contour};

use crate::crossings::{assert_uncrossed, model};
use crate::sampled::{assert_solid, nodes, surface_of, surface_of_expression};
use crate::testing::images::{closed, grid_around};
use crate::testing::random::Congruential;

/// Images with given nodes; the samples lie at arbitrary depths between the nodes.
pub fn images_of(grid: &Grid, inside: impl Fn([u32; 3]) -> bool, noise: &mut Congruential) -> [Ldi; 3] {
    thin_images_of(grid, inside, 0, noise)
}

/// The same with two more samples between some percentage of neighbouring nodes: a wall, a gap, or three samples.
fn thin_images_of(grid: &Grid, inside: impl Fn([u32; 3]) -> bool, share: usize, noise: &mut Congruential) -> [Ldi; 3] {
    Axis::ALL.map(|axis| {
        let (columns, rows) = grid.image_size(axis);
        let (mut offsets, mut depths) = (vec![0], Vec::new());
        for row in 0..rows {
            for column in 0..columns {
                let mut node = [0; 3];
                (node[axis.column()], node[axis.row()]) = (column, row);
                let count = grid.rays()[axis.depth()];
                let mut before = false;
                for i in 0..=count {
                    node[axis.depth()] = i;
                    let now = i < count && inside(node);
                    let from = if i == 0 { 0 } else { grid.node(i - 1) + 1 };
                    let to = if i == count { grid.length(axis.depth()) } else { grid.node(i) - 1 };
                    let wanted = usize::from(now != before) + if noise.below(100) < share { 2 } else { 0 };
                    let mut between = BTreeSet::new();
                    while between.len() < wanted {
                        between.insert(from + 2 * noise.below((to - from) as usize / 2 + 1) as i32);
                    }
                    depths.extend(between);
                    before = now;
                }
                offsets.push(depths.len() as u32);
            }
        }
        Ldi::from_parts(*grid, axis, offsets, depths, Vec::new()).unwrap()
    })
}

fn grid(rays: [u32; 3]) -> Grid {
    Grid::from_parts(DVec3::new(1.0, -2.0, 0.5), 0.25, rays, 12, 64).unwrap()
}

fn assert_nodes(mesh: TriangleMesh, grid: &Grid, inside: impl Fn([u32; 3]) -> bool) {
    let columns = grid.rays()[0];
    for (z, plane) in (0..).zip(nodes(&closed(mesh), grid)) {
        for (y, row) in (0..).zip(plane.chunks((columns as usize).div_ceil(64))) {
            (0..columns).for_each(|x| assert_eq!(row[x as usize / 64] >> (x % 64) & 1 == 1, inside([x, y, z])));
        }
    }
}

#[test]
fn surfaces_of_random_nodes_are_manifolds_that_contain_those_nodes() {
    let mut noise = Congruential::new(7);
    for (rays, share) in [([7, 6, 9], 2), ([5, 70, 4], 3), ([66, 5, 35], 2), ([1, 1, 1], 1), ([2, 1, 3], 1)] {
        for _ in 0..6 {
            let grid = grid(rays);
            let count = rays.iter().product::<u32>() as usize;
            let signs: Vec<bool> = (0..count).map(|_| noise.below(share) == 0).collect();
            let at = |[x, y, z]: [u32; 3]| signs[((z * rays[1] + y) * rays[0] + x) as usize];
            let images = images_of(&grid, at, &mut noise);
            let surface = contour(images.each_ref(), None, Mode::Exact).unwrap();
            assert_eq!((surface.disagreements, surface.sub_resolution), (0, Default::default()));
            assert_uncrossed(&surface, &grid, &format!("{rays:?}"));
            if signs.iter().any(|&inside| inside) {
                assert_solid(&surface.mesh);
                assert_nodes(surface.mesh, &grid, at);
            } else {
                assert!(surface.mesh.triangles.is_empty() && surface.mesh.positions.is_empty());
            }
        }
    }
}

/// Walls and gaps at random, without normals and with those of a random triangle, which contradict the samples and move vertices past
/// nodes.
#[test]
fn surfaces_of_random_walls_and_gaps_are_manifolds_that_contain_the_nodes() {
    let mut noise = Congruential::new(5);
    let normals: Vec<[f32; 3]> = (0..26)
        .map(|i| if i < 13 { i } else { i + 1 })
        .map(|i| DVec3::new(f64::from(i % 3 - 1), f64::from(i / 3 % 3 - 1), f64::from(i / 9 - 1)).normalize())
        .map(|normal| normal.as_vec3().to_array())
        .collect();
    let mut kept = 0;
    for (round, share) in [10, 40, 70, 100].into_iter().cycle().take(40).enumerate() {
        let rays = [[7, 6, 9], [5, 66, 4], [12, 11, 10]][round % 3];
        let of_nodes = [[0, 1], [1, 1], [1, 12], [11, 12], [1, 3]][round % 5];
        let grid = grid(rays);
        let count = rays.iter().product::<u32>() as usize;
        let signs: Vec<bool> = (0..count).map(|_| noise.below(of_nodes[1]) < of_nodes[0]).collect();
        let at = |[x, y, z]: [u32; 3]| signs[((z * rays[1] + y) * rays[0] + x) as usize];
        let images = thin_images_of(&grid, at, share, &mut noise);
        let images = images.map(|image| {
            let triangles = image.depths().iter().map(|_| noise.below(26) as u32).collect();
            image.with_triangles(triangles).unwrap()
        });
        let plain = images_of(&grid, at, &mut noise);
        for normals in [None, Some(&normals[..])] {
            let surface = contour(images.each_ref(), normals, Mode::Exact).unwrap();
            let of_nodes = contour(plain.each_ref(), None, Mode::Exact).unwrap().mesh.triangles.len();
            kept += usize::from(surface.mesh.triangles.len() != of_nodes);
            if surface.mesh.triangles.is_empty() {
                continue;
            }
            let report = ManifoldReport::of(&surface.mesh, Precision::Single);
            assert!(report.passed(), "{round}: {:?}", report.failures());
            if normals.is_none() {
                assert_nodes(surface.mesh, &grid, at);
            }
        }
    }
    assert!(kept > 40, "{kept}");
}

/// Asserts that a surface is a manifold without handles and crossings, and returns its report.
fn without_handles(surface: &Surface, grid: &Grid, what: &str) -> ManifoldReport {
    let report = ManifoldReport::of(&surface.mesh, Precision::Single);
    assert!(report.passed() && report.genus == Some(0), "{what}: genus {:?}, {:?}", report.genus, report.failures());
    assert_uncrossed(surface, grid, what);
    report
}

/// A box about a point, turned about the origin.
fn turned_box(centre: DVec3, size: DVec3, seed: u32) -> ClosedMesh {
    let mut mesh = solids::cuboid(centre - 0.5 * size, centre + 0.5 * size).unwrap();
    if seed > 0 {
        let axis = DVec3::new(f64::from(seed % 7) - 3.0, f64::from(seed % 5) - 2.2, f64::from(seed % 3) + 0.3);
        mesh.transform(&glam::DAffine3::from_axis_angle(axis.normalize(), 0.7 * f64::from(seed)));
    }
    closed(mesh)
}

#[test]
fn plates_nearer_than_a_pitch_stay_two() {
    for seed in 0..24 {
        for pitches in [0.3, 0.1] {
            let gap = pitches / 40.0;
            let plate = |side: f64| {
                let centre = DVec3::new(0.0, 0.0, side * 0.5 * (0.2 + gap));
                turned_box(centre, DVec3::new(1.0, 0.8, 0.2), seed)
            };
            let [a, b] = [-1.0, 1.0].map(plate);
            let (surface, grid) = surface_of_expression("a | b", &[&a, &b], 40);
            // A node in the tip of a corner may be a part of its own, beside one plate as beside two.
            let [of_a, of_b, of_both] = [surface_of(&a, &grid), surface_of(&b, &grid), surface].map(|surface| {
                let report = without_handles(&surface, &grid, &format!("{seed}"));
                (report.components, report.signed_volume)
            });
            assert_eq!(of_a.0 + of_b.0, of_both.0, "{seed}");
            assert!((of_both.1 - 0.32).abs() < 0.0025, "{seed}: {}", of_both.1);
        }
    }
}

/// Where a wall ends, its rim may be half a pitch away.
#[test]
fn walls_thinner_than_a_pitch_are_there() {
    let mut whole = 0;
    for seed in 0..24 {
        let wall = turned_box(DVec3::splat(0.001), DVec3::new(1.0, 0.8, 0.2 / 40.0), seed);
        let grid = grid_around(&[&wall], 40, 1024);
        let surface = surface_of(&wall, &grid);
        let report = ManifoldReport::of(&surface.mesh, Precision::Single);
        assert!(report.passed(), "{seed}: {:?}", report.failures());
        assert_uncrossed(&surface, &grid, &format!("{seed}"));
        assert_solid(&surface.mesh);
        let share = report.signed_volume / wall.mesh().signed_volume();
        whole += u32::from(report.genus == Some(0) && share > 0.88);
        assert!(share > 0.79 && share < 1.001, "{seed}: {share}");
    }
    assert_eq!(whole, 24);
}

/// Sheets that end in wedges thinner than the lattice: the exact mesh has one component and genus 6.
#[test]
fn sheets_that_end_in_wedges_have_the_topology_of_the_solid() {
    let [gyroid, bone] = ["gyroid_sheet.stl", "bone.stl"].map(|name| closed(model(name)));
    let (surface, grid) = surface_of_expression("a & b", &[&gyroid, &bone], 128);
    let report = ManifoldReport::of(&surface.mesh, Precision::Single);
    assert_eq!((report.components, report.genus), (1, Some(6)));
    assert_uncrossed(&surface, &grid, "gyroid and bone");
    assert!((report.signed_volume / 317.1035 - 1.0).abs() < 1e-3, "{}", report.signed_volume);
}

#[test]
fn images_that_disagree_about_nodes_still_give_a_manifold() {
    let mut noise = Congruential::new(11);
    for mode in [Mode::Exact, Mode::OVER, Mode::UNDER] {
        let grid = grid([9, 8, 7]);
        // Each image has nodes of its own.
        let [x, _, _] = images_of(&grid, |node| (node[0] * 31 + node[1] * 17 + node[2] * 7) % 5 < 2, &mut noise);
        let [_, y, _] = images_of(&grid, |node| (node[0] * 13 + node[1] * 19 + node[2] * 23) % 7 < 3, &mut noise);
        let [_, _, z] = images_of(&grid, |node| (node[0] * 11 + node[1] * 29 + node[2] * 3) % 4 < 2, &mut noise);
        let surface = contour([&x, &y, &z], None, mode).unwrap();
        assert!(surface.disagreements > 0 && surface.sub_resolution.unsupported > 0);
        assert_solid(&surface.mesh);
    }
}

#[test]
fn surfaces_do_not_depend_on_image_order_or_thread_count() {
    let mut noise = Congruential::new(3);
    let grid = grid([40, 30, 80]);
    let images = images_of(&grid, |node| (node[0] / 3 + node[1] / 2 + node[2] / 5) % 3 == 0, &mut noise);
    let with = |threads: usize, [a, b, c]: [usize; 3]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| contour([&images[a], &images[b], &images[c]], None, Mode::Exact).unwrap().mesh)
    };
    let one = with(1, [0, 1, 2]);
    assert!(one == with(3, [2, 0, 1]) && !one.triangles.is_empty());
    assert!(contour([&images[0], &images[1], &images[1]], None, Mode::Exact).is_err());
}

/// The union of two solids that touch along an edge has one or two parts, no handles, and the nodes of both.
fn assert_no_handles(a: TriangleMesh, b: TriangleMesh, rays: u32, what: &str) {
    let (a, b) = (closed(a), closed(b));
    let (surface, grid) = surface_of_expression("a | b", &[&a, &b], rays);
    without_handles(&surface, &grid, what);
    assert_solid(&surface.mesh);
    let [of_a, of_b, found] = [&a, &b, &closed(surface.mesh)].map(|mesh| nodes(mesh, &grid).concat());
    assert!(found.iter().zip(of_a.iter().zip(&of_b)).all(|(&found, (&a, &b))| found == a | b), "{what}");
}

#[test]
fn boxes_that_touch_along_an_oblique_edge_have_no_handles() {
    for (degrees, rays) in [(10.0, 40), (10.0, 64), (30.0, 40), (30.0, 64), (44.0, 40), (44.0, 64)] {
        for axis in [DVec3::Z, DVec3::new(1.0, 2.0, 3.0)] {
            let turn = glam::DAffine3::from_axis_angle(axis.normalize(), f64::to_radians(degrees));
            let turned = |from: DVec3| {
                let mut mesh = solids::cuboid(from, from + 1.0).unwrap();
                mesh.transform(&turn);
                mesh
            };
            let what = format!("{degrees} degrees about {axis}, {rays} rays");
            assert_no_handles(turned(DVec3::ZERO), turned(DVec3::new(1.0, 1.0, 0.0)), rays, &what);
        }
    }
}

/// The solids of the test EdgeUnion2 of manifold3d.
#[test]
fn tetrahedra_that_touch_along_a_diagonal_edge_have_no_handles() {
    let corners = [[-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, 1.0]].map(DVec3::from_array);
    let triangles = vec![[2, 0, 1], [0, 3, 1], [2, 3, 0], [3, 2, 1]];
    let mesh = |place: fn(DVec3) -> DVec3| TriangleMesh {
        positions: corners.map(place).to_vec(),
        triangles: triangles.clone(),
    };
    for rays in [32, 64, 65] {
        let (below, above) = (mesh(|p| p - DVec3::Z), mesh(|p| DVec3::new(-p.y, p.x, p.z + 1.0)));
        assert_no_handles(below, above, rays, &format!("{rays} rays"));
    }
}
