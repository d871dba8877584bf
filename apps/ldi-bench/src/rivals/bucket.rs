//! 32 layers a pass, by depth.

use ldi_ops::fixed::Crossing;
use ldi_ops::grid::{Axis, LatticeSolid};

use super::{Layers, Rival, for_each_fragment, rays};

const BUCKETS: usize = 32;

/// A bucket for each of 32 equal parts of a ray's depth range, each of which keeps one fragment, the deepest.
///
/// F. Liu, M.-C. Huang, X.-H. Liu and E.-H. Wu, Efficient depth peeling via bucket sort, High Performance Graphics 2009. This is
/// its form of one bucket sort with uniform buckets and MAX blending. Of fragments in the same bucket all but one are lost; the
/// paper reduces that by more passes or by buckets fitted to the depths. The range is that of the ray's fragments, from a pass of
/// its own: the range of a bounding box would cost nothing and lose more.
pub struct BucketPeeling;

impl Rival for BucketPeeling {
    fn name(&self) -> &'static str {
        "bucket peeling, 32"
    }

    fn sample(&self, solid: &LatticeSolid, axis: Axis) -> Layers {
        let mut ranges = vec![(i32::MAX, 0); rays(solid, axis)];
        for_each_fragment(solid, axis, |ray, crossing| {
            let (least, greatest) = ranges[ray];
            ranges[ray] = (least.min(crossing.nearest()), greatest.max(crossing.nearest()));
        });
        let mut buckets: Vec<Option<Crossing>> = vec![None; BUCKETS * ranges.len()];
        for_each_fragment(solid, axis, |ray, crossing| {
            let (least, greatest) = ranges[ray];
            let extent = (greatest - least + 1) as u64;
            let bucket = (crossing.nearest() - least) as u64 * BUCKETS as u64 / extent;
            let kept = &mut buckets[BUCKETS * ray + bucket as usize];
            *kept = (*kept).max(Some(crossing));
        });
        let kept = buckets.iter().enumerate().filter_map(|(i, kept)| kept.map(|kept| ((i / BUCKETS) as u32, kept)));
        Layers::gather(ranges.len(), &kept.collect::<Vec<_>>(), 2)
    }
}
