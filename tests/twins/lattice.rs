//! Soups as solids on grids of their own.

use glam::DVec3;
use ldi_ops::grid::{Grid, LatticeBox};
use ldi_ops::mesh::{ClosedMesh, TriangleMesh};

use crate::soups::{self, Frame, Generator, Random, Soup};

pub fn mesh(soup: &Soup) -> TriangleMesh {
    let positions = soup.positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
    TriangleMesh { positions, triangles: soup.triangles.clone() }
}

pub fn closed(soup: &Soup) -> ClosedMesh {
    ClosedMesh::check(mesh(soup)).unwrap_or_else(|error| panic!("a soup is not closed: {:?}", error.report))
}

/// Draws a small frame, now and then one whose positions need all 30 bits.
pub fn frame(random: &mut Random) -> Frame {
    let shift = random.choose(&[2, 2, 2, 3, 4, 7, 12, 26]);
    Frame { shift, rays: std::array::from_fn(|_| random.between(6, if shift == 26 { 11 } else { 9 }) as u32) }
}

/// Draws LOD-C from the fewest voxels to the most; the last mask word is often not full.
pub fn lod(random: &mut Random) -> u32 {
    match random.below(8) {
        0 => random.between(32, 65_536) as u32,
        1 => random.between(32, 200) as u32,
        _ => random.choose(&[32, 33, 64, 100, 256, 1024, 65_536]),
    }
}

/// A grid on which one lattice step is one world unit, so that soups are quantised to themselves.
pub fn grid(frame: &Frame, lod: u32) -> Grid {
    Grid::from_parts(DVec3::ZERO, f64::from(1u32 << frame.shift), frame.rays, frame.shift, lod).unwrap()
}

/// Draws any box with corners in the frame; now and then an empty one.
pub fn region(random: &mut Random, frame: &Frame) -> LatticeBox {
    let corner = |random: &mut Random| std::array::from_fn(|axis| random.between(0, frame.most(axis)));
    let (a, b): ([i32; 3], [i32; 3]) = (corner(random), corner(random));
    if random.chance(8) {
        return LatticeBox { min: a, max: b };
    }
    LatticeBox { min: std::array::from_fn(|i| a[i].min(b[i])), max: std::array::from_fn(|i| a[i].max(b[i])) }
}

/// Returns every generator of oriented soups by name.
pub fn oriented() -> Vec<(&'static str, Generator)> {
    let mut generators = soups::oriented();
    generators.push(("mixture", soups::mixture));
    generators
}

/// Returns every generator by name.
pub fn generators() -> Vec<(&'static str, Generator)> {
    let mut generators = oriented();
    generators.push(("disoriented", soups::disoriented));
    generators
}
