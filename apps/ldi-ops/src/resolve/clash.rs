//! Resolution of `clash`.

use std::path::PathBuf;

use ldi_ops::Error;
use ldi_ops::driver::clash::rules::Rules;
use ldi_ops::driver::clash::{ClashJob, DEFAULT_RAYS, Settings};
use ldi_ops::grid::RAYS_MAX;
use ldi_ops::length::Length;

use super::{Invocation, Job, Report, backend, fill, invocation, placed, report, spacing, usable, writable};
use crate::args::{ClashArguments, ComparisonArguments, MemorySize, RuleArguments};

/// A comparison of parts, and the destinations of its result.
#[derive(Debug)]
pub struct ClashCommand {
    pub job: ClashJob,
    /// The folder of the page and the tables.
    pub folder: Option<PathBuf>,
    /// The table alone.
    pub csv: Option<PathBuf>,
    pub report: Report,
}

/// Resolves `clash`.
pub fn resolve(arguments: ClashArguments) -> Result<Invocation, Error> {
    let ClashArguments { parts, assembly, output: folder, csv, transforms, rules, comparison, common } = arguments;
    let RuleArguments { clearance, allow_touching, max_volume, ignore } = rules;
    let ComparisonArguments { unit, touching, resolution, spacing, fill: fill_choice, backend, memory } = comparison;
    for (flag, length) in [("--clearance", clearance), ("--touching", touching)] {
        if let Some(length) = length.filter(|length| !is_valid(length)) {
            return Err(Error::input(format!("{flag} {length} is not a length of 0 or more")));
        }
    }
    if let Some(volume) = max_volume.as_ref().filter(|volume| volume.value < 0.0) {
        return Err(Error::input(format!("--max-volume {volume} is not a volume of 0 or more")));
    }
    if let Some(resolution) = resolution.filter(|rays| !(8..=RAYS_MAX / 8).contains(rays)) {
        return Err(Error::input(format!("--resolution {resolution} is outside 8 to {} rays", RAYS_MAX / 8)));
    }
    folder.as_deref().map(|folder| usable("-o ", folder, "clash")).transpose()?;
    csv.as_deref().map(writable).transpose()?;
    let settings = Settings {
        fill: fill(fill_choice.fill),
        clearance,
        touching,
        spacing: self::spacing(resolution, spacing, DEFAULT_RAYS)?,
        backend: self::backend(backend)?,
        rules: Rules { allow_touching, max_volume, ignored: ignore },
        memory: memory.map(|MemorySize(bytes)| bytes),
    };
    let job = ClashJob { inputs: placed(parts, transforms)?, assembly, unit, settings };
    let command = ClashCommand { job, folder, csv, report: report(&common)? };
    Ok(invocation(Job::Clash(Box::new(command)), &common))
}

fn is_valid(length: &Length) -> bool {
    length.value.is_finite() && length.value >= 0.0
}
