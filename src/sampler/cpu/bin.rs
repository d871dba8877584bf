//! Binning: the triangles that may meet the rays of each band of rows.

use std::ops::Range;

use crate::parallel::*;

use crate::cancel::checkpoint;
use crate::fixed::{Pixels, ViewPosition};
use crate::grid::{Axis, LatticeBox, LatticeSolid};
use crate::sampler::layout::Window;

/// The triangles of a solid that may meet some rows of an image, sorted by band, as the view along one axis sees them. Triangles
/// between the rays are left out; one that spans several bands is listed in each.
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
pub struct View<'s> {
    /// The solid.
    pub solid: &'s LatticeSolid<'s>,
    /// The direction of the rays.
    pub axis: Axis,
}

impl View<'_> {
    /// Lists the triangles of a run whose boxes have rays in them.
    fn list_run(&self, run: Range<usize>, lists: &mut Lists) {
        #[cfg(target_arch = "x86_64")]
        if super::raster::has_lanes() && self.solid.positions().len() <= super::gather::MOST {
            // SAFETY: the processor has the features that the function is compiled for.
            return unsafe { super::gather::list_run(self, run, lists) };
        }
        self.list_run_alone(run, lists);
    }

    /// Lists the triangles of a run one after another.
    fn list_run_alone(&self, run: Range<usize>, lists: &mut Lists) {
        for triangle in run {
            let corners = self.see(triangle as u32);
            let [a, b, c] = corners;
            let rays = |i: usize, within: &Range<i32>| {
                let (low, high) = (a[i].min(b[i]).min(c[i]), a[i].max(b[i]).max(c[i]));
                lists.pixels.index_from(low).max(within.start)..lists.pixels.index_from(high).min(within.end)
            };
            let (columns, rows) = (rays(0, &lists.window.columns), rays(1, &lists.window.rows));
            if !columns.is_empty() & !rows.is_empty() {
                lists.push(rows, &corners.map(|corner| corner.map(|coordinate| [coordinate])), 0, triangle as u32);
            }
        }
    }

    /// Returns the corners of a triangle.
    #[inline]
    fn see(&self, triangle: u32) -> [ViewPosition; 3] {
        let (column, row, depth) = (self.axis.column(), self.axis.row(), self.axis.depth());
        self.solid.triangles()[triangle as usize].map(|vertex| {
            let p = &self.solid.positions()[vertex as usize];
            [p[column], p[row], p[depth]]
        })
    }
}

/// Number of triangles that lie side by side.
pub const LANES: usize = 8;

/// Triangles in view coordinates, side by side. Lanes without a triangle hold a point, which covers no ray.
#[derive(Clone, Copy)]
pub struct Lanes {
    /// The corners, by corner, coordinate of the view, and lane.
    pub corners: [[[i32; LANES]; 3]; 3],
    /// The indices of the triangles in the mesh.
    pub triangles: [u32; LANES],
    /// The index of the next lanes of the same band, or [`NONE`].
    next: u32,
}

const NONE: u32 = u32::MAX;

impl Lanes {
    /// Lanes without triangles.
    pub const EMPTY: Lanes = Lanes { corners: [[[0; LANES]; 3]; 3], triangles: [0; LANES], next: NONE };

    /// Sets the triangle of a lane to one of `N` side by side.
    #[inline(always)]
    pub fn set<const N: usize>(&mut self, lane: usize, corners: &[[[i32; N]; 3]; 3], from: usize, triangle: u32) {
        for (to, coordinate) in self.corners.as_flattened_mut().iter_mut().zip(corners.as_flattened()) {
            to[lane] = coordinate[from];
        }
        self.triangles[lane] = triangle;
    }

    /// Returns the corners of the triangle of a lane.
    #[inline]
    pub fn of(&self, lane: usize) -> [ViewPosition; 3] {
        self.corners.map(|corner| corner.map(|coordinate| coordinate[lane]))
    }
}

/// The triangles of one run of the mesh. Runs are sorted separately so that they need no common array to write to.
struct Chunk {
    near: Near,
    wide: Sorted<u32>,
}

/// Triangles in lanes, by band.
struct Near {
    lanes: Vec<Lanes>,
    lists: Vec<List>,
}

/// The lanes of a band: a linked list, of which the last lanes may have room.
#[derive(Clone, Copy)]
struct List {
    first: u32,
    last: u32,
    used: u32,
}

impl Near {
    /// Returns lists without triangles, with room for some lanes.
    fn new(bands: usize, lanes: usize) -> Near {
        let empty = List { first: NONE, last: NONE, used: LANES as u32 };
        Near { lanes: Vec::with_capacity(lanes), lists: vec![empty; bands] }
    }

    /// Appends a triangle, one of `N` side by side, to the list of a band.
    #[inline(always)]
    fn push<const N: usize>(&mut self, band: u32, corners: &[[[i32; N]; 3]; 3], lane: usize, triangle: u32) {
        let list = &mut self.lists[band as usize];
        if list.used as usize == LANES {
            let new = self.lanes.len() as u32;
            self.lanes.push(Lanes::EMPTY);
            match list.first {
                NONE => list.first = new,
                _ => self.lanes[list.last as usize].next = new,
            }
            (list.last, list.used) = (new, 0);
        }
        self.lanes[list.last as usize].set(list.used as usize % LANES, corners, lane, triangle);
        list.used += 1;
    }
}

/// Where the triangles of a run are listed.
pub struct Lists<'l> {
    /// The pixels of the view.
    pub pixels: Pixels,
    /// The rays that are sampled.
    pub window: &'l Window,
    band_of_row: &'l [u32],
    near: Near,
    wide: &'l mut Vec<(u32, u32, u32)>,
}

impl Lists<'_> {
    /// Lists a triangle, one of `N` side by side, whose box has rays of these rows in it.
    #[inline(always)]
    pub fn push<const N: usize>(&mut self, rows: Range<i32>, corners: &[[[i32; N]; 3]; 3], lane: usize, triangle: u32) {
        let (first, last) = (self.band_of_row[rows.start as usize], self.band_of_row[rows.end as usize - 1]);
        if last - first >= NEAR_BANDS {
            return self.wide.push((triangle, first, last));
        }
        for band in first..=last {
            self.near.push(band, corners, lane, triangle);
        }
    }
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

/// Least number of triangles of a chunk: its vertices stay in the L2 cache.
const CHUNK: usize = 1 << 13;

/// Least number of triangles of a chunk for each band, so that few lanes stay empty.
const OF_BAND: usize = 64;

/// Triangles that span more bands than this are listed by index.
const NEAR_BANDS: u32 = 4;

impl<'s> Bins<'s> {
    /// Sorts the triangles of `solid` that may meet rays of `region` in `rows`, seen along `axis`, into bands of `band_rows` rows.
    pub fn new(
        solid: &'s LatticeSolid<'s>,
        region: &LatticeBox,
        axis: Axis,
        band_rows: u32,
        rows: &Range<u32>,
    ) -> Bins<'s> {
        let (_, all_rows) = solid.grid().image_size(axis);
        let band_of_row: Vec<u32> = (0..all_rows).map(|row| row / band_rows).collect();
        let bands = all_rows.div_ceil(band_rows) as usize;
        let pixels = Pixels::new(solid.grid().shift());
        let window = Window::new(solid.grid(), region, axis).in_rows(rows);
        let view = View { solid, axis };
        let triangles = if window.is_empty() { 0 } else { solid.triangles().len() };
        let of_chunk = CHUNK.max(OF_BAND * bands);
        let sort_chunk = |wide: &mut Vec<_>, chunk: usize| {
            checkpoint();
            wide.clear();
            let run = chunk * of_chunk..triangles.min((chunk + 1) * of_chunk);
            let near = Near::new(bands, run.len() / (LANES - 2));
            let mut lists = Lists { pixels, window: &window, band_of_row: &band_of_row, near, wide };
            view.list_run(run, &mut lists);
            let mut near = lists.near;
            near.lanes.shrink_to_fit();
            Chunk { near, wide: Sorted::new(bands, wide, |triangle| triangle) }
        };
        let chunks = (0..triangles.div_ceil(of_chunk)).into_par_iter().map_init(Vec::new, sort_chunk).collect();
        Bins { band_rows, window, view, chunks }
    }

    /// Returns the window of rays that are sampled.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// Calls `visit` with all triangles that may meet rays of the band that begins at `first_row`.
    #[inline]
    pub fn for_each_in_band(&self, first_row: u32, mut visit: impl FnMut(Seen)) {
        let band = (first_row / self.band_rows) as usize;
        for chunk in &self.chunks {
            let mut at = chunk.near.lists[band].first;
            while let Some(lanes) = chunk.near.lanes.get(at as usize) {
                visit(Seen::Near(lanes));
                at = lanes.next;
            }
            for &triangle in chunk.wide.of_band(band) {
                visit(Seen::Wide(self.view.see(triangle), triangle));
            }
        }
    }
}

/// Triangles of a band.
pub enum Seen<'l> {
    /// Up to eight triangles.
    Near(&'l Lanes),
    /// The corners and the index of a triangle that spans many bands.
    Wide([ViewPosition; 3], u32),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::testing::random::Random;
    use glam::DVec3;

    #[test]
    fn eight_triangles_are_listed_as_one_after_another() {
        let mut random = Random::new(18);
        let (mut listed_near, mut listed_wide) = (0, 0);
        for case in 0..60 {
            let grid = Grid::from_parts(DVec3::ZERO, 1.0, [40, 24, 33], [2, 9, 20, 24][case % 4], 1024).unwrap();
            let size = [0, 1, 2].map(|axis| grid.length(axis));
            // Few vertices make faces of any size; duplicates make some of one point.
            let positions: Vec<[i32; 3]> = (0..4 + random.below(30))
                .map(|_| size.map(|size| random.below(size as usize / 2) as i32 * 2))
                .collect();
            let triangles: Vec<[u32; 3]> = (0..random.below(300))
                .map(|_| {
                    let first = random.below(positions.len());
                    [first, first + random.below(4), random.below(positions.len())]
                        .map(|v| (v % positions.len()) as u32)
                })
                .collect();
            let solid = LatticeSolid::of_primitives(&grid, &positions, &triangles);
            let axis = Axis::ALL[case / 3 % 3];
            let box_of =
                |share: f64| LatticeBox { min: size.map(|size| (f64::from(size) * share) as i32 & !1), max: size };
            let window = Window::new(&grid, &box_of([0.0, 0.4][case / 9 % 2]), axis);
            let (_, rows) = grid.image_size(axis);
            let band_of_row: Vec<u32> = (0..rows).map(|row| row / 3).collect();
            let (view, bands) = (View { solid: &solid, axis }, rows.div_ceil(3) as usize);
            let run = random.below(2 + triangles.len() / 2).min(triangles.len())..triangles.len();
            let listed = |list: fn(&View, Range<usize>, &mut Lists)| {
                let (mut wide, near) = (Vec::new(), Near::new(bands, 0));
                let (pixels, window) = (Pixels::new(grid.shift()), &window);
                let mut lists = Lists { pixels, window, band_of_row: &band_of_row, near, wide: &mut wide };
                list(&view, run.clone(), &mut lists);
                let near = lists.near;
                let blocks: Vec<_> =
                    near.lanes.iter().map(|lanes| (lanes.corners, lanes.triangles, lanes.next)).collect();
                (blocks, near.lists.iter().map(|list| (list.first, list.last, list.used)).collect::<Vec<_>>(), wide)
            };
            let alone = listed(|view, run, lists| view.list_run_alone(run, lists));
            assert!(alone == listed(|view, run, lists| view.list_run(run, lists)), "case {case}");
            listed_near += alone.0.len();
            listed_wide += alone.2.len();
        }
        assert!(listed_near > 1_000 && listed_wide > 100, "{listed_near} near, {listed_wide} wide");
    }
}
