//! `intersect`, `union`, `difference`, `xor`, `csg`, `volume` and `sample`: images along the axes that were asked for, and what
//! they integrate to.
//!
//! One axis is done after another, and of each image only numbers are kept unless it is to be written, so that memory is
//! bounded by the images of one axis.

use std::fmt;
use std::mem::take;
use std::path::PathBuf;
use std::time::Instant;

use glam::{DMat3, DVec3};
#[cfg(feature = "report")]
use serde::Serialize;

use super::backend::{Backends, Choice, Ran};
use super::fill::FillDifference;
use super::image::{ImageMaker, Triangles, alive_at_once};
use super::input::{self, InputRequirements, Sides, Solid};
use super::job::{Boolean, ImageTarget, Input, Keep, MeasureJob, Measurement, Spacing};
use super::memory::Limit;
use super::sum::SumReport;
use super::surface::{Imaged, SurfaceReport};
use super::work::work;
use super::{machine, memory, raster, write};
use crate::boolean::VolumeBounds;
use crate::grid::{Axis, Grid, LatticeBox, LatticeSolid};
use crate::integrate::{self, AxisVolume, CHECK_PITCHES, Moments, SurfaceHits, VolumeEstimate};
use crate::ldi::Ldi;
use crate::mesh::{self, Aabb, LengthUnit, MassProperties, Unproved};
use crate::number::number;
use crate::progress::Monitor;
use crate::sampler::{FillRule, MaskIntersection, Mode, Sampler};
use crate::unit;
use crate::{Error, Estimate, Warning};

/// Everything that is known of a result.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The name of the command.
    pub command: &'static str,
    /// The expression that was typed.
    pub expression: Option<String>,
    /// The inputs.
    pub solids: Vec<Solid>,
    /// The unit of all lengths, where it is known.
    pub unit: Option<LengthUnit>,
    /// The volume of the result.
    pub volume: Volume,
    /// The raster.
    pub grid: Grid,
    /// The most samples on a ray along x, y and z; nothing for axes that were not sampled.
    pub layers: [Option<u32>; 3],
    /// Samples of all axes together.
    pub samples: u64,
    /// Unclosed rays of all axes together.
    pub unclosed: u64,
    /// The mode of the images.
    pub mode: Mode,
    /// The fill rule.
    pub fill: FillRule,
    /// Where the images were made, if any were.
    pub ran: Option<Ran>,
    /// Times by stage.
    pub seconds: Seconds,
    /// Remarks on inputs and result.
    pub warnings: Vec<Warning>,
    /// The images, where they are kept.
    pub images: Vec<Ldi>,
    /// The normals of the triangles that the images know.
    pub normals: Vec<[f32; 3]>,
    /// The file that the images, or what is made of them, were written to.
    pub output: Option<PathBuf>,
    /// The mesh that was made of the images, where one was asked for.
    pub surface: Option<SurfaceReport>,
    /// What `volume` adds.
    pub measures: Option<SolidMeasures>,
    /// What a tolerance led to.
    pub refinement: Option<Refinement>,
    /// What a sum took.
    pub sum: Option<SumReport>,
}

/// The volume of a result, and how well it is known.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// The volume, in cubic units of the inputs.
    pub value: f64,
    /// Of an exact value the bound of its rounding, else an estimate.
    pub error: f64,
    /// The method.
    pub method: Method,
    /// What the images alone say, if any were made.
    pub rays: Option<VolumeEstimate>,
    /// The least and the greatest volume that the inputs allow.
    pub possible: [f64; 2],
}

/// How a volume was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// By sums over the triangles of a mesh whose winding numbers are proved to be 0 and 1.
    Exact,
    /// From images. Of a solid by itself: why its triangles do not do.
    Estimate(Option<Unproved>),
}

impl Volume {
    /// What images say, held to what the inputs allow.
    pub fn estimate(rays: VolumeEstimate, possible: [f64; 2], unproved: Option<Unproved>) -> Volume {
        let [least, greatest] = possible;
        // NaN stays what it is.
        let value = rays.value.max(least).min(greatest);
        let farthest = (greatest - value).max(value - least);
        // Where the rays contradict the inputs, or meet nothing, all that is known is what the inputs allow.
        let error = match rays.value == 0.0 || (value - rays.value).abs() > rays.error {
            true => farthest,
            false => (rays.error + (value - rays.value).abs()).min(farthest),
        };
        // The volumes of the inputs are rounded.
        let error = error + 1e-12 * greatest;
        Volume { value, error, method: Method::Estimate(unproved), rays: Some(rays), possible }
    }

    /// Whether no ray met anything, so that all that is known is what the inputs allow.
    pub fn is_unresolved(&self) -> bool {
        self.rays.is_some_and(|rays| rays.value == 0.0)
            && self.method != Method::Exact
            && self.possible[1] > self.possible[0]
    }
}

/// Area and moments of one solid.
#[derive(Clone, Copy, Debug)]
pub struct SolidMeasures {
    /// Of the surface of the solid: triangles inside it do not count.
    pub area: f64,
    /// Not a number where there is no volume.
    pub centroid: DVec3,
    /// About the centroid, for unit density. Not a number where there is no volume.
    pub inertia: DMat3,
}

/// How `--tolerance` went.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "report", derive(Serialize))]
pub struct Refinement {
    /// The share of the volume that the error estimate was to be below.
    pub asked: f64,
    /// The share it came to; nothing where the volume is zero.
    pub came_to: f64,
    /// Whether the tolerance was reached.
    pub reached: bool,
    /// Rays along the longest side in the end.
    pub resolution: u32,
}

impl fmt::Display for Refinement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "--tolerance {} %: {} with {} rays along the longest side, where the estimate is {} % of the volume",
            number(100.0 * self.asked),
            if self.reached { "reached" } else { "not reached" },
            self.resolution,
            number(100.0 * self.came_to),
        )
    }
}

/// Where the time went.
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
    /// All of it.
    pub total: f64,
}

/// Reads inputs, measures what they make together and writes what `target` asks for.
///
/// `start` is the time from which the total counts.
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

/// Measures what solids make together.
///
/// # Errors
/// Those of [`measure_files`], but for reading and writing.
pub fn measure(
    job: &MeasureJob,
    solids: Vec<Solid>,
    backends: &Backends,
    progress: &Monitor,
) -> Result<Measured, Error> {
    let start = Instant::now();
    let mut seconds = Seconds::default();
    let mut warnings = Vec::new();
    let exact = match job.measurement {
        Measurement::Volume => {
            progress.stage("looking for triangles that meet")?;
            exact_sums(&solids[0], &mut seconds, progress)
        }
        _ => Err(None),
    };
    let spacing = job.spacing.in_unit(solids[0].unit)?;
    // The images of what is known exactly are but a check.
    let needs_images = exact.is_err() || job.check_rays || job.keep != Keep::Sums;
    let mut refinement = None;
    let mut round = None;
    if needs_images {
        let mut sample = |spacing| sample_round(job, &solids, backends, spacing, &mut seconds, progress);
        round = Some(match spacing {
            Spacing::Tolerance(_) if exact.is_ok() => sample(Spacing::Resolution(COARSEST))?,
            Spacing::Tolerance(tolerance) => {
                let (round, found) = refine(tolerance, &mut sample)?;
                if !found.reached {
                    warnings.push(Warning::new("tolerance-not-reached", found.to_string()));
                }
                refinement = Some(found);
                round
            }
            spacing => sample(spacing)?,
        });
    }
    let grid = match (&round, spacing) {
        (Some(round), _) => round.grid,
        (None, Spacing::Tolerance(_)) => lay(job, &solids, Spacing::Resolution(COARSEST))?,
        (None, spacing) => lay(job, &solids, spacing)?,
    };

    let (volume, measures) = match (&exact, &round) {
        (Ok(sums), round) => {
            let (volume, measures) = exactly(sums, round.as_ref().map(|round| round.volume));
            if let Spacing::Tolerance(asked) = spacing {
                let came_to = volume.error / volume.value;
                refinement = Some(Refinement { asked, came_to, reached: came_to <= asked, resolution: COARSEST });
            }
            (volume, Some(measures))
        }
        (Err(unproved), Some(round)) => {
            warnings.extend(fill_differences(job, &solids, &round.rules_agree, &mut seconds, progress)?);
            warnings.extend(solids.iter().filter_map(|solid| thin(solid, &grid, &job.axes)));
            let measures = match job.measurement {
                Measurement::Volume => Some(estimated_measures(job, &solids[0], round, &mut seconds, progress)?),
                _ => None,
            };
            (estimated(job, &solids, round, *unproved), measures)
        }
        (Err(_), None) => unreachable!("what is not known exactly is sampled"),
    };
    if let Some(round) = &round {
        warnings.extend(round.choice.ran().auto.iter().filter_map(|auto| auto.warning.clone()));
        warnings.extend(open_warning(&solids, round));
    }
    warnings.extend(coarse_voxels(job, &grid));

    seconds.total = start.elapsed().as_secs_f64();
    let (images, normals) =
        round.as_mut().map(|round| (take(&mut round.images), take(&mut round.normals))).unwrap_or_default();
    Ok(Measured {
        command: job.measurement.command(),
        expression: job.measurement.typed_expression().map(str::to_owned),
        unit: solids[0].unit,
        volume,
        grid,
        layers: round.as_ref().map_or([None; 3], |round| round.layers),
        samples: round.as_ref().map_or(0, |round| round.samples),
        unclosed: round.iter().flat_map(|round| &round.unclosed).map(|(_, rays)| rays).sum(),
        mode: job.mode,
        fill: job.fill,
        ran: round.as_ref().map(|round| round.choice.ran()),
        seconds,
        warnings,
        images,
        normals,
        output: None,
        surface: None,
        measures,
        refinement,
        sum: None,
        solids,
    })
}

impl Measured {
    /// Returns the volume with its error, its method and its unit.
    pub fn estimate(&self) -> Estimate {
        Estimate::of_volume(&self.volume, self.unit)
    }

    /// Returns the images, with all that a file of them needs.
    pub fn imaged(&self) -> Imaged<'_> {
        let (images, normals, volume) = (&self.images[..], Some(&self.normals[..]), self.volume.rays);
        Imaged { images, normals, mode: self.mode, unit: self.unit, volume }
    }

    /// Writes what `target` asks for and drops the images, after the inputs were read in so many seconds with some warnings.
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
            let (surface, said) = write::images(target, &self.imaged(), progress)?;
            warnings.extend(said);
            self.output = match &surface {
                Some(surface) => surface.path.clone(),
                None => Some(target.path.clone()),
            };
            self.surface = surface;
            self.seconds.write += writing.elapsed().as_secs_f64();
        }
        (self.images, self.normals) = (Vec::new(), Vec::new());
        self.warnings = warnings;
        self.seconds.read = read;
        self.seconds.total = start.elapsed().as_secs_f64();
        self.look_over();
        Ok(self)
    }

    /// Warns of numbers that are far off or not finite.
    pub(crate) fn look_over(&mut self) {
        self.warnings.extend(imprecise(self));
        self.warnings.extend(not_finite(self));
    }
}

/// Sums over the triangles of a solid, where it is proved that they enclose no point twice; else the reason, if the mesh is
/// closed.
fn exact_sums(solid: &Solid, seconds: &mut Seconds, progress: &Monitor) -> Result<MassProperties, Option<Unproved>> {
    let closed = solid.closed().ok_or(None)?;
    let proving = Instant::now();
    let proof = mesh::prove_simple(closed);
    let sums = proof.map(|()| closed.mass_properties());
    let took = proving.elapsed().as_secs_f64();
    seconds.integrate += took;
    let found = proof.map_or_else(|why| format!("not proved to be 0 and 1: {why}"), |()| "0 and 1".to_owned());
    progress.detail(format_args!("{}: winding numbers {found}, in {took:.4} s", solid.name()));
    sums.map_err(Some)
}

/// The volume and the measures of a solid from sums over its triangles. An inside-out mesh has the same solid.
fn exactly(sums: &MassProperties, rays: Option<VolumeEstimate>) -> (Volume, SolidMeasures) {
    let &MassProperties { volume, volume_rounding, area, centroid, inertia } = sums;
    let sign = volume.signum();
    let value = sign * volume;
    let volume = Volume { value, error: volume_rounding, method: Method::Exact, rays, possible: [value, value] };
    (volume, SolidMeasures { area, centroid, inertia: sign * inertia })
}

/// The volume that images give, held to what the inputs allow.
fn estimated(job: &MeasureJob, solids: &[Solid], round: &Round, unproved: Option<Unproved>) -> Volume {
    let mut volume = Volume::estimate(round.volume, possible(job, solids, &round.rules_agree), unproved);
    // As far as the rays see, a mesh's own volume is that of the solid, and the estimate is off by the difference.
    if job.measurement.expression().is_none() && round.rules_agree[0] == Some(true) {
        volume.error = volume.error.max((volume.value - solids[0].volume.abs()).abs());
    }
    volume
}

/// Area and moments of a solid from images.
fn estimated_measures(
    job: &MeasureJob,
    solid: &Solid,
    round: &Round,
    seconds: &mut Seconds,
    progress: &Monitor,
) -> Result<SolidMeasures, Error> {
    let measuring = Instant::now();
    let (centroid, inertia) = mean_moments(&round.moments);
    let area = match round.shows_every_facet {
        true => solid.mesh().area(),
        false => surface_area(job, solid, &round.grid, round.choice.sampler(), progress)?,
    };
    seconds.integrate += measuring.elapsed().as_secs_f64();
    Ok(SolidMeasures { area, centroid, inertia })
}

/// Warns of solids in which the fill rules see different volumes.
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

/// The least and the greatest volume that the inputs allow: no solid exceeds its box, and the volume of a closed mesh is known
/// where the fill rules agree on all rays.
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
        // The solid whose volume is asked for bounds nothing but itself.
        None => [0.0, solids[0].bounds().extent().element_product()],
    }
}

/// What the images of one grid gave.
struct Round<'b> {
    choice: Choice<'b>,
    grid: Grid,
    volume: VolumeEstimate,
    moments: Vec<Moments>,
    /// Whether all facets bound the solid, as far as three exact images show.
    shows_every_facet: bool,
    layers: [Option<u32>; 3],
    samples: u64,
    unclosed: Vec<(Axis, u64)>,
    images: Vec<Ldi>,
    /// Of all triangles that the images know, counted through over the inputs.
    normals: Vec<[f32; 3]>,
    /// Whether the fill rules agree in all images of each input alone; nothing where there was none.
    rules_agree: Vec<Option<bool>>,
}

/// Lays a raster around all solids.
fn lay(job: &MeasureJob, solids: &[Solid], spacing: Spacing) -> Result<Grid, Error> {
    raster::lay(raster::common_box(solids), spacing, job.lod, raster::names(solids))
}

/// Refuses images that would not fit into memory, before the system ends the process for them.
fn admit(job: &MeasureJob, solids: &[Solid], lattice: &[LatticeSolid], grid: &Grid) -> Result<(), Error> {
    let images = memory::Images {
        held: machine::held_memory(),
        axes: &job.axes,
        at_once: alive_at_once(&job.measurement, job.mode),
        have_triangles: job.keep.has_triangles(),
        are_kept: job.keep != Keep::Sums,
        have_normals: job.keep == Keep::ImagesWithTriangles,
    };
    let way_out = |factor| memory::coarser(factor, raster::common_box(solids).extent().max_element(), grid);
    memory::admit_images(images, grid, lattice, Limit::new(job.memory), way_out)
}

/// The solids on a grid, restricted to the rays that can matter.
fn quantise<'s>(job: &MeasureJob, solids: &'s [Solid], grid: &Grid) -> Result<Vec<LatticeSolid<'s>>, Error> {
    let mut lattice: Vec<LatticeSolid> = solids.iter().map(|solid| solid.quantise(grid)).collect::<Result<_, _>>()?;
    if solids.iter().all(Solid::is_closed) {
        restrict(&job.measurement, &mut lattice);
    }
    Ok(lattice)
}

/// The pitches of the rasters that images along so many axes are held against. One axis is asked for where time matters, and
/// the coarser raster is enough to show what it is blind to.
pub fn check_pitches(axes: &[Axis]) -> &'static [f64] {
    if axes.len() == 3 { &CHECK_PITCHES } else { &CHECK_PITCHES[1..] }
}

/// The exact images along all axes on a coarser raster, which an estimate is held against.
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
    let along = |axis| {
        let mut maker = ImageMaker { sampler, axis, mode, fill, triangles: Triangles::NotWanted, seconds, rules_agree };
        Ok(AxisVolume::from_sums(&maker.volume_sums(&job.measurement, &lattice)?))
    };
    Axis::ALL.into_iter().map(along).collect()
}

/// Lays a grid and samples along every axis that was asked for.
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

    // A GPU sums where it samples, unless the images themselves are wanted.
    let keeps_images = !choice.is_gpu() || job.keep != Keep::Sums || job.measurement == Measurement::Volume;

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
    for &axis in &job.axes {
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
        let volume_sums = if keeps_images {
            let image = maker.image(&job.measurement, &lattice)?;
            let integrating = Instant::now();
            let volume_sums = image.volume_sums();
            if job.measurement == Measurement::Volume {
                round.moments.push(integrate::moments(&image));
                round.shows_every_facet &= integrate::shows_every_facet(&image);
            }
            seconds.integrate += integrating.elapsed().as_secs_f64();
            if job.keep != Keep::Sums {
                round.images.push(image);
            }
            volume_sums
        } else {
            maker.volume_sums(&job.measurement, &lattice)?
        };
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

/// The most rays along the longest side with which it is found which part of a mesh's surface bounds the solid.
const AREA_RESOLUTION: u32 = 512;

/// The surface area: that of the mesh's triangles, times the share of it that rays along the three axes find to bound the
/// solid. It is exact where no triangle lies inside. Where no ray meets a triangle nothing is known to lie inside.
fn surface_area(
    job: &MeasureJob,
    solid: &Solid,
    used: &Grid,
    sampler: &dyn Sampler,
    progress: &Monitor,
) -> Result<f64, Error> {
    let rays = used.rays().into_iter().max().unwrap_or(1).min(AREA_RESOLUTION);
    let grid = Grid::with_resolution(solid.bounds(), rays, job.lod).map_err(Error::input)?;
    let lattice = solid.quantise(&grid)?;
    let mut total = SurfaceHits::default();
    for axis in Axis::ALL {
        progress.stage(format!("area, along {}", axis.name()))?;
        let hits = |fill| -> Result<SurfaceHits, Error> {
            let image = sampler.sample_surface(&lattice, axis, fill)?;
            Ok(integrate::surface_hits(&image, |triangle| lattice.facing(triangle, axis)))
        };
        // The even-odd rule alone keeps every crossing.
        let every = hits(FillRule::EvenOdd)?;
        total.all += every.all;
        total.boundary += match job.fill {
            FillRule::EvenOdd => every.boundary,
            FillRule::NonZero => hits(FillRule::NonZero)?.boundary,
        };
    }
    let share = if total.all > 0.0 { total.boundary / total.all } else { 1.0 };
    Ok(solid.mesh().area() * share)
}

/// Resolutions that a tolerance starts from and ends at.
const COARSEST: u32 = 128;
const FINEST: u32 = 4096;

/// A volume of zero is not believed before this resolution, as a small solid slips between few rays.
const ZERO_IS_CREDIBLE: u32 = 1024;

/// Doubles the resolution until the error estimate is within the tolerance.
fn refine<'b>(
    tolerance: f64,
    round: &mut impl FnMut(Spacing) -> Result<Round<'b>, Error>,
) -> Result<(Round<'b>, Refinement), Error> {
    let mut resolution = COARSEST;
    loop {
        let result = round(Spacing::Resolution(resolution))?;
        let volume = result.volume;
        let reached = match volume.value == 0.0 {
            true => volume.error == 0.0 && resolution >= ZERO_IS_CREDIBLE,
            false => volume.error <= tolerance * volume.value.abs(),
        };
        if reached || resolution >= FINEST {
            let came_to = if volume.error == 0.0 { 0.0 } else { volume.error / volume.value.abs() };
            return Ok((result, Refinement { asked: tolerance, came_to, reached, resolution }));
        }
        resolution *= 2;
    }
}

/// Returns centroid and inertia, the mean over the images along different axes.
pub fn mean_moments(moments: &[Moments]) -> (DVec3, DMat3) {
    let share = 1.0 / moments.len() as f64;
    let centroid = moments.iter().map(|m| m.centroid * share).sum();
    let inertia = moments.iter().fold(DMat3::ZERO, |sum, m| sum + m.inertia * share);
    (centroid, inertia)
}

/// Says that a solid is narrower than the distance of the rays, which may then miss it altogether.
fn thin(solid: &Solid, grid: &Grid, axes: &[Axis]) -> Option<Warning> {
    let extent = solid.bounds().extent();
    let (axis, width) = axes
        .iter()
        .flat_map(|axis| [axis.column(), axis.row()].map(|across| (axis, extent[across])))
        .find(|&(_, width)| width < grid.pitch())?;
    let message = format!(
        "{}: {width:.3e} wide across the rays along {}, which lie {:.3e} apart and may miss it; a greater --resolution or a \
         smaller --pitch sees more",
        solid.name(),
        axis.name(),
        grid.pitch(),
    );
    Some(Warning::new("thinner-than-pitch", message))
}

/// Estimates of Booleans whose voxels are longer than the pitch: what an estimate of one solid adds or leaves out is known; of
/// a Boolean it shows in the distance to exact coarser images alone.
fn coarse_voxels(job: &MeasureJob, grid: &Grid) -> Option<Warning> {
    let voxel = |axis: &Axis| f64::from(grid.voxel(*axis)) * grid.step();
    let longest = job.axes.iter().map(voxel).fold(0.0, f64::max);
    let (Measurement::Boolean(_), Mode::Estimate(_)) = (&job.measurement, job.mode) else { return None };
    if longest <= grid.pitch() {
        return None;
    }
    let message = format!(
        "a ray is divided into voxels of {longest:.3e}, longer than the pitch of {:.3e}: an estimate may add or leave out as \
         much at each surface; a greater --lod makes it less, and --mode exact leaves nothing of it",
        grid.pitch(),
    );
    Some(Warning::new("coarse-voxels", message))
}

/// How many rays did not close, where a mesh was let through although it is open.
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
    let message = format!("{}: not closed; rays that did not close count as empty: {rays}", open.join(", "));
    Some(Warning::new("open", message))
}

/// An estimated error above this share of the volume is told.
const IMPRECISE: f64 = 0.1;

/// Says that the rays are too few to tell the volume, as for a solid that is thin beside their distance.
fn imprecise(measured: &Measured) -> Option<Warning> {
    let Volume { value, error, possible: [least, greatest], .. } = measured.volume;
    // An empty sum has a warning of its own.
    if measured.volume.is_unresolved() && measured.sum.is_some() {
        return None;
    }
    if measured.volume.is_unresolved() {
        let unit = unit::suffix(measured.unit, 3);
        let message = format!(
            "no ray at a pitch of {:.3e} meets the result: all that is known is that its volume is at least {} and at most \
             {}{unit}; raise --resolution to resolve it",
            measured.grid.pitch(),
            number(least),
            number(greatest),
        );
        return Some(Warning::new("not-resolved", message));
    }
    let message = || {
        let much = if value > 0.0 { format!("{:.0} % of it", 100.0 * error / value) } else { "all of it".to_owned() };
        let flags = if measured.sum.is_some() { "--resolution" } else { "--resolution or --tolerance" };
        format!(
            "the volume may be off by {much}: at a pitch of {:.3e} too few rays meet the solid; a greater {flags} tells more",
            measured.grid.pitch()
        )
    };
    (error > IMPRECISE * value).then(|| Warning::new("imprecise", message()))
}

/// Names the results that are beyond the numbers, as JSON holds null in their place.
fn not_finite(measured: &Measured) -> Option<Warning> {
    let volume = [("volume", measured.volume.value), ("error estimate", measured.volume.error)];
    let measures = measured.measures.iter().flat_map(|m| {
        let inertia = m.inertia.to_cols_array().into_iter().sum();
        [("area", m.area), ("centroid", m.centroid.element_sum()), ("inertia", inertia)]
    });
    let inputs = measured.solids.iter().map(|solid| ("volume of an input's mesh", solid.volume));
    let names: Vec<&str> =
        volume.into_iter().chain(measures).chain(inputs).filter(|(_, v)| !v.is_finite()).map(|(n, _)| n).collect();
    let why = if measured.volume.value == 0.0 { "as there is no volume" } else { "being beyond the range of f64" };
    let message = format!("not a finite number, {why}: {}", names.join(", "));
    (!names.is_empty()).then(|| Warning::new("not-finite", message))
}
