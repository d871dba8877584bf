//! The GPU sampler: compute shaders that return the same bits as the CPU sampler.
//!
//! # Three routes
//! **Masks**, the paper's method, for estimates under the even-odd rule: `masks` (the first geometry pass) → `classify` →
//! `scan` → `identities` → `retrieve` (the second). **Lists**, for everything: `count` (the first geometry pass) → `scan` →
//! `scatter` (the second) → `sort` (and `merge`, where rays have many) → `resolve`, of two solids `meet` → `scan` →
//! `compact`; of triangles that bound nothing by themselves `gaps` → `scan` → `offsets` and `keep`, in place of those.
//! **Tiles**, for even-odd estimates of one solid: `bin` (the triangles of each tile of rays: counted, `scan`, listed)
//! → `tiles` (masks, classes and retrieval in the memory of a workgroup) → `scan` → `compact`. The number of passes
//! over the geometry does not depend on the number of layers, and between them the host reads only the numbers of
//! samples, crossings or triangles of tiles. The stages are WGSL files in `shaders/`, named like their counterparts in
//! [`super::cpu`].
//!
//! # Choice of the route
//! Unknown: it has not been measured on a GPU. `ldi-bench gpu` times all three; the slower ones are to be removed.
//! Calculated for three directions at 512², masks move 101 to 708 MB on six models of the paper's kinds, lists 54 to
//! 303 and tiles 73 to 283; at 1024² tiles move the least where triangles are larger than a pixel (279 MB against 435
//! and 2341). On a software adapter lists were first at 512², masks two to three times as slow. So lists are the
//! default: they are needed for exact images, the non-zero rule and intersections in any case, compute each depth once
//! where masks do twice, and require no more of a workgroup than every adapter has.
//!
//! # Bands
//! An image is made in bands of rays, each as large as the adapter's largest binding and the memory budget allow. A
//! band whose crossings need a larger buffer than that is halved and made again, so that any image that fits the host
//! can be made on any adapter, down to one ray at a time.
//!
//! # Exactness
//! Integers of 64 and 96 bits decide depths and coverage (`shaders/fixed.wgsl`); floating point only guesses. Sums and
//! masks use operations whose order does not matter, and lists are sorted.

mod band;
mod gaps;
mod image;
mod lists;
mod masks;
mod passes;
mod solid;
mod stages;
mod tiles;
mod view;
mod volume_sums;

use std::sync::{Arc, Mutex};

use super::stages::{ListStages, MaskStages};
use super::{Estimate, FillRule, MaskIntersection, Mode, SampleError, Sampler};
use crate::gpu::{Adapter, Device, DeviceError, Pool};
use crate::grid::{Axis, LatticeSolid};
use crate::ldi::{Ldi, VolumeSums};
use image::Image;
use solid::{ResidentSolid, Residents};
use stages::Kernels;

pub use stages::Arithmetic;

/// The method for estimates under the even-odd rule. The other rule, and exact images, always use lists, and so does
/// everything that a route has no room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// By bit masks and min/max retrieval.
    Masks,
    /// By sorted lists of crossings.
    Lists,
    /// By masks of tiles of rays that stay in the memory of a workgroup. Supports one solid of LOD-C 1024 at most,
    /// whose geometry fits one binding.
    Tiles,
}

/// The options of a GPU sampler. None of them changes a bit of any image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuOptions {
    /// Native by default where the adapter has 64-bit integers, except on DirectX 12.
    pub arithmetic: Option<Arithmetic>,
    /// The method for even-odd estimates.
    pub route: Route,
    /// Bytes of device memory for the lists or masks of a band together, and for solids. Counts and offsets of its rays
    /// take more, and data that is read back takes twice its size.
    pub memory: u64,
    /// Largest number of rays of a band.
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
        let device = Arc::new(Device::open(adapter, stages::needs())?);
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
            [a, b] => Image::of_two(a, b, axis, estimate, FillRule::EvenOdd)?,
            _ => Image::of_one(solids[0], axis, Mode::Estimate(estimate), FillRule::EvenOdd)?,
        };
        self.in_one_band(solids, &image, |job| job.mask_stages())
    }

    /// Returns the buffers between the stages of the route by lists.
    ///
    /// # Panics
    /// Panics if the image needs more than one band.
    pub fn list_stages(&self, solid: &LatticeSolid, axis: Axis) -> Result<ListStages, SampleError> {
        let image = Image::of_one(solid, axis, Mode::Exact, FillRule::EvenOdd)?;
        self.in_one_band(&[solid], &image, |job| job.list_stages())
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

impl Sampler for GpuSampler {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Ldi, SampleError> {
        self.image(&[solid], &Image::of_one(solid, axis, mode, fill)?)
    }

    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: FillRule) -> Result<Ldi, SampleError> {
        let image = Image::of_one(solid, axis, Mode::Exact, fill)?;
        self.image(&[solid], &Image { keeps_triangles: true, ..image })
    }

    fn volume_sums(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        mode: Mode,
        fill: FillRule,
    ) -> Result<VolumeSums, SampleError> {
        self.sums(&[solid], &Image::of_one(solid, axis, mode, fill)?)
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
        self.image(&[a, b], &Image::of_two(a, b, axis, estimate, fill)?)
    }

    fn intersection_sums(
        &self,
        [a, b]: [&LatticeSolid; 2],
        axis: Axis,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<VolumeSums, SampleError> {
        self.sums(&[a, b], &Image::of_two(a, b, axis, estimate, fill)?)
    }
}
