//! Crossings by lists: those of triangles that bound nothing by themselves, reduced ray by ray to the ones that may bound a
//! solid which lies behind every one of the triangles, and before none of them for certain.
//!
//! Every backend gives the same lists. On a ray crossings ascend, coincident ones by their triangles; from one that leaves to
//! the next one, which enters, there may be a **gap** in the solid, if there is room for one: a node lies between them, or
//! from `ceil` of the first to `floor` of the second there are two lattice steps at the least. A gap with a node in it counts
//! however short it is: those of the two other rays through that node may be long.

use crate::fixed::{Hit, Pixels};
use crate::grid::{Axis, LatticeSolid};

use super::SampleError;

/// Crossings of all rays along one axis, ascending on each: those of ray `r` are `hits[offsets[r] .. offsets[r + 1]]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RayLists<H> {
    /// Where the hits of each ray begin, and where the last ones end.
    pub offsets: Vec<u32>,
    /// The crossings that were kept.
    pub hits: Vec<H>,
    /// How many there were before.
    pub crossings: u64,
}

/// Which crossings of a ray are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Keep {
    /// Both ends of each gap.
    Gaps,
    /// The first and the last of the ray, and between them both ends of each gap. One that is an end twice is kept twice.
    GapsAndEnds,
}

impl Keep {
    /// Appends those of the sorted crossings of a ray that are kept.
    pub fn append<H: Hit>(self, pixels: Pixels, sorted: &[H], kept: &mut Vec<H>) {
        let (Some(&first), Some(&last)) = (sorted.first(), sorted.last()) else { return };
        if self == Keep::GapsAndEnds {
            kept.push(first);
        }
        for pair in sorted.windows(2) {
            let [before, after] = [pair[0].crossing(), pair[1].crossing()];
            let holds_node = || pixels.index_from(before.nearest()) < pixels.index_from(after.nearest());
            if before.winding() < 0 && after.winding() > 0 && (before.ceil() < after.floor() || holds_node()) {
                kept.extend_from_slice(pair);
            }
        }
        if self == Keep::GapsAndEnds {
            kept.push(last);
        }
    }
}

/// Lists crossings. Every implementation gives the same bits.
pub trait ListSampler {
    /// Why there may be no lists.
    type Error: Into<SampleError>;

    /// The crossings of each ray along `axis` with `triangles`, less those that `keep` leaves out.
    fn crossings<H: Hit>(&self, triangles: &LatticeSolid, axis: Axis, keep: Keep) -> Result<RayLists<H>, Self::Error>;
}
