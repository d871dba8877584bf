//! Meshes whose edges are slivers of triangles, which rounding may flip.

use std::collections::BTreeMap;

use super::*;
use crate::sampler::Mode;
use crate::sampler::cpu::CpuSampler;
use crate::surface::contour;

impl Offset {
    /// Compares the spans of all rays at the nodes with an exact test.
    fn agrees_at_nodes(&self) {
        for axis in Axis::ALL {
            let (columns, rows) = self.grid.image_size(axis);
            for ray in 0..columns * rows {
                for index in 0..self.grid.rays()[axis.depth()] {
                    let depth = self.grid.node(index);
                    let point = point_on(&self.grid, axis, ray, depth);
                    let is_in_sum = self.is_in(axis, ray, depth) == (self.exterior == Exterior::Out);
                    assert_eq!(is_in_sum, self.membership.contains(point, &mut ()), "{axis:?} {ray} {index}");
                }
            }
        }
    }
}

/// Splits each edge of a mesh into two slivers: each of its triangles protrudes over its sides by half of `width`, or ends
/// before them where that is negative.
fn with_slivers(mesh: &TriangleMesh, mut width: impl FnMut() -> f64) -> TriangleMesh {
    let mut positions = mesh.positions.clone();
    let mut triangles = Vec::new();
    let mut end_of = BTreeMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
        let normal = (b - a).cross(c - a).normalize();
        let center = positions.len() as u32;
        positions.push((a + b + c) / 3.0);
        for [from, to] in [[0, 1], [1, 2], [2, 0]].map(|side| side.map(|i| triangle[i])) {
            let (start, along) =
                (mesh.positions[from as usize], mesh.positions[to as usize] - mesh.positions[from as usize]);
            let share = if from < to { 0.4 } else { 0.5 };
            let end = positions.len() as u32;
            positions.push(start + along * share + along.cross(normal).normalize() * (0.5 * width()));
            triangles.extend([[center, from, end], [center, end, to]]);
            end_of.insert([from, to], end);
        }
    }
    for (&[from, to], &end) in &end_of {
        triangles.push([to, end, end_of[&[to, from]]]);
    }
    TriangleMesh { positions, triangles }
}

/// Returns the contoured surface of a grown solid.
fn contoured(mesh: TriangleMesh, distance: f64, pitch: f64) -> TriangleMesh {
    let mesh = ClosedMesh::check(mesh).unwrap();
    let grid = offset_grid(mesh.bounds(), distance, pitch, 1024).unwrap();
    let solid = Polyhedron::new(&grid.quantise(&mesh).unwrap());
    let radius = distance / grid.step();
    let patches = BallPatches::new(&solid, radius);
    let spans = Axis::ALL.map(|axis| patches.spans::<TriangleHit>(&grid, axis, Exterior::Out).unwrap());
    let membership = BallMembership::new(&grid, &solid, radius, Exterior::Out).unwrap();
    let resolved = resolve(&grid, spans, Exterior::Out, &membership, &|_, _| {}).unwrap();
    let images = resolved.spans.map(|spans| spans.image(&grid, Mode::Exact, &CpuSampler::default()).unwrap());
    let (images, normals) = patches.sample_normals(images).unwrap();
    contour(images.each_ref(), Some(&normals), Mode::Exact).unwrap().mesh
}

fn random_widths(most: f64) -> impl FnMut() -> f64 {
    let mut random = Congruential::new(1);
    move || most * (2.0 * random.share() - 1.0)
}

#[test]
fn slivers_turned_over_by_rounding_leave_no_gap() {
    let mesh = || turned(l_solid(), DVec3::new(1.0, 2.0, -1.0), 0.8);
    for width in [3e-9, 3e-8, 1e-6, 1e-4] {
        for distance in [0.4, -0.3] {
            // All slivers flipped, and some.
            Offset::new(with_slivers(&mesh(), || width), distance, 0.1).agrees_at_nodes();
            let mesh = with_slivers(&mesh(), random_widths(width));
            let offset = Offset::new(mesh, distance, 0.13);
            offset.agrees_at_nodes();
            offset.agrees_with_all_triangles();
        }
    }
}

#[test]
fn slivers_all_over_a_ball_leave_no_gap() {
    let mesh = solids::geodesic(1.0, 5).unwrap();
    for (width, distance, pitch) in [(1e-8, 0.3, 0.03), (1e-7, 1.0, 0.07), (1e-6, -0.2, 0.025), (1e-5, -0.4, 0.03)] {
        Offset::new(with_slivers(&mesh, random_widths(width)), distance, pitch).agrees_at_nodes();
    }
}

#[test]
fn offsets_of_contoured_surfaces_agree_with_an_exact_test() {
    let solids = [
        turned(l_solid(), DVec3::new(1.0, 2.0, -1.0), 0.8),
        solids::torus(3.0, 1.0, 13, 7).unwrap(),
        turned(together(&[cube(DVec3::ZERO, 1.0), cube(DVec3::splat(1.7), 1.5)]), DVec3::new(3.0, 1.0, -1.0), 0.5),
    ];
    for mesh in solids {
        let size = mesh.bounds().unwrap().extent().max_element();
        let fine = contoured(mesh, 0.11 * size, size / 40.0);
        // Also as stored in a file with few digits, which flips many slivers.
        for digit in [1e-12, 1e-6, 1e-4] {
            let digit = digit * size;
            let positions = fine.positions.iter().map(|position| (position / digit).round() * digit).collect();
            let rounded = TriangleMesh { positions, triangles: fine.triangles.clone() };
            for (share, rays) in [(-0.11, 23.0), (-0.11, 32.0), (-0.05, 41.3), (0.07, 30.7)] {
                Offset::new(rounded.clone(), share * size, 1.22 * size / rays).agrees_at_nodes();
            }
        }
    }
}
