//! Distributions, ready to be drawn.

use crate::mesh::LengthUnit;
use crate::metrics::{Distribution, Phase};
use crate::report::quantity::Quantity;
use crate::report::scaffold_report::HistogramPlot;

/// Number of bins of a histogram.
const BINS: usize = 64;

/// Shares of the weight whose quantiles are marked.
const MARKED: [f64; 4] = [0.01, 0.05, 0.5, 0.95];

/// The title of a plot and a guide to reading it.
#[derive(Clone, Copy, Debug)]
pub struct Plot {
    pub id: &'static str,
    pub title: &'static str,
    /// The meaning of the plot, with examples of good and bad ones.
    pub reading: &'static str,
}

/// Returns the histogram of a distribution of lengths.
pub fn histogram(plot: Plot, phase: Phase, values: &Distribution, unit: Option<LengthUnit>) -> HistogramPlot {
    let histogram = values.histogram(BINS);
    HistogramPlot {
        id: plot.id.to_owned(),
        title: plot.title.to_owned(),
        unit: Quantity::Length(1).of(unit),
        phase: phase.name(),
        range: histogram.range,
        shares: histogram.shares,
        mean: values.mean(),
        deviation: values.deviation(),
        quantiles: MARKED.map(|share| (share, values.quantile(share))).to_vec(),
        reading: plot.reading,
    }
}
