//! Random frames and regions of the lattice, and all generators of soups.

use ldi_ops::grid::LatticeBox;

use crate::soups::{self, Frame, Generator};
use crate::testing::random::Random;

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

/// Draws any box with corners in the frame; now and then an empty one.
pub fn region(random: &mut Random, frame: &Frame) -> LatticeBox {
    let corner = |random: &mut Random| std::array::from_fn(|axis| random.between(0, frame.most(axis)));
    let (a, b): ([i32; 3], [i32; 3]) = (corner(random), corner(random));
    if random.chance(8) {
        return LatticeBox { min: a, max: b };
    }
    LatticeBox { min: std::array::from_fn(|i| a[i].min(b[i])), max: std::array::from_fn(|i| a[i].max(b[i])) }
}

/// Returns every generator by name.
pub fn generators() -> Vec<(&'static str, Generator)> {
    let mut generators = soups::oriented();
    generators.push(("disoriented", soups::disoriented));
    generators
}
