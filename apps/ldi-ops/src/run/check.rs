//! `check`: reports whether each mesh is a solid, with all defects.

use std::path::{Path, PathBuf};

use glam::DVec3;
use ldi_ops::driver::input;
use ldi_ops::driver::size;
use ldi_ops::mesh::check::{MeshReport, check};
use ldi_ops::mesh::{Aabb, ClosedMesh, LengthUnit, TriangleMesh, Unproved, first_crossing, prove_simple};
use ldi_ops::{Error, Warning};

use super::{Each, Finished, Outcome, Refused, say_warnings};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::CheckJob;

/// The result for one mesh.
pub struct Checked {
    pub path: PathBuf,
    pub sha256: Option<String>,
    pub unit: Option<LengthUnit>,
    pub report: MeshReport,
    /// The warnings of the reader, and those about a surface that meets itself.
    pub warnings: Vec<Warning>,
}

/// Checks all meshes, one after another; an unreadable file does not stop the others.
pub fn run(job: &CheckJob, progress: &Progress) -> Result<Finished, Error> {
    let monitor = progress.monitor();
    monitor.expect(job.meshes.len())?;
    let mut results: Vec<Each<Checked>> = Vec::new();
    for path in &job.meshes {
        monitor.stage(path.display().to_string())?;
        results.push(check_file(path, job).map_err(|failure| Refused::new(path, failure)));
        monitor.step()?;
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

fn check_file(path: &Path, job: &CheckJob) -> Result<Checked, Error> {
    let read = input::read(path, job.report.has_json())?;
    let report = check(&read.file.mesh);
    let mut warnings = read.warnings;
    let extent = report.bounds.map_or(DVec3::ZERO, Aabb::extent);
    warnings.extend(size::unit_ignored(path, read.file.unit, job.unit, extent));
    let unit = read.file.unit.or(job.unit);
    warnings.extend(meets_itself(path, read.file.mesh));
    Ok(Checked { path: path.to_path_buf(), sha256: read.sha256, unit, report, warnings })
}

/// Returns a warning if triangles of a closed mesh meet elsewhere than in corners and sides that they share.
fn meets_itself(path: &Path, mesh: TriangleMesh) -> Option<Warning> {
    let closed = ClosedMesh::check(mesh).ok()?;
    let Unproved::TrianglesMeet { triangles: [a, b] } = prove_simple(&closed).err()? else { return None };
    let what = match first_crossing(&closed) {
        Some(crossing) => {
            format!(
                "{crossing}: where the surface passes through itself, the fill rule decides what is inside (--fill)"
            )
        }
        None => format!(
            "triangles {a} and {b} touch or lie on one another, and none cross: the fill rule decides what is inside only where parts of \
             the solid overlap (--fill)"
        ),
    };
    Some(Warning::new("meets-itself", format!("{}: {what}", path.display())))
}
