//! `surface`: from images in a file back to a mesh.

use std::io::{self, BufReader, Read, Seek};
use std::path::{Path, PathBuf};
use std::time::Instant;

use ldi_ops::grid::Grid;
use ldi_ops::input;
use ldi_ops::integrate::{AxisVolume, VolumeEstimate};
use ldi_ops::ldi::Ldi;
use ldi_ops::ldi::npz::{self, ImageMode, Normals, NpzError};
use ldi_ops::mesh::LengthUnit;
use ldi_ops::mesh::io::Format;
use ldi_ops::sampler::Mode;

use super::surface::{self, Imaged, SurfaceReport};
use super::{Finished, Outcome, peak_memory_bytes, say_warnings, write};
use crate::exit::Failure;
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
    /// The mode that the file states.
    pub mode: Option<ImageMode>,
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
        let mode = read.extras.mode;
        let has_normals = read.extras.normals.iter().any(Option::is_some);
        let (images, normals) = read.with_triangles().map_err(failure)?;
        Ok(ImageFile { images, normals: has_normals.then_some(normals), unit, mode, warnings })
    }

    /// The mode of the images: what the file states, or else what was asked for, or else exact.
    pub fn mode(&self, path: &Path, asked: Option<Mode>) -> Result<Mode, Failure> {
        match (self.mode, asked) {
            (Some(stated), Some(asked)) if write::image_mode(asked) != stated => Err(Failure::input(format!(
                "{}: the images are stated to be `{}`, and --mode {} contradicts that; leave --mode away",
                path.display(),
                stated.name(),
                write::image_mode(asked).name()
            ))),
            (stated, asked) => Ok(stated.map(write::mode).or(asked).unwrap_or(Mode::Exact)),
        }
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
        let volume = VolumeEstimate::from_axes(&self.images.iter().map(AxisVolume::of).collect::<Vec<_>>());
        Ok(Imaged { volume: Some(volume), ..self.as_they_are(mode) })
    }

    fn as_they_are(&self, mode: Mode) -> Imaged<'_> {
        Imaged { images: &self.images, normals: self.normals.as_deref(), mode, unit: self.unit, volume: None }
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
    let file = BufReader::new(input::open(&job.images).map_err(failure)?);
    let mut file = ImageFile::read(file, &job.images)?;
    file.unit = file.unit.or(job.unit);
    let reading = start.elapsed().as_secs_f64();
    let mode = file.mode(&job.images, job.mode)?;
    if file.mode.is_none() && job.mode.is_none() {
        progress.note(format_args!(
            "{}: the file states no mode, so its images are taken as exact; --mode says otherwise",
            job.images.display()
        ));
    }
    let imaged = match job.target.content {
        Content::Mesh(_) => file.imaged(&job.images, mode)?,
        _ => file.as_they_are(mode),
    };
    let (surface, said) = write::images(&job.target, &imaged, progress)?;
    let ImageFile { images, unit, mut warnings, .. } = file;
    let grid = *images[0].grid();
    warnings.extend(said);
    warnings.extend(surface.as_ref().and_then(|report| images_disagree(&job.images, mode, report)));
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
    let exit = surface::exit(surfaced.surface.as_ref());
    Ok(Finished { outcome: Outcome::Surfaced(Box::new(surfaced)), report: job.report.clone(), exit })
}

/// Says that images are not exact although they are taken so: of exact ones all agree about every node.
fn images_disagree(path: &Path, mode: Mode, report: &SurfaceReport) -> Option<Warning> {
    let message = format!(
        "{}: the images along different axes disagree about {} lattice nodes, which exact images of one closed solid do not; \
         of two that agree the mesh has what they say",
        path.display(),
        report.disagreements
    );
    (mode == Mode::Exact && report.disagreements > 0).then(|| Warning::new("images-disagree", message))
}
