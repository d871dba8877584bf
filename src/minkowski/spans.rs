//! Certain spans and gaps from the crossings of primitives.

use crate::parallel::*;

use crate::fixed::{Hit, Pixels};
use crate::grid::{Axis, RAYS_MAX};
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

/// The nodes behind the first and the last crossing of every ray along an axis, so that the rays that do not change in a slab of
/// planes across it are passed over without a look at their crossings.
#[derive(Debug)]
pub struct RayEnds(Vec<RayEnd>);

/// The nodes behind the first and the last crossing of a ray; without crossings, the first is above the last. Of 2^16 nodes, the
/// one behind the last counts as the last.
#[derive(Clone, Copy, Debug)]
struct RayEnd {
    first: u16,
    last: u16,
    /// True if there are no crossings besides these.
    has_two: bool,
}

/// Where a range of nodes lies on a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RangeOnRay {
    /// Before the first crossing, or behind the last.
    Beyond,
    /// Between the only two crossings, behind which are these nodes.
    Between([usize; 2]),
    /// Where crossings may be.
    Among,
}

impl RayEnds {
    /// Returns where the nodes from `start` to `end` lie on a ray, by the crossings with one of them behind.
    #[inline]
    pub fn place(&self, ray: u32, start: usize, end: usize) -> RangeOnRay {
        let RayEnd { first, last, has_two } = self.0[ray as usize];
        let (first, last) = (usize::from(first), usize::from(last));
        match () {
            _ if last < start || end < first => RangeOnRay::Beyond,
            _ if has_two && first < start && end < last => RangeOnRay::Between([first, last]),
            _ => RangeOnRay::Among,
        }
    }
}

impl<H: Hit> RaySpans<H> {
    /// Returns the hits of a ray.
    pub fn of_ray(&self, ray: u32) -> &[H] {
        &self.hits[self.offsets[ray as usize] as usize..self.offsets[ray as usize + 1] as usize]
    }

    /// Returns the nodes behind the first and the last crossing of every ray.
    pub fn ends(&self, pixels: Pixels) -> RayEnds
    where
        H: Sync,
    {
        // Behind the last of the most nodes is one more, which counts as the last: no range begins with it.
        const _: () = assert!(RAYS_MAX <= 1 << 16);
        let node = |hit: &H| u16::try_from(pixels.index_from(hit.crossing().nearest())).unwrap_or(u16::MAX);
        let of_ray = |ray: u32| {
            let hits = self.of_ray(ray);
            let (first, last) = (hits.first().map_or(u16::MAX, node), hits.last().map_or(0, node));
            RayEnd { first, last, has_two: hits.len() == 2 }
        };
        RayEnds((0..self.offsets.len() as u32 - 1).into_par_iter().with_min_len(1 << 12).map(of_ray).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::Crossing;
    use crate::testing::random::Random;

    #[test]
    fn ranges_are_passed_over_where_no_crossing_is_among_them() {
        let (mut random, pixels) = (Random::new(8), Pixels::new(6));
        let (mut offsets, mut nodes) = (vec![0], Vec::new());
        for _ in 0..300 {
            let mut of_ray: Vec<i32> = (0..2 * random.below(4)).map(|_| random.below(40) as i32).collect();
            of_ray.sort_unstable();
            nodes.extend(of_ray);
            offsets.push(nodes.len() as u32);
        }
        let hits = nodes.iter().map(|&node| Crossing::at(f64::from(pixels.ray(node) - 5), 1)).collect();
        let spans = RaySpans { axis: Axis::Z, offsets, hits };
        let (ends, mut counts) = (spans.ends(pixels), [0; 3]);
        for ray in 0..300 {
            let range = spans.offsets[ray as usize] as usize..spans.offsets[ray as usize + 1] as usize;
            let nodes: Vec<usize> = nodes[range].iter().map(|&node| node as usize).collect();
            for start in 0..40 {
                for end in [start, start + 7, usize::MAX] {
                    let before = nodes.iter().filter(|&&node| node < start).count();
                    let among = nodes.iter().filter(|&&node| (start..=end).contains(&node)).count();
                    let kind = match ends.place(ray, start, end) {
                        RangeOnRay::Beyond => {
                            assert!(among == 0 && (before == 0 || before == nodes.len()));
                            0
                        }
                        RangeOnRay::Between(of_ray) => {
                            assert!(among == 0 && before == 1 && of_ray[..] == nodes);
                            1
                        }
                        RangeOnRay::Among => {
                            assert!(among > 0 || nodes.len() != 2);
                            2
                        }
                    };
                    counts[kind] += 1;
                }
            }
        }
        assert!(counts.iter().all(|&count| count > 1000), "{counts:?}");
    }
}
