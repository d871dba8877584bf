//! Minkowski sums, offsets, openings and closings: images and volumes.
//!
//! An opening or a closing takes two steps, all others one. The error estimate of the volume comes from coarser rasters, as for
//! all images; the volume of details that a search finds between the rays (`between_rays`) is added to it.

mod backend;
mod between_rays;
mod bounds;
mod finer;
mod forecast;
#[cfg_attr(not(feature = "gpu"), path = "no_gpu.rs")]
mod gpu;
mod shells;
mod spot_check;
mod steps;

use std::f64::consts::PI;
use std::time::Instant;

use glam::{DAffine3, DVec3};

use crate::grid::Axis;
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::ldi::VolumeSums;
use crate::mesh::{Aabb, ClosedMesh, Precision};
use crate::metrics::bounds::Interval;
use crate::sampler::{FillRule, Mode};

pub use self::backend::SumBackend;
pub use self::between_rays::{BetweenRays, Detail};
pub use self::finer::FinerSum;
use self::shells::{Shells, Windings};
use self::steps::{Setting, Step, StepImages};
use super::certainty::{Certified, certify_offset};
use super::input::{self, InputRequirements, Sides, Solid};
use super::machine;
use super::measure::check_pitches;
use super::measured::{Measured, Seconds, SumReport, Volume};
use super::memory::Limit;
use super::raster;
use super::refine::{COARSEST, FINEST, RefinementEnd, UNMET, refine};
use super::surface::{self, Imaged};
use crate::Error;
use crate::Warning;
use crate::driver::job::{Finish, ImageTarget, Input, Keep, Openness, Operand, Spacing, SumJob, SumOperation};
use crate::number::number;
use crate::progress::Monitor;
use crate::unit;

/// Reads inputs, computes their sum, difference or offset, measures it and writes `target`.
///
/// The total time counts from `start`.
///
/// # Errors
/// Inputs that cannot be read or have no sum, rasters beyond the machine, and files that cannot be written.
pub fn sum_files(
    job: &SumJob,
    inputs: &[Input],
    target: Option<&ImageTarget>,
    start: Instant,
    progress: &Monitor,
) -> Result<Measured, Error> {
    // Before reading, so that a missing device fails at once.
    let backend = SumBackend::open(&job.backend)?;
    progress.stage("reading")?;
    let requirements = requirements(job);
    let (solids, warnings) = input::solids(inputs, requirements)?;
    let read = start.elapsed().as_secs_f64();
    progress.detail(format_args!("read in {read:.4} s"));
    let measured = sum(job, solids, &backend, progress)?;
    measured.finished(target, (read, warnings), start, progress)
}

/// Returns the requirements of an operation on its inputs.
fn requirements(job: &SumJob) -> InputRequirements {
    let (unit, fill, hashes) = (job.unit, job.fill, job.hashes);
    InputRequirements { unit, openness: Openness::Refused, sides: Sides::Needed, fill, hashes }
}

/// Computes the sum, the difference or the offset of solids, and measures it.
///
/// # Errors
/// Those of [`sum_files`], except for reading and writing.
pub fn sum(job: &SumJob, mut solids: Vec<Solid>, backend: &SumBackend, progress: &Monitor) -> Result<Measured, Error> {
    let start = Instant::now();
    let mut seconds = Seconds::default();
    let mut warnings = Vec::new();
    let requirements = requirements(job);
    let operation = job.operation.in_unit(solids[0].unit)?;
    let needs_bounds = job.certainty.needs_bounds();
    if needs_bounds {
        can_be_certified(operation)?;
    }
    let spacing = job.spacing.in_unit(solids[0].unit)?;
    let mut windings = Vec::new();
    for (i, solid) in solids.iter_mut().enumerate() {
        let side = if i == 0 { first_side(operation) } else { Side::Inside };
        windings.push(Windings::of(solid)?);
        warnings.extend(face_outwards(solid, &windings[i], side, requirements)?);
    }
    // A difference is the complement of a sum with the reflected B.
    if let SumOperation::Sum(Operand::Reflected) | SumOperation::Difference(Operand::AsItIs) = operation {
        input::map(&mut solids[1], &DAffine3::from_scale(DVec3::NEG_ONE), requirements)?;
    }
    let (least, greatest) =
        (least_volume(operation, &solids, &windings), greatest_volume(operation, &solids, &windings[0]));
    // The rays may lie beyond these by rounding to the lattice, or by the mesh between two steps.
    let possible = |rays: &VolumeEstimate| {
        let lower = if job.mode != Mode::UNDER && rays.value + rays.error >= least { least } else { 0.0 };
        let upper = if rays.value - rays.error <= greatest { greatest } else { rays.value };
        [lower.min(upper), upper]
    };
    let held = machine::held_memory();
    let mut round = |spacing| {
        let raster = Raster::of(job, (operation, spacing), &solids, held);
        let operated = operate(job, operation, raster, &solids, backend, &mut seconds, progress)?;
        let rays = estimate(job, (operation, &operated), &solids, backend, &mut seconds, progress)?;
        Ok((operated, rays))
    };
    let ((operated, rays), refined) = match spacing {
        Spacing::Tolerance(tolerance) => {
            let by_rays = |rays| round(Spacing::Resolution(rays));
            let volume = |(_, rays): &(Operated, _)| Volume::estimate(*rays, possible(rays), None);
            // Between the rays of an empty result, a complete search has found nothing.
            let most = |(operated, _): &(Operated, _)| match (operated.is_empty(), operated.report.may_have_details()) {
                (true, false) => COARSEST,
                (true, true) => UNMET,
                (false, _) => FINEST,
            };
            let (round, end) = refine(tolerance, most, volume, by_rays)?;
            (round, Some(end))
        }
        spacing => (round(spacing)?, None),
    };
    let is_empty = operated.is_empty();
    let StepImages { grid, volume_sums, images, normals, finer, bounds, .. } = operated.last;
    let certified = match (operation, bounds) {
        _ if !needs_bounds => Certified::default(),
        (SumOperation::Offset(distance), _) => {
            let within = |bounds| within_box(operation, &solids, bounds);
            certify_offset(job, &solids[0], (distance, grid.pitch()), within, &mut warnings, progress)?
        }
        (_, Some(Interval { lower, upper })) => {
            Certified::of(&job.certainty, within_box(operation, &solids, [lower, upper]), solids[0].unit)?
        }
        (_, None) => unreachable!("a sum has bounds if they are needed"),
    };
    let has_details = operated.report.has_details();
    let proves_empty =
        is_empty && (greatest == 0.0 && !has_details || certified.bounds.is_some_and(|[_, upper]| upper == 0.0));
    let mut volume = Volume::estimate(rays, if proves_empty { [0.0; 2] } else { possible(&rays) }, None);
    // The bounds are those of the exact volume, beyond which over- and under-estimates lie.
    if let (Mode::Exact, Some(bounds)) = (job.mode, certified.bounds) {
        volume.narrow(bounds);
    }
    let (refinement, not_reached) = refined.map(|end| RefinementEnd { volume, ..end }.judge()).unzip();
    warnings.extend(not_reached.flatten());
    warnings.extend(operated.warnings);
    let found = operated.report.between_rays(operation);
    warnings.extend(found.filter_map(|(found, grown)| found.warning(grown, solids[0].unit)));
    // Folds of the surface between two steps come from the lattice, and the user cannot repair them.
    if operated.report.steps[0].is_folded {
        let message = format!(
            "{}: a surface folds over itself, so the solid lies on the outer side of some facets; both sides of every facet are \
             used, as sheets without thickness; repair the mesh or change --resolution to avoid this",
            raster::names(&solids)
        );
        warnings.push(Warning::new("folded", message));
    }
    if is_empty {
        let length = |length| unit::rounded(length, solids[0].unit);
        warnings.push(empty(operation, grid.pitch(), (proves_empty, has_details), length));
    }

    seconds.total = start.elapsed().as_secs_f64();
    let mut layers = [None; 3];
    for volume_sums in &volume_sums {
        layers[volume_sums.axis().depth()] = Some(volume_sums.layers());
    }
    Ok(Measured {
        command: job.operation.command(),
        measurement: None,
        expression: None,
        unit: solids[0].unit,
        volume,
        certified,
        grid,
        requested: job.spacing,
        layers,
        samples: volume_sums.iter().map(|volume_sums| volume_sums.samples()).sum(),
        unclosed: 0,
        mode: job.mode,
        fill: job.fill,
        memory: job.memory,
        ran: Some(backend.ran(&job.backend)),
        seconds,
        warnings,
        images,
        normals,
        finer,
        exact_mesh: None,
        output: None,
        surface: None,
        measures: None,
        refinement,
        sum: Some(operated.report),
        solids,
    })
}

/// Refuses operations whose volume cannot be certified.
fn can_be_certified(operation: SumOperation) -> Result<(), Error> {
    match operation {
        SumOperation::Sum(_) | SumOperation::Difference(_) | SumOperation::Offset(_) => Ok(()),
        SumOperation::Opening(_) | SumOperation::Closing(_) => Err(Error::input(format!(
            "{}: bounds of the volume cannot be certified, as its second step starts from a mesh that is approximate; remove \
             --bounds and the assertions",
            operation.command()
        ))),
    }
}

/// Estimates the volume of a result, by its images, by coarser rasters, and by the details that were found between the rays.
fn estimate(
    job: &SumJob,
    (operation, operated): (SumOperation, &Operated),
    solids: &[Solid],
    backend: &SumBackend,
    seconds: &mut Seconds,
    progress: &Monitor,
) -> Result<VolumeEstimate, Error> {
    progress.stage("coarser rasters")?;
    let StepImages { grid, volume_sums, bias, .. } = &operated.last;
    let mut coarser = Vec::new();
    for ratio in check_pitches(&job.axes) {
        let pitch = ratio * grid.pitch();
        let last = operate(job, operation, Raster::coarser(pitch), solids, backend, seconds, progress)?.last;
        coarser.push(axis_volumes(&last.volume_sums));
    }
    let rays = VolumeEstimate::from_rasters(&axis_volumes(volume_sums), &coarser);
    let between_rays: f64 = operated.report.between_rays(operation).map(|(found, grown)| found.volume(grown)).sum();
    Ok(VolumeEstimate { error: rays.error.max(*bias) + between_rays, ..rays })
}

/// The result of all steps, with its report and warnings.
struct Operated {
    last: StepImages,
    report: SumReport,
    warnings: Vec<Warning>,
}

impl Operated {
    /// Returns whether no ray meets the result.
    fn is_empty(&self) -> bool {
        self.last.volume_sums.iter().all(|volume_sums| volume_sums.samples() == 0)
    }
}

/// The images to make, and the part of them to keep.
#[derive(Clone, Copy)]
struct Raster<'j> {
    pitch: f64,
    axes: &'j [Axis],
    mode: Mode,
    keep: Keep,
    /// True if certified bounds of the volume are needed.
    needs_bounds: bool,
    /// True for a raster that only checks a finer one.
    is_coarser: bool,
    /// Bytes that the process held before its first raster; not needed for one that only checks.
    held: u64,
}

impl Raster<'_> {
    /// Returns the raster of a job.
    fn of<'j>(
        job: &'j SumJob,
        (operation, spacing): (SumOperation, Spacing),
        solids: &[Solid],
        held: u64,
    ) -> Raster<'j> {
        let pitch = match spacing {
            Spacing::Resolution(rays) => counted_side(operation, solids) / f64::from(rays),
            Spacing::Pitch(pitch) => pitch,
            Spacing::Tolerance(_) => unreachable!("a refinement lays rasters by their resolution"),
        };
        let needs_bounds = job.certainty.needs_bounds();
        Raster { pitch, axes: &job.axes, mode: job.mode, keep: job.keep, needs_bounds, is_coarser: false, held }
    }

    /// Returns a raster for the error estimate of a finer one.
    fn coarser(pitch: f64) -> Raster<'static> {
        let (axes, mode, keep) = (&Axis::ALL, Mode::Exact, Keep::Sums);
        Raster { pitch, axes, mode, keep, needs_bounds: false, is_coarser: true, held: 0 }
    }
}

/// Runs all steps; the lengths of the operation and of the raster are in the unit of the solids.
fn operate(
    job: &SumJob,
    operation: SumOperation,
    raster: Raster,
    solids: &[Solid],
    backend: &SumBackend,
    seconds: &mut Seconds,
    progress: &Monitor,
) -> Result<Operated, Error> {
    let limit = Limit::new(job.memory);
    let held_by_rays = || machine::held_memory().saturating_sub(raster.held);
    let longest = counted_side(operation, solids);
    let Raster { pitch, axes, mode, keep, needs_bounds, is_coarser, .. } = raster;
    let names = raster::names(solids);
    let (lod, names) = (job.lod, &names[..]);
    let setting = Setting {
        pitch,
        requested: job.spacing,
        longest,
        lod,
        limit,
        held_by_rays: held_by_rays(),
        backend,
        axes,
        mode,
        keep,
        needs_bounds,
        is_coarser,
        names,
        progress,
    };
    let a = closed(&solids[0]);
    let (step, next) = match operation {
        SumOperation::Sum(_) => (Step::Sum(closed(&solids[1])), None),
        SumOperation::Difference(_) => (Step::DifferenceOfReflected(closed(&solids[1])), None),
        SumOperation::Offset(distance) => (Step::Offset(distance), None),
        SumOperation::Opening(radius) => (Step::Offset(-radius), Some(Step::Offset(radius))),
        SumOperation::Closing(radius) => (Step::Offset(radius), Some(Step::Offset(-radius))),
    };
    let Some(next) = next else {
        let last = setting.make(a, &step, seconds)?;
        let report = SumReport { steps: vec![last.report.clone()], memory_limit: limit.bytes() };
        return Ok(Operated { last, report, warnings: Vec::new() });
    };
    let whole = Setting {
        axes: &Axis::ALL,
        mode: Mode::Exact,
        keep: Keep::Mesh(Finish::of_operand().request(Precision::Double)),
        ..setting
    };
    let between = whole.make(a, &step, seconds)?;
    let mut steps = vec![between.report.clone()];
    let (images, normals, volume) = (
        &between.images,
        Some(&between.normals[..]),
        Some(VolumeEstimate::from_axes(&axis_volumes(&between.volume_sums))),
    );
    let imaged = Imaged { images, normals, mode: Mode::Exact, unit: None, volume, memory: job.memory, finer: None };
    let (mesh, found) = surface::mesh(&imaged, Finish::of_operand(), Precision::Double, progress)?;
    let mut warnings = surface::warnings(&found, true);
    warnings.extend(surface::far_from_volume(&imaged, &found).map(|Warning { code, message }| {
        Warning::new(code, format!("between the two steps {message}; the result lacks the same details"))
    }));
    let last = match mesh.triangles.is_empty() {
        // The offset of an empty set is empty.
        true => setting.empty(between)?,
        false => {
            drop(between);
            let mesh = ClosedMesh::check(mesh).map_err(Error::input)?;
            let last = Setting { held_by_rays: held_by_rays(), ..setting }.make(&mesh, &next, seconds)?;
            steps.push(last.report.clone());
            last
        }
    };
    Ok(Operated { last, report: SumReport { steps, memory_limit: limit.bytes() }, warnings })
}

fn axis_volumes(volume_sums: &[VolumeSums]) -> Vec<AxisVolume> {
    volume_sums.iter().map(AxisVolume::from_sums).collect()
}

fn closed(solid: &Solid) -> &ClosedMesh {
    match &solid.surface {
        input::Surface::Closed(closed) => closed,
        input::Surface::Open { .. } => unreachable!("open meshes are refused"),
    }
}

/// Returns a box around the result: that of A where the operation shrinks A.
fn result_box(operation: SumOperation, solids: &[Solid]) -> Aabb {
    let a = solids[0].bounds();
    match operation {
        SumOperation::Sum(_) => {
            let b = solids[1].bounds();
            Aabb { min: a.min + b.min, max: a.max + b.max }
        }
        SumOperation::Offset(distance) if distance > 0.0 => {
            Aabb { min: a.min - DVec3::splat(distance), max: a.max + DVec3::splat(distance) }
        }
        // A closing stays within the convex hull.
        _ => a,
    }
}

/// Returns the sides of the box of A shrunk by B or by the ball, if the result lies in that; negative where there is no room.
fn shrunk_sides(operation: SumOperation, solids: &[Solid]) -> Option<DVec3> {
    let by = match operation {
        SumOperation::Difference(_) => solids[1].bounds().extent(),
        SumOperation::Offset(distance) if distance < 0.0 => DVec3::splat(-2.0 * distance),
        _ => return None,
    };
    Some(solids[0].bounds().extent() - by)
}

/// Returns the greatest volume that the inputs allow a result. An operation that shrinks A gives at most A's volume, and at most that
/// of A's box shrunk by B or by the ball. For an offset inwards, ∛V(result) ≤ ∛V(A) − ∛V(ball) (Brunn–Minkowski). An opening is
/// empty where its first step is.
fn greatest_volume(operation: SumOperation, solids: &[Solid], windings: &Windings) -> f64 {
    let of_a = if windings.are_of_one_sign() { solids[0].volume.abs() } else { f64::INFINITY };
    let of_box = match shrunk_sides(operation, solids) {
        Some(sides) => sides.max(DVec3::ZERO).element_product(),
        None => result_box(operation, solids).extent().element_product(),
    };
    match operation {
        SumOperation::Difference(_) => of_box.min(of_a),
        SumOperation::Offset(distance) if distance < 0.0 => {
            of_box.min((of_a.cbrt() - root_of_ball(-distance)).max(0.0).powi(3))
        }
        SumOperation::Opening(radius) => {
            let narrowest = solids[0].bounds().extent().min_element();
            match 2.0 * radius > narrowest || root_of_ball(radius) > of_a.cbrt() {
                true => 0.0,
                false => of_box.min(of_a),
            }
        }
        SumOperation::Sum(_) | SumOperation::Offset(_) | SumOperation::Closing(_) => of_box,
    }
}

/// Returns the least volume that the inputs allow a result, where they do not overlap themselves: for a sum,
/// ∛V(result) ≥ ∛V(A) + ∛V(B) (Brunn–Minkowski), and a closing contains A.
fn least_volume(operation: SumOperation, solids: &[Solid], windings: &[Windings]) -> f64 {
    let root_of = |i: usize| windings[i].least_volume(solids[i].volume).cbrt();
    let root = match operation {
        SumOperation::Sum(_) => root_of(0) + root_of(1),
        SumOperation::Offset(distance) if distance > 0.0 => root_of(0) + root_of_ball(distance),
        SumOperation::Offset(0.0) | SumOperation::Closing(_) => root_of(0),
        SumOperation::Offset(_) | SumOperation::Difference(_) | SumOperation::Opening(_) => 0.0,
    };
    root.powi(3)
}

/// Returns the cube root of the volume of a ball.
fn root_of_ball(radius: f64) -> f64 {
    radius * (4.0 / 3.0 * PI).cbrt()
}

/// Narrows certified bounds by the shrunk box, of which rounding is counted.
fn within_box(operation: SumOperation, solids: &[Solid], [lower, upper]: [f64; 2]) -> [f64; 2] {
    let Some(sides) = shrunk_sides(operation, solids) else { return [lower, upper] };
    let rounding = 4.0 * f64::EPSILON * solids[0].bounds().extent();
    let of_box = (sides + rounding).max(DVec3::ZERO).element_product();
    [lower, upper.min((1.0 + 4.0 * f64::EPSILON) * of_box)]
}

/// Returns the side that a resolution counts along: the longest of the result's box.
fn counted_side(operation: SumOperation, solids: &[Solid]) -> f64 {
    result_box(operation, solids).extent().max_element()
}

/// The set that enters a sum: a solid or its complement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// The solid.
    Inside,
    /// The complement, where the operation shrinks the solid.
    Outside,
}

/// Returns whether the first input or its complement enters a sum.
fn first_side(operation: SumOperation) -> Side {
    match operation {
        SumOperation::Difference(_) | SumOperation::Opening(_) => Side::Outside,
        SumOperation::Offset(distance) if distance < 0.0 => Side::Outside,
        SumOperation::Sum(_) | SumOperation::Offset(_) | SumOperation::Closing(_) => Side::Inside,
    }
}

/// Reverses a solid whose triangles all face inwards, and refuses solids whose sum is not defined.
fn face_outwards(
    solid: &mut Solid,
    windings: &Windings,
    side: Side,
    requirements: InputRequirements,
) -> Result<Option<Warning>, Error> {
    let name = solid.name().to_string();
    // The non-zero rule is not defined for a mesh whose triangles were turned.
    let unite = match solid.turned {
        0 => format!("unite them first with `ldi-ops sample {name} --fill nonzero --mode exact -o one.stl`"),
        _ => format!("make one surface of them first with `ldi-ops csg a a={name} -o one.stl`"),
    };
    if let Some(share) = windings.overlap() {
        let overlap = format!("{name}: shells overlap in {:.2} % of the solid", 100.0 * share);
        match (requirements.fill, side) {
            (FillRule::NonZero, Side::Inside) => {}
            (FillRule::EvenOdd, Side::Inside) => {
                let way_out = if solid.turned == 0 { "--fill nonzero unites them" } else { &unite };
                return Err(Error::input(format!(
                    "{overlap}, and the even-odd rule cancels them there, for which no sum is defined; {way_out}"
                )));
            }
            // A wall inside two overlapping shells bounds nothing, but would be a surface of the complement.
            (_, Side::Outside) => {
                return Err(Error::input(format!(
                    "{overlap}, and this operation would shrink each shell by itself; {unite}"
                )));
            }
        }
    }
    match windings.shells(solid.volume) {
        Shells::Outwards if side == Side::Outside && windings.share_of_overlaps() > 0.0 => {
            let share = 100.0 * windings.share_of_overlaps();
            let message = format!(
                "{name}: shells overlap in about {share:.1e} % of the solid; each shrinks by itself, so the result is disconnected \
                 there; {unite}"
            );
            Ok(Some(Warning::new("overlap", message)))
        }
        Shells::Outwards => Ok(None),
        Shells::Inwards => {
            input::turn(solid, requirements)?;
            let volume = number(solid.volume);
            let message = format!(
                "{name}: the mesh is inside out (its signed volume is {volume}); its triangles were reversed for this operation"
            );
            Ok(Some(Warning::new("inside-out", message)))
        }
        Shells::Mixed => Err(Error::input(format!(
            "{name}: some shells face outwards and others inwards without a shell around them, so the inside is ambiguous; {}",
            if solid.turned == 0 { "orient all shells the same way" } else { &unite }
        ))),
    }
}

/// Returns the warning of an empty result. Where its emptiness is not proved, it may have details that no ray meets.
fn empty(
    operation: SumOperation,
    pitch: f64,
    (is_proved, has_details): (bool, bool),
    length: impl Fn(f64) -> String,
) -> Warning {
    let pitch = length(pitch);
    let why = match (operation, is_proved) {
        (SumOperation::Difference(_), true) => "B cannot move within A".to_owned(),
        (SumOperation::Difference(_), false) => "B hardly fits into A, if at all".to_owned(),
        // A ball that fits exactly leaves a point.
        (SumOperation::Offset(distance), true) => {
            format!("no ball larger than one of radius {} fits into the solid", length(-distance))
        }
        (SumOperation::Opening(radius), true) => format!("no ball of radius {} fits into the solid", length(radius)),
        (SumOperation::Offset(radius) | SumOperation::Opening(radius), false) => {
            format!("a ball of radius {} hardly fits into the solid, if at all", length(radius.abs()))
        }
        (SumOperation::Sum(_) | SumOperation::Closing(_), _) => "the solid is thinner than the pitch".to_owned(),
    };
    let message = match (is_proved, has_details) {
        (true, _) => format!("the result has no volume, as bounds of its volume prove: {why}"),
        (false, true) => format!("no ray at a pitch of {pitch} meets the result; raise --resolution to resolve it"),
        (false, false) => {
            format!("the result is empty at a pitch of {pitch}: {why}; raise --resolution to find smaller parts")
        }
    };
    Warning::new("empty", message)
}
