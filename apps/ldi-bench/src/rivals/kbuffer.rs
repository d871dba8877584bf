//! The nearest few layers a pass, by depth.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, LatticeSolid};

use super::{Layers, Rival, for_each_fragment, rays};

const K: usize = 8;

/// The eight nearest fragments of a ray in each pass, inserted in order of depth.
///
/// L. Bavoil, S. P. Callahan, A. Lefohn, J. L. D. Comba and C. T. Silva, Multi-fragment effects on the GPU using the k-buffer,
/// Interactive 3D Graphics and Games 2007. A single pass loses all but eight layers of a ray. Further passes take those deeper
/// than the last one kept, and lose fragments at the same depth as that. The races of the hardware, which lose more, are left out.
pub struct KBuffer {
    name: &'static str,
    passes: u32,
}

impl KBuffer {
    /// The method in a single pass.
    pub const ONE_PASS: KBuffer = KBuffer { name: "k-buffer, 8, one pass", passes: 1 };
    /// The method with as many passes as the solid needs.
    pub const ALL_PASSES: KBuffer = KBuffer { name: "k-buffer, 8 a pass", passes: u32::MAX };
}

impl Rival for KBuffer {
    fn name(&self) -> &'static str {
        self.name
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let mut found = Vec::new();
        let mut last = vec![-1; rays(solid, axis)];
        let mut nearest = vec![([Crossing::default(); K], 0); last.len()];
        let mut passes = 0;
        let mut overflows = true;
        while overflows && passes < self.passes {
            overflows = false;
            for_each_fragment(solid, axis, |ray, crossing| {
                if crossing.nearest() > last[ray] {
                    let (kept, count) = &mut nearest[ray];
                    let place = kept[..*count].partition_point(|&other| other <= crossing);
                    overflows |= *count == K;
                    if place < K {
                        kept[place..(*count + 1).min(K)].rotate_right(1);
                        kept[place] = crossing;
                        *count = (*count + 1).min(K);
                    }
                }
            });
            for (ray, (kept, count)) in nearest.iter_mut().enumerate() {
                found.extend(kept[..*count].iter().map(|&crossing| (ray as u32, crossing)));
                last[ray] = kept[..*count].last().map_or(i32::MAX, |deepest| deepest.nearest());
                *count = 0;
            }
            passes += 1;
        }
        Layers::gather(last.len(), &found, passes)
    }
}
