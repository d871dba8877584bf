//! Voxels: images as a dense grid that says of every lattice node whether it is inside, for programs that know no images.
//!
//! A voxel is the cube of one pitch around a node, and is 1 where the node is inside and 0 where not, which is what
//! [`NodePlanes`] tells. So voxels hold less than the images they are made from, which know where between two nodes a surface
//! lies; their volume is a count of nodes.
//!
//! Grids are written plane by plane and never held: a grid of 1024³ takes the images, the bits of 32 planes, and one plane of
//! bytes or, for `.vti`, 32 MiB of blocks that are compressed at the same time.

mod npy;
mod vti;

pub use npy::{ReadError, Voxels, read_npy, write_npy};
pub use vti::write_vti;

use std::io;

use rayon::prelude::*;

use crate::ldi::{NodePlanes, NodeSlab};

/// The formats that voxels are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Image data of VTK, which ParaView opens: knows where the voxels lie.
    Vti,
    /// An array of numpy: knows nothing but the voxels.
    Npy,
}

impl Format {
    /// The format of files with an extension, in whatever case.
    pub fn from_extension(extension: &str) -> Option<Format> {
        [("vti", Format::Vti), ("npy", Format::Npy)]
            .into_iter()
            .find_map(|(known, format)| extension.eq_ignore_ascii_case(known).then_some(format))
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Voxels whose nodes are inside.
    pub inside: u64,
    /// Voxels about whose nodes the images disagree.
    pub disagreements: u64,
}

/// Planes whose bits are made at the same time: each time all rays along z are searched for where the planes begin.
const SLAB: i32 = 32;

/// Hands on every plane, z after z: a byte for each voxel, x fastest.
fn each_plane(nodes: &NodePlanes, mut take: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<Written> {
    let [columns, rows, planes] = nodes.grid().rays();
    let mut bytes = vec![0; columns as usize * rows as usize];
    let mut written = Written::default();
    let mut first = 0;
    while first < planes as i32 {
        let slab = nodes.slab(first..(first + SLAB).min(planes as i32), 0);
        for plane in first..slab.end() {
            written.inside += fill(&slab, plane, columns as usize, &mut bytes);
            take(&bytes)?;
        }
        written.disagreements += slab.disagreements(first..slab.end());
        first = slab.end();
    }
    Ok(written)
}

/// Fills the bytes of a plane from its bits; gives how many are 1.
fn fill(slab: &NodeSlab, plane: i32, columns: usize, bytes: &mut [u8]) -> u64 {
    let rows = bytes.par_chunks_mut(columns).enumerate().with_min_len(16);
    rows.map(|(row, bytes)| {
        for (bytes, &word) in bytes.chunks_mut(64).zip(slab.row(row, plane)) {
            bytes.iter_mut().enumerate().for_each(|(bit, byte)| *byte = (word >> bit & 1) as u8);
        }
        bytes.iter().map(|&byte| u64::from(byte)).sum::<u64>()
    })
    .sum()
}

#[cfg(test)]
mod testing {
    //! Images to make voxels of.

    use crate::grid::{Axis, Grid};
    use crate::ldi::Ldi;
    use crate::mesh::ClosedMesh;
    use crate::sampler::cpu::CpuSampler;
    use crate::sampler::{Fill, Mode, Sampler};
    use crate::solids;

    /// The images of a torus, with `resolution` nodes along x and y, and fewer along z.
    pub fn torus(resolution: u32, mode: Mode) -> Vec<Ldi> {
        let closed = ClosedMesh::check(solids::torus(3.0, 1.0, 31, 17).unwrap()).unwrap();
        let grid = Grid::with_resolution(closed.bounds(), resolution, 32).unwrap();
        let solid = grid.quantise(&closed).unwrap();
        Axis::ALL.map(|axis| CpuSampler::default().sample(&solid, axis, mode, Fill::EvenOdd).unwrap()).to_vec()
    }

    /// Whether a node is inside an image along z, sample by sample.
    pub fn is_inside(image: &Ldi, [x, y, z]: [u32; 3]) -> bool {
        let samples = image.samples(y * image.size().0 + x);
        samples.iter().filter(|&&depth| depth < image.grid().node(z)).count() % 2 == 1
    }

    /// The voxels of an image along z, x fastest.
    pub fn voxels(image: &Ldi) -> Vec<u8> {
        let [columns, rows, planes] = image.grid().rays();
        let mut voxels = Vec::new();
        for z in 0..planes {
            for y in 0..rows {
                voxels.extend((0..columns).map(|x| u8::from(is_inside(image, [x, y, z]))));
            }
        }
        voxels
    }
}
