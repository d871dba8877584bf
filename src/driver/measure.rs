//! `intersect`, `union`, `difference`, `xor`, `csg`, `volume` and `sample`: images along the requested axes, and their
//! integrals.
//!
//! The axes are processed one after another. An image is kept only if it is to be written; otherwise its sums are kept, so that
//! the images of one axis bound the memory.

use std::mem::take;
use std::time::Instant;

use glam::{DMat3, DVec3};

use super::backend::{Backends, Choice};
use super::certainty::certify;
use super::fill::FillDifference;
use super::image::{ImageMaker, Triangles, alive_at_once};
use super::input::{self, InputRequirements, Sides, Solid};
use super::job::{
    Boolean, ImageTarget, Input, Keep, MeasureJob, Measurement, MeshMethod, MeshRequest, Spacing, VolumeMethod,
};
use super::measured::{Measured, Method, Refinement, Seconds, SolidMeasures, Volume, negligible};
use super::memory::Limit;
use super::refine::{COARSEST, FINEST, RefinementEnd, TOLERANCE_NOT_REACHED, UNMET, refine};
use super::work::work;
use super::{exact_cost, machine, memory, raster, surface};
use crate::boolean::VolumeBounds;
use crate::exact::{self, ExactMesh, ExactProperties, NotExact, Solution};
use crate::grid::{Axis, Grid, LatticeBox, LatticeSolid};
use crate::integrate::{self, AxisVolume, CHECK_PITCHES, Moments, SurfaceHits, VolumeEstimate};
use crate::ldi::Ldi;
use crate::mesh::{Aabb, ClosedMesh, LengthUnit, MassProperties, Unproved, first_crossing};
use crate::number::number;
use crate::progress::Monitor;
use crate::sampler::{FillRule, MaskIntersection, Mode, Sampler, SolidSums};
use crate::surface::Coordinates;
use crate::{Error, Warning, unit};

/// Reads inputs, measures the result of the job and writes `target`.
///
/// The total time counts from `start`.
///
/// # Errors
/// Inputs that cannot be read or sampled, rasters beyond the machine or the limits of the format, and files that cannot be
/// written.
pub fn measure_files(
    job: &MeasureJob,
    inputs: &[Input],
    target: Option<&ImageTarget>,
    backends: &Backends,
    start: Instant,
    progress: &Monitor,
) -> Result<Measured, Error> {
    progress.stage("reading")?;
    let reading = Instant::now();
    let requirements = InputRequirements {
        unit: job.unit,
        openness: job.openness,
        sides: Sides::NotNeeded,
        fill: job.fill,
        hashes: job.hashes,
    };
    let (solids, warnings) = input::solids(inputs, requirements)?;
    let read = reading.elapsed().as_secs_f64();
    progress.detail(format_args!("read in {read:.4} s"));
    measure(job, solids, backends, progress)?.finished(target, (read, warnings), start, progress)
}

/// Measures the result of a job on solids.
///
/// # Errors
/// Those of [`measure_files`], except for reading and writing.
pub fn measure(
    job: &MeasureJob,
    solids: Vec<Solid>,
    backends: &Backends,
    progress: &Monitor,
) -> Result<Measured, Error> {
    let start = Instant::now();
    let mut seconds = Seconds::default();
    let mut warnings = Vec::new();
    let mut exact = exact_result(job, &solids, (&mut seconds, &mut warnings), progress)?;
    let exact_mesh = exact.as_mut().ok().and_then(|exact| exact.mesh.take());
    let spacing = job.spacing.in_unit(solids[0].unit)?;
    // If the volume is known exactly, images are made only for a file or for the value of an estimate.
    let has_all_kept = job.keep == Keep::Sums || exact_mesh.is_some();
    let needs_images = exact.is_err() || job.mode != Mode::Exact || !has_all_kept;
    if let (Keep::Mesh(_), true) = (job.keep, job.axes.len() < 3 && !has_all_kept) {
        return Err(Error::input("a mesh that is not exact needs the images along all axes; remove --axis"));
    }
    let mut refined: Option<RefinementEnd> = None;
    let (mut refinement, mut round) = (None, None);
    if needs_images {
        let mut sample = |spacing| sample_round(job, &solids, backends, spacing, &mut seconds, progress);
        round = Some(match spacing {
            Spacing::Tolerance(tolerance) => {
                let by_rays = |rays| sample(Spacing::Resolution(rays));
                let most = |round: &Round| if round.samples == 0 { UNMET } else { FINEST };
                let volume = |round: &Round| estimated(job, &solids, round, None);
                let (round, end) = refine(tolerance, most, volume, by_rays)?;
                refined = Some(end);
                round
            }
            spacing => sample(spacing)?,
        });
    }
    let grid = match (&round, spacing) {
        (Some(round), _) => round.grid,
        (None, Spacing::Tolerance(_)) => lay(job, &solids, Spacing::Resolution(COARSEST))?,
        // An exact volume needs no raster.
        (None, spacing) => lay(job, &solids, spacing).or_else(|error| {
            let message =
                format!("{error}; the exact volume needs no raster, and the grid that is stated is a coarser one");
            warnings.push(Warning::new("raster-not-laid", message));
            lay(job, &solids, Spacing::Resolution(COARSEST))
        })?,
    };

    let (mut volume, measures) = match (&exact, &round) {
        (Ok(exact), round) if job.mode == Mode::Exact || round.is_none() => {
            let properties = &exact.properties;
            let (volume, measures) = exactly(properties, round.as_ref().map(|round| round.volume));
            if let (Spacing::Tolerance(asked), None) = (spacing, round) {
                let found = Refinement::of(asked, &volume, negligible(&solids), COARSEST);
                let unreached = || {
                    let rounded = match found.came_to.is_finite() {
                        true => format!("up to {} % of it", number(100.0 * found.came_to)),
                        false => "more than it".to_owned(),
                    };
                    let asked = number(100.0 * asked);
                    let message = format!(
                        "--tolerance {asked} %: not reached by the exact volume, which is rounded by {rounded}"
                    );
                    Warning::new(TOLERANCE_NOT_REACHED, message)
                };
                warnings.extend((!found.reached).then(unreached));
                refinement = Some(found);
            }
            let measures = match job.measurement {
                // The order of coincident faces is not defined: rays tell which of them bound the solid.
                Measurement::Volume if properties.area_error > 0.0 => {
                    let choice = backends.choose(|| work(&[], &job.axes));
                    let (area, estimate) = surface_area(job, &solids[0], &grid, choice.sampler(), progress)?;
                    let [least, most] = [-1.0, 1.0].map(|sign| measures.area + sign * properties.area_error);
                    let area = area.max(least).min(most);
                    let farthest = (most - area).max(area - least);
                    // Rays that meet none of the coincident faces tell nothing about them.
                    let area_error = if estimate > 0.0 { estimate.min(farthest) } else { farthest };
                    Some(SolidMeasures { area, area_error, ..measures })
                }
                Measurement::Volume => Some(measures),
                _ => None,
            };
            if let Some(round) = round {
                warnings.extend(solids.iter().filter_map(|solid| thin(solid, &round.grid, &job.axes)));
            }
            for &input in &properties.with_meeting_shells {
                let difference = FillDifference::exact(&solids[input])?;
                warnings.extend(difference.and_then(|difference| difference.warning(&solids[input], job.fill)));
            }
            (volume, measures)
        }
        (exact, Some(round)) => {
            warnings.extend(fill_differences(job, &solids, &round.rules_agree, &mut seconds, progress)?);
            warnings.extend(solids.iter().filter_map(|solid| thin(solid, &grid, &job.axes)));
            let measures = match job.measurement {
                Measurement::Volume => Some(estimated_measures(job, &solids[0], round, &mut seconds, progress)?),
                _ => None,
            };
            let mut volume = estimated(job, &solids, round, exact.as_ref().err().copied().flatten());
            volume.exact = exact.as_ref().ok().map(|exact| {
                let MassProperties { volume, volume_rounding, .. } = exact.properties.mass;
                [volume, volume_rounding]
            });
            (volume, measures)
        }
        (_, None) => unreachable!("a volume without an exact value is sampled"),
    };
    let certified = certify(job, &solids, &volume, (grid.pitch(), spacing), &mut warnings, progress)?;
    // The bounds are those of the exact volume, beyond which over- and under-estimates lie.
    if let (Mode::Exact, Some(bounds)) = (job.mode, certified.bounds) {
        volume.narrow(bounds);
        // Beside an exact volume, the estimate of the rays.
        if let Some(end) = &mut refined {
            end.volume.narrow(bounds);
        }
    }
    if let Some(end) = refined {
        let (found, not_reached) = end.judge();
        refinement = Some(found);
        warnings.extend(not_reached);
    }
    if let Some(round) = &round {
        warnings.extend(round.choice.ran().auto.iter().filter_map(|auto| auto.warning.clone()));
        warnings.extend(open_warning(&solids, round));
    }
    warnings.extend(coarse_voxels(job, &grid, solids[0].unit));

    seconds.total = start.elapsed().as_secs_f64();
    let (images, normals) =
        round.as_mut().map(|round| (take(&mut round.images), take(&mut round.normals))).unwrap_or_default();
    Ok(Measured {
        command: job.measurement.command(),
        measurement: Some(job.measurement.clone()),
        expression: job.measurement.typed_expression().map(str::to_owned),
        unit: solids[0].unit,
        volume,
        certified,
        grid,
        requested: job.spacing,
        layers: round.as_ref().map_or([None; 3], |round| round.layers),
        samples: round.as_ref().map_or(0, |round| round.samples),
        unclosed: round.iter().flat_map(|round| &round.unclosed).map(|(_, rays)| rays).sum(),
        mode: job.mode,
        fill: job.fill,
        memory: job.memory,
        ran: round.as_ref().map(|round| round.choice.ran()),
        seconds,
        warnings,
        images,
        normals,
        finer: None,
        exact_mesh,
        output: None,
        surface: None,
        measures,
        refinement,
        sum: None,
        solids,
    })
}

/// The effect of removing `--exact`, for errors.
const WITHOUT_EXACT: &str = "without --exact it is estimated";
/// The effect of removing `--mesh exact`, for errors.
const WITHOUT_MESH_EXACT: &str = "without --mesh exact the mesh is made from images";

/// The exact properties of a result, and its mesh if one is kept.
struct ExactResult {
    properties: ExactProperties,
    mesh: Option<surface::Exact>,
}

/// Returns the exact properties of the result, if they are sought and the triangles give them, and its exact mesh.
///
/// # Errors
/// The outer error if the job insists on an exact volume or mesh that cannot be had; the inner one gives the reason, if one was
/// found.
fn exact_result(
    job: &MeasureJob,
    solids: &[Solid],
    (seconds, warnings): (&mut Seconds, &mut Vec<Warning>),
    progress: &Monitor,
) -> Result<Result<ExactResult, Option<NotExact>>, Error> {
    if job.method == VolumeMethod::Estimate {
        return Ok(Err(None));
    }
    let mut request = exact_mesh_request(job);
    let insists_on_mesh = request.is_some_and(|request| request.method == MeshMethod::Exact);
    let insists = match job.method {
        VolumeMethod::Exact => Some(WITHOUT_EXACT),
        _ => insists_on_mesh.then_some(WITHOUT_MESH_EXACT),
    };
    let all: Vec<&Solid> = solids.iter().collect();
    let most = exact_cost::costs_if_all_meet(&all);
    let bytes = if request.is_some() { most.mesh } else { most.volume };
    let (limit, held) = (Limit::of_at_most(job.memory, bytes), machine::held_memory());
    let costs = match memory::excess("the exact mesh", held, bytes, limit) {
        None => most,
        Some(_) => exact_cost::costs(&all),
    };
    if let Some(excess) = memory::excess("the exact volume", held, costs.volume, limit) {
        if let Some(otherwise) = insists {
            return Err(Error::machine(format!("{excess}; {otherwise}")));
        }
        let message = format!("{excess}, so it is estimated; a larger --memory gives the exact one");
        warnings.push(Warning::new("exact-volume-memory", message));
        return Ok(Err(None));
    }
    if let Some(excess) = request.and_then(|_| memory::excess("the exact mesh", held, costs.mesh, limit)) {
        if insists_on_mesh {
            return Err(Error::machine(format!("{excess}; {WITHOUT_MESH_EXACT}")));
        }
        let message = format!("{excess}, so the mesh is made from images; a larger --memory gives the exact one");
        warnings.push(Warning::new("exact-mesh-memory", message));
        request = None;
    }
    progress.stage("exact volume")?;
    let start = Instant::now();
    let closed: Option<Vec<&ClosedMesh>> = solids.iter().map(Solid::closed).collect();
    let found = match (closed, &job.measurement) {
        (None, _) => Err(None),
        (Some(closed), Measurement::Boolean(boolean)) => {
            let solution = Solution::of(&closed, &boolean.expression, job.fill).map_err(Some);
            solution.map(|solution| (solution.properties(), Some(solution)))
        }
        (Some(closed), _) => exact::of_solid(closed[0], job.fill).map(|properties| (properties, None)).map_err(Some),
    };
    let took = start.elapsed().as_secs_f64();
    seconds.integrate += took;
    let outcome = match &found {
        Ok(_) => "exact volume".to_owned(),
        Err(Some(NotExact { input, why })) => format!("no exact volume, as {}: {why}", solids[*input].name()),
        Err(None) => "no exact volume, as a mesh is open".to_owned(),
    };
    progress.detail(format_args!("{outcome}, in {took:.4} s"));
    let (properties, solution) = match (insists, found) {
        (_, Ok(found)) => found,
        (Some(otherwise), Err(_)) => return Err(Error::input(format!("{outcome}; {otherwise}"))),
        (None, Err(why)) => {
            if let Some(NotExact { input, why: why @ Unproved::TooSmall }) = why {
                let message = format!(
                    "{}: {why}, so the volume is estimated; make the largest input smaller, or move the inputs nearer to one another",
                    solids[input].name()
                );
                warnings.push(Warning::new("too-small", message));
            }
            return Ok(Err(why));
        }
    };
    let mut mesh = None;
    if let (Some(request), Some(solution)) = (request, solution) {
        progress.stage("exact mesh")?;
        let meshing = Instant::now();
        let made = exact_mesh(request, &solution, &properties.mass, solids);
        warnings.extend(mesh_off(&made, &properties.mass, solids));
        warnings.extend(crossing_walls(&made, &solution.with_own_overlaps(), solids));
        mesh = Some(made);
        let took = meshing.elapsed().as_secs_f64();
        seconds.operate += took;
        progress.detail(format_args!("exact mesh in {took:.4} s"));
    }
    Ok(Ok(ExactResult { properties, mesh }))
}

/// Returns the request for an exact mesh, if the job has one: only Booleans have exact meshes, and an over- or under-estimate asks
/// for the mesh of its image.
fn exact_mesh_request(job: &MeasureJob) -> Option<MeshRequest> {
    match (job.keep, &job.measurement, job.mode) {
        (Keep::Mesh(request), Measurement::Boolean(_), Mode::Exact) if request.method != MeshMethod::Sampled => {
            Some(request)
        }
        _ => None,
    }
}

/// Returns the exact mesh in the coordinates of a file. Coincident faces may leave walls without thickness of a result that has no
/// volume; its mesh is empty.
fn exact_mesh(request: MeshRequest, solution: &Solution, mass: &MassProperties, solids: &[Solid]) -> surface::Exact {
    let MeshRequest { precision, recentre, .. } = request;
    let recentred = recentre.then(|| {
        let [min, max] = solution.corners();
        surface::middle(if min.cmple(max).all() { Aabb { min, max } } else { raster::common_box(solids) })
    });
    let coordinates = Coordinates { precision, offset: recentred.unwrap_or_default() };
    let found = solution.mesh(coordinates);
    let is_walls = || found.mesh.signed_volume() <= found.rounding.thickness * found.mesh.area();
    // Beside a far larger solid, the bound of the rounding says nothing.
    let is_empty = mass.volume <= mass.volume_rounding && is_walls();
    let mesh = if is_empty { ExactMesh { rounding: found.rounding, ..ExactMesh::default() } } else { found };
    surface::Exact { mesh, precision, recentred }
}

/// Difference of the volumes of an exact mesh and of the solid, as a share of the latter, above which there is a warning.
const MESH_OFF: f64 = 1e-3;

/// Returns a warning if an exact mesh encloses another volume than the exact one by more than that is rounded.
fn mesh_off(made: &surface::Exact, mass: &MassProperties, solids: &[Solid]) -> Option<Warning> {
    // An empty mesh is not written.
    if made.mesh.mesh.triangles.is_empty() {
        return None;
    }
    let &MassProperties { volume, volume_rounding, .. } = mass;
    let of_mesh = made.mesh.mesh.signed_volume();
    let off = (of_mesh - volume).abs();
    if off <= volume_rounding + (MESH_OFF * volume).max(negligible(solids)) {
        return None;
    }
    let message = format!(
        "the mesh encloses {}, but the exact volume is {}, as {}",
        number(of_mesh),
        number(volume),
        made.rounding(solids[0].unit),
    );
    Some(Warning::new("mesh-rounded", message))
}

/// Returns a warning if an exact mesh crosses itself, in walls between faces that lie on one another in one shell of some inputs.
fn crossing_walls(made: &surface::Exact, inputs: &[usize], solids: &[Solid]) -> Option<Warning> {
    if inputs.is_empty() {
        return None;
    }
    let crossing = first_crossing(&ClosedMesh::check(made.mesh.mesh.clone()).ok()?)?;
    let names: Vec<String> = inputs.iter().map(|&input| solids[input].name().to_string()).collect();
    let message = format!(
        "{}: faces of one shell lie on one another, and the exact mesh keeps walls of no thickness, where {crossing}; --fill nonzero \
         mostly leaves none, and neither does --mesh sampled",
        names.join(", "),
    );
    Some(Warning::new("walls-left", message))
}

/// Returns the volume and the measures of a solid from sums over its triangles.
fn exactly(properties: &ExactProperties, rays: Option<VolumeEstimate>) -> (Volume, SolidMeasures) {
    let &ExactProperties {
        mass: MassProperties { volume, volume_rounding: error, area, centroid, inertia },
        possible,
        ..
    } = properties;
    let exact = Some([volume, error]);
    let volume = Volume { value: volume, error, method: Method::Exact, exact, rays, possible };
    (volume, SolidMeasures { area, area_error: 0.0, centroid, inertia })
}

/// Returns the volume from images, clamped to the volumes that the inputs allow.
fn estimated(job: &MeasureJob, solids: &[Solid], round: &Round, not_exact: Option<NotExact>) -> Volume {
    let mut volume = Volume::estimate(round.volume, possible(job, solids, &round.rules_agree), not_exact);
    // On all rays the fill rules agree, so the signed volume of the mesh is that of the solid: the error is at least the
    // difference.
    if job.measurement.expression().is_none() && round.rules_agree[0] == Some(true) {
        volume.error = volume.error.max((volume.value - solids[0].volume.abs()).abs());
    }
    volume
}

/// Returns area and moments of a solid from images.
fn estimated_measures(
    job: &MeasureJob,
    solid: &Solid,
    round: &Round,
    seconds: &mut Seconds,
    progress: &Monitor,
) -> Result<SolidMeasures, Error> {
    let measuring = Instant::now();
    let (centroid, inertia) = mean_moments(&round.moments);
    let (area, area_error) = match round.shows_every_facet {
        true => (solid.mesh().area(), 0.0),
        false => surface_area(job, solid, &round.grid, round.choice.sampler(), progress)?,
    };
    seconds.integrate += measuring.elapsed().as_secs_f64();
    Ok(SolidMeasures { area, area_error, centroid, inertia })
}

/// Returns warnings about solids whose volumes differ between the fill rules.
fn fill_differences(
    job: &MeasureJob,
    solids: &[Solid],
    rules_agree: &[Option<bool>],
    seconds: &mut Seconds,
    progress: &Monitor,
) -> Result<Vec<Warning>, Error> {
    let comparing = Instant::now();
    let mut warnings = Vec::new();
    for (solid, _) in solids.iter().zip(rules_agree).filter(|(_, agree)| **agree != Some(true)) {
        let difference = FillDifference::of(solid)?;
        warnings.extend(difference.and_then(|difference| difference.warning(solid, job.fill)));
    }
    let compared = comparing.elapsed().as_secs_f64();
    seconds.sample += compared;
    progress.detail(format_args!("fill rules compared in {compared:.4} s"));
    Ok(warnings)
}

/// Returns the least and the greatest volume that the inputs allow: no solid exceeds its box, and the volume of a closed mesh is
/// known if the fill rules agree on all rays.
fn possible(job: &MeasureJob, solids: &[Solid], rules_agree: &[Option<bool>]) -> [f64; 2] {
    let known = |i: usize| {
        let (solid, Aabb { min, max }) = (&solids[i], solids[i].bounds());
        let volume = match rules_agree[i] == Some(true) && solid.is_oriented() {
            true => [solid.volume.abs(); 2],
            false => [0.0, (max - min).element_product()],
        };
        VolumeBounds { volume, corners: [min, max] }
    };
    match job.measurement.expression() {
        Some(expression) => expression.volume_bounds(known).volume,
        // The volume of a single solid is the unknown, so only its box bounds it.
        None => [0.0, solids[0].bounds().extent().element_product()],
    }
}

/// The results from the images of one grid.
struct Round<'b> {
    choice: Choice<'b>,
    grid: Grid,
    volume: VolumeEstimate,
    moments: Vec<Moments>,
    /// True if three exact images show that all facets bound the solid.
    shows_every_facet: bool,
    layers: [Option<u32>; 3],
    samples: u64,
    unclosed: Vec<(Axis, u64)>,
    images: Vec<Ldi>,
    /// The normals of all triangles, whose numbers count through all inputs.
    normals: Vec<[f32; 3]>,
    /// For each input: true if the fill rules agree in all its images; `None` without an image of this input alone.
    rules_agree: Vec<Option<bool>>,
}

/// Lays a raster around all solids.
fn lay(job: &MeasureJob, solids: &[Solid], spacing: Spacing) -> Result<Grid, Error> {
    raster::lay(raster::common_box(solids), spacing, job.lod, raster::names(solids))
}

/// Refuses images that would not fit into memory, before the system kills the process.
fn admit(job: &MeasureJob, solids: &[Solid], lattice: &[LatticeSolid], grid: &Grid) -> Result<(), Error> {
    let images = memory::Images {
        held: machine::held_memory(),
        axes: &job.axes,
        at_once: alive_at_once(&job.measurement, job.mode),
        have_triangles: job.keep.has_triangles(),
        are_kept: job.keep != Keep::Sums,
        have_normals: job.keep == Keep::ImagesWithTriangles,
    };
    let way_out = |factor| {
        let longest = raster::common_box(solids).extent().max_element();
        memory::coarser(factor, longest, grid, job.spacing)
    };
    memory::admit_images(images, grid, lattice, Limit::new(job.memory), way_out)
}

/// Returns the solids on a grid, restricted to the rays that can matter.
fn quantise<'s>(job: &MeasureJob, solids: &'s [Solid], grid: &Grid) -> Result<Vec<LatticeSolid<'s>>, Error> {
    let mut lattice: Vec<LatticeSolid> = solids.iter().map(|solid| solid.quantise(grid)).collect::<Result<_, _>>()?;
    if solids.iter().all(Solid::is_closed) {
        restrict(&job.measurement, &mut lattice);
    }
    Ok(lattice)
}

/// Returns the pitches of the coarser rasters that images along these axes are compared with. A user who requests fewer axes
/// wants a fast result, and one coarser raster is enough to estimate its error.
pub fn check_pitches(axes: &[Axis]) -> &'static [f64] {
    if axes.len() == 3 { &CHECK_PITCHES } else { &CHECK_PITCHES[1..] }
}

/// Returns the volumes of the exact images along all axes on a coarser raster, with which an estimate is compared.
fn check_raster(
    job: &MeasureJob,
    solids: &[Solid],
    pitch: f64,
    sampler: &dyn MaskIntersection,
    rules_agree: &mut [Option<bool>],
    seconds: &mut Seconds,
) -> Result<Vec<AxisVolume>, Error> {
    let quantising = Instant::now();
    let grid = lay(job, solids, Spacing::Pitch(pitch))?;
    let lattice = quantise(job, solids, &grid)?;
    seconds.sample += quantising.elapsed().as_secs_f64();
    let (mode, fill) = (Mode::Exact, job.fill);
    let (axis, triangles) = (Axis::X, Triangles::NotWanted);
    let mut maker = ImageMaker { sampler, axis, mode, fill, triangles, seconds, rules_agree };
    let sums = maker.volume_sums(&job.measurement, &lattice, &Axis::ALL)?;
    Ok(sums.iter().map(AxisVolume::from_sums).collect())
}

/// Lays a grid and samples along every requested axis.
fn sample_round<'b>(
    job: &MeasureJob,
    solids: &[Solid],
    backends: &'b Backends,
    spacing: Spacing,
    seconds: &mut Seconds,
    progress: &Monitor,
) -> Result<Round<'b>, Error> {
    let quantising = Instant::now();
    let grid = lay(job, solids, spacing)?;
    let lattice = quantise(job, solids, &grid)?;
    admit(job, solids, &lattice, &grid)?;
    seconds.sample += quantising.elapsed().as_secs_f64();
    let choice = backends.choose(|| work(&lattice, &job.axes));

    // A GPU computes sums itself, unless the images are needed.
    let keeps_images = !choice.is_gpu() || job.keep != Keep::Sums;

    let triangles = if job.keep.has_triangles() { Triangles::Wanted } else { Triangles::NotWanted };

    let [x, y, z] = grid.rays();
    progress.expect(job.axes.len())?;
    let mut volumes = Vec::new();
    let mut round = Round {
        choice,
        grid,
        volume: VolumeEstimate { value: 0.0, error: 0.0 },
        moments: Vec::new(),
        shows_every_facet: job.mode == Mode::Exact && job.axes.len() == 3,
        layers: [None; 3],
        samples: 0,
        unclosed: Vec::new(),
        images: Vec::new(),
        normals: match triangles {
            Triangles::Wanted => lattice.iter().flat_map(LatticeSolid::normals).collect(),
            Triangles::NotWanted => Vec::new(),
        },
        rules_agree: vec![None; solids.len()],
    };
    let mut sums = Vec::new();
    let has_moments = job.measurement == Measurement::Volume;
    for (index, &axis) in job.axes.iter().enumerate() {
        progress.stage(format!("{x} × {y} × {z} rays, along {}", axis.name()))?;
        let mut maker = ImageMaker {
            sampler: round.choice.sampler(),
            axis,
            mode: job.mode,
            fill: job.fill,
            triangles,
            seconds,
            rules_agree: &mut round.rules_agree,
        };
        let (volume_sums, solid_sums) = if keeps_images {
            let image = maker.image(&job.measurement, &lattice)?;
            let integrating = Instant::now();
            let solid_sums = has_moments.then(|| SolidSums::of(&image));
            let volume_sums = solid_sums.map_or_else(|| image.volume_sums(), |sums| sums.volume);
            seconds.integrate += integrating.elapsed().as_secs_f64();
            if job.keep != Keep::Sums {
                round.images.push(image);
            }
            (volume_sums, solid_sums)
        } else {
            if sums.is_empty() {
                let together = ImageMaker::sums_together(&job.measurement, job.mode);
                let axes = if together { &job.axes[..] } else { &job.axes[index..=index] };
                sums = match has_moments {
                    true => {
                        let sums = maker.solid_sums(&lattice[0], axes)?;
                        sums.into_iter().map(|sums| (sums.volume, Some(sums))).collect()
                    }
                    false => {
                        let sums = maker.volume_sums(&job.measurement, &lattice, axes)?;
                        sums.into_iter().map(|sums| (sums, None)).collect()
                    }
                };
            }
            sums.remove(0)
        };
        if let Some(sums) = solid_sums {
            round.moments.push(integrate::moments_of_sums(&sums.moments, &round.grid, axis));
            round.shows_every_facet &= integrate::sums_show_every_facet(&sums.volume, &sums.moments);
        }
        volumes.push(AxisVolume::from_sums(&volume_sums));
        round.layers[axis.depth()] = Some(volume_sums.layers());
        round.samples += volume_sums.samples();
        round.unclosed.push((axis, volume_sums.unclosed()));
        progress.step()?;
    }
    progress.stage("coarser rasters")?;
    let Round { choice, rules_agree, .. } = &mut round;
    let raster = |ratio: &f64| check_raster(job, solids, ratio * grid.pitch(), choice.sampler(), rules_agree, seconds);
    let coarser = check_pitches(&job.axes).iter().map(raster).collect::<Result<Vec<_>, Error>>()?;
    round.volume = VolumeEstimate::from_rasters(&volumes, &coarser);
    progress.detail(format_args!("{x} × {y} × {z} rays: sampled by {:.4} s; {}", seconds.sample, round.choice.ran()));
    Ok(round)
}

/// Restricts closed solids to the rays that can matter.
fn restrict(measurement: &Measurement, solids: &mut Vec<LatticeSolid>) {
    let Measurement::Boolean(Boolean { expression, .. }) = measurement else { return };
    let bounds: Vec<LatticeBox> = solids.iter().map(|solid| *solid.bounds()).collect();
    let regions = expression.regions(&bounds);
    *solids = solids.drain(..).zip(&regions).map(|(solid, region)| solid.within(region)).collect();
}

/// The most rays along the longest side for the share of a mesh's surface that bounds the solid.
const AREA_RESOLUTION: u32 = 512;

/// Returns the surface area with an error estimate: the area of the mesh, times the share of it that bounds the solid according to
/// rays along the three axes. It is exact if no triangle lies inside. If no ray meets a triangle, the share is 1. The error is the
/// larger of the differences to the shares of two coarser rasters, plus a pixel along the border of what lies inside.
fn surface_area(
    job: &MeasureJob,
    solid: &Solid,
    used: &Grid,
    sampler: &dyn Sampler,
    progress: &Monitor,
) -> Result<(f64, f64), Error> {
    let rays = used.rays().into_iter().max().unwrap_or(1).min(AREA_RESOLUTION);
    let share = |coarser: f64| {
        let rays = (f64::from(rays) / coarser).ceil() as u32;
        let grid = Grid::with_resolution(solid.bounds(), rays, job.lod).map_err(Error::input)?;
        surface_share(job, solid, &grid, sampler, progress)
    };
    let fine = share(1.0)?;
    let [finer, coarser] = CHECK_PITCHES;
    let change = (share(finer)? - fine).abs().max((share(coarser)? - fine).abs());
    let area = solid.mesh().area();
    let pitch = solid.bounds().extent().max_element() / f64::from(rays);
    // Pixels count up to one beyond the border of what lies inside, taken for a square.
    let border = 4.0 * pitch * ((1.0 - fine) * area).max(0.0).sqrt();
    Ok((area * fine, area * change + border))
}

/// Returns the share of a mesh's area that bounds the solid, according to rays along the three axes.
fn surface_share(
    job: &MeasureJob,
    solid: &Solid,
    grid: &Grid,
    sampler: &dyn Sampler,
    progress: &Monitor,
) -> Result<f64, Error> {
    let lattice = solid.quantise(grid)?;
    let mut total = SurfaceHits::default();
    for axis in Axis::ALL {
        progress.stage(format!("area, along {}", axis.name()))?;
        let hits = |fill| -> Result<SurfaceHits, Error> {
            let image = sampler.sample_surface(&lattice, axis, fill)?;
            Ok(integrate::surface_hits(&image, |triangle| lattice.facing(triangle, axis)))
        };
        // Only the even-odd rule keeps every crossing.
        let every = hits(FillRule::EvenOdd)?;
        total.all += every.all;
        total.boundary += match job.fill {
            FillRule::EvenOdd => every.boundary,
            FillRule::NonZero => hits(FillRule::NonZero)?.boundary,
        };
    }
    Ok(if total.all > 0.0 { total.boundary / total.all } else { 1.0 })
}

/// Returns centroid and inertia: the means over the images along different axes that have any; NaN if none has.
pub fn mean_moments(moments: &[Moments]) -> (DVec3, DMat3) {
    let found = || moments.iter().filter(|moments| moments.volume > 0.0);
    // Without any, that is infinite, and its product with zero not a number.
    let share = 1.0 / found().count() as f64;
    let centroid = found().map(|m| m.centroid).sum::<DVec3>() * share;
    let inertia = found().fold(DMat3::ZERO, |sum, m| sum + m.inertia) * share;
    (centroid, inertia)
}

/// Returns a warning if a solid is narrower than the pitch, so that rays may miss it.
fn thin(solid: &Solid, grid: &Grid, axes: &[Axis]) -> Option<Warning> {
    let extent = solid.bounds().extent();
    let (axis, width) = axes
        .iter()
        .flat_map(|axis| [axis.column(), axis.row()].map(|across| (axis, extent[across])))
        .find(|&(_, width)| width < grid.pitch())?;
    let message = format!(
        "{}: the solid is {} wide across the rays along {}, which lie {} apart and may miss it; raise --resolution or lower \
         --pitch",
        solid.name(),
        unit::rounded(width, solid.unit),
        axis.name(),
        unit::rounded(grid.pitch(), solid.unit),
    );
    Some(Warning::new("thinner-than-pitch", message))
}

/// Returns a warning for an estimate of a Boolean whose voxels are longer than the pitch. The bias of an estimate of one solid is
/// known; that of a Boolean appears only in the difference to exact coarser images.
fn coarse_voxels(job: &MeasureJob, grid: &Grid, unit: Option<LengthUnit>) -> Option<Warning> {
    let voxel = |axis: &Axis| f64::from(grid.voxel(*axis)) * grid.step();
    let longest = job.axes.iter().map(voxel).fold(0.0, f64::max);
    let (Measurement::Boolean(_), Mode::Estimate(_)) = (&job.measurement, job.mode) else { return None };
    if longest <= grid.pitch() {
        return None;
    }
    let message = format!(
        "the voxels of a ray are {} long, longer than the pitch of {}: an estimate may add or omit this length at each surface; \
         raise --lod to reduce it, or use --mode exact to avoid it",
        unit::rounded(longest, unit),
        unit::rounded(grid.pitch(), unit),
    );
    Some(Warning::new("coarse-voxels", message))
}

/// Returns a warning with the number of unclosed rays, if an open mesh was sampled.
fn open_warning(solids: &[Solid], round: &Round) -> Option<Warning> {
    let open: Vec<String> = solids.iter().filter(|s| !s.is_closed()).map(|s| s.name().to_string()).collect();
    if open.is_empty() {
        return None;
    }
    let each = round.unclosed.iter().map(|&(axis, unclosed)| {
        let (columns, rows) = round.grid.image_size(axis);
        format!("{unclosed} of {} along {}", u64::from(columns) * u64::from(rows), axis.name())
    });
    let rays = each.collect::<Vec<_>>().join(", ");
    let message = format!("{}: the mesh is not closed; rays that do not close count as empty: {rays}", open.join(", "));
    Some(Warning::new("open", message))
}
