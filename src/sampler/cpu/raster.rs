//! The geometry pass: the crossings of a band of rows, gathered by ray.

use std::ops::Range;

use super::bin::Bins;
use crate::fixed::{Crossing, DepthPlane, EdgeWalk, Hit, Pixels, ViewPosition};
use crate::grid::{Axis, Grid};

/// The crossings of the rays of one band, in compact storage; their order on a ray is arbitrary.
#[derive(Default)]
pub struct BandCrossings<H = Crossing> {
    found: Vec<(u32, H)>,
    starts: Vec<u32>,
    crossings: Vec<H>,
}

impl<H: Hit> BandCrossings<H> {
    /// Finds all crossings of the rays in `rows`, one band of `bins`. Reuses the memory of earlier bands.
    pub fn gather(&mut self, grid: &Grid, axis: Axis, bins: &Bins, rows: Range<u32>) {
        let (columns, _) = grid.image_size(axis);
        let rays = rows.len() * columns as usize;
        let pixels = Pixels::new(grid.shift());
        self.begin(rays);
        let (found, starts) = (&mut self.found, &mut self.starts);
        let first_row = rows.start;
        let window = bins.window();
        let (first_column, end_column) = (window.columns.start, window.columns.end);
        let rows = (rows.start as i32).max(window.rows.start)..(rows.end as i32).min(window.rows.end);
        bins.for_each_in_band(first_row, |seen| {
            let mut plane = None;
            for_each_run(&seen.corners, pixels, &rows, |row, covered| {
                let plane: &DepthPlane = plane.get_or_insert_with(|| DepthPlane::new(&seen.corners, axis));
                let first_ray = (row - first_row as i32) as u32 * columns;
                let row = pixels.ray(row);
                for column in covered.start.max(first_column)..covered.end.min(end_column) {
                    let ray = first_ray + column as u32;
                    starts[ray as usize] += 1;
                    found.push((ray, H::new(plane.crossing(pixels.ray(column), row), seen.triangle)));
                }
            });
        });
        self.sort_by_ray();
    }

    /// Clears all crossings, but keeps their memory, and begins a band of this many rays.
    pub fn begin(&mut self, rays: usize) {
        self.found.clear();
        self.starts.clear();
        self.starts.resize(rays + 1, 0);
    }

    /// Adds a crossing of a ray of the band.
    #[inline]
    pub fn push(&mut self, ray: u32, hit: H) {
        self.starts[ray as usize] += 1;
        self.found.push((ray, hit));
    }

    /// Stores the crossings of each ray contiguously: the second half of a counting sort. They can be read after it.
    pub fn sort_by_ray(&mut self) {
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        // Each start is now at the end of its ray, and filling backwards moves it to the beginning.
        self.crossings.clear();
        self.crossings.resize(self.found.len(), H::default());
        for &(ray, crossing) in &self.found {
            let start = &mut self.starts[ray as usize];
            *start -= 1;
            self.crossings[*start as usize] = crossing;
        }
    }

    /// Returns the crossings of a ray of the band.
    pub fn on_ray(&mut self, ray: u32) -> &mut [H] {
        let ray = ray as usize;
        &mut self.crossings[self.starts[ray] as usize..self.starts[ray + 1] as usize]
    }

    /// Returns the number of crossings of the band.
    pub fn count(&self) -> usize {
        self.crossings.len()
    }
}

/// Calls `cover` with each of `rows` in which the triangle covers rays, and the columns covered there.
#[inline(always)]
fn for_each_run(
    corners: &[ViewPosition; 3],
    pixels: Pixels,
    rows: &Range<i32>,
    mut cover: impl FnMut(i32, Range<i32>),
) {
    // Corners in the order of their rows. Triangles come in any order, so that branches would be mispredicted.
    let key = |i: usize| u64::from(corners[i][1] as u32) << 2 | i as u64;
    let keys = [key(0), key(1), key(2)];
    let (least, greatest) = (keys[0].min(keys[1]).min(keys[2]), keys[0].max(keys[1]).max(keys[2]));
    let between = keys[0] ^ keys[1] ^ keys[2] ^ least ^ greatest;
    let [low, middle, high] = [least, between, greatest].map(|key| (key & 3) as usize);

    let first = pixels.index_from(corners[low][1]).max(rows.start);
    let end = pixels.index_from(corners[high][1]).min(rows.end);
    // From the row `turn` on, the second short edge bounds the triangle.
    let turn = pixels.index_from(corners[middle][1]);
    if first >= end {
        return;
    }
    let long = EdgeWalk::upwards(&corners[low], &corners[high], pixels);
    let (from, to) = if first < turn { (low, middle) } else { (middle, high) };
    let mut short = EdgeWalk::upwards(&corners[from], &corners[to], pixels);
    for row in first..end {
        if row == turn && row != first {
            short = EdgeWalk::upwards(&corners[middle], &corners[high], pixels);
        }
        let position = pixels.ray(row);
        let (a, b) = (long.first_column(position, pixels), short.first_column(position, pixels));
        if a != b {
            cover(row, a.min(b)..a.max(b));
        }
    }
}
