//! Reports as users ask for them.

use std::fmt;
use std::ops::Index;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;

use super::files::{Made, Task, checked_limits, limits, sheet, steps_of_sheet, write_sheet};
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

/// Limits that metrics are held to.
#[derive(Clone, Debug)]
pub struct Limits {
    parsed: ParsedLimits,
}

impl Limits {
    /// Reads limits (TOML): `porosity = { min = "50 %", max = "90 %" }`.
    ///
    /// # Errors
    /// Files that cannot be read, and limits on metrics that do not exist, with the nearest name.
    pub fn open(path: impl AsRef<Path>) -> Result<Limits, Error> {
        Ok(Limits { parsed: limits(path.as_ref(), None)? })
    }

    /// Reads limits from text.
    ///
    /// # Errors
    /// Limits on metrics that do not exist, with the nearest name.
    pub fn parse(text: &str) -> Result<Limits, Error> {
        Ok(Limits { parsed: checked_limits(Path::new("limits"), text, None)? })
    }
}

/// A report to be made: the solid, its region of interest, its limits and the course of the measurement.
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
    sheet: ScaffoldReport,
}

impl Report {
    /// Returns a report to be made of a solid within its box.
    pub fn of(solid: &Solid) -> ReportBuilder {
        ReportBuilder {
            solid: solid.clone(),
            region: None,
            limits: None,
            course: Course {
                spacing: Settings::default().spacing(),
                tortuosity_resolution: 128,
                edges: BoundaryCondition::Border,
                fill: crate::FillRule::EvenOdd,
                build: DVec3::Z,
                overhang_angle: 45.0,
                kozeny: 5.0,
                memory: None,
                backend: crate::Backend::Auto,
            },
        }
    }

    /// Returns all metrics, in the order of the catalogue.
    pub fn metrics(&self) -> &[Metric] {
        &self.sheet.metrics
    }

    /// Returns a metric by its id: `porosity`, `solid.thickness.mean`.
    pub fn get(&self, id: &str) -> Option<&Metric> {
        self.sheet.metric(id)
    }

    /// Returns the outcome of the limits, if any were given.
    pub fn verdict(&self) -> Option<&Verdict> {
        self.sheet.verdict.as_ref()
    }

    /// Returns all data of the report.
    pub fn sheet(&self) -> &ScaffoldReport {
        &self.sheet
    }

    /// Writes `report.html`, `metrics.json`, `metrics.csv` and `methods.txt` to a folder, which is made if it is not there.
    ///
    /// # Errors
    /// Folders and files that cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), Error> {
        write_sheet(&self.sheet, folder.as_ref())
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
    pub fn region(mut self, region: &Solid) -> Self {
        self.region = Some(Roi::Solid(region.clone()));
        self
    }

    /// Measures within the convex hull of the solid.
    pub fn within_hull(mut self) -> Self {
        self.region = Some(Roi::Hull);
        self
    }

    /// Measures within the solid with all pores filled that a ball of a diameter from outside cannot enter.
    pub fn within_wrap(mut self, diameter: f64) -> Self {
        self.region = Some(Roi::Wrap(Some(Length { value: diameter, unit: None })));
        self
    }

    /// Holds the metrics to limits.
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

    /// Measures.
    ///
    /// # Errors
    /// Solids that the fill rule does not allow, rasters that do not fit into memory, limits that do not apply, and operations
    /// that the caller stops.
    pub fn measure(mut self, settings: &Settings) -> Result<Report, Error> {
        settings.check()?;
        self.course.spacing = settings.spacing();
        if let Spacing::Tolerance(_) = self.course.spacing {
            return Err(Error::Usage("reports take no tolerance; give rays or a pitch".to_owned()));
        }
        self.course.fill = settings.fill_rule();
        self.course.backend = settings.device().clone();
        self.course.memory = settings.memory();
        settings.run(|monitor| {
            monitor.expect(steps_of_sheet(self.region.as_ref()))?;
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
            let mut sheet = sheet(task, solids, clock, monitor)?;
            if let Some(Limits { parsed }) = &self.limits {
                sheet.verdict = Some(parsed.judge(&sheet.metrics, sheet.unit).map_err(Error::input)?);
            }
            Ok(Report { sheet })
        })
    }
}
