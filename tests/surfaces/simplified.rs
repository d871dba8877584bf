//! Simplified surfaces: few triangles within a bound, as sound as before, around the same nodes.

use glam::{DAffine3, DVec3};
use ldi_ops::grid::Grid;
use ldi_ops::ldi::Mode;
use ldi_ops::mesh::{ClosedMesh, Precision};
use ldi_ops::solids;
use ldi_ops::surface::manifold::ManifoldReport;
use ldi_ops::surface::simplify::{Limits, simplify};
use ldi_ops::surface::{Surface, contour};

use crate::crossings::{assert_uncrossed, model};
use crate::sampled::{assert_solid, nodes, surface_of, surface_of_expression};
use crate::testing::images::closed;
use crate::testing::near::Near;
use crate::testing::random::Congruential;
use crate::topology::images_of;

/// Returns a surface with fewer triangles within a bound, in pitches.
fn simplified(surface: &Surface, grid: &Grid, bound: f64) -> Surface {
    let limits = Limits { bound: bound * grid.pitch(), grid: Some(grid), precision: Precision::Single };
    Surface { mesh: simplify(&surface.mesh, &limits, |_| Vec::new()).unwrap().mesh, ..surface.clone() }
}

/// As [`simplified`], with the nodes that change sides as the caller's criterion: nodes may lie on a surface as rough as noise.
fn simplified_around_nodes(surface: &Surface, grid: &Grid, bound: f64) -> Surface {
    let limits = Limits { bound: bound * grid.pitch(), grid: Some(grid), precision: Precision::Single };
    let expected = nodes(&closed(surface.mesh.clone()), grid);
    let words = grid.rays()[0].div_ceil(64) as usize;
    let result = simplify(&surface.mesh, &limits, |mesh| {
        let found = nodes(&closed(mesh.clone()), grid);
        let mut places = Vec::new();
        for (z, (expected, found)) in expected.iter().zip(&found).enumerate() {
            for (at, changed) in expected.iter().zip(found).map(|(one, other)| one ^ other).enumerate() {
                for bit in (0..64).filter(|bit| changed >> bit & 1 == 1) {
                    let node = [at % words * 64 + bit, at / words, z].map(|i| f64::from(grid.node(i as u32)));
                    places.push(grid.origin() + grid.step() * DVec3::from_array(node));
                }
            }
        }
        places
    });
    Surface { mesh: result.unwrap().mesh, ..surface.clone() }
}

/// Checks the simplified surface of a solid, and returns the numbers of triangles before and after.
fn check(mesh: &ClosedMesh, grid: &Grid, bound: f64, what: &str) -> [usize; 2] {
    let single = surface_of(mesh, grid);
    let few = simplified(&single, grid, bound);
    assert_solid(&few.mesh);
    assert_uncrossed(&few, grid, what);
    let [one, other] = [&single, &few].map(|surface| ManifoldReport::of(&surface.mesh, Precision::Single));
    assert_eq!((one.components, one.genus), (other.components, other.genus), "{what}");
    let near = [&single, &few].map(|surface| Near::new(&surface.mesh, grid.pitch()));
    let away = |near: &Near, point| near.distance(point).map_or(f64::INFINITY, |away| away / grid.pitch());
    for &point in &single.mesh.positions {
        let away = away(&near[1], point);
        assert!(away <= bound * (1.0 + 1e-9), "{what}: {point} is {away} away");
    }
    // Each side is one of two triangles.
    let mut noise = Congruential::new(few.mesh.triangles.len() as u64);
    for triangle in &few.mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| few.mesh.positions[vertex as usize]);
        let on_sides = [[a, b], [b, c], [c, a]].map(|[one, other]| [0; 4].map(|_| one.lerp(other, noise.share())));
        let inside = [0; 4].map(|_| a.lerp(b.lerp(c, noise.share()), noise.share()));
        for point in on_sides.into_iter().flatten().chain(inside) {
            let away = away(&near[0], point);
            assert!(away <= bound * (1.0 + 1e-9), "{what}: {point} is {away} away");
        }
    }
    let [before, after] = [single.mesh, few.mesh].map(|mesh| (mesh.triangles.len(), nodes(&closed(mesh), grid)));
    assert!(before.1 == after.1, "{what}: nodes changed sides");
    [before.0, after.0]
}

#[test]
fn models_stay_within_the_bound_and_around_their_nodes() {
    let ell = solids::ell(DVec3::new(3.0, 2.0, 1.0), [1.2, 0.7]).unwrap();
    let cases = [
        ("ell", ell, 64, 30.0),
        ("geodesic", model("geodesic.obj"), 64, 4.0),
        ("bone", model("bone.stl"), 100, 3.0),
        ("lattice", model("bcc_lattice.stl"), 50, 1.5),
    ];
    for (name, mesh, rays, least) in cases {
        let mesh = closed(mesh);
        let grid = Grid::with_resolution(mesh.bounds(), rays, 1024).unwrap();
        for bound in [0.05, 0.3] {
            let [before, after] = check(&mesh, &grid, bound, &format!("{name} at {rays} within {bound}"));
            println!("{name} at {rays} within {bound}: {before} and {after} triangles");
            assert!(least * after as f64 <= before as f64, "{name}: {before} {after}");
        }
    }
}

#[test]
fn turned_cubes_have_twelve_triangles_and_their_corners() {
    let mut noise = Congruential::new(5);
    let mut cubes = Vec::new();
    for _ in 0..60 {
        let mut cube = solids::cuboid(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap();
        let axis = DVec3::from_array([0; 3].map(|_| noise.below(1000) as f64 - 499.5)).normalize();
        cube.transform(&DAffine3::from_axis_angle(axis, noise.below(1000) as f64 / 500.0));
        cubes.push(closed(cube));
    }
    for (rays, exceptions) in [(50, vec![45]), (100, vec![])] {
        let mut more = Vec::new();
        for (i, cube) in cubes.iter().enumerate() {
            let grid = Grid::with_resolution(cube.bounds(), rays, 1024).unwrap();
            let [before, after] = check(cube, &grid, 0.05, &format!("cube {i}"));
            let few = simplified(&surface_of(cube, &grid), &grid, 0.05).mesh;
            let away = |corner: &DVec3| few.positions.iter().map(|p| p.distance(*corner)).fold(f64::INFINITY, f64::min);
            let farthest = cube.mesh().positions.iter().map(away).fold(0.0, f64::max) / grid.pitch();
            println!("cube {i} at {rays} rays: {before} and {after} triangles, corners {farthest} pitches away");
            assert!(after <= 32 && farthest < 1e-6, "{i} at {rays} rays: {after} {farthest}");
            more.extend((after > 12).then_some(i));
        }
        // Why one cube keeps more triangles is not known.
        assert_eq!(more, exceptions, "{rays} rays");
    }
}

/// The common part of a ball and a half space, whose surface is known everywhere.
#[test]
fn a_ball_cut_by_a_plane_keeps_its_flat_face_and_its_rim() {
    let ball = closed(solids::geodesic(1.0, 64).unwrap());
    let normal = DVec3::new(2.0, -1.0, 3.0).normalize();
    let turn = glam::DQuat::from_rotation_arc(DVec3::Z, normal);
    let mut half = solids::cuboid(DVec3::new(-2.0, -2.0, -3.0), DVec3::new(2.0, 2.0, 0.4)).unwrap();
    half.transform(&DAffine3::from_quat(turn));
    let (surface, grid) = surface_of_expression("a & b", &[&ball, &closed(half)], 200);
    let few = simplified(&surface, &grid, 0.05);
    assert_solid(&few.mesh);
    assert_uncrossed(&few, &grid, "a cut ball");
    let pitch = grid.pitch();
    // Chords of the ball's triangles and of the cells are 0.01 pitches off.
    let most = 0.06 * pitch;
    let mut noise = Congruential::new(3);
    let mut flat = 0;
    for triangle in &few.mesh.triangles {
        let corners @ [a, b, c] = triangle.map(|vertex| few.mesh.positions[vertex as usize]);
        flat += usize::from(corners.iter().all(|corner| (corner.dot(normal) - 0.4).abs() < most));
        for point in corners.into_iter().chain([0; 8].map(|_| a.lerp(b.lerp(c, noise.share()), noise.share()))) {
            let away = (point.length() - 1.0).max(point.dot(normal) - 0.4);
            assert!(away.abs() < most, "{point} is {} pitches away", away / pitch);
        }
    }
    let near = Near::new(&few.mesh, pitch);
    for i in 0..1000 {
        let (sine, cosine) = (f64::from(i) * 0.00628).sin_cos();
        let radius = (1.0 - 0.4 * 0.4_f64).sqrt();
        let rim = turn * DVec3::new(radius * cosine, radius * sine, 0.4);
        let away = near.distance(rim).unwrap();
        assert!(away < most, "the rim at {rim} is {} pitches away", away / pitch);
    }
    let counts = [surface.mesh.triangles.len(), few.mesh.triangles.len(), flat];
    println!("{counts:?} triangles: of the full mesh, within the bound, and of the flat face");
    assert!(8 * counts[1] < counts[0] && 8 * flat < counts[1], "{counts:?}");
}

#[test]
fn surfaces_of_random_nodes_stay_manifolds_around_them() {
    let mut noise = Congruential::new(31);
    for (rays, rough) in [([40, 9, 37], 0), ([66, 35, 8], 2), ([20, 20, 20], 60)] {
        let grid = Grid::from_parts(DVec3::new(1.0, -2.0, 0.5), 0.25, rays, 12, 64).unwrap();
        // A plane whose nodes change sides here and there, and specks.
        let flips: Vec<bool> = (0..rays.iter().product::<u32>()).map(|_| noise.below(100) < rough).collect();
        let inside = |[x, y, z]: [u32; 3]| {
            let height = f64::from(z) - 4.0 - 0.1 * f64::from(x + y);
            let is_flipped = flips[((z * rays[1] + y) * rays[0] + x) as usize];
            (height < 0.0) != (is_flipped && (height.abs() < 2.0 || rough > 50))
        };
        let images = images_of(&grid, inside, &mut noise);
        let single = contour(images.each_ref(), None, Mode::Exact).unwrap();
        for bound in [0.05, 0.5] {
            let moved = nodes(&closed(simplified(&single, &grid, bound).mesh), &grid);
            let all = nodes(&closed(single.mesh.clone()), &grid);
            let moved: u32 = moved.iter().flatten().zip(all.iter().flatten()).map(|(a, b)| (a ^ b).count_ones()).sum();
            assert!(moved <= 2, "{rays:?} within {bound}: {moved} nodes");
            let few = simplified_around_nodes(&single, &grid, bound);
            assert_solid(&few.mesh);
            assert_uncrossed(&few, &grid, &format!("{rays:?} {rough}"));
            assert!(few.mesh.triangles.len() < single.mesh.triangles.len());
            let [before, after] = [&single, &few].map(|surface| nodes(&closed(surface.mesh.clone()), &grid));
            assert!(before == after, "{rays:?} within {bound}: nodes changed sides");
        }
    }
}
