//! The minimum of squared distances along many lines side by side.
//!
//! In solids and pores most distances are a few pitches, and the places that can lower a value are no farther off than its
//! root. Trying them one after another, on many lines at once, takes a sixth of the time of the lower envelope (measured on
//! distances up to 26 pitches), which remains for lines beside one with greater distances. The minima differ by the roundings of
//! the envelope, which compares parabolas in `f32`.

use super::envelope::{Envelope, Nearest};

/// Lines side by side.
pub(super) const LANES: usize = 32;

/// Places to either side that are tried before the lower envelope is taken.
const REACH: usize = 80;

/// Squared distances and sites, those of place `i` on line `l` at `i · lines + l`.
pub(super) struct Lines {
    pub squared: Vec<f32>,
    pub sites: Vec<u32>,
}

impl Lines {
    /// Returns places without sites.
    pub fn new(places: usize) -> Lines {
        Lines { squared: vec![f32::INFINITY; places], sites: vec![u32::MAX; places] }
    }

    /// Returns the squared distances and sites of a part of the given length, counted in such parts.
    pub fn part(&mut self, part: usize, length: usize) -> (&mut [f32], &mut [u32]) {
        let part = part * length..(part + 1) * length;
        (&mut self.squared[part.clone()], &mut self.sites[part])
    }

    /// Replaces each squared distance on `count` lines by the minimum over the line of squared distance plus squared offset,
    /// with its site.
    pub fn lower(&mut self, count: usize, repeats: bool, block: &mut Block) {
        let places = self.squared.len() / count;
        for first in (0..count).step_by(LANES) {
            let some = |i: usize| i * count + first..i * count + count.min(first + LANES);
            block.fill((0..places).map(|i| (&self.squared[some(i)], &self.sites[some(i)])));
            block.lower(repeats, |i, squared, sites| {
                let some = some(i);
                self.squared[some.clone()].copy_from_slice(&squared[..some.len()]);
                self.sites[some.clone()].copy_from_slice(&sites[..some.len()]);
            });
        }
    }
}

/// Some lines side by side, and memory that is kept from one to the next.
#[derive(Default)]
pub(super) struct Block {
    squared: Vec<[f32; LANES]>,
    sites: Vec<[u32; LANES]>,
    line: Vec<Nearest>,
    envelope: Envelope,
}

impl Block {
    /// Sets the squared distances and sites of at most [`LANES`] lines, given place by place.
    pub fn fill<'p>(&mut self, places: impl Iterator<Item = (&'p [f32], &'p [u32])>) {
        self.squared.clear();
        self.sites.clear();
        for (squared, sites) in places {
            // Lanes without a line have no site, and distances that are lowest already.
            self.squared.push(padded(squared, 0.0));
            self.sites.push(padded(sites, u32::MAX));
        }
    }

    /// Passes the minimum at each place, with its site, to `put`. Of equal ones it is the first on the line.
    pub fn lower(&mut self, repeats: bool, mut put: impl FnMut(usize, &[f32; LANES], &[u32; LANES])) {
        let near = way_to_lower();
        let lowered = (0..self.squared.len()).all(|i| {
            let found = near(i, &self.squared, &self.sites, repeats);
            found.inspect(|(squared, sites)| put(i, squared, sites)).is_some()
        });
        if lowered {
            return;
        }
        self.lower_by_envelope(repeats);
        for (i, (squared, sites)) in self.squared.iter().zip(&self.sites).enumerate() {
            put(i, squared, sites);
        }
    }

    /// Lowers one line after another.
    fn lower_by_envelope(&mut self, repeats: bool) {
        for lane in 0..LANES {
            let line = self.squared.iter().zip(&self.sites);
            self.line.clear();
            self.line.extend(line.map(|(squared, sites)| Nearest { squared: squared[lane], site: sites[lane] }));
            self.envelope.lower(&mut self.line, repeats);
            for ((squared, sites), nearest) in self.squared.iter_mut().zip(&mut self.sites).zip(&self.line) {
                (squared[lane], sites[lane]) = (nearest.squared, nearest.site);
            }
        }
    }
}

/// Returns values of some lanes, and `other` for the rest.
fn padded<T: Copy>(values: &[T], other: T) -> [T; LANES] {
    match values.try_into() {
        Ok(values) => values,
        Err(_) => {
            let mut padded = [other; LANES];
            padded[..values.len()].copy_from_slice(values);
            padded
        }
    }
}

/// Squared distances of places side by side, with their sites.
type Found = ([f32; LANES], [u32; LANES]);

/// Finds the minimum at a place of each line, with its site; `None` if it may lie beyond the reach.
type LeastNear = fn(usize, &[[f32; LANES]], &[[u32; LANES]], bool) -> Option<Found>;

/// Returns the fastest way of this processor. Each has the same bits.
fn way_to_lower() -> LeastNear {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        return |i, squared, sites, repeats| unsafe { least_near_avx2(i, squared, sites, repeats) };
    }
    least_near
}

/// Returns the places at some steps before and after place `i` of lines of the given length; beyond it if there is none.
#[inline(always)]
fn around(i: usize, step: usize, length: usize, repeats: bool) -> [usize; 2] {
    match repeats {
        true => [(i + length * step - step) % length, (i + step) % length],
        false => [i.wrapping_sub(step), i + step],
    }
}

/// See [`LeastNear`].
fn least_near(i: usize, squared: &[[f32; LANES]], sites: &[[u32; LANES]], repeats: bool) -> Option<Found> {
    let (mut least, mut nearest) = (squared[i], sites[i]);
    for step in 1.. {
        let offset = (step * step) as f32;
        // A place that far off lowers nothing, and ties with nothing.
        if least.iter().all(|&least| least < offset) {
            break;
        }
        if step > REACH {
            return None;
        }
        let [before, after] = around(i, step, squared.len(), repeats);
        if before >= squared.len() && after >= squared.len() {
            break;
        }
        for (place, comes_first) in [(before, true), (after, false)] {
            let Some(others) = squared.get(place) else { continue };
            for lane in 0..LANES {
                let other = others[lane] + offset;
                if other < least[lane] || comes_first && other == least[lane] {
                    (least[lane], nearest[lane]) = (other, sites[place][lane]);
                }
            }
        }
    }
    Some((least, nearest))
}

/// See [`LeastNear`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn least_near_avx2(i: usize, squared: &[[f32; LANES]], sites: &[[u32; LANES]], repeats: bool) -> Option<Found> {
    use std::arch::x86_64::*;
    const VECTORS: usize = LANES / 8;
    let mut least: [__m256; VECTORS] = bytemuck::cast(squared[i]);
    let mut nearest: [__m256; VECTORS] = bytemuck::cast(sites[i]);
    for step in 1.. {
        let offset = _mm256_set1_ps((step * step) as f32);
        let mut can_be_lower = _mm256_setzero_ps();
        for least in least {
            can_be_lower = _mm256_or_ps(can_be_lower, _mm256_cmp_ps::<_CMP_GE_OQ>(least, offset));
        }
        if _mm256_movemask_ps(can_be_lower) == 0 {
            break;
        }
        if step > REACH {
            return None;
        }
        let [before, after] = around(i, step, squared.len(), repeats);
        if before >= squared.len() && after >= squared.len() {
            break;
        }
        let mut meet = |place: usize, comes_first: bool| {
            let Some(others) = squared.get(place) else { return };
            let others: [__m256; VECTORS] = bytemuck::cast(*others);
            let of_others: [__m256; VECTORS] = bytemuck::cast(sites[place]);
            for v in 0..VECTORS {
                let other = _mm256_add_ps(others[v], offset);
                let is_least = match comes_first {
                    true => _mm256_cmp_ps::<_CMP_LE_OQ>(other, least[v]),
                    false => _mm256_cmp_ps::<_CMP_LT_OQ>(other, least[v]),
                };
                least[v] = _mm256_min_ps(other, least[v]);
                nearest[v] = _mm256_blendv_ps(nearest[v], of_others[v], is_least);
            }
        };
        meet(before, true);
        meet(after, false);
    }
    Some((bytemuck::cast(least), bytemuck::cast(nearest)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn lines_side_by_side_are_lowered_as_one_after_another() {
        let mut random = Random::new(18);
        for case in 0..300 {
            let (places, count) = ([1, 2, 7, 40, 250][case % 5], [1, 31, 32, 33, 70][case / 5 % 5]);
            let (largest, sites_in) = ([0.5, 6.0, 30.0, 500.0][case / 25 % 4], [1.0, 0.5, 0.02, 0.0][random.below(4)]);
            let repeats = case % 2 == 0;
            let mut lines = Lines::new(places * count);
            for (i, (squared, site)) in lines.squared.iter_mut().zip(&mut lines.sites).enumerate() {
                if random.share() < sites_in {
                    // Halves make ties.
                    let distance = ((random.share() * largest * 2.0) as f32).floor() / 2.0;
                    (*squared, *site) = (distance * distance, i as u32);
                }
            }
            let mut expected = Vec::new();
            for line in 0..count {
                let of_line = (0..places).map(|i| i * count + line);
                let mut row: Vec<Nearest> =
                    of_line.map(|at| Nearest { squared: lines.squared[at], site: lines.sites[at] }).collect();
                Envelope::default().lower(&mut row, repeats);
                expected.push(row);
            }
            let mut block = Block::default();
            lines.lower(count, repeats, &mut block);
            for (at, found) in lines.squared.iter().zip(&lines.sites).enumerate() {
                let Nearest { squared, site } = expected[at % count][at / count];
                assert_eq!(found, (&squared, &site), "case {case}, place {}, line {}", at / count, at % count);
            }
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
            let lanes: Vec<_> = (0..LANES).map(|_| lane()).collect();
            let squared: Vec<[f32; LANES]> = (0..places).map(|i| std::array::from_fn(|l| lanes[l](i))).collect();
            let sites: Vec<[u32; LANES]> =
                (0..places).map(|i| std::array::from_fn(|l| (i * LANES + l) as u32)).collect();
            for i in 0..places {
                let least = least_near(i, &squared, &sites, repeats);
                assert_eq!(least, way_to_lower()(i, &squared, &sites, repeats), "case {case}");
                match least {
                    Some(_) => found += 1,
                    None => by_envelope += 1,
                }
            }
            let mut block = Block { squared: squared.clone(), sites, ..Block::default() };
            block.lower_by_envelope(repeats);
            let near =
                (0..places).filter_map(|i| least_near(i, &squared, &block.sites, repeats).map(|found| (i, found.0)));
            for (i, least) in near {
                for (least, of_envelope) in least.iter().zip(block.squared[i]) {
                    assert!((least - of_envelope).abs() <= 1e-6 * of_envelope, "case {case}: {least}, {of_envelope}");
                }
            }
        }
        assert!(found > 1_000 && by_envelope > 100, "{found}, {by_envelope}");
    }
}
