//! `surface`: from images in a file back to a mesh.

use std::io::{Read, Seek};
use std::path::Path;

use super::surface::{Imaged, SurfaceReport};
use crate::integrate::{AxisVolume, VolumeEstimate};
use crate::ldi::Ldi;
use crate::ldi::npz::{self, Normals, NpzError};
use crate::mesh::LengthUnit;
use crate::sampler::Mode;
use crate::unit;
use crate::{Error, Warning};

/// Images that were read from a file, and what came with them.
pub struct ImageFile {
    /// The images, one to three.
    pub images: Vec<Ldi>,
    /// Of the triangles that images refer to, one for each sample; nothing where none are known.
    pub normals: Option<Normals>,
    /// The unit that the file states.
    pub unit: Option<LengthUnit>,
    /// The mode that the file states.
    pub mode: Option<Mode>,
    /// Remarks of the reader.
    pub warnings: Vec<Warning>,
}

impl ImageFile {
    /// Reads a file; its name stands in errors.
    pub fn read(from: impl Read + Seek, path: &Path) -> Result<ImageFile, Error> {
        let failure = |error: NpzError| Error::input(format!("{}: {error}", path.display()));
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
    pub fn mode(&self, path: &Path, asked: Option<Mode>) -> Result<Mode, Error> {
        match (self.mode, asked) {
            (Some(stated), Some(asked)) if asked != stated => Err(Error::input(format!(
                "{}: the images are stated to be `{}`, and --mode {} contradicts that; leave --mode away",
                path.display(),
                stated.name(),
                asked.name()
            ))),
            (stated, asked) => Ok(stated.or(asked).unwrap_or(Mode::Exact)),
        }
    }

    /// What a mesh is made of, if all three images are there.
    pub fn imaged(&self, path: &Path, mode: Mode) -> Result<Imaged<'_>, Error> {
        if self.images.len() < 3 {
            let axes: Vec<&str> = self.images.iter().map(|image| image.axis().name()).collect();
            return Err(Error::input(format!(
                "{}: a mesh is made of images along all three axes, and there are {} alone",
                path.display(),
                axes.join(" and ")
            )));
        }
        let volume = VolumeEstimate::from_axes(&self.images.iter().map(AxisVolume::of).collect::<Vec<_>>());
        Ok(Imaged { volume: Some(volume), ..self.as_they_are(mode) })
    }

    /// Returns the images as they are, for files that need no surface.
    pub fn as_they_are(&self, mode: Mode) -> Imaged<'_> {
        Imaged { images: &self.images, normals: self.normals.as_deref(), mode, unit: self.unit, volume: None }
    }
}

/// Says that images are not exact although they are taken so: of exact ones all agree about every node.
pub fn images_disagree(path: &Path, mode: Mode, report: &SurfaceReport) -> Option<Warning> {
    let message = format!(
        "{}: the images along different axes disagree about {} lattice nodes, which exact images of one closed solid do not; \
         of two that agree the mesh has what they say",
        path.display(),
        report.disagreements
    );
    (mode == Mode::Exact && report.disagreements > 0).then(|| Warning::new("images-disagree", message))
}
