//! The integer sums of an image from which its volume and the error estimate are computed. The sums are small, so a GPU
//! transfers them instead of the image.

use crate::parallel::*;

use super::{Ldi, Windings};
use crate::fixed::Pixels;
use crate::grid::{Axis, Grid};

/// The integer sums of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeSums {
    grid: Grid,
    axis: Axis,
    sums: RaySums,
    layers: u32,
    samples: u64,
    unclosed: u64,
    windings: Option<Windings>,
}

/// Exact sums over rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RaySums {
    /// Lattice steps inside, by the parity of column and row: entry `c + 2 r` for columns of parity c in rows of parity
    /// r.
    pub steps: [i64; 4],
    /// Number of nodes inside, by the parity of column and row, and of the depth.
    pub nodes: [[i64; 2]; 4],
    /// Residuals of samples that are level along both directions, along the columns only, and along the rows only. The
    /// residual of a sample is its height above the last pixel boundary before the next node, exits minus entries.
    pub level: [i64; 3],
}

impl RaySums {
    /// Returns the sums over both.
    pub fn plus(mut self, other: RaySums) -> RaySums {
        for i in 0..4 {
            self.steps[i] += other.steps[i];
            self.nodes[i][0] += other.nodes[i][0];
            self.nodes[i][1] += other.nodes[i][1];
        }
        for i in 0..3 {
            self.level[i] += other.level[i];
        }
        self
    }
}

impl VolumeSums {
    /// Builds the sums of an image that was summed elsewhere: the sums, the largest number of samples of a ray, and
    /// the total numbers of samples and of unclosed rays.
    pub fn from_parts(
        grid: Grid,
        axis: Axis,
        sums: RaySums,
        layers: u32,
        [samples, unclosed]: [u64; 2],
        windings: Option<Windings>,
    ) -> VolumeSums {
        VolumeSums { grid, axis, sums, layers, samples, unclosed, windings }
    }

    /// Returns the grid under the image.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the direction of the rays.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// Returns the sums over its rays.
    pub fn sums(&self) -> &RaySums {
        &self.sums
    }

    /// Returns the inside length of all rays together, in lattice steps.
    pub fn length(&self) -> i64 {
        self.sums.steps.iter().sum()
    }

    /// Returns n_max: the largest number of samples on any ray.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Returns the number of samples of all rays.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Returns the number of unclosed rays.
    pub fn unclosed(&self) -> u64 {
        self.unclosed
    }

    /// Returns the winding sums, as [`Ldi::windings`] does.
    pub fn windings(&self) -> Option<Windings> {
        self.windings
    }
}

/// Number of rows that one task sums, one after another.
const ROWS: usize = 16;

/// Returns the largest distance between the depths of two samples of neighbouring rays, in lattice steps, at which they
/// count as one level surface: a tenth of a pixel of 2^`shift` steps.
pub fn level_tolerance(shift: u32) -> i32 {
    ((1i64 << shift) / 10) as i32
}

impl Ldi {
    /// Sums the image, in one pass.
    pub fn volume_sums(&self) -> VolumeSums {
        let (_, rows) = self.size();
        let rows: Vec<u32> = (0..rows).collect();
        let sums = rows.par_chunks(ROWS).map(|rows| sums_of_rows(self, rows)).reduce(RaySums::default, RaySums::plus);
        VolumeSums {
            grid: self.grid,
            axis: self.axis,
            sums,
            layers: self.layers(),
            samples: self.depths.len() as u64,
            unclosed: self.unclosed.len() as u64,
            windings: self.windings,
        }
    }
}

/// Returns the sums over consecutive rows.
fn sums_of_rows(image: &Ldi, rows: &[u32]) -> RaySums {
    let (columns, all_rows) = image.size();
    let pixels = Pixels::new(image.grid().shift());
    let tolerance = level_tolerance(pixels.shift);
    let mut sums = RaySums::default();
    let mut levels = RowLevels::default();
    let mut next = RowLevels::default();
    levels.start(image, rows[0]);
    if rows[0] > 0 {
        next.start(image, rows[0] - 1);
        compare_rows(image, rows[0] - 1, tolerance, &mut next, &mut levels);
    }
    for &row in rows {
        compare_columns(image, row, tolerance, &mut levels);
        if row + 1 < all_rows {
            next.start(image, row + 1);
            compare_rows(image, row, tolerance, &mut levels, &mut next);
        }
        for column in 0..columns {
            let ray = row * columns + column;
            add_ray(
                image.samples(ray),
                levels.of_ray(image, ray),
                (column % 2 + row % 2 * 2) as usize,
                pixels,
                &mut sums,
            );
        }
        std::mem::swap(&mut levels, &mut next);
    }
    sums
}

/// Adds the samples of one ray.
fn add_ray(samples: &[i32], levels: &[u8], parity: usize, pixels: Pixels, sums: &mut RaySums) {
    let half = 1 << (pixels.shift - 1);
    for (span, level) in samples.chunks_exact(2).zip(levels.chunks_exact(2)) {
        sums.steps[parity] += i64::from(span[1] - span[0]);
        let (first, end) = (pixels.index_from(span[0]), pixels.index_from(span[1]));
        // Of the first k indices, (k + 1) / 2 are even.
        let even = (end + 1) / 2 - (first + 1) / 2;
        sums.nodes[parity][0] += i64::from(even);
        sums.nodes[parity][1] += i64::from(end - first - even);
        for (depth, index, level, sign) in [(span[0], first, level[0], -1), (span[1], end, level[1], 1)] {
            let residual = depth - (index << pixels.shift);
            match level {
                ALONG_BOTH => sums.level[0] += i64::from(sign * residual),
                // A diagonal surface through nodes: rounding, which differs between the modes, would decide on which
                // side of them it lies; on average it lies on neither.
                ALONG_COLUMNS | ALONG_ROWS if (residual.abs() - half).abs() <= THROUGH_NODES => {}
                ALONG_COLUMNS => sums.level[1] += i64::from(sign * residual),
                ALONG_ROWS => sums.level[2] += i64::from(sign * residual),
                _ => {}
            }
        }
    }
}

/// Marks of a sample on a surface that is level in the direction of the columns, of the rows, or in both.
pub const ALONG_COLUMNS: u8 = 1;
/// See [`ALONG_COLUMNS`].
pub const ALONG_ROWS: u8 = 2;
const ALONG_BOTH: u8 = ALONG_COLUMNS | ALONG_ROWS;

/// A residual this close to half a pixel, in lattice steps, counts as that of a surface through nodes.
pub const THROUGH_NODES: i32 = 3;

/// The directions in which the surface is level at each sample of one row of rays.
#[derive(Default)]
struct RowLevels {
    first: usize,
    flags: Vec<u8>,
}

impl RowLevels {
    /// Begins a row with all flags cleared.
    fn start(&mut self, image: &Ldi, row: u32) {
        let (columns, _) = image.size();
        let [first, end] = [row, row + 1].map(|row| image.offsets()[(row * columns) as usize] as usize);
        self.first = first;
        self.flags.clear();
        self.flags.resize(end - first, 0);
    }

    fn range(&self, image: &Ldi, ray: u32) -> std::ops::Range<usize> {
        let [start, end] = [ray, ray + 1].map(|ray| image.offsets()[ray as usize] as usize - self.first);
        start..end
    }

    fn of_ray(&self, image: &Ldi, ray: u32) -> &[u8] {
        &self.flags[self.range(image, ray)]
    }

    fn of_ray_mut(&mut self, image: &Ldi, ray: u32) -> &mut [u8] {
        let range = self.range(image, ray);
        &mut self.flags[range]
    }
}

/// Compares each ray of a row with the next one.
fn compare_columns(image: &Ldi, row: u32, tolerance: i32, levels: &mut RowLevels) {
    let (columns, _) = image.size();
    for ray in row * columns..(row + 1) * columns - 1 {
        let (range, next) = (levels.range(image, ray), levels.range(image, ray + 1));
        let (flags, next_flags) = levels.flags[range.start..next.end].split_at_mut(range.len());
        mark_level(image.samples(ray), image.samples(ray + 1), tolerance, ALONG_COLUMNS, flags, next_flags);
    }
}

/// Compares each ray of a row with the one in the next row.
fn compare_rows(image: &Ldi, row: u32, tolerance: i32, levels: &mut RowLevels, next: &mut RowLevels) {
    let (columns, _) = image.size();
    for ray in row * columns..(row + 1) * columns {
        let (flags, next_flags) = (levels.of_ray_mut(image, ray), next.of_ray_mut(image, ray + columns));
        mark_level(image.samples(ray), image.samples(ray + columns), tolerance, ALONG_ROWS, flags, next_flags);
    }
}

/// Marks the samples of two neighbouring rays that lie at the same depth and have the same direction.
fn mark_level(a: &[i32], b: &[i32], tolerance: i32, mark: u8, flags_a: &mut [u8], flags_b: &mut [u8]) {
    let mut mark_pair = |i: usize, j: usize| {
        let level = if (a[i] - b[j]).abs() <= tolerance { mark } else { 0 };
        flags_a[i] |= level;
        flags_b[j] |= level;
    };
    if a.len() == b.len() {
        return (0..a.len()).for_each(|i| mark_pair(i, i));
    }
    let mut from = 0;
    for (i, &depth) in a.iter().enumerate() {
        while from < b.len() && b[from] < depth - tolerance {
            from += 1;
        }
        // The first in reach with the same direction; searching further would be quadratic where many lie within reach.
        if let Some(j) = (from..b.len()).find(|j| j % 2 == i % 2).filter(|&j| b[j] <= depth + tolerance) {
            mark_pair(i, j);
        }
    }
}
