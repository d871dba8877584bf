//! Samples solids along three axes, makes their surfaces, and checks these.

use std::collections::HashMap;

use glam::DVec3;
use ldi_ops::boolean::{Expression, Leaf, Operand, Plan};
use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::{Ldi, Mode, NodePlanes};
use ldi_ops::mesh::check::check;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::surface::{Surface, contour};

use crate::testing::images::{grid_around, surface_images};

/// Returns the images of one solid, with triangles, and the normals of the triangles.
pub fn images(mesh: &ClosedMesh, grid: &Grid) -> ([Ldi; 3], Vec<[f32; 3]>) {
    let solid = grid.quantise(mesh).unwrap();
    (surface_images(&solid), solid.normals())
}

pub fn surface_of(mesh: &ClosedMesh, grid: &Grid) -> Surface {
    let (images, normals) = images(mesh, grid);
    contour(images.each_ref(), Some(&normals), Mode::Exact).unwrap()
}

/// Returns all nodes of a grid that are inside a mesh, plane by plane.
pub fn nodes(mesh: &ClosedMesh, grid: &Grid) -> Vec<Vec<u64>> {
    let (images, _) = images(mesh, grid);
    NodePlanes::new(&images, Mode::Exact).unwrap().planes().collect()
}

/// Asserts that a mesh has no defect: closed, oriented, every edge in two triangles, every vertex in one fan, facing outwards.
pub fn assert_solid(mesh: &TriangleMesh) {
    let report = check(mesh);
    let defects: Vec<String> = report.defects().iter().map(|defect| defect.to_string()).collect();
    assert!(report.is_solid() && defects.is_empty(), "{}", defects.join("\n"));
}

/// Returns the surface of an expression over solids named a, b, …, and the grid around all of them.
pub fn surface_of_expression(text: &str, solids: &[&ClosedMesh], resolution: u32) -> (Surface, Grid) {
    let grid = grid_around(solids, resolution, 1024);
    let names: Vec<String> = ('a'..).take(solids.len()).map(String::from).collect();
    let plan = Plan::new(&Expression::parse(text, &names).unwrap(), Mode::Exact);
    let sampled: Vec<_> = solids.iter().map(|mesh| images(mesh, &grid)).collect();
    let mut first = vec![0];
    sampled.iter().for_each(|(_, normals)| first.push(first[first.len() - 1] + normals.len() as u32));
    let image = |axis: Axis| {
        let operand =
            |leaf: &Leaf| Operand { image: &sampled[leaf.input].0[axis.depth()], first_triangle: first[leaf.input] };
        plan.sweep(&plan.leaves().iter().map(operand).collect::<Vec<_>>()).unwrap()
    };
    let result = Axis::ALL.map(image);
    let normals: Vec<[f32; 3]> = sampled.into_iter().flat_map(|(_, normals)| normals).collect();
    (contour(result.each_ref(), Some(&normals), Mode::Exact).unwrap(), grid)
}

/// Returns the edges, as pairs of positions, at which the triangles of a mesh turn by more than an angle.
pub fn sharp_edges(mesh: &TriangleMesh, cosine: f64) -> Vec<[DVec3; 2]> {
    let mut normals: HashMap<[u32; 2], DVec3> = HashMap::new();
    let mut sharp = Vec::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for i in 0..3 {
            let (from, to) = (triangle[i], triangle[(i + 1) % 3]);
            match normals.remove(&[to, from]) {
                Some(other) if other.dot(normal) < cosine => {
                    sharp.push([mesh.positions[from as usize], mesh.positions[to as usize]]);
                }
                Some(_) => {}
                None => {
                    normals.insert([from, to], normal);
                }
            }
        }
    }
    sharp
}

/// Returns the distance of a point from the nearest of some segments.
pub fn distance(point: DVec3, segments: &[[DVec3; 2]]) -> f64 {
    let of_segment = |[a, b]: &[DVec3; 2]| {
        let along = *b - *a;
        let share = (along.dot(point - *a) / along.length_squared()).clamp(0.0, 1.0);
        (*a + along * share).distance(point)
    };
    segments.iter().map(of_segment).fold(f64::INFINITY, f64::min)
}
