//! Images of the last step of a sum on finer rays, for the parts of its mesh that need them.

use std::fmt;

use crate::Error;
use crate::driver::finer::FineSampler;
use crate::fixed::TriangleHit;
use crate::grid::{Axis, FineBox, Grid};
use crate::ldi::TooManySamples;
use crate::minkowski::ball::{BallMembership, BallPatches, BallProbe};
use crate::minkowski::{Exterior, Polyhedron, Primitives, RaySpans, SumMembership, images_in_box};
use crate::sampler::cpu::CpuSampler;
use crate::surface::FineImages;

/// A step that can be sampled again on finer rays: what its images were made from.
pub struct FinerSum {
    pub(super) grid: Grid,
    pub(super) exterior: Exterior,
    pub(super) parts: Parts,
}

/// What covers the boundary of a sum, and the test of its points.
pub(super) enum Parts {
    /// Of a sum of two solids.
    OfPair { primitives: Primitives, membership: SumMembership },
    /// Of an offset.
    OfBall {
        solid: Polyhedron,
        /// The solid with both sides of its facets, if patches cover those.
        two_sided: Option<Polyhedron>,
        radius: f64,
        membership: BallMembership,
    },
}

impl fmt::Debug for FinerSum {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let FinerSum { grid, exterior, .. } = self;
        f.debug_struct("FinerSum").field("grid", grid).field("exterior", exterior).finish_non_exhaustive()
    }
}

impl FinerSum {
    /// Returns a sampler of the step's exact images, with the triangles that its coarse images have, or with normals of their own.
    /// The images are small, and the bits are those of any device. There are none where rays contradict one another.
    pub fn sampler(&self) -> FineSampler<'_> {
        let FinerSum { grid, exterior, parts } = self;
        match parts {
            Parts::OfPair { primitives, membership } => Box::new(move |fine| {
                let sampler = CpuSampler::default();
                let along = |axis| primitives.spans_in_box(grid, fine, axis, *exterior, &sampler);
                let images = spans(along).and_then(|spans| images_in_box(fine, spans, *exterior, membership));
                Ok(images.map_err(Error::machine)?.map(|images| FineImages { images, normals: None }))
            }),
            Parts::OfBall { solid, two_sided, radius, membership } => {
                let patches = BallPatches::new(two_sided.as_ref().unwrap_or(solid), *radius);
                let probe = BallProbe::new(membership, solid);
                Box::new(move |fine: &FineBox| {
                    let along = |axis| patches.spans_in_box(grid, fine, axis, *exterior);
                    let images = spans(along).and_then(|spans| images_in_box(fine, spans, *exterior, &probe));
                    let Some(images) = images.map_err(Error::machine)? else { return Ok(None) };
                    let (images, normals) = patches.sample_normals_from(fine.origin(), images).map_err(Error::input)?;
                    Ok(Some(FineImages { images, normals: Some(normals) }))
                })
            }
        }
    }
}

/// Returns the spans along x, y and z.
fn spans(
    along: impl Fn(Axis) -> Result<RaySpans<TriangleHit>, TooManySamples>,
) -> Result<[RaySpans<TriangleHit>; 3], TooManySamples> {
    Ok([along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?])
}
