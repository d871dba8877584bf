//! `surface`: converts images in a file back to a mesh.

use std::io::{self, BufReader};
use std::path::PathBuf;
use std::time::Instant;

use ldi_ops::driver::image_file::ImageFile;
use ldi_ops::driver::job::Content;
use ldi_ops::driver::machine::peak_memory_bytes;
use ldi_ops::driver::surface::SurfaceReport;
use ldi_ops::driver::write;
use ldi_ops::grid::Grid;
use ldi_ops::mesh::LengthUnit;
use ldi_ops::mesh::io::Format;
use ldi_ops::{Error, Warning, input};

use super::{Finished, Outcome, say_warnings, surface_exit};
use crate::progress::Progress;
use crate::resolve::SurfaceJob;

/// The result of converting a file of images.
pub struct Surfaced {
    pub from: PathBuf,
    pub grid: Grid,
    /// Number of samples of all images together.
    pub samples: usize,
    pub unit: Option<LengthUnit>,
    pub output: Option<PathBuf>,
    /// `None` if voxels or images were written.
    pub surface: Option<SurfaceReport>,
    /// Seconds of reading, and in total.
    pub seconds: [f64; 2],
    pub peak_memory: Option<u64>,
    pub warnings: Vec<Warning>,
}

/// Reads images and writes the requested file.
pub fn run(job: &SurfaceJob, start: Instant, progress: &Progress) -> Result<Finished, Error> {
    let monitor = progress.monitor();
    monitor.stage("reading")?;
    if Format::from_path(&job.images).is_ok() {
        let message = format!(
            "{}: is a mesh; `surface` reads images: write them with `ldi-ops sample MESH -o FILE.npz`",
            job.images.display()
        );
        return Err(Error::input(message));
    }
    let failure = |error: io::Error| Error::input(format!("{}: {error}", job.images.display()));
    let file = BufReader::new(input::open(&job.images).map_err(failure)?);
    let mut file = ImageFile::read(file, &job.images)?;
    file.unit = file.unit.or(job.unit);
    let reading = start.elapsed().as_secs_f64();
    let mode = file.mode(&job.images, job.mode)?;
    if file.mode.is_none() && job.mode.is_none() {
        progress.note(format_args!(
            "{}: the file states no mode: its images are treated as exact (set --mode)",
            job.images.display()
        ));
    }
    let imaged = match job.target.content {
        Content::Mesh(_) => file.imaged(&job.images, mode)?,
        _ => file.as_they_are(mode),
    };
    let (surface, said) = write::images(&job.target, &imaged, &monitor)?;
    let doubts = file.doubts(&job.images, mode, surface.as_ref());
    let ImageFile { images, unit, mut warnings, .. } = file;
    let grid = *images[0].grid();
    warnings.extend(said);
    warnings.extend(doubts);
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
    let exit = surface_exit(surfaced.surface.as_ref());
    Ok(Finished { outcome: Outcome::Surfaced(Box::new(surfaced)), report: job.report.clone(), exit })
}
