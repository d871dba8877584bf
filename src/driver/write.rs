//! Writes images, or the mesh or voxels computed from them.

use std::io;

use super::job::{Content, ImageTarget};
use super::output;
use super::surface::{self, Imaged, SurfaceReport};
use crate::ldi::NodePlanes;
#[cfg(feature = "npz")]
use crate::ldi::npz::{self, Extras};
use crate::mesh::LengthUnit;
use crate::progress::Monitor;
#[cfg(feature = "npz")]
use crate::voxels;
use crate::{Error, Warning};

/// Writes images along one or more axes, or the mesh or voxels computed from them. Returns the report of a mesh, and warnings.
pub fn images(
    target: &ImageTarget,
    imaged: &Imaged,
    progress: &Monitor,
) -> Result<(Option<SurfaceReport>, Vec<Warning>), Error> {
    let unit = imaged.unit.map(LengthUnit::symbol);
    progress.stage("writing")?;
    match target.content {
        Content::Mesh(finish) => {
            let (report, warnings) = surface::write(imaged, &target.path, finish, progress)?;
            Ok((Some(report), warnings))
        }
        #[cfg(feature = "npz")]
        Content::Images => {
            let normals = imaged.images.iter().map(|image| npz::normals_of_samples(image, imaged.normals?));
            let (unit, mode) = (unit.map(str::to_owned), Some(imaged.mode));
            let extras = Extras { normals: normals.collect(), unit, mode };
            output::replace(&target.path, |file| npz::write(imaged.images, &extras, file).map_err(io::Error::from))?;
            Ok((None, Vec::new()))
        }
        #[cfg(feature = "npz")]
        Content::Voxels(format) => {
            let nodes = NodePlanes::new(imaged.images, imaged.mode).map_err(Error::input)?;
            let mut written = voxels::Written::default();
            output::replace(&target.path, |file| {
                written = match format {
                    voxels::Format::Vti => voxels::write_vti(&nodes, unit, file)?,
                    voxels::Format::Npy => voxels::write_npy(&nodes, file)?,
                };
                Ok(())
            })?;
            let [x, y, z] = nodes.grid().rays();
            let voxels::Written { inside, disagreements } = written;
            progress.detail(format_args!(
                "{x} × {y} × {z} voxels, of which {inside} are inside; the images disagree about {disagreements}"
            ));
            Ok((None, Vec::new()))
        }
    }
}
