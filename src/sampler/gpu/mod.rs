//! The sampler for GPUs: compute shaders with the bits of the CPU's sampler.
//!
//! # Two routes
//! **Masks**, the paper's method, for estimates under the even-odd rule: `masks` (the first geometry pass) → `classify` →
//! `scan` → `identities` → `retrieve` (the second). **Lists**, for everything: `count` (the first geometry pass) → `scan` →
//! `scatter` (the second) → `sort` → `resolve`, of two solids `meet` → `scan` → `compact`. Either makes two passes over the
//! geometry whatever the number of layers, and the host learns nothing between them but how many samples or crossings there
//! are. The stages are WGSL files in `shaders/`, of the names of their twins in [`super::cpu`].
//!
//! # Bands
//! An image is made in bands of rays, each as large as the adapter's largest binding and the memory budget allow. A band
//! whose crossings turn out to need a larger buffer is halved and made again, so that any image that fits the host can be
//! made on any adapter, down to one ray at a time.
//!
//! # Where the bits come from
//! Depths and coverage are decided by integers of 64 and 96 bits (`shaders/fixed.wgsl`); floating point only guesses. Sums
//! and masks are of operations whose order does not matter, and lists are sorted.

mod band;
mod lists;
mod masks;
mod passes;
mod solid;
mod stages;
mod view;

use std::sync::{Arc, Mutex};

use super::layout::Window;
use super::stages::{ListStages, MaskStages};
use super::{Estimate, Fill, Mode, SampleError, Sampler, admit, region_of_both};
use crate::gpu::{Adapter, Device, DeviceError, Pool};
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::{BandImage, ImageBuilder, Ldi, Windings};
use band::Band;
use solid::{ResidentSolid, Residents};
pub use stages::Arithmetic;
use stages::{Flag, Flags, Kernels};

/// How estimates under the even-odd rule are made. The other rule, and exact images, always take the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Route {
    /// By bit masks and min/max retrieval.
    Masks,
    /// By sorted lists of crossings.
    Lists,
}

/// What may be chosen about a GPU sampler. Nothing of it changes a bit of any image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuOptions {
    /// Native by default where the adapter has 64-bit integers.
    pub arithmetic: Option<Arithmetic>,
    /// The way to even-odd estimates.
    pub route: Route,
    /// Bytes of device memory that buffers of a band may take together, and that solids may.
    pub memory: u64,
    /// The most rays of a band.
    pub band_rays: u32,
    /// The most bytes of one binding; the adapter's own limit holds besides.
    pub binding: u64,
    /// Fills every buffer of a band with this word before it is used, so that what no stage writes shows. For tests.
    pub prefill: Option<u32>,
}

impl Default for GpuOptions {
    fn default() -> GpuOptions {
        GpuOptions {
            arithmetic: None,
            route: Route::Masks,
            memory: 1 << 30,
            band_rays: 1 << 24,
            binding: 1 << 30,
            prefill: None,
        }
    }
}

/// Samples on one GPU. Calls from several threads take turns.
pub struct GpuSampler {
    device: Device,
    options: GpuOptions,
    kernels: Kernels,
    state: Mutex<State>,
}

/// What is kept from call to call.
struct State {
    pool: Pool,
    residents: Residents,
}

impl GpuSampler {
    /// Opens an adapter.
    pub fn open(adapter: &Adapter, options: GpuOptions) -> Result<GpuSampler, DeviceError> {
        let device = Device::open(adapter)?;
        let arithmetic = options.arithmetic.unwrap_or(match adapter.int64 {
            true => Arithmetic::Native,
            false => Arithmetic::Pairs,
        });
        let state = State { pool: Pool::new(options.prefill), residents: Residents::default() };
        Ok(GpuSampler { device, options, kernels: Kernels::new(arithmetic), state: Mutex::new(state) })
    }

    /// The device, to ask it for its name or for the times of its stages.
    pub fn device(&self) -> &Device {
        &self.device
    }

    fn largest_binding(&self) -> u64 {
        self.device.largest_binding().min(self.options.binding)
    }

    /// The buffers between the stages of the route by masks, for one solid or the intersection of two.
    ///
    /// # Panics
    /// If the image needs more than one band.
    pub fn mask_stages(
        &self,
        solids: &[&LatticeSolid],
        axis: Axis,
        estimate: Estimate,
    ) -> Result<MaskStages, SampleError> {
        self.in_one_band(solids, axis, Mode::Estimate(estimate), |job| job.mask_stages())
    }

    /// The buffers between the stages of the route by lists.
    ///
    /// # Panics
    /// If the image needs more than one band.
    pub fn list_stages(&self, solid: &LatticeSolid, axis: Axis) -> Result<ListStages, SampleError> {
        let stages = self.in_one_band(&[solid], axis, Mode::Exact, |job| job.list_stages())?;
        Ok(stages.expect("the crossings fit one band"))
    }

    fn in_one_band<T>(
        &self,
        solids: &[&LatticeSolid],
        axis: Axis,
        mode: Mode,
        run: impl FnOnce(&mut BandJob) -> Result<T, DeviceError>,
    ) -> Result<T, SampleError> {
        let grid = admit(solids, Fill::EvenOdd)?;
        let region = match solids {
            [a, b] => region_of_both(a, b),
            _ => *solids[0].region(),
        };
        let image = Image {
            axis,
            mode,
            fill: Fill::EvenOdd,
            window: Window::new(&grid, &region, axis),
            keeps_triangles: false,
            counts_windings: false,
            solids: solids.len(),
        };
        let (columns, rows) = grid.image_size(axis);
        let most = image.most_rays(self, &grid).unwrap_or(self.options.band_rays);
        assert!(columns * rows <= most, "{columns} × {rows} rays in bands of {most}");
        let mut state = self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let resident = self.resident(&mut state.residents, solids)?;
        let band = Band::of_rows(0..rows, columns);
        let pool = &mut state.pool;
        Ok(run(&mut BandJob { sampler: self, pool, solids: &resident, grid, image: &image, band })?)
    }

    /// The solids in device memory.
    fn resident(
        &self,
        residents: &mut Residents,
        solids: &[&LatticeSolid],
    ) -> Result<Vec<Arc<ResidentSolid>>, DeviceError> {
        let resident =
            |solid: &&LatticeSolid| residents.get(&self.device, solid, self.largest_binding(), self.options.memory);
        solids.iter().map(resident).collect()
    }

    /// Makes an image band by band, by either route.
    fn image(&self, solids: &[&LatticeSolid], image: Image) -> Result<Ldi, SampleError> {
        let grid = *solids[0].grid();
        let mut state = self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let State { pool, residents } = &mut *state;
        let resident = self.resident(residents, solids)?;
        let (columns, rows) = grid.image_size(image.axis);
        let mut builder = ImageBuilder::new(grid, image.axis);
        // Rows that the window leaves out are empty without a look at them.
        let first = image.window.rows.start.clamp(0, rows as i32) as u32;
        let end = image.window.rows.end.clamp(first as i32, rows as i32) as u32;
        let none = image.counts_windings.then(Windings::default);
        builder.append(BandImage::of_empty_rays(first * columns, none))?;
        let most_rays = image.most_rays(self, &grid);
        let mut bands = band::cut(first..end, columns, most_rays.unwrap_or(self.options.band_rays));
        let by_masks = most_rays.is_some();
        bands.reverse();
        while let Some(band) = bands.pop() {
            let mut job = BandJob { sampler: self, pool: &mut *pool, solids: &resident, grid, image: &image, band };
            let made = if by_masks { job.by_masks()? } else { job.by_lists()? };
            match (made, band.halves()) {
                (Made::Band(part), _) => builder.append(part)?,
                (Made::TooLarge { .. }, Some([first, second])) => bands.extend([second, first]),
                (Made::TooLarge { what, bytes }, None) => {
                    return Err(self.device.too_large(what, bytes, self.largest_binding()).into());
                }
            }
        }
        builder.append(BandImage::of_empty_rays((rows - end) * columns, none))?;
        Ok(builder.finish())
    }
}

/// What image is asked for.
struct Image {
    axis: Axis,
    mode: Mode,
    fill: Fill,
    window: Window,
    keeps_triangles: bool,
    /// Windings are sound, and wanted.
    counts_windings: bool,
    solids: usize,
}

impl Image {
    fn flags(&self) -> Flags {
        Flags::of(&[
            (Flag::Over, self.mode == Mode::Estimate(Estimate::Over)),
            (Flag::Exact, self.mode == Mode::Exact),
            (Flag::NonZero, self.fill == Fill::NonZero),
            (Flag::TwoSolids, self.solids == 2),
            (Flag::KeepsTriangles, self.keeps_triangles),
        ])
    }

    /// The most rays of a band by masks; nothing where lists are to be used, as masks do not serve or would not fit.
    fn most_rays(&self, sampler: &GpuSampler, grid: &Grid) -> Option<u32> {
        if self.mode == Mode::Exact || self.fill == Fill::NonZero || sampler.options.route == Route::Lists {
            return None;
        }
        let mask = 4 * u64::from(view::words(grid));
        let masks = 1 + 2 * self.solids as u64;
        let rays = (sampler.largest_binding() / mask).min(sampler.options.memory / (masks * mask));
        (rays > 0).then(|| rays.min(u64::from(sampler.options.band_rays)) as u32)
    }
}

/// One band of an image.
struct BandJob<'a> {
    sampler: &'a GpuSampler,
    pool: &'a mut Pool,
    solids: &'a [Arc<ResidentSolid>],
    grid: Grid,
    image: &'a Image,
    band: Band,
}

/// What came of a band.
enum Made {
    Band(BandImage),
    /// A buffer would be larger than allowed.
    TooLarge {
        what: &'static str,
        bytes: u64,
    },
}

impl Sampler for GpuSampler {
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: Fill) -> Result<Ldi, SampleError> {
        let grid = admit(&[solid], fill)?;
        let image = Image {
            axis,
            mode,
            fill,
            window: Window::new(&grid, solid.region(), axis),
            keeps_triangles: false,
            counts_windings: solid.closure().is_oriented(),
            solids: 1,
        };
        self.image(&[solid], image)
    }

    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: Fill) -> Result<Ldi, SampleError> {
        let grid = admit(&[solid], fill)?;
        let image = Image {
            axis,
            mode: Mode::Exact,
            fill,
            window: Window::new(&grid, solid.region(), axis),
            keeps_triangles: true,
            counts_windings: solid.closure().is_oriented(),
            solids: 1,
        };
        self.image(&[solid], image)
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
        let image = Image {
            axis,
            mode: Mode::Estimate(estimate),
            fill,
            window: Window::new(&grid, &region_of_both(a, b), axis),
            keeps_triangles: false,
            counts_windings: false,
            solids: 2,
        };
        self.image(&[a, b], image)
    }
}
