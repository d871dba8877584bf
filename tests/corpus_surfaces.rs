//! Surfaces of the real meshes in the folder `LDI_CORPUS`: they are solids, contain the nodes of their images, and stay near the
//! original mesh.

#[path = "corpus/manifest.rs"]
mod manifest;
#[path = "../src/testing/mod.rs"]
mod testing;

use glam::DVec3;
use ldi_ops::grid::Grid;
use ldi_ops::ldi::{Ldi, Mode, NodePlanes};
use ldi_ops::mesh::{ClosedMesh, Precision, TriangleMesh, io};
use ldi_ops::surface::manifold::ManifoldReport;
use ldi_ops::surface::simplify::{Limits, simplify};
use ldi_ops::surface::{Surface, contour};
use testing::near::Near;

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

/// Returns points of the triangles of a mesh, about `spacing` apart: a raster of each, with its corners and sides.
fn raster(mesh: &TriangleMesh, spacing: f64) -> Vec<DVec3> {
    let of_triangle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let parts = (longest / spacing).ceil().max(1.0) as u32;
        let at = move |i: u32, j: u32| a + ((b - a) * f64::from(i) + (c - a) * f64::from(j)) / f64::from(parts);
        (0..=parts).flat_map(move |i| (0..=parts - i).map(move |j| at(i, j)))
    };
    mesh.triangles.iter().flat_map(of_triangle).collect()
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn fandisk_keeps_its_shape_within_the_bound_with_an_eighth_of_the_triangles() {
    const BOUND: f64 = 0.05;
    let entry = manifest::entries().into_iter().find(|entry| entry.name.starts_with("fandisk")).unwrap();
    let mesh = ClosedMesh::check(io::read(&entry.path).unwrap().mesh).unwrap();
    let grid = Grid::with_resolution(mesh.bounds(), 256, 1024).unwrap();
    let (images, Surface { mesh: full, .. }) = surface(&mesh, &grid);
    let limits = Limits { bound: BOUND * grid.pitch(), grid: Some(&grid), precision: Precision::Single };
    let few = simplify(&full, &limits, |_| Vec::new()).unwrap().mesh;
    assert!(8 * few.triangles.len() <= full.triangles.len(), "{}", few.triangles.len());
    let away = |from: &TriangleMesh, to: &TriangleMesh| {
        let near = Near::new(to, 0.5 * grid.pitch());
        let distances = raster(from, 0.3 * grid.pitch()).into_iter().map(|point| near.distance(point).unwrap());
        distances.fold(0.0, f64::max) / grid.pitch()
    };
    let (there, back) = (away(&few, &full), away(&full, &few));
    eprintln!(
        "fandisk at 256: {} of {} triangles, {there} pitches, {back} back",
        few.triangles.len(),
        full.triangles.len()
    );
    assert!(there <= BOUND && back <= BOUND, "{there} {back}");
    assert!(ManifoldReport::of(&few, Precision::Single).failures().is_empty());
    let (again, _) = surface(&ClosedMesh::check(few).unwrap(), &grid);
    assert!(nodes(&again) == nodes(&images), "nodes changed sides");
}
