//! Certain spans and gaps from the crossings of primitives.

use crate::fixed::{Hit, Pixels};
use crate::grid::Axis;
use crate::sampler::lists::Keep;

/// The state of everything before the first and after the last crossing of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exterior {
    /// Outside: the solid is bounded.
    Out,
    /// Inside: the solid is the complement of a bounded one.
    In,
}

/// Spans of all rays along one axis, by the crossings at their ends.
///
/// The crossings of ray `r` are `hits[offsets[r] .. offsets[r + 1]]`, ascending in depth and of even count. With [`Exterior::Out`]
/// they alternately enter and leave, and a **gap** is from hit 2i + 1 to hit 2i + 2; with [`Exterior::In`] they alternately leave
/// and enter, and a gap is from hit 2i to hit 2i + 1. Everything outside the gaps is in, except beyond the first and last hit
/// with [`Exterior::Out`]. Every gap contains a node or spans at least two lattice steps from `ceil` of its first hit to `floor`
/// of its second.
#[derive(Clone, Debug, PartialEq)]
pub struct RaySpans<H> {
    /// The direction of the rays.
    pub axis: Axis,
    /// The first hit of each ray, and the end of the last.
    pub offsets: Vec<u32>,
    /// The ends of spans.
    pub hits: Vec<H>,
}

impl Exterior {
    /// Returns the index of the first hit of a ray that begins a gap.
    pub fn first_gap(self) -> usize {
        match self {
            Exterior::Out => 1,
            Exterior::In => 0,
        }
    }

    /// Appends the ends of possible gaps on a ray, and of the ray's whole span if it has an end. A gap with a node in it is
    /// kept however short it is: gaps of the two other rays through that node may be long.
    pub fn keep_gaps<H: Hit>(self, pixels: Pixels, sorted: &[H], kept: &mut Vec<H>) {
        self.keep().append(pixels, sorted, kept);
    }

    /// Returns which crossings of a ray to keep: the ends of possible gaps, and of its whole span if it has an end.
    pub fn keep(self) -> Keep {
        match self {
            Exterior::Out => Keep::GapsAndEnds,
            Exterior::In => Keep::Gaps,
        }
    }
}

impl<H: Hit> RaySpans<H> {
    /// Returns the hits of a ray.
    pub fn of_ray(&self, ray: u32) -> &[H] {
        &self.hits[self.offsets[ray as usize] as usize..self.offsets[ray as usize + 1] as usize]
    }
}
