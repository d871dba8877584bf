//! Meshes on grids, their images, and sets of nodes.

use ldi_ops::grid::{Axis, Grid, LatticeBox, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::metrics::NodeSet;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{FillRule, Mode, Sampler};

use super::random::mix;

#[track_caller]
pub fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::check(mesh).unwrap_or_else(|error| panic!("the mesh is not closed: {error}"))
}

/// Returns a grid around all of the meshes.
pub fn grid_around(meshes: &[&ClosedMesh], resolution: u32, lod: u32) -> Grid {
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).unwrap();
    Grid::with_resolution(bounds, resolution, lod).unwrap()
}

/// Returns the box of a whole grid.
pub fn whole(grid: &Grid) -> LatticeBox {
    LatticeBox { min: [0; 3], max: [0, 1, 2].map(|axis| grid.length(axis)) }
}

/// Returns the images of one solid, without triangles.
pub fn images(solid: &LatticeSolid, mode: Mode) -> [Ldi; 3] {
    Axis::ALL.map(|axis| CpuSampler::default().sample(solid, axis, mode, FillRule::EvenOdd).unwrap())
}

/// Returns the exact images of one solid, with triangles.
pub fn surface_images(solid: &LatticeSolid) -> [Ldi; 3] {
    Axis::ALL.map(|axis| CpuSampler::default().sample_surface(solid, axis, FillRule::EvenOdd).unwrap())
}

/// Returns the images of a mesh on a grid around it, without triangles.
pub fn images_of(mesh: TriangleMesh, resolution: u32, lod: u32, mode: Mode) -> [Ldi; 3] {
    let mesh = closed(mesh);
    images(&grid_around(&[&mesh], resolution, lod).quantise(&mesh).unwrap(), mode)
}

/// Returns the exact images of a mesh on a grid, with triangles.
pub fn surface_images_on(grid: &Grid, mesh: TriangleMesh) -> [Ldi; 3] {
    surface_images(&grid.quantise(&closed(mesh)).unwrap())
}

/// Returns random nodes, a share of all; each node of a raster is drawn by itself.
pub fn random_nodes(size: [usize; 3], share: f64, seed: u64) -> NodeSet {
    NodeSet::from_fn(size, |[x, y, z]| {
        let bits = mix(((z * 1000 + y) * 1000 + x) as u64 ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        (bits as f64) < share * u64::MAX as f64
    })
}

/// Returns whether a node is in a tunnel one node wide that fills a block of 65 × 9 × 65 nodes, level by level, row by row.
pub fn in_serpentine([x, y, z]: [u32; 3], has_mouth: bool) -> bool {
    let turn = |at: u32, end: u32| if at / 2 % 2 == 1 { end } else { 1 };
    let in_row = y % 2 == 1 && z % 2 == 1 && (1..64).contains(&x);
    let between_rows = y.is_multiple_of(2) && z % 2 == 1 && (1..7).contains(&y) && x == turn(y, 63);
    let between_levels = z.is_multiple_of(2) && (1..63).contains(&z) && x == 1 && y == turn(z, 7);
    let way_out = has_mouth && [x, y, z] == [1, 0, 1];
    in_row || between_rows || between_levels || way_out
}
