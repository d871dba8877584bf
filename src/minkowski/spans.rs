//! What is certainly in: from the crossings of primitives to spans and gaps.

use crate::fixed::{Hit, Pixels};
use crate::grid::Axis;
use crate::sampler::lists::Keep;

/// What lies outside of everything: before the first and after the last crossing of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outer {
    /// Nothing: the solid is bounded.
    Out,
    /// The solid: it is the complement of a bounded one.
    In,
}

/// Spans of all rays along one axis, by the crossings at their ends.
///
/// The crossings of ray `r` are `hits[offsets[r] .. offsets[r + 1]]`, ascending in depth and of even count. With
/// [`Outer::Out`] they enter and leave in turn, and a **gap** is from hit 2i + 1 to hit 2i + 2; with [`Outer::In`] they leave
/// and enter in turn, and a gap is from hit 2i to hit 2i + 1. All that lies in no gap is in, but for what is beyond the
/// first and last hit with [`Outer::Out`]. A node lies in every gap, or from `ceil` of its first hit to `floor` of its second
/// there are two lattice steps at the least.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySpans<H> {
    /// The direction of the rays.
    pub axis: Axis,
    /// Where the hits of each ray begin, and where the last ones end.
    pub offsets: Vec<u32>,
    /// Ends of spans.
    pub hits: Vec<H>,
}

impl Outer {
    /// Index of the first hit of a ray that begins a gap.
    pub fn first_gap(self) -> usize {
        match self {
            Outer::Out => 1,
            Outer::In => 0,
        }
    }

    /// Appends the ends of what may be gaps on a ray, and of the ray's whole span if it has an end. A gap with a node in it
    /// is kept however short it is: gaps of the two other rays through that node may be long.
    pub fn keep_gaps<H: Hit>(self, pixels: Pixels, sorted: &[H], kept: &mut Vec<H>) {
        self.keep().append(pixels, sorted, kept);
    }

    /// Which crossings of a ray are ends of what may be gaps, or of its whole span if it has an end.
    pub fn keep(self) -> Keep {
        match self {
            Outer::Out => Keep::GapsAndEnds,
            Outer::In => Keep::Gaps,
        }
    }
}

impl<H: Hit> RaySpans<H> {
    /// The hits of a ray.
    pub fn of_ray(&self, ray: u32) -> &[H] {
        &self.hits[self.offsets[ray as usize] as usize..self.offsets[ray as usize + 1] as usize]
    }
}
