//! Volume, centroid and inertia tensor from exact sums over the columns of an image.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::cancel::checkpoint;
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, Spans};

/// Volume, first and second moments of a solid of unit density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// In cubic world units.
    pub volume: f64,
    /// The centre of mass, in world coordinates; NaN where the volume is zero.
    pub centroid: DVec3,
    /// The inertia tensor about the centroid, in world units to the fifth; NaN where the volume is zero.
    pub inertia: DMat3,
}

/// Exact sums over the columns of an image: the volume integrals of the monomials up to degree two in column, row and depth.
/// Columns and rows count in half pixels from the corner of the image, depths in lattice steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MomentSums {
    one: i128,
    column: i128,
    row: i128,
    twice_depth: i128,
    column_column: i128,
    row_row: i128,
    thrice_depth_depth: i128,
    column_row: i128,
    twice_column_depth: i128,
    twice_row_depth: i128,
    coincident: u64,
}

/// Number of the sums.
pub const MOMENTS: usize = 10;

impl MomentSums {
    /// Builds the sums of an image that was summed elsewhere, in the order of the fields: over 1, column, row, 2 depth, column²,
    /// row², 3 depth², column · row, 2 column · depth and 2 row · depth; and the number of coincident samples.
    pub fn from_parts(sums: [i128; MOMENTS], coincident: u64) -> MomentSums {
        let [one, column, row, twice_depth, column_column, row_row, thrice_depth_depth, ..] = sums;
        let [.., column_row, twice_column_depth, twice_row_depth] = sums;
        MomentSums {
            one,
            column,
            row,
            twice_depth,
            column_column,
            row_row,
            thrice_depth_depth,
            column_row,
            twice_column_depth,
            twice_row_depth,
            coincident,
        }
    }

    /// Sums an image.
    pub fn of(image: &Ldi) -> MomentSums {
        let (_, rows) = image.size();
        let of_row = |row| MomentSums::of_row(image, row);
        (0..rows).into_par_iter().map(of_row).reduce(MomentSums::default, MomentSums::plus)
    }

    /// Returns the number of samples at the depth of the one before on their ray.
    pub fn coincident(&self) -> u64 {
        self.coincident
    }

    /// Returns the sums over one row of columns.
    fn of_row(image: &Ldi, row: u32) -> MomentSums {
        checkpoint();
        let (columns, _) = image.size();
        let mut sums = MomentSums::default();
        for column in 0..columns {
            // On a ray of at most 2^30 steps Σ(end − start) ≤ 2^30 and Σ(end² − start²) ≤ 2^60.
            let (mut one, mut two, mut three) = (0i64, 0i64, 0i128);
            let samples = image.samples(row * columns + column);
            sums.coincident += samples.windows(2).filter(|pair| pair[0] == pair[1]).count() as u64;
            for (start, end) in Spans::new(samples) {
                let (start, end) = (i64::from(start), i64::from(end));
                one += end - start;
                two += (end - start) * (end + start);
                three += i128::from(end - start) * i128::from(end * end + end * start + start * start);
            }
            let column = i64::from(2 * column + 1);
            sums.one += i128::from(one);
            sums.column += i128::from(column * one);
            sums.twice_depth += i128::from(two);
            sums.column_column += i128::from(column * column) * i128::from(one);
            sums.thrice_depth_depth += three;
            sums.twice_column_depth += i128::from(column) * i128::from(two);
        }
        let row = i128::from(2 * row + 1);
        sums.row = row * sums.one;
        sums.row_row = row * row * sums.one;
        sums.column_row = row * sums.column;
        sums.twice_row_depth = row * sums.twice_depth;
        sums
    }

    /// Returns the sums over both.
    pub fn plus(self, other: MomentSums) -> MomentSums {
        MomentSums {
            one: self.one + other.one,
            column: self.column + other.column,
            row: self.row + other.row,
            twice_depth: self.twice_depth + other.twice_depth,
            column_column: self.column_column + other.column_column,
            row_row: self.row_row + other.row_row,
            thrice_depth_depth: self.thrice_depth_depth + other.thrice_depth_depth,
            column_row: self.column_row + other.column_row,
            twice_column_depth: self.twice_column_depth + other.twice_column_depth,
            twice_row_depth: self.twice_row_depth + other.twice_row_depth,
            coincident: self.coincident + other.coincident,
        }
    }

    /// Returns volume, centroid and inertia tensor of the solid in the image, whose rays lie along an axis of a grid.
    pub fn moments(&self, grid: &Grid, axis: Axis) -> Moments {
        moments_of(self, grid, axis)
    }
}

/// Returns volume, centroid and inertia tensor of the solid in an image.
pub fn moments(image: &Ldi) -> Moments {
    MomentSums::of(image).moments(image.grid(), image.axis())
}

fn moments_of(sums: &MomentSums, grid: &Grid, axis: Axis) -> Moments {
    let volume = grid.pitch() * grid.pitch() * (grid.step() * sums.one as f64);
    if sums.one == 0 {
        return Moments { volume, centroid: DVec3::NAN, inertia: DMat3::NAN };
    }
    // Means over the solid, in half pixels and lattice steps. Variances and covariances come from differences of integers, so
    // that nothing cancels in f64: N² var = N Σx² − (Σx)², which may exceed 128 bits and is therefore taken about a whole
    // number near the mean.
    let (half_pixel, step) = (0.5 * grid.pitch(), grid.step());
    let n = sums.one;
    let near = |sum: i128| sum.div_euclid(n);
    let (c, r, d) = (near(sums.column), near(sums.row), near(sums.twice_depth).div_euclid(2));
    let mean = |sum: i128, scale: f64| sum as f64 / n as f64 * scale;
    let offset = [
        mean(sums.column - c * n, half_pixel),
        mean(sums.row - r * n, half_pixel),
        mean(sums.twice_depth - 2 * d * n, 0.5 * step),
    ];
    let about = [
        mean(sums.column_column - 2 * c * sums.column + c * c * n, half_pixel * half_pixel),
        mean(sums.row_row - 2 * r * sums.row + r * r * n, half_pixel * half_pixel),
        mean(sums.thrice_depth_depth - 3 * d * sums.twice_depth + 3 * d * d * n, step * step / 3.0),
    ];
    let mixed = [
        mean(sums.column_row - c * sums.row - r * sums.column + c * r * n, half_pixel * half_pixel),
        mean(
            sums.twice_column_depth - c * sums.twice_depth - 2 * d * sums.column + 2 * c * d * n,
            0.5 * half_pixel * step,
        ),
        mean(sums.twice_row_depth - r * sums.twice_depth - 2 * d * sums.row + 2 * r * d * n, 0.5 * half_pixel * step),
    ];
    // The section of a column adds h²/12 to its second moments across the ray.
    let section = grid.pitch() * grid.pitch() / 12.0;
    let places = [axis.column(), axis.row(), axis.depth()];
    let mut centroid = DVec3::ZERO;
    let mut covariance = DMat3::ZERO;
    for i in 0..3 {
        let whole = [c, r, d][i] as f64 * [half_pixel, half_pixel, step][i];
        centroid[places[i]] = grid.origin()[places[i]] + whole + offset[i];
        let variance = about[i] - offset[i] * offset[i] + if i < 2 { section } else { 0.0 };
        covariance.col_mut(places[i])[places[i]] = variance;
    }
    for (k, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
        let shared = mixed[k] - offset[i] * offset[j];
        covariance.col_mut(places[i])[places[j]] = shared;
        covariance.col_mut(places[j])[places[i]] = shared;
    }
    let trace = covariance.col(0)[0] + covariance.col(1)[1] + covariance.col(2)[2];
    Moments { volume, centroid, inertia: volume * (DMat3::from_diagonal(DVec3::splat(trace)) - covariance) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::surface_hits;
    use crate::mesh::ClosedMesh;
    use crate::sampler::Mode;
    use crate::solids;
    use crate::testing::images::{closed, grid_around, images_of, surface_images};

    fn box_of(min: DVec3, max: DVec3) -> ClosedMesh {
        closed(solids::cuboid(min, max).unwrap())
    }

    #[test]
    fn a_box_has_its_volume_area_centroid_and_inertia() {
        let (min, max) = (DVec3::new(-1.0, 2.0, 30.0), DVec3::new(3.0, 4.0, 38.0));
        let mesh = box_of(min, max);
        let grid = grid_around(&[&mesh], 64, 1024);
        let solid = grid.quantise(&mesh).unwrap();
        let mut area = 0.0;
        for (axis, image) in Axis::ALL.into_iter().zip(surface_images(&solid)) {
            area += surface_hits(&image, |triangle| solid.facing(triangle, axis)).boundary;
            let found = moments(&image);
            assert_eq!(found.volume, 64.0);
            assert!((found.centroid - 0.5 * (min + max)).length() < 1e-12, "{axis:?} {:?}", found.centroid);
            let (a, b, c) = (4.0f64, 2.0, 8.0);
            let expected = DVec3::new(b * b + c * c, a * a + c * c, a * a + b * b) * 64.0 / 12.0;
            let difference = found.inertia - DMat3::from_diagonal(expected);
            assert!(difference.to_cols_array().iter().all(|d| d.abs() < 1e-9), "{axis:?} {difference}");
        }
        assert!((area - 2.0 * (8.0 + 16.0 + 32.0)).abs() < 1e-9, "{area}");
    }

    #[test]
    fn a_turned_box_has_products_of_inertia() {
        // A prism over the right triangle (0,0), (1,0), (0,1): I_xy about the centroid is −∫(x − x̄)(y − ȳ) = 1/72 of h.
        let mut prism = solids::cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        for p in &mut prism.positions {
            if p.x == 1.0 && p.y == 1.0 {
                (p.x, p.y) = (0.5, 0.5);
            }
        }
        for (axis, image) in Axis::ALL.into_iter().zip(images_of(prism, 512, 1024, Mode::Exact)) {
            let found = moments(&image);
            assert!((found.volume - 0.5).abs() < 2e-3);
            assert!((found.inertia.col(0)[1] - 1.0 / 72.0).abs() < 1e-4, "{axis:?} {}", found.inertia);
            assert!(found.inertia.col(0)[2].abs() < 1e-9);
        }
    }
}
