//! Solids sampled along three axes, and what their surfaces are held to.

use ldi_ops::grid::{Axis, Grid};
use ldi_ops::ldi::{Combine, Ldi, NodePlanes};
use ldi_ops::mesh::check::check;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Fill, Sampler};
use ldi_ops::surface::{Surface, SurfaceMode, contour};

pub fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::check(mesh).unwrap()
}

/// The images of one solid with triangles, and the normals of those.
pub fn images(mesh: &ClosedMesh, grid: &Grid) -> ([Ldi; 3], Vec<[f32; 3]>) {
    let solid = grid.quantise(mesh).unwrap();
    let image = |axis| CpuSampler::default().sample_surface(&solid, axis, Fill::EvenOdd).unwrap();
    (Axis::ALL.map(image), solid.normals())
}

pub fn surface_of(mesh: &ClosedMesh, grid: &Grid) -> Surface {
    let (images, normals) = images(mesh, grid);
    contour(images.each_ref(), Some(&normals), SurfaceMode::Exact).unwrap()
}

/// All nodes of a grid that are inside a mesh, plane after plane.
pub fn nodes(mesh: &ClosedMesh, grid: &Grid) -> Vec<Vec<u64>> {
    let (images, _) = images(mesh, grid);
    NodePlanes::new(&images, Combine::Most).unwrap().planes().collect()
}

/// A mesh without a defect: closed, oriented, every edge in two triangles, every vertex in one fan, right side out.
pub fn assert_solid(mesh: &TriangleMesh) {
    let report = check(mesh);
    let defects: Vec<String> = report.defects().iter().map(|defect| defect.to_string()).collect();
    assert!(report.is_solid() && defects.is_empty(), "{}", defects.join("\n"));
}
