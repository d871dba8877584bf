//! Solids in device memory.

use std::sync::{Arc, Mutex};

use crate::parallel::*;

use super::view::BLOCK_ROWS;
use crate::fixed::Pixels;
use crate::gpu::{Device, DeviceError, held};
use crate::grid::{Axis, LatticeSolid};

/// A run of triangles of a solid with the positions that they use.
pub struct Chunk {
    pub positions: wgpu::Buffer,
    pub triangles: wgpu::Buffer,
    /// The index in the mesh of the first triangle.
    pub first_triangle: u32,
    /// The number of triangles.
    pub count: u32,
    /// The rows of the triangles that are not covered as a whole.
    pub blocks: Vec<Blocks>,
}

/// Blocks of rows of triangles: in two words each, the triangle, and the first row and the axis.
pub struct Blocks {
    pub buffer: wgpu::Buffer,
    pub count: u32,
    /// Their depths need integers of 96 bits.
    pub are_hard: bool,
}

/// The geometry of a solid in device memory: one chunk, or as many as the adapter's largest binding requires.
pub struct ResidentSolid {
    pub chunks: Vec<Chunk>,
    /// Size in bytes.
    pub bytes: u64,
    /// The crossings that the projected areas of its triangles make likely along each axis.
    pub areas: [f64; 3],
    /// The number of crossings of jobs of whole images of this solid alone, by the set of their axes; zero where it is unknown.
    found: Mutex<[u64; 8]>,
}

/// Size in bytes of a position and of a triangle.
const CORNER_BYTES: u64 = 12;

/// Size in bytes of a block.
const BLOCK_BYTES: u64 = 8;

/// Triangles that one task measures.
const TRIANGLES_PER_TASK: usize = 1 << 14;

impl ResidentSolid {
    /// Copies the geometry of a solid to the device, in bindings of at most `largest` bytes.
    pub fn upload(device: &Device, solid: &LatticeSolid, largest: u64) -> Result<ResidentSolid, DeviceError> {
        let (positions, triangles) = (solid.positions(), solid.triangles());
        let most = (positions.len().max(triangles.len()) as u64) * CORNER_BYTES;
        let (mut chunks, mut areas) = (Vec::new(), [0.0; 3]);
        let mut add = |positions: &[[i32; 3]], triangles: &[[u32; 3]], first_triangle: usize| {
            let seen = Seen::of_all(Pixels::new(solid.grid().shift()), positions, triangles);
            areas = sum(areas, seen.areas);
            let mut blocks = upload_blocks(device, &seen.blocks, false, largest)?;
            blocks.extend(upload_blocks(device, &seen.hard_blocks, true, largest)?);
            chunks.push(Chunk {
                positions: device.upload("positions", bytemuck::cast_slice(positions))?,
                triangles: device.upload("triangles", bytemuck::cast_slice(&seen.triangles))?,
                first_triangle: first_triangle as u32,
                count: triangles.len() as u32,
                blocks,
            });
            Ok::<(), DeviceError>(())
        };
        if most <= largest {
            add(positions, triangles, 0)?;
        } else {
            // Each triangle has its own corners, which avoids an index of the vertices.
            let at_once = (largest / (3 * CORNER_BYTES)).max(1) as usize;
            for (index, part) in triangles.chunks(at_once).enumerate() {
                let corners: Vec<[i32; 3]> = part.iter().flatten().map(|&v| positions[v as usize]).collect();
                let numbered: Vec<[u32; 3]> = (0..part.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                add(&corners, &numbered, index * at_once)?;
            }
        }
        let bytes = |chunk: &Chunk| {
            let blocks: u64 = chunk.blocks.iter().map(|blocks| blocks.buffer.size()).sum();
            chunk.positions.size() + chunk.triangles.size() + blocks
        };
        Ok(ResidentSolid { bytes: chunks.iter().map(bytes).sum(), chunks, areas, found: Mutex::default() })
    }

    /// Returns the number of crossings that were found along a set of axes, a bit for each; zero if none were made.
    pub fn found(&self, axes: usize) -> u64 {
        held(&self.found)[axes]
    }

    /// Remembers how many there were.
    pub fn remember(&self, axes: usize, found: u64) {
        held(&self.found)[axes] = found;
    }
}

/// Triangles as they are seen along the three axes.
#[derive(Default)]
struct Seen {
    /// The areas of all, in pixels: the number of rays that they cross but for those that their edges win or lose.
    areas: [f64; 3],
    /// The triangles; the top bit of corner i is set where one is covered by its rows along axis i.
    triangles: Vec<[u32; 3]>,
    blocks: Vec<[u32; 2]>,
    hard_blocks: Vec<[u32; 2]>,
}

/// Triangles whose box covers more rays than this are covered row by row.
const SMALL_BOX: u64 = 256;

impl Seen {
    fn of_all(pixels: Pixels, positions: &[[i32; 3]], triangles: &[[u32; 3]]) -> Seen {
        let of_part = |(part, triangles): (usize, &[[u32; 3]])| {
            let mut seen = Seen { triangles: Vec::with_capacity(triangles.len()), ..Seen::default() };
            for (i, triangle) in triangles.iter().enumerate() {
                seen.add(pixels, positions, *triangle, (part * TRIANGLES_PER_TASK + i) as u32);
            }
            seen
        };
        let parts: Vec<Seen> = triangles.par_chunks(TRIANGLES_PER_TASK).enumerate().map(of_part).collect();
        // In the order of the triangles, so that every run expects the same.
        let mut all = Seen { triangles: Vec::with_capacity(triangles.len()), ..Seen::default() };
        for part in parts {
            all.areas = sum(all.areas, part.areas);
            all.triangles.extend(part.triangles);
            all.blocks.extend(part.blocks);
            all.hard_blocks.extend(part.hard_blocks);
        }
        all
    }

    fn add(&mut self, pixels: Pixels, positions: &[[i32; 3]], mut triangle: [u32; 3], index: u32) {
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        let edge = |to: [i32; 3]| [0, 1, 2].map(|i| i64::from(to[i] - a[i]));
        let (u, v) = (edge(b), edge(c));
        let normal = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| (u[i] * v[j] - u[j] * v[i]).unsigned_abs() as f64);
        let reach = [0, 1, 2].map(|i| u[i].abs().max(v[i].abs()) as f64);
        let rays =
            [0, 1, 2].map(|i| pixels.index_from(a[i].min(b[i]).min(c[i]))..pixels.index_from(a[i].max(b[i]).max(c[i])));
        let pixel = f64::from(1u32 << pixels.shift);
        for axis in Axis::ALL {
            let [column, row, depth] = [axis.column(), axis.row(), axis.depth()];
            self.areas[depth] += normal[depth] / 2.0 / (pixel * pixel);
            let (columns, rows) = (rays[column].clone(), rays[row].clone());
            let slopes = normal[column] * reach[column] + normal[row] * reach[row];
            let is_hard = is_hard(slopes, normal[depth]);
            let is_large = columns.len() as u64 * rows.len() as u64 > SMALL_BOX;
            let is_crossed = normal[depth] != 0.0 && !columns.is_empty() && !rows.is_empty();
            if is_crossed && !(is_hard || is_large) {
                continue;
            }
            // One that no ray crosses has no rows to be covered.
            triangle[depth] |= 1 << 31;
            if !is_crossed {
                continue;
            }
            let blocks = rows.step_by(BLOCK_ROWS as usize).map(|row| [index, (row as u32) << 2 | depth as u32]);
            if is_hard { &mut self.hard_blocks } else { &mut self.blocks }.extend(blocks);
        }
        self.triangles.push(triangle);
    }
}

/// Returns whether `f32` guesses a depth so badly that what is left of it may not fit 64 bits (`crossing_of` in
/// `shaders/fixed.wgsl`). `slopes` is the sum of the slopes times their reaches times the depth component of the normal. The
/// roundings of slopes, products and their sum are below 2^-19 of it.
fn is_hard(slopes: f64, by_depth: f64) -> bool {
    let doubt_times_depth = slopes / f64::from(1 << 19) + 2.0 * by_depth;
    // The correction of a doubt of 2^17 is right to a sixth.
    doubt_times_depth > f64::from(1 << 17) * by_depth || doubt_times_depth > (1u64 << 60) as f64
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] + b[i])
}

/// Copies blocks of rows to the device.
fn upload_blocks(
    device: &Device,
    blocks: &[[u32; 2]],
    are_hard: bool,
    largest: u64,
) -> Result<Vec<Blocks>, DeviceError> {
    // One invocation for each row is counted in 32 bits.
    let at_once = (largest / BLOCK_BYTES).clamp(1, u64::from(u32::MAX / BLOCK_ROWS)) as usize;
    let upload = |blocks: &[[u32; 2]]| {
        let buffer = device.upload("blocks of rows", bytemuck::cast_slice(blocks))?;
        Ok(Blocks { buffer, count: blocks.len() as u32, are_hard })
    };
    blocks.chunks(at_once).map(upload).collect()
}

/// Returns the bytes that the geometry of some solids takes in bindings of at most `largest` bytes, each solid once, but for blocks
/// of rows.
pub fn bytes_of_all(solids: &[&LatticeSolid], largest: u64) -> u64 {
    let is_first = |i: &usize| !solids[..*i].iter().any(|other| other.identity() == solids[*i].identity());
    let bytes = |i: usize| {
        let [positions, triangles] = [solids[i].positions().len(), solids[i].triangles().len()].map(|n| n as u64);
        match CORNER_BYTES * positions.max(triangles) <= largest {
            true => CORNER_BYTES * (positions + triangles),
            // Each triangle with its own corners.
            false => 4 * CORNER_BYTES * triangles,
        }
    };
    (0..solids.len()).filter(is_first).map(bytes).sum()
}

/// The most recently sampled solids, so that three axes cost one upload.
#[derive(Default)]
pub struct Residents {
    /// Solids by the identity of their geometry, the last used at the end.
    solids: Vec<(u64, Arc<ResidentSolid>)>,
}

impl Residents {
    /// Returns the solid in device memory, after copying it there if necessary; others are evicted where all would
    /// exceed `budget` bytes, or where the device has no memory for it.
    pub fn get(
        &mut self,
        device: &Device,
        solid: &LatticeSolid,
        largest: u64,
        budget: u64,
    ) -> Result<Arc<ResidentSolid>, DeviceError> {
        let place = self.solids.iter().position(|(identity, _)| *identity == solid.identity());
        let entry = match place {
            Some(place) => self.solids.remove(place),
            None => {
                let mut uploaded = ResidentSolid::upload(device, solid, largest);
                if matches!(uploaded, Err(DeviceError::OutOfMemory { .. })) && !self.solids.is_empty() {
                    self.solids.clear();
                    uploaded = ResidentSolid::upload(device, solid, largest);
                }
                (solid.identity(), Arc::new(uploaded?))
            }
        };
        let resident = Arc::clone(&entry.1);
        self.solids.push(entry);
        while self.solids.len() > 1 && self.solids.iter().map(|(_, solid)| solid.bytes).sum::<u64>() > budget {
            self.solids.remove(0);
        }
        Ok(resident)
    }
}
