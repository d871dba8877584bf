//! Resolution of arguments into jobs; rejects every error that can be found without reading an input.

mod clash;
mod render;
mod report;
mod sum;
mod sweep;

use std::ffi::OsString;
use std::fmt::Display;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap_complete::Shell;
use ldi_ops::Error;
use ldi_ops::boolean::{BooleanOperation, Expression};
use ldi_ops::driver::certainty::Certainty;
use ldi_ops::driver::job::{
    Backend, Boolean, Content, Finish, ImageTarget, Input, Keep, MeasureJob, Measurement, MeshMethod, Openness,
    Spacing, SumJob, SumOperation, VolumeMethod, Wording,
};
use ldi_ops::driver::render::RenderJob;
use ldi_ops::excerpt;
use ldi_ops::grid::{Axis, LOD_RANGE, RAYS_MAX};
use ldi_ops::length::Length;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::mesh::io::{Format, FormatError, WriteError};
use ldi_ops::placement::Placement;
use ldi_ops::report::ReportJob;
use ldi_ops::report::sweep::SweepJob;
use ldi_ops::sampler::{Estimate, FillRule, Mode};
use ldi_ops::solids::Model;
use ldi_ops::voxels;

use crate::args::{
    self, AxisChoice, BackendArguments, BackendChoice, CommonArguments, DeviceArguments, FillChoice, MemorySize,
    MeshChoice, ModeChoice, PlacingArguments, SamplingArguments, SpacingArguments, TransformArguments,
};
use crate::output;
pub use clash::ClashCommand;

/// A job and its settings of threads and verbosity.
#[derive(Debug)]
pub struct Invocation {
    pub job: Job,
    /// The requested number of threads.
    pub threads: Option<NonZeroUsize>,
    pub verbosity: Verbosity,
}

/// What goes to stderr; stdout has the result in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Warnings and errors.
    Quiet,
    /// Also notes on automatic choices, and a progress bar on a terminal.
    Normal,
    /// Also stages with their times, the raster, the backend, time and memory.
    Verbose,
}

#[derive(Debug)]
pub enum Job {
    Measure(Command<MeasureJob>),
    Surface(SurfaceJob),
    Check(CheckJob),
    Convert(ConvertJob),
    Generate(GenerateJob),
    Devices(DevicesJob),
    Render(Command<RenderJob>),
    Sum(Command<SumJob>),
    Clash(Box<ClashCommand>),
    Report(Box<ReportJob>, Report),
    Sweep(SweepJob, Report),
    Completions(Shell),
    /// The folder of the pages; `None` for the page of the program on stdout.
    Man(Option<PathBuf>),
}

/// A job of the library, its inputs, and the destination of its results.
#[derive(Debug)]
pub struct Command<J> {
    pub job: J,
    pub inputs: Vec<Input>,
    /// The output file made from the images.
    pub target: Option<ImageTarget>,
    pub report: Report,
}

/// The destination of the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Report {
    /// Text on stdout.
    Text,
    /// Text on stdout, and JSON to a file.
    TextAndJson(PathBuf),
    /// JSON on stdout.
    Json,
}

impl Report {
    /// Returns whether JSON is written.
    pub fn has_json(&self) -> bool {
        *self != Report::Text
    }
}

/// A `surface` command.
#[derive(Debug)]
pub struct SurfaceJob {
    /// The file of the images.
    pub images: PathBuf,
    pub unit: Option<LengthUnit>,
    /// The mode of the images, if given.
    pub mode: Option<Mode>,
    pub target: ImageTarget,
    pub report: Report,
}

#[derive(Debug)]
pub struct CheckJob {
    pub meshes: Vec<PathBuf>,
    pub unit: Option<LengthUnit>,
    pub report: Report,
}

#[derive(Debug)]
pub struct ConvertJob {
    pub from: Input,
    pub to: PathBuf,
    pub unit: Option<LengthUnit>,
    /// True if a round offset is subtracted from the coordinates.
    pub recentre: bool,
    pub report: Report,
}

#[derive(Debug)]
pub struct GenerateJob {
    pub kind: String,
    pub model: Model,
    pub to: PathBuf,
    pub report: Report,
}

#[derive(Debug)]
pub struct DevicesJob {
    pub report: Report,
}

/// Advice for meshes that are not solids.
const NO_REPAIR: &str = "no command repairs a mesh; depending on its defects, use:
  ldi-ops check A                                          names all defects
  --allow-open                                             samples a mesh that is not closed
  --fill nonzero                                           unites shells that overlap
  ldi-ops sample A --fill nonzero --mode exact -o B.stl    writes a new, closed surface of the solid";

/// Resolves a command line; `words` are its words after the program's name.
pub fn resolve(command: args::Command, words: &[OsString]) -> Result<Invocation, Error> {
    use args::Command;
    match command {
        Command::Intersect(a) => list(BooleanOperation::Intersection, a.list),
        Command::Union(a) => list(BooleanOperation::Union, a.list),
        Command::Difference(a) => list(BooleanOperation::Difference, a.list),
        Command::Xor(a) => list(BooleanOperation::Xor, a.list),
        Command::Csg(a) => csg(a),
        Command::Volume(a) => {
            if a.solids.len() > 1 && a.placing.transform_a.is_some() {
                return Err(Error::input("--transform-a applies to one solid, but several are given"));
            }
            let PlacingArguments { reading, transform_a: placement } = a.placing;
            let inputs = a.solids.into_iter().map(|path| Input { name: None, path, placement }).collect();
            let sampling = (a.sampling, method(&a.method), a.certainty.into());
            measure(Measurement::Volume, inputs, reading, sampling, Default::default(), a.common)
        }
        Command::Sample(a) => {
            let input = Input { name: None, path: a.solid, placement: a.placing.transform_a };
            let writing = args::ImageArguments { output: Some(a.output), finish: a.finish };
            let sampling = (a.sampling, VolumeMethod::Estimate, Certainty::default());
            measure(Measurement::Sample, vec![input], a.placing.reading, sampling, (writing, None), a.common)
        }
        Command::Surface(a) => {
            let report = report(&a.common)?;
            has_no_finer_rays(&a.finish, "a file of images has no finer rays; sample the solid with more")?;
            let writing = args::ImageArguments { output: Some(a.output), finish: a.finish };
            let target = image_target(writing, MeshMethod::Sampled, AxisChoice::All)?.expect("an output is given");
            let job = SurfaceJob { images: a.images, unit: a.unit, mode: a.mode.map(mode), target, report };
            Ok(invocation(Job::Surface(job), &a.common))
        }
        Command::Check(a) => {
            let report = report(&a.common)?;
            Ok(invocation(Job::Check(CheckJob { meshes: a.meshes, unit: a.unit, report }), &a.common))
        }
        Command::Repair(_) => Err(Error::input(NO_REPAIR)),
        Command::Convert(a) => {
            let report = report(&a.common)?;
            mesh_target(&a.output)?;
            let from = Input { name: None, path: a.from, placement: a.transform_a };
            let job = ConvertJob { from, to: a.output, unit: a.unit, recentre: a.recentre, report };
            Ok(invocation(Job::Convert(job), &a.common))
        }
        Command::Generate(a) => {
            let report = report(&a.common)?;
            mesh_target(&a.output)?;
            let model = model(&a)?;
            Ok(invocation(Job::Generate(GenerateJob { kind: a.kind, model, to: a.output, report }), &a.common))
        }
        Command::Render(a) => render::resolve(a),
        Command::Clash(a) => clash::resolve(a),
        Command::Report(a) => report::resolve(a, words),
        Command::Sweep(a) => sweep::resolve(a),
        Command::Minkowski(a) => sum::minkowski(a),
        Command::Offset(a) => sum::offset(a),
        Command::Open(a) => sum::ball(SumOperation::Opening, a),
        Command::Close(a) => sum::ball(SumOperation::Closing, a),
        Command::Devices(a) => {
            let report = report(&a.common)?;
            Ok(invocation(Job::Devices(DevicesJob { report }), &a.common))
        }
        Command::Completions(a) => Ok(of_text(Job::Completions(a.shell))),
        Command::Man(a) => {
            a.folder.as_deref().map(|folder| usable("", folder, "man")).transpose()?;
            Ok(of_text(Job::Man(a.folder)))
        }
    }
}

/// Returns a model; lengths are in millimetres or have units.
fn model(arguments: &args::GenerateArguments) -> Result<Model, Error> {
    let kind = Model::kinds().iter().find(|kind| kind.name == arguments.kind);
    let in_millimetres = |name: &str, text: &str| kind.map_or(text.to_owned(), |kind| kind.in_millimetres(name, text));
    let texts: Vec<(&str, String)> =
        arguments.parameters.iter().map(|(name, text)| (*name, in_millimetres(name, text))).collect();
    let parameters: Vec<(&str, &str)> = texts.iter().map(|(name, text)| (*name, text.as_str())).collect();
    Model::from_parameters(&arguments.kind, &parameters).map_err(Error::input)
}

/// Returns the invocation of a command without common flags.
fn of_text(job: Job) -> Invocation {
    Invocation { job, threads: Some(NonZeroUsize::MIN), verbosity: Verbosity::Normal }
}

fn invocation(job: Job, common: &CommonArguments) -> Invocation {
    let verbosity = match (common.quiet, common.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, false) => Verbosity::Normal,
        (false, true) => Verbosity::Verbose,
    };
    Invocation { job, threads: common.threads, verbosity }
}

/// Resolves an operation on a list of inputs, which are named by letters.
fn list(operation: BooleanOperation, arguments: args::ListOfSolids) -> Result<Invocation, Error> {
    let args::ListOfSolids { a, others, placing, operation: rest } = arguments;
    let args::ListPlacingArguments { reading, transforms } = placing;
    let inputs = placed([a].into_iter().chain(others).collect(), transforms)?;
    let expression = Expression::of_inputs(operation, inputs.len());
    let boolean = Boolean { expression, wording: Wording::Operation(operation) };
    let args::OperationArguments { sampling, method: choice, certainty, writing, mesh, common } = rest;
    let sampling = (sampling, method(&choice), certainty.into());
    measure(Measurement::Boolean(boolean), inputs, reading, sampling, (writing, mesh), common)
}

/// Resolves `csg`: an expression over named inputs.
fn csg(arguments: args::CsgArguments) -> Result<Invocation, Error> {
    let args::CsgArguments { expression: text, solids, placing, operation } = arguments;
    let args::ListPlacingArguments { reading, transforms } = placing;
    let (names, paths): (Vec<String>, Vec<PathBuf>) = solids.into_iter().map(|solid| (solid.name, solid.path)).unzip();
    let expression = parsed(&text, &names)?;
    let placements = placements(&names, transforms)?;
    let inputs = names.into_iter().zip(paths).zip(placements);
    let inputs = inputs.map(|((name, path), placement)| Input { name: Some(name), path, placement }).collect();
    let boolean = Boolean { expression, wording: Wording::Typed(text) };
    let args::OperationArguments { sampling, method: choice, certainty, writing, mesh, common } = operation;
    let sampling = (sampling, method(&choice), certainty.into());
    measure(Measurement::Boolean(boolean), inputs, reading, sampling, (writing, mesh), common)
}

/// Parses an expression as typed.
fn parsed(text: &str, names: &[String]) -> Result<Expression, Error> {
    Expression::parse(text, names).map_err(|error| match error.at() {
        Some(at) => Error::input(format!(
            "the expression, at character {}: {error}\n{}",
            at + 1,
            excerpt::pointing_at(text, at)
        )),
        None => Error::input(error),
    })
}

/// Returns the name of an input in a list: a, b, … z, aa, ab, …
fn letters(index: usize) -> String {
    let mut name = String::new();
    let mut rest = index + 1;
    while rest > 0 {
        name.insert(0, char::from(b'a' + ((rest - 1) % 26) as u8));
        rest = (rest - 1) / 26;
    }
    name
}

/// Returns files as inputs, each with the placement of its letter.
fn placed(paths: Vec<PathBuf>, transforms: TransformArguments) -> Result<Vec<Input>, Error> {
    let names: Vec<String> = (0..paths.len()).map(letters).collect();
    let placements = placements(&names, transforms)?;
    Ok(paths.into_iter().zip(placements).map(|(path, placement)| Input { name: None, path, placement }).collect())
}

/// Returns the placements of inputs by their names.
fn placements(names: &[String], transforms: TransformArguments) -> Result<Vec<Option<Placement>>, Error> {
    let TransformArguments { transform_a, transform_b, transforms: named } = transforms;
    let mut placements = vec![None; names.len()];
    let short = [("a", transform_a), ("b", transform_b)].into_iter();
    let short =
        short.filter_map(|(name, placement)| Some((format!("--transform-{name}"), name.to_owned(), placement?)));
    let named = named
        .into_iter()
        .map(|args::NamedPlacement { name, placement }| (format!("--transform {name}=…"), name, placement));
    for (flag, name, placement) in short.chain(named) {
        let Some(i) = names.iter().position(|known| *known == name) else {
            let known = match names.is_empty() {
                true => "; parts of a list have their `transform` there".to_owned(),
                false => format!("; the inputs are {}", names.join(", ")),
            };
            return Err(Error::input(format!("{flag}: no input is named `{name}`{known}")));
        };
        if placements[i].replace(placement).is_some() {
            return Err(Error::input(format!("{flag}: the input `{name}` has a placement already")));
        }
    }
    Ok(placements)
}

fn measure(
    measurement: Measurement,
    inputs: Vec<Input>,
    reading: args::ReadingArguments,
    (sampling, method, certainty): (SamplingArguments, VolumeMethod, Certainty),
    (writing, mesh): (args::ImageArguments, Option<MeshChoice>),
    common: CommonArguments,
) -> Result<Invocation, Error> {
    if method == VolumeMethod::Exact && sampling.kind.mode != ModeChoice::Exact {
        return Err(Error::input(
            "--exact asks for the exact volume, and --mode over or under for that of an image; remove one of them",
        ));
    }
    let (backend, memory) = device(sampling.device)?;
    let spacing = spacing(sampling.resolution, sampling.spacing, DEFAULT_RESOLUTION)?;
    let lod = lod(sampling.kind.lod)?;
    can_be_refined(&writing.finish, sampling.kind.mode)?;
    let mesh_method = mesh_method(mesh, &measurement, method, sampling.kind.mode)?;
    let target = image_target(writing, mesh_method, sampling.kind.axis)?;
    if let (Some(choice), false) = (mesh, matches!(&target, Some(ImageTarget { content: Content::Mesh(_), .. }))) {
        let flag = match choice {
            MeshChoice::Exact => "exact",
            MeshChoice::Sampled => "sampled",
        };
        return Err(Error::input(format!("--mesh {flag} applies to a mesh: write one with -o FILE, or remove it")));
    }
    let report = report(&common)?;
    let job = MeasureJob {
        measurement,
        unit: reading.unit,
        openness: if reading.allow_open { Openness::Sampled } else { Openness::RefusedByDefault },
        spacing,
        lod,
        axes: axes(sampling.kind.axis),
        mode: mode(sampling.kind.mode),
        fill: fill(sampling.fill.fill),
        backend,
        method,
        memory,
        hashes: report.has_json(),
        certainty,
        keep: Keep::from(target.as_ref()),
    };
    Ok(invocation(Job::Measure(Command { job, inputs, target, report }), &common))
}

/// Returns the method of a written mesh.
fn mesh_method(
    choice: Option<MeshChoice>,
    measurement: &Measurement,
    volume: VolumeMethod,
    mode: ModeChoice,
) -> Result<MeshMethod, Error> {
    let of_images = match (measurement, volume, mode) {
        (Measurement::Boolean(_), VolumeMethod::Estimate, _) => Some("--estimate asks for results of images"),
        (Measurement::Boolean(_), _, ModeChoice::Over | ModeChoice::Under) => {
            Some("--mode over or under asks for results of images")
        }
        (Measurement::Boolean(_), _, ModeChoice::Exact) => None,
        _ => Some("the mesh is one of images"),
    };
    match (choice, of_images) {
        (Some(MeshChoice::Exact), Some(why)) => {
            Err(Error::input(format!("--mesh exact asks for the exact mesh, but {why}; remove one of them")))
        }
        (Some(MeshChoice::Exact), None) => Ok(MeshMethod::Exact),
        (None, None) => Ok(MeshMethod::Best),
        (Some(MeshChoice::Sampled), _) | (None, Some(_)) => Ok(MeshMethod::Sampled),
    }
}

/// Returns the method of the volume.
fn method(choice: &args::MethodArguments) -> VolumeMethod {
    match (choice.exact, choice.estimate) {
        (true, _) => VolumeMethod::Exact,
        (_, true) => VolumeMethod::Estimate,
        _ => VolumeMethod::Best,
    }
}

fn lod(voxels: u32) -> Result<u32, Error> {
    match LOD_RANGE.contains(&voxels) {
        true => Ok(voxels),
        false => {
            let (least, most) = (LOD_RANGE.start(), LOD_RANGE.end());
            Err(Error::input(format!("--lod {voxels} is outside {least} to {most} voxels per ray")))
        }
    }
}

fn axes(choice: AxisChoice) -> Vec<Axis> {
    match choice {
        AxisChoice::X => vec![Axis::X],
        AxisChoice::Y => vec![Axis::Y],
        AxisChoice::Z => vec![Axis::Z],
        AxisChoice::All => Axis::ALL.to_vec(),
    }
}

fn mode(choice: ModeChoice) -> Mode {
    match choice {
        ModeChoice::Over => Mode::Estimate(Estimate::Over),
        ModeChoice::Under => Mode::Estimate(Estimate::Under),
        ModeChoice::Exact => Mode::Exact,
    }
}

/// Returns the device and the memory limit in bytes.
fn device(DeviceArguments { backend, memory }: DeviceArguments) -> Result<(Backend, Option<u64>), Error> {
    Ok((self::backend(backend)?, memory.map(|MemorySize(bytes)| bytes)))
}

fn backend(BackendArguments { backend, adapter }: BackendArguments) -> Result<Backend, Error> {
    match (backend, adapter) {
        (BackendChoice::Auto, None) => Ok(Backend::Auto),
        (BackendChoice::Cpu, None) => Ok(Backend::Cpu),
        (BackendChoice::Cpu, Some(name)) => {
            Err(Error::input(format!("--adapter {name} needs a GPU and contradicts --backend cpu; remove one of them")))
        }
        // A named adapter leaves `auto` no choice.
        (BackendChoice::Auto | BackendChoice::Gpu, name) => Ok(Backend::Gpu(name)),
    }
}

fn fill(choice: FillChoice) -> FillRule {
    match choice {
        FillChoice::EvenOdd => FillRule::EvenOdd,
        FillChoice::Nonzero => FillRule::NonZero,
    }
}

/// Rays along the longest side by default.
const DEFAULT_RESOLUTION: u32 = 512;

/// Returns the raster; `default` is its resolution if neither resolution nor pitch nor tolerance is given.
fn spacing(
    resolution: Option<u32>,
    SpacingArguments { pitch, tolerance }: SpacingArguments,
    default: u32,
) -> Result<Spacing<Length>, Error> {
    match (resolution, pitch, tolerance) {
        (Some(rays), _, _) if !(1..=RAYS_MAX).contains(&rays) => {
            Err(Error::input(format!("--resolution {rays} is outside 1 to {RAYS_MAX} rays")))
        }
        (_, Some(pitch), _) if !(pitch.value.is_finite() && pitch.value > 0.0) => {
            Err(Error::input(format!("--pitch {pitch} is not a positive length")))
        }
        (Some(rays), _, _) => Ok(Spacing::Resolution(rays)),
        (_, Some(pitch), _) => Ok(Spacing::Pitch(pitch)),
        (_, _, Some(args::Share(tolerance))) => Ok(Spacing::Tolerance(tolerance)),
        (None, None, None) => Ok(Spacing::Resolution(default)),
    }
}

fn report(common: &CommonArguments) -> Result<Report, Error> {
    match &common.json {
        None => Ok(Report::Text),
        Some(path) if path.as_os_str() == "-" => Ok(Report::Json),
        Some(path) => {
            writable(path)?;
            Ok(Report::TextAndJson(path.clone()))
        }
    }
}

/// Checks that a target's folder exists before any work is done.
fn writable(path: &Path) -> Result<(), Error> {
    let folder = output::folder(path);
    if path.is_dir() {
        return Err(Error::input(format!("{}: is a folder; give the name of a file", path.display())));
    }
    if !folder.is_dir() {
        return Err(no_folder(path.display(), folder));
    }
    Ok(())
}

/// Says that the folder of a target is missing, or is a file.
fn no_folder(target: impl Display, folder: &Path) -> Error {
    let folder_name = folder.display();
    Error::input(match folder.exists() {
        true => format!("{target}: {folder_name} is a file, not a folder; choose another"),
        false => format!("{target}: the folder {folder_name} does not exist; create it first"),
    })
}

/// Checks that a folder or its parent exists; `flag` stands before its name in messages.
fn usable(flag: &str, folder: &Path, taker: &str) -> Result<(), Error> {
    if folder.exists() && !folder.is_dir() {
        return Err(Error::input(format!("{flag}{}: is a file, and {taker} takes a folder", folder.display())));
    }
    let parent = output::folder(folder);
    if !folder.is_dir() && !parent.is_dir() {
        return Err(no_folder(format_args!("{flag}{}", folder.display()), parent));
    }
    Ok(())
}

/// Checks that a mesh file has a writable format.
fn mesh_target(path: &Path) -> Result<(), Error> {
    match Format::from_path(path) {
        Ok(format) if format.is_written() => writable(path),
        Ok(format) => Err(Error::input(WriteError::NoWriter { path: path.to_path_buf(), format })),
        Err(FormatError::Unknown { path, extension }) => Err(Error::input(format!(
            "{}: `.{extension}` is not a mesh format to write; {MESHES_WRITTEN}",
            path.display()
        ))),
        Err(FormatError::NoExtension { path }) => {
            Err(Error::input(format!("{}: the name has no extension; {MESHES_WRITTEN}", path.display())))
        }
        Err(error) => Err(Error::input(error)),
    }
}

/// Refuses levels of finer rays for the mesh of an over- or under-estimate.
fn can_be_refined(finish: &args::FinishArguments, mode: ModeChoice) -> Result<(), Error> {
    match mode {
        ModeChoice::Exact => Ok(()),
        _ => has_no_finer_rays(finish, "meshes of over- and under-estimates have the cells of their raster"),
    }
}

/// Refuses levels of finer rays where there are none, with the reason.
fn has_no_finer_rays(finish: &args::FinishArguments, why: &str) -> Result<(), Error> {
    match finish.refine {
        Some(levels @ 1..) => Err(Error::input(format!("--refine {levels}: {why}; remove --refine"))),
        _ => Ok(()),
    }
}

/// The formats of `-o` where a mesh is written.
const MESHES_WRITTEN: &str = "-o takes .stl, .obj, .ply, .off, .glb or .3mf";

/// The formats of `-o` and their contents.
const WRITTEN: &str = "-o takes .npz (images), .stl, .obj, .ply, .off, .glb or .3mf (surface), .vti or .npy (voxels)";

/// Returns the file to make from the images.
fn image_target(
    writing: args::ImageArguments,
    method: MeshMethod,
    axis: AxisChoice,
) -> Result<Option<ImageTarget>, Error> {
    let args::ImageArguments { output, finish } = writing;
    let args::FinishArguments { surface_error, refine, drop_parts, recentre } = finish;
    let flags = [
        ("--surface-error", surface_error.is_some()),
        ("--refine", refine.is_some()),
        ("--drop-parts", drop_parts.is_some()),
        ("--recentre", recentre),
    ];
    let flag = flags.into_iter().find_map(|(flag, is_given)| is_given.then_some(flag));
    let Some(path) = output else {
        return match flag {
            Some(flag) => Err(Error::input(format!("{flag} applies to a mesh: add -o FILE, or remove {flag}"))),
            None => Ok(None),
        };
    };
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let refuse = |why: &str| Err(Error::input(format!("{}: {why}", path.display())));
    let content = match (extension.as_str(), voxels::Format::from_extension(&extension)) {
        (_, Some(format)) => Content::Voxels(format),
        ("npz", _) => Content::Images,
        ("", _) => return refuse(&format!("the name has no extension; {WRITTEN}")),
        _ if Format::from_path(&path).is_ok() => {
            mesh_target(&path)?;
            let least_part = drop_parts.map(|args::Share(share)| share);
            let finish = Finish { method, surface_error, refine, least_part, recentre };
            if method == MeshMethod::Exact && finish.is_of_images() {
                return refuse("--surface-error bounds meshes from images; remove it, or --mesh exact");
            }
            if method == MeshMethod::Exact && matches!(refine, Some(1..)) {
                return refuse("--refine is for meshes from images; remove it, or --mesh exact");
            }
            Content::Mesh(finish)
        }
        _ => return refuse(&format!("unknown extension; {WRITTEN}")),
    };
    match (content, axis) {
        (Content::Mesh(_), AxisChoice::All) => {}
        (Content::Mesh(finish), _) if finish.is_of_images() => {
            return refuse("a mesh of images needs those along all axes; remove --axis");
        }
        (Content::Mesh(_), _) => {}
        _ => {
            if let Some(flag) = flag {
                return refuse(&format!("{flag} applies to meshes only; remove it, or write a mesh"));
            }
        }
    }
    writable(&path)?;
    Ok(Some(ImageTarget { path, content }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_go_by_letters() {
        let names = [0, 1, 25, 26, 27, 51, 52, 26 + 26 * 26].map(letters);
        assert_eq!(names, ["a", "b", "z", "aa", "ab", "az", "ba", "aaa"]);
    }
}
