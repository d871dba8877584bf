//! The masks of one ray: W (the inside state changes over a voxel) and ANY (the surface may lie in it).
//!
//! The paper builds T1 in one geometry pass and T2 in another. W (one XOR a crossing) and ANY (one OR) come from a
//! single pass, and T1 is the prefix parity of W (sampling.md §3).

use crate::bits::Ones;
use crate::fixed::Crossing;
use crate::sampler::FillRule;
use crate::sampler::layout::{Voxels, WORD_BITS};

/// Masks W and ANY of one ray, and which of their words are not zero.
pub struct RayMasks {
    /// Bit z: the inside state differs between the near and the far face of voxel z.
    pub change: Vec<u32>,
    /// Bit z: voxel z is touched.
    pub any: Vec<u32>,
    /// Bit k: word k of `any` is not zero. Words that are zero are never visited, so that the cost depends on the
    /// number of crossings and not on LOD-C.
    pub occupied: Vec<u64>,
}

impl RayMasks {
    /// Returns empty masks for rays of the given voxels.
    pub fn new(voxels: &Voxels) -> RayMasks {
        let words = voxels.words();
        RayMasks { change: vec![0; words], any: vec![0; words], occupied: vec![0; words.div_ceil(64)] }
    }

    /// Enters the crossings of a ray into empty masks; the non-zero rule requires them sorted.
    pub fn enter(&mut self, crossings: &[Crossing], fill: FillRule, voxels: &Voxels) {
        match fill {
            FillRule::EvenOdd => {
                for &crossing in crossings {
                    let voxel = voxels.of(crossing);
                    self.change[(voxel / WORD_BITS) as usize] ^= 1 << (voxel % WORD_BITS);
                    self.touch(voxel);
                }
            }
            FillRule::NonZero => {
                let mut winding = 0;
                for in_voxel in crossings.chunk_by(|&a, &b| voxels.of(a) == voxels.of(b)) {
                    let voxel = voxels.of(in_voxel[0]);
                    let before = winding;
                    let mut may_be_zero = false;
                    for group in in_voxel.chunk_by(|a, b| a.half_floor() == b.half_floor()) {
                        let entering = group.iter().filter(|c| c.winding() > 0).count() as i32;
                        let leaving = group.len() as i32 - entering;
                        // A group contains a crossing, so that it always has a winding other than zero.
                        may_be_zero |= (winding - leaving..=winding + entering).contains(&0);
                        winding += entering - leaving;
                    }
                    if may_be_zero {
                        self.touch(voxel);
                        if (before != 0) != (winding != 0) {
                            self.change[(voxel / WORD_BITS) as usize] ^= 1 << (voxel % WORD_BITS);
                        }
                    }
                }
            }
        }
    }

    #[inline]
    fn touch(&mut self, voxel: u32) {
        let word = (voxel / WORD_BITS) as usize;
        self.any[word] |= 1 << (voxel % WORD_BITS);
        self.occupied[word / 64] |= 1 << (word % 64);
    }

    /// Empties the masks.
    pub fn clear(&mut self) {
        for (index, summary) in self.occupied.iter_mut().enumerate() {
            for bit in Ones(std::mem::take(summary)) {
                let word = index * 64 + bit as usize;
                (self.change[word], self.any[word]) = (0, 0);
            }
        }
    }
}
