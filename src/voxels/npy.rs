//! Voxels as `.npy`: an array of uint8 and shape (nx, ny, nz) that `numpy.load` opens, where `a[i, j, k]` is the voxel around
//! node (i, j, k).
//!
//! The array is in Fortran order, x fastest, since planes along z are written one after another. The format cannot store the
//! position of the voxels: voxel (i, j, k) is the cube of one pitch around `origin + (i + ½, j + ½, k + ½) · pitch + step` of
//! the grid.

use std::io::{self, Write};

use super::{Written, each_plane};
use crate::ldi::NodePlanes;
use crate::ldi::npz::npy::{Order, write_header};

/// Writes all voxels.
pub fn write_npy(nodes: &NodePlanes, mut to: impl Write) -> io::Result<Written> {
    let shape = nodes.grid().rays().map(|n| n as usize);
    write_header(&mut to, "'|u1'", Order::Fortran, &shape)?;
    let written = each_plane(nodes, |plane| to.write_all(plane))?;
    to.flush()?;
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{torus, voxels};
    use super::*;
    use crate::ldi::npz::npy::{Header, Kind};
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
}
