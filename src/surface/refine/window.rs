//! Finer images around groups of cells.

use std::ops::Range;

use super::super::border::Scale;
use super::groups::Group;
use crate::grid::{FineBox, Grid};
use crate::ldi::Ldi;

/// The exact images of a solid in a box of finer pixels, with the triangles of their samples.
pub(crate) struct FineImages {
    /// Those along x, y and z, on the grid of the box.
    pub images: [Ldi; 3],
    /// The normals of their triangles; `None` where these are numbered as those of the coarse images.
    pub normals: Option<Vec<[f32; 3]>>,
}

/// Makes the images of a solid in boxes of finer pixels; `None` where the solid is ambiguous there.
pub(crate) type FineSampler<'a, E> = Box<dyn FnMut(&FineBox) -> Result<Option<FineImages>, E> + 'a>;

/// The finer images around a group.
pub struct Window {
    pub scale: Scale,
    fine: FineBox,
}

impl Window {
    /// Returns the window of a group at some levels; `None` where no grid is that fine, or the window would be too large.
    pub fn around(group: &Group, grid: &Grid, levels: u32) -> Option<Window> {
        let fine = FineBox::all(grid, levels).ok()?;
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
            let last = i64::from(fine.whole().rays()[i]);
            let start = (index(least) - 1).clamp(0, last - 1);
            start as u32..(index(greatest + 1) + 2).clamp(start + 1, last) as u32
        });
        let offset = std::array::from_fn(|i| whole.offset[i] - pixels[i].start as i32);
        let [x, y, z] = pixels.each_ref().map(|range| u64::from(range.end - range.start));
        let is_small = fits(&pixels) && x * y * z / 64 <= MOST_WORDS;
        is_small.then(|| Window { scale: Scale { levels, offset }, fine: fine.with_pixels(pixels) })
    }
}

/// A box of pixels.
type Pixels = [Range<u32>; 3];

/// Most rays of an image along one axis.
const MOST_RAYS: u64 = 1 << 24;

/// Most words of the nodes of a window.
const MOST_WORDS: u64 = 1 << 22;

/// Returns whether the images of a box of pixels have few enough rays.
fn fits(pixels: &Pixels) -> bool {
    rays(pixels).into_iter().all(|rays| rays <= MOST_RAYS)
}

/// Windows whose images are made together: those of the box around them.
pub struct Batch {
    /// Their numbers.
    pub windows: Vec<usize>,
    pixels: Pixels,
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

    /// Returns two batches of half of the windows each; none of a single window.
    pub fn halves(&self, windows: &[Window]) -> Option<[Batch; 2]> {
        let (some, others) = self.windows.split_at(self.windows.len() / 2);
        let batch = |some: &[usize]| Batch { windows: some.to_vec(), pixels: hull(windows, some) };
        (!some.is_empty()).then(|| [batch(some), batch(others)])
    }

    /// Returns the number of its rays along all axes.
    pub fn rays(&self) -> u64 {
        rays(&self.pixels).iter().sum()
    }

    /// Returns the box of pixels that its images are made in.
    pub fn fine(&self, windows: &[Window]) -> FineBox {
        windows[self.windows[0]].fine.with_pixels(self.pixels.clone())
    }

    /// Returns the part of its images in a window.
    pub fn of_window(&self, images: &[Ldi; 3], window: &Window) -> [Ldi; 3] {
        let pixels = std::array::from_fn(|i| {
            let (Range { start, end }, first) = (window.fine.pixels()[i].clone(), self.pixels[i].start);
            start - first..end - first
        });
        images.each_ref().map(|image| image.window(*window.fine.grid(), &pixels))
    }
}

/// Returns the rays through a box of pixels along the three axes.
fn rays([x, y, z]: &Pixels) -> [u64; 3] {
    let [x, y, z] = [x, y, z].map(|range| u64::from(range.end - range.start));
    [y * z, z * x, x * y]
}

/// Returns the box around some windows.
fn hull(windows: &[Window], some: &[usize]) -> Pixels {
    std::array::from_fn(|i| {
        let ranges = || some.iter().map(|&window| &windows[window].fine.pixels()[i]);
        ranges().map(|range| range.start).min().unwrap_or(0)..ranges().map(|range| range.end).max().unwrap_or(0)
    })
}

/// Divides windows in two where that takes less time than their images together, and so on. Returns the cost.
fn share_out(windows: &[Window], mut some: Vec<usize>, rays_of_image: u64, batches: &mut Vec<Batch>) -> u64 {
    let pixels = hull(windows, &some);
    let rays = rays(&pixels);
    let together = rays.iter().sum::<u64>() + 3 * rays_of_image;
    let first = batches.len();
    if some.len() > 1 {
        let longest = (0..3).max_by_key(|&i| pixels[i].len()).unwrap_or(0);
        some.sort_by_key(|&window| {
            let range = &windows[window].fine.pixels()[longest];
            range.start + range.end
        });
        let others = some.split_off(some.len() / 2);
        let apart = share_out(windows, some.clone(), rays_of_image, batches)
            + share_out(windows, others.clone(), rays_of_image, batches);
        if apart < together || !fits(&pixels) {
            return apart;
        }
        batches.truncate(first);
        some.extend(others);
    }
    batches.push(Batch { windows: some, pixels });
    together
}
