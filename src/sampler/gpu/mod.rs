//! The GPU sampler: compute shaders that return the same bits as the CPU sampler.
//!
//! # Two routes
//! **Lists**, for everything: `cover` (the only geometry pass; `append` takes the crossings it finds) → `scan` → `place` (by ray)
//! → `sort` (long lists) → `resolve`, of each leaf of a combination, then `combine`, or for the estimated intersection of two
//! solids `sort` and `meet` → where samples leave the device `scan` → `compact`; of
//! triangles that bound nothing by themselves `gaps` → `scan` → `offsets` and `keep`, in place of those. The images along all
//! three axes are made in one recording, each triangle is read once, and the host waits once: there is room for as many
//! crossings as the areas of the triangles make likely, and if there are more, the recording is made again. Where only part of a
//! solid is looked at, the host waits for the number of samples, and then for the samples.
//! **Masks**, the paper's method, for estimates under the even-odd rule: `masks` (the first geometry pass) → `classify` →
//! `scan` → `identities` → `retrieve` (the second), one band a recording. The stages are WGSL files in `shaders/`, named like
//! their counterparts in [`super::cpu`].
//!
//! # Jobs
//! A recording makes a job: bands of rays along up to three axes, as many as the memory budget and the adapter's largest binding
//! allow. A job whose crossings need more, or for which the device has no memory left, is divided and made again, so that any
//! image that fits the host can be made on any adapter, down to one ray at a time.
//!
//! # Exactness
//! Integers of 64 and 96 bits decide depths and coverage (`shaders/fixed.wgsl`); floating point only guesses. Sums and
//! masks use operations whose order does not matter, and lists are sorted.

mod band;
mod gaps;
mod image;
mod job;
mod lists;
mod masks;
mod network;
mod solid;
mod stages;
mod view;
mod volume_sums;

use std::sync::{Arc, Mutex};

use super::stages::{ListStages, MaskStages};
use super::{Combination, Combined, Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler, SolidSums};
use crate::gpu::{Adapter, Device, DeviceError, Pool, held};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{BandImage, ImageBuilder, Ldi, LdiError, VolumeSums, Windings};
use band::Band;
use image::{Image, Way};
use job::{Job, JobError};
use solid::{ResidentSolid, Residents, bytes_of_all};
use stages::Kernels;
use view::View;
use volume_sums::sums_by_leaf;

pub use stages::Arithmetic;

/// The method for estimates under the even-odd rule. The other rule, and exact images, always use lists, and so does
/// everything that a route has no room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// By bit masks and min/max retrieval.
    Masks,
    /// By sorted lists of crossings.
    Lists,
}

/// The options of a GPU sampler. None of them changes a bit of any image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuOptions {
    /// Native by default where the adapter has 64-bit integers, except on DirectX 12.
    pub arithmetic: Option<Arithmetic>,
    /// The method for even-odd estimates.
    pub route: Route,
    /// Bytes of device memory for the lists or masks of a job together, and for solids. Counts and offsets of its rays
    /// take more, and data that is read back takes twice its size.
    pub memory: u64,
    /// Largest number of rays of a job, and for a combination of rays times leaves.
    pub band_rays: u32,
    /// Largest size of one binding in bytes; the adapter's own limit applies besides.
    pub binding: u64,
    /// Fills every buffer of a band with this word before it is used, so that words which no stage writes are detected.
    /// For tests.
    pub prefill: Option<u32>,
}

impl Default for GpuOptions {
    fn default() -> GpuOptions {
        GpuOptions {
            arithmetic: None,
            route: Route::Lists,
            memory: 1 << 30,
            band_rays: 1 << 24,
            binding: 1 << 30,
            prefill: None,
        }
    }
}

/// A sampler that runs on one GPU. Calls from several threads are serialised.
pub struct GpuSampler {
    device: Arc<Device>,
    options: GpuOptions,
    kernels: Kernels,
    state: Mutex<State>,
}

/// The state that is kept from call to call.
struct State {
    pool: Pool,
    residents: Residents,
}

impl GpuSampler {
    /// Opens an adapter.
    pub fn open(adapter: &Adapter, options: GpuOptions) -> Result<GpuSampler, DeviceError> {
        let device = Arc::new(Device::open(adapter, stages::needs(options.route == Route::Masks))?);
        // On DirectX 12 wgpu reports 64-bit integers that not every one of its shader compilers supports.
        let is_native = adapter.int64 && adapter.api != "dx12";
        let arithmetic = options.arithmetic.unwrap_or(if is_native { Arithmetic::Native } else { Arithmetic::Pairs });
        let state = State { pool: Pool::new(options.prefill), residents: Residents::default() };
        Ok(GpuSampler { device, options, kernels: Kernels::new(arithmetic), state: Mutex::new(state) })
    }

    /// Returns the device, for its name, the times of its stages, or other work.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Returns the arithmetic of its shaders.
    pub fn arithmetic(&self) -> Arithmetic {
        self.kernels.arithmetic()
    }

    fn largest_binding(&self) -> u64 {
        self.device.largest_binding().min(self.options.binding)
    }

    /// Returns the buffers between the stages of the route by masks, for one solid or the intersection of two.
    ///
    /// # Panics
    /// Panics if the image needs more than one band.
    pub fn mask_stages(
        &self,
        solids: &[&LatticeSolid],
        axis: Axis,
        estimate: Estimate,
    ) -> Result<MaskStages, SampleError> {
        let image = match solids {
            [a, b] => Image::of_two(a, b, estimate, FillRule::EvenOdd)?,
            _ => Image::of_one(solids[0], Mode::Estimate(estimate), FillRule::EvenOdd)?,
        };
        self.in_one_band(solids, &image, axis, |job| job.mask_stages())
    }

    /// Returns the buffers between the stages of the route by lists.
    ///
    /// # Panics
    /// Panics if the image needs more than one band.
    pub fn list_stages(&self, solid: &LatticeSolid, axis: Axis) -> Result<ListStages, SampleError> {
        let image = Image::of_one(solid, Mode::Exact, FillRule::EvenOdd)?;
        self.in_one_band(&[solid], &image, axis, |job| job.list_stages())
    }

    /// Runs a function on the whole image along an axis as one band.
    fn in_one_band<T>(
        &self,
        solids: &[&LatticeSolid],
        image: &Image,
        axis: Axis,
        run: impl FnOnce(&mut Job) -> Result<T, JobError>,
    ) -> Result<T, SampleError> {
        let (columns, rows) = image.grid.image_size(axis);
        let Way { route, most_rays } = image.way(self);
        assert!(columns * rows <= most_rays, "{columns} × {rows} rays in bands of {most_rays}");
        let mut state = held(&self.state);
        let State { pool, residents } = &mut *state;
        let solids = self.resident(residents, solids)?;
        let bands = [Band::of_rows(axis, 0..rows, columns)];
        let view = View::new(image, route, &bands);
        let mut job = Job { sampler: self, pool, solids: &solids, image, route, bands: &bands, view };
        run(&mut job).map_err(|error| self.refused(error))
    }

    /// Makes images along some axes.
    fn images(
        &self,
        solids: &[&LatticeSolid],
        image: &Image,
        axes: &[Axis],
    ) -> Result<Vec<WithLeaves<Ldi>>, SampleError> {
        assert!(are_different(axes), "{axes:?} has an axis twice");
        let no_windings = image.counts_windings().then(Windings::default);
        let mut builders = Vec::new();
        let mut of_leaves = vec![Vec::new(); axes.len()];
        for &axis in axes {
            let (columns, _) = image.grid.image_size(axis);
            let mut builder = ImageBuilder::new(image.grid, axis);
            builder.append(BandImage::of_empty_rays(image.window_rows(axis).start * columns, no_windings))?;
            builders.push(builder);
        }
        self.by_jobs(
            solids,
            image,
            axes,
            |job| job.bring_back(),
            |band, part| {
                let i = axes.iter().position(|&axis| axis == band.axis).expect("bands lie along the axes");
                of_leaves[i] = sums_by_leaf(std::mem::take(&mut of_leaves[i]), part.of_leaves);
                Ok(builders[i].append(part.image)?)
            },
        )?;
        let unsound = |error: LdiError| {
            let adapter = self.device.adapter().name.clone();
            DeviceError::Unsound { adapter, reason: error.to_string() }
        };
        let finished = |((mut builder, &axis), of_leaves): ((ImageBuilder, &Axis), Vec<Windings>)| {
            let (columns, rows) = image.grid.image_size(axis);
            builder.append(BandImage::of_empty_rays((rows - image.window_rows(axis).end) * columns, no_windings))?;
            Ok(WithLeaves { result: builder.finish_checked().map_err(unsound)?, of_leaves })
        };
        builders.into_iter().zip(axes).zip(of_leaves).map(finished).collect()
    }

    /// Runs the jobs that make images along some axes, in the order of their rays along each axis, and passes the results of
    /// each band to `take`.
    fn by_jobs<T: IntoIterator>(
        &self,
        solids: &[&LatticeSolid],
        image: &Image,
        axes: &[Axis],
        run: impl Fn(&mut Job) -> Result<T, JobError>,
        take: impl FnMut(&Band, T::Item) -> Result<(), SampleError>,
    ) -> Result<(), SampleError> {
        let jobs = image.jobs(axes, image.way(self));
        self.run_jobs(solids, image, jobs, &Band::halves, run, take)
    }

    /// Runs jobs in their order. One that is too large for the device is divided: into its bands, and a band into halves.
    fn run_jobs<T: IntoIterator>(
        &self,
        solids: &[&LatticeSolid],
        image: &Image,
        mut jobs: Vec<Vec<Band>>,
        halves: &dyn Fn(&Band) -> Option<[Band; 2]>,
        run: impl Fn(&mut Job) -> Result<T, JobError>,
        mut take: impl FnMut(&Band, T::Item) -> Result<(), SampleError>,
    ) -> Result<(), SampleError> {
        let mut state = held(&self.state);
        let State { pool, residents } = &mut *state;
        let solids = self.resident(residents, solids)?;
        let Way { route, .. } = image.way(self);
        jobs.reverse();
        while let Some(bands) = jobs.pop() {
            let view = View::new(image, route, &bands);
            let mut job = Job { sampler: self, pool, solids: &solids, image, route, bands: &bands, view };
            let error = match run(&mut job) {
                Ok(parts) => {
                    bands.iter().zip(parts).try_for_each(|(band, part)| take(band, part))?;
                    continue;
                }
                Err(error) => error,
            };
            let smaller: Option<Vec<Band>> = match &bands[..] {
                [band] => halves(band).map(Vec::from),
                bands => Some(bands.to_vec()),
            };
            let Some(smaller) = smaller.filter(|_| error.has_way_out()) else { return Err(self.refused(error)) };
            if matches!(error, JobError::Device(_)) {
                pool.release();
                self.device.release_staging();
            }
            jobs.extend(smaller.into_iter().rev().map(|band| vec![band]));
        }
        Ok(())
    }

    /// Runs a function on the solids and the parameters of a combination. Returns `None`, with all memory of the device free, where
    /// there is no room for all leaves at once, or where rays have too many crossings for a software adapter.
    fn combined<T>(
        &self,
        combination: Combination,
        fill: FillRule,
        make: impl FnOnce(&[&LatticeSolid], &Image) -> Result<Vec<WithLeaves<T>>, SampleError>,
    ) -> Result<Option<Vec<Combined<T>>>, SampleError> {
        use DeviceError::{Inadequate, OutOfMemory, TooLarge};
        let solids: Vec<&LatticeSolid> = combination.leaves().iter().map(|&(solid, _)| solid).collect();
        if bytes_of_all(&solids, self.largest_binding()) > self.options.memory {
            return Ok(None);
        }
        let image = Image::of_combination(combination, &solids, fill)?;
        match make(&solids, &image) {
            Err(SampleError::Device(Inadequate { .. } | OutOfMemory { .. } | TooLarge { .. })) => {
                let mut state = held(&self.state);
                state.residents = Residents::default();
                state.pool.release();
                self.device.release_staging();
                Ok(None)
            }
            made => Ok(Some(made?.into_iter().map(|made| made.combined(&image)).collect())),
        }
    }

    /// Returns the error of a job that cannot be divided further.
    fn refused(&self, error: JobError) -> SampleError {
        match error {
            JobError::Device(error) => error.into(),
            JobError::TooLarge { what, bytes, limit } => self.device.too_large(what, bytes, limit).into(),
        }
    }

    /// Returns the solids in device memory.
    fn resident(
        &self,
        residents: &mut Residents,
        solids: &[&LatticeSolid],
    ) -> Result<Vec<Arc<ResidentSolid>>, DeviceError> {
        let resident =
            |solid: &&LatticeSolid| residents.get(&self.device, solid, self.largest_binding(), self.options.memory);
        solids.iter().map(resident).collect()
    }
}

/// Returns whether each of some axes is among them once.
fn are_different(axes: &[Axis]) -> bool {
    axes.iter().enumerate().all(|(i, axis)| !axes[..i].contains(axis))
}

/// A result, and the winding sums of the images of leaves, if it is that of a combination.
struct WithLeaves<T> {
    result: T,
    of_leaves: Vec<Windings>,
}

impl<T> WithLeaves<T> {
    fn map<U>(self, of: impl FnOnce(T) -> U) -> WithLeaves<U> {
        WithLeaves { result: of(self.result), of_leaves: self.of_leaves }
    }

    /// Returns the result with the winding sums of those leaves that have any.
    fn combined(self, image: &Image) -> Combined<T> {
        // Without rays in the windows nothing was summed.
        let sums = self.of_leaves.into_iter().chain(std::iter::repeat(Windings::default()));
        let windings = image.parts.iter().zip(sums).map(|(part, sums)| part.counts_windings.then_some(sums));
        Combined { windings: windings.collect(), result: self.result }
    }
}

/// Returns the results alone.
fn results<T>(made: Vec<WithLeaves<T>>) -> Vec<T> {
    made.into_iter().map(|made| made.result).collect()
}

/// Returns the sums for volumes alone.
fn volumes(made: Vec<WithLeaves<SolidSums>>) -> Vec<VolumeSums> {
    made.into_iter().map(|made| made.result.volume).collect()
}

/// Returns the only one of some results, of one axis.
fn only<T>(made: Vec<T>) -> T {
    made.into_iter().next().expect("one axis gives one result")
}

impl Sampler for GpuSampler {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Ldi, SampleError> {
        Ok(only(self.sample_along(solid, &[axis], mode, fill)?))
    }

    fn sample_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<Ldi>, SampleError> {
        Ok(results(self.images(&[solid], &Image::of_one(solid, mode, fill)?, axes)?))
    }

    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: FillRule) -> Result<Ldi, SampleError> {
        Ok(only(self.images(&[solid], &Image::of_surface(solid, fill)?, &[axis])?).result)
    }

    fn volume_sums(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        mode: Mode,
        fill: FillRule,
    ) -> Result<VolumeSums, SampleError> {
        Ok(only(self.volume_sums_along(solid, &[axis], mode, fill)?))
    }

    fn volume_sums_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<VolumeSums>, SampleError> {
        Ok(volumes(self.sums(&[solid], &Image::of_one(solid, mode, fill)?, axes)?))
    }

    fn solid_sums_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<SolidSums>, SampleError> {
        Ok(results(self.sums(&[solid], &Image::of_moments(solid, mode, fill)?, axes)?))
    }

    fn sample_combination(
        &self,
        combination: Combination,
        axis: Axis,
        fill: FillRule,
    ) -> Result<Option<Combined<Ldi>>, SampleError> {
        let made = self.combined(combination, fill, |solids, image| self.images(solids, image, &[axis]))?;
        Ok(made.map(only))
    }

    fn combination_sums_along(
        &self,
        combination: Combination,
        axes: &[Axis],
        fill: FillRule,
    ) -> Result<Option<Vec<Combined<VolumeSums>>>, SampleError> {
        self.combined(combination, fill, |solids, image| {
            let sums = self.sums(solids, image, axes)?;
            Ok(sums.into_iter().map(|sums| sums.map(|sums| sums.volume)).collect())
        })
    }
}

impl MaskIntersection for GpuSampler {
    fn sample_intersection(
        &self,
        [a, b]: [&LatticeSolid; 2],
        axis: Axis,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Ldi, SampleError> {
        Ok(only(self.images(&[a, b], &Image::of_two(a, b, estimate, fill)?, &[axis])?).result)
    }

    fn intersection_sums_along(
        &self,
        [a, b]: [&LatticeSolid; 2],
        axes: &[Axis],
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Vec<VolumeSums>, SampleError> {
        Ok(volumes(self.sums(&[a, b], &Image::of_two(a, b, estimate, fill)?, axes)?))
    }
}
