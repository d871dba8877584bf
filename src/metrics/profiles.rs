//! Porosity, slice by slice.
//!
//! A slice is a plane of nodes across an axis. The rays in that plane, along either of the two other axes, determine the solid
//! share of it: lengths over lengths, without voxels. Both families of rays count, since each is blind to surfaces along it.
//! The slices of an axis, weighted by their area in the region, have the porosity of those two images as their mean, exactly.

use crate::parallel::*;

use super::segments::segments;
use super::{Phase, Region};
use crate::cancel::checkpoint;
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, Spans};

/// The porosity of the slices across an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The axis that slices are across.
    pub axis: Axis,
    /// Positions along the axis, in world coordinates, ascending: a pitch apart.
    pub positions: Vec<f64>,
    /// The share of each slice that is not solid; NaN outside the region.
    pub porosities: Vec<f64>,
    /// The area of each slice within the region, in square world units.
    pub areas: Vec<f64>,
}

impl Profile {
    /// Returns the mean of all slices by their area: the porosity along the rays in them. NaN where there is no area.
    pub fn mean(&self) -> f64 {
        let weighted: f64 = self.in_region().map(|(porosity, area)| porosity * area).sum();
        weighted / self.in_region().map(|(_, area)| area).sum::<f64>()
    }

    /// Returns the least and the greatest porosity of a slice; `None` where no slice lies in the region.
    pub fn range(&self) -> Option<[f64; 2]> {
        let widen = |[low, high]: [f64; 2], (porosity, _): (f64, f64)| [low.min(porosity), high.max(porosity)];
        let range = self.in_region().fold([f64::INFINITY, f64::NEG_INFINITY], widen);
        (range[0] <= range[1]).then_some(range)
    }

    /// Returns porosity and area of the slices in the region.
    fn in_region(&self) -> impl Iterator<Item = (f64, f64)> {
        self.porosities.iter().copied().zip(self.areas.iter().copied()).filter(|&(_, area)| area > 0.0)
    }
}

/// Computes the profiles across x, y and z, from the exact images of a solid along x, y and z.
pub fn profiles(images: &[Ldi; 3], region: &Region) -> [Profile; 3] {
    let sums = images.each_ref().map(|image| ImageSums::of(image, region));
    Axis::ALL.map(|axis| {
        let mut slices = vec![Lengths::default(); images[0].grid().rays()[axis.depth()] as usize];
        for (image, sums) in images.iter().zip(&sums) {
            let lines = match axis.depth() {
                across if across == image.axis().column() => &sums.columns,
                across if across == image.axis().row() => &sums.rows,
                _ => continue,
            };
            slices.iter_mut().zip(lines).for_each(|(slice, line)| slice.add(line));
        }
        Profile::of(axis, images[0].grid(), &slices)
    })
}

impl Profile {
    fn of(axis: Axis, grid: &Grid, slices: &[Lengths]) -> Profile {
        let place = |slice: usize| grid.origin()[axis.depth()] + grid.step() * f64::from(grid.node(slice as u32));
        Profile {
            axis,
            positions: (0..slices.len()).map(place).collect(),
            // 0/0 is NaN where the region has no length.
            porosities: slices.iter().map(|slice| slice.pore as f64 / slice.region() as f64).collect(),
            // Two images, each of which has the whole area.
            areas: slices.iter().map(|slice| 0.5 * grid.pitch() * grid.step() * slice.region() as f64).collect(),
        }
    }
}

/// Lengths of rays, in lattice steps.
#[derive(Clone, Copy, Debug, Default)]
struct Lengths {
    solid: i64,
    pore: i64,
}

impl Lengths {
    fn of_ray(image: &Ldi, region: &Region, ray: u32) -> Lengths {
        let length = |phase| {
            let mut length = 0;
            let (solid, spans) = (Spans::new(image.samples(ray)), region.spans(image.axis(), ray));
            segments(solid, spans, phase, 0, |segment| length += i64::from(segment.length()));
            length
        };
        Lengths { solid: length(Phase::Solid), pore: length(Phase::Pore) }
    }

    fn add(&mut self, other: &Lengths) {
        self.solid += other.solid;
        self.pore += other.pore;
    }

    fn region(&self) -> i64 {
        self.solid + self.pore
    }
}

/// The lengths of the rays of an image, by column and by row.
struct ImageSums {
    columns: Vec<Lengths>,
    rows: Vec<Lengths>,
}

impl ImageSums {
    fn of(image: &Ldi, region: &Region) -> ImageSums {
        let (columns, rows) = image.size();
        let of_row = |row: u32| -> Vec<Lengths> {
            checkpoint();
            (row * columns..(row + 1) * columns).map(|ray| Lengths::of_ray(image, region, ray)).collect()
        };
        let added = |mut all: Vec<Lengths>, part: Vec<Lengths>| {
            all.iter_mut().zip(&part).for_each(|(sum, lengths)| sum.add(lengths));
            all
        };
        let (by_row, by_column): (Vec<Lengths>, Vec<Vec<Lengths>>) = (0..rows)
            .into_par_iter()
            .map(|row| {
                let rays = of_row(row);
                let sum = rays.iter().fold(Lengths::default(), |mut sum, ray| {
                    sum.add(ray);
                    sum
                });
                (sum, rays)
            })
            .unzip();
        let none = vec![Lengths::default(); columns as usize];
        ImageSums { columns: by_column.into_iter().fold(none, added), rows: by_row }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::f64::consts::PI;

    use crate::integrate;
    use crate::metrics::surface_area::tests::{Sampled, grid_of, network, order};
    use crate::solids::{self, Surface};

    #[test]
    fn a_ball_has_the_profile_of_its_sections() {
        let errors = [32, 64, 128].map(|resolution| {
            let ball = Sampled::on(
                &grid_of(DVec3::splat(-1.1), DVec3::splat(1.1), resolution),
                solids::geodesic(1.0, 96).unwrap(),
            );
            let pitch = ball.grid().pitch();
            let mut worst = 0.0f64;
            for profile in profiles(&ball.images, &ball.whole()) {
                assert_eq!(profile.positions.len(), resolution as usize);
                for i in 0..profile.positions.len() {
                    let z = profile.positions[i];
                    assert!((z - (-1.1 + (i as f64 + 0.5) * pitch)).abs() < 1e-6);
                    assert!((profile.areas[i] - 2.2 * 2.2).abs() < 1e-6);
                    let exact = 1.0 - PI * (1.0 - z * z).max(0.0) / (2.2 * 2.2);
                    worst = worst.max((profile.porosities[i] - exact).abs());
                }
                let [low, high] = profile.range().unwrap();
                assert!((low - (1.0 - PI / 4.84)).abs() < 1e-2 && high == 1.0);
            }
            worst
        });
        println!("ball, porosity by slice: off by {errors:.5?}, order {:.2}", order(errors));
        assert!(errors[2] < 2e-3 && order(errors) > 1.0, "{errors:?}");
    }

    #[test]
    fn the_mean_of_slices_equals_the_porosity_of_the_images() {
        let cell = Sampled::of(network(Surface::Gyroid, 1, 24), 40);
        let region = cell.boxed();
        let volumes = cell.images.each_ref().map(integrate::volume);
        for profile in profiles(&cell.images, &region) {
            let others = (0..3).filter(|&axis| axis != profile.axis.depth());
            let solid = 0.5 * others.map(|axis| volumes[axis]).sum::<f64>();
            let porosity = 1.0 - solid / region.volume();
            assert!((profile.mean() - porosity).abs() < 1e-12, "{} {porosity}", profile.mean());
        }
    }

    #[test]
    fn profiles_show_a_step_at_its_place() {
        let grid = grid_of(DVec3::ZERO, DVec3::splat(4.0), 16);
        let block = solids::cuboid(DVec3::ZERO, DVec3::new(4.0, 4.0, 1.5)).unwrap();
        let block = Sampled::on(&grid, block);
        let [x, y, z] = profiles(&block.images, &block.whole());
        for (position, porosity) in z.positions.iter().zip(&z.porosities) {
            assert_eq!(*porosity, if *position < 1.5 { 0.0 } else { 1.0 });
        }
        for profile in [x, y] {
            assert!(profile.porosities.iter().all(|porosity| (porosity - 0.625).abs() < 1e-6));
        }
    }

    #[test]
    fn slices_beyond_the_region_are_nan() {
        let grid = grid_of(DVec3::splat(-2.0), DVec3::splat(2.0), 32);
        let plate = solids::cuboid(DVec3::new(-2.0, -2.0, -0.25), DVec3::new(2.0, 2.0, 0.25)).unwrap();
        let [plate, ball] = [plate, solids::geodesic(1.0, 16).unwrap()].map(|mesh| Sampled::on(&grid, mesh));
        let region = Region::of_solid(&ball.images);
        let [x, _, z] = profiles(&plate.images, &region);
        for (i, &position) in z.positions.iter().enumerate() {
            match position.abs() {
                beyond if beyond > 1.0 => assert!(z.porosities[i].is_nan() && z.areas[i] == 0.0, "{position}"),
                height => assert_eq!(z.porosities[i], f64::from(u8::from(height > 0.25)), "{position}"),
            }
            assert!((z.areas[i] - PI * (1.0 - position * position).max(0.0)).abs() < 0.1);
        }
        assert_eq!(z.range(), Some([0.0, 1.0]));
        // Volume of the plate within the ball: π(2·0.25 − 2·0.25³/3).
        let exact = 1.0 - PI * (0.5 - 2.0 * 0.25f64.powi(3) / 3.0) / (4.0 / 3.0 * PI);
        assert!((x.mean() - exact).abs() < 1e-2, "{} {exact}", x.mean());
    }
}
