//! The input of shaders: constants, declared once and emitted into WGSL, and the parameters of one dispatch.

use std::fmt::Write;

use super::Route;
use super::band::Band;
use super::image::Image;
use super::network::NETWORK;
use crate::diagram::Diagram;
use crate::gpu::{WORKGROUP, shared_struct};
use crate::grid::{Axis, Grid};
use crate::ldi::{ALONG_COLUMNS, ALONG_ROWS, THROUGH_NODES, level_tolerance};
use crate::sampler::layout::{WORD_BITS, Window};
use crate::sampler::stages::UNCLOSED;

/// Most bands of one job.
pub const MOST_BANDS: usize = 3;

/// Number of sums for moments.
pub const MOMENTS: usize = 10;

/// Number of rows of a block of a large triangle.
pub const BLOCK_ROWS: u32 = 8;

/// Number of invocations of a workgroup of the prefix sum, and of counts that each of them adds up.
pub const SCAN_WORKGROUP: u32 = 256;
const SCAN_ITEMS: u32 = 8;

/// Number of counts that one workgroup of the prefix sum adds up.
pub const SCAN_BLOCK: u32 = SCAN_WORKGROUP * SCAN_ITEMS;

/// Largest number of crossings of a ray that one invocation sorts by itself.
pub const SORTED_ALONE: u32 = 64;

/// Number of invocations of a workgroup that sorts more.
pub const LONG_WORKGROUP: u32 = 64;

/// Largest number of workgroups that sort more: one dimension of a dispatch.
const MOST_GROUPS: u32 = 65_535;

/// Offsets of the sums of nodes and of residuals among the sums of an image, after four sums of lengths, and the number
/// of all sums.
pub const NODE_SUMS: u32 = 4;
pub const LEVEL_SUMS: u32 = 12;
pub const SUMS: u32 = 15;

/// Number of words of the totals of one band: sums in two words each, the largest number of samples of a ray, and the number of
/// all samples.
pub const TOTALS_WORDS: u32 = 2 * SUMS + 2;

/// Number of words of the totals of one band for moments: sums in four words each, and the number of coincident samples.
pub const MOMENT_WORDS: u32 = 4 * MOMENTS as u32 + 1;

/// Most leaves whose states are tabulated, and for which less memory of each invocation is cleared.
pub const FEW_LEAVES: usize = 8;

/// Returns the constants in WGSL, for the head of every shader.
pub fn constants() -> String {
    let mut text = String::new();
    let mut constant = |name: &str, kind: &str, value: u32| {
        let suffix = if kind == "u32" { "u" } else { "" };
        let _ = writeln!(text, "const {name}: {kind} = {value}{suffix};");
    };
    constant("WORD_BITS", "u32", WORD_BITS);
    constant("WORKGROUP", "u32", WORKGROUP);
    constant("MOST_BANDS", "u32", MOST_BANDS as u32);
    constant("FEW_LEAVES", "u32", FEW_LEAVES as u32);
    constant("MOST_LEAVES", "u32", Diagram::MOST_LEAVES as u32);
    constant("BLOCK_ROWS", "u32", BLOCK_ROWS);
    constant("NETWORK", "u32", NETWORK);
    constant("SCAN_WORKGROUP", "u32", SCAN_WORKGROUP);
    constant("SCAN_ITEMS", "u32", SCAN_ITEMS);
    constant("SCAN_BLOCK", "u32", SCAN_BLOCK);
    constant("SORTED_ALONE", "u32", SORTED_ALONE);
    constant("LONG_WORKGROUP", "u32", LONG_WORKGROUP);
    constant("MOST_GROUPS", "u32", MOST_GROUPS);
    constant("SUMS", "u32", SUMS);
    constant("TOTALS_WORDS", "u32", TOTALS_WORDS);
    constant("MOMENTS", "u32", MOMENTS as u32);
    constant("MOMENT_WORDS", "u32", MOMENT_WORDS);
    constant("NODE_SUMS", "u32", NODE_SUMS);
    constant("LEVEL_SUMS", "u32", LEVEL_SUMS);
    constant("ALONG_COLUMNS", "u32", ALONG_COLUMNS.into());
    constant("ALONG_ROWS", "u32", ALONG_ROWS.into());
    constant("THROUGH_NODES", "i32", THROUGH_NODES as u32);
    constant("UNCLOSED", "u32", UNCLOSED);
    constant("AXIS_X", "u32", Axis::X.depth() as u32);
    constant("AXIS_Y", "u32", Axis::Y.depth() as u32);
    text
}

shared_struct! {
    /// A band of rays along one axis.
    pub struct BandView {
        /// The coordinate along the rays: 0, 1 or 2.
        axis: u32,
        /// The number of its first ray among those of the job.
        first_ray: u32,
        /// Number of rays.
        rays: u32,
        /// Number of columns.
        columns: u32,
        /// The band's first row.
        first_row: i32,
        /// The band's first column.
        first_column: i32,
        /// The rows and columns of the window within the band.
        first_window_row: i32,
        end_window_row: i32,
        first_window_column: i32,
        end_window_column: i32,
        /// The counted rays, by their numbers; the others serve only for comparison.
        first_counted: u32,
        end_counted: u32,
        /// Half the number of lattice steps of a voxel, and one divided by it.
        half_voxel: u32,
        per_half_voxel: f32,
        /// The place of its tally.
        tally: u32,
        unused: u32,
    }
}

shared_struct! {
    /// The input of one dispatch: the raster and the bands of its job, and the sizes of its buffers.
    pub struct View {
        /// A pixel is 2^shift lattice steps wide.
        shift: u32,
        /// The lattice position of ray 0 of any axis.
        first_ray: i32,
        /// 2^-shift.
        pixels_per_step: f32,
        /// Largest distance between samples of one level surface, in lattice steps.
        level_tolerance: i32,
        /// LOD-C − 1.
        last_voxel: u32,
        /// Number of mask words per ray.
        words: u32,
        /// Number of bands.
        band_count: u32,
        /// Number of rays of all bands.
        rays: u32,
        /// Number of lists: rays of each solid, or other things that are counted.
        lists: u32,
        /// The first list of the solid.
        first_list: u32,
        /// Number of items that the lists have room for.
        capacity: u32,
        /// Lists of more items than this are sorted by a workgroup.
        long_from: u32,
        /// Number of triangles in the buffer.
        triangles: u32,
        /// The index, in the mesh, of the first of them.
        first_triangle: u32,
        /// Number of blocks of rows in the buffer.
        blocks: u32,
        /// Number of solids whose lists follow one another.
        solids: u32,
        ;
        /// The bands; those beyond the last begin behind all rays.
        bands: [BandView; 3]
    }
}

impl View {
    /// Returns the input of a job of these bands, without the sizes of its lists.
    pub fn new(image: &Image, route: Route, bands: &[Band]) -> View {
        let grid = &image.grid;
        let mut first_ray = 0;
        let mut band_views = [BandView { first_ray: u32::MAX, ..BandView::default() }; MOST_BANDS];
        for (i, (view, band)) in band_views.iter_mut().zip(bands).enumerate() {
            *view = BandView { tally: i as u32, ..BandView::new(image, band, first_ray) };
            first_ray += band.rays().next_multiple_of(WORKGROUP);
        }
        View {
            shift: grid.shift(),
            first_ray: grid.node(0),
            pixels_per_step: 1.0 / (1u32 << grid.shift()) as f32,
            level_tolerance: level_tolerance(grid.shift()),
            last_voxel: grid.lod() - 1,
            words: words(grid),
            band_count: bands.len() as u32,
            rays: first_ray,
            solids: if route == Route::Lists { image.parts.len() as u32 } else { 1 },
            long_from: u32::MAX,
            bands: band_views,
            ..View::default()
        }
    }

    /// Returns the input of stages that look at solid `part` alone: its lists, its windows, and if it is a leaf of a combination,
    /// its tallies, behind those of the result.
    pub fn of_part(self, image: &Image, part: usize, bands: &[Band]) -> View {
        let mut view = View { first_list: part as u32 * self.rays, ..self };
        for (band_view, band) in view.bands.iter_mut().zip(bands) {
            *band_view = band_view.within(&image.parts[part].windows[band.axis.depth()], band);
            if image.leaves() > 0 {
                band_view.tally += (1 + part as u32) * self.band_count;
            }
        }
        view
    }
}

impl BandView {
    fn new(image: &Image, band: &Band, first_ray: u32) -> BandView {
        let columns = band.columns();
        let half_voxel = image.grid.voxel(band.axis) / 2;
        BandView {
            axis: band.axis.depth() as u32,
            first_ray,
            rays: band.rays(),
            columns: columns.end - columns.start,
            first_row: band.first_row as i32,
            first_column: columns.start as i32,
            first_counted: first_ray + band.counted().start,
            end_counted: first_ray + band.counted().end,
            half_voxel,
            per_half_voxel: 1.0 / half_voxel as f32,
            ..BandView::default()
        }
        .within(image.window(band.axis), band)
    }

    /// Returns the same band with another window.
    fn within(self, window: &Window, band: &Band) -> BandView {
        let (rows, columns) = (band.first_row..band.first_row + band.rows, band.columns());
        BandView {
            first_window_row: (rows.start as i32).max(window.rows.start),
            end_window_row: (rows.end as i32).min(window.rows.end),
            first_window_column: (columns.start as i32).max(window.columns.start),
            end_window_column: (columns.end as i32).min(window.columns.end),
            ..self
        }
    }
}

/// Returns the number of mask words of a ray.
pub fn words(grid: &Grid) -> u32 {
    grid.lod().div_ceil(WORD_BITS)
}

shared_struct! {
    /// Counts over all rays of a band: unclosed rays, and the winding sums of crossings
    /// ([`Windings`](crate::ldi::Windings)). Atomic in WGSL; sums of 64 bits are stored in two words.
    pub struct Tally {
        unclosed: u32 atomic,
        changes: u32 atomic,
        wound_low: u32 atomic,
        wound_high: u32 atomic,
        aligned_low: u32 atomic,
        aligned_high: u32 atomic,
        unpaired_low: u32 atomic,
        unpaired_high: u32 atomic,
    }
}

shared_struct! {
    /// What a job finds, and the arguments of the dispatch that sorts its long lists. Atomic in WGSL, but for stages that only
    /// read it.
    pub struct Found {
        /// The place of the next crossing.
        next: u32 atomic,
        /// The largest number of items of a list.
        greatest: u32 atomic,
        /// Number of items of all lists.
        total: u32,
        /// Number of lists that are too long for one invocation to sort.
        long_lists: u32 atomic,
        workgroups_x: u32 atomic,
        workgroups_y: u32,
        workgroups_z: u32,
    }
}

/// Number of words of what a job finds.
pub const FOUND_WORDS: u64 = size_of::<Found>() as u64 / 4;

/// The offset in bytes of the arguments of the dispatch that sorts long lists.
pub const LONG_DISPATCH: u64 = std::mem::offset_of!(Found, workgroups_x) as u64;

/// Number of words of a tally.
pub const TALLY_WORDS: u64 = size_of::<Tally>() as u64 / 4;

/// Returns a sum of 64 bits that is stored in two words.
pub fn wide(low: u32, high: u32) -> i64 {
    (u64::from(low) | u64::from(high) << 32) as i64
}
