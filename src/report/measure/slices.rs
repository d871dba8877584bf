//! Slices through the middle of the region, node by node.

use std::ops::Range;

use crate::grid::{Axis, Grid};
use crate::metrics::{NodeSet, Phase, Region};
use crate::report::scaffold_report::{Slice, SliceNode};

/// A slice under construction.
pub struct SliceMaker {
    slice: Slice,
    axis: Axis,
    /// The index of the slice's plane of nodes along its axis.
    at: usize,
    /// The first column and row of the slice in the raster.
    first: [usize; 2],
}

/// Returns slices across x, y and z through the middle of the region's box, without values yet.
pub fn through_the_middle(region: &Region, solid: &NodeSet) -> Vec<SliceMaker> {
    Axis::ALL.map(|axis| SliceMaker::new(region, solid, axis)).into()
}

impl SliceMaker {
    fn new(region: &Region, solid: &NodeSet, axis: Axis) -> SliceMaker {
        let ranges = node_ranges(region);
        let [columns, rows] = [axis.column(), axis.row()];
        let Range { start, end } = ranges[axis.depth()];
        let at = (start + end - 1) / 2;
        let first = [ranges[columns].start, ranges[rows].start];
        let size = [columns, rows].map(|along| ranges[along].len());
        let grid = region.grid();
        let mut maker = SliceMaker {
            slice: Slice {
                across: axis.name(),
                position: position(grid, axis, at),
                along: [columns, rows].map(|along| Axis::ALL[along].name()),
                size,
                nodes: Vec::with_capacity(size[0] * size[1]),
                pitch: grid.pitch(),
            },
            axis,
            at,
            first,
        };
        for row in 0..size[1] {
            for column in 0..size[0] {
                let node = maker.node(column, row);
                maker.slice.nodes.push(match (region.nodes().contains(node), solid.contains(node)) {
                    (false, _) => SliceNode::Outside,
                    (true, true) => SliceNode::Solid(0.0),
                    (true, false) => SliceNode::Pore(0.0),
                });
            }
        }
        maker
    }

    /// Returns the node of the raster at a place of the slice.
    fn node(&self, column: usize, row: usize) -> [usize; 3] {
        let mut node = [0; 3];
        node[self.axis.depth()] = self.at;
        node[self.axis.column()] = self.first[0] + column;
        node[self.axis.row()] = self.first[1] + row;
        node
    }

    /// Copies the values of a phase from a map of the whole raster, in pitches, x fastest.
    pub fn fill(&mut self, phase: Phase, map: &[f32], size: [usize; 3]) {
        let pitch = self.slice.pitch as f32;
        let columns = self.slice.size[0];
        for i in 0..self.slice.nodes.len() {
            let [x, y, z] = self.node(i % columns, i / columns);
            let value = map[(z * size[1] + y) * size[0] + x] * pitch;
            match (&mut self.slice.nodes[i], phase) {
                (SliceNode::Solid(width), Phase::Solid) | (SliceNode::Pore(width), Phase::Pore) => *width = value,
                _ => {}
            }
        }
    }

    /// Returns the slice.
    pub fn finished(self) -> Slice {
        self.slice
    }
}

/// Returns the world coordinate of a node; 0 if it differs from 0 by rounding only.
pub fn position(grid: &Grid, axis: Axis, node: usize) -> f64 {
    let position = grid.origin()[axis.depth()] + grid.step() * f64::from(grid.node(node as u32));
    if position.abs() < 1e-6 * grid.pitch() { 0.0 } else { position }
}

/// Returns the ranges of nodes along each axis that may lie in the region.
pub fn node_ranges(region: &Region) -> [Range<usize>; 3] {
    let [low, high] = region.bounds_in_pitches();
    let size = region.nodes().size();
    [0, 1, 2].map(|axis| {
        let last = size[axis] - 1;
        let first = (low[axis].ceil().max(0.0) as usize).min(last);
        first..(high[axis].floor().max(0.0) as usize).clamp(first, last) + 1
    })
}
