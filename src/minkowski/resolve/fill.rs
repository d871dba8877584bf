//! Removal of gaps from spans.

use crate::fixed::Hit;
use crate::minkowski::RaySpans;

/// Removes the gaps that begin at the given hits, each with the hit at its end.
pub fn fill<H: Hit>(spans: &mut RaySpans<H>, mut begins: Vec<u32>) {
    begins.sort_unstable();
    let Some(&first) = begins.first() else { return };
    let RaySpans { offsets, hits, .. } = spans;
    // The hits between two removed gaps move up; offsets decrease by the gaps that begin before them.
    let mut kept = first as usize;
    for (at, &begin) in begins.iter().enumerate() {
        let end = begins.get(at + 1).map_or(hits.len(), |&next| next as usize);
        hits.copy_within(begin as usize + 2..end, kept);
        kept += end - begin as usize - 2;
    }
    hits.truncate(kept);
    let mut passed = 0;
    for offset in offsets {
        while passed < begins.len() && begins[passed] < *offset {
            passed += 1;
        }
        *offset -= 2 * passed as u32;
    }
}
