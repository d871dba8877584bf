//! The results of operations: volumes, measures, images, files, times and warnings.

use std::fmt;
use std::path::PathBuf;
use std::time::Instant;

use glam::{DMat3, DVec3};
#[cfg(feature = "report")]
use serde::Serialize;

use super::backend::Ran;
use super::certainty::Certified;
use super::finer::Finer;
use super::input::Solid;
use super::job::{Content, ImageTarget, Measurement, Spacing, SumOperation};
use super::sum::BetweenRays;
use super::sum::FinerSum;
use super::surface::{self, Exact, Imaged, SurfaceReport};
use super::{raster, write};
use crate::exact::NotExact;
use crate::grid::Grid;
use crate::integrate::VolumeEstimate;
use crate::ldi::Ldi;
use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::minkowski::{CullCounts, ResolveCounts};
use crate::number::{number, outwards, rounded_up};
use crate::progress::Monitor;
use crate::sampler::{FillRule, Mode};
use crate::unit;
use crate::{Error, Estimate, Warning};

/// The measured result of an operation.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The name of the command.
    pub command: &'static str,
    /// What was measured; `None` for a sum.
    pub measurement: Option<Measurement>,
    /// The expression as typed.
    pub expression: Option<String>,
    /// The inputs.
    pub solids: Vec<Solid>,
    /// The unit of all lengths, where it is known.
    pub unit: Option<LengthUnit>,
    /// The volume of the result.
    pub volume: Volume,
    /// Certified bounds of the volume, and the verdicts on assertions.
    pub certified: Certified,
    /// The raster.
    pub grid: Grid,
    /// The requested spacing, from which the raster follows.
    pub requested: Spacing<Length>,
    /// The most samples on a ray along x, y and z; `None` for axes that were not sampled.
    pub layers: [Option<u32>; 3],
    /// The number of samples on all axes.
    pub samples: u64,
    /// The number of unclosed rays on all axes.
    pub unclosed: u64,
    /// The mode of the images.
    pub mode: Mode,
    /// The fill rule.
    pub fill: FillRule,
    /// The memory limit in bytes, if one was given.
    pub memory: Option<u64>,
    /// The device that made the images, if there are any.
    pub ran: Option<Ran>,
    /// Times by stage.
    pub seconds: Seconds,
    /// Warnings about the inputs and the result.
    pub warnings: Vec<Warning>,
    /// The images, if they are kept.
    pub images: Vec<Ldi>,
    /// The normals of the triangles that the images refer to.
    pub normals: Vec<[f32; 3]>,
    /// The solids of a sum, if a mesh of the images may need finer ones.
    pub finer: Option<FinerSum>,
    /// The exact mesh, if it is kept; then the images are not.
    pub exact_mesh: Option<Exact>,
    /// The output file.
    pub output: Option<PathBuf>,
    /// The report of the mesh, if one was requested.
    pub surface: Option<SurfaceReport>,
    /// Area and moments, for `volume`.
    pub measures: Option<SolidMeasures>,
    /// The course of a refinement, for `--tolerance`.
    pub refinement: Option<Refinement>,
    /// The report of a sum or an offset.
    pub sum: Option<SumReport>,
}

/// The volume of a result, with its error.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// The volume, in cubic units of the inputs.
    pub value: f64,
    /// The bound of the rounding of an exact value, else an error estimate.
    pub error: f64,
    /// The method.
    pub method: Method,
    /// The exact volume with the bound of its rounding, where it is known; beside the value of an over- or under-estimate.
    pub exact: Option<[f64; 2]>,
    /// The estimate from the images alone, if there are any.
    pub rays: Option<VolumeEstimate>,
    /// The least and the greatest volume that the inputs, and certified bounds if there are any, allow; of an exact value, that its
    /// rounding allows.
    pub possible: [f64; 2],
}

/// The method of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By sums over triangles and the segments in which they meet; see [`exact`](crate::exact).
    Exact,
    /// From images, with the reason why the triangles give no exact volume, if one was sought.
    Estimate(Option<NotExact>),
}

impl Volume {
    /// Returns the estimate of images, clamped to the volumes that the inputs allow.
    pub fn estimate(rays: VolumeEstimate, possible: [f64; 2], not_exact: Option<NotExact>) -> Volume {
        let [least, greatest] = possible;
        // NaN stays NaN.
        let value = rays.value.max(least).min(greatest);
        let farthest = (greatest - value).max(value - least);
        // If the rays contradict the inputs, or meet nothing, only the range that the inputs allow is known.
        let error = match rays.value == 0.0 || (value - rays.value).abs() > rays.error {
            true => farthest,
            false => (rays.error + (value - rays.value).abs()).min(farthest),
        };
        // The volumes of the inputs are rounded.
        let error = error + 1e-12 * greatest;
        Volume { value, error, method: Method::Estimate(not_exact), exact: None, rays: Some(rays), possible }
    }

    /// Narrows an estimate to certified bounds of the exact volume.
    pub fn narrow(&mut self, [lower, upper]: [f64; 2]) {
        let possible @ [least, greatest] = [self.possible[0].max(lower), self.possible[1].min(upper)];
        // Where rounding leaves nothing between them, the volumes of the inputs stand.
        if let (Some(rays), Method::Estimate(not_exact), true) = (self.rays, self.method, least <= greatest) {
            let narrowed = Volume::estimate(rays, possible, not_exact);
            let farthest = (greatest - narrowed.value).max(narrowed.value - least);
            let error = self.error.max(narrowed.error).min(farthest + 1e-12 * greatest);
            *self = Volume { error, exact: self.exact, ..narrowed };
        }
    }

    /// Returns whether no ray met the result, so that only the range that the inputs allow is known.
    pub fn is_unresolved(&self) -> bool {
        self.rays.is_some_and(|rays| rays.value == 0.0)
            && self.method != Method::Exact
            && self.possible[1] > self.possible[0]
    }
}

/// Area and moments of one solid.
#[derive(Clone, Copy, Debug)]
pub struct SolidMeasures {
    /// The area of the surface of the solid; triangles inside it do not count.
    pub area: f64,
    /// An estimate of the error of the area, where rays tell which triangles bound the solid; else 0.
    pub area_error: f64,
    /// The centre of mass; NaN where there is no volume.
    pub centroid: DVec3,
    /// The inertia about the centroid, for unit density; NaN where there is no volume.
    pub inertia: DMat3,
}

/// The outcome of `--tolerance`.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "report", derive(Serialize))]
pub struct Refinement {
    /// The requested bound of the error estimate, as a share of the volume.
    pub asked: f64,
    /// The error estimate in the end, as a share of the volume; infinite if the volume is zero.
    pub came_to: f64,
    /// True if the tolerance was reached.
    pub reached: bool,
    /// Rays along the longest side in the end.
    pub resolution: u32,
}

impl Refinement {
    /// Compares the error of a volume with the requested share of it. An error that is no larger than `negligible` is none: an exact
    /// volume of zero is rounded, too.
    pub fn of(asked: f64, &Volume { value, error, .. }: &Volume, negligible: f64, resolution: u32) -> Refinement {
        let came_to = if error <= negligible { 0.0 } else { error / value.abs() };
        Refinement { asked, came_to, reached: came_to <= asked, resolution }
    }
}

impl fmt::Display for Refinement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "--tolerance {} %: {} with {} rays along the longest side, ",
            number(100.0 * self.asked),
            if self.reached { "reached" } else { "not reached" },
            self.resolution,
        )?;
        match self.came_to.is_finite() {
            true => write!(f, "where the estimate is {} % of the volume", number(100.0 * self.came_to)),
            false => f.write_str("which resolve no volume"),
        }
    }
}

/// Times by stage.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "report", derive(Serialize))]
pub struct Seconds {
    /// Reading and checking.
    pub read: f64,
    /// Sampling.
    pub sample: f64,
    /// Booleans, sums and offsets.
    pub operate: f64,
    /// Volumes, moments and areas.
    pub integrate: f64,
    /// Writing.
    pub write: f64,
    /// The total.
    pub total: f64,
}

/// The report of a sum, a difference or an offset.
#[derive(Clone, Debug)]
pub struct SumReport {
    /// The steps: two for an opening or a closing, one for all others. If the first result is empty, there is no second step.
    pub steps: Vec<StepReport>,
    /// The memory limit in bytes, where it is known.
    pub memory_limit: Option<u64>,
}

impl SumReport {
    /// Returns the expected peak memory, in bytes.
    pub fn memory_estimate(&self) -> u64 {
        self.steps.iter().map(|step| step.memory_estimate).max().unwrap_or(0)
    }

    /// Returns whether details were found between the rays.
    pub fn has_details(&self) -> bool {
        self.searches().any(|found| !found.details.is_empty())
    }

    /// Returns whether there may be details between the rays.
    pub fn may_have_details(&self) -> bool {
        self.has_details() || self.searches().any(|found| !found.is_complete)
    }

    /// Returns what was found between the rays, of each step that was searched, and the radius by which the next step grows it.
    pub fn between_rays(&self, operation: SumOperation) -> impl Iterator<Item = (&BetweenRays, f64)> {
        let radius = match operation {
            SumOperation::Opening(radius) | SumOperation::Closing(radius) => radius,
            SumOperation::Sum(_) | SumOperation::Difference(_) | SumOperation::Offset(_) => 0.0,
        };
        let found = self.steps.iter().enumerate();
        found.filter_map(move |(i, step)| Some((step.between_rays.as_ref()?, if i == 0 { radius } else { 0.0 })))
    }

    fn searches(&self) -> impl Iterator<Item = &BetweenRays> {
        self.steps.iter().filter_map(|step| step.between_rays.as_ref())
    }
}

/// The report of a step.
#[derive(Clone, Debug)]
pub struct StepReport {
    /// `sum`, `difference` or `offset`.
    pub operation: &'static str,
    /// The distance of an offset.
    pub distance: Option<f64>,
    /// True if the facets of the inputs contradict each other, so that both sides of each are used.
    pub is_folded: bool,
    /// The counts of pairs of features; `None` for an offset.
    pub pairs: Option<CullCounts>,
    /// The number of triangles, or of parts of planes, tubes and spheres, that cover the surface.
    pub primitives: u64,
    /// The number of triangles or parts that are sampled, as they may lie on the surface.
    pub sampled: u64,
    /// The number of crossings of rays along x, y and z with the sampled primitives.
    pub crossings: Option<[u64; 3]>,
    /// The counts of gap resolution.
    pub resolved: ResolveCounts,
    /// The details that no ray meets; `None` if they were not searched.
    pub between_rays: Option<BetweenRays>,
    /// The expected peak memory of the step, in bytes.
    pub memory_estimate: u64,
    /// Seconds of each stage, in order.
    pub seconds: Vec<(&'static str, f64)>,
}

impl Measured {
    /// Returns the volume with its error, its method and its unit.
    pub fn estimate(&self) -> Estimate {
        let mut estimate = Estimate::of_volume(&self.volume, self.unit);
        estimate.bounds = self.certified.bounds;
        estimate
    }

    /// Returns the images with the data that an output file needs.
    pub fn imaged(&self) -> Imaged<'_> {
        let (images, normals, volume) = (&self.images[..], Some(&self.normals[..]), self.volume.rays);
        let finer = match (&self.measurement, &self.finer) {
            (Some(measurement), _) => Some(Finer::Measured { measurement, solids: &self.solids, fill: self.fill }),
            (None, finer) => finer.as_ref().map(Finer::Sum),
        };
        Imaged { images, normals, mode: self.mode, unit: self.unit, volume, memory: self.memory, finer }
    }

    /// Writes `target` and drops the images. `read` and `warnings` are the seconds and the warnings of reading the inputs.
    pub(in crate::driver) fn finished(
        mut self,
        target: Option<&ImageTarget>,
        (read, mut warnings): (f64, Vec<Warning>),
        start: Instant,
        progress: &Monitor,
    ) -> Result<Measured, Error> {
        warnings.append(&mut self.warnings);
        if let Some(target) = target {
            let writing = Instant::now();
            let (surface, found) = match (target.content, self.exact_mesh.take()) {
                (Content::Mesh(finish), Some(exact)) => {
                    let (report, found) =
                        surface::write_exact(exact, &self.volume, self.unit, &target.path, finish, progress)?;
                    (Some(report), found)
                }
                _ => write::images(target, &self.imaged(), progress)?,
            };
            warnings.extend(found);
            self.output = match &surface {
                Some(surface) => surface.path.clone(),
                None => Some(target.path.clone()),
            };
            self.surface = surface;
            self.seconds.write += writing.elapsed().as_secs_f64();
        }
        (self.images, self.normals, self.finer) = (Vec::new(), Vec::new(), None);
        self.warnings = warnings;
        self.seconds.read = read;
        self.seconds.total = start.elapsed().as_secs_f64();
        self.add_warnings();
        Ok(self)
    }

    /// Adds warnings about numbers that are imprecise or not finite.
    pub(crate) fn add_warnings(&mut self) {
        self.warnings.extend(self.imprecise());
        self.warnings.extend(not_finite(self));
    }

    /// Returns a warning if there are too few rays for the volume, as for a solid that is thin compared with the pitch.
    pub(in crate::driver) fn imprecise(&self) -> Option<Warning> {
        let Volume { value, error, possible: [least, greatest], .. } = self.volume;
        // An empty sum has a warning of its own.
        if self.warnings.iter().any(|warning| warning.code == "empty") {
            return None;
        }
        let finer = match self.requested {
            Spacing::Pitch(_) => "lower --pitch",
            Spacing::Resolution(_) | Spacing::Tolerance(_) => "raise --resolution",
        };
        if self.volume.is_unresolved() {
            let unit = unit::suffix(self.unit, 3);
            let [least, greatest] = outwards([least, greatest]);
            let rays = if self.samples == 0 { "no ray meets the result" } else { "too few rays meet the result" };
            let message = format!(
                "{rays} at a pitch of {}: its volume is at least {least} and at most {greatest}{unit}; {finer} to resolve it",
                unit::rounded(self.grid.pitch(), self.unit),
            );
            return Some(Warning::new(NOT_RESOLVED, message));
        }
        if self.volume.method == Method::Exact {
            return self.rounded();
        }
        let much = if value > 0.0 { format!("{:.0} % of it", 100.0 * error / value) } else { "all of it".to_owned() };
        let message = || {
            let pitch = unit::rounded(self.grid.pitch(), self.unit);
            match self.unclosed {
                0 if !self.solids.iter().all(Solid::is_closed) => format!(
                    "the volume may be off by {much}: a mesh is not closed, so that images along different axes may disagree, and at \
                     a pitch of {pitch} too few rays may meet the solid; repair the mesh, or {finer}"
                ),
                0 => format!(
                    "the volume may be off by {much}: too few rays meet the solid at a pitch of {pitch}; {finer} or set \
                     --tolerance"
                ),
                rays => format!(
                    "the volume may be off by {much}: rays that do not close ({rays}) count as empty, and at a pitch of {pitch} \
                     too few may meet the solid; repair the mesh, or {finer}"
                ),
            }
        };
        // A refinement has said what it came to.
        if self.refinement.is_some() {
            return None;
        }
        (error > IMPRECISE_ABOVE * value).then(|| Warning::new(IMPRECISE, message()))
    }

    /// Returns a warning if the rounding of an exact volume is a noticeable part of it, as beside an input that is far larger.
    fn rounded(&self) -> Option<Warning> {
        let Volume { value, error, .. } = self.volume;
        if error <= ROUNDED_ABOVE * value || error <= negligible(&self.solids) {
            return None;
        }
        let rounded =
            format!("the exact volume is rounded by at most {}{}", rounded_up(error), unit::suffix(self.unit, 3));
        let longest = |solid: &&Solid| solid.bounds().extent().max_element();
        let message = match self.solids.iter().max_by(|a, b| longest(a).total_cmp(&longest(b))) {
            Some(largest) if self.solids.len() > 1 => format!(
                "{rounded}, as all coordinates are rounded to about 1e-12 of the longest side of the box around all inputs, \
                 {}; for more digits, make the largest input, {}, smaller, or move the inputs nearer to one another",
                unit::rounded(raster::common_box(&self.solids).extent().max_element(), self.unit),
                largest.name(),
            ),
            _ => format!("{rounded}, as its triangles nearly cancel one another"),
        };
        Some(Warning::new(IMPRECISE, message))
    }
}

/// Returns the rounding of an exact volume that is never worth a warning: solids that are equal, or touch, have nothing between them
/// but rounding.
pub(super) fn negligible(solids: &[Solid]) -> f64 {
    NEGLIGIBLE * solids.iter().map(|solid| solid.volume.abs()).fold(f64::INFINITY, f64::min)
}

/// Rounding of an exact volume, as a share of it, above which there is a warning.
const ROUNDED_ABOVE: f64 = 1e-5;

/// Rounding of an exact volume, as a share of the smallest input, that is never worth a warning.
const NEGLIGIBLE: f64 = 1e-9;

/// Estimated error, as a share of the volume, above which there is a warning.
const IMPRECISE_ABOVE: f64 = 0.1;

/// The code of the warning about a volume that may be off by more, as there are too few rays.
pub const IMPRECISE: &str = "imprecise";

/// The code of the warning about a volume that no ray meets.
pub const NOT_RESOLVED: &str = "not-resolved";

/// Returns a warning that names the results that are not finite, which are null in JSON.
fn not_finite(measured: &Measured) -> Option<Warning> {
    let volume = [("volume", measured.volume.value), ("error estimate", measured.volume.error)];
    let measures = measured.measures.iter().flat_map(|m| {
        let inertia = m.inertia.to_cols_array().into_iter().sum();
        [("area", m.area), ("centroid", m.centroid.element_sum()), ("inertia", inertia)]
    });
    let inputs = measured.solids.iter().map(|solid| ("volume of an input's mesh", solid.volume));
    let names: Vec<&str> =
        volume.into_iter().chain(measures).chain(inputs).filter(|(_, v)| !v.is_finite()).map(|(n, _)| n).collect();
    let why = if measured.volume.value == 0.0 { "as the volume is zero" } else { "as they exceed the range of f64" };
    let message = format!("these results are not finite numbers, {why}: {}", names.join(", "));
    (!names.is_empty()).then(|| Warning::new("not-finite", message))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certified_bounds_narrow_an_estimate() {
        let narrowed = |value, error, bounds| {
            let mut volume = Volume::estimate(VolumeEstimate { value, error }, [2.0, 10.0], None);
            volume.narrow(bounds);
            (volume.value, volume.error, volume.possible)
        };
        let is_near = |(value, error, possible), (expected, of_error, range): (f64, f64, [f64; 2])| {
            assert!(f64::abs(value - expected) < 1e-9 && f64::abs(error - of_error) < 1e-9, "{value} ± {error}");
            assert_eq!(possible, range);
        };
        is_near(narrowed(5.0, 0.5, [1.0, 20.0]), (5.0, 0.5, [2.0, 10.0]));
        is_near(narrowed(5.0, 0.5, [5.25, 5.75]), (5.25, 0.5, [5.25, 5.75]));
        is_near(narrowed(5.0, 0.5, [4.9, 5.1]), (5.0, 0.1, [4.9, 5.1]));
        is_near(narrowed(0.0, 0.0, [2.5, 3.0]), (2.5, 0.5, [2.5, 3.0]));
        // Bounds that rounding parts from the volumes of the inputs.
        is_near(narrowed(10.0, 0.5, [10.1, 10.2]), (10.0, 0.5, [2.0, 10.0]));
    }
}
