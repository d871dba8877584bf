//! Finer images around groups of cells.

use std::ops::Range;

use glam::DVec3;

use super::super::border::Scale;
use super::groups::Group;
use crate::cancel::checkpoint;
use crate::grid::{Axis, Grid, GridError, LatticeBox, LatticeSolid};
use crate::ldi::Ldi;

/// Rays to be sampled, beside one another 2^levels times closer together than those of a grid.
pub struct FineRays {
    /// The axis along which they run.
    pub axis: Axis,
    /// How often the pitch is halved.
    pub levels: u32,
    /// The columns of the refined grid that the image has.
    pub columns: Range<u32>,
    /// The rows that are needed.
    pub rows: Range<u32>,
}

impl FineRays {
    /// Returns a solid of the coarse grid for its image along the axis.
    ///
    /// # Errors
    /// Fails where the grid cannot be refined.
    pub fn solid<'s>(&self, solid: &'s LatticeSolid) -> Result<LatticeSolid<'s>, GridError> {
        let fine = solid.refined(self.levels, self.axis, &self.columns)?;
        let grid = *fine.grid();
        let mut region = LatticeBox { min: [0; 3], max: [0, 1, 2].map(|i| grid.length(i)) };
        let row = self.axis.row();
        region.min[row] = (self.rows.start << grid.shift()) as i32;
        region.max[row] = (self.rows.end << grid.shift()) as i32;
        Ok(fine.within(&region))
    }
}

/// The finer images around a group.
pub struct Window {
    pub scale: Scale,
    grid: Grid,
    /// Pixels of the refined grid, along x, y and z.
    pixels: Pixels,
    /// The numbers of pixels of that grid.
    all: [u32; 3],
}

impl Window {
    /// Returns the window of a group at some levels; `None` where no grid is that fine, or the window would be too large.
    pub fn around(group: &Group, grid: &Grid, levels: u32) -> Option<Window> {
        let fine = grid.refined(levels).ok()?;
        let half = 1 << (levels - 1);
        // Of the nodes of x and y, as of cells, 1 is the first of the grid.
        let first = half + 1 - (1 << levels);
        let whole = Scale { levels, offset: [first, first, half] };
        let all = || group.cells.iter().chain(&group.beside);
        let pixels: [Range<u32>; 3] = std::array::from_fn(|i| {
            let [least, greatest] = [all().map(|c| c[i]).min().unwrap_or(0), all().map(|c| c[i]).max().unwrap_or(0)];
            let index = |at: i32| {
                let mut cell = [0; 3];
                cell[i] = at;
                i64::from(whole.fine(cell)[i] - i32::from(i < 2))
            };
            let last = i64::from(fine.rays()[i]);
            let start = (index(least) - 1).clamp(0, last - 1);
            start as u32..(index(greatest + 1) + 2).clamp(start + 1, last) as u32
        });
        let offset = std::array::from_fn(|i| whole.offset[i] - pixels[i].start as i32);
        let starts = DVec3::from_array(pixels.each_ref().map(|range| f64::from(range.start)));
        let rays = pixels.each_ref().map(|range| range.end - range.start);
        let origin = fine.origin() + fine.pitch() * starts;
        let grid = Grid::from_parts(origin, fine.pitch(), rays, fine.shift(), fine.lod()).ok()?;
        let [x, y, z] = rays.map(u64::from);
        let is_small = fits(&pixels, fine.rays()) && x * y * z / 64 <= MOST_WORDS;
        is_small.then_some(Window { scale: Scale { levels, offset }, grid, pixels, all: fine.rays() })
    }
}

/// A box of pixels.
type Pixels = [Range<u32>; 3];

/// Most rays of an image along one axis, with the empty rows beside those that are needed.
const MOST_RAYS: u64 = 1 << 24;

/// Most words of the nodes of a window.
const MOST_WORDS: u64 = 1 << 22;

/// Returns whether the images of a box of pixels, which have all rows of the grid, have few enough rays.
fn fits(pixels: &Pixels, all: [u32; 3]) -> bool {
    Axis::ALL.into_iter().all(|axis| pixels[axis.column()].len() as u64 * u64::from(all[axis.row()]) <= MOST_RAYS)
}

/// Windows whose images are made together: those of the box around them.
pub struct Batch {
    /// Their numbers.
    pub windows: Vec<usize>,
    pixels: Pixels,
    levels: u32,
}

impl Batch {
    /// Shares out windows at some levels, so that little is sampled: an image takes as much time as `rays_of_image` more rays.
    pub fn of(windows: &[Window], rays_of_image: u64) -> Vec<Batch> {
        let mut batches = Vec::new();
        if !windows.is_empty() {
            share_out(windows, (0..windows.len()).collect(), rays_of_image, &mut batches);
        }
        batches
    }

    /// Returns the number of its rays along all axes.
    pub fn rays(&self) -> u64 {
        rays(&self.pixels).iter().sum()
    }

    /// Has the images made.
    pub fn images<E>(&self, sample: &mut impl FnMut(&FineRays) -> Result<Ldi, E>) -> Result<[Ldi; 3], E> {
        let mut along = |axis: Axis| {
            checkpoint();
            let [columns, rows] = [axis.column(), axis.row()].map(|i| self.pixels[i].clone());
            sample(&FineRays { axis, levels: self.levels, columns, rows })
        };
        Ok([along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?])
    }

    /// Returns the part of the images in a window.
    pub fn of_window(&self, images: &[Ldi; 3], window: &Window) -> [Ldi; 3] {
        let along = |image: &Ldi| {
            let (mut pixels, across) = (window.pixels.clone(), image.axis().column());
            let first = self.pixels[across].start;
            pixels[across] = pixels[across].start - first..pixels[across].end - first;
            image.window(window.grid, &pixels)
        };
        images.each_ref().map(along)
    }
}

/// Returns the rays through a box of pixels along the three axes.
fn rays([x, y, z]: &Pixels) -> [u64; 3] {
    let [x, y, z] = [x, y, z].map(|range| u64::from(range.end - range.start));
    [y * z, z * x, x * y]
}

/// Divides windows in two where that takes less time than their images together, and so on. Returns the cost.
fn share_out(windows: &[Window], mut some: Vec<usize>, rays_of_image: u64, batches: &mut Vec<Batch>) -> u64 {
    let hull = |some: &[usize]| -> Pixels {
        std::array::from_fn(|i| {
            let ranges = || some.iter().map(|&window| &windows[window].pixels[i]);
            ranges().map(|range| range.start).min().unwrap_or(0)..ranges().map(|range| range.end).max().unwrap_or(0)
        })
    };
    let pixels = hull(&some);
    let rays = rays(&pixels);
    let together = rays.iter().sum::<u64>() + 3 * rays_of_image;
    let (first, levels) = (batches.len(), windows[some[0]].scale.levels);
    if some.len() > 1 {
        let longest = (0..3).max_by_key(|&i| pixels[i].len()).unwrap_or(0);
        some.sort_by_key(|&window| {
            let range = &windows[window].pixels[longest];
            range.start + range.end
        });
        let others = some.split_off(some.len() / 2);
        let apart = share_out(windows, some.clone(), rays_of_image, batches)
            + share_out(windows, others.clone(), rays_of_image, batches);
        if apart < together || !fits(&pixels, windows[some[0]].all) {
            return apart;
        }
        batches.truncate(first);
        some.extend(others);
    }
    batches.push(Batch { windows: some, pixels, levels });
    together
}
