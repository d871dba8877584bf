//! Exact images: the sorted crossings of a ray.

#[cfg(target_arch = "x86_64")]
use super::network;
use crate::fixed::{Crossing, Hit};
use crate::sampler::FillRule;
use crate::sampler::layout::Voxels;

/// Passes the exact samples of one ray, whose crossings close, to `keep`; sorts `hits` first. Where several crossings
/// make one sample under the non-zero rule, it is the first with the direction of the sample.
pub fn resolve<H: Hit>(hits: &mut [H], fill: FillRule, mut keep: impl FnMut(H)) {
    sort(hits);
    match fill {
        FillRule::EvenOdd => hits.iter().for_each(|&hit| keep(hit)),
        FillRule::NonZero => {
            let mut winding = 0;
            for group in hits.chunk_by(|a, b| a.crossing().nearest() == b.crossing().nearest()) {
                let step: i32 = group.iter().map(|hit| hit.crossing().winding()).sum();
                if (winding != 0) != (winding + step != 0) {
                    let along = group.iter().find(|hit| hit.crossing().winding() == step.signum());
                    keep(*along.expect("a sum has a term of its own sign"));
                }
                winding += step;
            }
        }
    }
}

/// Returns whether the sorted crossings of a ray all lie in different voxels. Then no two of them merge, so that the
/// estimate has a sample for each and needs no masks: with LOD-C 1024 that holds for all but one ray in fifty of a
/// scaffold.
pub fn in_voxels_of_their_own(crossings: &[Crossing], voxels: &Voxels) -> bool {
    crossings.windows(2).all(|pair| voxels.of(pair[0]) != voxels.of(pair[1]))
}

/// Sorts the crossings of a ray by depth. Most rays have only a few.
#[inline]
pub fn sort<H: Hit>(crossings: &mut [H]) {
    #[cfg(target_arch = "x86_64")]
    if let 5..=network::MOST = crossings.len()
        && is_x86_feature_detected!("avx2")
        && let Some(keys) = H::keys(crossings)
    {
        // SAFETY: the processor has AVX2.
        return unsafe { network::sort(keys) };
    }
    const FEW: usize = 24;
    if crossings.len() > FEW {
        return crossings.sort_unstable();
    }
    for i in 1..crossings.len() {
        let moving = crossings[i];
        let mut to = i;
        while to > 0 && crossings[to - 1] > moving {
            crossings[to] = crossings[to - 1];
            to -= 1;
        }
        crossings[to] = moving;
    }
}
