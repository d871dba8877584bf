//! Orientation and overlap of a solid's shells, on which its sums depend.
//!
//! A sum assumes that the solid lies behind each triangle. Where the winding number is −1, its result is wrong; where it is 2 or
//! more, shells overlap, and the sum unites them. Real meshes have folds and overlaps that are too small to matter. So shares of
//! the volume decide, on a raster that resolves a thousandth.

use crate::Error;
use crate::driver::input::Solid;
use crate::grid::{Axis, Grid, LOD_RANGE, LatticeSolid};
use crate::ldi::Ldi;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::{FillRule, Sampler};

/// Rays along the longest side of the solid.
const RESOLUTION: u32 = 192;

/// Share of the volume up to which negative or multiple winding numbers are ignored, as in [`super::super::fill`].
const NOTEWORTHY: f64 = 1e-3;

/// The orientation of the shells of a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shells {
    /// The solid lies behind every triangle.
    Outwards,
    /// The solid lies before every triangle.
    Inwards,
    /// Some shells face outwards, others inwards without a shell around them.
    Mixed,
}

/// Lengths of rays, in lattice steps, by the winding number there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Windings {
    positive: i64,
    negative: i64,
    /// The length with a winding number beyond ±1.
    multiple: i64,
}

impl Windings {
    /// Returns the lengths along all axes.
    pub fn of(solid: &Solid) -> Result<Windings, Error> {
        let mut windings = Windings::default();
        // A box that fits no grid is an error later, when the grid of the sum is laid.
        let Ok(grid) = Grid::with_resolution(solid.bounds(), RESOLUTION, *LOD_RANGE.start()) else {
            return Ok(windings);
        };
        let lattice = solid.quantise(&grid)?;
        let normals = lattice.normals();
        for axis in Axis::ALL {
            windings.add_image(&crossings(&lattice, axis)?, |triangle| {
                // A ray enters through triangles that face against it.
                if normals[triangle as usize][axis.depth()] < 0.0 { 1 } else { -1 }
            });
        }
        Ok(windings)
    }

    fn add_image(&mut self, image: &Ldi, winding_of: impl Fn(u32) -> i64) {
        let triangles = image.triangles().expect("the image was sampled with triangles");
        for ends in image.offsets().windows(2) {
            let ray = ends[0] as usize..ends[1] as usize;
            let (mut winding, mut last) = (0, 0);
            for (&depth, &triangle) in image.depths()[ray.clone()].iter().zip(&triangles[ray]) {
                self.add(winding, i64::from(depth - last));
                winding += winding_of(triangle);
                last = depth;
            }
        }
    }

    fn add(&mut self, winding: i64, length: i64) {
        match winding.signum() {
            1 => self.positive += length,
            -1 => self.negative += length,
            _ => {}
        }
        if winding.abs() > 1 {
            self.multiple += length;
        }
    }

    /// Returns the orientation of the shells; `signed_volume` decides if no ray met any.
    pub fn shells(&self, signed_volume: f64) -> Shells {
        let total = self.positive + self.negative;
        let is_noteworthy = |length: i64| length as f64 > NOTEWORTHY * total as f64;
        match (is_noteworthy(self.positive), is_noteworthy(self.negative)) {
            (true, true) => Shells::Mixed,
            (false, true) => Shells::Inwards,
            (false, false) if signed_volume < 0.0 => Shells::Inwards,
            _ => Shells::Outwards,
        }
    }

    /// Returns whether the rays met windings of one sign alone, so that the signed volume of the mesh, as far as these rays tell, is
    /// at least that of the solid.
    pub fn are_of_one_sign(&self) -> bool {
        (self.positive == 0) != (self.negative == 0)
    }

    /// Returns the least volume of the solid by the signed one of its mesh: none unless the rays met windings of one sign alone, and no
    /// multiple ones; a share that they may miss is left.
    pub fn least_volume(&self, signed_volume: f64) -> f64 {
        let are_single = self.are_of_one_sign() && self.multiple == 0;
        if are_single { (1.0 - NOTEWORTHY) * signed_volume.abs() } else { 0.0 }
    }

    /// Returns the share of the solid in which shells overlap, if it is large enough to matter to a sum.
    pub fn overlap(&self) -> Option<f64> {
        let share = self.share_of_overlaps();
        (share > NOTEWORTHY).then_some(share)
    }

    /// Returns the share of the solid in which shells overlap, however small.
    pub fn share_of_overlaps(&self) -> f64 {
        self.multiple as f64 / (self.positive + self.negative).max(1) as f64
    }
}

/// Returns the image of every crossing, for any fill rule.
fn crossings(lattice: &LatticeSolid, axis: Axis) -> Result<Ldi, Error> {
    Ok(CpuSampler::default().sample_surface(lattice, axis, FillRule::EvenOdd)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_by_winding_number_give_the_orientation_of_shells() {
        let of = |lengths: &[(i64, i64)]| {
            let mut windings = Windings::default();
            lengths.iter().for_each(|&(winding, length)| windings.add(winding, length));
            windings
        };
        assert_eq!(of(&[(0, 500), (1, 1000), (-1, 1)]).shells(1.0), Shells::Outwards);
        assert_eq!(of(&[(1, 1), (-1, 1000)]).shells(-1.0), Shells::Inwards);
        assert_eq!(of(&[(1, 10), (-1, 1000)]).shells(-1.0), Shells::Mixed);
        assert_eq!(of(&[]).shells(-1.0), Shells::Inwards);
        assert_eq!(of(&[]).shells(0.0), Shells::Outwards);
        assert_eq!(of(&[(1, 1000), (2, 1)]).overlap(), None);
        assert_eq!(of(&[(1, 750), (2, 250)]).overlap(), Some(0.25));
        assert_eq!(of(&[(-1, 750), (-2, 250)]).overlap(), Some(0.25));
        assert!(of(&[(-1, 750), (-2, 250)]).are_of_one_sign() && !of(&[(1, 1000), (-1, 1)]).are_of_one_sign());
        assert!(!of(&[]).are_of_one_sign());
        assert_eq!(of(&[(-1, 750)]).least_volume(-1.0), 1.0 - NOTEWORTHY);
        assert_eq!(
            [&[(-1, 750), (-2, 250)], &[(1, 1), (-1, 1)]].map(|lengths| of(lengths).least_volume(-1.0)),
            [0.0; 2]
        );
    }
}
