//! `report`, resolved.

use std::path::{Path, PathBuf};

use glam::DVec3;
use ldi_ops::grid::RAYS_MAX;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::metrics::Edges;
use ldi_ops::sampler::Fill;

use super::{Backend, Input, Invocation, Job, Openness, Report, Spacing, backend, fill, invocation, report, spacing};
use crate::args::{BuildChoice, EdgesChoice, JudgingArguments, RasterArguments, RegionArguments, ReportArguments};
use crate::exit::Failure;
use crate::length::Length;
use crate::output;
use crate::transform::Placement;

/// Reports to be made.
#[derive(Debug)]
pub struct ReportJob {
    pub solids: Vec<Input>,
    /// The region of interest; the box of the solid where there is none.
    pub roi: Option<Roi>,
    /// The design to be put beside the first.
    pub compare: Option<Input>,
    pub limits: Option<PathBuf>,
    /// The folder for everything.
    pub folder: PathBuf,
    pub unit: Option<LengthUnit>,
    pub openness: Openness,
    pub settings: Settings,
    pub report: Report,
}

/// What bounds the region of interest.
#[derive(Debug)]
pub enum Roi {
    File(Input),
    /// The convex hull of the solid.
    Hull,
    /// The solid with everything filled that a ball from outside cannot reach; its diameter, or a default.
    Wrap(Option<Length>),
}

impl Roi {
    /// Reads `hull`, `wrap`, `wrap:LENGTH` or a file.
    fn parse(text: &Path, placement: Option<Placement>) -> Result<Roi, Failure> {
        let shape = match text.to_str() {
            Some("hull") => Roi::Hull,
            Some("wrap") => Roi::Wrap(None),
            Some(text) if text.starts_with("wrap:") => {
                let diameter = text["wrap:".len()..].parse::<Length>();
                let diameter = diameter.map_err(|error| Failure::input(format!("--roi {text}: {error}")))?;
                if !(diameter.value.is_finite() && diameter.value > 0.0) {
                    return Err(Failure::input(format!("--roi {text}: the diameter is not a positive number")));
                }
                Roi::Wrap(Some(diameter))
            }
            _ => return Ok(Roi::File(Input { name: None, path: text.to_owned(), placement })),
        };
        match placement {
            None => Ok(shape),
            Some(_) => Err(Failure::input(format!(
                "--transform-roi places a file, and --roi {} lies where the solid does",
                text.display()
            ))),
        }
    }
}

/// How it is measured.
#[derive(Clone, Debug)]
pub struct Settings {
    pub spacing: Spacing<Length>,
    /// Rays along the longest side for what equations are solved on.
    pub tortuosity_resolution: u32,
    pub edges: Edges,
    pub fill: Fill,
    /// Up, when it is printed.
    pub build: DVec3,
    /// In degrees from the horizontal.
    pub overhang_angle: f64,
    /// K of Kozeny and Carman.
    pub kozeny: f64,
    pub backend: Backend,
}

/// Rays along the longest side where nothing else is asked for.
const DEFAULT_RESOLUTION: u32 = 256;

pub fn resolve(arguments: ReportArguments) -> Result<Invocation, Failure> {
    let ReportArguments { solids, output: folder, region, judging, raster, common } = arguments;
    let RegionArguments { unit, allow_open, roi, transform_a, transform_roi, edges, fill: fill_choice } = region;
    let JudgingArguments { limits, compare, build, overhang_angle, kozeny } = judging;
    let RasterArguments { resolution, pitch, tortuosity_resolution, backend: backend_choice, adapter } = raster;
    if solids.len() > 1 && transform_a.is_some() {
        return Err(Failure::input("--transform-a places one solid, and several are given"));
    }
    if solids.len() > 1 && compare.is_some() {
        return Err(Failure::input(
            "--compare puts one design beside another, and several solids are given; without it they share a table",
        ));
    }
    let edges = match edges {
        EdgesChoice::Clip => Edges::Clip,
        EdgesChoice::Periodic if roi.is_some() => {
            return Err(Failure::input("--edges periodic is for a box that repeats, and --roi is none"));
        }
        EdgesChoice::Periodic => Edges::Periodic,
        EdgesChoice::Border => Edges::Border,
    };
    if !(0.0..=90.0).contains(&overhang_angle) {
        return Err(Failure::input(format!("--overhang-angle {overhang_angle} is outside 0 to 90 degrees")));
    }
    if !(kozeny.is_finite() && kozeny > 0.0) {
        return Err(Failure::input(format!("--kozeny {kozeny} is not a positive number")));
    }
    if !(2..=RAYS_MAX).contains(&tortuosity_resolution) {
        return Err(Failure::input(format!(
            "--tortuosity-resolution {tortuosity_resolution} is outside 2 to {RAYS_MAX} rays"
        )));
    }
    usable(&folder)?;
    let settings = Settings {
        spacing: spacing(Some(resolution.unwrap_or(DEFAULT_RESOLUTION)).filter(|_| pitch.is_none()), pitch, None)?,
        tortuosity_resolution,
        edges,
        fill: fill(fill_choice),
        build: direction(build),
        overhang_angle,
        kozeny,
        backend: backend(backend_choice, adapter)?,
    };
    let placed = |path, placement| Input { name: None, path, placement };
    let roi = roi.map(|roi| Roi::parse(&roi, transform_roi)).transpose()?;
    let job = ReportJob {
        solids: solids.into_iter().map(|path| placed(path, transform_a)).collect(),
        roi,
        compare: compare.map(|path| placed(path, None)),
        limits,
        folder,
        unit,
        openness: if allow_open { Openness::Sampled } else { Openness::Refused },
        settings,
        report: report(&common)?,
    };
    Ok(invocation(Job::Report(Box::new(job)), &common))
}

fn direction(choice: BuildChoice) -> DVec3 {
    match choice {
        BuildChoice::X => DVec3::X,
        BuildChoice::Y => DVec3::Y,
        BuildChoice::Z => DVec3::Z,
        BuildChoice::MinusX => DVec3::NEG_X,
        BuildChoice::MinusY => DVec3::NEG_Y,
        BuildChoice::MinusZ => DVec3::NEG_Z,
    }
}

/// A folder that is there, or whose parent is.
fn usable(folder: &Path) -> Result<(), Failure> {
    if folder.exists() && !folder.is_dir() {
        return Err(Failure::input(format!("-o {}: is a file, and a report takes a folder", folder.display())));
    }
    let parent = output::folder(folder);
    if !folder.is_dir() && !parent.is_dir() {
        return Err(Failure::input(format!("-o {}: there is no folder {}", folder.display(), parent.display())));
    }
    Ok(())
}
