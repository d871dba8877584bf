//! Voxels: images as a dense grid that states of every lattice node whether it is inside, for programs that cannot read images.
//!
//! A voxel is the cube of one pitch around a node; it is 1 where the node is inside according to [`NodePlanes`], and 0
//! elsewhere. Voxels hold less than the images they are made from, which locate a surface between two nodes; the volume of
//! voxels is a count of nodes.
//!
//! Grids are streamed plane by plane: a grid of 1024³ takes the memory of the images, the bits of 32 planes, and one plane of
//! bytes or, for `.vti`, 32 MiB of blocks that are compressed in parallel.

mod npy;
mod vti;

pub use npy::write_npy;
pub use vti::write_vti;

use std::io;

use crate::parallel::*;

use crate::ldi::{NodePlanes, NodeSlab};

/// The file formats of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// VTK image data, which ParaView opens: stores the position of the voxels.
    Vti,
    /// A numpy array: stores the voxels alone.
    Npy,
}

impl Format {
    /// Returns the format for a file extension, ignoring case.
    pub fn from_extension(extension: &str) -> Option<Format> {
        [("vti", Format::Vti), ("npy", Format::Npy)]
            .into_iter()
            .find_map(|(known, format)| extension.eq_ignore_ascii_case(known).then_some(format))
    }
}

/// Counts of the voxels written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Voxels whose nodes are inside.
    pub inside: u64,
    /// Voxels at whose nodes the images disagree.
    pub disagreements: u64,
}

/// Planes whose bits are made at the same time; each slab searches all rays along z for its first plane.
const SLAB: i32 = 32;

/// Passes every plane to `take`, in ascending z: a byte for each voxel, x fastest.
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

/// Fills the bytes of a plane from its bits; returns the number of ones.
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
    //! Test images for voxels.

    use crate::ldi::Ldi;
    use crate::sampler::Mode;
    use crate::solids;
    use crate::testing::images::images_of;

    /// Returns the images of a torus, with `resolution` nodes along x and y, and fewer along z.
    pub fn torus(resolution: u32, mode: Mode) -> Vec<Ldi> {
        images_of(solids::torus(3.0, 1.0, 31, 17).unwrap(), resolution, 32, mode).to_vec()
    }

    /// Returns whether a node is inside an image along z, sample by sample.
    pub fn is_inside(image: &Ldi, [x, y, z]: [u32; 3]) -> bool {
        let samples = image.samples(y * image.size().0 + x);
        samples.iter().filter(|&&depth| depth < image.grid().node(z)).count() % 2 == 1
    }

    /// Returns the voxels of an image along z, x fastest.
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
