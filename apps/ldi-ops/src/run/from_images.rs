//! `surface`: from images in a file back to a mesh.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::time::Instant;

use ldi_ops::grid::Grid;
use ldi_ops::ldi::npz;
use ldi_ops::mesh::LengthUnit;

use super::surface::{Imaged, SurfaceReport};
use super::{Finished, peak_memory_bytes, say_warnings, write};
use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::report::Warning;
use crate::resolve::SurfaceJob;
use crate::{json, report, unit};

/// What was made of a file of images.
pub struct Surfaced {
    pub from: PathBuf,
    pub grid: Grid,
    /// Samples of all images together.
    pub samples: usize,
    pub unit: Option<LengthUnit>,
    pub output: Option<PathBuf>,
    /// Nothing where voxels or images were written.
    pub surface: Option<SurfaceReport>,
    /// Reading, and all.
    pub seconds: [f64; 2],
    pub peak_memory: Option<u64>,
    pub warnings: Vec<Warning>,
}

/// Reads images and writes what was asked for.
pub fn run(job: &SurfaceJob, start: Instant, progress: &Progress) -> Result<Finished, Failure> {
    progress.stage("reading");
    let name = job.images.display();
    let file = File::open(&job.images).map_err(|error| Failure::input(format!("{name}: {error}")))?;
    let mut read = npz::read(BufReader::new(file)).map_err(|error| Failure::input(format!("{name}: {error}")))?;
    let mut warnings = Vec::new();
    if !read.ignored.is_empty() {
        let message = format!("{name}: arrays that mean nothing here were not read: {}", read.ignored.join(", "));
        warnings.push(Warning::new("arrays-ignored", message));
    }
    let stated = read.extras.unit.take();
    let unit = stated.as_deref().and_then(|unit| unit::parse(unit).ok()).or(job.unit);
    let has_normals = read.extras.normals.iter().any(Option::is_some);
    let (images, normals) = read.with_triangles().map_err(|error| Failure::input(format!("{name}: {error}")))?;
    let reading = start.elapsed().as_secs_f64();
    let grid = *images[0].grid();
    let imaged = Imaged { images: &images, normals: has_normals.then_some(&normals), mode: job.mode, unit };
    let (surface, said) = write::images(&job.target, &imaged, progress)?;
    warnings.extend(said);
    progress.finish();
    let surfaced = Surfaced {
        from: job.images.clone(),
        grid,
        samples: images.iter().map(|image| image.depths().len()).sum(),
        unit,
        output: match &surface {
            Some(surface) => surface.path.clone(),
            None => Some(job.target.path.clone()),
        },
        surface,
        seconds: [reading, start.elapsed().as_secs_f64()],
        peak_memory: peak_memory_bytes(),
        warnings,
    };
    say_warnings(&surfaced.warnings, progress);
    let stdout = json::deliver(&job.report, || json::surfaced(&surfaced), || report::surfaced(&surfaced))?;
    Ok(Finished { stdout, exit: Exit::Done })
}
