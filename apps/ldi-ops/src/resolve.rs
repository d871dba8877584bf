//! From arguments as typed to jobs that can be run: everything that can be refused without reading an input is.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use ldi_ops::boolean::BooleanOperation;
use ldi_ops::grid::{Axis, LOD_RANGE, RAYS_MAX};
use ldi_ops::mesh::LengthUnit;
use ldi_ops::mesh::io::{Format, WriteError};
use ldi_ops::sampler::{Estimate, Fill, Mode};
use ldi_ops::solids::Model;

use crate::args::{
    self, AxisChoice, BackendChoice, CommonArguments, FillChoice, ModeChoice, PlacingArguments, SamplingArguments,
};
use crate::exit::Failure;
use crate::output;
use crate::transform::Placement;

/// What the program is to do, and how it is to talk meanwhile.
#[derive(Debug)]
pub struct Invocation {
    pub job: Job,
    /// The number of threads that was asked for.
    pub threads: Option<NonZeroUsize>,
    pub verbosity: Verbosity,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// Warnings and errors alone.
    Quiet,
    /// Also a progress bar on a terminal.
    Normal,
    /// Also what was decided and how long it took.
    Verbose,
}

#[derive(Debug)]
pub enum Job {
    Measure(MeasureJob),
    Check(CheckJob),
    Convert(ConvertJob),
    Generate(GenerateJob),
    Devices(DevicesJob),
}

/// Where the result goes.
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
    /// Whether any JSON is made.
    pub fn has_json(&self) -> bool {
        *self != Report::Text
    }
}

/// What is measured of the inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measurement {
    /// The volume of a Boolean of all inputs.
    Boolean(BooleanOperation),
    /// Volume, area and moments of each input on its own.
    Volume,
    /// The image of the one input.
    Sample,
}

impl Measurement {
    /// The name of the command.
    pub fn command(self) -> &'static str {
        match self {
            Measurement::Boolean(BooleanOperation::Intersection) => "intersect",
            Measurement::Boolean(BooleanOperation::Union) => "union",
            Measurement::Boolean(BooleanOperation::Difference) => "difference",
            Measurement::Boolean(BooleanOperation::Xor) => "xor",
            Measurement::Volume => "volume",
            Measurement::Sample => "sample",
        }
    }
}

/// How fine the raster is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing {
    /// Rays along the longest side of the common box.
    Resolution(u32),
    /// Distance of the rays.
    Pitch(f64),
    /// Whatever brings the error estimate below this share of the volume.
    Tolerance(f64),
}

/// What becomes of a mesh that is not closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Openness {
    Refused,
    Sampled,
}

/// Where sampling is to run. Whether there is such a device is found out when the job is run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Backend {
    /// Wherever it is likely to be done first.
    Auto,
    Cpu,
    /// On the adapter of this name, or of which it is a part; without a name on the first.
    Gpu(Option<String>),
}

/// A file to read, and where to place what it holds.
#[derive(Clone, Debug)]
pub struct Input {
    pub path: PathBuf,
    pub placement: Option<Placement>,
}

/// `intersect`, `union`, `difference`, `xor`, `volume` and `sample`.
#[derive(Debug)]
pub struct MeasureJob {
    pub measurement: Measurement,
    pub inputs: Vec<Input>,
    pub unit: Option<LengthUnit>,
    pub openness: Openness,
    pub spacing: Spacing,
    pub lod: u32,
    pub axes: Vec<Axis>,
    pub mode: Mode,
    pub fill: Fill,
    pub backend: Backend,
    /// Where the images go.
    pub images: Option<PathBuf>,
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

/// Resolves a command line.
pub fn resolve(command: args::Command) -> Result<Invocation, Failure> {
    use args::Command;
    let boolean = Measurement::Boolean;
    let list = |operation, a: args::ListArguments| {
        let mut paths = vec![a.a];
        paths.extend(a.others);
        pair_like(boolean(operation), paths, a.placing, a.sampling, a.writing, a.common)
    };
    match command {
        Command::Intersect(a) => pair_like(
            boolean(BooleanOperation::Intersection),
            vec![a.a, a.b],
            a.placing,
            a.sampling,
            a.writing,
            a.common,
        ),
        Command::Union(a) => list(BooleanOperation::Union, a),
        Command::Difference(a) => list(BooleanOperation::Difference, a),
        Command::Xor(a) => list(BooleanOperation::Xor, a),
        Command::Volume(a) => {
            if a.solids.len() > 1 && a.placing.transform_a.is_some() {
                return Err(Failure::input("--transform-a places one solid, and several are given"));
            }
            measure(Measurement::Volume, a.solids, None, a.placing, a.sampling, None, a.common)
        }
        Command::Sample(a) => {
            measure(Measurement::Sample, vec![a.solid], None, a.placing, a.sampling, Some(a.output), a.common)
        }
        Command::Check(a) => {
            let report = report(&a.common)?;
            Ok(invocation(Job::Check(CheckJob { meshes: a.meshes, unit: a.unit, report }), &a.common))
        }
        Command::Convert(a) => {
            let report = report(&a.common)?;
            mesh_target(&a.output)?;
            apart(&report, &a.output)?;
            let from = Input { path: a.from, placement: a.transform_a };
            Ok(invocation(Job::Convert(ConvertJob { from, to: a.output, unit: a.unit, report }), &a.common))
        }
        Command::Generate(a) => {
            let report = report(&a.common)?;
            mesh_target(&a.output)?;
            apart(&report, &a.output)?;
            let parameters: Vec<(&str, &str)> =
                a.parameters.iter().map(|(name, text)| (*name, text.as_str())).collect();
            let model = Model::from_parameters(&a.kind, &parameters).map_err(Failure::input)?;
            Ok(invocation(Job::Generate(GenerateJob { kind: a.kind, model, to: a.output, report }), &a.common))
        }
        Command::Devices(a) => {
            let report = report(&a.common)?;
            Ok(invocation(Job::Devices(DevicesJob { report }), &a.common))
        }
    }
}

fn invocation(job: Job, common: &CommonArguments) -> Invocation {
    let verbosity = match (common.quiet, common.verbose) {
        (true, _) => Verbosity::Quiet,
        (false, false) => Verbosity::Normal,
        (false, true) => Verbosity::Verbose,
    };
    Invocation { job, threads: common.threads, verbosity }
}

fn pair_like(
    measurement: Measurement,
    paths: Vec<PathBuf>,
    placing: args::PairPlacingArguments,
    sampling: SamplingArguments,
    writing: args::ImageArguments,
    common: CommonArguments,
) -> Result<Invocation, Failure> {
    measure(measurement, paths, placing.transform_b, placing.first, sampling, writing.output, common)
}

fn measure(
    measurement: Measurement,
    paths: Vec<PathBuf>,
    transform_b: Option<Placement>,
    placing: PlacingArguments,
    sampling: SamplingArguments,
    images: Option<PathBuf>,
    common: CommonArguments,
) -> Result<Invocation, Failure> {
    let backend = backend(&sampling)?;
    let spacing = spacing(&sampling)?;
    if !LOD_RANGE.contains(&sampling.lod) {
        let (least, most) = (LOD_RANGE.start(), LOD_RANGE.end());
        return Err(Failure::input(format!("--lod {} is outside {least} to {most} voxels a ray", sampling.lod)));
    }
    if let Some(path) = &images {
        image_target(path)?;
    }
    let report = report(&common)?;
    if let Some(path) = &images {
        apart(&report, path)?;
    }
    let placements = [placing.transform_a, transform_b];
    let inputs = paths.into_iter().enumerate();
    let inputs = inputs.map(|(i, path)| Input { path, placement: placements.get(i).copied().flatten() }).collect();
    let job = MeasureJob {
        measurement,
        inputs,
        unit: placing.unit,
        openness: if placing.allow_open { Openness::Sampled } else { Openness::Refused },
        spacing,
        lod: sampling.lod,
        axes: match sampling.axis {
            AxisChoice::X => vec![Axis::X],
            AxisChoice::Y => vec![Axis::Y],
            AxisChoice::Z => vec![Axis::Z],
            AxisChoice::All => Axis::ALL.to_vec(),
        },
        mode: match sampling.mode {
            ModeChoice::Over => Mode::Estimate(Estimate::Over),
            ModeChoice::Under => Mode::Estimate(Estimate::Under),
            ModeChoice::Exact => Mode::Exact,
        },
        fill: match sampling.fill {
            FillChoice::EvenOdd => Fill::EvenOdd,
            FillChoice::Nonzero => Fill::NonZero,
        },
        backend,
        images,
        report,
    };
    Ok(invocation(Job::Measure(job), &common))
}

fn backend(sampling: &SamplingArguments) -> Result<Backend, Failure> {
    match (sampling.backend, &sampling.adapter) {
        (BackendChoice::Auto, None) => Ok(Backend::Auto),
        (BackendChoice::Cpu, None) => Ok(Backend::Cpu),
        (BackendChoice::Cpu, Some(name)) => {
            Err(Failure::input(format!("--adapter {name} asks for a GPU, and --backend cpu for none")))
        }
        // Who names an adapter leaves no choice to auto.
        (BackendChoice::Auto | BackendChoice::Gpu, name) => Ok(Backend::Gpu(name.clone())),
    }
}

/// Rays along the longest side where neither resolution nor pitch nor tolerance is given.
const DEFAULT_RESOLUTION: u32 = 512;

fn spacing(sampling: &SamplingArguments) -> Result<Spacing, Failure> {
    match (sampling.resolution, sampling.pitch, sampling.tolerance) {
        (Some(rays), _, _) if !(1..=RAYS_MAX).contains(&rays) => {
            Err(Failure::input(format!("--resolution {rays} is outside 1 to {RAYS_MAX} rays")))
        }
        (_, Some(pitch), _) if !(pitch.is_finite() && pitch > 0.0) => {
            Err(Failure::input(format!("--pitch {pitch} is not a positive length")))
        }
        (Some(rays), _, _) => Ok(Spacing::Resolution(rays)),
        (_, Some(pitch), _) => Ok(Spacing::Pitch(pitch)),
        (_, _, Some(args::Tolerance(tolerance))) => Ok(Spacing::Tolerance(tolerance)),
        (None, None, None) => Ok(Spacing::Resolution(DEFAULT_RESOLUTION)),
    }
}

fn report(common: &CommonArguments) -> Result<Report, Failure> {
    match &common.json {
        None => Ok(Report::Text),
        Some(path) if path.as_os_str() == "-" => Ok(Report::Json),
        Some(path) => {
            writable(path)?;
            Ok(Report::TextAndJson(path.clone()))
        }
    }
}

/// A target whose folder is there, so that nobody waits for a result that has nowhere to go.
fn writable(path: &Path) -> Result<(), Failure> {
    let folder = output::folder(path);
    if path.is_dir() {
        return Err(Failure::input(format!("{}: is a folder, and a file is to be written", path.display())));
    }
    if !folder.is_dir() {
        return Err(Failure::input(format!("{}: there is no folder {}", path.display(), folder.display())));
    }
    Ok(())
}

/// The JSON and the other output go to different files, as one would take the place of the other.
fn apart(report: &Report, other: &Path) -> Result<(), Failure> {
    match report {
        Report::TextAndJson(json) if output::is_same(json, other) => Err(Failure::input(format!(
            "--json {} and -o {} are the same file; each needs its own",
            json.display(),
            other.display()
        ))),
        _ => Ok(()),
    }
}

/// A mesh file of a format that can be written.
fn mesh_target(path: &Path) -> Result<(), Failure> {
    let format = Format::from_path(path).map_err(Failure::input)?;
    if !format.is_written() {
        return Err(Failure::input(WriteError::NoWriter { path: path.to_path_buf(), format }));
    }
    writable(path)
}

/// An image file.
fn image_target(path: &Path) -> Result<(), Failure> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let refuse = |why: &str| Err(Failure::input(format!("{}: {why}", path.display())));
    match extension.as_str() {
        "npz" => writable(path),
        "vti" | "npy" => refuse("voxels are not made by this build; -o takes .npz, the image"),
        "" => refuse("the name has no extension; -o takes .npz, the image"),
        _ if Format::from_path(path).is_ok() => {
            refuse("surfaces are not made by this build, so there is no mesh to write; -o takes .npz, the image")
        }
        _ => refuse("this extension is not known; -o takes .npz, the image"),
    }
}
