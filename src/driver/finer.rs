//! Images of a measured result on finer rays, for the parts of its mesh that need them.

use super::image::{ImageMaker, Triangles};
use super::input::Solid;
use super::job::Measurement;
use super::measured::Seconds;
use crate::Error;
use crate::grid::{Grid, LatticeSolid};
use crate::ldi::Ldi;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode};
use crate::surface::FineRays;

/// The solids of a result, which can be sampled again.
#[derive(Clone, Copy)]
pub struct Finer<'a> {
    /// The result.
    pub measurement: &'a Measurement,
    /// Its inputs.
    pub solids: &'a [Solid],
    /// The fill rule.
    pub fill: FillRule,
}

impl<'a> Finer<'a> {
    /// Returns the inputs on the grid of the images that they were sampled to.
    pub fn lattices(&self, grid: &Grid) -> Result<Vec<LatticeSolid<'a>>, Error> {
        self.solids.iter().map(|solid| solid.quantise(grid)).collect()
    }

    /// Returns the exact image of the result on finer rays, with the triangles of its samples.
    pub fn image(&self, lattices: &[LatticeSolid], rays: &FineRays) -> Result<Ldi, Error> {
        let finer = lattices.iter().map(|lattice| rays.solid(lattice)).collect::<Result<Vec<_>, _>>();
        let mut maker = ImageMaker {
            // The images are small, and the bits are those of any device.
            sampler: &CpuSampler::default(),
            axis: rays.axis,
            mode: Mode::Exact,
            fill: self.fill,
            triangles: Triangles::Wanted,
            seconds: &mut Seconds::default(),
            rules_agree: &mut vec![None; self.solids.len()],
        };
        maker.image(self.measurement, &finer.map_err(Error::input)?)
    }
}
