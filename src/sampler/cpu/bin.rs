//! Binning: the triangles that may meet the rays of each band of rows.

use std::ops::Range;

use rayon::prelude::*;

use crate::cancel::checkpoint;
use crate::fixed::{Pixels, ViewPosition};
use crate::grid::{Axis, LatticeBox, LatticeSolid};
use crate::sampler::layout::Window;

/// The triangles of a solid sorted by band of image rows, as the view along one axis sees them. Triangles between the
/// rays are left out; one that spans several bands is listed in each.
///
/// Corners are copied into the lists: the triangles of a band are scattered over the whole mesh, and following indices
/// from it costs more cache misses than everything else together (measured: 1.5 × on a mesh whose triangles are ordered
/// across the bands). Triangles that span many bands are listed by index, at 4 bytes a band instead of 40.
pub struct Bins<'s> {
    band_rows: u32,
    window: Window,
    view: View<'s>,
    chunks: Vec<Chunk>,
}

/// A solid's triangles in the coordinates of one view.
#[derive(Clone, Copy)]
struct View<'s> {
    solid: &'s LatticeSolid<'s>,
    axis: Axis,
}

impl View<'_> {
    #[inline]
    fn see(&self, triangle: u32) -> SeenTriangle {
        let [a, b, c] = self.solid.triangles()[triangle as usize];
        let (column, row, depth) = (self.axis.column(), self.axis.row(), self.axis.depth());
        let see = |vertex: u32| {
            let p = &self.solid.positions()[vertex as usize];
            [p[column], p[row], p[depth]]
        };
        SeenTriangle { corners: [see(a), see(b), see(c)], triangle }
    }
}

/// A triangle in view coordinates.
#[derive(Clone, Copy, Default)]
pub struct SeenTriangle {
    /// Its corners in the coordinates of the view.
    pub corners: [ViewPosition; 3],
    /// Its index in the mesh.
    pub triangle: u32,
}

/// A run of triangles, counting-sorted separately so that chunks need no common array to write to.
struct Chunk {
    near: Sorted<SeenTriangle>,
    wide: Sorted<u32>,
}

/// Items sorted by band: those of band k are `items[starts[k]..starts[k + 1]]`.
pub struct Sorted<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy + Default> Sorted<T> {
    /// Counting-sorts triangles, each with its first and last band.
    pub fn new(bands: usize, reaching: &[(u32, u32, u32)], item: impl Fn(u32) -> T) -> Sorted<T> {
        let mut starts = vec![0u32; bands + 1];
        for &(_, first, last) in reaching {
            for band in first..=last {
                starts[band as usize] += 1;
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        // Each start is now at the end of its band, and filling backwards moves it to the beginning.
        let mut items = vec![T::default(); sum as usize];
        for &(triangle, first, last) in reaching.iter().rev() {
            let item = item(triangle);
            for band in first..=last {
                let start = &mut starts[band as usize];
                *start -= 1;
                items[*start as usize] = item;
            }
        }
        Sorted { starts, items }
    }

    /// Returns the items of a band, in the order in which they were given.
    pub fn of_band(&self, band: usize) -> &[T] {
        &self.items[self.starts[band] as usize..self.starts[band + 1] as usize]
    }
}

/// Number of triangles of a chunk: its vertices stay in the L2 cache between counting and copying.
const CHUNK: usize = 1 << 13;

/// Triangles that span more bands than this are listed by index.
const NEAR_BANDS: u32 = 2;

impl<'s> Bins<'s> {
    /// Sorts the triangles of `solid` that may meet rays of `region`, seen along `axis`, into bands of `band_rows` rows.
    pub fn new(solid: &'s LatticeSolid<'s>, region: &LatticeBox, axis: Axis, band_rows: u32) -> Bins<'s> {
        let (_, rows) = solid.grid().image_size(axis);
        let bands = rows.div_ceil(band_rows) as usize;
        let pixels = Pixels::new(solid.grid().shift());
        let window = Window::new(solid.grid(), region, axis);
        let view = View { solid, axis };
        let triangles = solid.triangles().len();
        let chunks = (0..triangles.div_ceil(CHUNK))
            .into_par_iter()
            .map_init(Default::default, |(near, wide): &mut (Vec<_>, Vec<_>), chunk| {
                checkpoint();
                near.clear();
                wide.clear();
                for triangle in chunk * CHUNK..triangles.min((chunk + 1) * CHUNK) {
                    let triangle = triangle as u32;
                    let [a, b, c] = view.see(triangle).corners;
                    let meets = |i: usize, within: &Range<i32>| {
                        let (low, high) = (a[i].min(b[i]).min(c[i]), a[i].max(b[i]).max(c[i]));
                        pixels.index_from(low).max(within.start)..pixels.index_from(high).min(within.end)
                    };
                    let (columns, rows) = (meets(0, &window.columns), meets(1, &window.rows));
                    if !columns.is_empty() & !rows.is_empty() {
                        let (first, last) = (rows.start as u32 / band_rows, (rows.end as u32 - 1) / band_rows);
                        let list = if last - first < NEAR_BANDS { &mut *near } else { &mut *wide };
                        list.push((triangle, first, last));
                    }
                }
                Chunk {
                    near: Sorted::new(bands, near, |triangle| view.see(triangle)),
                    wide: Sorted::new(bands, wide, |triangle| triangle),
                }
            })
            .collect();
        Bins { band_rows, window, view, chunks }
    }

    /// Returns the window of rays that are sampled.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// Calls `visit` with each triangle that may meet rays of the band that begins at `first_row`.
    #[inline]
    pub fn for_each_in_band(&self, first_row: u32, mut visit: impl FnMut(SeenTriangle)) {
        let band = (first_row / self.band_rows) as usize;
        for chunk in &self.chunks {
            for seen in chunk.near.of_band(band) {
                visit(*seen);
            }
            for &triangle in chunk.wide.of_band(band) {
                visit(self.view.see(triangle));
            }
        }
    }
}
