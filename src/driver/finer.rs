//! Images of a result on finer rays, for the parts of its mesh that need them.

use super::image::{ImageMaker, Triangles};
use super::input::Solid;
use super::job::Measurement;
use super::measured::Seconds;
use super::sum::FinerSum;
use crate::Error;
use crate::grid::{Axis, FineBox, Grid, LatticeSolid};
use crate::ldi::Ldi;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode};
use crate::surface::{FineImages, FineSampler};

/// A result that can be sampled again.
#[derive(Clone, Copy)]
pub enum Finer<'a> {
    /// A measurement of solids.
    Measured { measurement: &'a Measurement, solids: &'a [Solid], fill: FillRule },
    /// A sum, a difference or an offset.
    Sum(&'a FinerSum),
}

impl<'a> Finer<'a> {
    /// Returns the number of triangles that the sampler looks at.
    pub(crate) fn triangles(self) -> usize {
        match self {
            Finer::Measured { solids, .. } => solids.iter().map(|solid| solid.mesh().triangles.len()).sum(),
            Finer::Sum(sum) => sum.triangles(),
        }
    }

    /// Returns the sampler of a result whose images lie on a grid.
    pub(crate) fn sampler(self, grid: &Grid) -> Result<FineSampler<'a, Error>, Error> {
        match self {
            Finer::Measured { measurement, solids, fill } => {
                let lattices = solids.iter().map(|solid| solid.quantise(grid)).collect::<Result<Vec<_>, Error>>()?;
                Ok(Box::new(move |fine| {
                    let along = |axis| image((measurement, &lattices, fill), axis, fine);
                    let images = [along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?];
                    Ok(Some(FineImages { images, normals: None }))
                }))
            }
            Finer::Sum(sum) => sum.sampler(*grid),
        }
    }
}

/// Returns the exact image of a measurement along an axis in a box, with the triangles of its samples.
fn image(
    (measurement, lattices, fill): (&Measurement, &[LatticeSolid], FillRule),
    axis: Axis,
    fine: &FineBox,
) -> Result<Ldi, Error> {
    let solids: Vec<LatticeSolid> = lattices.iter().map(|lattice| lattice.along(axis, fine)).collect();
    let mut maker = ImageMaker {
        // The images are small, and the bits are those of any device.
        sampler: &CpuSampler::default(),
        axis,
        mode: Mode::Exact,
        fill,
        triangles: Triangles::Wanted,
        seconds: &mut Seconds::default(),
        rules_agree: &mut vec![None; solids.len()],
    };
    Ok(maker.image(measurement, &solids)?.in_box(fine))
}
