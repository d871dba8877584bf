//! Retrieval: each crossing finds its rank in O(1) and stores the least or the greatest depth there.

use super::classify::RayClasses;
use crate::fixed::Crossing;
use crate::sampler::Estimate;
use crate::sampler::layout::{Voxels, WORD_BITS};

/// Returns the value that every depth replaces, by the parity of its rank and the estimate.
pub fn identity(rank: usize, estimate: Estimate) -> i32 {
    if keeps_least(rank as u32, estimate) { i32::MAX } else { i32::MIN }
}

/// Returns whether a rank keeps the least depth. Even ranks enter and odd ones leave; the over-estimate enters at the
/// least and leaves at the greatest depth.
#[inline]
fn keeps_least(rank: u32, estimate: Estimate) -> bool {
    rank.is_multiple_of(2) == (estimate == Estimate::Over)
}

/// Merges the crossings of a ray into its samples, which hold identities or earlier crossings. `any` is the mask of the
/// crossings' own solid: where it is not set, its crossings lie inside the solid and are not on the surface.
pub fn retrieve(
    crossings: &[Crossing],
    any: &[u32],
    classes: &RayClasses,
    voxels: &Voxels,
    estimate: Estimate,
    samples: &mut [i32],
) {
    for &crossing in crossings {
        let voxel = voxels.of(crossing);
        let (word, bit) = ((voxel / WORD_BITS) as usize, 1u32 << (voxel % WORD_BITS));
        let (single, pair) = (classes.single[word], classes.pair[word]);
        if (single | pair) & any[word] & bit == 0 {
            continue;
        }
        let below = bit - 1;
        let rank = classes.rank[word] + (single & below).count_ones() + 2 * (pair & below).count_ones();
        keep(samples, rank, crossing, estimate);
        if pair & bit != 0 {
            keep(samples, rank + 1, crossing, estimate);
        }
    }
}

#[inline]
fn keep(samples: &mut [i32], rank: u32, crossing: Crossing, estimate: Estimate) {
    let sample = &mut samples[rank as usize];
    let depth = rounded(crossing, rank, estimate);
    *sample = if keeps_least(rank, estimate) { (*sample).min(depth) } else { (*sample).max(depth) };
}

/// Returns the depth of a crossing as a sample of the given rank keeps it: least depths are rounded down and greatest
/// up, outward for the over-, inward for the under-estimate.
#[inline]
pub fn rounded(crossing: Crossing, rank: u32, estimate: Estimate) -> i32 {
    if keeps_least(rank, estimate) { crossing.floor() } else { crossing.ceil() }
}
