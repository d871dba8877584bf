//! Whether the two fill rules see the same solid in a mesh.

use ldi_ops::grid::{Axis, Grid, LatticeSolid};
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

/// The volumes that the two rules give on a coarse raster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillDifference {
    pub even_odd: f64,
    pub non_zero: f64,
}

impl FillDifference {
    /// Compares the rules on a solid; nothing for one whose winding numbers mean nothing, or for which they are known to
    /// agree. `sampled` is a volume of it by the rule `fill`, where one is known.
    ///
    /// The mesh's own volume counts every point as often as shells wind around it, the even-odd rule only where that is
    /// odd, the non-zero rule once. Where the mesh's own volume is that of an image, no shells overlap, unless others
    /// turned inside out happen to make up for it.
    pub fn of(solid: &Solid, sampled: Option<f64>, fill: Fill) -> Result<Option<FillDifference>, Failure> {
        // A point that two shells wind around is missing twice from the volume by even-odd, and once by non-zero. Half of
        // the share is left for the error of the image.
        let telling = match fill {
            Fill::EvenOdd => NOTEWORTHY,
            Fill::NonZero => 0.5 * NOTEWORTHY,
        };
        let is_own = |sampled: f64| (sampled - solid.volume).abs() <= telling * solid.volume;
        if !solid.is_oriented() || sampled.is_some_and(is_own) {
            return Ok(None);
        }
        let Ok(grid) = Grid::with_resolution(solid.bounds(), RESOLUTION, 1024) else { return Ok(None) };
        let lattice = solid.quantise(&grid)?;
        let image = CpuSampler::default().sample_surface(&lattice, Axis::Z, Fill::EvenOdd)?;
        let volume = |length: i64| grid.pitch() * grid.pitch() * grid.step() * length as f64;
        let lengths = lengths(&lattice, &image);
        Ok(Some(FillDifference { even_odd: volume(lengths[0]), non_zero: volume(lengths[1]) }))
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
                 {non_zero:.6} (on a coarse raster); {used}",
                solid.name(),
                100.0 * self.share(),
            );
            Warning::new("fill-rules-differ", message)
        })
    }
}

/// The inside lengths by even-odd and by non-zero, in lattice steps, of an exact even-odd image along z: it holds every
/// crossing, and the triangle of each tells which way it goes.
fn lengths(lattice: &LatticeSolid, image: &Ldi) -> [i64; 2] {
    let triangles = image.triangles().expect("the image was sampled with triangles");
    let on_ray = |ray: u32| {
        let start = image.offsets()[ray as usize] as usize;
        let (mut winding, mut before, mut sums) = (0i32, 0, [0i64; 2]);
        for (i, &depth) in image.samples(ray).iter().enumerate() {
            let length = i64::from(depth - before);
            sums[0] += if i % 2 == 1 { length } else { 0 };
            sums[1] += if winding != 0 { length } else { 0 };
            winding += winding_step(lattice, triangles[start + i]);
            before = depth;
        }
        sums
    };
    (0..image.rays()).into_par_iter().map(on_ray).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// +1 where a ray along z enters through a triangle, −1 where it leaves.
fn winding_step(lattice: &LatticeSolid, triangle: u32) -> i32 {
    let [a, b, c] = lattice.triangles()[triangle as usize].map(|v| lattice.positions()[v as usize].map(i64::from));
    let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    // The normal of a triangle that is counter-clockwise in x and y points along z, so a ray leaves there.
    -turn.signum() as i32
}
