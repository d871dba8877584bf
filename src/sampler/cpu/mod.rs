//! The sampler for processors without a GPU: rayon over bands of rows.
//!
//! Stages, each a module: [`bin`] (triangles by band) → [`raster`] (the one geometry pass: crossings by ray) →
//! [`exact`], or [`masks`] → [`classify`] → [`retrieve`] ray by ray. The masks of one ray stay in the first-level cache,
//! and the retrieval reads the crossings that the geometry pass left instead of rasterising again.

mod bin;
mod classify;
mod exact;
mod masks;
mod raster;
mod retrieve;

use std::num::NonZeroU32;
use std::ops::Range;

use rayon::prelude::*;

use super::layout::Voxels;
use super::{Estimate, Fill, Mode, SampleError, Sampler, admit};
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::Ldi;
use bin::Bins;
use classify::RayClasses;
use exact::Unclosed;
use masks::RayMasks;
use raster::BandCrossings;

/// Samples on the threads of the current rayon pool.
#[derive(Clone, Debug)]
pub struct CpuSampler {
    band_rows: NonZeroU32,
}

/// Rows of a band: with 512 columns the counts and crossings of a band stay in the second-level cache.
const BAND_ROWS: NonZeroU32 = NonZeroU32::new(8).unwrap();

/// Bands sampled before their results are moved into the image; bounds what is held twice.
const WAVE: usize = 32;

impl Default for CpuSampler {
    fn default() -> CpuSampler {
        CpuSampler { band_rows: BAND_ROWS }
    }
}

impl CpuSampler {
    /// A sampler whose bands have the given height. It changes memory and speed, never a bit of the image.
    pub fn with_band_rows(band_rows: NonZeroU32) -> CpuSampler {
        CpuSampler { band_rows }
    }

    /// Runs `stage` over all bands and joins what it leaves.
    fn image<S: Send>(
        &self,
        grid: Grid,
        axis: Axis,
        new_stage: impl Fn() -> S + Sync,
        run: impl Fn(&mut S, usize, Range<u32>, &mut BandImage) + Sync,
    ) -> Result<Ldi, SampleError> {
        let (columns, rows) = grid.image_size(axis);
        let band_rows = self.band_rows.get();
        let bands = rows.div_ceil(band_rows) as usize;
        let mut offsets = Vec::with_capacity(columns as usize * rows as usize + 1);
        offsets.push(0u32);
        let mut depths = Vec::new();
        let mut unclosed = Vec::new();
        for wave in 0..bands.div_ceil(WAVE) {
            let wave = wave * WAVE..bands.min((wave + 1) * WAVE);
            let images: Vec<BandImage> = wave
                .into_par_iter()
                .map_init(&new_stage, |stage, band| {
                    let first = band as u32 * band_rows;
                    let mut image = BandImage::default();
                    run(stage, band, first..rows.min(first + band_rows), &mut image);
                    image
                })
                .collect();
            for image in images {
                let base = depths.len() as u32;
                let first_ray = offsets.len() as u32 - 1;
                if depths.len() + image.depths.len() > u32::MAX as usize {
                    return Err(SampleError::TooManySamples { axis, limit: u64::from(u32::MAX) });
                }
                depths.extend_from_slice(&image.depths);
                offsets.extend(image.ends.iter().map(|end| base + end));
                unclosed.extend(image.unclosed.iter().map(|ray| first_ray + ray));
            }
        }
        Ok(Ldi::from_trusted_parts(grid, axis, offsets, depths, unclosed))
    }
}

/// The part of an image that one band gives: the end of each ray's samples, the samples, and the rays that did not
/// close, all counted within the band.
#[derive(Default)]
struct BandImage {
    ends: Vec<u32>,
    depths: Vec<i32>,
    unclosed: Vec<u32>,
}

impl BandImage {
    /// Closes the ray whose samples were just appended.
    fn end_ray(&mut self, closed: bool) {
        if !closed {
            self.unclosed.push(self.ends.len() as u32);
        }
        self.ends.push(self.depths.len() as u32);
    }
}

/// What a thread keeps from band to band to make an estimate of one solid.
struct OneSolid {
    crossings: BandCrossings,
    masks: RayMasks,
    classes: RayClasses,
}

impl Sampler for CpuSampler {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: Fill) -> Result<Ldi, SampleError> {
        let grid = admit(&[solid], fill)?;
        let bins = Bins::new(solid, axis, self.band_rows.get());
        let (columns, _) = grid.image_size(axis);
        match mode {
            Mode::Exact => self.image(grid, axis, BandCrossings::default, |crossings, band, rows, image| {
                crossings.gather(solid, axis, &bins, band, rows.clone());
                image.depths.reserve(crossings.count());
                for ray in 0..rows.len() as u32 * columns {
                    let resolved = exact::resolve(crossings.on_ray(ray), fill, &mut image.depths);
                    image.end_ray(resolved != Err(Unclosed));
                }
            }),
            Mode::Estimate(estimate) => {
                let voxels = Voxels::new(&grid, axis);
                let new_stage = || OneSolid {
                    crossings: BandCrossings::default(),
                    masks: RayMasks::new(&voxels),
                    classes: RayClasses::new(voxels.words()),
                };
                self.image(grid, axis, new_stage, |stage, band, rows, image| {
                    stage.crossings.gather(solid, axis, &bins, band, rows.clone());
                    image.depths.reserve(stage.crossings.count());
                    for ray in 0..rows.len() as u32 * columns {
                        let closed = stage.estimate_ray(ray, fill, &voxels, estimate, &mut image.depths);
                        image.end_ray(closed);
                    }
                })
            }
        }
    }

    fn sample_intersection(
        &self,
        a: &LatticeSolid,
        b: &LatticeSolid,
        axis: Axis,
        estimate: Estimate,
        fill: Fill,
    ) -> Result<Ldi, SampleError> {
        let grid = admit(&[a, b], fill)?;
        let (bins_a, bins_b) = rayon::join(
            || Bins::new(a, axis, self.band_rows.get()),
            || Bins::new(b, axis, self.band_rows.get()),
        );
        let (columns, _) = grid.image_size(axis);
        let voxels = Voxels::new(&grid, axis);
        let new_stage = || TwoSolids {
            crossings: Default::default(),
            masks: [RayMasks::new(&voxels), RayMasks::new(&voxels)],
            occupied: vec![0; voxels.words().div_ceil(64)],
            classes: RayClasses::new(voxels.words()),
        };
        self.image(grid, axis, new_stage, |stage, band, rows, image| {
            stage.crossings[0].gather(a, axis, &bins_a, band, rows.clone());
            stage.crossings[1].gather(b, axis, &bins_b, band, rows.clone());
            for ray in 0..rows.len() as u32 * columns {
                let closed = stage.intersect_ray(ray, fill, &voxels, estimate, &mut image.depths);
                image.end_ray(closed);
            }
        })
    }
}

impl OneSolid {
    /// Appends the estimate on one ray to `depths`; whether the ray closed.
    fn estimate_ray(
        &mut self,
        ray: u32,
        fill: Fill,
        voxels: &Voxels,
        estimate: Estimate,
        depths: &mut Vec<i32>,
    ) -> bool {
        let crossings = self.crossings.on_ray(ray);
        if crossings.is_empty() {
            return true;
        }
        let closed = closes(crossings, fill);
        if closed {
            self.masks.enter(crossings, fill, voxels);
            self.classes.classify(&self.masks, estimate);
            let samples = append_identities(depths, self.classes.samples, estimate);
            retrieve::retrieve(crossings, &self.masks.any, &self.classes, voxels, estimate, samples);
            self.masks.clear();
        }
        closed
    }
}

/// What a thread keeps from band to band to make an estimate of the intersection of two solids.
struct TwoSolids {
    crossings: [BandCrossings; 2],
    masks: [RayMasks; 2],
    occupied: Vec<u64>,
    classes: RayClasses,
}

impl TwoSolids {
    /// Appends the estimate of the intersection on one ray to `depths`; whether both solids' rays closed.
    fn intersect_ray(
        &mut self,
        ray: u32,
        fill: Fill,
        voxels: &Voxels,
        estimate: Estimate,
        depths: &mut Vec<i32>,
    ) -> bool {
        let [a, b] = &mut self.crossings;
        let [a, b] = [a.on_ray(ray), b.on_ray(ray)];
        if !(closes(a, fill) && closes(b, fill)) {
            return false;
        }
        if a.is_empty() || b.is_empty() {
            return true;
        }
        let [masks_a, masks_b] = &mut self.masks;
        masks_a.enter(a, fill, voxels);
        masks_b.enter(b, fill, voxels);
        for ((both, a), b) in self.occupied.iter_mut().zip(&masks_a.occupied).zip(&masks_b.occupied) {
            *both = a | b;
        }
        self.classes.classify_intersection(masks_a, masks_b, &self.occupied, estimate);
        let samples = append_identities(depths, self.classes.samples, estimate);
        retrieve::retrieve(a, &masks_a.any, &self.classes, voxels, estimate, samples);
        retrieve::retrieve(b, &masks_b.any, &self.classes, voxels, estimate, samples);
        masks_a.clear();
        masks_b.clear();
        true
    }
}

/// Whether the crossings of a ray close under a fill rule.
fn closes(crossings: &[crate::fixed::Crossing], fill: Fill) -> bool {
    match fill {
        Fill::EvenOdd => crossings.len() % 2 == 0,
        Fill::NonZero => crossings.iter().map(|c| c.winding()).sum::<i32>() == 0,
    }
}

/// Appends `count` samples that every depth replaces.
fn append_identities(depths: &mut Vec<i32>, count: u32, estimate: Estimate) -> &mut [i32] {
    let before = depths.len();
    depths.extend((0..count as usize).map(|rank| retrieve::identity(rank, estimate)));
    &mut depths[before..]
}
