//! Resolution of `report`.

use std::ffi::OsString;
use std::path::Path;

use glam::DVec3;
use ldi_ops::Error;
use ldi_ops::driver::job::{Input, Openness};
use ldi_ops::grid::RAYS_MAX;
use ldi_ops::metrics::BoundaryCondition;
use ldi_ops::placement::Placement;
use ldi_ops::report::{ReportJob, Roi, Settings};

use super::{Invocation, Job, fill, invocation, report, spacing, usable};
use crate::args::{
    BuildChoice, EdgesChoice, JudgingArguments, RasterArguments, RegionArguments, ReportArguments, SpacingArguments,
};

/// Rays along the longest side by default.
const DEFAULT_RESOLUTION: u32 = 256;

/// Resolves `report`; `words` are the words of the command line after the program's name.
pub fn resolve(arguments: ReportArguments, words: &[OsString]) -> Result<Invocation, Error> {
    let ReportArguments { solids, output: folder, region, judging, raster, common } = arguments;
    let RegionArguments { unit, allow_open, roi, transform_a, transform_roi, edges } = region;
    let JudgingArguments { limits, compare, build, overhang_angle, kozeny } = judging;
    let RasterArguments { resolution, pitch, tortuosity_resolution, fill: fill_choice, device } = raster;
    if solids.len() > 1 && transform_a.is_some() {
        return Err(Error::input("--transform-a applies to one solid, but several are given"));
    }
    if solids.len() > 1 && compare.is_some() {
        return Err(Error::input(
            "--compare compares two solids, but more are given; without --compare all share one table",
        ));
    }
    let edges = match edges {
        EdgesChoice::Clip => BoundaryCondition::Clip,
        EdgesChoice::Periodic if roi.is_some() => {
            return Err(Error::input(
                "--edges periodic needs a box that repeats; remove --roi, or choose border or clip",
            ));
        }
        EdgesChoice::Periodic => BoundaryCondition::Periodic,
        EdgesChoice::Border => BoundaryCondition::Border,
    };
    if !(0.0..=90.0).contains(&overhang_angle) {
        return Err(Error::input(format!("--overhang-angle {overhang_angle} is outside 0 to 90 degrees")));
    }
    if !(kozeny.is_finite() && kozeny > 0.0) {
        return Err(Error::input(format!("--kozeny {kozeny} is not a positive number")));
    }
    if !(2..=RAYS_MAX).contains(&tortuosity_resolution) {
        return Err(Error::input(format!(
            "--tortuosity-resolution {tortuosity_resolution} is outside 2 to {RAYS_MAX} rays"
        )));
    }
    folder.as_deref().map(|folder| usable("-o ", folder, "a report")).transpose()?;
    let (backend, memory) = super::device(device)?;
    let settings = Settings {
        spacing: spacing(resolution, SpacingArguments { pitch, tolerance: None }, DEFAULT_RESOLUTION)?,
        tortuosity_resolution,
        edges,
        fill: fill(fill_choice.fill),
        build: direction(build),
        overhang_angle,
        kozeny,
        memory,
        backend,
        // Only the page has pictures.
        is_drawn: folder.is_some(),
    };
    let placed = |path, placement| Input { name: None, path, placement };
    let roi = roi.map(|roi| self::roi(&roi, transform_roi)).transpose()?;
    let job = ReportJob {
        solids: solids.into_iter().map(|path| placed(path, transform_a)).collect(),
        roi,
        compare: compare.map(|path| placed(path, None)),
        limits,
        folder,
        unit,
        openness: if allow_open { Openness::Sampled } else { Openness::RefusedByDefault },
        settings,
        command_line: command_line(words),
    };
    Ok(invocation(Job::Report(Box::new(job), report(&common)?), &common))
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

/// Reads `hull`, `wrap`, `wrap:LENGTH` or a file.
fn roi(text: &Path, placement: Option<Placement>) -> Result<Roi, Error> {
    let shape = Roi::following(text.to_str().unwrap_or_default());
    match (shape.map_err(|problem| Error::input(format!("--roi {}: {problem}", text.display())))?, placement) {
        (None, placement) => Ok(Roi::Solid(Input { name: None, path: text.to_owned(), placement })),
        (Some(shape), None) => Ok(shape),
        (Some(_), Some(_)) => Err(Error::input(format!(
            "--transform-roi needs a file as --roi; --roi {} follows the solid",
            text.display()
        ))),
    }
}

/// Returns the command line as typed, with `ldi-ops` in place of the program's path.
fn command_line(words: &[OsString]) -> String {
    let quoted = words.iter().map(|word| match word.to_string_lossy() {
        word if word.contains(char::is_whitespace) => format!("'{word}'"),
        word => word.into_owned(),
    });
    std::iter::once("ldi-ops".to_owned()).chain(quoted).collect::<Vec<_>>().join(" ")
}
