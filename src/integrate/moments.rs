//! Volume, centroid and inertia tensor from exact sums over the columns of an image.

use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, MomentSums};
use glam::{DMat3, DVec3};

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

/// Returns volume, centroid and inertia tensor of the solid in an image.
pub fn moments(image: &Ldi) -> Moments {
    moments_of_sums(&image.moment_sums(), image.grid(), image.axis())
}

/// Returns the same from the sums over an image whose rays lie along an axis of a grid.
pub fn moments_of_sums(sums: &MomentSums, grid: &Grid, axis: Axis) -> Moments {
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
