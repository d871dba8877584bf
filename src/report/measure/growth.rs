//! The change of the main metrics as the region grows: a test of whether it represents the structure.
//!
//! The parts are centred in the region and have from half its sides to all of them. Thickness and widths come from the map of
//! the whole region, so that no part has boundaries of its own.

use std::ops::Range;

use crate::parallel::*;

use super::slices::node_ranges;
use crate::bits::ones;
use crate::metrics::{NodeSet, Phase, Region};
use crate::report::id::{self, Statistic};
use crate::report::scaffold_report::{Convergence, ConvergenceSeries, Varied};

/// The parts, as shares of the region's sides.
const SHARES: [f64; 5] = [0.5, 0.625, 0.75, 0.875, 1.0];

/// Values in growing parts of a region.
pub struct Growth {
    parts: [[Range<usize>; 3]; 5],
    porosity: Vec<Option<f64>>,
    thickness: Vec<Option<f64>>,
    width: Vec<Option<f64>>,
}

impl Growth {
    /// Returns the parts of a region, with the porosity of their nodes.
    pub fn of(region: &Region, solid: &NodeSet) -> Growth {
        let ranges = node_ranges(region);
        let parts = SHARES.map(|share| {
            ranges.clone().map(|Range { start, end }| {
                let cut = ((1.0 - share) * 0.5 * (end - start) as f64).round() as usize;
                start + cut..(end - cut).max(start + cut + 1)
            })
        });
        let inside = solid.and(region.nodes());
        let porosity = parts.iter().map(|part| {
            let [all, solid] = [region.nodes(), &inside].map(|nodes| sum(nodes, part, |_| 1.0));
            (all > 0.0).then(|| 1.0 - solid / all)
        });
        Growth { porosity: porosity.collect(), parts, thickness: Vec::new(), width: Vec::new() }
    }

    /// Records the means of a phase's map, which is in pitches.
    pub fn take(&mut self, phase: Phase, map: &[f32], nodes: &NodeSet, pitch: f64) {
        let means = self.parts.iter().map(|part| {
            let count = sum(nodes, part, |_| 1.0);
            (count > 0.0).then(|| pitch * sum(nodes, part, |node| f64::from(map[node])) / count)
        });
        let means = means.collect();
        match phase {
            Phase::Solid => self.thickness = means,
            Phase::Pore => self.width = means,
        }
    }

    /// Returns the study; phases that were absent are left out.
    pub fn finished(self) -> Convergence {
        let series = [
            (id::POROSITY, self.porosity),
            (id::SOLID_THICKNESS.of(Statistic::Mean), self.thickness),
            (id::PORE_THICKNESS.of(Statistic::Mean), self.width),
        ];
        let found = series.into_iter().filter(|(_, values)| !values.is_empty());
        Convergence {
            over: Varied::Region,
            at: SHARES.to_vec(),
            series: found.map(|(metric, values)| ConvergenceSeries { metric, values, order: None }).collect(),
        }
    }
}

/// Sums a term over the nodes of a set within a part, plane by plane.
fn sum(nodes: &NodeSet, [xs, ys, zs]: &[Range<usize>; 3], term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let [columns, rows, _] = nodes.size();
    let of_row = |y: usize, z: usize| -> f64 {
        let found = ones(nodes.row(y, z)).skip_while(|&x| x < xs.start).take_while(|&x| x < xs.end);
        found.map(|x| term((z * rows + y) * columns + x)).sum()
    };
    let by_plane: Vec<f64> = zs.clone().into_par_iter().map(|z| ys.clone().map(|y| of_row(y, z)).sum()).collect();
    by_plane.iter().sum()
}
