//! `convert`: from one mesh format to another.

use std::path::{Path, PathBuf};

use ldi_ops::mesh::io::Format;
use ldi_ops::mesh::{LengthUnit, TriangleMesh, io};

use super::input::{self, Provenance};
use super::{Finished, say_warnings};
use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::report::Warning;
use crate::resolve::ConvertJob;
use crate::{json, report};

/// What was written.
pub struct Converted {
    pub from: PathBuf,
    pub sha256: Option<String>,
    pub to: PathBuf,
    pub triangles: usize,
    /// The unit of the coordinates, which stay as they are.
    pub unit: Option<LengthUnit>,
    pub warnings: Vec<Warning>,
}

/// Converts a mesh as it is, solid or not. The formats that are written have no unit of their own, so nothing is scaled.
pub fn run(job: &ConvertJob, progress: &Progress) -> Result<Finished, Failure> {
    let provenance = if job.report.has_json() { Provenance::Hashed } else { Provenance::NotWanted };
    progress.stage("reading");
    let read = input::read(&job.from.path, provenance)?;
    let mut mesh = read.file.mesh;
    if let Some(placement) = &job.from.placement {
        mesh.transform(&placement.map);
    }
    let mut warnings = input::notes(&job.from.path, &read.file.notes);
    warnings.extend(input::unit_ignored(&job.from.path, read.file.unit, job.unit));
    warnings.extend(rounded(&mesh, &job.to));
    let unit = read.file.unit.or(job.unit);
    progress.stage("writing");
    io::write(&job.to, &mesh, unit).map_err(super::write_failure)?;
    let converted = Converted {
        from: job.from.path.clone(),
        sha256: read.sha256,
        to: job.to.clone(),
        triangles: mesh.triangles.len(),
        unit,
        warnings,
    };
    progress.finish();
    say_warnings(&converted.warnings, progress);
    let stdout = json::deliver(&job.report, || json::converted(&converted), || report::converted(&converted))?;
    Ok(Finished { stdout, exit: Exit::Done })
}

/// Rounding by more than this share of a mesh's size is told.
const ROUNDED: f64 = 1e-5;

/// Says that a format of 32-bit coordinates moves the vertices of a mesh that is small beside its distance from the origin.
fn rounded(mesh: &TriangleMesh, to: &Path) -> Option<Warning> {
    let bounds = mesh.bounds().filter(|_| matches!(Format::from_path(to), Ok(Format::Stl)))?;
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    // Half a unit in the last place of 24 bits.
    let moved = farthest * f64::from(f32::EPSILON) / 2.0;
    let size = bounds.extent().max_element();
    let message = || {
        format!(
            "{}: STL holds 32-bit coordinates, which moves vertices of this mesh by up to {moved:.1e}, of a size of {size:.1e}; \
             .obj holds 64 bits",
            to.display()
        )
    };
    (moved > ROUNDED * size).then(|| Warning::new("coordinates-rounded", message()))
}
