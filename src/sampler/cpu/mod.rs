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
use std::ops::Range;

use crate::parallel::*;

use super::layout::{Voxels, Window};
use super::{Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler, admit, region_of_both};
use crate::fixed::{Crossing, Hit, TriangleHit};
use crate::grid::{Axis, LatticeBox, LatticeSolid};
use crate::ldi::{BandImage, Ldi, TooManySamples, Windings, image_from_passes};
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
    triangles_of_pass: u64,
}

/// Number of rows of a band: with 512 columns the counts and crossings of a band stay in the L2 cache.
const BAND_ROWS: NonZeroU32 = NonZeroU32::new(8).unwrap();

/// Triangles of a mesh for each pass over it. A pass lists those that meet its rows, in 40 bytes for each band that they meet.
const TRIANGLES_OF_PASS: u64 = 1 << 22;

/// Triangles for each ray that count: coarser images are small, and passes over the mesh would take more time than they are worth.
const TRIANGLES_OF_RAY: u64 = 4;

impl Default for CpuSampler {
    fn default() -> CpuSampler {
        CpuSampler::with_band_rows(BAND_ROWS)
    }
}

impl CpuSampler {
    /// Returns a sampler whose bands have the given height. It changes memory and speed, never a bit of the image.
    pub fn with_band_rows(band_rows: NonZeroU32) -> CpuSampler {
        CpuSampler { band_rows, triangles_of_pass: TRIANGLES_OF_PASS }
    }

    /// Returns the rows of each pass over solids on one grid, ascending and adjoining: together they are all rows of the image, and
    /// each but the last is whole bands. Those that the solids may meet within the region are shared out evenly.
    fn passes(&self, solids: &[&LatticeSolid], region: &LatticeBox, axis: Axis) -> Vec<Range<u32>> {
        let (grid, band_rows) = (solids[0].grid(), self.band_rows.get());
        let (columns, rows) = grid.image_size(axis);
        let triangles = solids.iter().map(|solid| solid.triangles().len() as u64).sum::<u64>();
        let counted = triangles.min(TRIANGLES_OF_RAY * u64::from(columns) * u64::from(rows));
        let passes = counted.div_ceil(self.triangles_of_pass);
        let bounds = solids.iter().fold(LatticeBox::EMPTY, |all, solid| all.hull(solid.bounds()));
        let met = Window::new(grid, &bounds.intersection(region), axis).rows;
        let first = met.start.max(0) as u32 / band_rows;
        let bands = u64::from((met.end.max(0) as u32).div_ceil(band_rows).saturating_sub(first));
        let cuts = (1..passes).map(|pass| (first + (bands * pass / passes) as u32) * band_rows);
        let mut ends: Vec<u32> = cuts.chain([rows]).filter(|&end| end > 0).collect();
        ends.dedup();
        let starts = [0].into_iter().chain(ends.clone());
        starts.zip(ends).map(|(start, end)| start..end).collect()
    }

    /// Makes an image of solids on one grid, as far as the rays meet a region. `run` appends the rays of one band from the lists of
    /// each solid.
    fn image_in_passes<S>(
        &self,
        solids: &[&LatticeSolid],
        region: &LatticeBox,
        axis: Axis,
        new_stage: impl Fn() -> S + Sync + Send,
        run: impl Fn(&mut S, &[Bins], Range<u32>, &mut BandImage) + Sync + Send,
    ) -> Result<Ldi, TooManySamples> {
        let (grid, band_rows) = (*solids[0].grid(), self.band_rows.get());
        let passes = self.passes(solids, region, axis).into_iter().map(|rows| {
            let bins = solids.par_iter().map(|solid| Bins::new(solid, region, axis, band_rows, &rows));
            let bins: Vec<Bins> = bins.collect();
            (rows, bins)
        });
        image_from_passes(grid, axis, band_rows, passes, new_stage, |stage, bins, rows, image| {
            run(stage, bins, rows, image);
        })
    }

    /// Makes an image from the sorted crossings of all rays, each passed to `keep`.
    fn exact_image<H: Hit>(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        fill: FillRule,
        keep: impl Fn(&mut BandImage, H) + Sync + Send,
    ) -> Result<Ldi, TooManySamples> {
        let grid = *solid.grid();
        let (columns, _) = grid.image_size(axis);
        let new_stage = BandCrossings::<H>::default;
        self.image_in_passes(&[solid], solid.region(), axis, new_stage, |crossings, bins, rows, image| {
            let rays = rows.len() as u32 * columns;
            crossings.gather(&grid, axis, &bins[0], rows);
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
        let image = match mode {
            Mode::Exact => self.exact_image::<Crossing>(solid, axis, fill, |image, hit| {
                image.depths().push(hit.nearest());
            }),
            Mode::Estimate(estimate) => {
                let (columns, _) = grid.image_size(axis);
                let voxels = Voxels::new(&grid, axis);
                let new_stage = || OneSolid { crossings: BandCrossings::default(), estimator: Estimator::new(&voxels) };
                self.image_in_passes(&[solid], solid.region(), axis, new_stage, |stage, bins, rows, image| {
                    let rays = rows.len() as u32 * columns;
                    stage.crossings.gather(&grid, axis, &bins[0], rows);
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
        let (columns, _) = grid.image_size(axis);
        let voxels = Voxels::new(&grid, axis);
        let new_stage = || TwoSolids {
            crossings: Default::default(),
            masks: [RayMasks::new(&voxels), RayMasks::new(&voxels)],
            occupied: vec![0; voxels.words().div_ceil(64)],
            classes: RayClasses::new(voxels.words()),
        };
        let image =
            self.image_in_passes(&[a, b], &region_of_both(a, b), axis, new_stage, |stage, bins, rows, image| {
                let rays = rows.len() as u32 * columns;
                for (crossings, bins) in stage.crossings.iter_mut().zip(bins) {
                    crossings.gather(&grid, axis, bins, rows.clone());
                }
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::grid::Grid;
    use crate::mesh::TriangleMesh;
    use crate::sampler::lists::{Keep, ListSampler};
    use crate::solids;
    use crate::testing::images::{closed, grid_around};

    fn sampler(band_rows: u32, triangles_of_pass: u64) -> CpuSampler {
        CpuSampler { band_rows: NonZeroU32::new(band_rows).unwrap(), triangles_of_pass }
    }

    fn ball_at(middle: DVec3) -> TriangleMesh {
        let mut ball = solids::sphere(0.5, 24).unwrap();
        ball.positions.iter_mut().for_each(|position| *position += middle);
        ball
    }

    /// Bands of one row, so that a pass has several waves of them.
    #[test]
    fn images_do_not_depend_on_the_number_of_passes() {
        let star = closed(solids::star(1.0, 0.3, 2).unwrap());
        let ball = closed(ball_at(DVec3::splat(0.7)));
        let grid = grid_around(&[&star, &ball], 120, 1024);
        let mut holed = star.mesh().clone();
        holed.triangles.pop();
        let holed = grid.quantise_open(&holed).unwrap();
        let [star, ball] = [&star, &ball].map(|mesh| grid.quantise(mesh).unwrap());
        let whole = sampler(1, u64::MAX);
        for (band_rows, triangles_of_pass) in [(1, 1), (1, 100), (7, 100), (40, 60)] {
            let parted = sampler(band_rows, triangles_of_pass);
            let name = format!("{band_rows} rows, {triangles_of_pass} triangles");
            for axis in Axis::ALL {
                let passes = parted.passes(&[&star], star.region(), axis).len();
                assert!(passes > 1, "{name}: {passes} passes");
                for solid in [&star, &ball, &holed] {
                    for mode in [Mode::Exact, Mode::Estimate(Estimate::Over)] {
                        let image = |by: &CpuSampler| by.sample(solid, axis, mode, FillRule::EvenOdd).unwrap();
                        assert_eq!(image(&whole), image(&parted), "{name}, {axis:?}, {mode:?}");
                    }
                }
                assert!(!parted.sample(&holed, axis, Mode::Exact, FillRule::EvenOdd).unwrap().unclosed().is_empty());
                let surface = |by: &CpuSampler| by.sample_surface(&ball, axis, FillRule::NonZero).unwrap();
                assert_eq!(surface(&whole), surface(&parted), "{name}, {axis:?}");
                let both = |by: &CpuSampler| {
                    by.sample_intersection([&star, &ball], axis, Estimate::Under, FillRule::EvenOdd).unwrap()
                };
                assert_eq!(both(&whole), both(&parted), "{name}, {axis:?}");
                let lists = |by: &CpuSampler| by.crossings::<TriangleHit>(&star, axis, Keep::GapsAndEnds).unwrap();
                assert!(lists(&whole) == lists(&parted), "{name}, {axis:?}");
            }
        }
    }

    /// Two balls in the first quarter of the rows of a grid.
    #[test]
    fn passes_share_the_rows_that_solids_meet() {
        let balls = [DVec3::ZERO, DVec3::new(0.0, 0.4, 0.0)].map(|middle| closed(ball_at(middle)));
        let grid = Grid::from_parts(DVec3::splat(-0.52), 0.026, [40, 160, 40], 20, 1024).unwrap();
        let balls = balls.each_ref().map(|ball| grid.quantise(ball).unwrap());
        let [ball, _] = &balls;
        let ends_within = |band_rows, triangles_of_pass, solids: &[&LatticeSolid], region| {
            let passes = sampler(band_rows, triangles_of_pass).passes(solids, region, Axis::Z);
            let ends: Vec<u32> = passes.iter().map(|rows| rows.end).collect();
            let starts = [0].into_iter().chain(ends.clone());
            assert!(passes.iter().map(|rows| rows.start).eq(starts.take(passes.len())), "{passes:?}");
            ends
        };
        let ends = |band_rows, triangles_of_pass, solids: &[&LatticeSolid]| {
            ends_within(band_rows, triangles_of_pass, solids, ball.region())
        };
        let triangles = ball.triangles().len() as u64;
        assert_eq!(ends(8, triangles, &[ball]), [160]);
        assert_eq!(ends(8, triangles - 1, &[ball]), [16, 160]);
        assert_eq!(ends(8, triangles, &balls.each_ref()), [24, 160]);
        assert_eq!(ends(8, 1, &[ball]), [8, 16, 24, 32, 160]);
        assert_eq!(ends(u32::MAX, 1, &[ball]), [160]);
        let none = LatticeSolid::of_primitives(&grid, &[], &[]);
        assert_eq!(ends(8, 1, &[&none]), [160]);
        // A pass lists what meets its rows alone.
        let listed = |rows: Range<u32>| {
            let bins = Bins::new(ball, ball.region(), Axis::Z, 8, &rows);
            let mut seen = 0;
            (0..160).step_by(8).for_each(|row| bins.for_each_in_band(row, |_| seen += 1));
            seen
        };
        let [all, lower, upper, beyond] = [0..160, 0..16, 16..160, 48..160].map(listed);
        assert!(all == lower + upper && lower > 10 && upper > 10 && beyond == 0, "{all}, {lower}, {upper}, {beyond}");
        assert_eq!(ends_within(8, 1, &[ball], &LatticeBox::EMPTY), [160]);
    }
}
