//! Whether the two fill rules see the same solid in a mesh.

use ldi_ops::grid::{Axis, Grid, LOD_RANGE, LatticeSolid};
use ldi_ops::ldi::Ldi;
use ldi_ops::sampler::cpu::CpuSampler;
use ldi_ops::sampler::{Fill, Sampler};
use rayon::prelude::*;

use super::Solid;
use crate::exit::Failure;
use crate::report::Warning;

/// Rays along the longest side of the solid; enough to tell a tenth of a percent, as both rules are asked on the same rays.
const RESOLUTION: u32 = 128;

/// Differences above this share of the larger volume are told.
const NOTEWORTHY: f64 = 1e-3;

/// What sampling a solid on its own told of it on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Insight {
    /// It was not sampled on its own.
    Nothing,
    /// Its volume by the rule that was asked for.
    Volume(f64),
    /// Its volumes by both rules.
    Rules(FillDifference),
}

/// The volumes that the two rules give on the same rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillDifference {
    pub even_odd: f64,
    pub non_zero: f64,
}

impl FillDifference {
    /// Compares the rules on a solid; nothing for one whose winding numbers mean nothing, or for which the rules are known
    /// to agree.
    ///
    /// The mesh's own volume counts every point as often as shells wind around it, the even-odd rule only where that is
    /// odd, the non-zero rule once. Where the mesh's own volume is that of an image, no shells overlap, unless others
    /// turned inside out happen to make up for it.
    pub fn of(solid: &Solid, insight: Insight, fill: Fill) -> Result<Option<FillDifference>, Failure> {
        match insight {
            _ if !solid.is_oriented() => return Ok(None),
            Insight::Rules(difference) => return Ok(Some(difference)),
            Insight::Volume(volume) if is_own(volume, solid.volume, fill) => return Ok(None),
            Insight::Volume(_) | Insight::Nothing => {}
        }
        let Ok(grid) = Grid::with_resolution(solid.bounds(), RESOLUTION, *LOD_RANGE.start()) else { return Ok(None) };
        let lattice = solid.quantise(&grid)?;
        let image = CpuSampler::default().sample_surface(&lattice, Axis::Z, Fill::EvenOdd)?;
        Ok(Some(FillDifference::in_image(&lattice, &image)))
    }

    /// Compares the rules on rays of an exact even-odd image with triangles: it holds every crossing, and the triangle of
    /// each tells which way it goes. Of many rays some are taken, evenly.
    pub fn in_image(lattice: &LatticeSolid, image: &Ldi) -> FillDifference {
        let grid = image.grid();
        let (columns, rows) = image.size();
        let stride = columns.max(rows).div_ceil(RESOLUTION);
        let row_lengths = |row: u32| {
            let rays = (stride / 2..columns).step_by(stride as usize).map(|column| row * columns + column);
            rays.map(|ray| lengths(lattice, image, ray)).fold([0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
        };
        let taken: Vec<u32> = (stride / 2..rows).step_by(stride as usize).collect();
        let sums = taken.into_par_iter().map(row_lengths).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let section = (f64::from(stride) * grid.pitch()).powi(2);
        let [even_odd, non_zero] = sums.map(|length| section * grid.step() * length as f64);
        FillDifference { even_odd, non_zero }
    }

    /// How much the rules differ, as a share of the larger volume.
    pub fn share(&self) -> f64 {
        let largest = self.even_odd.abs().max(self.non_zero.abs());
        if largest == 0.0 { 0.0 } else { (self.even_odd - self.non_zero).abs() / largest }
    }

    /// What to say of it where the rules differ by more than a tenth of a percent.
    pub fn warning(&self, solid: &Solid, fill: Fill) -> Option<Warning> {
        let FillDifference { even_odd, non_zero } = self;
        let used = match fill {
            Fill::EvenOdd => "even-odd was used, in which overlaps cancel; --fill nonzero unites them",
            Fill::NonZero => "nonzero was used, in which overlaps unite",
        };
        (self.share() > NOTEWORTHY).then(|| {
            let message = format!(
                "{}: shells overlap, and the fill rules differ by {:.2} %: even-odd gives a volume of {even_odd:.6}, nonzero \
                 {non_zero:.6}; {used}",
                solid.name(),
                100.0 * self.share(),
            );
            Warning::new("fill-rules-differ", message)
        })
    }
}

/// Whether a volume by the rule `fill` is that of the mesh itself, so that no shells overlap by a noteworthy share.
pub fn is_own(volume: f64, own: f64, fill: Fill) -> bool {
    // A point that two shells wind around is missing twice from the volume by even-odd, and once by non-zero. Half of the
    // share is left for the error of the image.
    let telling = match fill {
        Fill::EvenOdd => NOTEWORTHY,
        Fill::NonZero => 0.5 * NOTEWORTHY,
    };
    (volume - own).abs() <= telling * own
}

/// The inside lengths of a ray by even-odd and by non-zero, in lattice steps.
fn lengths(lattice: &LatticeSolid, image: &Ldi, ray: u32) -> [i64; 2] {
    let triangles = image.triangles().expect("the image was sampled with triangles");
    let start = image.offsets()[ray as usize] as usize;
    let (mut winding, mut before, mut sums) = (0i32, 0, [0i64; 2]);
    for (i, &depth) in image.samples(ray).iter().enumerate() {
        let length = i64::from(depth - before);
        sums[0] += if i % 2 == 1 { length } else { 0 };
        sums[1] += if winding != 0 { length } else { 0 };
        winding += winding_step(lattice, triangles[start + i], image.axis());
        before = depth;
    }
    sums
}

/// +1 where a ray along an axis enters through a triangle, −1 where it leaves.
fn winding_step(lattice: &LatticeSolid, triangle: u32, axis: Axis) -> i32 {
    let [a, b, c] = lattice.triangles()[triangle as usize].map(|v| lattice.positions()[v as usize].map(i64::from));
    let (i, j) = ((axis.depth() + 1) % 3, (axis.depth() + 2) % 3);
    let normal = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
    -normal.signum() as i32
}
