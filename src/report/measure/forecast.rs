//! The memory of a report: what would not fit is refused, before the system ends the process.

use glam::DVec3;

use super::Study;
use super::raster::{Subject, not_whole};
use super::slices::node_ranges;
use super::transport::multiple;
use crate::Error;
use crate::driver::job::Spacing;
use crate::driver::machine;
use crate::driver::memory::{self, Cost, Limit};
use crate::grid::Grid;
use crate::metrics::{BoundaryCondition, Phase};
use crate::number::number;
use crate::report::Settings;

/// Memory per node in bytes while most arrays are alive, those of thickness: two distances, two maps or a map and the marks of dropped
/// balls, and the largest balls. 22 were measured at 512 rays of a gyroid, 29 at 256, where balls are denser (`docs/performance.md`).
const BYTES_OF_NODE: f64 = 32.0;

/// Memory of an equation of tortuosity in bytes per conducting node ([`diffusive`](crate::metrics::tortuosity::diffusive)).
const BYTES_OF_UNKNOWN: f64 = 130.0;

/// Memory of tortuosity in bytes per node besides: the lengths of three paths at a time, and what an equation has for all nodes.
const BYTES_BESIDE: f64 = 20.0;

/// Limit of the number of nodes: indices have 31 bits.
const NODES_MAX: f64 = 2_147_483_648.0;

/// Refuses rasters whose fields would not fit.
///
/// # Errors
/// A machine error with the memory that is needed, the limit, and the raster that would fit.
pub fn admit_fields(subject: &Subject, grid: &Grid, settings: &Settings) -> Result<(), Error> {
    // All nodes may conduct.
    let forecast = Forecast::new(subject, grid, settings, BYTES_OF_UNKNOWN + BYTES_BESIDE);
    let Forecast { limit, held: fixed, .. } = forecast;
    let nodes = memory::nodes(grid);
    let [x, y, z] = grid.rays();
    let name = subject.solid.name();
    let cost = Cost { fixed, of_nodes: BYTES_OF_NODE * nodes, ..Cost::default() };
    if nodes >= NODES_MAX {
        let factor = (nodes / (0.9 * NODES_MAX)).cbrt();
        let factor = match limit.bytes() {
            Some(_) => memory::fitting(&[cost], limit).map(|fits| fits.max(factor)),
            None => Some(factor),
        };
        return Err(Error::machine(format!(
            "{name}: {x} × {y} × {z} nodes (limit {NODES_MAX}), which need about {} of memory; {}",
            memory::size(BYTES_OF_NODE * nodes),
            forecast.coarser(factor)
        )));
    }
    let fields = format_args!("{name}: the fields of {x} × {y} × {z} nodes");
    memory::admit(&[cost], limit, fields, |factor| forecast.coarser(factor))
}

/// Refuses equations of tortuosity that would not fit, in a region that has them.
///
/// # Errors
/// A machine error with the memory that is needed, the limit, and the raster that would fit.
pub fn admit_equations(study: &Study) -> Result<(), Error> {
    let Study { subject, settings, region, .. } = study;
    if !region.is_box() {
        return Ok(());
    }
    let nodes = region.nodes().count();
    let solid = Phase::Solid.nodes(&study.solid, region.nodes()).count();
    let conducting = solid.max(nodes - solid) as f64 / nodes as f64;
    let forecast = Forecast::new(subject, region.grid(), settings, BYTES_OF_UNKNOWN * conducting + BYTES_BESIDE);
    let pitch = region.grid().pitch();
    let times = forecast.multiple(pitch);
    let [x, y, z] = node_ranges(region).map(|range| range.len().div_ceil(times as usize));
    let equations = format_args!("{}: the equations of tortuosity on {x} × {y} × {z} nodes", subject.solid.name());
    let way_out = |factor: Option<f64>| match forecast.fewer_equations(pitch) {
        Some(option) => format!("{option} would fit"),
        // The fields fit, so that any coarser raster may do.
        None => forecast.coarser(factor.map(|_| 1.0)),
    };
    memory::admit(&[forecast.cost_of_equations(pitch, times)], forecast.limit, equations, way_out)
}

/// The memory of equations, on rasters that a report might have.
struct Forecast<'a> {
    subject: &'a Subject<'a>,
    settings: &'a Settings,
    limit: Limit,
    /// The bytes that the process holds already.
    held: f64,
    /// The raster of the report.
    grid: &'a Grid,
    /// The bytes of an equation per node.
    of_equations: f64,
}

impl<'a> Forecast<'a> {
    fn new(subject: &'a Subject, grid: &'a Grid, settings: &'a Settings, of_equations: f64) -> Forecast<'a> {
        let (limit, held) = (Limit::new(settings.memory), machine::held_memory() as f64);
        Forecast { subject, settings, limit, held, grid, of_equations }
    }

    /// Returns the sides of the region.
    fn extent(&self) -> DVec3 {
        self.subject.roi.unwrap_or(self.subject.solid).bounds().extent()
    }

    /// Returns the advice to take a raster whose pitch is at least `factor` times as long.
    fn coarser(&self, factor: Option<f64>) -> String {
        let Forecast { subject: Subject { solid, roi }, settings, .. } = self;
        let extent = self.extent();
        let longest = extent.max_element();
        let most = memory::rays_within(factor, longest, self.grid);
        let is_periodic = settings.edges == BoundaryCondition::Periodic;
        let is_whole = |rays: &u32| !is_periodic || not_whole(extent, longest / f64::from(*rays)).is_none();
        let with_equations = |rays: u32| {
            let pitch = longest / f64::from(rays);
            let fit = self.fit(pitch, self.multiple(pitch)).then(String::new);
            let equations = fit.or_else(|| self.fewer_equations(pitch).map(|option| format!(" with {option}")))?;
            Some((rays, equations))
        };
        let (rays, equations) = (1..=most).rev().filter(is_whole).find_map(with_equations).unwrap_or_default();
        // A pitch of seven digits does not divide the sides of a period.
        let spacing = if is_periodic { Spacing::Resolution(rays) } else { settings.spacing };
        let sizes = roi.map(|roi| {
            let [solid, roi] = [solid, &roi].map(|solid| number(solid.bounds().extent().max_element()));
            format!("; the solid is {solid} long and the region of interest {roi}: are both in one unit?")
        });
        memory::advice(rays, longest, spacing) + &equations + &sizes.unwrap_or_default()
    }

    /// Returns the option for the finest raster on which the equations of a report fit at a pitch, if not on that of the settings.
    fn fewer_equations(&self, pitch: f64) -> Option<String> {
        let rays = self.rays(pitch);
        let longest = rays.into_iter().max().unwrap_or(1);
        let option = |times: u32| {
            let most = longest.div_ceil(times);
            let is_possible = most > 1 && multiple(rays, most, self.settings.edges) == times;
            (is_possible && self.fit(pitch, times)).then(|| format!("--tortuosity-resolution {most}"))
        };
        (self.multiple(pitch) + 1..=longest).find_map(option)
    }

    /// Returns the rays of a report at a pitch, those of [`Subject::grid_of_pitch`].
    fn rays(&self, pitch: f64) -> [u32; 3] {
        self.subject.bounds().extent().to_array().map(|side| (side / pitch - 1e-9).ceil().max(1.0) as u32)
    }

    /// Returns the pitch of the raster for the equations of a report at a pitch, as a multiple of it.
    fn multiple(&self, pitch: f64) -> u32 {
        multiple(self.rays(pitch), self.settings.tortuosity_resolution, self.settings.edges)
    }

    fn fit(&self, pitch: f64, times: u32) -> bool {
        memory::fits(self.cost_of_equations(pitch, times), self.limit)
    }

    /// Returns the cost of equations on a raster whose pitch is a multiple of that of a report.
    fn cost_of_equations(&self, pitch: f64, times: u32) -> Cost {
        let nodes: f64 = (self.extent() / (pitch * f64::from(times))).ceil().max(DVec3::ONE).element_product();
        Cost { fixed: self.held, of_nodes: self.of_equations * nodes, ..Cost::default() }
    }
}
