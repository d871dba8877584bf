//! `check`: is each mesh a solid? All defects.

use std::path::{Path, PathBuf};

use glam::DVec3;
use ldi_ops::mesh::check::{MeshReport, check};
use ldi_ops::mesh::{Aabb, LengthUnit};

use super::input::{self, Provenance};
use super::{Each, Finished, Outcome, Refused, say_warnings, size};
use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::resolve::CheckJob;
use crate::warning::Warning;

/// What was found out about one mesh.
pub struct Checked {
    pub path: PathBuf,
    pub sha256: Option<String>,
    pub unit: Option<LengthUnit>,
    pub report: MeshReport,
    /// What the reader had to say.
    pub warnings: Vec<Warning>,
}

/// Checks all meshes, one after another; a file that cannot be read does not keep the others from being checked.
pub fn run(job: &CheckJob, progress: &Progress) -> Result<Finished, Failure> {
    progress.expect(job.meshes.len());
    let mut results: Vec<Each<Checked>> = Vec::new();
    for path in &job.meshes {
        progress.stage(path.display().to_string());
        results.push(check_file(path, job).map_err(|failure| Refused::new(path, failure)));
        progress.step();
    }
    progress.finish();
    for checked in results.iter().flatten() {
        say_warnings(&checked.warnings, progress);
    }
    let exit = super::worst(&results, |checked| match checked.report.is_solid() {
        true => Exit::Done,
        false => Exit::CheckFalse,
    });
    Ok(Finished { outcome: Outcome::Checked(results), report: job.report.clone(), exit })
}

fn check_file(path: &Path, job: &CheckJob) -> Result<Checked, Failure> {
    let provenance = if job.report.has_json() { Provenance::Hashed } else { Provenance::NotWanted };
    let read = input::read(path, provenance)?;
    let report = check(&read.file.mesh);
    let mut warnings = read.warnings;
    let extent = report.bounds.map_or(DVec3::ZERO, Aabb::extent);
    warnings.extend(size::unit_ignored(path, read.file.unit, job.unit, extent));
    let unit = read.file.unit.or(job.unit);
    Ok(Checked { path: path.to_path_buf(), sha256: read.sha256, unit, report, warnings })
}
