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
    /// Finds all crossings of the rays in `rows`, one band of `bins`. Keeps the memory of earlier bands.
    pub fn gather(&mut self, grid: &Grid, axis: Axis, bins: &Bins, rows: Range<u32>) {
        let (columns, _) = grid.image_size(axis);
        let rays = rows.len() * columns as usize;
        let pixels = Pixels::new(grid.shift());
        self.found.clear();
        self.starts.clear();
        self.starts.resize(rays + 1, 0);
        let (found, starts) = (&mut self.found, &mut self.starts);
        let first_row = rows.start;
        let rows = rows.start as i32..rows.end as i32;
        bins.for_each_in_band(first_row, |seen| {
            cross_triangle(seen.corners, axis, pixels, &rows, |row, covered, plane| {
                let first_ray = (row - rows.start) as u32 * columns;
                let row = pixels.ray(row);
                for count in
                    &mut starts[(first_ray + covered.start as u32) as usize..(first_ray + covered.end as u32) as usize]
                {
                    *count += 1;
                }
                found.extend(covered.map(|column| {
                    let crossing = plane.crossing(pixels.ray(column), row);
                    (first_ray + column as u32, H::new(crossing, seen.triangle))
                }));
            });
        });
        self.sort_by_ray();
    }

    /// The second half of a counting sort: the crossings of each ray side by side.
    fn sort_by_ray(&mut self) {
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        // Each start stands at the end of its ray now, and filling backwards moves it to the beginning.
        self.crossings.clear();
        self.crossings.resize(self.found.len(), H::default());
        for &(ray, crossing) in &self.found {
            let start = &mut self.starts[ray as usize];
            *start -= 1;
            self.crossings[*start as usize] = crossing;
        }
    }

    /// The crossings of a ray of the band.
    pub fn on_ray(&mut self, ray: u32) -> &mut [H] {
        let ray = ray as usize;
        &mut self.crossings[self.starts[ray] as usize..self.starts[ray + 1] as usize]
    }

    /// All crossings of the band.
    pub fn count(&self) -> usize {
        self.crossings.len()
    }
}

/// Calls `cover` with each of `rows` in which the triangle covers rays, and the columns covered there.
#[inline]
fn cross_triangle(
    corners: [ViewPosition; 3],
    axis: Axis,
    pixels: Pixels,
    rows: &Range<i32>,
    mut cover: impl FnMut(i32, Range<i32>, &DepthPlane),
) {
    let [mut low, mut middle, mut high] = corners;
    if low[1] > middle[1] {
        std::mem::swap(&mut low, &mut middle);
    }
    if middle[1] > high[1] {
        std::mem::swap(&mut middle, &mut high);
    }
    if low[1] > middle[1] {
        std::mem::swap(&mut low, &mut middle);
    }
    let first = pixels.index_from(low[1]).max(rows.start);
    let end = pixels.index_from(high[1]).min(rows.end);
    if first >= end {
        return;
    }
    let turn = pixels.index_from(middle[1]).clamp(first, end);
    let long = EdgeWalk::new(low, high, pixels);
    let mut plane = None;
    let mut walk = |rows: Range<i32>, from: ViewPosition, to: ViewPosition| {
        if rows.is_empty() {
            return;
        }
        let short = EdgeWalk::new(from, to, pixels);
        for row in rows {
            let position = pixels.ray(row);
            let (a, b) = (long.first_column(position, pixels), short.first_column(position, pixels));
            if a != b {
                let plane = plane.get_or_insert_with(|| DepthPlane::new(corners, axis));
                cover(row, a.min(b)..a.max(b), plane);
            }
        }
    };
    walk(first..turn, low, middle);
    walk(turn..end, middle, high);
}
