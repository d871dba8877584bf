//! The sampler for processors without a GPU: rayon over bands of rows.
//!
//! Stages, each a module: `bin` (triangles by band) → `raster` (the one geometry pass: crossings by ray) →
//! `exact`, or `masks` → `classify` → `retrieve` ray by ray; `windings` adds up the crossings beside either. The masks of
//! one ray stay in the first-level cache, and the retrieval reads the crossings that the geometry pass left instead of
//! rasterising again.

mod bin;
mod classify;
mod exact;
mod masks;
mod raster;
mod retrieve;
mod windings;

use std::num::NonZeroU32;

use super::layout::Voxels;
use super::stages::{ListStages, MaskStages, UNCLOSED};
use super::{Estimate, Fill, Mode, SampleError, Sampler, admit, region_of_both};
use crate::fixed::{Crossing, Hit, TriangleHit};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{BandImage, Ldi, TooManySamples, Windings, image_from_bands};
use bin::Bins;
use classify::RayClasses;
use masks::RayMasks;
use raster::BandCrossings;

/// Samples on the threads of the current rayon pool.
#[derive(Clone, Debug)]
pub struct CpuSampler {
    band_rows: NonZeroU32,
}

/// Rows of a band: with 512 columns the counts and crossings of a band stay in the second-level cache.
const BAND_ROWS: NonZeroU32 = NonZeroU32::new(8).unwrap();

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

    /// The sorted crossings of all rays, each handed to `keep`.
    fn exact_image<H: Hit>(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        fill: Fill,
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

impl CpuSampler {
    /// The buffers between the stages of masks, for one solid or the intersection of two, whole images at once.
    pub fn mask_stages(
        &self,
        solids: &[&LatticeSolid],
        axis: Axis,
        estimate: Estimate,
    ) -> Result<MaskStages, SampleError> {
        let grid = admit(solids, Fill::EvenOdd)?;
        let region = match solids {
            [a, b] => region_of_both(a, b),
            _ => *solids[0].region(),
        };
        let (columns, rows) = grid.image_size(axis);
        let rays = columns as usize * rows as usize;
        let voxels = Voxels::new(&grid, axis);
        let words = voxels.words();
        let empty = || vec![0; rays * words];
        let mut stages = MaskStages {
            masks: solids.iter().map(|_| [empty(), empty()]).collect(),
            single: empty(),
            pair: empty(),
            ranks: empty(),
            counts: vec![0; rays],
            offsets: vec![0],
        };
        let mut crossings: Vec<BandCrossings> = solids.iter().map(|_| BandCrossings::default()).collect();
        for (crossings, solid) in crossings.iter_mut().zip(solids) {
            crossings.gather(&grid, axis, &Bins::new(solid, &region, axis, rows), 0..rows);
        }
        let mut classes = RayClasses::new(words);
        for ray in 0..rays {
            let mut closed = true;
            let masks: Vec<RayMasks> = crossings
                .iter_mut()
                .map(|crossings| {
                    let crossings = crossings.on_ray(ray as u32);
                    closed &= closes(crossings, Fill::EvenOdd);
                    let mut masks = RayMasks::new(&voxels);
                    masks.enter(crossings, Fill::EvenOdd, &voxels);
                    masks
                })
                .collect();
            for ([change, any], masks) in stages.masks.iter_mut().zip(&masks) {
                for word in 0..words {
                    change[word * rays + ray] = masks.change[word];
                    any[word * rays + ray] = masks.any[word];
                }
            }
            let mut occupied = masks[0].occupied.clone();
            match &masks[..] {
                _ if !closed => {
                    occupied.fill(0);
                    classes.samples = 0;
                }
                [a, b] => {
                    occupied.iter_mut().zip(&b.occupied).for_each(|(both, b)| *both |= b);
                    classes.classify_intersection(a, b, &occupied, estimate);
                }
                _ => classes.classify(&masks[0], estimate),
            }
            let mut rank = 0;
            for word in 0..words {
                let at = word * rays + ray;
                if occupied[word / 64] >> (word % 64) & 1 == 1 {
                    (stages.single[at], stages.pair[at]) = (classes.single[word], classes.pair[word]);
                }
                stages.ranks[at] = if closed { rank } else { UNCLOSED };
                rank += stages.single[at].count_ones() + 2 * stages.pair[at].count_ones();
            }
            stages.counts[ray] = if closed { classes.samples } else { UNCLOSED };
            stages.offsets.push(stages.offsets[ray] + classes.samples);
        }
        Ok(stages)
    }

    /// The crossings of all rays, sorted.
    pub fn list_stages(&self, solid: &LatticeSolid, axis: Axis) -> Result<ListStages, SampleError> {
        let grid = admit(&[solid], Fill::EvenOdd)?;
        let (columns, rows) = grid.image_size(axis);
        let mut crossings = BandCrossings::<Crossing>::default();
        crossings.gather(&grid, axis, &Bins::new(solid, solid.region(), axis, rows), 0..rows);
        let mut stages = ListStages { starts: vec![0], crossings: Vec::with_capacity(crossings.count()) };
        for ray in 0..columns * rows {
            let on_ray = crossings.on_ray(ray);
            exact::sort(on_ray);
            stages.crossings.extend(on_ray.iter().map(|crossing| crossing.0));
            stages.starts.push(stages.crossings.len() as u32);
        }
        Ok(stages)
    }
}

impl Sampler for CpuSampler {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: Fill) -> Result<Ldi, SampleError> {
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
                let new_stage = || OneSolid {
                    crossings: BandCrossings::default(),
                    masks: RayMasks::new(&voxels),
                    classes: RayClasses::new(voxels.words()),
                };
                image_from_bands(grid, axis, band_rows, new_stage, |stage, rows, image| {
                    let rays = rows.len() as u32 * columns;
                    stage.crossings.gather(&grid, axis, &bins, rows);
                    image.depths().reserve(stage.crossings.count());
                    let mut windings = Windings::default();
                    for ray in 0..rays {
                        stage.estimate_ray(ray, fill, &voxels, estimate, image, &mut windings);
                    }
                    if solid.closure().is_oriented() {
                        image.add_windings(windings);
                    }
                })
            }
        };
        Ok(image?)
    }

    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: Fill) -> Result<Ldi, SampleError> {
        admit(&[solid], fill)?;
        let image = self.exact_image::<TriangleHit>(solid, axis, fill, |image, hit| {
            image.depths().push(hit.crossing().nearest());
            image.triangles().push(hit.triangle);
        });
        Ok(image?)
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

/// What a thread keeps from band to band to make an estimate of one solid.
struct OneSolid {
    crossings: BandCrossings,
    masks: RayMasks,
    classes: RayClasses,
}

impl OneSolid {
    /// Appends the estimate on one ray of the band, and adds what its crossings tell of windings.
    fn estimate_ray(
        &mut self,
        ray: u32,
        fill: Fill,
        voxels: &Voxels,
        estimate: Estimate,
        image: &mut BandImage,
        windings: &mut Windings,
    ) {
        let crossings = self.crossings.on_ray(ray);
        if !closes(crossings, fill) {
            return image.end_unclosed_ray();
        }
        exact::sort(crossings);
        if fill == Fill::EvenOdd && exact::in_voxels_of_their_own(crossings, voxels) {
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

/// What a thread keeps from band to band to make an estimate of the intersection of two solids.
struct TwoSolids {
    crossings: [BandCrossings; 2],
    masks: [RayMasks; 2],
    occupied: Vec<u64>,
    classes: RayClasses,
}

impl TwoSolids {
    /// Appends the estimate of the intersection on one ray of the band; unclosed if either solid's ray is.
    fn intersect_ray(&mut self, ray: u32, fill: Fill, voxels: &Voxels, estimate: Estimate, image: &mut BandImage) {
        let [a, b] = self.crossings.each_mut().map(|crossings| crossings.on_ray(ray));
        if !(closes(a, fill) && closes(b, fill)) {
            return image.end_unclosed_ray();
        }
        if !(a.is_empty() || b.is_empty()) {
            let [masks_a, masks_b] = &mut self.masks;
            if fill == Fill::NonZero {
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

/// Whether the crossings of a ray close under a fill rule.
fn closes<H: Hit>(hits: &[H], fill: Fill) -> bool {
    match fill {
        Fill::EvenOdd => hits.len().is_multiple_of(2),
        Fill::NonZero => hits.iter().map(|hit| hit.crossing().winding()).sum::<i32>() == 0,
    }
}

/// Appends `count` samples that every depth replaces.
fn append_identities(depths: &mut Vec<i32>, count: u32, estimate: Estimate) -> &mut [i32] {
    let before = depths.len();
    depths.extend((0..count as usize).map(|rank| retrieve::identity(rank, estimate)));
    &mut depths[before..]
}
