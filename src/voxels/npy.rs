//! Voxels as `.npy`: an array of uint8 and shape (nx, ny, nz) that `numpy.load` opens, where `a[i, j, k]` is the voxel around
//! node (i, j, k).
//!
//! The array is in Fortran order, x fastest, since planes along z are written one after another. The format cannot store the
//! position of the voxels: voxel (i, j, k) is the cube of one pitch around `origin + (i + ½, j + ½, k + ½) · pitch + step` of
//! the grid.
//!
//! Arrays of other programs are read in either order, by numpy's indices and not by byte order: `a[i, j, k]` is the voxel (i,
//! j, k) in both.

use std::io::{self, Read, Write};

use rayon::prelude::*;

use super::{Written, each_plane};
use crate::ldi::NodePlanes;
use crate::ldi::npz::HeaderError;
use crate::ldi::npz::npy::{Class, Header, Kind, Order, Scalar, write_header};

/// Writes all voxels.
pub fn write_npy(nodes: &NodePlanes, mut to: impl Write) -> io::Result<Written> {
    let shape = nodes.grid().rays().map(|n| n as usize);
    write_header(&mut to, "'|u1'", Order::Fortran, &shape)?;
    let written = each_plane(nodes, |plane| to.write_all(plane))?;
    to.flush()?;
    Ok(written)
}

/// Voxels read from a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Voxels {
    /// Number of voxels along x, y and z.
    pub size: [usize; 3],
    /// One byte for each voxel, x fastest, with the array's value.
    pub bytes: Vec<u8>,
}

/// The reason why an array cannot be read as voxels.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The header is not understood.
    #[error("the array {0}")]
    Header(#[from] HeaderError),
    /// Elements are not bytes.
    #[error("the array has elements {found}; voxel arrays must be uint8 or int8")]
    Kind {
        /// The element type in numpy's notation.
        found: String,
    },
    /// The array has not three dimensions, or a side of zero length, or more elements than can be counted.
    #[error("the array has shape {shape:?}; voxel arrays must have three dimensions, none of them 0")]
    Shape {
        /// Its shape.
        shape: Vec<u64>,
    },
    /// There are fewer or more elements than the header says.
    #[error("the array has {found} elements{}, but its shape requires {expected}", if *.found > *.expected { " or more" } else { "" })]
    Length {
        /// The number of elements after the header; one more than expected where there are too many.
        found: u64,
        /// The number of elements expected.
        expected: u64,
    },
    /// The elements could not be read.
    #[error("the array cannot be read: {0}")]
    Io(#[from] io::Error),
}

/// Reads voxels. Needs one byte of memory per element, two where the array is in C order.
pub fn read_npy(mut from: impl Read) -> Result<Voxels, ReadError> {
    let header = Header::read(&mut from)?;
    match &header.kind {
        Kind::Plain(Scalar { class: Class::Signed | Class::Unsigned, bytes: 1 }) => {}
        other => return Err(ReadError::Kind { found: other.to_string() }),
    }
    let wrong_shape = || ReadError::Shape { shape: header.shape.clone() };
    let sides: [u64; 3] = header.shape.as_slice().try_into().map_err(|_| wrong_shape())?;
    let expected = sides.iter().try_fold(1u64, |product, &side| product.checked_mul(side));
    let expected = expected.filter(|&product| product > 0 && product < usize::MAX as u64).ok_or_else(wrong_shape)?;
    let mut bytes = Vec::new();
    from.take(expected + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 != expected {
        return Err(ReadError::Length { found: bytes.len() as u64, expected });
    }
    let size = sides.map(|side| side as usize);
    let bytes = if header.order == Order::C { x_fastest(size, &bytes) } else { bytes };
    Ok(Voxels { size, bytes })
}

/// Reorders elements from C order, z fastest, to x fastest.
fn x_fastest([nx, ny, nz]: [usize; 3], bytes: &[u8]) -> Vec<u8> {
    let mut turned = vec![0; bytes.len()];
    turned.par_chunks_mut(nx).enumerate().for_each(|(row, turned)| {
        let (y, z) = (row % ny, row / ny);
        turned.iter_mut().enumerate().for_each(|(x, byte)| *byte = bytes[(x * ny + y) * nz + z]);
    });
    turned
}

#[cfg(test)]
mod tests {
    use super::super::testing::{torus, voxels};
    use super::*;
    use crate::sampler::{Estimate, Mode};

    #[test]
    fn voxels_equal_the_nodes() {
        // Rows of two words and part of a third; one slab of planes and part of a second.
        let images = torus(140, Mode::Exact);
        let rays = images[0].grid().rays();
        assert!(rays[0] > 64 && !rays[0].is_multiple_of(64) && rays[2] > 32 && !rays[2].is_multiple_of(32), "{rays:?}");
        let expected = voxels(&images[2]);
        for chosen in [&images[..], &images[..1]] {
            let mut file = Vec::new();
            let written = write_npy(&NodePlanes::new(chosen, Mode::Exact).unwrap(), &mut file).unwrap();
            let mut elements = file.as_slice();
            let header = Header::read(&mut elements).unwrap();
            assert_eq!((header.order, &header.shape[..]), (Order::Fortran, &rays.map(u64::from)[..]));
            assert!(matches!(header.kind, Kind::Plain(scalar) if scalar.to_string() == "<u1"));
            assert!(elements == expected);
            let inside = expected.iter().map(|&voxel| u64::from(voxel)).sum();
            assert_eq!(written, Written { inside, disagreements: 0 });
        }
    }

    #[test]
    fn disagreements_of_estimates_are_counted() {
        let over = torus(150, Mode::Estimate(Estimate::Over));
        let write = |combine| {
            let mut file = Vec::new();
            write_npy(&NodePlanes::new(&over, combine).unwrap(), &mut file).unwrap()
        };
        let (any, all) = (write(Mode::OVER), write(Mode::UNDER));
        assert!(any.disagreements > 0);
        assert_eq!(any.inside - all.inside, any.disagreements);
    }

    /// Returns a file whose array holds bytes that count up in storage order.
    fn counting(descr: &str, order: Order, shape: &[usize], elements: u8) -> Vec<u8> {
        let mut file = Vec::new();
        write_header(&mut file, descr, order, shape).unwrap();
        file.extend(0..elements);
        file
    }

    #[test]
    fn voxels_are_addressed_by_index_in_either_order() {
        let of = |order| read_npy(counting("'|u1'", order, &[2, 3, 4], 24).as_slice()).unwrap();
        let (fortran, c) = (of(Order::Fortran), of(Order::C));
        assert_eq!((fortran.size, c.size), ([2, 3, 4], [2, 3, 4]));
        assert_eq!(fortran.bytes, (0..24).collect::<Vec<u8>>());
        for (i, byte) in c.bytes.iter().enumerate() {
            let (x, y, z) = (i % 2, i / 2 % 3, i / 6);
            assert_eq!(usize::from(*byte), (x * 3 + y) * 4 + z, "{x} {y} {z}");
        }
    }

    #[test]
    fn written_voxels_are_read_back() {
        let images = torus(70, Mode::Exact);
        let mut file = Vec::new();
        write_npy(&NodePlanes::new(&images, Mode::Exact).unwrap(), &mut file).unwrap();
        let read = read_npy(file.as_slice()).unwrap();
        assert_eq!(read.size, images[0].grid().rays().map(|n| n as usize));
        assert!(read.bytes == voxels(&images[2]));
    }

    #[test]
    fn other_arrays_are_refused() {
        let refused = |file: Vec<u8>| read_npy(file.as_slice()).unwrap_err().to_string();
        for (descr, shape, elements, says) in [
            ("'<f4'", &[2, 3, 4][..], 24, "elements <f4"),
            ("'|u1'", &[6, 4], 24, "shape [6, 4]"),
            ("'|u1'", &[6, 0, 4], 24, "shape [6, 0, 4]"),
            ("'|u1'", &[1 << 40, 1 << 40, 4], 24, "three sides"),
            ("'|u1'", &[2, 3, 4], 23, "23 elements, but its shape requires 24"),
            ("'|u1'", &[2, 3, 4], 25, "25 elements or more"),
        ] {
            let said = refused(counting(descr, Order::C, shape, elements));
            assert!(said.contains(says), "{said}");
        }
        assert!(refused(b"PK\x03\x04\0\0\0\0".to_vec()).contains("signature of a .npy"));
    }
}
