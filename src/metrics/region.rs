//! Regions of interest.

use crate::parallel::*;

use super::NodeSet;
use crate::grid::{Axis, Grid, LatticeBox};
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::ldi::{Ldi, Mode, NodePlanes, Spans};

/// The volume of interest (VOI): the box of a solid, or the inside of another mesh.
#[derive(Clone, Debug)]
pub struct Region<'a> {
    grid: Grid,
    within: Within<'a>,
    bounds: LatticeBox,
    nodes: NodeSet,
    volume: f64,
}

#[derive(Clone, Copy, Debug)]
enum Within<'a> {
    Box,
    /// Exact images along x, y and z.
    Solid(&'a [Ldi; 3]),
}

impl<'a> Region<'a> {
    /// Creates a box within a grid, in lattice positions. All nodes of the grid that lie in it belong to the region.
    pub fn of_box(grid: &Grid, bounds: LatticeBox) -> Region<'a> {
        let size = grid.rays().map(|n| n as usize);
        let inside: [Vec<bool>; 3] = [0, 1, 2].map(|axis| {
            let (min, max) = (bounds.min[axis], bounds.max[axis]);
            (0..size[axis] as u32).map(|i| (min..=max).contains(&grid.node(i))).collect()
        });
        let nodes = NodeSet::from_fn(size, |[x, y, z]| inside[0][x] && inside[1][y] && inside[2][z]);
        let sides = [0, 1, 2].map(|axis| f64::from(bounds.max[axis] - bounds.min[axis]) * grid.step());
        Region { grid: *grid, within: Within::Box, bounds, nodes, volume: sides.iter().product() }
    }

    /// Creates the region inside a solid, from its exact images along x, y and z. Its volume is that of the images.
    pub fn of_solid(images: &'a [Ldi; 3]) -> Region<'a> {
        let grid = *images[0].grid();
        let planes = NodePlanes::new(images, Mode::Exact).expect("images along the three axes of one grid");
        let nodes = NodeSet::of_planes(&planes);
        let bounds = Axis::ALL.map(|axis| {
            let depths = images[axis.depth()].depths();
            (depths.par_iter().min().copied().unwrap_or(0), depths.par_iter().max().copied().unwrap_or(0))
        });
        let bounds = LatticeBox { min: bounds.map(|(min, _)| min), max: bounds.map(|(_, max)| max) };
        let volume = VolumeEstimate::from_axes(&images.each_ref().map(AxisVolume::of)).value;
        Region { grid, within: Within::Solid(images), bounds, nodes, volume }
    }

    /// Returns the raster.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns whether the region is a box.
    pub fn is_box(&self) -> bool {
        matches!(self.within, Within::Box)
    }

    /// Returns the images of the solid that bounds the region; `None` for a box.
    pub fn images(&self) -> Option<&'a [Ldi; 3]> {
        match self.within {
            Within::Box => None,
            Within::Solid(images) => Some(images),
        }
    }

    /// Returns the box around the region, in lattice positions.
    pub fn bounds(&self) -> LatticeBox {
        self.bounds
    }

    /// Returns the box around the region in pitches, node `i` lying at `i`: lower and upper corner.
    pub fn bounds_in_pitches(&self) -> [[f64; 3]; 2] {
        let place = |position: i32| f64::from(position - self.grid.node(0)) / f64::from(1u32 << self.grid.shift());
        [self.bounds.min.map(place), self.bounds.max.map(place)]
    }

    /// Returns the lower and upper corner of a box in pitches, whose faces are walls with
    /// [`BoundaryCondition::Border`](super::BoundaryCondition::Border).
    pub fn walls(&self) -> Option<[[f32; 3]; 2]> {
        self.is_box().then(|| self.bounds_in_pitches().map(|corner| corner.map(|place| place as f32)))
    }

    /// Returns the nodes in the region.
    pub fn nodes(&self) -> &NodeSet {
        &self.nodes
    }

    /// Returns TV, in cubic world units.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Returns the segments of a ray that lie in the region, in lattice positions; `ray` is row · columns + column.
    pub fn spans(&self, axis: Axis, ray: u32) -> RegionSpans<'a> {
        match self.within {
            Within::Box => {
                let (columns, _) = self.grid.image_size(axis);
                let is_in = |coordinate: usize, index: u32| {
                    let node = self.grid.node(index);
                    (self.bounds.min[coordinate]..=self.bounds.max[coordinate]).contains(&node)
                };
                let meets = is_in(axis.column(), ray % columns) && is_in(axis.row(), ray / columns);
                let depth = axis.depth();
                RegionSpans::Box(meets.then_some((self.bounds.min[depth], self.bounds.max[depth])))
            }
            Within::Solid(images) => RegionSpans::Solid(Spans::new(images[axis.depth()].samples(ray))),
        }
    }
}

/// The segments of a ray that lie in a region, ascending.
#[derive(Clone, Debug)]
pub enum RegionSpans<'a> {
    /// The segment within a box, if the ray meets it.
    Box(Option<(i32, i32)>),
    /// The spans of a solid.
    Solid(Spans<'a>),
}

impl Iterator for RegionSpans<'_> {
    type Item = (i32, i32);

    fn next(&mut self) -> Option<(i32, i32)> {
        match self {
            RegionSpans::Box(span) => span.take(),
            RegionSpans::Solid(spans) => spans.next(),
        }
    }
}
