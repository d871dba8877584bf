//! `render`: pictures of solids, from images along the direction of sight.

use std::path::PathBuf;
use std::time::Instant;

use glam::{DAffine3, DVec3};
#[cfg(feature = "report")]
use serde::Serialize;

use super::backend::{Backends, Choice, Ran};
use super::fill::FillDifference;
use super::image::first_triangles;
use super::input::{self, InputRequirements, Sides, Solid};
use super::job::{Backend, Input, Openness};
use super::memory::Limit;
use super::work::work;
use super::{memory, output, raster};
use crate::boolean::{Expression, Operand, Plan};
use crate::grid::{Axis, Grid, LOD_RANGE, LatticeBox, LatticeSolid};
use crate::ldi::{Ldi, Windings};
use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::number::number;
use crate::picture::annotate::{Annotator, CaptionLine, ScaleBar};
use crate::picture::camera::SIDES;
use crate::picture::{
    Background, Camera, Canvas, Colour, Cut, Facets, Format, Scene, Skin, View, ViewBox, outline_of, palette, png,
    shaded, slice,
};
use crate::progress::Monitor;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, SampleError, Sampler};
use crate::unit;
use crate::{Error, Warning};

/// The description of a picture.
#[derive(Clone, Debug)]
pub struct RenderJob {
    /// The names of the inputs in captions.
    pub names: Vec<String>,
    /// The unit of files that state none.
    pub unit: Option<LengthUnit>,
    /// The treatment of meshes that are not closed.
    pub openness: Openness,
    /// The fill rule.
    pub fill: FillRule,
    /// The device that samples.
    pub backend: Backend,
    /// The most bytes that the process may hold; a share of the free memory without it.
    pub memory: Option<u64>,
    /// True if the files are hashed.
    pub hashes: bool,
    /// The solid to show, as an expression over the indices of the inputs.
    pub expression: Expression,
    /// The expression as text, if it was given as text.
    pub typed: Option<String>,
    /// The view.
    pub scenery: Scenery,
    /// The size of the picture.
    pub format: Format,
    /// The colour behind the solid.
    pub background: Background,
    /// Smooth or flat shading.
    pub facets: Facets,
    /// The file.
    pub to: PathBuf,
}

/// The view of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scenery {
    /// The solid, shaded.
    Shaded {
        /// The direction of sight.
        view: View,
        /// A plane that opens the solid.
        cut: Option<Plane>,
    },
    /// A section by a plane.
    Slice(Plane),
}

/// A plane across an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// The axis.
    pub axis: Axis,
    /// The position on the axis.
    pub position: SlicePosition,
}

/// The position of a plane on its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SlicePosition {
    /// A coordinate in file units, or in its own unit.
    Coordinate(Length),
    /// A share of the solids' box, from 0 at its lower end to 1 at its upper end.
    Share(f64),
}

/// The result of a rendering.
pub struct Rendered {
    /// The inputs, rotated to the view.
    pub solids: Vec<Solid>,
    /// The unit of all lengths, where it is known.
    pub unit: Option<LengthUnit>,
    /// The file.
    pub to: PathBuf,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The side of a pixel, in the unit of the solids.
    pub pixel: f64,
    /// The length of the scale bar, in the unit of the solids.
    pub scale_bar: f64,
    /// The direction of sight.
    pub view: View,
    /// The axis and coordinate of the slice or cut, if any.
    pub plane: Option<(Axis, f64)>,
    /// The raster behind the picture.
    pub grid: Grid,
    /// The number of samples in all images.
    pub samples: u64,
    /// The number of unclosed rays.
    pub unclosed: u64,
    /// The fill rule.
    pub fill: FillRule,
    /// The device that sampled.
    pub ran: Ran,
    /// Times by stage.
    pub seconds: RenderSeconds,
    /// Warnings about the inputs and the picture.
    pub warnings: Vec<Warning>,
}

/// Times by stage.
#[derive(Clone, Copy, Debug, Default)]
#[cfg_attr(feature = "report", derive(Serialize))]
pub struct RenderSeconds {
    /// Reading and checking.
    pub read: f64,
    /// Sampling.
    pub sample: f64,
    /// The Boolean.
    pub operate: f64,
    /// Shading and captions.
    pub shade: f64,
    /// Writing.
    pub write: f64,
    /// The total.
    pub total: f64,
}

/// Renders a job. The total time counts from `start`.
pub fn render(job: &RenderJob, inputs: &[Input], start: Instant, progress: &Monitor) -> Result<Rendered, Error> {
    let backends = Backends::open(&job.backend)?;
    let mut seconds = RenderSeconds::default();
    progress.stage("reading")?;
    let (mut solids, mut warnings) = timed(&mut seconds.read, || input::solids(inputs, requirements(job)))?;

    let drawn = draw(job, &mut solids, (&backends, &mut seconds), progress)?;
    progress.stage("writing")?;
    timed(&mut seconds.write, || output::replace(&job.to, |file| png::write(&drawn.canvas, file)))?;

    let Drawn { plane, view, counts, ran, scale_bar, grid, pixel, .. } = drawn;
    if counts.result == 0 {
        let message = "the picture is empty: no ray meets the solid to show".to_owned();
        warnings.push(Warning::new("nothing-seen", message));
    }
    warnings.extend(fill_warnings(&solids, &counts.rules_agree, job.fill)?);
    warnings.extend(ran.auto.iter().filter_map(|auto| auto.warning.clone()));
    warnings.extend(counts.warning(&solids));
    seconds.total = start.elapsed().as_secs_f64();
    Ok(Rendered {
        unit: solids[0].unit,
        solids,
        to: job.to.clone(),
        width: job.format.width,
        height: job.format.height,
        pixel,
        scale_bar,
        view,
        plane,
        grid,
        samples: counts.samples,
        unclosed: counts.unclosed,
        fill: job.fill,
        ran,
        seconds,
        warnings,
    })
}

/// Returns the requirements of a picture on its solids.
fn requirements(job: &RenderJob) -> InputRequirements {
    let &RenderJob { unit, openness, fill, hashes, .. } = job;
    InputRequirements { unit, openness, sides: Sides::NotNeeded, fill, hashes }
}

/// A picture in memory.
struct Drawn {
    canvas: Canvas,
    plane: Option<(Axis, f64)>,
    view: View,
    counts: Counts,
    ran: Ran,
    scale_bar: f64,
    grid: Grid,
    pixel: f64,
}

/// Turns the solids of a job to its view and draws them.
fn draw(
    job: &RenderJob,
    solids: &mut [Solid],
    (backends, seconds): (&Backends, &mut RenderSeconds),
    progress: &Monitor,
) -> Result<Drawn, Error> {
    let plane = place(job, solids)?;
    let view = match job.scenery {
        Scenery::Shaded { view, .. } => view,
        Scenery::Slice(plane) => across(plane.axis),
    };
    let rotation = view.rotation();
    progress.stage("turning")?;
    let turning = Instant::now();
    if view != View::From(Axis::Z) {
        for solid in solids.iter_mut() {
            input::map(solid, &DAffine3::from_mat3(rotation), requirements(job))?;
        }
    }
    let stage = Stage::set(job, solids, backends)?;
    seconds.sample += turning.elapsed().as_secs_f64();
    progress.detail(format_args!("turned and quantised in {:.4} s", turning.elapsed().as_secs_f64()));

    let (mut canvas, counts) = match (job.scenery, plane) {
        (Scenery::Slice(_), Some((axis, at))) => stage.slice(axis, at, seconds, progress)?,
        (_, plane) => {
            let cut = plane.map(|(axis, at)| Cut::facing_the_eye(rotation * unit_vector(axis), at));
            stage.shaded(cut, seconds, progress)?
        }
    };
    let bar = ScaleBar::of(&stage.camera);
    annotate(job, &stage, plane, bar, &mut canvas);
    let (grid, pixel) = (*stage.camera.grid(), stage.camera.pixel());
    Ok(Drawn { canvas, plane, view, counts, ran: stage.choice.ran(), scale_bar: bar.length, grid, pixel })
}

/// Returns a shaded picture of a solid, as a PNG file.
///
/// # Errors
/// Sides that a picture cannot have, and pictures that do not fit into memory.
pub(crate) fn picture(solid: &Solid, [width, height]: [u32; 2]) -> Result<Vec<u8>, Error> {
    if let Some(side) = [width, height].into_iter().find(|side| !SIDES.contains(side)) {
        let (least, most) = (SIDES.start(), SIDES.end());
        return Err(Error::Usage(format!("{side} pixels: a side of a picture has between {least} and {most}")));
    }
    let job = RenderJob {
        names: vec!["a".to_owned()],
        unit: solid.unit,
        openness: Openness::Refused,
        fill: FillRule::EvenOdd,
        backend: Backend::Cpu,
        memory: None,
        hashes: false,
        expression: Expression::input(0),
        typed: None,
        scenery: Scenery::Shaded { view: View::Isometric, cut: None },
        format: Format { width, height, supersampling: 3 },
        background: Background::Light,
        facets: Facets::Smooth,
        to: PathBuf::new(),
    };
    let (backends, mut seconds) = (Backends::open(&job.backend)?, RenderSeconds::default());
    let drawn = draw(&job, &mut [solid.clone()], (&backends, &mut seconds), &Monitor::new(None))?;
    let mut file = Vec::new();
    png::write(&drawn.canvas, &mut file).map_err(Error::machine)?;
    Ok(file)
}

/// Runs a task and adds its time to `seconds`.
fn timed<T>(seconds: &mut f64, task: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = task();
    *seconds += start.elapsed().as_secs_f64();
    result
}

fn unit_vector(axis: Axis) -> DVec3 {
    [DVec3::X, DVec3::Y, DVec3::Z][axis.depth()]
}

/// Returns the view onto a plane across an axis: x to the right if possible, and z upwards.
pub(crate) fn across(axis: Axis) -> View {
    match axis {
        Axis::X | Axis::Z => View::From(axis),
        Axis::Y => View::FromBelow(axis),
    }
}

/// Returns the plane of a job.
///
/// # Errors
/// Planes that miss the box of the solids.
fn place(job: &RenderJob, solids: &[Solid]) -> Result<Option<(Axis, f64)>, Error> {
    let (Scenery::Slice(Plane { axis, position }) | Scenery::Shaded { cut: Some(Plane { axis, position }), .. }) =
        job.scenery
    else {
        return Ok(None);
    };
    let bounds = raster::common_box(solids);
    let (low, high) = (bounds.min[axis.depth()], bounds.max[axis.depth()]);
    let at = match position {
        SlicePosition::Coordinate(at) => at.in_unit(solids[0].unit, "--slice")?,
        SlicePosition::Share(share) => low + share * (high - low),
    };
    if (low..=high).contains(&at) {
        return Ok(Some((axis, at)));
    }
    let name = axis.name();
    Err(Error::input(format!(
        "--slice {name}={at}: the plane misses the solids, which extend from {} to {} along {name}",
        number(low),
        number(high)
    )))
}

/// The rotated solids, the camera and the device.
struct Stage<'s> {
    job: &'s RenderJob,
    solids: &'s [Solid],
    camera: Camera,
    lattice: Vec<LatticeSolid<'s>>,
    choice: Choice<'s>,
}

/// Counts of the samples and rays behind a picture.
#[derive(Default)]
struct Counts {
    samples: u64,
    unclosed: u64,
    /// The number of samples of the solid or section to show.
    result: usize,
    /// For each input: true if the fill rules agree in its image.
    rules_agree: Vec<Option<bool>>,
}

impl Counts {
    /// Adds the counts of the image of the next input.
    fn add_image(&mut self, image: &Ldi) {
        self.samples += image.depths().len() as u64;
        self.unclosed += image.unclosed().len() as u64;
        self.rules_agree.push(image.windings().map(Windings::fill_rules_agree));
    }

    /// Returns a warning with the number of unclosed rays, if a mesh is open.
    fn warning(&self, solids: &[Solid]) -> Option<Warning> {
        let open: Vec<String> = solids.iter().filter(|s| !s.is_closed()).map(|s| s.name().to_string()).collect();
        let message = format!(
            "{}: the mesh is not closed; {} rays do not close and show nothing",
            open.join(", "),
            self.unclosed
        );
        (!open.is_empty()).then(|| Warning::new("open", message))
    }
}

fn fill_warnings(solids: &[Solid], agree: &[Option<bool>], fill: FillRule) -> Result<Vec<Warning>, Error> {
    let mut warnings = Vec::new();
    for (solid, _) in solids.iter().zip(agree).filter(|(_, agree)| **agree != Some(true)) {
        warnings.extend(FillDifference::of(solid)?.and_then(|difference| difference.warning(solid, fill)));
    }
    Ok(warnings)
}

impl<'s> Stage<'s> {
    fn set(job: &'s RenderJob, solids: &'s [Solid], backends: &'s Backends) -> Result<Stage<'s>, Error> {
        let boxes = solids.iter().map(|s| ViewBox { min: s.bounds().min, max: s.bounds().max });
        let all = boxes.reduce(hull).expect("a job has an input");
        let subject = match job.scenery {
            Scenery::Shaded { .. } => box_of_result(job, solids)?.unwrap_or(all),
            Scenery::Slice(_) => all,
        };
        let camera = Camera::aim(job.format, subject, all)
            .map_err(|error| Error::input(format!("{}: {error}", raster::names(solids))))?;
        let seen = |solid: &'s Solid| Ok(camera.see(&solid.quantise(camera.raster())?));
        let mut lattice = solids.iter().map(seen).collect::<Result<Vec<LatticeSolid>, Error>>()?;
        if solids.iter().all(Solid::is_closed) {
            let bounds: Vec<LatticeBox> = lattice.iter().map(|solid| *solid.bounds()).collect();
            let regions = match job.scenery {
                Scenery::Shaded { .. } => job.expression.regions(&bounds),
                Scenery::Slice(_) => bounds,
            };
            lattice = lattice.into_iter().zip(regions).map(|(solid, region)| solid.within(&region)).collect();
        }
        memory::admit_pictures(camera.grid(), &lattice, Limit::new(job.memory), "lower --size or --samples")?;
        let choice = backends.choose(|| work(&lattice, &[Axis::Z]));
        Ok(Stage { job, solids, camera, lattice, choice })
    }

    /// Returns the images of all solids, and their counts.
    fn sampled(
        &self,
        sample: impl Fn(&LatticeSolid) -> Result<Ldi, SampleError>,
        seconds: &mut RenderSeconds,
        progress: &Monitor,
    ) -> Result<(Vec<Ldi>, Counts), Error> {
        let (columns, rows) = self.camera.grid().image_size(Axis::Z);
        progress.stage(format!("{columns} × {rows} rays"))?;
        let mut counts = Counts::default();
        let mut images = Vec::new();
        for solid in &self.lattice {
            let image = timed(&mut seconds.sample, || sample(solid))?;
            counts.add_image(&image);
            images.push(image);
        }
        Ok((images, counts))
    }

    fn shaded(
        &self,
        cut: Option<Cut>,
        seconds: &mut RenderSeconds,
        progress: &Monitor,
    ) -> Result<(Canvas, Counts), Error> {
        let (images, mut counts) = self.sampled(
            |solid| self.choice.sampler().sample_surface(solid, Axis::Z, self.job.fill),
            seconds,
            progress,
        )?;
        progress.detail(format_args!("sampled by {:.4} s; {}", seconds.sample, self.choice.ran()));
        let first_triangles: Vec<u32> = first_triangles(&self.lattice).collect();
        let result = timed(&mut seconds.operate, || combine(self.job, images, &first_triangles))?;
        counts.result = result.depths().len();
        progress.stage("shading")?;
        let skins: Vec<Skin> = self
            .lattice
            .iter()
            .enumerate()
            .map(|(i, solid)| Skin {
                positions: solid.positions(),
                triangles: solid.triangles(),
                tint: tint(self.job, i),
            })
            .collect();
        let scene = Scene { camera: &self.camera, image: &result, skins: &skins, cut, cut_tint: palette::cut() };
        let canvas = timed(&mut seconds.shade, || shaded(&scene, self.job.facets, self.job.background));
        Ok((canvas, counts))
    }

    fn slice(
        &self,
        axis: Axis,
        at: f64,
        seconds: &mut RenderSeconds,
        progress: &Monitor,
    ) -> Result<(Canvas, Counts), Error> {
        let (images, mut counts) = self.sampled(
            |solid| self.choice.sampler().sample(solid, Axis::Z, Mode::Exact, self.job.fill),
            seconds,
            progress,
        )?;
        counts.result = images.iter().map(|image| image.depths().len()).sum();
        progress.stage("drawing")?;
        let depth = (across(axis).rotation() * unit_vector(axis)).z * at;
        let images: Vec<&Ldi> = images.iter().collect();
        let ink = self.job.background.ink();
        let job = self.job;
        let fills = |inputs: u32| fill_of(job, inputs);
        let canvas = timed(&mut seconds.shade, || slice(&self.camera, &images, depth, &fills, ink, job.background));
        Ok((canvas, counts))
    }
}

/// Returns the tint of an input of a job.
fn tint(job: &RenderJob, input: usize) -> Colour {
    if job.names.len() == 1 { palette::alone() } else { palette::tint(input) }
}

/// Returns the colour, in a slice, of the points in some inputs: the colour of the result where they belong to it, else a pale
/// mix of the inputs' tints.
fn fill_of(job: &RenderJob, inputs: u32) -> Colour {
    if job.names.len() == 1 {
        return palette::alone();
    }
    if job.expression.holds(|input| inputs >> input & 1 == 1) {
        return palette::result();
    }
    let inside = (0..job.names.len()).filter(|input| inputs >> input & 1 == 1);
    let background = job.background.colour();
    inside.enumerate().fold(background, |mixed, (before, input)| mixed.mix(pale(job, input), 1.0 / (before + 1) as f32))
}

/// Returns the colour, in a slice, of the points in one input that are not in the result.
fn pale(job: &RenderJob, input: usize) -> Colour {
    tint(job, input).mix(job.background.colour(), 0.45)
}

fn hull(a: ViewBox, b: ViewBox) -> ViewBox {
    ViewBox { min: a.min.min(b.min), max: a.max.max(b.max) }
}

/// Rays along the longest side of all solids, for the box of the result of several.
const BOX_RESOLUTION: u32 = 160;

/// Returns the box of the result of several solids; `None` for a single solid or an empty result.
///
/// The CPU always samples here: it finishes so few rays before a GPU has compiled its shaders.
fn box_of_result(job: &RenderJob, solids: &[Solid]) -> Result<Option<ViewBox>, Error> {
    if solids.len() == 1 {
        return Ok(None);
    }
    let bounds = raster::common_box(solids);
    let Ok(grid) = Grid::with_resolution(bounds, BOX_RESOLUTION, *LOD_RANGE.start()) else { return Ok(None) };
    let images = solids
        .iter()
        .map(|solid| Ok(CpuSampler::default().sample(&solid.quantise(&grid)?, Axis::Z, Mode::Exact, job.fill)?));
    let image = combine(job, images.collect::<Result<_, Error>>()?, &vec![0; solids.len()])?;
    let columns = image.size().0;
    let hits = (0..image.rays()).filter_map(|ray| {
        let samples = image.samples(ray);
        let at = [ray % columns, ray / columns].map(f64::from);
        let depth = |steps: &i32| f64::from(*steps) * grid.step();
        // The result may extend up to the neighbouring ray that misses it.
        let low = DVec3::new((at[0] - 0.5) * grid.pitch(), (at[1] - 0.5) * grid.pitch(), depth(samples.first()?));
        let high = DVec3::new((at[0] + 1.5) * grid.pitch(), (at[1] + 1.5) * grid.pitch(), depth(samples.last()?));
        Some(ViewBox { min: grid.origin() + low, max: grid.origin() + high })
    });
    let within = |b: ViewBox| ViewBox { min: b.min.max(bounds.min), max: b.max.min(bounds.max) };
    Ok(hits.reduce(hull).map(within))
}

/// Returns the image of a job's expression, from an image of each input and the number of its first triangle.
fn combine(job: &RenderJob, mut images: Vec<Ldi>, first_triangles: &[u32]) -> Result<Ldi, Error> {
    if images.len() == 1 {
        return Ok(images.remove(0));
    }
    let plan = Plan::new(&job.expression, Mode::Exact);
    let operand = |input: usize| Operand { image: &images[input], first_triangle: first_triangles[input] };
    let operands: Vec<Operand> = plan.leaves().iter().map(|leaf| operand(leaf.input)).collect();
    Ok(plan.sweep(&operands)?)
}

/// Draws outline, scale bar, axes and caption.
fn annotate(job: &RenderJob, stage: &Stage, plane: Option<(Axis, f64)>, bar: ScaleBar, canvas: &mut Canvas) {
    let unit_of = unit::suffix(stage.solids[0].unit, 1);
    let mut annotator = Annotator::new(canvas);
    let view = match job.scenery {
        Scenery::Shaded { view, .. } => view,
        Scenery::Slice(plane) => {
            let bounds = raster::common_box(stage.solids);
            annotator.outline(&outline_of(bounds.min, bounds.max).map(|corner| stage.camera.place(corner)));
            across(plane.axis)
        }
    };
    annotator.scale_bar(bar, &format!("{}{unit_of}", number(bar.length)));
    annotator.axes(view.rotation());
    annotator.caption(&captions(job, stage, plane, &unit_of));
}

/// Returns the caption: the position of the plane, and the tint of each input.
fn captions(job: &RenderJob, stage: &Stage, plane: Option<(Axis, f64)>, unit_of: &str) -> Vec<CaptionLine> {
    let mut lines = Vec::new();
    if let Some((axis, at)) = plane {
        let text = format!("{} = {}{unit_of}", axis.name(), rounded(at));
        lines.push(CaptionLine { patch: None, text });
    }
    if stage.solids.len() == 1 {
        return lines;
    }
    for (i, solid) in stage.solids.iter().enumerate() {
        let name = solid.path.file_name().unwrap_or_default().to_string_lossy();
        let text = match &job.typed {
            Some(_) => format!("{}: {name}", job.names[i]),
            None => name.into_owned(),
        };
        let colour = match job.scenery {
            Scenery::Shaded { .. } => tint(job, i),
            Scenery::Slice(_) => pale(job, i),
        };
        lines.push(CaptionLine { patch: Some(colour), text });
    }
    let patch = match job.scenery {
        Scenery::Slice(_) => Some(palette::result()),
        Scenery::Shaded { .. } => None,
    };
    match (&job.typed, patch) {
        (None, None) => {}
        (None, patch) => lines.push(CaptionLine { patch, text: "common part".to_owned() }),
        (Some(typed), patch) => lines.push(CaptionLine { patch, text: typed.clone() }),
    }
    lines
}

/// Returns a number with four significant digits, for a caption.
fn rounded(value: f64) -> String {
    let text = format!("{value:.3e}");
    let short: f64 = text.parse().unwrap_or(value);
    // A rounding residue of 0 appears as 0.
    format!("{}", if short.abs() < 1e-12 { 0.0 } else { short })
}
