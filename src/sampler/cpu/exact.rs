//! Exact images: the sorted crossings of a ray.

use crate::fixed::Crossing;
use crate::sampler::Fill;

/// Appends the exact samples of one ray, whose crossings close, to `depths`; sorts `crossings` on the way.
pub fn resolve(crossings: &mut [Crossing], fill: Fill, depths: &mut Vec<i32>) {
    sort(crossings);
    match fill {
        Fill::EvenOdd => depths.extend(crossings.iter().map(|c| c.nearest())),
        Fill::NonZero => {
            let mut winding = 0;
            for group in crossings.chunk_by(|a, b| a.nearest() == b.nearest()) {
                let after = winding + group.iter().map(|c| c.winding()).sum::<i32>();
                if (winding != 0) != (after != 0) {
                    depths.push(group[0].nearest());
                }
                winding = after;
            }
        }
    }
}

/// Sorts the crossings of a ray by depth. Most rays have a few, for which insertion beats everything.
#[inline]
pub fn sort(crossings: &mut [Crossing]) {
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
