//! Which triangles each band of rows may see.

use rayon::prelude::*;

use crate::fixed::Pixels;
use crate::grid::{Axis, LatticeSolid};

/// The triangles of a solid sorted by band of image rows. Triangles between the rays are left out; one that reaches
/// over several bands is listed in each.
pub struct Bins {
    band_rows: u32,
    chunks: Vec<Chunk>,
}

/// A run of triangles, counting-sorted by itself so that chunks need no common array to write to.
struct Chunk {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

/// Triangles a chunk has; large enough that its 64 or so bands have runs longer than a cache line.
const CHUNK: usize = 1 << 15;

impl Bins {
    /// Sorts the triangles of `solid`, seen along `axis`, into bands of `band_rows` rows.
    pub fn new(solid: &LatticeSolid, axis: Axis, band_rows: u32) -> Bins {
        let (_, rows) = solid.grid().image_size(axis);
        let bands = rows.div_ceil(band_rows) as usize;
        let pixels = Pixels::new(solid.grid().shift());
        let chunks = solid
            .triangles()
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, triangles)| {
                let base = (chunk * CHUNK) as u32;
                let mut starts = vec![0u32; bands + 1];
                // The bands of each triangle that can meet a ray: triangle, first band, last band.
                let mut reaching = Vec::with_capacity(triangles.len());
                for (index, triangle) in triangles.iter().enumerate() {
                    let corner = triangle.map(|v| solid.positions()[v as usize]);
                    let (low, high) = extent(corner, axis.row());
                    let (first, end) = (pixels.index_from(low), pixels.index_from(high));
                    let (low, high) = extent(corner, axis.column());
                    if first == end || pixels.index_from(low) == pixels.index_from(high) {
                        continue;
                    }
                    let (first, last) = (first as u32 / band_rows, (end as u32 - 1) / band_rows);
                    for band in first..=last {
                        starts[band as usize + 1] += 1;
                    }
                    reaching.push((base + index as u32, first, last));
                }
                for band in 0..bands {
                    starts[band + 1] += starts[band];
                }
                let mut next = starts.clone();
                let mut sorted = vec![0u32; starts[bands] as usize];
                for (triangle, first, last) in reaching {
                    for band in first..=last {
                        let slot = &mut next[band as usize];
                        sorted[*slot as usize] = triangle;
                        *slot += 1;
                    }
                }
                Chunk { starts, triangles: sorted }
            })
            .collect();
        Bins { band_rows, chunks }
    }

    /// The triangles that may meet rays of the band that begins at `first_row`, ascending.
    pub fn triangles(&self, first_row: u32) -> impl Iterator<Item = u32> + '_ {
        let band = (first_row / self.band_rows) as usize;
        let runs =
            self.chunks.iter().flat_map(move |c| &c.triangles[c.starts[band] as usize..c.starts[band + 1] as usize]);
        runs.copied()
    }
}

/// The least and greatest of one coordinate.
fn extent(corners: [[i32; 3]; 3], coordinate: usize) -> (i32, i32) {
    let [a, b, c] = corners.map(|p| p[coordinate]);
    (a.min(b).min(c), a.max(b).max(c))
}
