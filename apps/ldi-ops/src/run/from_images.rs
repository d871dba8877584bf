//! `surface`: from images in a file back to a mesh.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};
use std::time::Instant;

use ldi_ops::grid::Grid;
use ldi_ops::ldi::Ldi;
use ldi_ops::ldi::npz::{self, Normals, NpzError};
use ldi_ops::mesh::LengthUnit;
use ldi_ops::mesh::io::Format;
use ldi_ops::sampler::Mode;

use super::surface::{Imaged, SurfaceReport};
use super::{Finished, Outcome, peak_memory_bytes, say_warnings, write};
use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::resolve::{Content, SurfaceJob};
use crate::unit;
use crate::warning::Warning;

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

/// Images that were read from a file, and what came with them.
pub struct ImageFile {
    pub images: Vec<Ldi>,
    /// Of the triangles that images refer to, one for each sample; nothing where none are known.
    pub normals: Option<Normals>,
    /// The unit that the file states.
    pub unit: Option<LengthUnit>,
    pub warnings: Vec<Warning>,
}

impl ImageFile {
    /// Reads a file; its name stands in errors.
    pub fn read(from: impl Read + Seek, path: &Path) -> Result<ImageFile, Failure> {
        let failure = |error: NpzError| Failure::input(format!("{}: {error}", path.display()));
        let mut read = npz::read(from).map_err(failure)?;
        let mut warnings = Vec::new();
        if !read.ignored.is_empty() {
            let ignored = read.ignored.join(", ");
            let message = format!("{}: arrays that mean nothing here were not read: {ignored}", path.display());
            warnings.push(Warning::new("arrays-ignored", message));
        }
        let unit = read.extras.unit.take().and_then(|unit| unit::parse(&unit).ok());
        let has_normals = read.extras.normals.iter().any(Option::is_some);
        let (images, normals) = read.with_triangles().map_err(failure)?;
        Ok(ImageFile { images, normals: has_normals.then_some(normals), unit, warnings })
    }

    /// What a mesh is made of, if all three images are there.
    pub fn imaged(&self, path: &Path, mode: Mode) -> Result<Imaged<'_>, Failure> {
        if self.images.len() < 3 {
            let axes: Vec<&str> = self.images.iter().map(|image| image.axis().name()).collect();
            return Err(Failure::input(format!(
                "{}: a mesh is made of images along all three axes, and there are {} alone",
                path.display(),
                axes.join(" and ")
            )));
        }
        Ok(self.as_they_are(mode))
    }

    fn as_they_are(&self, mode: Mode) -> Imaged<'_> {
        Imaged { images: &self.images, normals: self.normals.as_deref(), mode, unit: self.unit }
    }
}

/// Reads images and writes what was asked for.
pub fn run(job: &SurfaceJob, start: Instant, progress: &Progress) -> Result<Finished, Failure> {
    progress.stage("reading");
    if Format::from_path(&job.images).is_ok() {
        let message = format!(
            "{}: is a mesh, and images are wanted, as `ldi-ops sample` writes them to .npz",
            job.images.display()
        );
        return Err(Failure::input(message));
    }
    let failure = |error: io::Error| Failure::input(format!("{}: {error}", job.images.display()));
    let file = BufReader::new(File::open(&job.images).map_err(failure)?);
    let mut file = ImageFile::read(file, &job.images)?;
    file.unit = file.unit.or(job.unit);
    let reading = start.elapsed().as_secs_f64();
    let imaged = match job.target.content {
        Content::Mesh(_) => file.imaged(&job.images, job.mode)?,
        _ => file.as_they_are(job.mode),
    };
    let (surface, said) = write::images(&job.target, &imaged, progress)?;
    let ImageFile { images, unit, mut warnings, .. } = file;
    let grid = *images[0].grid();
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
    Ok(Finished { outcome: Outcome::Surfaced(Box::new(surfaced)), report: job.report.clone(), exit: Exit::Done })
}
