//! Convergence: the change of the main metrics with the raster.

use super::Study;
use super::balls::Balls;
use super::raster::Subject;
use super::record::Record;
use crate::Error;
use crate::grid::Grid;
use crate::ldi::{Mode, NodePlanes};
use crate::metrics::{BoundaryCondition, Distribution, Facets, NodeSet, Phase};
use crate::report::Settings;
use crate::report::id::{self, MetricId, Statistic};
use crate::report::scaffold_report::{Convergence, ConvergenceSeries, Varied};
use crate::sampler::Sampler;

/// The metrics that are measured again on coarser rasters.
const WATCHED: [MetricId; 5] = [
    id::POROSITY,
    id::SURFACE_DENSITY,
    id::SOLID_THICKNESS.of(Statistic::Mean),
    id::PORE_THICKNESS.of(Statistic::Mean),
    id::PERCOLATION,
];

/// Measures the watched metrics at four times and twice the pitch, and appends those at the pitch itself.
pub fn over_pitch(
    subject: Subject,
    settings: &Settings,
    grid: &Grid,
    sampler: &dyn Sampler,
    record: &Record,
) -> Result<Convergence, Error> {
    // A periodic cell must consist of whole pitches.
    let fits =
        |times: &u32| settings.edges != BoundaryCondition::Periodic || grid.rays().iter().all(|rays| rays % times == 0);
    let mut at: Vec<f64> = [4, 2].into_iter().filter(fits).map(|times| f64::from(times) * grid.pitch()).collect();
    let mut columns = Vec::new();
    for &pitch in &at {
        columns.push(watched(subject, settings, pitch, sampler)?);
    }
    at.push(grid.pitch());
    columns.push(WATCHED.map(|id| record.value(id)));
    let series = WATCHED.iter().enumerate().map(|(i, &metric)| {
        let values: Vec<Option<f64>> = columns.iter().map(|column| column[i]).collect();
        ConvergenceSeries { metric, order: order(&values), values }
    });
    Ok(Convergence { over: Varied::Pitch, at, series: series.collect() })
}

/// Returns the observed order of convergence of values at 4, 2 and 1 pitches: log₂ of the ratio of their differences. `None` if
/// the values are not monotone, or do not differ.
fn order(values: &[Option<f64>]) -> Option<f64> {
    let [Some(coarse), Some(middle), Some(fine)] = values else { return None };
    let ratio = (coarse - middle) / (middle - fine);
    (ratio.is_finite() && ratio > 0.0).then(|| ratio.log2())
}

/// Measures the watched metrics at another pitch.
fn watched(
    subject: Subject,
    settings: &Settings,
    pitch: f64,
    sampler: &dyn Sampler,
) -> Result<[Option<f64>; 5], Error> {
    let grid = subject.grid_of_pitch(pitch)?;
    let images = subject.sample(&grid, settings.fill, sampler)?;
    let region = images.region();
    let planes = NodePlanes::new(&images.solid, Mode::Exact).expect("images along the three axes of one grid");
    let study = Study { subject, settings, images: &images, region: &region, solid: NodeSet::of_planes(&planes) };
    let mesh = subject.solid.mesh();
    let facets = Facets::of(&mesh.positions, &mesh.triangles);
    let surface = images.surface(&facets, &region).area();
    let porosity = 1.0 - images.volume(&region, &[]).value / region.volume();
    let found = Balls::of(&study);
    let means = Phase::BOTH.map(|phase| {
        let widths = Distribution::of_map(&found.thickness(phase), pitch)?;
        widths.mean().is_finite().then(|| widths.mean())
    });
    let spans = found.percolation(&study);
    let percolation = spans.and_then(|[x, y, z]| Some(pitch * x?.diameter.min(y?.diameter).min(z?.diameter)));
    Ok([Some(porosity), Some(surface / region.volume()), means[0], means[1], percolation])
}
