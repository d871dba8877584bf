//! The parameters of requested images, and how the rays of images are divided into jobs.

use super::band::{Band, cut};
use super::stages::{Flag, Flags};
use super::view::{FEW_LEAVES, MOST_BANDS, words};
use super::{GpuSampler, Route};
use crate::gpu::{WORKGROUP, bytes_of};
use crate::grid::{Axis, Closure, Grid, LatticeBox, LatticeSolid};
use crate::sampler::layout::Window;
use crate::sampler::lists::Keep;
use crate::sampler::{Combination, Estimate, FillRule, Mode, SampleError, admit, region_of_both};

/// The parameters of requested images of the same solids along several axes.
pub(super) struct Image {
    pub grid: Grid,
    pub fill: FillRule,
    pub result: Outcome,
    /// The solids, each with the part of it that matters.
    pub parts: Vec<Part>,
    windows: [Window; 3],
    pub keeps_triangles: bool,
    /// Lists keep the first and the last crossing of each ray.
    keeps_ends: bool,
    /// Every crossing is a sample, as every ray has an even number of them.
    pub is_dense: bool,
    /// The windows leave out part of a solid.
    pub is_restricted: bool,
    /// Moments are wanted where it is summed.
    pub has_moments: bool,
}

/// The way from the crossings of the solids to the image.
pub(super) enum Outcome {
    /// The image of the only solid.
    Own,
    /// The estimate of the intersection of two, voxel by voxel.
    Both,
    /// The combination of the images of all, by a table of all sets of few leaves, or the diagram of many, in words of the device.
    Combination(Vec<u32>),
}

/// A solid, its image and its window.
pub(super) struct Part {
    pub mode: Mode,
    /// The rays that can matter.
    pub windows: [Window; 3],
    /// The share of the rays through the solid that is in the windows.
    pub shares: [f64; 3],
    /// Windings are defined, and requested.
    pub counts_windings: bool,
}

impl Part {
    fn new(solid: &LatticeSolid, mode: Mode, region: &LatticeBox) -> Part {
        let grid = solid.grid();
        Part {
            mode,
            windows: Axis::ALL.map(|axis| Window::new(grid, region, axis)),
            shares: shares(grid, solid.bounds(), region),
            counts_windings: solid.closure().is_oriented(),
        }
    }
}

impl Image {
    /// Returns the parameters of images of one solid.
    pub fn of_one(solid: &LatticeSolid, mode: Mode, fill: FillRule) -> Result<Image, SampleError> {
        let grid = admit(&[solid], fill)?;
        Ok(Image {
            grid,
            fill,
            result: Outcome::Own,
            parts: vec![Part::new(solid, mode, solid.region())],
            windows: Axis::ALL.map(|axis| Window::new(&grid, solid.region(), axis)),
            keeps_triangles: false,
            keeps_ends: false,
            is_dense: mode == Mode::Exact && fill == FillRule::EvenOdd && solid.closure() != Closure::Open,
            is_restricted: solid.region().intersection(solid.bounds()) != *solid.bounds(),
            has_moments: false,
        })
    }

    /// Returns the parameters of images of one solid that are summed, also for moments.
    pub fn of_moments(solid: &LatticeSolid, mode: Mode, fill: FillRule) -> Result<Image, SampleError> {
        Ok(Image { has_moments: true, ..Image::of_one(solid, mode, fill)? })
    }

    /// Returns the parameters of exact images of one solid whose samples carry their triangles.
    pub fn of_surface(solid: &LatticeSolid, fill: FillRule) -> Result<Image, SampleError> {
        Ok(Image { keeps_triangles: true, ..Image::of_one(solid, Mode::Exact, fill)? })
    }

    /// Returns the parameters of reduced crossing lists, not images, of triangles that bound nothing by themselves.
    pub fn of_kept(triangles: &LatticeSolid, keep: Keep, keeps_triangles: bool) -> Result<Image, SampleError> {
        let image = Image::of_one(triangles, Mode::Exact, FillRule::EvenOdd)?;
        Ok(Image { keeps_triangles, keeps_ends: keep == Keep::GapsAndEnds, ..image })
    }

    /// Returns the parameters of estimates of the intersection of two solids.
    pub fn of_two(
        a: &LatticeSolid,
        b: &LatticeSolid,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Image, SampleError> {
        let grid = admit(&[a, b], fill)?;
        let region = region_of_both(a, b);
        Ok(Image {
            grid,
            fill,
            result: Outcome::Both,
            parts: [a, b].map(|solid| Part::new(solid, Mode::Estimate(estimate), &region)).into(),
            windows: Axis::ALL.map(|axis| Window::new(&grid, &region, axis)),
            keeps_triangles: false,
            keeps_ends: false,
            is_dense: false,
            is_restricted: true,
            has_moments: false,
        })
    }

    /// Returns the parameters of images of a combination of these solids.
    pub fn of_combination(
        combination: Combination,
        solids: &[&LatticeSolid],
        fill: FillRule,
    ) -> Result<Image, SampleError> {
        let grid = admit(solids, fill)?;
        let part = |&(solid, mode): &(&LatticeSolid, Mode)| Part::new(solid, mode, solid.region());
        let parts: Vec<Part> = combination.leaves().iter().map(part).collect();
        let around = |axis: Axis| {
            let windows = parts.iter().map(|part| part.windows[axis.depth()].clone());
            windows.reduce(Window::around).expect("there is a leaf")
        };
        Ok(Image {
            grid,
            fill,
            result: Outcome::Combination(match parts.len() {
                0..=FEW_LEAVES => combination.diagram().table(parts.len()),
                _ => combination.diagram().words(),
            }),
            windows: Axis::ALL.map(around),
            parts,
            keeps_triangles: false,
            keeps_ends: false,
            is_dense: false,
            is_restricted: true,
            has_moments: false,
        })
    }

    /// Returns whether the image comes with winding sums: that of one oriented solid does.
    pub fn counts_windings(&self) -> bool {
        matches!(self.result, Outcome::Own) && self.parts[0].counts_windings
    }

    /// Returns the number of images of leaves, each with its winding sums.
    pub fn leaves(&self) -> usize {
        match self.result {
            Outcome::Combination(_) => self.parts.len(),
            _ => 0,
        }
    }

    /// Returns the columns and rows along an axis whose rays can matter.
    pub fn window(&self, axis: Axis) -> &Window {
        &self.windows[axis.depth()]
    }

    /// Returns the rows of the window; all others are empty without sampling.
    pub fn window_rows(&self, axis: Axis) -> std::ops::Range<u32> {
        let (_, rows) = self.grid.image_size(axis);
        let window = self.window(axis);
        let first = window.rows.start.clamp(0, rows as i32);
        first as u32..window.rows.end.clamp(first, rows as i32) as u32
    }

    /// Returns the band of all rows of the window along an axis.
    pub fn whole(&self, axis: Axis) -> Band {
        Band::of_rows(axis, self.window_rows(axis), self.grid.image_size(axis).0)
    }

    /// Returns the flags of the variants of the stages that make the image of a part. Stages that look at all parts have no
    /// flags in which those differ.
    pub fn flags(&self, part: usize) -> Flags {
        let mode = self.parts[part].mode;
        Flags::of(&[
            (Flag::Over, mode == Mode::Estimate(Estimate::Over)),
            (Flag::Exact, mode == Mode::Exact),
            (Flag::NonZero, self.fill == FillRule::NonZero),
            (Flag::TwoSolids, self.parts.len() == 2),
            (Flag::KeepsTriangles, self.keeps_triangles),
            (Flag::KeepsEnds, self.keeps_ends),
            (Flag::ManyLeaves, self.leaves() > FEW_LEAVES),
        ])
    }

    /// Returns the route of the jobs and the most rays of one.
    pub fn way(&self, sampler: &GpuSampler) -> Way {
        let options = &sampler.options;
        // Each ray has a list for each leaf.
        let most_rays = (options.band_rays / self.leaves().max(1) as u32).max(1);
        let by_lists = Way { route: Route::Lists, most_rays };
        let has_masks = self.leaves() == 0 && self.parts[0].mode != Mode::Exact && self.fill == FillRule::EvenOdd;
        match options.route {
            Route::Masks if has_masks => self.by_masks(sampler).unwrap_or(by_lists),
            _ => by_lists,
        }
    }

    /// Returns the route by masks, or `None` where the masks of a single ray do not fit.
    fn by_masks(&self, sampler: &GpuSampler) -> Option<Way> {
        let options = &sampler.options;
        let mask = bytes_of(u64::from(words(&self.grid)));
        let masks = 1 + 2 * self.parts.len() as u64;
        // Rays fill whole workgroups; where fewer fit, a single one still takes the masks of a workgroup.
        let workgroup = u64::from(WORKGROUP);
        let whole = |rays: u64| if rays < workgroup { rays.min(1) } else { rays - rays % workgroup };
        let rays = whole((sampler.largest_binding() / mask).min(options.memory / (masks * mask)));
        let most_rays = rays.min(u64::from(options.band_rays)) as u32;
        (most_rays > 0).then_some(Way { route: Route::Masks, most_rays })
    }

    /// Returns the jobs that make the images along some axes, in the order of their rays: one for all axes where their rays fit
    /// together, else bands of each axis.
    pub fn jobs(&self, axes: &[Axis], way: Way) -> Vec<Vec<Band>> {
        let whole: Vec<Band> = axes.iter().map(|&axis| self.whole(axis)).filter(|band| band.rays() > 0).collect();
        let rays: u64 = whole.iter().map(|band| u64::from(band.rays()).next_multiple_of(WORKGROUP.into())).sum();
        let fits = whole.len() <= MOST_BANDS && rays <= u64::from(way.most_rays) && way.route == Route::Lists;
        if fits && !whole.is_empty() {
            return vec![whole];
        }
        let cut = |band: &Band| cut(band.axis, band.counted_rows(), band.columns().len() as u32, way.most_rays);
        whole.iter().flat_map(cut).map(|band| vec![band]).collect()
    }
}

/// Returns the shares of the rays through a box along the three axes that go through a region of it, too.
fn shares(grid: &Grid, bounds: &LatticeBox, region: &LatticeBox) -> [f64; 3] {
    let rays = |of: &LatticeBox, axis: Axis| {
        let window = Window::new(grid, of, axis);
        window.columns.len() as f64 * window.rows.len() as f64
    };
    let seen = region.intersection(bounds);
    Axis::ALL.map(|axis| rays(&seen, axis) / rays(bounds, axis).max(1.0))
}

/// A route, and the most rays of a job.
#[derive(Clone, Copy)]
pub(super) struct Way {
    pub route: Route,
    pub most_rays: u32,
}
