//! Files that are made of images.

use std::io;

use super::job::{Content, ImageTarget};
use super::output;
use super::surface::{self, Imaged, SurfaceReport};
#[cfg(feature = "npz")]
use crate::ldi::npz::{self, Extras, ImageMode};
use crate::ldi::{Combine, NodePlanes};
use crate::mesh::LengthUnit;
use crate::progress::Monitor;
use crate::sampler::{Estimate, Mode};
#[cfg(feature = "npz")]
use crate::voxels;
use crate::{Error, Warning};

/// Writes images along one axis or several, or what is made of them; of a mesh it tells what it came to.
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
            let (unit, mode) = (unit.map(str::to_owned), Some(image_mode(imaged.mode)));
            let extras = Extras { normals: normals.collect(), unit, mode };
            output::replace(&target.path, |file| npz::write(imaged.images, &extras, file).map_err(io::Error::from))?;
            Ok((None, Vec::new()))
        }
        #[cfg(feature = "npz")]
        Content::Voxels(format) => {
            let nodes = NodePlanes::new(imaged.images, combine(imaged.mode)).map_err(Error::input)?;
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

/// What files call a mode.
#[cfg(feature = "npz")]
pub fn image_mode(mode: Mode) -> ImageMode {
    match mode {
        Mode::Exact => ImageMode::Exact,
        Mode::Estimate(Estimate::Over) => ImageMode::Over,
        Mode::Estimate(Estimate::Under) => ImageMode::Under,
    }
}

/// The mode that files call so.
#[cfg(feature = "npz")]
pub fn mode(mode: ImageMode) -> Mode {
    match mode {
        ImageMode::Exact => Mode::Exact,
        ImageMode::Over => Mode::Estimate(Estimate::Over),
        ImageMode::Under => Mode::Estimate(Estimate::Under),
    }
}

/// What holds of a node about which images disagree: an over-estimate stays one, and so does an under-estimate.
pub(crate) fn combine(mode: Mode) -> Combine {
    match mode {
        Mode::Estimate(Estimate::Over) => Combine::Any,
        Mode::Estimate(Estimate::Under) => Combine::All,
        Mode::Exact => Combine::Most,
    }
}
