//! Voxel arrays in the form that metrics take.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use ldi_ops::grid::{Axis, Grid, LatticeBox};
use ldi_ops::ldi::Ldi;
use ldi_ops::metrics::{NodeSet, Region};
use ldi_ops::voxels::read_npy;

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
    /// Reads an array of `uint8`; nonzero voxels are solid.
    pub fn read(path: &Path) -> Result<Array, BenchError> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(BenchError::io(name.clone()))?;
        let voxels = read_npy(BufReader::new(file)).map_err(|error| BenchError::model(&name, error))?;
        Array::of(NodeSet::from_bytes(voxels.size, &voxels.bytes)).map_err(|error| BenchError::model(&name, error))
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
}
