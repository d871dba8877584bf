//! The segments of one ray that lie in a phase, and the kinds of their ends.

use super::{Phase, RegionSpans};
use crate::grid::Grid;
use crate::ldi::Spans;

/// The kind of an end of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The surface of the solid.
    Surface,
    /// The region's boundary; the segment may continue beyond.
    Boundary,
}

/// A segment of a ray within one phase of a region.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Segment {
    /// In lattice positions, below `end`.
    pub start: i32,
    /// In lattice positions.
    pub end: i32,
    /// The kinds of its start and end.
    pub ends: [End; 2],
}

impl Segment {
    /// Returns the length in lattice steps.
    pub fn length(&self) -> i32 {
        self.end - self.start
    }
}

/// Returns the distance from the region's boundary within which a surface counts as lying in it, in lattice steps: a millionth
/// of the grid's longest side, about ten times the rounding of the coordinates of a file in single precision.
pub(super) fn flush(grid: &Grid) -> i32 {
    let longest = (0..3).map(|axis| grid.length(axis)).fold(0, i32::max);
    (longest / 1_000_000).max(4)
}

/// Visits the segments of a ray in a phase, ascending.
///
/// An end within `flush` steps of an end of the region's span counts as one at the boundary, whatever its cause; the sliver
/// between that end and the boundary is dropped. With a `flush` of 0 the segments of the two phases fill the region's spans.
pub(super) fn segments(
    solid: Spans<'_>,
    region: RegionSpans<'_>,
    phase: Phase,
    flush: i32,
    mut visit: impl FnMut(Segment),
) {
    let mut solid = solid.peekable();
    for (low, high) in region {
        let end_at = |depth: i32| match depth <= low + flush || depth >= high - flush {
            true => End::Boundary,
            false => End::Surface,
        };
        let mut say = |of: Phase, start: i32, end: i32| {
            let is_sliver = start >= end || end <= low + flush || start >= high - flush;
            if of == phase && !is_sliver {
                visit(Segment { start, end, ends: [end_at(start), end_at(end)] });
            }
        };
        while solid.next_if(|&(_, end)| end <= low).is_some() {}
        let mut at = low;
        while let Some(&(start, end)) = solid.peek()
            && start < high
        {
            say(Phase::Pore, at, start.max(low));
            say(Phase::Solid, start.max(low), end.min(high));
            at = end.min(high);
            if end > high {
                // It may continue in the next span of the region.
                break;
            }
            solid.next();
        }
        say(Phase::Pore, at, high);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use End::{Boundary, Surface};

    fn of(solid: &[i32], region: &[i32], phase: Phase, flush: i32) -> Vec<(i32, i32, [End; 2])> {
        let mut found = Vec::new();
        segments(Spans::new(solid), RegionSpans::Solid(Spans::new(region)), phase, flush, |segment| {
            found.push((segment.start, segment.end, segment.ends));
        });
        found
    }

    #[test]
    fn a_ray_is_cut_into_both_phases() {
        let (solid, region) = ([0, 10, 20, 30, 40, 80, 95, 99], [5, 50, 60, 90, 100, 110]);
        let solids = of(&solid, &region, Phase::Solid, 0);
        assert_eq!(
            solids,
            [
                (5, 10, [Boundary, Surface]),
                (20, 30, [Surface, Surface]),
                (40, 50, [Surface, Boundary]),
                (60, 80, [Boundary, Surface]),
            ]
        );
        let pores = of(&solid, &region, Phase::Pore, 0);
        assert_eq!(
            pores,
            [
                (10, 20, [Surface, Surface]),
                (30, 40, [Surface, Surface]),
                (80, 90, [Surface, Boundary]),
                (100, 110, [Boundary, Boundary]),
            ]
        );
    }

    #[test]
    fn ends_within_rounding_of_the_boundary_are_cut_there() {
        let (solid, region) = ([13, 20, 30, 48], [10, 50]);
        assert_eq!(
            of(&solid, &region, Phase::Solid, 4),
            [(13, 20, [Boundary, Surface]), (30, 48, [Surface, Boundary])]
        );
        assert_eq!(of(&solid, &region, Phase::Pore, 4), [(20, 30, [Surface, Surface])]);
        // A sliver of solid in the boundary ends no pore.
        assert_eq!(of(&[11, 13], &region, Phase::Pore, 4), [(13, 50, [Boundary, Boundary])]);
    }

    #[test]
    fn the_two_phases_fill_the_region() {
        // Every solid and region of three spans on a short ray.
        let spans = |bits: u32| -> Vec<i32> {
            (0..8).filter(|i| (bits >> i & 1) != (bits >> (i + 1) & 1)).map(|i| i + 1).collect()
        };
        for solid in (0..256).map(|bits| spans(bits << 1)) {
            for region in (0..256).map(|bits| spans(bits << 1)) {
                let (solid, region) = (even(&solid), even(&region));
                let length = |phase| of(solid, region, phase, 0).iter().map(|(start, end, _)| end - start).sum::<i32>();
                let whole: i32 = region.chunks(2).map(|span| span[1] - span[0]).sum();
                assert_eq!(length(Phase::Solid) + length(Phase::Pore), whole, "{solid:?} {region:?}");
                let is_in = |spans: &[i32], x: i32| spans.chunks(2).any(|span| (span[0]..span[1]).contains(&x));
                let both = (0..12).filter(|&x| is_in(solid, x) && is_in(region, x)).count() as i32;
                assert_eq!(length(Phase::Solid), both, "{solid:?} {region:?}");
            }
        }
    }

    fn even(samples: &[i32]) -> &[i32] {
        &samples[..samples.len() / 2 * 2]
    }
}
