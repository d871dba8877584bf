//! Reports of several solids: measures them one after another and writes their files.
//!
//! The files of a solid are written as soon as it is measured, so that the failure of a later solid loses none of them.

use std::collections::HashSet;
use std::fmt::Display;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::slice;
use std::time::{Instant, SystemTime};

use glam::DVec3;

use super::limits::Limits;
use super::measure::{Clock, Subject, admit_fields, measure, stages, unmeasured};
use super::page::summary::{Entry, Unmeasured};
use super::page::{self, compare, summary};
use super::scaffold_report::{self, Alert, InputFile, ScaffoldReport, Severity};
use super::{ReportJob, Roi, write};
use crate::cancel::checkpoint;
use crate::closest::{ClosestTriangle, closest_to_origin};
use crate::driver::backend::Backends;
use crate::driver::input::{self, InputRequirements, Sides, Solid};
use crate::driver::job::Input;
use crate::driver::memory::{Cost, Limit, admit};
use crate::driver::work::work;
use crate::driver::{FillDifference, machine, output};
use crate::grid::{Axis, Grid, LOD_RANGE};
use crate::length::Length;
use crate::mesh::{Aabb, ClosedMesh, LengthUnit, Precision, TriangleMesh, convex_hull};
use crate::metrics;
use crate::metrics::wrap::RADIUS_MIN;
use crate::number::number;
use crate::parallel::*;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, Sampler};
use crate::surface::{Coordinates, contour_in};
use crate::{Error, ErrorKind, Monitor, Warning};

/// The reports of a job, and its failures.
pub struct Reported {
    /// The reports, in the order of the inputs.
    pub reports: Vec<ScaffoldReport>,
    /// The pages, the one to open first in front; none without a folder.
    pub pages: Vec<PathBuf>,
    /// The solids that could not be measured, if there were several.
    pub failures: Vec<Unmeasured>,
    /// All failures in one text.
    pub failed: Option<String>,
    /// The worst kind of failure.
    pub worst: Option<ErrorKind>,
}

impl Reported {
    /// Returns whether all limits are kept.
    pub fn passed(&self) -> bool {
        self.reports.iter().filter_map(|report| report.verdict.as_ref()).all(|verdict| verdict.passed)
    }
}

/// Measures solids one after another and, where the job has a folder, writes the files of each as soon as it is measured, then
/// those over all of them. `on_report` takes each report before it is written.
///
/// # Errors
/// If limits cannot be read, files cannot be written, or no solid can be measured. If only some of several solids cannot be
/// measured, the result lists them.
pub fn report_files(
    job: &ReportJob,
    progress: &Monitor,
    mut on_report: impl FnMut(&ScaffoldReport),
) -> Result<Reported, Error> {
    let limits = job.limits.as_deref().map(|path| limits(path, job.unit)).transpose()?;
    let backends = Backends::open(&job.settings.backend)?;
    if let Some(second) = &job.compare {
        // If it cannot be read, that shows before the first design is measured for nothing.
        progress.stage(format!("{}: reading", second.path.display()))?;
        input::solids(slice::from_ref(second), InputRequirements { hashes: false, ..requirements(job) })?;
    }
    let (mut places, mut reports, mut failures) = (Vec::new(), Vec::new(), Vec::new());
    let mut worst = None;
    let each = steps_of_report(job.roi.as_ref()) + READING_AND_WRITING;
    progress.expect(each * (job.solids.len() + usize::from(job.compare.is_some())))?;
    for (i, (place, input)) in self::places(job).into_iter().zip(job.solids.iter().chain(&job.compare)).enumerate() {
        let mut report = match report_of(job, input, &backends, progress) {
            Ok(report) => report,
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            // The others are measured all the same.
            Err(error) if job.solids.len() > 1 => {
                let kind = error.kind();
                worst = if kind == ErrorKind::Machine { Some(kind) } else { worst.or(Some(kind)) };
                failures.push(unmeasured_solid(input, &error));
                progress.catch_up(each * (i + 1))?;
                continue;
            }
            Err(error) => return Err(error),
        };
        if let Some(limits) = &limits {
            report.verdict = Some(limits.judge(&report.metrics, report.unit).map_err(Error::input)?);
        }
        on_report(&report);
        if let Some(folder) = &job.folder {
            progress.stage(format!("{}: writing", input.path.display()))?;
            write_report(&report, &folder.join(&place))?;
        }
        progress.step()?;
        reports.push(report);
        places.push(place);
    }
    let failed = (!failures.is_empty()).then(|| failure_text(&failures, job.solids.len()));
    if let (Some(kind), Some(message), true) = (worst, &failed, reports.is_empty()) {
        return Err(if kind == ErrorKind::Machine { Error::machine(message) } else { Error::input(message) });
    }
    tell_apart(&mut reports);
    let pages = match &job.folder {
        Some(folder) => write_overview(job, folder, &places, &reports, &failures)?,
        None => Vec::new(),
    };
    Ok(Reported { reports, pages, failures, failed, worst })
}

/// Writes the files over all solids, and returns all pages.
fn write_overview(
    job: &ReportJob,
    folder: &Path,
    places: &[PathBuf],
    reports: &[ScaffoldReport],
    failures: &[Unmeasured],
) -> Result<Vec<PathBuf>, Error> {
    let mut pages: Vec<PathBuf> = places.iter().map(|place| folder.join(place).join("report.html")).collect();
    if let Some((name, text)) = overview(job, places, reports, failures) {
        let path = folder.join(name);
        output::replace(&path, |file| file.write_all(text.as_bytes()))?;
        pages.insert(0, path);
    }
    if job.solids.len() > 1 {
        let all = reports.iter().collect::<Vec<_>>();
        for (name, table) in [("metrics.csv", write::csv(&all)), ("designs.csv", write::designs(&all, failures))] {
            output::replace(&folder.join(name), |file| file.write_all(table.as_bytes()))?;
        }
    }
    Ok(pages)
}

/// The steps of a solid beside those of [`report_on`].
const READING_AND_WRITING: usize = 2;

/// Returns the number of steps that [`report_on`] counts, which the caller announces.
pub(super) fn steps_of_report<S>(roi: Option<&Roi<S>>) -> usize {
    stages(roi.is_some()) + usize::from(matches!(roi, Some(Roi::Wrap(_))))
}

/// Returns a failure by its file, with a message that does not repeat the file.
fn unmeasured_solid(input: &Input, failure: &Error) -> Unmeasured {
    let path = input.path.display().to_string();
    let message = failure.to_string();
    let rest = message.strip_prefix(&path).unwrap_or(&message);
    let message = rest.trim_start_matches([':', ',', ' ']).to_owned();
    Unmeasured { path, message }
}

/// Returns all failures as a text, a paragraph each.
fn failure_text(failures: &[Unmeasured], all: usize) -> String {
    let mut text = format!("{} of {all} solids could not be measured:", failures.len());
    failures.iter().for_each(|Unmeasured { path, message }| text += &format!("\n{path}: {message}"));
    text
}

/// Reads limits from a file.
pub(super) fn limits(path: &Path, unit: Option<LengthUnit>) -> Result<Limits, Error> {
    let text = crate::input::open(path)
        .and_then(io::read_to_string)
        .map_err(|error| Error::input(format!("{}: {error}", path.display())))?;
    checked_limits(path, &text, unit)
}

/// Parses limits, and checks them against metrics without values, which finds misspelt names before anything is measured.
pub(super) fn checked_limits(path: &Path, text: &str, unit: Option<LengthUnit>) -> Result<Limits, Error> {
    let limits = Limits::parse(path, text).map_err(Error::input)?;
    // Files may state another unit; any unit serves to check names and dimensions.
    let unit = unit.or(Some(LengthUnit::Millimetre));
    limits.judge(&unmeasured(unit), unit).map_err(Error::input)?;
    Ok(limits)
}

/// Returns the name and the text of the page on several solids, if there is one.
fn overview(
    job: &ReportJob,
    places: &[PathBuf],
    reports: &[ScaffoldReport],
    failures: &[Unmeasured],
) -> Option<(&'static str, String)> {
    let entries: Vec<Entry> = places
        .iter()
        .zip(reports)
        .map(|(place, report)| Entry { report, link: place.join("report.html").to_string_lossy().replace('\\', "/") })
        .collect();
    match (&entries[..], &job.compare) {
        ([a, b], Some(_)) => Some(("compare.html", compare::html(a, b))),
        _ if job.solids.len() == 1 => None,
        _ => Some(("index.html", summary::html(&entries, failures))),
    }
}

/// Returns the folder of the files of each solid, relative to that of the job.
fn places(job: &ReportJob) -> Vec<PathBuf> {
    if job.compare.is_some() {
        return vec![PathBuf::new(), PathBuf::from("compare")];
    }
    if job.solids.len() == 1 {
        return vec![PathBuf::new()];
    }
    let mut taken = HashSet::new();
    let place = |input: &Input| {
        let stem = input.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut names = std::iter::once(stem.clone()).chain((2..).map(|n| format!("{stem}-{n}")));
        // Some file systems ignore the case of letters.
        PathBuf::from(names.find(|name| taken.insert(name.to_lowercase())).expect("names do not end"))
    };
    job.solids.iter().map(place).collect()
}

/// Replaces titles that several reports share by the paths of their files.
fn tell_apart(reports: &mut [ScaffoldReport]) {
    let titles: Vec<String> = reports.iter().map(|report| report.title.clone()).collect();
    for report in reports {
        if titles.iter().filter(|title| **title == report.title).count() > 1 {
            report.title = report.provenance.inputs[0].path.clone();
        }
    }
}

/// The names of the files of each solid.
const FILES: [&str; 4] = ["metrics.json", "metrics.csv", "methods.txt", "report.html"];

/// Returns all files that a job may write.
pub fn files(job: &ReportJob) -> Vec<PathBuf> {
    let Some(folder) = &job.folder else { return Vec::new() };
    let each = places(job).into_iter().flat_map(|place| FILES.map(|name| folder.join(&place).join(name)));
    let over_all = ["index.html", "compare.html", "metrics.csv", "designs.csv"].map(|name| folder.join(name));
    let mut files: Vec<PathBuf> = each.chain(over_all).collect();
    files.sort();
    files.dedup();
    files
}

/// Writes the files of one solid.
pub(super) fn write_report(report: &ScaffoldReport, folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|error| Error::output(folder, &error))?;
    let texts = [write::json(report), write::csv(&[report]), write::methods(report), page::html(report)];
    for (name, text) in FILES.into_iter().zip(texts) {
        output::replace(&folder.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    Ok(())
}

/// Reads and measures one solid.
fn report_of(job: &ReportJob, input: &Input, backends: &Backends, progress: &Monitor) -> Result<ScaffoldReport, Error> {
    let start = Instant::now();
    let mut clock = Clock::default();
    progress.stage(format!("{}: reading", input.path.display()))?;
    let requirements = requirements(job);
    let roi = match &job.roi {
        Some(Roi::Solid(roi)) => Some(roi),
        Some(Roi::Hull | Roi::Wrap(_)) | None => None,
    };
    let inputs: Vec<Input> = [Some(input), roi].into_iter().flatten().cloned().collect();
    let (solids, warnings) = clock.time("read", || input::solids(&inputs, requirements))?;
    progress.step()?;
    let (settings, command_line) = (&job.settings, job.command_line.clone());
    let made = job.roi.as_ref().and_then(Made::of);
    let task = Task { settings, made, requirements, command_line, warnings, backends, start };
    let mut report = report_on(task, solids, clock, progress)?;
    report.title = input.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(report)
}

fn requirements(job: &ReportJob) -> InputRequirements {
    InputRequirements {
        unit: job.unit,
        openness: job.openness,
        sides: Sides::NotNeeded,
        fill: job.settings.fill,
        hashes: true,
    }
}

/// A region of interest that is constructed from the solid.
pub(super) enum Made {
    /// The convex hull of the solid.
    Hull,
    /// The solid with everything filled that a ball of a diameter cannot enter.
    Wrap(Option<Length>),
}

impl Made {
    /// Returns the region to be constructed; `None` if it is a solid of its own.
    pub fn of<S>(roi: &Roi<S>) -> Option<Made> {
        match roi {
            Roi::Solid(_) => None,
            Roi::Hull => Some(Made::Hull),
            Roi::Wrap(diameter) => Some(Made::Wrap(*diameter)),
        }
    }
}

/// The settings and the context of one report.
pub(super) struct Task<'t> {
    pub settings: &'t super::Settings,
    /// The region to be constructed from the solid; `None` for its box or a second solid.
    pub made: Option<Made>,
    pub requirements: InputRequirements,
    pub command_line: String,
    /// Warnings about the solids.
    pub warnings: Vec<Warning>,
    pub backends: &'t Backends,
    /// The start of the total time.
    pub start: Instant,
}

/// Measures the first solid, within the second if there is one.
pub(super) fn report_on(
    task: Task,
    mut solids: Vec<Solid>,
    mut clock: Clock,
    progress: &Monitor,
) -> Result<ScaffoldReport, Error> {
    let Task { settings, made, requirements, command_line, warnings, backends, start } = task;
    // Curvature and overhang need outward normals.
    for solid in solids.iter_mut().filter(|solid| solid.is_oriented() && solid.volume < 0.0) {
        input::turn(solid, requirements)?;
        solid.volume = -solid.volume;
    }
    let files: Vec<InputFile> =
        ["solid", "roi"].into_iter().zip(&solids).map(|(role, solid)| file(role, solid)).collect();
    match made {
        Some(Made::Hull) => solids.push(hull(&solids[0])?),
        Some(Made::Wrap(diameter)) => {
            let limit = Limit::new(settings.memory);
            progress.stage(format!("{}: wrapping", solids[0].name()))?;
            let wrap = clock.time("wrapping", || wrap(&solids[0], diameter, settings.fill, limit))?;
            solids.push(wrap);
            progress.step()?;
        }
        None => {}
    }
    let subject = Subject { solid: &solids[0], roi: solids.get(1) };
    let mut alerts: Vec<Alert> = warnings.into_iter().map(alert).collect();
    for solid in &solids {
        let difference = FillDifference::of(solid)?;
        alerts.extend(difference.and_then(|difference| difference.warning(solid, settings.fill)).map(alert));
    }
    let grid = subject.grid(settings)?;
    admit_fields(&subject, &grid, settings)?;
    let lattice = clock.time("sampling", || subject.solid.quantise(&grid))?;
    let choice = backends.choose(|| work(slice::from_ref(&lattice), &Axis::ALL));
    let mut report = measure(subject, settings, lattice, choice.sampler(), &mut clock, progress)?;
    let ran = choice.ran();
    alerts.extend(ran.auto.iter().filter_map(|auto| auto.warning.clone()).map(alert));
    alerts.append(&mut report.alerts);
    let mut seconds = clock.stages();
    seconds.push(("total", start.elapsed().as_secs_f64()));
    Ok(ScaffoldReport {
        schema: scaffold_report::SCHEMA,
        title: solids[0].name().to_string(),
        unit: solids[0].unit,
        alerts,
        provenance: scaffold_report::Provenance {
            inputs: files,
            command_line,
            version: env!("CARGO_PKG_VERSION"),
            made: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
            device: ran.to_string(),
            threads: rayon::current_num_threads(),
            rays: grid.rays(),
            pitch: grid.pitch(),
            edges: settings.edges.name(),
            region: solids.get(1).map_or_else(|| "box".to_owned(), |roi| roi.name().to_string()),
            seconds,
            peak_memory_bytes: machine::peak_memory_bytes(),
        },
        ..report
    })
}

/// Returns the convex hull of a solid.
fn hull(solid: &Solid) -> Result<Solid, Error> {
    let mesh = convex_hull(&solid.mesh().positions);
    let closed = mesh.and_then(|mesh| ClosedMesh::check(mesh).ok());
    let closed = closed.ok_or_else(|| Error::input(format!("{}: the solid is flat and has no hull", solid.name())))?;
    Ok(region_of(solid, closed, "hull".to_owned()))
}

/// Rays along the longest side of the raster that a solid is wrapped on.
const WRAP_RAYS: f64 = 256.0;

/// The default diameter of the ball that wraps a solid, as a share of the longest side.
const WRAP_SHARE: f64 = 0.25;

/// Returns the solid with everything filled that a ball of a diameter cannot enter from outside.
fn wrap(solid: &Solid, diameter: Option<Length>, fill: FillRule, limit: Limit) -> Result<Solid, Error> {
    let bounds = solid.bounds();
    let longest = bounds.extent().max_element();
    let diameter = match diameter {
        Some(diameter) => diameter.in_unit(solid.unit, "--roi wrap:")?,
        None => WRAP_SHARE * longest,
    };
    // Two pitches around the ball allow for the rounding to the lattice.
    let pitch = (longest + diameter) / (WRAP_RAYS - 4.0);
    let radius = 0.5 * diameter / pitch;
    let refused = |error: &dyn Display| Error::input(format!("{}: {error}", solid.name()));
    if radius < RADIUS_MIN {
        let least = 2.0 * RADIUS_MIN * longest / (WRAP_RAYS - 4.0 - 2.0 * RADIUS_MIN);
        return Err(refused(&format_args!(
            "--roi wrap: a ball of diameter {} is too small for a solid {} long (least: {})",
            number(diameter),
            number(longest),
            number(least)
        )));
    }
    let margin = DVec3::splat(0.5 * diameter + 2.0 * pitch);
    let bounds = Aabb { min: bounds.min - margin, max: bounds.max + margin };
    let grid = Grid::with_pitch(bounds, pitch, *LOD_RANGE.start()).map_err(|error| refused(&error))?;
    let fixed = machine::held_memory() as f64 + BYTES_OF_TREE * solid.mesh().triangles.len() as f64;
    let cost = Cost { fixed, ..Cost::default() };
    admit(&[cost], limit, format_args!("{}: the tree of its triangles", solid.name()), |_| {
        "raise --memory".to_owned()
    })?;
    let lattice = solid.quantise(&grid)?;
    let image = |axis| CpuSampler::default().sample_surface(&lattice, axis, fill);
    let images = [image(Axis::X)?, image(Axis::Y)?, image(Axis::Z)?];
    let [x, y, z] = &metrics::wrap::wrap(&images, radius).map_err(|error| refused(&error))?;
    let coordinates = Coordinates { precision: Precision::Double, ..Coordinates::default() };
    let mut mesh = contour_in([x, y, z], None, Mode::Exact, coordinates).map_err(|error| refused(&error))?.mesh;
    put_onto(&mut mesh, solid.mesh(), (metrics::wrap::error(radius) + CONTOUR_ERROR) * pitch);
    let closed = ClosedMesh::check(mesh).map_err(|error| refused(&error))?;
    let unit = solid.unit.map_or_else(String::new, |unit| format!(" {}", unit.symbol()));
    Ok(region_of(solid, closed, format!("wrap:{}{unit}", number(diameter))))
}

/// Error of the contour of a wrapped solid, in pitches: its images have crossings in f32.
const CONTOUR_ERROR: f64 = 1e-3;

/// Bytes for each triangle of a [`ClosestTriangle`], while it is made.
const BYTES_OF_TREE: f64 = 220.0;

/// Vertices between two checkpoints.
const VERTICES_PER_TASK: usize = 1 << 10;

/// Moves the vertices of a mesh that are within `reach` of another one onto it. A region that lies a little outside of the solid where
/// both should coincide would have pores between them, which are as thin as that and lead all around the solid. Triangles of the
/// region stay chords of concave faces: between these and the solid lie pores of less than h²/8R, for pitches h and radii R, each by
/// itself.
fn put_onto(mesh: &mut TriangleMesh, other: &TriangleMesh, reach: f64) {
    let corners = |indices: &[u32; 3]| indices.map(|vertex| other.positions[vertex as usize]);
    let tree = ClosestTriangle::new(&other.triangles.iter().map(corners).collect::<Vec<_>>());
    mesh.positions.par_chunks_mut(VERTICES_PER_TASK).for_each(|positions| {
        checkpoint();
        for position in positions {
            if let Some(closest) = tree.below(*position, reach * reach, |_| true) {
                *position += closest_to_origin(tree.corners(closest.hint).map(|corner| corner - *position));
            }
        }
    });
}

/// Returns a region of interest constructed from a solid, in its unit.
fn region_of(solid: &Solid, closed: ClosedMesh, name: String) -> Solid {
    Solid { unit: solid.unit, ..Solid::from_closed(closed, &name) }
}

fn alert(warning: Warning) -> Alert {
    Alert { code: warning.code, severity: Severity::Warning, message: warning.message }
}

fn file(role: &'static str, solid: &Solid) -> InputFile {
    InputFile {
        role,
        path: solid.name().to_string(),
        sha256: solid.sha256.clone().unwrap_or_default(),
        triangles: solid.mesh().triangles.len() as u64,
        closed: solid.is_closed(),
        oriented: solid.was_oriented(),
        unit: solid.stated_unit,
    }
}
