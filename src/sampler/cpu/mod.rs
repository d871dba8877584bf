//! The CPU sampler: rayon over bands of rows.
//!
//! Stages, each a module: `bin` (triangles by band) → `raster` (the one geometry pass: crossings by ray) → `exact`, or
//! `masks` → `classify` → `retrieve` ray by ray; `windings` accumulates the winding sums in either case. The masks of one
//! ray stay in the L1 cache, and the retrieval reads the crossings that the geometry pass left instead of rasterising again.
//! On processors with AVX2 `gather` sees eight triangles at a time, `lanes` finds the crossings of eight small ones, and
//! `network` sorts those of a ray.

mod bin;
mod classify;
mod exact;
#[cfg(target_arch = "x86_64")]
mod gather;
#[cfg(target_arch = "x86_64")]
mod lanes;
#[cfg(not(target_arch = "x86_64"))]
#[path = "no_lanes.rs"]
mod lanes;
mod lists;
mod masks;
#[cfg(target_arch = "x86_64")]
mod network;
mod raster;
mod retrieve;
mod stages;
mod windings;

use std::num::NonZeroU32;

use super::layout::Voxels;
use super::{Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler, admit, region_of_both};
use crate::fixed::{Crossing, Hit, TriangleHit};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{BandImage, Ldi, TooManySamples, Windings, image_from_bands};
use bin::Bins;
pub(crate) use bin::Sorted;
use classify::RayClasses;
pub(crate) use exact::sort;
use masks::RayMasks;
pub(crate) use raster::BandCrossings;

/// A sampler that runs on the threads of the current rayon pool.
#[derive(Clone, Debug)]
pub struct CpuSampler {
    band_rows: NonZeroU32,
}

/// Number of rows of a band: with 512 columns the counts and crossings of a band stay in the L2 cache.
const BAND_ROWS: NonZeroU32 = NonZeroU32::new(8).unwrap();

impl Default for CpuSampler {
    fn default() -> CpuSampler {
        CpuSampler { band_rows: BAND_ROWS }
    }
}

impl CpuSampler {
    /// Returns a sampler whose bands have the given height. It changes memory and speed, never a bit of the image.
    pub fn with_band_rows(band_rows: NonZeroU32) -> CpuSampler {
        CpuSampler { band_rows }
    }

    /// Makes an image from the sorted crossings of all rays, each passed to `keep`.
    fn exact_image<H: Hit>(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        fill: FillRule,
        keep: impl Fn(&mut BandImage, H) + Sync + Send,
    ) -> Result<Ldi, TooManySamples> {
        let (grid, band_rows) = (*solid.grid(), self.band_rows.get());
        let bins = Bins::new(solid, solid.region(), axis, band_rows);
        let (columns, _) = grid.image_size(axis);
        image_from_bands(grid, axis, band_rows, BandCrossings::<H>::default, |crossings, rows, image| {
            let rays = rows.len() as u32 * columns;
            crossings.gather(&grid, axis, &bins, rows);
            image.depths().reserve(crossings.count());
            let mut windings = Windings::default();
            for ray in 0..rays {
                let hits = crossings.on_ray(ray);
                if closes(hits, fill) {
                    exact::resolve(hits, fill, |hit| keep(image, hit));
                    windings::add(&mut windings, hits, |hit| hit.crossing().nearest() as u32);
                    image.end_ray();
                } else {
                    image.end_unclosed_ray();
                }
            }
            if solid.closure().is_oriented() {
                image.add_windings(windings);
            }
        })
    }
}

impl Sampler for CpuSampler {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Ldi, SampleError> {
        let grid = admit(&[solid], fill)?;
        let band_rows = self.band_rows.get();
        let image = match mode {
            Mode::Exact => self.exact_image::<Crossing>(solid, axis, fill, |image, hit| {
                image.depths().push(hit.nearest());
            }),
            Mode::Estimate(estimate) => {
                let bins = Bins::new(solid, solid.region(), axis, band_rows);
                let (columns, _) = grid.image_size(axis);
                let voxels = Voxels::new(&grid, axis);
                let new_stage = || OneSolid { crossings: BandCrossings::default(), estimator: Estimator::new(&voxels) };
                image_from_bands(grid, axis, band_rows, new_stage, |stage, rows, image| {
                    let rays = rows.len() as u32 * columns;
                    stage.crossings.gather(&grid, axis, &bins, rows);
                    image.depths().reserve(stage.crossings.count());
                    let mut windings = Windings::default();
                    for ray in 0..rays {
                        let crossings = stage.crossings.on_ray(ray);
                        stage.estimator.estimate_ray(crossings, fill, &voxels, estimate, image, &mut windings);
                    }
                    if solid.closure().is_oriented() {
                        image.add_windings(windings);
                    }
                })
            }
        };
        Ok(image?)
    }

    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: FillRule) -> Result<Ldi, SampleError> {
        admit(&[solid], fill)?;
        let image = self.exact_image::<TriangleHit>(solid, axis, fill, |image, hit| {
            image.depths().push(hit.crossing().nearest());
            image.triangles().push(hit.triangle);
        });
        Ok(image?)
    }
}

impl MaskIntersection for CpuSampler {
    fn sample_intersection(
        &self,
        [a, b]: [&LatticeSolid; 2],
        axis: Axis,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Ldi, SampleError> {
        let grid = admit(&[a, b], fill)?;
        let band_rows = self.band_rows.get();
        let region = region_of_both(a, b);
        let bins = |solid| Bins::new(solid, &region, axis, band_rows);
        let (bins_a, bins_b) = rayon::join(|| bins(a), || bins(b));
        let (columns, _) = grid.image_size(axis);
        let voxels = Voxels::new(&grid, axis);
        let new_stage = || TwoSolids {
            crossings: Default::default(),
            masks: [RayMasks::new(&voxels), RayMasks::new(&voxels)],
            occupied: vec![0; voxels.words().div_ceil(64)],
            classes: RayClasses::new(voxels.words()),
        };
        let image = image_from_bands(grid, axis, band_rows, new_stage, |stage, rows, image| {
            let rays = rows.len() as u32 * columns;
            stage.crossings[0].gather(&grid, axis, &bins_a, rows.clone());
            stage.crossings[1].gather(&grid, axis, &bins_b, rows);
            for ray in 0..rays {
                stage.intersect_ray(ray, fill, &voxels, estimate, image);
            }
        });
        Ok(image?)
    }
}

/// The state that a thread keeps from band to band for an estimate of one solid.
struct OneSolid {
    crossings: BandCrossings,
    estimator: Estimator,
}

/// Makes the estimate on one ray after another from crossings.
struct Estimator {
    masks: RayMasks,
    classes: RayClasses,
}

impl Estimator {
    fn new(voxels: &Voxels) -> Estimator {
        Estimator { masks: RayMasks::new(voxels), classes: RayClasses::new(voxels.words()) }
    }

    /// Appends the estimate on the ray of the given crossings, and adds their winding sums. Sorts the crossings.
    fn estimate_ray(
        &mut self,
        crossings: &mut [Crossing],
        fill: FillRule,
        voxels: &Voxels,
        estimate: Estimate,
        image: &mut BandImage,
        windings: &mut Windings,
    ) {
        if !closes(crossings, fill) {
            return image.end_unclosed_ray();
        }
        exact::sort(crossings);
        if fill == FillRule::EvenOdd && exact::in_voxels_of_their_own(crossings, voxels) {
            image
                .depths()
                .extend((0..).zip(&*crossings).map(|(rank, &crossing)| retrieve::rounded(crossing, rank, estimate)));
            windings::add_single(windings, crossings);
        } else {
            self.masks.enter(crossings, fill, voxels);
            self.classes.classify(&self.masks, estimate);
            let samples = append_identities(image.depths(), self.classes.samples, estimate);
            retrieve::retrieve(crossings, &self.masks.any, &self.classes, voxels, estimate, samples);
            self.masks.clear();
            windings::add(windings, crossings, |crossing| voxels.of(crossing));
        }
        image.end_ray();
    }
}

/// The state that a thread keeps from band to band for an estimate of the intersection of two solids.
struct TwoSolids {
    crossings: [BandCrossings; 2],
    masks: [RayMasks; 2],
    occupied: Vec<u64>,
    classes: RayClasses,
}

impl TwoSolids {
    /// Appends the estimate of the intersection on one ray of the band; unclosed if either solid's ray is.
    fn intersect_ray(&mut self, ray: u32, fill: FillRule, voxels: &Voxels, estimate: Estimate, image: &mut BandImage) {
        let [a, b] = self.crossings.each_mut().map(|crossings| crossings.on_ray(ray));
        if !(closes(a, fill) && closes(b, fill)) {
            return image.end_unclosed_ray();
        }
        if !(a.is_empty() || b.is_empty()) {
            let [masks_a, masks_b] = &mut self.masks;
            if fill == FillRule::NonZero {
                exact::sort(a);
                exact::sort(b);
            }
            masks_a.enter(a, fill, voxels);
            masks_b.enter(b, fill, voxels);
            for ((both, a), b) in self.occupied.iter_mut().zip(&masks_a.occupied).zip(&masks_b.occupied) {
                *both = a | b;
            }
            self.classes.classify_intersection(masks_a, masks_b, &self.occupied, estimate);
            let samples = append_identities(image.depths(), self.classes.samples, estimate);
            retrieve::retrieve(a, &masks_a.any, &self.classes, voxels, estimate, samples);
            retrieve::retrieve(b, &masks_b.any, &self.classes, voxels, estimate, samples);
            masks_a.clear();
            masks_b.clear();
        }
        image.end_ray();
    }
}

/// Returns whether the crossings of a ray close under a fill rule.
fn closes<H: Hit>(hits: &[H], fill: FillRule) -> bool {
    match fill {
        FillRule::EvenOdd => hits.len().is_multiple_of(2),
        FillRule::NonZero => hits.iter().map(|hit| hit.crossing().winding()).sum::<i32>() == 0,
    }
}

/// Appends `count` samples with the values that every depth replaces.
fn append_identities(depths: &mut Vec<i32>, count: u32, estimate: Estimate) -> &mut [i32] {
    let before = depths.len();
    depths.extend((0..count as usize).map(|rank| retrieve::identity(rank, estimate)));
    &mut depths[before..]
}
