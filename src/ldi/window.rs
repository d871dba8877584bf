//! The part of an image in a box.

use std::ops::Range;

use super::Ldi;
use crate::grid::{FineBox, Grid};

impl Ldi {
    /// Returns the part of the image of a solid [along](crate::grid::LatticeSolid::along) its axis that lies in the box.
    pub(crate) fn in_box(&self, fine: &FineBox) -> Ldi {
        let (mut pixels, along) = (fine.grid().rays().map(|count| 0..count), self.axis().depth());
        pixels[along] = fine.pixels()[along].clone();
        self.window(*fine.grid(), &pixels)
    }

    /// Returns the part of an image whose rays and nodes are in a range of pixels along each axis, on a grid of these. Where the solid
    /// extends beyond it, it is cut off there; a new sample has the triangle of the one that it replaces.
    ///
    /// # Panics
    /// Panics if a range extends beyond the image.
    pub(crate) fn window(&self, window: Grid, pixels: &[Range<u32>; 3]) -> Ldi {
        let (grid, axis) = (self.grid(), self.axis());
        let [columns, rows, along] = [axis.column(), axis.row(), axis.depth()].map(|i| pixels[i].clone());
        let [first, last] = [along.start, along.end].map(|pixel| (pixel << grid.shift()) as i32);
        let mut offsets = vec![0];
        let (mut depths, mut triangles) = (Vec::new(), Vec::new());
        for row in rows {
            for column in columns.clone() {
                let ray = row * self.size().0 + column;
                let start = self.offsets()[ray as usize] as usize;
                let samples = self.samples(ray);
                let (from, to) = (samples.partition_point(|&d| d <= first), samples.partition_point(|&d| d < last));
                // Inside where an odd number of samples lie before.
                let kept = from - from % 2..to + to % 2;
                depths.extend(samples[kept.clone()].iter().map(|d| d.clamp(&first, &last) - first));
                if let Some(of_samples) = self.triangles() {
                    triangles.extend_from_slice(&of_samples[start + kept.start..start + kept.end]);
                }
                offsets.push(depths.len() as u32);
            }
        }
        Ldi { grid: window, axis, offsets, depths, triangles, windings: None, unclosed: Vec::new() }
    }
}
