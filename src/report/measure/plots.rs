//! Distributions, ready to be drawn.

use crate::mesh::LengthUnit;
use crate::metrics::{Distribution, Phase};

use crate::report::quantity::Quantity;
use crate::report::sheet::HistogramPlot;

/// Bins of a histogram.
const BINS: usize = 64;

/// Shares of the weight whose values are marked.
const MARKED: [f64; 4] = [0.01, 0.05, 0.5, 0.95];

/// What a plot is called and how to read it.
#[derive(Clone, Copy, Debug)]
pub struct Plot {
    pub id: &'static str,
    pub title: &'static str,
    /// What it shows, and what good and bad look like.
    pub reading: &'static str,
}

/// A distribution of lengths.
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
