//! Surfaces within a bound of the samples: few triangles where they are flat, and as sound as those of single cells.

use glam::{DAffine3, DVec3};
use ldi_ops::grid::Grid;
use ldi_ops::ldi::{Ldi, Mode};
use ldi_ops::mesh::{ClosedMesh, Precision};
use ldi_ops::solids;
use ldi_ops::surface::manifold::ManifoldReport;
use ldi_ops::surface::{Coordinates, Surface, contour_in};

use crate::crossings::{assert_uncrossed, model};
use crate::sampled::{assert_solid, images, nodes, surface_of};
use crate::testing::images::closed;
use crate::testing::near::Near;
use crate::testing::random::Congruential;
use crate::topology::images_of;

const BOUND: f64 = 0.05;

fn within(images: &[Ldi; 3], normals: Option<&[[f32; 3]]>, bound: f64) -> Surface {
    contour_in(images.each_ref(), normals, Mode::Exact, Coordinates::default(), bound).unwrap()
}

/// Returns the samples of images in world coordinates.
fn samples(images: &[Ldi; 3], grid: &Grid) -> Vec<DVec3> {
    let of_image = |image: &Ldi| {
        let axis = image.axis();
        let (columns, rows) = image.size();
        let mut found = Vec::new();
        for ray in 0..columns * rows {
            let mut at = DVec3::ZERO;
            at[axis.column()] = f64::from(grid.node(ray % columns));
            at[axis.row()] = f64::from(grid.node(ray / columns));
            for &depth in image.samples(ray) {
                at[axis.depth()] = f64::from(depth);
                found.push(grid.origin() + at * grid.pitch() / f64::from(1u32 << grid.shift()));
            }
        }
        found
    };
    images.iter().flat_map(of_image).collect()
}

/// Checks the surface of a solid within a bound against that of single cells, and returns the numbers of their triangles.
fn check(mesh: &ClosedMesh, grid: &Grid, bound: f64, what: &str) -> [usize; 2] {
    let (images, normals) = images(mesh, grid);
    let [single, few] = [0.0, bound].map(|bound| within(&images, Some(&normals), bound));
    assert_solid(&few.mesh);
    assert_uncrossed(&few, grid, what);
    let [one, other] = [&single, &few].map(|surface| ManifoldReport::of(&surface.mesh, Precision::Single));
    assert_eq!((one.components, one.genus), (other.components, other.genus), "{what}");
    assert_eq!((single.sub_resolution, single.disagreements), (few.sub_resolution, few.disagreements), "{what}");
    let near = [&single, &few].map(|surface| Near::new(&surface.mesh, grid.pitch()));
    // In pitches, and infinite beyond one.
    let distance = |near: &Near, point| near.distance(point).map_or(f64::INFINITY, |away| away / grid.pitch());
    let (to_single, to_few) = (|point| distance(&near[0], point), |point| distance(&near[1], point));
    for sample in samples(&images, grid) {
        let (before, after) = (to_single(sample), to_few(sample));
        assert!(after <= bound.max(before) + 1e-6, "{what}: {sample}: {before} {after}");
        // Of samples of walls and gaps below the pitch nothing is said.
        let is_all = few.sub_resolution == Default::default();
        assert!(!is_all || after * grid.pitch() <= few.distance + 1e-9, "{what}: {sample}: {after}");
    }
    // The bound is one of samples: points of the triangles may be further from the surface of single cells, which is itself off
    // the solid where that bends, and nodes as near to it may change sides.
    for triangle in &few.mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| few.mesh.positions[vertex as usize]);
        for point in [a, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0, (a + b + c) / 3.0] {
            let away = to_single(point);
            assert!(away <= 2.0 * bound, "{what}: {point} is {away} away");
        }
    }
    let (before, after) = (nodes(&closed(single.mesh.clone()), grid), nodes(&closed(few.mesh.clone()), grid));
    let words = (grid.rays()[0] as usize).div_ceil(64);
    for (z, (before, after)) in (0..).zip(before.iter().zip(&after)) {
        for (place, (before, after)) in before.iter().zip(after).enumerate() {
            for bit in (0..64).filter(|bit| (before ^ after) >> bit & 1 == 1) {
                let node = [(place % words * 64 + bit) as u32, (place / words) as u32, z];
                let at = DVec3::from_array(node.map(|i| f64::from(grid.node(i))));
                let away = to_single(grid.origin() + at * grid.pitch() / f64::from(1u32 << grid.shift()));
                assert!(away <= 2.0 * bound, "{what}: node {node:?} is {away} away");
            }
        }
    }
    [single.mesh.triangles.len(), few.mesh.triangles.len()]
}

#[test]
fn models_stay_within_the_bound() {
    let ell = solids::ell(DVec3::new(3.0, 2.0, 1.0), [1.2, 0.7]).unwrap();
    let cases = [
        ("ell", ell, &[33, 64][..]),
        ("geodesic", model("geodesic.obj"), &[33, 64]),
        ("bone", model("bone.stl"), &[64]),
        ("lattice", model("bcc_lattice.stl"), &[33]),
    ];
    for (name, mesh, resolutions) in cases {
        let mesh = closed(mesh);
        for &rays in resolutions {
            let grid = Grid::with_resolution(mesh.bounds(), rays, 1024).unwrap();
            for bound in [BOUND, 0.3] {
                let [single, few] = check(&mesh, &grid, bound, &format!("{name} at {rays} within {bound}"));
                println!("{name} at {rays} within {bound}: {single} and {few} triangles");
                assert!(few < single, "{name}: {single} {few}");
            }
        }
    }
}

#[test]
fn the_faces_of_turned_cubes_have_few_triangles() {
    let mut noise = Congruential::new(5);
    for i in 0..3 {
        let mut cube = solids::cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap();
        let axis = DVec3::from_array([0; 3].map(|_| noise.below(1000) as f64 - 499.5)).normalize();
        cube.transform(&DAffine3::from_axis_angle(axis, noise.below(1000) as f64 / 500.0));
        let cube = closed(cube);
        let grid = Grid::with_resolution(cube.bounds(), 256, 1024).unwrap();
        let (images, normals) = images(&cube, &grid);
        let surface = within(&images, Some(&normals), BOUND);
        assert_solid(&surface.mesh);
        assert!((surface.mesh.signed_volume() - 8.0).abs() < 1e-3, "{}", surface.mesh.signed_volume());
        for corner in &cube.mesh().positions {
            let nearest = surface.mesh.positions.iter().map(|p| p.distance(*corner)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-5 * grid.pitch(), "{i}: {corner} {}", nearest / grid.pitch());
        }
        let single = surface_of(&cube, &grid).mesh.triangles.len();
        println!("cube {i}: {single} and {} triangles", surface.mesh.triangles.len());
        assert!(4 * surface.mesh.triangles.len() < single, "{i}: {} {single}", surface.mesh.triangles.len());
    }
}

#[test]
fn surfaces_of_random_nodes_without_normals_are_manifolds() {
    let mut noise = Congruential::new(31);
    let grid = |rays| Grid::from_parts(DVec3::new(1.0, -2.0, 0.5), 0.25, rays, 12, 64).unwrap();
    for rays in [[40, 9, 37], [66, 35, 8]] {
        for (tilt, rough) in [(0.0, 0), (0.1, 0), (0.0, 2), (0.2, 1), (0.0, 60)] {
            let grid = grid(rays);
            // A plane whose nodes change sides here and there, and specks.
            let count = rays.iter().product::<u32>() as usize;
            let flips: Vec<bool> = (0..count).map(|_| noise.below(100) < rough).collect();
            let inside = |[x, y, z]: [u32; 3]| {
                let height = f64::from(z) - 4.0 - tilt * f64::from(x + y);
                let is_flipped = flips[((z * rays[1] + y) * rays[0] + x) as usize];
                (height < 0.0) != (is_flipped && (height.abs() < 2.0 || rough > 50))
            };
            let images = images_of(&grid, inside, &mut noise);
            for bound in [BOUND, 0.5] {
                let surface = within(&images, None, bound);
                assert_solid(&surface.mesh);
                assert_uncrossed(&surface, &grid, &format!("{rays:?} {tilt} {rough}"));
            }
        }
    }
}

#[test]
fn images_without_normals_have_few_triangles_too() {
    let cube = closed(solids::cuboid(DVec3::splat(-1.0), DVec3::new(1.0, 1.2, 1.7)).unwrap());
    let grid = Grid::with_resolution(cube.bounds(), 64, 1024).unwrap();
    let (images, _) = images(&cube, &grid);
    let [single, few] = [0.0, BOUND].map(|bound| within(&images, None, bound).mesh);
    assert_solid(&few);
    assert!(2 * few.triangles.len() < single.triangles.len(), "{} {}", few.triangles.len(), single.triangles.len());
    assert!((few.signed_volume() / single.signed_volume() - 1.0).abs() < 1e-3);
}

#[test]
fn results_do_not_depend_on_threads() {
    let mesh = closed(model("bone.stl"));
    let grid = Grid::with_resolution(mesh.bounds(), 100, 1024).unwrap();
    let (images, normals) = images(&mesh, &grid);
    let of_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| within(&images, Some(&normals), BOUND).mesh)
    };
    let mesh = of_threads(1);
    assert!(mesh.triangles.len() < within(&images, Some(&normals), 0.0).mesh.triangles.len() && mesh == of_threads(5));
}
