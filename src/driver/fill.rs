//! Comparison of the volumes that the two fill rules give a mesh.

use super::input::Solid;
use crate::exact;
use crate::grid::{Axis, Grid, LOD_RANGE};
use crate::integrate;
use crate::number::number;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Mode, Sampler};
use crate::{Error, Warning};

/// Rays along the longest side of the solid. Both rules use the same rays, so these resolve differences of 0.1 %.
const RESOLUTION: u32 = 128;

/// Difference, as a share of the larger volume, above which there is a warning.
const NOTEWORTHY: f64 = 1e-3;

/// The code of the warning about a surface of which parts are inside out.
pub const PARTS_INSIDE_OUT: &str = "parts-inside-out";

/// The volumes that the two rules give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillDifference {
    /// True if the volumes are exact; otherwise they are those on the same rays of a coarse raster.
    pub is_exact: bool,
    /// Volume under the even-odd rule.
    pub even_odd: f64,
    /// Volume under the non-zero rule.
    pub non_zero: f64,
}

impl FillDifference {
    /// Returns the volumes under both rules on a coarse raster; `None` for a mesh that is not oriented or that no grid fits.
    ///
    /// The CPU always samples here: it finishes so few rays before a GPU has compiled its shaders.
    pub fn of(solid: &Solid) -> Result<Option<FillDifference>, Error> {
        let Ok(grid) = Grid::with_resolution(solid.bounds(), RESOLUTION, *LOD_RANGE.start()) else { return Ok(None) };
        if !solid.was_oriented() {
            return Ok(None);
        }
        let lattice = solid.quantise(&grid)?;
        let volume = |fill| {
            CpuSampler::default().sample(&lattice, Axis::Z, Mode::Exact, fill).map(|image| integrate::volume(&image))
        };
        let (even_odd, non_zero) = (volume(FillRule::EvenOdd)?, volume(FillRule::NonZero)?);
        Ok(Some(FillDifference { is_exact: false, even_odd, non_zero }))
    }

    /// Returns the exact volumes under both rules, or else [those on a raster](FillDifference::of).
    pub fn exact(solid: &Solid) -> Result<Option<FillDifference>, Error> {
        // The non-zero rule is not defined for a mesh whose triangles were turned.
        match solid.closed().filter(|_| solid.was_oriented()).and_then(|mesh| exact::volumes_of_solid(mesh).ok()) {
            Some([even_odd, non_zero]) => Ok(Some(FillDifference { is_exact: true, even_odd, non_zero })),
            None => FillDifference::of(solid),
        }
    }

    /// Returns the difference of the volumes, as a share of the larger one.
    pub fn share(&self) -> f64 {
        let largest = self.even_odd.abs().max(self.non_zero.abs());
        if largest == 0.0 { 0.0 } else { (self.even_odd - self.non_zero).abs() / largest }
    }

    /// Returns a warning if the rules differ by more than 0.1 %, or if they agree on an exact volume from which that of the mesh
    /// falls short by as much.
    pub fn warning(&self, solid: &Solid, fill: FillRule) -> Option<Warning> {
        let of_mesh = solid.volume.abs();
        if self.share() <= NOTEWORTHY {
            // What overlaps counts several times in the mesh, and more than in the solid; only parts that are inside out count less.
            let is_less = self.is_exact && of_mesh < (1.0 - NOTEWORTHY) * self.even_odd.min(self.non_zero);
            return is_less.then(|| {
                let message = format!(
                    "{}: parts of the surface are inside out and count against the mesh volume of {}; the volume is {}",
                    solid.name(),
                    number(solid.volume),
                    number(if fill == FillRule::EvenOdd { self.even_odd } else { self.non_zero }),
                );
                Warning::new(PARTS_INSIDE_OUT, message)
            });
        }
        let &FillDifference { is_exact, even_odd, non_zero } = self;
        let used = match fill {
            FillRule::EvenOdd => "even-odd was used, in which overlaps cancel; --fill nonzero unites them",
            FillRule::NonZero => "nonzero was used, in which overlaps unite",
        };
        let volumes = match is_exact {
            true => format!("even-odd gives a volume of {}, nonzero {}", number(even_odd), number(non_zero)),
            false => {
                format!("on a coarse raster even-odd gives a volume of about {even_odd:.3e}, nonzero {non_zero:.3e}")
            }
        };
        let message = format!(
            "{}: shells overlap, and the fill rules differ by {:.2} %: {volumes}; {used}",
            solid.name(),
            100.0 * self.share(),
        );
        Some(Warning::new("fill-rules-differ", message))
    }
}
