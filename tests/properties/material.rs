//! Solids for the property tests: random soups on lattices of their own, models of the library, and their rearrangements.

use glam::DVec3;
use ldi_ops::grid::{Grid, LatticeSolid};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};
use ldi_ops::solids::{LatticeForm, LongBone, MinimalSurface, Part, StrutLattice, StrutPattern, Surface, torus};

use super::soups::{Frame, Soup, oriented};
use super::testing::images::closed;
use super::testing::random::Random;

/// Draws LOD-C, from the least to more voxels than there are lattice steps.
pub fn random_lod(random: &mut Random) -> u32 {
    random.choose(&[32, 33, 48, 64, 100, 256, 1024, 65_536])
}

/// Draws frames: mostly small pixels, in which crossings crowd, and sometimes the whole 30 bits.
pub fn random_frame(random: &mut Random) -> Frame {
    let shift = random.choose(&[2, 2, 3, 4, 7, 12, 26]);
    Frame { shift, rays: std::array::from_fn(|_| random.between(6, if shift == 26 { 15 } else { 9 }) as u32) }
}

pub fn random_soup(random: &mut Random, frame: &Frame) -> Soup {
    let (_, generator) = random.choose(&oriented());
    generator(random, frame)
}

#[track_caller]
pub fn quantised<'m>(grid: &Grid, mesh: &'m ClosedMesh) -> LatticeSolid<'m> {
    grid.quantise(mesh).unwrap()
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
    use super::super::testing::meshes::{reversed, unwelded};
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
