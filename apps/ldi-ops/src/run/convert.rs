//! `convert`: converts between mesh formats.

use std::path::PathBuf;

use glam::DVec3;
use ldi_ops::driver::input;
use ldi_ops::driver::{size, surface};
use ldi_ops::mesh::io::Format;
use ldi_ops::mesh::{Aabb, LengthUnit, io};
use ldi_ops::unit;
use ldi_ops::{Error, Warning};

use super::{Finished, Outcome, say_warnings};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::ConvertJob;

/// The result of a conversion.
pub struct Converted {
    pub from: PathBuf,
    pub sha256: Option<String>,
    pub to: PathBuf,
    pub triangles: usize,
    /// The offset subtracted from the coordinates, in the unit of the written file.
    pub recentred: Option<DVec3>,
    /// The unit of the written file.
    pub unit: Option<LengthUnit>,
    pub warnings: Vec<Warning>,
}

/// Converts a mesh as it is, solid or not. Coordinates are unchanged; GLB scales them to the metre, its only unit.
pub fn run(job: &ConvertJob, progress: &Progress) -> Result<Finished, Error> {
    let monitor = progress.monitor();
    monitor.stage("reading")?;
    let read = input::read(&job.from.path, job.report.has_json())?;
    let mut mesh = read.file.mesh;
    if let Some(placement) = &job.from.placement {
        let map = placement.map(read.file.unit.or(job.unit));
        mesh.transform(&map.map_err(|error| Error::input(format!("{}: {error}", job.from.path.display())))?);
    }
    // STL has no shared vertices, while readers of other formats rely on indices.
    if Format::from_path(&job.from.path) == Ok(Format::Stl) {
        mesh.weld();
    }
    let recentred = mesh.bounds().filter(|_| job.recentre).map(surface::middle);
    if let Some(offset) = recentred {
        mesh.positions.iter_mut().for_each(|position| *position -= offset);
    }
    let mut warnings = read.warnings;
    let extent = mesh.bounds().map_or(DVec3::ZERO, Aabb::extent);
    warnings.extend(size::unit_ignored(&job.from.path, read.file.unit, job.unit, extent));
    let unit = read.file.unit.or(job.unit);
    monitor.stage("writing")?;
    let written = io::write_at(&job.to, &mesh, unit, recentred.unwrap_or_default()).map_err(surface::write_error)?;
    warnings.extend(ldi_ops::driver::output::write_notes(&job.to, &written.notes));
    warnings.extend(unit_not_kept(job, read.file.unit));
    let to_written = match (unit, written.unit) {
        (Some(unit), Some(written)) => unit.metres() / written.metres(),
        _ => 1.0,
    };
    let converted = Converted {
        from: job.from.path.clone(),
        sha256: read.sha256,
        to: job.to.clone(),
        triangles: mesh.triangles.len(),
        recentred: recentred.map(|offset| offset * to_written),
        unit: written.unit,
        warnings,
    };
    progress.finish();
    say_warnings(&converted.warnings, progress);
    Ok(Finished { outcome: Outcome::Converted(converted), report: job.report.clone(), exit: Exit::Done })
}

/// Warns that a format cannot store the unit that a file stated.
fn unit_not_kept(job: &ConvertJob, stated: Option<LengthUnit>) -> Option<Warning> {
    let has_none = |format| matches!(format, Format::Stl | Format::Obj | Format::Ply | Format::Off);
    let format = Format::from_path(&job.to).ok().filter(|format| has_none(*format))?;
    let unit = unit::suffix(Some(stated?), 1);
    let message = format!(
        "{}: {format} files state no unit: a reader must know that lengths are in{unit}; write .3mf or .glb to keep the unit",
        job.to.display()
    );
    Some(Warning::new("unit-not-kept", message))
}
