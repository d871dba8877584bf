//! Porosity, slice by slice.
//!
//! A slice is a plane of nodes across an axis. The rays in that plane, along either of the two other axes, say which share
//! of it is solid: lengths over lengths, with no voxel in between. Both families of rays count, since each is blind to
//! surfaces along it. The slices of an axis, weighted by their area in the region, have the porosity of those two images as
//! their mean, exactly.

use rayon::prelude::*;

use super::stretches::stretches;
use super::{Phase, Region};
use crate::grid::{Axis, Grid};
use crate::ldi::{Ldi, Spans};

/// The porosity of the slices across an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The axis that slices are across.
    pub axis: Axis,
    /// Where they are along the axis, in world coordinates, ascending: a pitch apart.
    pub positions: Vec<f64>,
    /// The share of each that is not solid; NaN where the region has none of it.
    pub porosities: Vec<f64>,
    /// What of each lies in the region, in square world units.
    pub areas: Vec<f64>,
}

impl Profile {
    /// The mean of all slices by their area: the porosity that the rays in them see. NaN where there is no area.
    pub fn mean(&self) -> f64 {
        let weighted: f64 = self.in_region().map(|(porosity, area)| porosity * area).sum();
        weighted / self.in_region().map(|(_, area)| area).sum::<f64>()
    }

    /// The least and the greatest porosity of a slice; nothing where no slice lies in the region.
    pub fn range(&self) -> Option<[f64; 2]> {
        let widen = |[low, high]: [f64; 2], (porosity, _): (f64, f64)| [low.min(porosity), high.max(porosity)];
        let range = self.in_region().fold([f64::INFINITY, f64::NEG_INFINITY], widen);
        (range[0] <= range[1]).then_some(range)
    }

    /// Porosity and area of the slices that the region has.
    fn in_region(&self) -> impl Iterator<Item = (f64, f64)> {
        self.porosities.iter().copied().zip(self.areas.iter().copied()).filter(|&(_, area)| area > 0.0)
    }
}

/// The profiles across x, y and z, from the exact images of a solid along x, y and z.
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
            stretches(solid, spans, phase, 0, |stretch| length += i64::from(stretch.length()));
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
