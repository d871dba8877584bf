//! Checks that no two triangles of a surface cross, by an exact integer test of all pairs that shares no code with the library's.

use std::path::Path;

use glam::DVec3;
use ldi_ops::grid::Grid;
use ldi_ops::mesh::{TriangleMesh, io};
use ldi_ops::solids;
use ldi_ops::surface::Surface;

use crate::sampled::{assert_solid, nodes, surface_of, surface_of_expression};
use crate::testing::images::closed;

type Point = [i128; 3];

fn minus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn cross(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn dot(a: Point, b: Point) -> i128 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// Returns the sign of the volume that four points span.
fn volume([a, b, c]: [Point; 3], d: Point) -> i128 {
    dot(cross(minus(b, a), minus(c, a)), minus(d, a)).signum()
}

/// Returns whether a segment passes through or ends in the interior of a triangle or of its sides; false if it lies in the
/// triangle's plane.
fn pierces([p, q]: [Point; 2], [a, b, c]: [Point; 3]) -> bool {
    let ends = [volume([a, b, c], p), volume([a, b, c], q)];
    if ends[0] * ends[1] > 0 || ends == [0, 0] {
        return false;
    }
    let turns = [volume([p, q, a], b), volume([p, q, b], c), volume([p, q, c], a)];
    !(turns.contains(&1) && turns.contains(&-1))
}

/// Returns whether two triangles share a point that is not on a common corner or side; false for two triangles in one plane.
fn cross_one_another(one: [u32; 3], other: [u32; 3], points: &[Point]) -> bool {
    let at = |triangle: [u32; 3]| triangle.map(|vertex| points[vertex as usize]);
    let pierced = |by: [u32; 3], triangle: [u32; 3]| {
        // A side that ends in a corner of the triangle begins there, or lies in its plane.
        let sides = [[by[0], by[1]], [by[1], by[2]], [by[2], by[0]]];
        let free = sides.into_iter().filter(|side| !side.iter().any(|vertex| triangle.contains(vertex)));
        free.into_iter().any(|side| pierces(side.map(|vertex| points[vertex as usize]), at(triangle)))
    };
    pierced(one, other) || pierced(other, one)
}

/// Returns all pairs of triangles that cross.
fn crossing_pairs(mesh: &TriangleMesh, grid: &Grid) -> Vec<[usize; 2]> {
    // Coordinates of about 50 bits are small enough for a volume to fit.
    let whole =
        |p: &DVec3| ((*p - grid.origin()) / grid.pitch() * f64::from(1 << 28)).round().to_array().map(|c| c as i128);
    let points: Vec<Point> = mesh.positions.iter().map(whole).collect();
    let range = |triangle: &[u32; 3], axis: usize| {
        let on = triangle.map(|vertex| points[vertex as usize][axis]);
        (on[0].min(on[1]).min(on[2]), on[0].max(on[1]).max(on[2]))
    };
    let mut ranges: Vec<([(i128, i128); 3], usize)> = mesh
        .triangles
        .iter()
        .enumerate()
        .map(|(i, triangle)| ([0, 1, 2].map(|axis| range(triangle, axis)), i))
        .collect();
    ranges.sort_unstable();
    let mut pairs = Vec::new();
    for (at, (one, i)) in ranges.iter().enumerate() {
        let near = ranges[at + 1..].iter().take_while(|(other, _)| other[0].0 <= one[0].1);
        let touching =
            near.filter(|(other, _)| (1..3).all(|axis| other[axis].0 <= one[axis].1 && one[axis].0 <= other[axis].1));
        let crossing = touching.filter(|(_, j)| cross_one_another(mesh.triangles[*i], mesh.triangles[*j], &points));
        pairs.extend(crossing.map(|(_, j)| [*i, *j]));
    }
    pairs
}

/// Asserts that no triangles of a mesh cross, both as it is and with coordinates rounded to 32 bits.
pub fn assert_uncrossed(surface: &Surface, grid: &Grid, what: &str) {
    let mut rounded = surface.mesh.clone();
    rounded.positions.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
    for mesh in [&surface.mesh, &rounded] {
        let pairs = crossing_pairs(mesh, grid);
        assert_eq!(pairs.len(), 0, "{what}: {:?}", &pairs[..pairs.len().min(4)]);
    }
    assert_eq!(surface.crossing_pairs, 0, "{what}");
}

#[test]
fn crossing_pairs_are_found_and_touching_pairs_are_not() {
    let points: Vec<Point> =
        vec![[0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, -2], [1, 1, 2], [9, 9, 0], [1, 1, 1], [4, 4, 0]];
    let cross = |one, other| cross_one_another(one, other, &points);
    assert!(cross([0, 1, 2], [3, 4, 5]));
    // One common corner: a segment through the triangle, and one out of it.
    assert!(cross([0, 1, 2], [0, 3, 4]) && !cross([0, 1, 2], [0, 6, 4]));
    // One common side, then two triangles side by side in one plane.
    assert!(!cross([0, 1, 2], [2, 1, 6]) && !cross([0, 1, 2], [1, 7, 2]));
}

pub fn model(name: &str) -> TriangleMesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/models").join(name);
    io::read(&path).unwrap().mesh
}

#[test]
fn surfaces_of_models_do_not_cross_themselves() {
    let mut pulled = 0;
    for name in ["bone.stl", "gyroid_sheet.stl", "bcc_lattice.stl", "geodesic.obj", "diamond_network.stl"] {
        let mesh = closed(model(name));
        for rays in [20, 33, 47] {
            let grid = Grid::with_resolution(mesh.bounds(), rays, 1024).unwrap();
            let surface = surface_of(&mesh, &grid);
            assert_uncrossed(&surface, &grid, &format!("{name} at {rays}"));
            assert_solid(&surface.mesh);
            pulled += surface.pulled;
            assert!(nodes(&closed(surface.mesh), &grid) == nodes(&mesh, &grid), "{name} at {rays}");
        }
    }
    assert!(pulled > 0, "nothing had to be parted");
}

/// A name, the Boolean of the nodes, the files, the rotation (axis, degrees) and scale of the second, and the rays.
type Case<'a> = (&'a str, fn(u64, u64) -> u64, [&'a str; 2], [f64; 5], u32);

/// In the first two cases, vertices outside their cells keep one another from going back, until all of them go back. In the last,
/// triangles meet in a cell that vertices of both entered from other cells.
#[test]
fn surfaces_of_booleans_do_not_cross_themselves() {
    let cases: [Case; 3] = [
        ("a - b", |a, b| a & !b, ["cubic_lattice.stl", "bcc_lattice.stl"], [-9.0, -2.0, -9.0, 204.0, 1.3], 40),
        ("a ^ b", |a, b| a ^ b, ["gyroid_sheet.stl"; 2], [-4.0, -5.0, -5.0, 164.0, 0.7], 40),
        ("a & b", |a, b| a & b, ["gyroid_sheet.stl", "primitive_sheet.stl"], [-1.0, 8.0, -8.0, 319.0, 1.0], 80),
    ];
    for (text, of_nodes, names, [x, y, z, degrees, scale], rays) in cases {
        let [a, mut b] = names.map(model);
        let turn = glam::DAffine3::from_axis_angle(DVec3::new(x, y, z).normalize(), degrees.to_radians());
        b.transform(&(glam::DAffine3::from_scale(DVec3::splat(scale)) * turn));
        let (a, b) = (closed(a), closed(b));
        let (surface, grid) = surface_of_expression(text, &[&a, &b], rays);
        assert_uncrossed(&surface, &grid, text);
        assert_solid(&surface.mesh);
        let [of_a, of_b, found] = [&a, &b, &closed(surface.mesh)].map(|mesh| nodes(mesh, &grid).concat());
        let wanted: Vec<u64> = of_a.iter().zip(&of_b).map(|(&a, &b)| of_nodes(a, b)).collect();
        assert!(found == wanted, "{text}");
    }
}

#[test]
fn thin_walls_do_not_cross_themselves() {
    for seed in 0..40u32 {
        let angle = |k: u32| f64::from(seed * 5 + k * 11 + 1) * 0.417;
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, angle(1), angle(2), angle(3));
        // From a third of a pitch to three pitches.
        let thickness = 0.01 * (1.0 + f64::from(seed % 9));
        let half = 0.5 * DVec3::new(1.0, 0.7, thickness);
        let mut mesh = solids::cuboid(-half, half).unwrap();
        mesh.transform(&glam::DAffine3::from_quat(turn));
        let mesh = closed(mesh);
        let grid = Grid::with_resolution(mesh.bounds(), 31, 1024).unwrap();
        let surface = surface_of(&mesh, &grid);
        if !surface.mesh.triangles.is_empty() {
            assert_uncrossed(&surface, &grid, &format!("{seed}"));
            assert!(nodes(&closed(surface.mesh), &grid) == nodes(&mesh, &grid), "{seed}");
        }
    }
}
