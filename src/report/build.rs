//! The facade: a builder of reports, and the report of a solid in memory.

use std::fmt;
use std::ops::Index;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;

use super::files::{Made, Task, checked_limits, limits, report_on, steps_of_report, write_report};
use super::limits::Limits as ParsedLimits;
use super::measure::Clock;
use super::page::words;
use super::scaffold_report::{Metric, ScaffoldReport, Verdict};
use super::{Roi, Settings as Course};
use crate::driver::backend::Backends;
use crate::driver::input::{InputRequirements, Sides, ready};
use crate::driver::job::{Openness, Spacing};
use crate::length::Length;
use crate::metrics::BoundaryCondition;
use crate::{Error, Settings, Solid};

/// Limits that metrics are checked against.
#[derive(Clone, Debug)]
pub struct Limits {
    parsed: ParsedLimits,
}

impl Limits {
    /// Reads limits (TOML): `porosity = { min = "50 %", max = "90 %" }`.
    ///
    /// # Errors
    /// If the file cannot be read, or limits a metric that does not exist; the error names the nearest ones.
    pub fn open(path: impl AsRef<Path>) -> Result<Limits, Error> {
        Ok(Limits { parsed: limits(path.as_ref(), None)? })
    }

    /// Reads limits from text.
    ///
    /// # Errors
    /// If the text limits a metric that does not exist; the error names the nearest ones.
    pub fn parse(text: &str) -> Result<Limits, Error> {
        Ok(Limits { parsed: checked_limits(Path::new("limits"), text, None)? })
    }
}

/// A builder of a report: the solid, its region of interest, its limits and the course of the measurement.
#[derive(Clone, Debug)]
pub struct ReportBuilder {
    solid: Solid,
    region: Option<Roi<Solid>>,
    limits: Option<Limits>,
    course: Course,
}

/// The metrics of a scaffold: a map from metric id to value, bounds, unit and status.
///
/// ```
/// use ldi_ops::{Report, Settings, Solid, solids};
///
/// let cube = solids::hollow_box(glam::DVec3::splat(3.0), glam::DVec3::ONE)?;
/// let cube = Solid::from_triangles(cube.positions, cube.triangles)?;
/// let report = Report::of(&cube).measure(&Settings::rays(24))?;
/// assert!((report["porosity"].value.unwrap() - 1.0 / 27.0).abs() < 1e-6);
/// println!("{}", report["porosity"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Report {
    scaffold: ScaffoldReport,
}

impl Report {
    /// Returns the builder of a report on a solid within its box.
    pub fn of(solid: &Solid) -> ReportBuilder {
        ReportBuilder { solid: solid.clone(), region: None, limits: None, course: Course::default() }
    }

    /// Returns all metrics, in the order of the catalogue.
    pub fn metrics(&self) -> &[Metric] {
        &self.scaffold.metrics
    }

    /// Returns a metric by its id: `porosity`, `solid.thickness.mean`.
    pub fn get(&self, id: &str) -> Option<&Metric> {
        self.scaffold.metric(id)
    }

    /// Returns the outcome of the limits, if any were given.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.scaffold.verdict.as_ref()
    }

    /// Returns all data of the report.
    pub fn scaffold_report(&self) -> &ScaffoldReport {
        &self.scaffold
    }

    /// Writes `report.html`, `metrics.json`, `metrics.csv` and `methods.txt` to a folder, which is created if it is missing.
    ///
    /// # Errors
    /// If the folder or a file cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), Error> {
        write_report(&self.scaffold, folder.as_ref())
    }
}

impl Index<&str> for Report {
    type Output = Metric;

    /// # Panics
    /// If there is no metric of this id; see [`get`](Report::get).
    fn index(&self, id: &str) -> &Metric {
        self.get(id).unwrap_or_else(|| panic!("no metric `{id}`"))
    }
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.value {
            Some(value) => {
                let unit = self.unit.for_people();
                let space = if unit.is_empty() { "" } else { " " };
                f.pad(&format!("{}{space}{unit}", words::with_error(value, self.error, &self.unit)))
            }
            None => f.pad(&format!("– ({})", words::reason(self))),
        }
    }
}

impl ReportBuilder {
    /// Measures within a closed solid: the bone around the scaffold.
    pub fn region(self, region: &Solid) -> Self {
        self.within(Roi::Solid(region.clone()))
    }

    /// Measures within the convex hull of the solid.
    pub fn within_hull(self) -> Self {
        self.within(Roi::Hull)
    }

    /// Measures within the solid with all pores filled that a ball of a diameter from outside cannot enter.
    pub fn within_wrap(self, diameter: f64) -> Self {
        self.within(Roi::Wrap(Some(Length { value: diameter, unit: None })))
    }

    /// Measures within a region of interest.
    pub fn within(mut self, region: Roi<Solid>) -> Self {
        self.region = Some(region);
        self
    }

    /// Checks the metrics against limits.
    pub fn limits(mut self, limits: &Limits) -> Self {
        self.limits = Some(limits.clone());
        self
    }

    /// Sets the boundary condition at the faces of the region.
    pub fn edges(mut self, edges: BoundaryCondition) -> Self {
        self.course.edges = edges;
        self
    }

    /// Sets the rays along the longest side of the raster that diffusion is solved on.
    pub fn tortuosity_rays(mut self, rays: u32) -> Self {
        self.course.tortuosity_resolution = rays;
        self
    }

    /// Sets the direction that is up in the printer, and the angle from the horizontal in degrees below which a facet overhangs.
    pub fn printed(mut self, up: DVec3, overhang_angle: f64) -> Self {
        (self.course.build, self.course.overhang_angle) = (up, overhang_angle);
        self
    }

    /// Sets the course of the measurement, but for what the settings of [`measure`](ReportBuilder::measure) say.
    pub(super) fn course(mut self, course: Course) -> Self {
        self.course = course;
        self
    }

    /// Leaves out the view of the solid, which no metric needs and which takes seconds.
    pub fn without_view(mut self) -> Self {
        self.course.is_drawn = false;
        self
    }

    /// Measures the solid.
    ///
    /// # Errors
    /// If the fill rule does not allow the solid, the raster does not fit into memory, a limit does not apply, or the caller
    /// cancels.
    pub fn measure(mut self, settings: &Settings) -> Result<Report, Error> {
        settings.check()?;
        self.course.check(self.region.is_some()).map_err(Error::Usage)?;
        self.course.spacing = settings.spacing();
        if let Spacing::Tolerance(_) = self.course.spacing {
            return Err(Error::Usage("a report has no tolerance; set rays or a pitch".to_owned()));
        }
        self.course.fill = settings.fill_rule();
        self.course.backend = settings.device().clone();
        self.course.memory = settings.memory();
        settings.run(|monitor| {
            monitor.expect(steps_of_report(self.region.as_ref()))?;
            let (start, clock) = (Instant::now(), Clock::default());
            let requirements = InputRequirements {
                unit: None,
                openness: Openness::Refused,
                sides: Sides::NotNeeded,
                fill: self.course.fill,
                hashes: false,
            };
            let mut solids = vec![self.solid.inner().clone()];
            if let Some(Roi::Solid(region)) = &self.region {
                solids.push(region.inner().clone());
            }
            let warnings = ready(&mut solids, requirements)?;
            let backends = Backends::open(&self.course.backend)?;
            let task = Task {
                settings: &self.course,
                made: self.region.as_ref().and_then(Made::of),
                requirements,
                command_line: String::new(),
                warnings,
                backends: &backends,
                start,
            };
            let mut scaffold = report_on(task, solids, clock, monitor)?;
            if let Some(Limits { parsed }) = &self.limits {
                scaffold.verdict = Some(parsed.judge(&scaffold.metrics, scaffold.unit).map_err(Error::input)?);
            }
            Ok(Report { scaffold })
        })
    }
}
