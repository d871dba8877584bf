//! `generate`: builds model solids.

use std::path::PathBuf;

use ldi_ops::driver::surface;
use ldi_ops::mesh::{Aabb, LengthUnit, io};
use ldi_ops::{Error, Warning};

use super::{Finished, Outcome, say_warnings};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::GenerateJob;

/// The result of writing a model.
pub struct Generated {
    pub kind: String,
    pub to: PathBuf,
    pub triangles: usize,
    pub bounds: Option<Aabb>,
    pub volume: f64,
    pub area: f64,
    pub warnings: Vec<Warning>,
}

/// Builds a model, in millimetres, and writes it.
pub fn run(job: &GenerateJob, progress: &Progress) -> Result<Finished, Error> {
    let monitor = progress.monitor();
    monitor.stage("building")?;
    let mesh = job.model.build().map_err(Error::input)?;
    monitor.stage("writing")?;
    let written = io::write(&job.to, &mesh, Some(LengthUnit::Millimetre)).map_err(surface::write_error)?;
    let generated = Generated {
        kind: job.kind.clone(),
        to: job.to.clone(),
        triangles: mesh.triangles.len(),
        bounds: mesh.bounds(),
        volume: mesh.signed_volume(),
        area: mesh.area(),
        warnings: ldi_ops::driver::output::write_notes(&job.to, &written.notes),
    };
    progress.finish();
    say_warnings(&generated.warnings, progress);
    Ok(Finished { outcome: Outcome::Generated(generated), report: job.report.clone(), exit: Exit::Done })
}
