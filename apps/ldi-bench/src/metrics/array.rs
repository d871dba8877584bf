//! Voxel arrays in the form that metrics take.

use std::fs;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid, LatticeBox};
use ldi_ops::ldi::Ldi;
use ldi_ops::metrics::{NodeSet, Region};
use rayon::prelude::*;

use crate::BenchError;

/// Log₂ of the lattice steps per pitch; faces of voxels lie on the lattice.
const SHIFT: u32 = 16;

/// Solid voxels of an array, as nodes and as images whose rays cross the surface at the faces of voxels. A voxel is 1 wide.
pub struct Array {
    /// The solid.
    pub nodes: NodeSet,
    grid: Grid,
    /// Images along x, y and z.
    pub images: [Ldi; 3],
    /// Seconds of making each image.
    pub seconds: [f64; 3],
}

impl Array {
    /// Reads an array of `uint8` or `int8`; nonzero voxels are solid.
    pub fn read(path: &Path) -> Result<Array, BenchError> {
        let name = path.display().to_string();
        let file = fs::read(path).map_err(BenchError::io(name.clone()))?;
        let (size, bytes) = voxels(&file).map_err(|error| BenchError::model(&name, error))?;
        Array::of(NodeSet::from_bytes(size, &bytes)).map_err(|error| BenchError::model(&name, error))
    }

    /// Makes an array from nodes, each the centre of a voxel.
    pub fn of(nodes: NodeSet) -> Result<Array, ldi_ops::grid::GridError> {
        let grid = Grid::from_parts(DVec3::ZERO, 1.0, nodes.size().map(|n| n as u32), SHIFT, 1024)?;
        let timed = Axis::ALL.map(|axis| {
            let start = Instant::now();
            (image(&nodes, grid, axis), start.elapsed().as_secs_f64())
        });
        let seconds = timed.each_ref().map(|&(_, seconds)| seconds);
        Ok(Array { nodes, grid, images: timed.map(|(image, _)| image), seconds })
    }

    /// Returns the whole array as a region.
    pub fn region(&self) -> Region<'_> {
        let max = [0, 1, 2].map(|axis| self.grid.length(axis));
        Region::of_box(&self.grid, LatticeBox { min: [0; 3], max })
    }
}

/// Returns the sides of an array as numpy and ldi-ops write it, version 1.0, and its elements, x fastest in either order.
fn voxels(file: &[u8]) -> Result<([usize; 3], Vec<u8>), String> {
    let rest = file.strip_prefix(b"\x93NUMPY\x01\x00").ok_or("the file has no mark of a .npy file of version 1.0")?;
    let (length, rest) = rest.split_first_chunk().ok_or("the header is cut off")?;
    let (header, elements) =
        rest.split_at_checked(u16::from_le_bytes(*length).into()).ok_or("the header is cut off")?;
    let header = String::from_utf8_lossy(header);
    let value = |key: &str| Some(header.split_once(key)?.1.trim_start());
    let is_of_bytes = |descr: &str| ["'|u1'", "'|i1'"].iter().any(|bytes| descr.starts_with(bytes));
    if !value("'descr':").is_some_and(is_of_bytes) {
        return Err(format!("voxels are of type uint8 or int8: {header}"));
    }
    let shape = value("'shape': (").and_then(|rest| rest.split_once(')')).map_or("", |(shape, _)| shape);
    let sides = shape.split(',').map(str::trim).filter(|side| !side.is_empty()).map(|side| side.parse().ok());
    let size: Option<[usize; 3]> = sides.collect::<Option<Vec<usize>>>().and_then(|sides| sides.try_into().ok());
    let size = size.ok_or_else(|| format!("voxels have three sides: {header}"))?;
    let expected = size.iter().try_fold(1usize, |product, &side| product.checked_mul(side)).filter(|&all| all > 0);
    if expected != Some(elements.len()) {
        return Err(format!("there are {} elements: {header}", elements.len()));
    }
    if value("'fortran_order':").is_some_and(|order| order.starts_with("True")) {
        return Ok((size, elements.to_vec()));
    }
    let [nx, ny, nz] = size;
    let mut turned = vec![0; elements.len()];
    turned.par_chunks_mut(nx).enumerate().for_each(|(row, turned)| {
        let (y, z) = (row % ny, row / ny);
        turned.iter_mut().enumerate().for_each(|(x, byte)| *byte = elements[(x * ny + y) * nz + z]);
    });
    Ok((size, turned))
}

/// Returns the image along an axis: each run of solid voxels is a span.
fn image(nodes: &NodeSet, grid: Grid, axis: Axis) -> Ldi {
    let (columns, rows) = grid.image_size(axis);
    let length = nodes.size()[axis.depth()];
    let mut offsets = vec![0];
    let mut depths = Vec::new();
    for ray in 0..columns * rows {
        let mut node = [0; 3];
        node[axis.column()] = (ray % columns) as usize;
        node[axis.row()] = (ray / columns) as usize;
        let mut was_inside = false;
        for depth in 0..=length {
            node[axis.depth()] = depth;
            let is_inside = depth < length && nodes.contains(node);
            if is_inside != was_inside {
                depths.push((depth << SHIFT) as i32);
                was_inside = is_inside;
            }
        }
        offsets.push(depths.len() as u32);
    }
    Ldi::from_parts(grid, axis, offsets, depths, Vec::new()).expect("runs of voxels are spans of an image")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ldi_ops::ldi::{Mode, NodePlanes};
    use ldi_ops::voxels::write_npy;

    #[test]
    fn images_have_the_nodes_of_the_array() {
        // The sides differ and are not whole words, and there is solid at the faces.
        let nodes = NodeSet::from_fn([67, 5, 9], |[x, y, z]| (x * x + 3 * y + 7 * z) % 5 < 2);
        let array = Array::of(nodes.clone()).unwrap();
        let planes = NodePlanes::new(&array.images, Mode::OVER).unwrap();
        assert!(NodeSet::of_planes(&planes) == nodes);
        let planes = NodePlanes::new(&array.images, Mode::UNDER).unwrap();
        assert!(NodeSet::of_planes(&planes) == nodes);
        assert_eq!(array.region().volume(), 67.0 * 5.0 * 9.0);
        assert_eq!(array.region().nodes().count(), 67 * 5 * 9);
    }

    /// Returns a file as numpy writes it, whose array holds bytes that count up in storage order.
    fn counting(descr: &str, order: &str, shape: &str, elements: u8) -> Vec<u8> {
        let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}");
        let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((length as u16).to_le_bytes());
        file.extend(format!("{header:length$}").bytes());
        file.extend(0..elements);
        file
    }

    #[test]
    fn voxels_are_addressed_by_index_in_either_order() {
        let of = |order| voxels(&counting("'|u1'", order, "(2, 3, 4)", 24)).unwrap();
        let (fortran, c) = (of("True"), of("False"));
        assert_eq!((fortran.0, c.0), ([2, 3, 4], [2, 3, 4]));
        assert_eq!(fortran.1, (0..24).collect::<Vec<u8>>());
        for (i, byte) in c.1.iter().enumerate() {
            let (x, y, z) = (i % 2, i / 2 % 3, i / 6);
            assert_eq!(usize::from(*byte), (x * 3 + y) * 4 + z, "{x} {y} {z}");
        }
    }

    #[test]
    fn written_voxels_are_read_back() {
        let nodes = NodeSet::from_fn([67, 5, 9], |[x, y, z]| (x * x + 3 * y + 7 * z) % 5 < 2);
        let array = Array::of(nodes.clone()).unwrap();
        let mut file = Vec::new();
        write_npy(&NodePlanes::new(&array.images, Mode::OVER).unwrap(), &mut file).unwrap();
        let (size, bytes) = voxels(&file).unwrap();
        assert_eq!(size, nodes.size());
        assert!(NodeSet::from_bytes(size, &bytes) == nodes);
    }

    #[test]
    fn other_arrays_are_refused() {
        for (descr, shape, elements, says) in [
            ("'<f4'", "(2, 3, 4)", 24, "voxels are of type uint8"),
            ("'|u1'", "(6, 4)", 24, "three sides"),
            ("'|u1'", "(6, 0, 4)", 24, "24 elements"),
            ("'|u1'", "(1099511627776, 1099511627776, 4)", 24, "24 elements"),
            ("'|u1'", "(2, 3, 4)", 23, "23 elements"),
            ("'|u1'", "(2, 3, 4)", 25, "25 elements"),
        ] {
            let said = voxels(&counting(descr, "False", shape, elements)).unwrap_err();
            assert!(said.contains(says), "{said}");
        }
        assert!(voxels(b"PK\x03\x04\0\0\0\0").unwrap_err().contains("mark of a .npy"));
    }
}
