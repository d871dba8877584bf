//! Surfaces of the real meshes in the folder `LDI_CORPUS`: they are solids, contain the nodes of their images, and stay near the
//! original mesh.

#[path = "corpus/manifest.rs"]
mod manifest;
#[path = "../src/testing/mod.rs"]
mod testing;

use std::collections::HashMap;

use glam::DVec3;
use ldi_ops::grid::Grid;
use ldi_ops::ldi::{Ldi, Mode, NodePlanes};
use ldi_ops::mesh::{ClosedMesh, Precision, TriangleMesh, io};
use ldi_ops::surface::manifold::ManifoldReport;
use ldi_ops::surface::{Surface, contour};

/// Returns the images of a mesh, which may overlap itself, and its surface.
fn surface(mesh: &ClosedMesh, grid: &Grid) -> ([Ldi; 3], Surface) {
    let solid = grid.quantise(mesh).unwrap();
    let images = testing::images::surface_images(&solid);
    let surface = contour(images.each_ref(), Some(&solid.normals()), Mode::Exact).unwrap();
    (images, surface)
}

fn nodes(images: &[Ldi]) -> Vec<Vec<u64>> {
    NodePlanes::new(images, Mode::Exact).unwrap().planes().collect()
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn surfaces_of_the_corpus_are_manifold_and_contain_the_nodes_of_their_images() {
    let mut files = 0;
    for entry in manifest::entries() {
        let Ok(file) = io::read(&entry.path) else { continue };
        let Ok(mesh) = ClosedMesh::check(file.mesh) else { continue };
        let Ok(grid) = Grid::with_resolution(mesh.bounds(), 100, 1024) else { continue };
        let (images, Surface { mesh: made, disagreements, stayed, moved, .. }) = surface(&mesh, &grid);
        let manifold = ManifoldReport::of(&made, Precision::Single);
        let failures: Vec<String> = manifold.failures().iter().map(|failure| failure.to_string()).collect();
        assert!(failures.is_empty(), "{}: {}", entry.name, failures.join("\n"));
        assert_eq!(disagreements, 0, "{}", entry.name);
        files += 1;
        eprintln!(
            "{:28} {:>8} triangles, {moved} vertices beyond their cells, {stayed} held",
            entry.name, manifold.triangles
        );
        if manifold.triangles == 0 {
            continue;
        }
        let (again, _) = surface(&ClosedMesh::check(made).unwrap(), &grid);
        assert!(nodes(&again) == nodes(&images), "{}: the nodes differ", entry.name);
    }
    assert!(files > 40, "only {files} closed meshes were found");
}

/// An index of triangles by the blocks of a raster that they are near.
struct Near<'m> {
    mesh: &'m TriangleMesh,
    reach: f64,
    blocks: HashMap<[i64; 3], Vec<u32>>,
}

impl<'m> Near<'m> {
    fn new(mesh: &'m TriangleMesh, reach: f64) -> Near<'m> {
        let mut near = Near { mesh, reach, blocks: HashMap::new() };
        for (index, triangle) in (0..).zip(&mesh.triangles) {
            let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
            let low = near.block(a.min(b).min(c) - reach);
            let high = near.block(a.max(b).max(c) + reach);
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        near.blocks.entry([x, y, z]).or_default().push(index);
                    }
                }
            }
        }
        near
    }

    fn block(&self, point: DVec3) -> [i64; 3] {
        (point / (2.0 * self.reach)).floor().to_array().map(|c| c as i64)
    }

    /// Returns the distance of a point from the mesh, if it is within reach.
    fn distance(&self, point: DVec3) -> Option<f64> {
        let triangles = self.blocks.get(&self.block(point))?;
        let of = |&index: &u32| {
            distance(point, self.mesh.triangles[index as usize].map(|v| self.mesh.positions[v as usize]))
        };
        triangles.iter().map(of).min_by(f64::total_cmp).filter(|distance| *distance <= self.reach)
    }
}

/// Returns the distance of a point from a triangle: from its plane where the point projects into it, else from its sides.
fn distance(point: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let above = (0..3).all(|i| normal.cross(corners[(i + 1) % 3] - corners[i]).dot(point - corners[i]) >= 0.0);
    if above && normal.length_squared() > 0.0 {
        return normal.dot(point - a).abs() / normal.length();
    }
    let side = |i: usize| {
        let (from, along) = (corners[i], corners[(i + 1) % 3] - corners[i]);
        let share = if along.length_squared() > 0.0 { along.dot(point - from) / along.length_squared() } else { 0.0 };
        (from + along * share.clamp(0.0, 1.0)).distance(point)
    };
    (0..3).map(side).fold(f64::INFINITY, f64::min)
}

/// Returns the largest distance, in units of `pitch`, of the vertices and triangle centres of one mesh from another mesh; `None`
/// if it exceeds 2.
fn one_sided(from: &TriangleMesh, to: &TriangleMesh, pitch: f64) -> Option<f64> {
    let near = Near::new(to, 2.0 * pitch);
    let middles = from.triangles.iter().map(|t| t.map(|v| from.positions[v as usize]).into_iter().sum::<DVec3>() / 3.0);
    let points = from.positions.iter().copied().chain(middles);
    points.map(|point| near.distance(point)).try_fold(0.0, |most: f64, found| Some(most.max(found? / pitch)))
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn fandisk_surface_is_within_half_a_pitch_of_the_mesh_and_the_mesh_within_a_pitch_of_it() {
    let entry = manifest::entries().into_iter().find(|entry| entry.name.starts_with("fandisk")).unwrap();
    let mesh = ClosedMesh::check(io::read(&entry.path).unwrap().mesh).unwrap();
    let grid = Grid::with_resolution(mesh.bounds(), 256, 1024).unwrap();
    let (_, made) = surface(&mesh, &grid);
    let there = one_sided(&made.mesh, mesh.mesh(), grid.pitch());
    let back = one_sided(mesh.mesh(), &made.mesh, grid.pitch());
    eprintln!("fandisk at 256: {there:?} pitches from its surface to it, {back:?} back");
    assert!(there.unwrap() < 0.5, "{there:?}");
    assert!(back.unwrap() < 1.0, "{back:?}");
}
