//! Images from crossing lists: the crossings of triangles that bound nothing by themselves, reduced ray by ray to those
//! that may bound a solid, and the image of a solid given by such lists.
//!
//! Minkowski sums are computed this way: their primitives cross a ray far more often than their boundary does, and only
//! when all rays have been examined together is it known which crossings are the boundary's.

use crate::parallel::*;

use super::bin::Bins;
use super::raster::BandCrossings;
use super::{CpuSampler, Estimator, exact};
use crate::cancel::checkpoint;
use crate::fixed::{Crossing, Hit, Pixels};
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::{Ldi, TooManySamples, Windings, image_from_bands};
use crate::sampler::layout::Voxels;
use crate::sampler::lists::{BandLists, Keep, ListSampler, RayLists};
use crate::sampler::{FillRule, Mode};

impl CpuSampler {
    /// Returns the sorted crossings of each ray with `triangles`, as far as `keep` appends them.
    pub fn lists<H: Hit>(
        &self,
        triangles: &LatticeSolid,
        axis: Axis,
        keep: impl Fn(&[H], &mut Vec<H>) + Sync,
    ) -> Result<RayLists<H>, TooManySamples> {
        let (grid, band_rows) = (*triangles.grid(), self.band_rows.get());
        let (columns, rows) = grid.image_size(axis);
        let mut bands: Vec<BandLists<H>> = Vec::with_capacity(rows.div_ceil(band_rows) as usize);
        for pass in self.passes(&[triangles], triangles.region(), axis) {
            let bins = Bins::new(triangles, triangles.region(), axis, band_rows, &pass);
            let bands_of_pass = pass.start / band_rows..pass.end.div_ceil(band_rows);
            bands.par_extend(bands_of_pass.into_par_iter().map_init(BandCrossings::<H>::default, |crossings, band| {
                checkpoint();
                let first = band * band_rows;
                let rows = first..rows.min(first + band_rows);
                let rays = rows.len() as u32 * columns;
                crossings.gather(&grid, axis, &bins, rows);
                let mut kept = BandLists { crossings: crossings.count() as u64, ..BandLists::default() };
                for ray in 0..rays {
                    let hits = crossings.on_ray(ray);
                    exact::sort(hits);
                    keep(hits, &mut kept.hits);
                    kept.ends.push(kept.hits.len() as u32);
                }
                kept
            }));
        }
        RayLists::of_bands(axis, bands)
    }

    /// Returns the image of a solid whose crossings with each ray are `hits_of_ray`, ascending, alternately entering
    /// and leaving. An exact image of hits that carry their triangles has the triangles, too.
    pub fn image_of_lists<'h, H: Hit + Sync + 'h>(
        &self,
        grid: &Grid,
        axis: Axis,
        mode: Mode,
        hits_of_ray: impl Fn(u32) -> &'h [H] + Sync + Send,
    ) -> Result<Ldi, TooManySamples> {
        let (columns, _) = grid.image_size(axis);
        let voxels = Voxels::new(grid, axis);
        let new_stage = || (Estimator::new(&voxels), Vec::<Crossing>::new());
        image_from_bands(*grid, axis, self.band_rows.get(), new_stage, |(estimator, crossings), rows, image| {
            for ray in rows.start * columns..rows.end * columns {
                let hits = hits_of_ray(ray);
                match mode {
                    Mode::Exact => {
                        image.depths().extend(hits.iter().map(|hit| hit.crossing().nearest()));
                        image.triangles().extend(hits.iter().filter_map(|hit| hit.triangle()));
                        image.end_ray();
                    }
                    Mode::Estimate(estimate) => {
                        crossings.clear();
                        crossings.extend(hits.iter().map(|hit| hit.crossing()));
                        let mut windings = Windings::default();
                        estimator.estimate_ray(crossings, FillRule::EvenOdd, &voxels, estimate, image, &mut windings);
                    }
                }
            }
        })
    }
}

impl ListSampler for CpuSampler {
    type Error = TooManySamples;

    fn crossings<H: Hit>(
        &self,
        triangles: &LatticeSolid,
        axis: Axis,
        keep: Keep,
    ) -> Result<RayLists<H>, TooManySamples> {
        let pixels = Pixels::new(triangles.grid().shift());
        self.lists(triangles, axis, |sorted, kept| keep.append(pixels, sorted, kept))
    }
}
