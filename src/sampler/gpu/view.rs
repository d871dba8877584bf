//! The input of shaders: constants, declared once and emitted into WGSL, and the parameters of one dispatch.

use std::fmt::Write;

use super::band::Band;
use crate::gpu::{MOST_WORKGROUPS, WORKGROUP, shared_struct};
use crate::grid::{Axis, Grid};
use crate::ldi::{ALONG_COLUMNS, ALONG_ROWS, THROUGH_NODES, level_tolerance};
use crate::sampler::layout::{WORD_BITS, Window};
use crate::sampler::stages::UNCLOSED;

/// Number of rows of a block of a large triangle; one workgroup processes a block.
pub const BLOCK_ROWS: u32 = 8;

/// Triangles whose box covers more rays than this are large.
const SMALL_BOX: u32 = 256;

/// The same in a pass over tiles: triangles whose box covers more tiles than this are large.
const SMALL_BOX_IN_TILES: u32 = 16;

/// Number of rows and columns of a tile; a workgroup has one lane for each of its rays.
pub const TILE_SIDE: u32 = 8;
const _: () = assert!(TILE_SIDE * TILE_SIDE == WORKGROUP);

/// Largest number of mask words of a ray of a tile.
pub const TILE_WORDS: u32 = 32;

/// Number of crossings of a tile that are kept from the first pass over its triangles to the second.
const TILE_CROSSINGS: u32 = 2048;

/// Bytes of workgroup memory that a tile takes: two masks, ranks of half the size and a place per ray, crossings with
/// their rays in a byte each, and the rest for a few sums.
pub const TILE_MEMORY: u32 = 4 * WORKGROUP * (2 * TILE_WORDS + TILE_WORDS / 2 + 1) + 5 * TILE_CROSSINGS + 256;

/// Number of invocations of a workgroup of the prefix sum, and of counts that each of them adds up.
pub const SCAN_WORKGROUP: u32 = 256;
const SCAN_ITEMS: u32 = 8;

/// Number of counts that one workgroup of the prefix sum adds up.
pub const SCAN_BLOCK: u32 = SCAN_WORKGROUP * SCAN_ITEMS;

/// Largest number of crossings of a ray that one invocation sorts by itself.
pub const SORTED_ALONE: u32 = 64;

/// Offsets of the sums of nodes and of residuals among the sums of an image, after four sums of lengths, and the number
/// of all sums.
pub const NODE_SUMS: u32 = 4;
pub const LEVEL_SUMS: u32 = 12;
pub const SUMS: u32 = 15;

/// Returns the constants in WGSL, for the head of every shader.
pub fn constants() -> String {
    let mut text = String::new();
    let mut constant = |name: &str, kind: &str, value: u32| {
        let suffix = if kind == "u32" { "u" } else { "" };
        let _ = writeln!(text, "const {name}: {kind} = {value}{suffix};");
    };
    constant("WORD_BITS", "u32", WORD_BITS);
    constant("WORKGROUP", "u32", WORKGROUP);
    constant("MOST_WORKGROUPS", "u32", MOST_WORKGROUPS);
    constant("BLOCK_ROWS", "i32", BLOCK_ROWS);
    constant("BLOCK_LANES", "i32", WORKGROUP / BLOCK_ROWS);
    constant("SMALL_BOX", "u32", SMALL_BOX);
    constant("SMALL_BOX_IN_TILES", "u32", SMALL_BOX_IN_TILES);
    constant("TILE_SIDE", "u32", TILE_SIDE);
    constant("TILE_WORDS", "u32", TILE_WORDS);
    constant("TILE_CROSSINGS", "u32", TILE_CROSSINGS);
    constant("SCAN_WORKGROUP", "u32", SCAN_WORKGROUP);
    constant("SCAN_ITEMS", "u32", SCAN_ITEMS);
    constant("SCAN_BLOCK", "u32", SCAN_BLOCK);
    constant("SORTED_ALONE", "u32", SORTED_ALONE);
    constant("SUMS", "u32", SUMS);
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
    /// The view of a solid along one axis, in one band.
    pub struct View {
        /// A pixel is 2^shift lattice steps wide.
        shift: u32,
        /// The lattice position of ray 0 of any axis.
        first_ray: i32,
        /// 2^-shift.
        pixels_per_step: f32,
        /// The coordinate along the rays: 0, 1 or 2.
        axis: u32,
        /// The coordinate along the columns.
        column_axis: u32,
        /// The coordinate along the rows.
        row_axis: u32,
        /// The band's first row.
        first_row: i32,
        /// The band's first column.
        first_column: i32,
        /// Number of columns of the band.
        columns: u32,
        /// Number of rays of the band.
        rays: u32,
        /// The rows and columns of the window within the band.
        first_window_row: i32,
        end_window_row: i32,
        first_window_column: i32,
        end_window_column: i32,
        /// Number of triangles in the buffer.
        triangles: u32,
        /// The index, in the mesh, of the first of them.
        first_triangle: u32,
        /// Number of blocks that the queue of large triangles holds.
        queue_capacity: u32,
        /// Half the number of lattice steps of a voxel.
        half_voxel: u32,
        /// LOD-C − 1.
        last_voxel: u32,
        /// Number of mask words per ray.
        words: u32,
        /// The offset of the crossings of the solid in their buffer.
        first_crossing: u32,
        /// The counted rays of the band; the others serve only for comparison.
        first_counted: u32,
        end_counted: u32,
        /// Largest distance between samples of one level surface, in lattice steps.
        level_tolerance: i32,
        /// The length of the sorted runs to be merged.
        run: u32,
    }
}

impl View {
    /// Returns the view of a band along `axis`, without properties of the solid.
    pub fn new(grid: &Grid, axis: Axis, band: &Band, window: &Window) -> View {
        let (rows, columns) = (band.first_row..band.first_row + band.rows, band.columns());
        View {
            shift: grid.shift(),
            first_ray: grid.node(0),
            pixels_per_step: 1.0 / (1u32 << grid.shift()) as f32,
            axis: axis.depth() as u32,
            column_axis: axis.column() as u32,
            row_axis: axis.row() as u32,
            first_row: rows.start as i32,
            first_column: columns.start as i32,
            columns: columns.end - columns.start,
            rays: band.rays(),
            first_window_row: (rows.start as i32).max(window.rows.start),
            end_window_row: (rows.end as i32).min(window.rows.end),
            first_window_column: (columns.start as i32).max(window.columns.start),
            end_window_column: (columns.end as i32).min(window.columns.end),
            half_voxel: grid.voxel(axis) / 2,
            last_voxel: grid.lod() - 1,
            words: words(grid),
            first_counted: band.counted().start,
            end_counted: band.counted().end,
            level_tolerance: level_tolerance(grid.shift()),
            ..View::default()
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
    /// The queue state of a geometry pass: the arguments of an indirect dispatch, and the number of blocks without
    /// room.
    pub struct Planned {
        workgroups_x: u32,
        workgroups_y: u32,
        workgroups_z: u32,
        left_out: u32,
    }
}

/// Number of words of a plan.
pub const PLANNED_WORDS: u64 = size_of::<Planned>() as u64 / 4;

/// Number of words of a tally.
pub const TALLY_WORDS: u64 = size_of::<Tally>() as u64 / 4;

/// Returns a sum of 64 bits that is stored in two words.
pub fn wide(low: u32, high: u32) -> i64 {
    (u64::from(low) | u64::from(high) << 32) as i64
}

/// Returns the largest number of rows of a band in which the blocks of this many large triangles can be counted in 32
/// bits.
pub fn most_rows(triangles: u64) -> u32 {
    let blocks = u64::from(u32::MAX) / triangles.max(1);
    (u64::from(BLOCK_ROWS) * blocks.max(1)).min(u32::MAX.into()) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn block_counts_of_the_large_triangle_queue_fit_32_bits() {
        for triangles in [1, 1000, 524_287, 524_288, 524_289, 33_554_433, 1 << 31, (1 << 32) - 1] {
            let rows = most_rows(triangles).min(1 << 16);
            let blocks = triangles * u64::from(rows.div_ceil(BLOCK_ROWS));
            assert!(blocks <= u32::MAX.into(), "{triangles} triangles in {rows} rows: {blocks}");
            assert!(rows == 1 << 16 || blocks + triangles > u32::MAX.into(), "{rows} rows could be more");
        }
        assert_eq!([most_rows(0), most_rows(524_287)], [u32::MAX, 65_536]);
    }
}
