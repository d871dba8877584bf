//! The mesh is a manifold for any content of the images.

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::{Ldi, Mode};
use ldi_ops::mesh::{Precision, TriangleMesh};
use ldi_ops::solids;
use ldi_ops::surface::contour;
use ldi_ops::surface::manifold::ManifoldReport;

use crate::crossings::assert_uncrossed;
use crate::sampled::{assert_solid, nodes, surface_of_expression};
use crate::testing::images::closed;
use crate::testing::random::Congruential;

/// Images with given nodes; the samples lie at arbitrary depths between the nodes.
pub fn images_of(grid: &Grid, inside: impl Fn([u32; 3]) -> bool, noise: &mut Congruential) -> [Ldi; 3] {
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
                    if now != before {
                        let from = if i == 0 { 0 } else { grid.node(i - 1) + 1 };
                        let to = if i == count { grid.length(axis.depth()) } else { grid.node(i) - 1 };
                        depths.push(from + 2 * noise.below((to - from) as usize / 2 + 1) as i32);
                        before = now;
                    }
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
                for (z, plane) in (0..).zip(nodes(&closed(surface.mesh), &grid)) {
                    let words = (rays[0] as usize).div_ceil(64);
                    for (y, row) in (0..).zip(plane.chunks(words)) {
                        (0..rays[0]).for_each(|x| assert_eq!(row[x as usize / 64] >> (x % 64) & 1 == 1, at([x, y, z])));
                    }
                }
            } else {
                assert!(surface.mesh.triangles.is_empty() && surface.mesh.positions.is_empty());
            }
        }
    }
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
    let manifold = ManifoldReport::of(&surface.mesh, Precision::Single);
    assert!(
        manifold.passed() && manifold.genus == Some(0),
        "{what}: genus {:?}, {:?}",
        manifold.genus,
        manifold.failures()
    );
    assert_uncrossed(&surface, &grid, what);
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
