//! The winding sums of the crossings of a ray.

use crate::fixed::Hit;
use crate::ldi::Windings;

/// Adds the sums of the sorted crossings of a closed ray, where each is a group of its own: the parity becomes odd at
/// every other one.
#[inline]
pub fn add_single<H: Hit>(windings: &mut Windings, sorted: &[H]) {
    for pair in sorted.chunks_exact(2) {
        let [start, end] = [pair[0].crossing(), pair[1].crossing()];
        windings.wound -= i64::from(start.nearest() * start.winding()) + i64::from(end.nearest() * end.winding());
        windings.aligned += i64::from(start.winding() - end.winding());
    }
    windings.changes += sorted.len() as i64;
}

/// Adds the sums of the sorted crossings of a closed ray, where `group` is the position of the group of each.
#[inline]
pub fn add<H: Hit>(windings: &mut Windings, sorted: &[H], group: impl Fn(H) -> u32) {
    let mut shared = false;
    let mut before = u32::MAX;
    for &hit in sorted {
        let this = group(hit);
        shared |= this == before;
        before = this;
    }
    if shared { add_groups(windings, sorted, group) } else { add_single(windings, sorted) }
}

/// Handles the general case of [`add`], which almost no ray needs.
#[cold]
fn add_groups<H: Hit>(windings: &mut Windings, sorted: &[H], group: impl Fn(H) -> u32) {
    let mut direction = -1;
    for in_group in sorted.chunk_by(|&a, &b| group(a) == group(b)) {
        for hit in in_group {
            let crossing = hit.crossing();
            windings.wound -= i64::from(crossing.nearest() * crossing.winding());
        }
        let winding: i32 = in_group.iter().map(|hit| hit.crossing().winding()).sum();
        if in_group.len().is_multiple_of(2) {
            windings.unpaired -= i64::from(group(in_group[0])) * i64::from(winding);
        } else {
            direction = -direction;
            windings.aligned += i64::from(direction * winding);
            windings.changes += 1;
        }
    }
}
