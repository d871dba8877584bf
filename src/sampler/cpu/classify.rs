//! Classification: turns masks into classes (which voxels keep samples) and ranks (how many samples precede them).

use super::masks::RayMasks;
use crate::bits::{self, prefix_parity};
use crate::sampler::Estimate;
use crate::sampler::layout::WORD_BITS;

/// The classes of the voxels of one ray, in the occupied words.
pub struct RayClasses {
    /// Bit z: voxel z enters or leaves and keeps one sample.
    pub single: Vec<u32>,
    /// Bit z: voxel z keeps two samples: entering-leaving for the over-, leaving-entering for the under-estimate.
    pub pair: Vec<u32>,
    /// p at the beginning of each word: the number of samples in the words before it.
    pub rank: Vec<u32>,
    /// Number of samples of the ray.
    pub samples: u32,
}

impl RayClasses {
    /// Returns classes for rays of `words` mask words; each classification overwrites their contents.
    pub fn new(words: usize) -> RayClasses {
        RayClasses { single: vec![0; words], pair: vec![0; words], rank: vec![0; words], samples: 0 }
    }

    /// Classifies the voxels of one solid, whose ray closes.
    pub fn classify(&mut self, masks: &RayMasks, estimate: Estimate) {
        self.samples = 0;
        let mut inside = 0u32;
        bits::ones(&masks.occupied).for_each(|word| {
            let (change, any) = (masks.change[word], masks.any[word]);
            // T1: the inside state at the far face of each voxel.
            let far = prefix_parity(change) ^ inside;
            inside = spread_top(far);
            let pair = match estimate {
                Estimate::Over => any & !change & !far,
                Estimate::Under => any & !change & far,
            };
            self.record(word, change, pair);
        });
        debug_assert_eq!(inside, 0, "a ray that closes ends outside");
    }

    /// Classifies the voxels of the intersection of two solids, each of which closes.
    pub fn classify_intersection(&mut self, a: &RayMasks, b: &RayMasks, occupied: &[u64], estimate: Estimate) {
        self.samples = 0;
        let (mut inside_a, mut inside_b) = (0u32, 0u32);
        bits::ones(occupied).for_each(|word| {
            let far_a = prefix_parity(a.change[word]) ^ inside_a;
            let far_b = prefix_parity(b.change[word]) ^ inside_b;
            let near_a = far_a << 1 | inside_a & 1;
            let near_b = far_b << 1 | inside_b & 1;
            (inside_a, inside_b) = (spread_top(far_a), spread_top(far_b));
            let (far, near) = (far_a & far_b, near_a & near_b);
            let pair = match estimate {
                Estimate::Over => (far_a | near_a | a.any[word]) & (far_b | near_b | b.any[word]) & !far & !near,
                Estimate::Under => (a.any[word] | b.any[word]) & far & near,
            };
            self.record(word, far ^ near, pair);
        });
    }

    #[inline]
    fn record(&mut self, word: usize, single: u32, pair: u32) {
        (self.single[word], self.pair[word], self.rank[word]) = (single, pair, self.samples);
        self.samples += single.count_ones() + 2 * pair.count_ones();
    }
}

/// Returns a word with all bits equal to the top one: the state that one word passes to the next.
#[inline]
fn spread_top(word: u32) -> u32 {
    ((word as i32) >> (WORD_BITS - 1)) as u32
}
