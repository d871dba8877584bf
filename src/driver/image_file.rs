//! `surface`: the images of a file, from which a mesh is contoured.

use std::io::{Read, Seek};
use std::path::Path;

use super::surface::{Imaged, SurfaceReport};
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::ldi::npz::{self, Normals, NpzError};
use crate::ldi::{Ldi, NodePlanes};
use crate::mesh::LengthUnit;
use crate::sampler::Mode;
use crate::unit;
use crate::{Error, Warning};

/// The images of a file, with their normals, unit and mode.
pub struct ImageFile {
    /// The images, one to three.
    pub images: Vec<Ldi>,
    /// The normals of the triangles that samples refer to, one for each sample; `None` where none are known.
    pub normals: Option<Normals>,
    /// The unit that the file states.
    pub unit: Option<LengthUnit>,
    /// The mode that the file states.
    pub mode: Option<Mode>,
    /// Warnings of the reader.
    pub warnings: Vec<Warning>,
}

impl ImageFile {
    /// Reads a file; errors name `path`.
    pub fn read(from: impl Read + Seek, path: &Path) -> Result<ImageFile, Error> {
        let failure = |error: NpzError| Error::input(format!("{}: {error}", path.display()));
        let mut read = npz::read(from).map_err(failure)?;
        let mut warnings = Vec::new();
        if !read.ignored.is_empty() {
            let ignored = read.ignored.join(", ");
            let message =
                format!("{}: these arrays are not part of the format and were ignored: {ignored}", path.display());
            warnings.push(Warning::new("arrays-ignored", message));
        }
        let unit = read.extras.unit.take().and_then(|unit| unit::parse(&unit).ok());
        let mode = read.extras.mode;
        let has_normals = read.extras.normals.iter().any(Option::is_some);
        let (images, normals) = read.with_triangles().map_err(failure)?;
        Ok(ImageFile { images, normals: has_normals.then_some(normals), unit, mode, warnings })
    }

    /// Returns the mode of the images: the one that the file states, else `requested`, else exact.
    pub fn mode(&self, path: &Path, requested: Option<Mode>) -> Result<Mode, Error> {
        match (self.mode, requested) {
            (Some(stated), Some(requested)) if requested != stated => Err(Error::input(format!(
                "{}: the file states the mode `{}`, and --mode {} contradicts it; omit the option",
                path.display(),
                stated.name(),
                requested.name()
            ))),
            (stated, requested) => Ok(stated.or(requested).unwrap_or(Mode::Exact)),
        }
    }

    /// Returns the images with their volume, for a mesh.
    ///
    /// # Errors
    /// Files without the images along all three axes.
    pub fn imaged(&self, path: &Path, mode: Mode) -> Result<Imaged<'_>, Error> {
        if self.images.len() < 3 {
            let axes: Vec<&str> = self.images.iter().map(|image| image.axis().name()).collect();
            return Err(Error::input(format!(
                "{}: a mesh needs images along all three axes; the file holds {} only; sample with --axis all",
                path.display(),
                axes.join(" and ")
            )));
        }
        let volume = VolumeEstimate::from_axes(&self.images.iter().map(AxisVolume::of).collect::<Vec<_>>());
        Ok(Imaged { volume: Some(volume), ..self.as_they_are(mode) })
    }

    /// Returns the images without a volume, for outputs that need no surface.
    pub fn as_they_are(&self, mode: Mode) -> Imaged<'_> {
        Imaged {
            images: &self.images,
            normals: self.normals.as_deref(),
            mode,
            unit: self.unit,
            volume: None,
            memory: None,
            finer: None,
        }
    }

    /// Returns warnings if the images are not those of one closed solid: some rays did not close, or images that count as exact disagree
    /// about nodes. `report` is that of their mesh, if there is one.
    pub fn doubts(&self, path: &Path, mode: Mode, report: Option<&SurfaceReport>) -> Vec<Warning> {
        let path = path.display();
        let unclosed = self
            .images
            .iter()
            .map(|image| format!("{} of {} along {}", image.unclosed().len(), image.rays(), image.axis().name()));
        let unclosed: Vec<String> = unclosed.collect();
        let is_open = self.images.iter().any(|image| !image.unclosed().is_empty());
        let open = is_open.then(|| {
            let rays = unclosed.join(", ");
            Warning::new("open", format!("{path}: rays that did not close count as empty: {rays}"))
        });
        let of_nodes = || NodePlanes::new(&self.images, mode).ok()?.disagreements().map(|(count, _)| count);
        let disagreements = match report.and_then(SurfaceReport::sampled) {
            _ if mode != Mode::Exact => 0,
            Some(report) => report.disagreements,
            None => of_nodes().unwrap_or(0),
        };
        let disagree = (disagreements > 0).then(|| {
            let message = format!(
                "{path}: the images along different axes disagree about {disagreements} lattice nodes, so they are not exact images \
                 of one closed solid; at each of these nodes a mesh follows the majority",
            );
            Warning::new("images-disagree", message)
        });
        open.into_iter().chain(disagree).collect()
    }
}
