//! Whether the two fill rules see the same solid in a mesh.

use super::input::Solid;
use crate::grid::{Axis, Grid, LOD_RANGE};
use crate::integrate;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, Sampler};
use crate::{Error, Warning};

/// Rays along the longest side of the solid; enough to tell a tenth of a percent, as both rules are asked on the same rays.
const RESOLUTION: u32 = 128;

/// Differences above this share of the larger volume are told.
const NOTEWORTHY: f64 = 1e-3;

/// The volumes that the two rules give on the same rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillDifference {
    /// Volume under the even-odd rule.
    pub even_odd: f64,
    /// Volume under the non-zero rule.
    pub non_zero: f64,
}

impl FillDifference {
    /// Compares the rules on a coarse raster; nothing for a solid whose winding numbers mean nothing.
    ///
    /// It is always the CPU that does it: it is done with so few rays before a GPU has compiled its shaders for them.
    pub fn of(solid: &Solid) -> Result<Option<FillDifference>, Error> {
        let Ok(grid) = Grid::with_resolution(solid.bounds(), RESOLUTION, *LOD_RANGE.start()) else { return Ok(None) };
        if !solid.is_oriented() {
            return Ok(None);
        }
        let lattice = solid.quantise(&grid)?;
        let volume = |fill| {
            CpuSampler::default().sample(&lattice, Axis::Z, Mode::Exact, fill).map(|image| integrate::volume(&image))
        };
        Ok(Some(FillDifference { even_odd: volume(FillRule::EvenOdd)?, non_zero: volume(FillRule::NonZero)? }))
    }

    /// How much the rules differ, as a share of the larger volume.
    pub fn share(&self) -> f64 {
        let largest = self.even_odd.abs().max(self.non_zero.abs());
        if largest == 0.0 { 0.0 } else { (self.even_odd - self.non_zero).abs() / largest }
    }

    /// What to say of it where the rules differ by more than a tenth of a percent.
    pub fn warning(&self, solid: &Solid, fill: FillRule) -> Option<Warning> {
        let FillDifference { even_odd, non_zero } = self;
        let used = match fill {
            FillRule::EvenOdd => "even-odd was used, in which overlaps cancel; --fill nonzero unites them",
            FillRule::NonZero => "nonzero was used, in which overlaps unite",
        };
        (self.share() > NOTEWORTHY).then(|| {
            let message = format!(
                "{}: shells overlap, and the fill rules differ by {:.2} %: on a coarse raster even-odd gives a volume of about \
                 {even_odd:.3e}, nonzero {non_zero:.3e}; {used}",
                solid.name(),
                100.0 * self.share(),
            );
            Warning::new("fill-rules-differ", message)
        })
    }
}
