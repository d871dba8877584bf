//! Solids for the property tests: random soups on lattices of their own, models of the library, and their rearrangements.

use glam::DVec3;
use ldi_ops::grid::{Grid, LatticeSolid};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::solids::{LatticeForm, LongBone, MinimalSurface, Part, StrutLattice, StrutPattern, Surface, torus};

use super::soups::{self, Frame, Generator, Random, Soup};

/// Draws LOD-C, from the least to more voxels than there are lattice steps.
pub fn random_lod(random: &mut Random) -> u32 {
    random.choose(&[32, 33, 48, 64, 100, 256, 1024, 65_536])
}

/// Draws frames: mostly small pixels, in which crossings crowd, and sometimes the whole 30 bits.
pub fn random_frame(random: &mut Random) -> Frame {
    let shift = random.choose(&[2, 2, 3, 4, 7, 12, 26]);
    Frame { shift, rays: std::array::from_fn(|_| random.between(6, if shift == 26 { 15 } else { 9 }) as u32) }
}

/// Returns every generator of oriented soups, mixtures of them among them.
pub fn generators() -> Vec<(&'static str, Generator)> {
    let mut generators = soups::oriented();
    generators.push(("mixture", soups::mixture));
    generators
}

pub fn random_soup(random: &mut Random, frame: &Frame) -> Soup {
    let (_, generator) = random.choose(&generators());
    generator(random, frame)
}

/// A grid on which one lattice step is one world unit, so that soups are quantised to themselves.
pub fn grid(frame: &Frame, lod: u32) -> Grid {
    Grid::from_parts(DVec3::ZERO, f64::from(1u32 << frame.shift), frame.rays, frame.shift, lod).unwrap()
}

pub fn mesh(soup: &Soup) -> TriangleMesh {
    let positions = soup.positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    TriangleMesh { positions, triangles: soup.triangles.clone() }
}

#[track_caller]
pub fn closed(mesh: TriangleMesh) -> ClosedMesh {
    ClosedMesh::check(mesh).unwrap_or_else(|e| panic!("the mesh is not closed: {e}"))
}

#[track_caller]
pub fn quantised<'m>(grid: &Grid, mesh: &'m ClosedMesh) -> LatticeSolid<'m> {
    grid.quantise(mesh).unwrap()
}

/// Returns a grid around all of the meshes.
pub fn grid_around(meshes: &[&ClosedMesh], resolution: u32, lod: u32) -> Grid {
    let bounds = meshes.iter().map(|mesh| mesh.bounds()).reduce(|a, b| a.union(b)).unwrap();
    Grid::with_resolution(bounds, resolution, lod).unwrap()
}

/// Returns the models of the library that differ most from each other, by name.
pub fn models() -> Vec<(&'static str, ClosedMesh)> {
    let sheet = |surface| MinimalSurface {
        surface,
        part: Part::Sheet { wall: 1.3 },
        cells: [2; 3],
        cell_size: 10.0,
        resolution: 12,
    };
    let struts = |pattern, form| StrutLattice { pattern, form, cells: [2; 3], cell_size: 10.0, radius: 1.2 };
    let merged = LatticeForm::Union { resolution: 14 };
    let bone = LongBone { length: 40.0, girth: 2.0, bow: 1.0, resolution: 72 };
    [
        ("gyroid", sheet(Surface::Gyroid).build()),
        ("diamond", sheet(Surface::Diamond).build()),
        ("cubic lattice", struts(StrutPattern::Cubic, merged).build()),
        ("heap of struts", struts(StrutPattern::BodyCentred, LatticeForm::Overlapping { segments: 12 }).build()),
        ("bone", bone.build()),
        ("torus", torus(10.0, 3.0, 48, 20)),
    ]
    .map(|(name, mesh)| (name, closed(mesh.unwrap())))
    .to_vec()
}

/// Joins all meshes into one and welds nothing.
pub fn together(meshes: &[TriangleMesh]) -> TriangleMesh {
    let mut all = TriangleMesh::default();
    for mesh in meshes {
        let base = all.positions.len() as u32;
        all.positions.extend_from_slice(&mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|index| index + base)));
    }
    all
}

/// Returns the same surface facing the other way.
pub fn reversed(mesh: &TriangleMesh) -> TriangleMesh {
    let triangles = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    TriangleMesh { positions: mesh.positions.clone(), triangles }
}

/// Returns the same triangles with three positions each, shared by none.
pub fn unwelded(mesh: &TriangleMesh) -> TriangleMesh {
    let positions: Vec<DVec3> = mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    TriangleMesh { positions, triangles }
}

pub fn moved(mesh: &TriangleMesh, by: DVec3) -> TriangleMesh {
    TriangleMesh { positions: mesh.positions.iter().map(|&p| p + by).collect(), triangles: mesh.triangles.clone() }
}

pub fn scaled(mesh: &TriangleMesh, by: f64) -> TriangleMesh {
    TriangleMesh { positions: mesh.positions.iter().map(|&p| p * by).collect(), triangles: mesh.triangles.clone() }
}

fn shuffle<T>(random: &mut Random, items: &mut [T]) {
    for i in (1..items.len()).rev() {
        items.swap(i, random.below(i + 1));
    }
}

/// Returns the same triangles in another order, each beginning at any of its corners.
pub fn shuffled(random: &mut Random, mesh: &TriangleMesh) -> TriangleMesh {
    let mut mesh = mesh.clone();
    shuffle(random, &mut mesh.triangles);
    for triangle in &mut mesh.triangles {
        triangle.rotate_left(random.below(3));
    }
    mesh
}

/// Returns the same triangles over positions in another order.
pub fn renumbered(random: &mut Random, mesh: &TriangleMesh) -> TriangleMesh {
    let mut order: Vec<usize> = (0..mesh.positions.len()).collect();
    shuffle(random, &mut order);
    let mut new_index = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        new_index[old] = new as u32;
    }
    TriangleMesh {
        positions: order.iter().map(|&old| mesh.positions[old]).collect(),
        triangles: mesh.triangles.iter().map(|triangle| triangle.map(|index| new_index[index as usize])).collect(),
    }
}

mod tests {
    use super::*;

    #[test]
    fn rearranged_meshes_differ_and_keep_their_volume() {
        let (_, torus) = models().pop().unwrap();
        let torus = torus.into_mesh();
        let mut random = Random::new(1);
        let others = [shuffled(&mut random, &torus), renumbered(&mut random, &torus), unwelded(&torus)];
        for (i, other) in others.iter().enumerate() {
            assert!(*other != torus, "{i}");
            assert!((other.signed_volume() / torus.signed_volume() - 1.0).abs() < 1e-12, "{i}");
        }
        assert_eq!(reversed(&torus).signed_volume(), -torus.signed_volume());
    }
}
