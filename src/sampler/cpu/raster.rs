//! The geometry pass: the crossings of a band of rows, gathered by ray.

use std::ops::Range;

use super::bin::{Bins, LANES, Lanes, Seen};
use super::lanes::Places;
use crate::fixed::{Crossing, DepthPlane, Hit, Pixels, ViewPosition, for_each_run};
use crate::grid::{Axis, Grid};

/// The crossings of the rays of one band; their order on a ray is arbitrary.
///
/// Each ray has a few slots, so that a crossing is written once, to where it is read. Crossings of rays that have more
/// are sorted by ray at the end.
#[derive(Default)]
pub struct BandCrossings<H = Crossing> {
    counts: Vec<u32>,
    slots_of_ray: usize,
    slots: Vec<H>,
    spilled: Vec<(u32, H)>,
    /// Of the rays of more crossings than slots: where they begin in `long`.
    starts: Vec<u32>,
    long: Vec<H>,
}

/// Most slots of a ray: without triangles they fill a cache line.
const SLOTS: usize = 16;

/// Slots of a band, which stay in the L2 cache; on very many rays each has two.
const SLOTS_OF_BAND: usize = 1 << 17;

/// The rays of a band that are sampled, and the view.
pub struct Clip {
    /// The direction of the rays.
    pub axis: Axis,
    /// The pixels of the view.
    pub pixels: Pixels,
    /// The columns that are sampled.
    pub columns: Range<i32>,
    /// The rows that are sampled.
    pub rows: Range<i32>,
    /// The row of the first ray of the band.
    pub first_row: i32,
    /// Number of columns of the image.
    pub width: i32,
}

impl<H: Hit> BandCrossings<H> {
    /// Finds all crossings of the rays in `rows`, one band of `bins`. Reuses the memory of earlier bands.
    pub fn gather(&mut self, grid: &Grid, axis: Axis, bins: &Bins, rows: Range<u32>) {
        let (columns, _) = grid.image_size(axis);
        self.begin(rows.len() * columns as usize);
        let window = bins.window().clone().in_rows(&rows);
        let clip = Clip {
            axis,
            pixels: Pixels::new(grid.shift()),
            columns: window.columns,
            rows: window.rows,
            first_row: rows.start as i32,
            width: columns as i32,
        };
        let mut places = Places::new(&clip);
        let cover_lanes = way_to_cover_lanes();
        bins.for_each_in_band(rows.start, |seen| match seen {
            Seen::Near(lanes) => {
                let mut left_out = cover_lanes(self, lanes, &clip, &mut places);
                while left_out != 0 {
                    let lane = left_out.trailing_zeros() as usize;
                    left_out &= left_out - 1;
                    self.cover(&lanes.of(lane), lanes.triangles[lane], &clip);
                }
            }
            Seen::Wide(corners, triangle) => self.cover(&corners, triangle, &clip),
        });
        self.sort_by_ray();
    }

    /// Adds the crossings of one triangle.
    fn cover(&mut self, corners: &[ViewPosition; 3], triangle: u32, clip: &Clip) {
        let mut plane = None;
        for_each_run(corners, clip.pixels, &clip.rows, |row, covered| {
            let plane: &DepthPlane = plane.get_or_insert_with(|| DepthPlane::new(corners, clip.axis));
            let first_ray = (row - clip.first_row) as u32 * clip.width as u32;
            let row = clip.pixels.ray(row);
            for column in covered.start.max(clip.columns.start)..covered.end.min(clip.columns.end) {
                let crossing = plane.crossing(clip.pixels.ray(column), row);
                self.push(first_ray + column as u32, H::new(crossing, triangle));
            }
        });
    }

    /// Adds the crossings of the triangles of the lanes, except those it returns as bits.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma,bmi1,bmi2,popcnt,lzcnt")]
    fn cover_lanes_avx2(&mut self, lanes: &Lanes, clip: &Clip, places: &mut Places) -> u32 {
        super::lanes::cover(lanes, clip, places, |ray, hit| self.push(ray, hit))
    }

    /// Clears all crossings, but keeps their memory, and begins a band of this many rays.
    pub fn begin(&mut self, rays: usize) {
        self.counts.clear();
        self.counts.resize(rays, 0);
        self.slots_of_ray = (SLOTS_OF_BAND / rays.max(1)).clamp(2, SLOTS);
        if self.slots.len() < rays * self.slots_of_ray {
            self.slots.resize(rays * self.slots_of_ray, H::default());
        }
        self.spilled.clear();
    }

    /// Adds a crossing of a ray of the band.
    #[inline(always)]
    pub fn push(&mut self, ray: u32, hit: H) {
        let count = &mut self.counts[ray as usize];
        let slot = *count as usize;
        *count += 1;
        if slot < self.slots_of_ray {
            self.slots[ray as usize * self.slots_of_ray + slot] = hit;
        } else {
            self.spilled.push((ray, hit));
        }
    }

    /// Stores the crossings of each ray contiguously. They can be read after it.
    pub fn sort_by_ray(&mut self) {
        if self.spilled.is_empty() {
            return;
        }
        let slots = self.slots_of_ray;
        self.starts.clear();
        self.long.clear();
        for (ray, &count) in self.counts.iter().enumerate() {
            self.starts.push(self.long.len() as u32);
            if count as usize > slots {
                self.long.extend_from_slice(&self.slots[ray * slots..][..slots]);
                self.long.resize(self.long.len() + count as usize - slots, H::default());
            }
        }
        // Each start moves to the first free place, and back.
        for &(ray, hit) in &self.spilled {
            let start = &mut self.starts[ray as usize];
            self.long[*start as usize + slots] = hit;
            *start += 1;
        }
        for (start, &count) in self.starts.iter_mut().zip(&self.counts) {
            *start -= count.saturating_sub(slots as u32);
        }
    }

    /// Returns the crossings of a ray of the band.
    #[inline]
    pub fn on_ray(&mut self, ray: u32) -> &mut [H] {
        let ray = ray as usize;
        let count = self.counts[ray] as usize;
        if count > self.slots_of_ray {
            return &mut self.long[self.starts[ray] as usize..][..count];
        }
        &mut self.slots[ray * self.slots_of_ray..][..count]
    }

    /// Returns the number of crossings of the band.
    pub fn count(&self) -> usize {
        self.counts.iter().map(|&count| count as usize).sum()
    }
}

/// Adds the crossings of the triangles of lanes, except those it returns as bits.
type CoverLanes<H> = fn(&mut BandCrossings<H>, &Lanes, &Clip, &mut Places) -> u32;

/// Returns the fastest way of this processor: side by side with AVX2, else one triangle after another.
///
/// With 128-bit registers lanes are no faster than single triangles (SSE2: 0.9 to 1.3 × the time).
fn way_to_cover_lanes<H: Hit>() -> CoverLanes<H> {
    #[cfg(target_arch = "x86_64")]
    if has_lanes() {
        // SAFETY: the processor has the features that the function is compiled for.
        return |crossings, lanes, clip, places| unsafe { crossings.cover_lanes_avx2(lanes, clip, places) };
    }
    |_, _, _, _| (1 << LANES) - 1
}

/// Returns whether this processor works on lanes side by side.
#[cfg(target_arch = "x86_64")]
pub fn has_lanes() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("popcnt")
        && is_x86_feature_detected!("lzcnt")
}

/// Returns whether this processor works on lanes side by side.
#[cfg(all(test, not(target_arch = "x86_64")))]
fn has_lanes() -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixed::TriangleHit;
    use crate::testing::random::Random;

    /// Returns the sorted crossings of all rays of a band, found by `cover_lanes` as far as it finds them.
    fn crossings(
        lanes: &Lanes,
        clip: &Clip,
        rays: usize,
        cover_lanes: CoverLanes<TriangleHit>,
    ) -> (Vec<Vec<TriangleHit>>, u32) {
        let mut found = BandCrossings::default();
        found.begin(rays);
        let left_out = cover_lanes(&mut found, lanes, clip, &mut Places::new(clip));
        for lane in (0..LANES).filter(|lane| left_out >> lane & 1 == 1) {
            found.cover(&lanes.of(lane), lanes.triangles[lane], clip);
        }
        found.sort_by_ray();
        let sorted = |ray| {
            let mut hits = found.on_ray(ray).to_vec();
            hits.sort_unstable();
            hits
        };
        ((0..rays as u32).map(sorted).collect(), left_out)
    }

    #[test]
    fn lanes_find_the_crossings_of_single_triangles() {
        let mut random = Random::new(18);
        let (mut compared, mut found_in_lanes) = (0, 0);
        for case in 0..4_000 {
            let shift = [2, 6, 12, 18, 21, 25][case % 6];
            let pixel = 1i32 << shift;
            let columns = [40, 100, 7][case / 486 % 3].min((1 << 30) >> shift);
            let (first_row, band_rows) = [(0, 8), (16, 8), (8, 3), (0, 20)][random.below(4)];
            let first_row = if shift > 21 { 0 } else { first_row };
            let axis = Axis::ALL[case / 6 % 3];
            // Coordinates on a coarse lattice make ties of rays with edges and of depths with lattice positions.
            let coarse = [2, pixel / 2, pixel][case / 18 % 3].max(2);
            let size = [pixel, 4 * pixel, 40 * pixel][case / 54 % 3];
            let depth = [2, size, 1 << 29][case / 162 % 3];
            let mut lanes = Lanes::EMPTY;
            for lane in 0..LANES - random.below(3) {
                let mut even = |from: i32, extent: i32| {
                    let at = i64::from(from) + (random.share() * f64::from(extent)) as i64;
                    (at.min(1 << 30) / i64::from(coarse) * i64::from(coarse)) as i32 & !1
                };
                let origin = [even(0, columns * pixel), even(first_row * pixel, band_rows * pixel)];
                let mut corner = || [even(origin[0], size), even(origin[1], size), even(0, depth)];
                let corners = [corner(), corner(), corner()].map(|corner| corner.map(|coordinate| [coordinate]));
                lanes.set(lane, &corners, 0, lane as u32);
            }
            let clip = Clip {
                axis,
                pixels: Pixels::new(shift),
                columns: random.within(0..4)..columns - random.within(0..3),
                rows: first_row + random.within(0..3)..first_row + band_rows,
                first_row,
                width: columns,
            };
            let rays = (columns * band_rows) as usize;
            let (expected, _) = crossings(&lanes, &clip, rays, |_, _, _, _| (1 << LANES) - 1);
            let (found, left_out) = crossings(&lanes, &clip, rays, way_to_cover_lanes());
            assert_eq!(found, expected, "case {case}: {:?}", lanes.corners);
            found_in_lanes += LANES - left_out.count_ones() as usize;
            compared += expected.iter().map(Vec::len).sum::<usize>();
        }
        assert!(
            compared > 20_000 && (found_in_lanes > 10_000 || !has_lanes()),
            "{compared} crossings, {found_in_lanes} triangles in lanes"
        );
    }

    #[test]
    fn rays_hold_any_number_of_crossings() {
        let mut found = BandCrossings::default();
        found.begin(3);
        let counts = [SLOTS, 0, 3 * SLOTS];
        for i in 0..3 * SLOTS as u32 {
            for (ray, &count) in counts.iter().enumerate() {
                if (i as usize) < count {
                    found.push(ray as u32, Crossing(i));
                }
            }
        }
        found.sort_by_ray();
        assert_eq!(found.count(), 4 * SLOTS);
        for (ray, count) in counts.into_iter().enumerate() {
            let expected: Vec<Crossing> = (0..count as u32).map(Crossing).collect();
            assert_eq!(found.on_ray(ray as u32), expected);
        }
    }
}
