//! The minimum of squared distances along lines.
//!
//! In solids and pores most distances are a few pitches, and the places that can lower a value are no farther off than its
//! root. Trying them one after another, at many places at once, takes a sixth of the time of the lower envelope (measured on
//! distances up to 26 pitches), which remains from the first place on that may need one farther off. The minima differ by the
//! roundings of the envelope, which compares parabolas in `f32`.

use std::ops::Range;

use super::envelope::{Envelope, Nearest};
use super::site::Site;

/// Number of elements lowered together.
pub(super) const LANES: usize = 32;

/// Places to either side that are tried before the lower envelope is taken.
const REACH: usize = 80;
const _: () = assert!(REACH.is_multiple_of(2), "steps are taken in pairs");

/// Lines that are lowered together: [`LANES`] side by side, or a single one, at as many neighbouring places at once.
///
/// Beyond either end of a line is room for the places that its ends reach: without sites, or with those of its repetitions.
pub(super) struct Lines<S> {
    squared: Vec<f32>,
    sites: Vec<S>,
    places: usize,
    /// Places of a line are this far apart.
    stride: usize,
    /// Places beyond either end.
    room: usize,
    repeats: bool,
    /// The lower envelopes, where some line needs them.
    by_envelope: Vec<Nearest>,
    line: Vec<Nearest>,
    envelope: Envelope,
}

impl<S: Site> Lines<S> {
    /// Returns lines without sites, of which `stride` lie side by side.
    pub fn new(places: usize, stride: usize, repeats: bool) -> Lines<S> {
        let room = if repeats { REACH } else { REACH.min(places) };
        let length = (places + 2 * room) * stride + LANES;
        let (by_envelope, line, envelope) = Default::default();
        let (squared, sites) = (vec![f32::INFINITY; length], vec![S::NONE; length]);
        Lines { squared, sites, places, stride, room, repeats, by_envelope, line, envelope }
    }

    /// Returns the squared distances and sites of some elements, those of place `i` on line `l` at `i · stride + l`.
    pub fn part(&mut self, part: Range<usize>) -> (&mut [f32], &mut [S]) {
        let from = self.room * self.stride;
        let part = from + part.start..from + part.end;
        (&mut self.squared[part.clone()], &mut self.sites[part])
    }

    /// Sets the squared distances and sites of a place of the first lines.
    pub fn set(&mut self, place: usize, squared: &[f32], sites: &[S]) {
        let first = place * self.stride;
        let part = self.part(first..first + squared.len());
        copy(squared, part.0);
        copy(sites, part.1);
    }

    /// Passes the minimum at each place of the line of squared distance plus squared offset, with its site, to `put`: of the
    /// first `lines` at one place, or of a single line at [`LANES`] places from the one given on, and at its end at those that are
    /// left. Of equal ones it is the first on the line.
    pub fn lower(&mut self, lines: usize, put: impl FnMut(usize, &[f32], &[S])) {
        if self.repeats {
            self.repeat();
        }
        self.by_envelope.clear();
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.lower_avx2(lines, put) };
        }
        self.lower_by(least_near, lines, put);
    }

    /// Lowers elements with AVX2.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn lower_avx2(&mut self, lines: usize, put: impl FnMut(usize, &[f32], &[S])) {
        self.lower_by(|group, found| least_near_avx2(group, found), lines, put);
    }

    /// Lowers elements by `near`; from the first on for which that fails, by the envelope.
    #[inline(always)]
    fn lower_by(
        &mut self,
        near: impl Fn(Group<S>, &mut Found<S>) -> bool,
        lines: usize,
        mut put: impl FnMut(usize, &[f32], &[S]),
    ) {
        let end = self.places * self.stride;
        let mut found = ([0.0; LANES], [S::NONE; LANES]);
        for (first, place) in (0..end).step_by(LANES).zip((0..).step_by(LANES / self.stride)) {
            let lanes = if self.stride == 1 { LANES.min(end - first) } else { lines };
            let is_near = self.by_envelope.is_empty() && near(self.group(first, lanes), &mut found);
            if !is_near {
                found = self.at_envelope(first, lines);
            }
            put(place, &found.0[..lanes], &found.1[..lanes]);
        }
    }

    /// Returns some elements and what surrounds them.
    fn group(&self, first: usize, lanes: usize) -> Group<'_, S> {
        let &Lines { ref squared, ref sites, places, stride, room, repeats, .. } = self;
        let steps = if repeats { usize::MAX } else { places - 1 };
        Group { squared, sites, first: first + room * stride, stride, steps, lanes }
    }

    /// Fills the room beyond the ends with repetitions.
    fn repeat(&mut self) {
        let Lines { places, stride, room, .. } = *self;
        let (period, start) = (places * stride, room * stride);
        // As much at a time as lies within a period; before the first place from the end on.
        for done in (0..start).step_by(period) {
            let length = period.min(start - done);
            let (before, after) = (start - done - length, start + period + done);
            for (from, to) in [(before + period, before), (after - period, after)] {
                self.squared.copy_within(from..from + length, to);
                self.sites.copy_within(from..from + length, to);
            }
        }
    }

    /// Returns elements of the lower envelopes of the first lines, which are found where none is known.
    fn at_envelope(&mut self, first: usize, lines: usize) -> Found<S> {
        let Lines { places, stride, room, repeats, .. } = *self;
        if self.by_envelope.is_empty() {
            self.by_envelope.resize(places * stride + LANES, Nearest::NONE);
            for lane in 0..lines.min(stride) {
                let of_line = (0..places).map(|place| place * stride + lane);
                let given = |at: usize| Nearest {
                    squared: self.squared[room * stride + at],
                    site: self.sites[room * stride + at].number(),
                };
                self.line.clear();
                self.line.extend(of_line.clone().map(given));
                self.envelope.lower(&mut self.line, repeats);
                of_line.zip(&self.line).for_each(|(at, nearest)| self.by_envelope[at] = *nearest);
            }
        }
        let lowered = &self.by_envelope[first..first + LANES];
        (std::array::from_fn(|lane| lowered[lane].squared), std::array::from_fn(|lane| S::numbered(lowered[lane].site)))
    }
}

/// Copies elements; [`LANES`] of them, the usual number, without a call.
#[inline(always)]
pub(super) fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    match (<&[T; LANES]>::try_from(from), <&mut [T; LANES]>::try_from(&mut *to)) {
        (Ok(from), Ok(to)) => *to = *from,
        _ => to.iter_mut().zip(from).for_each(|(to, from)| *to = *from),
    }
}

/// Elements of lines to be lowered together.
#[derive(Clone, Copy)]
struct Group<'a, S> {
    squared: &'a [f32],
    sites: &'a [S],
    /// The first of [`LANES`] elements.
    first: usize,
    /// The elements before and after these lie this far off.
    stride: usize,
    /// No place lies more steps off.
    steps: usize,
    /// The elements that are asked for, from the first.
    lanes: usize,
}

impl<S: Site> Group<'_, S> {
    /// Returns the squared distances and sites from an element on.
    #[inline(always)]
    fn elements(&self, first: usize) -> Found<S> {
        let all = |slice: &[S]| -> [S; LANES] { slice.try_into().expect("as many elements as lanes") };
        let squared: [f32; LANES] = self.squared[first..first + LANES].try_into().expect("as many elements as lanes");
        (squared, all(&self.sites[first..first + LANES]))
    }

    /// Returns whether the least found within the reach may lie beyond it.
    #[inline(always)]
    fn is_beyond_reach(&self, least: &[f32; LANES]) -> bool {
        const BEYOND: f32 = ((REACH + 1) * (REACH + 1)) as f32;
        self.steps > REACH && least.iter().any(|&least| least >= BEYOND)
    }
}

/// Squared distances of places side by side, with their sites.
type Found<S> = ([f32; LANES], [S; LANES]);

/// Sets the minimum at each of some elements, with its site; returns false if it may lie beyond the reach.
fn least_near<S: Site>(group: Group<S>, found: &mut Found<S>) -> bool {
    *found = group.elements(group.first);
    let (least, nearest) = found;
    least[group.lanes..].fill(0.0);
    for step in 1..=group.steps.min(REACH) {
        let offset = (step * step) as f32;
        // A place that far off lowers nothing, and ties with nothing.
        if least.iter().all(|&least| least < offset) {
            break;
        }
        let off = step * group.stride;
        for (first, comes_first) in [(group.first - off, true), (group.first + off, false)] {
            let (others, sites) = group.elements(first);
            for lane in 0..LANES {
                let other = others[lane] + offset;
                if other < least[lane] || comes_first && other == least[lane] {
                    (least[lane], nearest[lane]) = (other, sites[lane]);
                }
            }
        }
    }
    !group.is_beyond_reach(least)
}

/// Does the same, with the same bits.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn least_near_avx2<S: Site>(group: Group<S>, found: &mut Found<S>) -> bool {
    use std::arch::x86_64::*;
    const VECTORS: usize = LANES / 8;
    let (mut squared, sites) = group.elements(group.first);
    squared[group.lanes..].fill(0.0);
    let mut least: [__m256; VECTORS] = bytemuck::cast(squared);
    // Sites that are not known have no bits.
    let vectors = |sites: [S; LANES]| bytemuck::try_cast(sites).unwrap_or([_mm256_setzero_ps(); VECTORS]);
    let mut nearest: [__m256; VECTORS] = vectors(sites);
    // One test for two steps: a branch that is not foreseen costs more than a step that lowers nothing.
    for step in (1..=REACH).step_by(2).take_while(|&step| step <= group.steps) {
        let greatest = least.into_iter().reduce(|a, b| _mm256_max_ps(a, b)).expect("a vector at least");
        let can_be_lower = _mm256_cmp_ps::<_CMP_GE_OQ>(greatest, _mm256_set1_ps((step * step) as f32));
        if _mm256_movemask_ps(can_be_lower) == 0 {
            break;
        }
        for step in [step, step + 1] {
            let offset = _mm256_set1_ps((step * step) as f32);
            let mut meet = |first: usize, comes_first: bool| {
                let (others, sites) = group.elements(first);
                let others: [__m256; VECTORS] = bytemuck::cast(others);
                let sites = vectors(sites);
                for v in 0..VECTORS {
                    let other = _mm256_add_ps(others[v], offset);
                    let is_least = match comes_first {
                        true => _mm256_cmp_ps::<_CMP_LE_OQ>(other, least[v]),
                        false => _mm256_cmp_ps::<_CMP_LT_OQ>(other, least[v]),
                    };
                    least[v] = _mm256_min_ps(other, least[v]);
                    if S::IS_KNOWN {
                        nearest[v] = _mm256_blendv_ps(nearest[v], sites[v], is_least);
                    }
                }
            };
            let off = step * group.stride;
            meet(group.first - off, true);
            meet(group.first + off, false);
        }
    }
    *found = (bytemuck::cast(least), bytemuck::try_cast(nearest).unwrap_or([S::NONE; LANES]));
    !group.is_beyond_reach(&found.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    /// Sets the squared distance and the site of each place on each of some lines.
    fn fill(lines: &mut Lines<u32>, elements: &[Nearest], count: usize) {
        for (place, row) in elements.chunks(count).enumerate() {
            let squared: Vec<f32> = row.iter().map(|nearest| nearest.squared).collect();
            let sites: Vec<u32> = row.iter().map(|nearest| nearest.site).collect();
            lines.set(place, &squared, &sites);
        }
    }

    /// Returns lines with the given elements.
    fn of(elements: &[Nearest], count: usize, stride: usize, repeats: bool) -> Lines<u32> {
        let mut lines = Lines::new(elements.len() / count, stride, repeats);
        fill(&mut lines, elements, count);
        lines
    }

    #[test]
    fn lines_together_are_lowered_as_one_after_another() {
        let mut random = Random::new(18);
        for case in 0..400 {
            let (places, count) = ([1, 2, 32, 40, 81, 82, 250][case % 7], [1, 1, 31, LANES][case / 5 % 4]);
            let (largest, sites_in) = ([0.5, 6.0, 30.0, 500.0][case / 25 % 4], [1.0, 0.5, 0.02, 0.0][random.below(4)]);
            let repeats = case % 2 == 0;
            let stride = if count == 1 && case % 3 > 0 { 1 } else { LANES };
            let mut element = |site: usize| match random.share() < sites_in {
                // Halves make ties.
                true => {
                    let distance = ((random.share() * largest * 2.0) as f32).floor() / 2.0;
                    Nearest { squared: distance * distance, site: site as u32 }
                }
                false => Nearest::NONE,
            };
            let elements: Vec<Nearest> = (0..places * count).map(&mut element).collect();
            let mut expected = vec![Nearest::NONE; elements.len()];
            for line in 0..count {
                let mut row: Vec<Nearest> = elements.iter().skip(line).step_by(count).copied().collect();
                Envelope::default().lower(&mut row, repeats);
                expected.iter_mut().skip(line).step_by(count).zip(row).for_each(|(out, nearest)| *out = nearest);
            }
            // Lines that have held others, too.
            let mut lines = of(&vec![Nearest { squared: 1e6, site: 9 }; places * stride], stride, stride, repeats);
            lines.lower(stride, |_, _, _| ());
            fill(&mut lines, &elements, count);
            let mut found = Vec::new();
            lines.lower(count, |place, squared, sites| {
                assert_eq!(found.len(), place * count);
                found.extend(squared.iter().zip(sites).map(|(&squared, &site)| (squared, site)));
            });
            let expected: Vec<(f32, u32)> = expected.iter().map(|nearest| (nearest.squared, nearest.site)).collect();
            assert_eq!(found, expected, "case {case}");
        }
    }

    #[test]
    fn all_ways_have_the_same_bits() {
        let mut random = Random::new(19);
        let (mut found, mut by_envelope) = (0, 0);
        for case in 0..200 {
            let places = [3, 60, 250][case % 3];
            let repeats = case % 2 == 0;
            // Rows through spheres: the distances of a row along another axis, between which roundings decide.
            let mut lane = || {
                let (radius, centre) = (4.0 + 60.0 * random.share(), random.share() * places as f64);
                move |i: usize| (radius * radius - (i as f64 - centre).powi(2)).abs() as f32
            };
            let stride = [1, LANES][case / 6 % 2];
            let lanes: Vec<_> = (0..stride).map(|_| lane()).collect();
            let element = |at: usize| Nearest { squared: lanes[at % stride](at / stride), site: at as u32 };
            let elements: Vec<Nearest> = (0..places * stride).map(element).collect();
            let mut lines = of(&elements, stride, stride, repeats);
            if repeats {
                lines.repeat();
            }
            for first in (0..places * stride).step_by(LANES) {
                let asked = LANES.min(places * stride - first);
                let group = lines.group(first, asked);
                let mut least = ([0.0; LANES], [0; LANES]);
                let is_found = least_near(group, &mut least);
                #[cfg(target_arch = "x86_64")]
                if is_x86_feature_detected!("avx2") {
                    let mut by_vectors = ([0.0; LANES], [0; LANES]);
                    // SAFETY: the processor has AVX2.
                    let are_found = unsafe { least_near_avx2(group, &mut by_vectors) };
                    assert_eq!((are_found, by_vectors), (is_found, least), "case {case}");
                }
                if !is_found {
                    by_envelope += 1;
                    continue;
                }
                found += 1;
                let (of_envelope, _) = lines.at_envelope(first, stride);
                for (least, of_envelope) in least.0.iter().zip(of_envelope).take(asked) {
                    assert!((least - of_envelope).abs() <= 1e-6 * of_envelope, "case {case}: {least}, {of_envelope}");
                }
            }
        }
        assert!(found > 1_000 && by_envelope > 100, "{found}, {by_envelope}");
    }
}
