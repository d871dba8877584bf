//! Images, assembled band by band.

use std::sync::Arc;

use super::band::{Band, cut};
use super::solid::ResidentSolid;
use super::stages::{Flag, Flags};
use super::view::{TALLY_WORDS, TILE_MEMORY, TILE_SIDE, TILE_WORDS, Tally, most_rows, wide, words};
use super::{GpuSampler, Route, State};
use crate::gpu::{DeviceError, Pool, Recorder, bytes_of, held};
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::{BandImage, ImageBuilder, Ldi, LdiError, Windings};
use crate::sampler::layout::Window;
use crate::sampler::lists::Keep;
use crate::sampler::stages::UNCLOSED;
use crate::sampler::{Estimate, FillRule, Mode, SampleError, admit, region_of_both};

/// The parameters of a requested image.
pub(super) struct Image {
    pub grid: Grid,
    pub axis: Axis,
    pub mode: Mode,
    pub fill: FillRule,
    pub window: Window,
    pub keeps_triangles: bool,
    /// Lists keep the first and the last crossing of each ray.
    pub keeps_ends: bool,
    /// Windings are defined, and requested.
    pub counts_windings: bool,
    pub solids: usize,
    /// The largest number of triangles of a solid.
    pub triangles: usize,
}

impl Image {
    /// Returns the parameters of an image of one solid.
    pub fn of_one(solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Image, SampleError> {
        let grid = admit(&[solid], fill)?;
        Ok(Image {
            grid,
            axis,
            mode,
            fill,
            window: Window::new(&grid, solid.region(), axis),
            keeps_triangles: false,
            keeps_ends: false,
            counts_windings: solid.closure().is_oriented(),
            solids: 1,
            triangles: solid.triangles().len(),
        })
    }

    /// Returns the parameters of reduced crossing lists, not an image, of triangles that bound nothing by themselves.
    pub fn of_kept(
        triangles: &LatticeSolid,
        axis: Axis,
        keep: Keep,
        keeps_triangles: bool,
    ) -> Result<Image, SampleError> {
        let image = Image::of_one(triangles, axis, Mode::Exact, FillRule::EvenOdd)?;
        Ok(Image { keeps_triangles, keeps_ends: keep == Keep::GapsAndEnds, ..image })
    }

    /// Returns the parameters of an estimate of the intersection of two solids.
    pub fn of_two(
        a: &LatticeSolid,
        b: &LatticeSolid,
        axis: Axis,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Image, SampleError> {
        let grid = admit(&[a, b], fill)?;
        Ok(Image {
            grid,
            axis,
            mode: Mode::Estimate(estimate),
            fill,
            window: Window::new(&grid, &region_of_both(a, b), axis),
            keeps_triangles: false,
            keeps_ends: false,
            counts_windings: false,
            solids: 2,
            triangles: a.triangles().len().max(b.triangles().len()),
        })
    }

    /// Returns the flags of the variants of the stages that make it.
    pub fn flags(&self) -> Flags {
        Flags::of(&[
            (Flag::Over, self.mode == Mode::Estimate(Estimate::Over)),
            (Flag::Exact, self.mode == Mode::Exact),
            (Flag::NonZero, self.fill == FillRule::NonZero),
            (Flag::TwoSolids, self.solids == 2),
            (Flag::KeepsTriangles, self.keeps_triangles),
            (Flag::KeepsEnds, self.keeps_ends),
        ])
    }

    /// Returns the route of the bands and their largest size.
    pub fn way(&self, sampler: &GpuSampler) -> Way {
        let options = &sampler.options;
        let by_lists = Way { route: Route::Lists, most_rays: self.band_rays(sampler) };
        if self.mode == Mode::Exact || self.fill == FillRule::NonZero {
            return by_lists;
        }
        match options.route {
            Route::Masks => self.by_masks(sampler).unwrap_or(by_lists),
            Route::Lists => by_lists,
            Route::Tiles => self.by_tiles(sampler).unwrap_or(by_lists),
        }
    }

    /// Returns the route by masks, or `None` where the masks of a single ray do not fit.
    fn by_masks(&self, sampler: &GpuSampler) -> Option<Way> {
        let options = &sampler.options;
        let mask = bytes_of(u64::from(words(&self.grid)));
        let masks = 1 + 2 * self.solids as u64;
        let rays = (sampler.largest_binding() / mask).min(options.memory / (masks * mask));
        let most_rays = rays.min(u64::from(self.band_rays(sampler))) as u32;
        (most_rays > 0).then_some(Way { route: Route::Masks, most_rays })
    }

    /// Returns the route by tiles, or `None` for two solids, or where a tile's masks do not fit the memory of a
    /// workgroup.
    fn by_tiles(&self, sampler: &GpuSampler) -> Option<Way> {
        let fits = words(&self.grid) <= TILE_WORDS
            && sampler.device.adapter().limits.workgroup_memory >= TILE_MEMORY
            && self.solids == 1;
        let (columns, _) = self.grid.image_size(self.axis);
        // Bands of whole tiles, where they have room for one.
        let band_rays = self.band_rays(sampler);
        let most_rays = match band_rays / (TILE_SIDE * columns) {
            0 => band_rays,
            tiles_down => tiles_down * TILE_SIDE * columns,
        };
        fits.then_some(Way { route: Route::Tiles, most_rays })
    }

    /// Returns the largest number of rays of a band by any route: the option, limited so that the blocks of large
    /// triangles can be counted.
    fn band_rays(&self, sampler: &GpuSampler) -> u32 {
        let (columns, _) = self.grid.image_size(self.axis);
        sampler.options.band_rays.min(most_rows(self.triangles as u64).saturating_mul(columns))
    }

    /// Returns the rows of the window; all others are empty without sampling.
    pub fn window_rows(&self) -> std::ops::Range<u32> {
        let (_, rows) = self.grid.image_size(self.axis);
        let first = self.window.rows.start.clamp(0, rows as i32);
        first as u32..self.window.rows.end.clamp(first, rows as i32) as u32
    }
}

/// A route, and the largest number of rays of its bands.
#[derive(Clone, Copy)]
pub(super) struct Way {
    pub route: Route,
    pub most_rays: u32,
}

/// One band of an image.
pub(super) struct BandJob<'a> {
    pub sampler: &'a GpuSampler,
    pub pool: &'a mut Pool,
    pub solids: &'a [Arc<ResidentSolid>],
    pub image: &'a Image,
    pub route: Route,
    pub band: Band,
}

/// The reason why a band could not be made.
pub(super) enum BandError {
    Device(DeviceError),
    /// A buffer would take more bytes than allowed; a smaller band needs less.
    TooLarge {
        what: &'static str,
        bytes: u64,
        limit: u64,
    },
}

impl From<DeviceError> for BandError {
    fn from(error: DeviceError) -> BandError {
        BandError::Device(error)
    }
}

/// A band's image on the device, valid as soon as the recorded commands have run.
pub(super) struct MadeBand<'d> {
    pub recorder: Recorder<'d>,
    /// Number of samples of each ray, or the mark of an unclosed one.
    pub counts: wgpu::Buffer,
    pub offsets: wgpu::Buffer,
    pub samples: wgpu::Buffer,
    pub triangles: Option<wgpu::Buffer>,
    pub tally: wgpu::Buffer,
    /// An upper bound of the number of samples.
    pub most_samples: u64,
}

impl Tally {
    /// Returns the winding sums.
    pub fn windings(&self) -> Windings {
        Windings {
            wound: wide(self.wound_low, self.wound_high),
            aligned: wide(self.aligned_low, self.aligned_high),
            changes: i64::from(self.changes),
            unpaired: wide(self.unpaired_low, self.unpaired_high),
        }
    }
}

impl<'a> BandJob<'a> {
    /// Makes the band on the device.
    pub fn make(&mut self) -> Result<MadeBand<'a>, BandError> {
        match self.route {
            Route::Masks => self.make_by_masks(),
            Route::Lists => self.make_by_lists(),
            Route::Tiles => self.make_by_tiles(),
        }
    }

    /// Makes the band and reads it back.
    fn bring_back(&mut self) -> Result<BandImage, BandError> {
        let MadeBand { mut recorder, counts, offsets, samples, triangles, tally, most_samples } = self.make()?;
        let rays = u64::from(self.band.rays());
        recorder.read_back(&offsets, 0, bytes_of(rays + 1));
        recorder.read_back(&samples, 0, bytes_of(most_samples));
        recorder.read_back(&tally, 0, bytes_of(TALLY_WORDS));
        if let Some(triangles) = &triangles {
            recorder.read_back(triangles, 0, bytes_of(most_samples));
        }
        let mut brought = recorder.finish()?.into_iter();
        let mut next = || brought.next().unwrap_or_default();
        let (mut ends, depths, tally, mut triangles) = (next(), next(), next(), next());
        let total = ends[ends.len() - 1] as usize;
        ends.remove(0);
        triangles.truncate(total);
        let mut depths: Vec<i32> = bytemuck::cast_vec(depths);
        depths.truncate(total);
        let tally: Tally = bytemuck::cast_slice(&tally)[0];
        let unclosed = if tally.unclosed == 0 { Vec::new() } else { self.unclosed_rays(&counts)? };
        let windings = self.image.counts_windings.then(|| tally.windings());
        Ok(BandImage::from_parts(ends, depths, triangles, windings, unclosed))
    }

    fn unclosed_rays(&self, counts: &wgpu::Buffer) -> Result<Vec<u32>, DeviceError> {
        let mut recorder = Recorder::new(&self.sampler.device);
        recorder.read_back(counts, 0, bytes_of(u64::from(self.band.rays())));
        let counts = recorder.finish()?;
        let unclosed = |(ray, count): (usize, &u32)| (*count == UNCLOSED).then_some(ray as u32);
        Ok(counts[0].iter().enumerate().filter_map(unclosed).collect())
    }
}

impl GpuSampler {
    /// Makes an image.
    pub(super) fn image(&self, solids: &[&LatticeSolid], image: &Image) -> Result<Ldi, SampleError> {
        let mut state = held(&self.state);
        let State { pool, residents } = &mut *state;
        let solids = self.resident(residents, solids)?;
        let (columns, rows) = image.grid.image_size(image.axis);
        let looked_at = image.window_rows();
        let no_windings = image.counts_windings.then(Windings::default);
        let mut builder = ImageBuilder::new(image.grid, image.axis);
        builder.append(BandImage::of_empty_rays(looked_at.start * columns, no_windings))?;
        let Way { route, most_rays } = image.way(self);
        let mut bands = cut(looked_at.clone(), columns, most_rays);
        bands.reverse();
        while let Some(band) = bands.pop() {
            let mut job = BandJob { sampler: self, pool, solids: &solids, image, route, band };
            match (job.bring_back(), band.halves()) {
                (Ok(part), _) => builder.append(part)?,
                (Err(BandError::Device(error)), _) => return Err(error.into()),
                (Err(BandError::TooLarge { .. }), Some([first, second])) => bands.extend([second, first]),
                (Err(BandError::TooLarge { what, bytes, limit }), None) => {
                    return Err(self.device.too_large(what, bytes, limit).into());
                }
            }
        }
        builder.append(BandImage::of_empty_rays((rows - looked_at.end) * columns, no_windings))?;
        let adapter = || self.device.adapter().name.clone();
        let unsound = |error: LdiError| DeviceError::Unsound { adapter: adapter(), reason: error.to_string() };
        Ok(builder.finish_checked().map_err(unsound)?)
    }

    /// Runs a function on the whole image as one band.
    ///
    /// # Panics
    /// Panics if the image is too large for one.
    pub(super) fn in_one_band<T>(
        &self,
        solids: &[&LatticeSolid],
        image: &Image,
        run: impl FnOnce(&mut BandJob) -> Result<T, BandError>,
    ) -> Result<T, SampleError> {
        let (columns, rows) = image.grid.image_size(image.axis);
        let Way { route, most_rays } = image.way(self);
        assert!(columns * rows <= most_rays, "{columns} × {rows} rays in bands of {most_rays}");
        let mut state = held(&self.state);
        let State { pool, residents } = &mut *state;
        let solids = self.resident(residents, solids)?;
        let band = Band::of_rows(0..rows, columns);
        match run(&mut BandJob { sampler: self, pool, solids: &solids, image, route, band }) {
            Ok(result) => Ok(result),
            Err(BandError::Device(error)) => Err(error.into()),
            Err(BandError::TooLarge { what, bytes, limit }) => Err(self.device.too_large(what, bytes, limit).into()),
        }
    }
}
