//! Closed surfaces of a few faces with random corners: they cross, touch and fold upon themselves in every way. The volume is that of
//! the cells into which the planes of all faces cut space, by their winding numbers from solid angles, in `f64`.

use std::f64::consts::PI;

use glam::DVec3;
use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::exact::{Solution, of_solid};
use ldi_ops::mesh::{ClosedMesh, Precision, TriangleMesh};
use ldi_ops::sampler::FillRule;
use ldi_ops::solids;
use ldi_ops::surface::Coordinates;
use proptest::prelude::*;

use super::known::together;
use super::{OPERATIONS, exact};

/// Corners lie within this distance of zero along each axis.
const SIDE: i64 = 3;

/// The distance of a plane within which a corner of a cell counts as in it.
const NEAR: f64 = 1e-9;

type Tetrahedron = [DVec3; 4];

/// Returns six times the volume of a tetrahedron.
fn size([a, b, c, d]: Tetrahedron) -> f64 {
    (b - a).dot((c - a).cross(d - a)).abs()
}

/// Cuts a tetrahedron along a plane.
fn cut(corners: Tetrahedron, height: &dyn Fn(DVec3) -> f64, parts: &mut Vec<Tetrahedron>) {
    let heights = corners.map(height);
    let mut sides = (0..4).flat_map(|i| (i + 1..4).map(move |j| [i, j]));
    let side = |i: usize| if heights[i].abs() < NEAR { 0.0 } else { heights[i].signum() };
    match sides.find(|&[i, j]| side(i) * side(j) < 0.0) {
        None => parts.push(corners),
        Some([i, j]) => {
            let middle = corners[i].lerp(corners[j], heights[i] / (heights[i] - heights[j]));
            for replaced in [i, j] {
                let mut part = corners;
                part[replaced] = middle;
                cut(part, height, parts);
            }
        }
    }
}

/// Returns the cells into which the planes of all faces cut a box around them, as tetrahedra.
fn cells(meshes: &[&TriangleMesh]) -> Vec<Tetrahedron> {
    let far = 2.0 * SIDE as f64;
    let mut steps = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|step| 2.0 * far * DVec3::from_array(step));
    let mut all = Vec::new();
    // A cube is six tetrahedra, one for each order of the axes.
    for _ in 0..2 {
        for turn in 0..3 {
            let [u, v, w] = [0, 1, 2].map(|i| steps[(i + turn) % 3]);
            let corner = DVec3::splat(-far);
            all.push([corner, corner + u, corner + u + v, corner + u + v + w]);
        }
        steps.swap(0, 1);
    }
    for mesh in meshes {
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|index| mesh.positions[index as usize]);
            let normal = (b - a).cross(c - a);
            if normal.length() > 0.5 {
                let normal = normal.normalize();
                let mut parts = Vec::new();
                all.into_iter().for_each(|cell| cut(cell, &|point| normal.dot(point - a), &mut parts));
                all = parts;
            }
        }
    }
    all
}

/// Returns the winding number at a point by the solid angles of all faces (Van Oosterom and Strackee, 1983).
fn winding(mesh: &TriangleMesh, point: DVec3) -> i32 {
    let angle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|index| mesh.positions[index as usize] - point);
        let [u, v, w] = [a, b, c].map(DVec3::length);
        2.0 * a.dot(b.cross(c)).atan2(u * v * w + a.dot(b) * w + b.dot(c) * u + c.dot(a) * v)
    };
    (mesh.triangles.iter().map(angle).sum::<f64>() / (4.0 * PI)).round() as i32
}

/// Checks the volumes of all operations on solids, and of each alone, under both fill rules.
fn check(inputs: &[ClosedMesh]) {
    let meshes: Vec<&TriangleMesh> = inputs.iter().map(ClosedMesh::mesh).collect();
    let of_cell = |cell: &Tetrahedron| {
        let middle = 0.25 * (cell[0] + cell[1] + cell[2] + cell[3]);
        let windings: Vec<i32> = meshes.iter().map(|mesh| winding(mesh, middle)).collect();
        (size(*cell) / 6.0, windings)
    };
    let cells: Vec<(f64, Vec<i32>)> = cells(&meshes).iter().filter(|cell| size(**cell) > 1e-12).map(of_cell).collect();
    for fill in [FillRule::EvenOdd, FillRule::NonZero] {
        let volume = |expression: &Expression| -> f64 {
            let is_inside = |windings: &[i32]| {
                expression.holds(|solid| match fill {
                    FillRule::EvenOdd => windings[solid] % 2 != 0,
                    FillRule::NonZero => windings[solid] != 0,
                })
            };
            cells.iter().filter(|(_, windings)| is_inside(windings)).map(|(volume, _)| volume).sum()
        };
        for (number, input) in inputs.iter().enumerate() {
            let (found, expected) = (of_solid(input, fill).unwrap().mass.volume, volume(&Expression::input(number)));
            assert!((found - expected).abs() < 1e-7, "{fill:?}: {found} instead of {expected} for {:?}", input.mesh());
        }
        for operation in OPERATIONS {
            let expression = Expression::of_inputs(operation, inputs.len());
            let (found, expected) = (exact(inputs, &expression, fill).volume, volume(&expression));
            assert!(
                (found - expected).abs() < 1e-7,
                "{operation:?} {fill:?}: {found} instead of {expected} for {meshes:?}"
            );
        }
    }
}

/// A surface with the faces of a double pyramid over a polygon, of any corners in a small box.
fn pyramids(count: usize) -> impl Strategy<Value = ClosedMesh> {
    let corner = || [-SIDE..=SIDE, -SIDE..=SIDE, -SIDE..=SIDE];
    let place = |corner: [i64; 3]| DVec3::from_array(corner.map(|x| x as f64));
    prop::collection::vec(corner(), count + 2).prop_filter_map("nothing", move |corners| {
        let positions = corners.into_iter().map(place).collect();
        let count = count as u32;
        let around = (0..count).map(|i| [i, (i + 1) % count]);
        let triangles = around.flat_map(|[i, j]| [[i, j, count], [j, i, count + 1]]).collect();
        ClosedMesh::check(TriangleMesh { positions, triangles }).ok().filter(|mesh| mesh.oriented())
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, max_shrink_iters: 200, ..ProptestConfig::default() })]

    #[test]
    fn surfaces_of_any_corners_have_the_volumes_of_their_cells(mesh in (3usize..6).prop_flat_map(pyramids)) {
        let cuboid = solids::cuboid(DVec3::new(-1.0, -2.0, -3.0), DVec3::new(1.0, 2.0, 0.5)).unwrap();
        check(&[mesh, ClosedMesh::check(cuboid).unwrap()]);
    }

    #[test]
    fn two_surfaces_of_any_corners_have_the_volumes_of_their_cells(a in pyramids(3), b in pyramids(4)) {
        check(&[a, b]);
    }
}

/// A prism of height 1 over a pentagram in a circle of radius 1, from a place on.
fn star(at: DVec3) -> TriangleMesh {
    // Corners two steps apart; the caps are fans about the middle, which they cover twice.
    let corner = |i: u32, z: f64| {
        let angle = f64::from(i) * 4.0 * PI / 5.0;
        at + DVec3::new(angle.cos(), angle.sin(), z)
    };
    let mut mesh = TriangleMesh::default();
    mesh.positions.extend((0..10).map(|i| corner(i % 5, f64::from(i / 5))).chain([at, at + DVec3::Z]));
    for i in 0..5 {
        let j = (i + 1) % 5;
        mesh.triangles.extend([[i, j, 5 + j], [i, 5 + j, 5 + i], [10, j, i], [11, 5 + i, 5 + j]]);
    }
    mesh
}

/// The volume and the area of a star, where its middle is filled and where it is empty.
fn of_star() -> [[f64; 2]; 2] {
    // Ten triangles about the middle, from a tip to an inner corner; the pentagon is five triangles between inner corners.
    let (tenth, inner) = (PI / 5.0, (2.0 * PI / 5.0).cos() / (PI / 5.0).cos());
    let (whole, pentagon) = (5.0 * inner * tenth.sin(), 2.5 * inner * inner * (2.0 * tenth).sin());
    let outline = 10.0 * (1.0 + inner * inner - 2.0 * inner * tenth.cos()).sqrt();
    let of_pentagon = 10.0 * inner * tenth.sin();
    [[whole, 2.0 * whole + outline], [whole - pentagon, 2.0 * (whole - pentagon) + outline + of_pentagon]]
}

#[test]
fn a_pentagram_is_filled_twice_in_its_middle() {
    let star = ClosedMesh::check(star(DVec3::ZERO)).unwrap();
    let expression = Expression::of_inputs(BooleanOperation::Union, 1);
    for (fill, [volume, area]) in [FillRule::NonZero, FillRule::EvenOdd].into_iter().zip(of_star()) {
        let found = exact(std::slice::from_ref(&star), &expression, fill).volume;
        assert!((found - volume).abs() < 1e-11, "{fill:?}: {found} instead of {volume}");
        let found = of_solid(&star, fill).unwrap();
        assert!((found.mass.area - area).abs() <= found.area_error + 1e-11, "{fill:?}: {found:?} instead of {area}");
    }
}

#[test]
fn a_shell_that_meets_itself_leaves_no_wall_where_another_of_its_solid_is_flush() {
    let cube = |x: f64| solids::cuboid(DVec3::new(x, 0.0, 0.0), DVec3::new(x + 2.0, 2.0, 2.0)).unwrap();
    let inputs =
        [cube(0.0), together(&[star(DVec3::splat(9.0)), cube(2.0)]), together(&[cube(4.0), star(-DVec3::splat(9.0))])];
    let inputs = inputs.map(|mesh| ClosedMesh::check(mesh).unwrap());
    let union = Expression::of_inputs(BooleanOperation::Union, 3);
    let volume = exact(&inputs, &union, FillRule::NonZero).volume;
    let [[of_star, area], _] = of_star();
    assert!((volume - 24.0 - 2.0 * of_star).abs() < 1e-9, "{volume}");
    let solution = Solution::of(&inputs.each_ref(), &union, FillRule::NonZero).unwrap();
    let mesh = solution.mesh(Coordinates { precision: Precision::Double, ..Coordinates::default() }).mesh;
    let walls = mesh.area() - 56.0 - 2.0 * area;
    assert!(walls.abs() < 1e-9, "{walls}");
}

#[test]
fn surfaces_that_are_listed_twice_have_their_volume_once_or_not_at_all() {
    let place = |corner: [f64; 3]| DVec3::from_array(corner);
    let corners = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]].map(place);
    let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let tetrahedron = TriangleMesh { positions: corners.to_vec(), triangles: faces };
    let one = Expression::input(0);
    for mesh in [tetrahedron, solids::geodesic(2.0, 1).unwrap(), solids::geodesic(2.0, 3).unwrap()] {
        let volume = mesh.signed_volume();
        let doubled = |order: &dyn Fn(usize) -> usize| {
            let triangles = (0..2 * mesh.triangles.len()).map(|i| mesh.triangles[order(i)]).collect();
            ClosedMesh::check(TriangleMesh { triangles, ..mesh.clone() }).unwrap()
        };
        let count = mesh.triangles.len();
        for twice in [doubled(&|i| i / 2), doubled(&|i| i % count), doubled(&|i| i.min(2 * count - 1 - i))] {
            let inputs = std::slice::from_ref(&twice);
            let [united, cancelled] =
                [FillRule::NonZero, FillRule::EvenOdd].map(|fill| exact(inputs, &one, fill).volume);
            assert!((united - volume).abs() < 1e-9 && cancelled.abs() < 1e-9, "{united} {cancelled} of {volume}");
        }
    }
}
