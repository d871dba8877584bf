//! `check`: is each mesh a solid? All defects.

use std::path::{Path, PathBuf};

use ldi_ops::mesh::LengthUnit;
use ldi_ops::mesh::check::{MeshReport, check};

use super::input::{self, Provenance};
use super::{Finished, Outcome, say_warnings};
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

/// Checks all meshes, one after another; a file that cannot be read ends the job.
pub fn run(job: &CheckJob, progress: &Progress) -> Result<Finished, Failure> {
    progress.expect(job.meshes.len());
    let mut results = Vec::new();
    for path in &job.meshes {
        progress.stage(path.display().to_string());
        results.push(check_file(path, job)?);
        progress.step();
    }
    progress.finish();
    for checked in &results {
        say_warnings(&checked.warnings, progress);
    }
    let all = results.iter().all(|checked| checked.report.is_solid());
    Ok(Finished {
        outcome: Outcome::Checked(results),
        report: job.report.clone(),
        exit: if all { Exit::Done } else { Exit::CheckFalse },
    })
}

fn check_file(path: &Path, job: &CheckJob) -> Result<Checked, Failure> {
    let provenance = if job.report.has_json() { Provenance::Hashed } else { Provenance::NotWanted };
    let read = input::read(path, provenance)?;
    Ok(Checked {
        path: path.to_path_buf(),
        sha256: read.sha256,
        unit: read.file.unit.or(job.unit),
        report: check(&read.file.mesh),
        warnings: read.warnings,
    })
}
