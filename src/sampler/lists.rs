//! Crossing lists: the crossings of triangles that bound nothing by themselves, reduced ray by ray to those that may
//! bound a solid. The solid lies behind every one of the triangles; in front of them it may or may not.
//!
//! Every backend gives the same lists. On a ray crossings ascend, coincident ones by their triangles; between one that
//! leaves and the next one, which enters, there may be a **gap** in the solid, if there is room for one: a node lies
//! between them, or there are at least two lattice steps from `ceil` of the first to `floor` of the second. A gap with
//! a node in it counts however short it is: the gaps of the two other rays through that node may be long.

use crate::fixed::{Hit, Pixels};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::TooManySamples;

use super::SampleError;

/// Crossings of all rays along one axis, ascending on each: those of ray `r` are `hits[offsets[r] .. offsets[r + 1]]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RayLists<H> {
    /// The offset of the hits of each ray, and the end of the last ones.
    pub offsets: Vec<u32>,
    /// The kept crossings.
    pub hits: Vec<H>,
    /// Number of crossings before the reduction.
    pub crossings: u64,
}

/// The crossings of some consecutive rays.
#[derive(Default)]
pub(crate) struct BandLists<H> {
    /// The end of the hits of each ray.
    pub ends: Vec<u32>,
    /// The kept crossings.
    pub hits: Vec<H>,
    /// Number of crossings before the reduction.
    pub crossings: u64,
}

impl<H: Copy> RayLists<H> {
    /// Joins the bands of an image along an axis, in order.
    pub(crate) fn of_bands(axis: Axis, bands: Vec<BandLists<H>>) -> Result<RayLists<H>, TooManySamples> {
        let total: usize = bands.iter().map(|band| band.hits.len()).sum();
        if total > u32::MAX as usize {
            return Err(TooManySamples { axis });
        }
        let rays: usize = bands.iter().map(|band| band.ends.len()).sum();
        let (offsets, hits) = (Vec::with_capacity(rays + 1), Vec::with_capacity(total));
        let mut lists = RayLists { offsets, hits, crossings: 0 };
        lists.offsets.push(0);
        for band in bands {
            let before = lists.hits.len() as u32;
            lists.offsets.extend(band.ends.iter().map(|end| before + end));
            lists.hits.extend_from_slice(&band.hits);
            lists.crossings += band.crossings;
        }
        Ok(lists)
    }
}

/// The rule for which crossings of a ray are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Keep {
    /// Both ends of each gap.
    Gaps,
    /// The first and the last of the ray, and between them both ends of each gap. A crossing that ends two of these is
    /// kept twice.
    GapsAndEnds,
}

impl Keep {
    /// Appends the kept ones of the sorted crossings of a ray.
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
    /// The error of a backend.
    type Error: Into<SampleError>;

    /// Returns the crossings of each ray along `axis` with `triangles`, reduced by `keep`.
    fn crossings<H: Hit>(&self, triangles: &LatticeSolid, axis: Axis, keep: Keep) -> Result<RayLists<H>, Self::Error>;
}
