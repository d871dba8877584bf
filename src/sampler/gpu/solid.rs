//! Solids in device memory.

use std::sync::Arc;

use crate::gpu::{Device, DeviceError};
use crate::grid::LatticeSolid;

/// A run of triangles of a solid with the positions that they use.
pub struct Chunk {
    pub positions: wgpu::Buffer,
    pub triangles: wgpu::Buffer,
    /// The index in the mesh of the first triangle.
    pub first_triangle: u32,
    /// The number of triangles.
    pub count: u32,
}

/// The geometry of a solid in device memory: one chunk, or as many as the adapter's largest binding requires.
pub struct ResidentSolid {
    pub chunks: Vec<Chunk>,
    /// Size in bytes.
    pub bytes: u64,
}

/// Size in bytes of a position and of a triangle.
const CORNER_BYTES: u64 = 12;

impl ResidentSolid {
    /// Copies the geometry of a solid to the device, in bindings of at most `largest` bytes.
    pub fn upload(device: &Device, solid: &LatticeSolid, largest: u64) -> Result<ResidentSolid, DeviceError> {
        let (positions, triangles) = (solid.positions(), solid.triangles());
        let most = (positions.len().max(triangles.len()) as u64) * CORNER_BYTES;
        let mut chunks = Vec::new();
        if most <= largest {
            chunks.push(Chunk {
                positions: device.upload("positions", bytemuck::cast_slice(positions))?,
                triangles: device.upload("triangles", bytemuck::cast_slice(triangles))?,
                first_triangle: 0,
                count: triangles.len() as u32,
            });
        } else {
            // Each triangle has its own corners, which avoids an index of the vertices.
            let at_once = (largest / (3 * CORNER_BYTES)).max(1) as usize;
            for (index, part) in triangles.chunks(at_once).enumerate() {
                let corners: Vec<[i32; 3]> = part.iter().flatten().map(|&v| positions[v as usize]).collect();
                let numbered: Vec<u32> = (0..3 * part.len() as u32).collect();
                chunks.push(Chunk {
                    positions: device.upload("positions", bytemuck::cast_slice(&corners))?,
                    triangles: device.upload("triangles", bytemuck::cast_slice(&numbered))?,
                    first_triangle: (index * at_once) as u32,
                    count: part.len() as u32,
                });
            }
        }
        let bytes = chunks.iter().map(|chunk| chunk.positions.size() + chunk.triangles.size()).sum();
        Ok(ResidentSolid { chunks, bytes })
    }
}

/// The most recently sampled solids, so that three axes cost one upload.
#[derive(Default)]
pub struct Residents {
    /// Solids by the identity of their geometry, the last used at the end.
    solids: Vec<(u64, Arc<ResidentSolid>)>,
}

impl Residents {
    /// Returns the solid in device memory, after copying it there if necessary; others are evicted where all would
    /// exceed `budget` bytes.
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
            None => (solid.identity(), Arc::new(ResidentSolid::upload(device, solid, largest)?)),
        };
        let resident = Arc::clone(&entry.1);
        self.solids.push(entry);
        while self.solids.len() > 1 && self.solids.iter().map(|(_, solid)| solid.bytes).sum::<u64>() > budget {
            self.solids.remove(0);
        }
        Ok(resident)
    }
}
