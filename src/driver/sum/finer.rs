//! Images of the last step of a sum on finer rays, for the parts of its mesh that need them.

use crate::Error;
use crate::fixed::TriangleHit;
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::TooManySamples;
use crate::minkowski::ball::{BallMembership, BallPatches, BallProbe};
use crate::minkowski::{Exterior, Polyhedron, Primitives, RaySpans, SumMembership, images_in_box};
use crate::surface::{FineImages, FineSampler};

/// The solids of a step, for its images on finer rays. Trees and patches are made anew where such are needed.
#[derive(Clone, Debug)]
pub struct FinerSum {
    pub(super) exterior: Exterior,
    pub(super) parts: Parts,
}

/// The solids of a sum on its lattice.
#[derive(Clone, Debug)]
pub(super) enum Parts {
    /// Two solids, and the primitives that cover the boundary of their sum.
    OfPair { primitives: Primitives, solids: [Polyhedron; 2] },
    /// A solid that is offset by a radius in lattice steps.
    OfBall {
        solid: Polyhedron,
        /// The same with both sides of its facets, if its patches are those of both.
        two_sided: Option<Polyhedron>,
        radius: f64,
    },
}

impl FinerSum {
    /// Returns the number of primitives, or about that of patches.
    pub(crate) fn triangles(&self) -> usize {
        match &self.parts {
            Parts::OfPair { primitives, .. } => primitives.triangles.len(),
            // A triangle, and its share of edges and vertices.
            Parts::OfBall { solid, two_sided, .. } => 3 * two_sided.as_ref().unwrap_or(solid).triangles().len(),
        }
    }

    /// Returns a sampler of exact images, with the triangles that those on a grid have, or with normals of their own. The images are
    /// small, and the bits are those of any device. There are none where rays contradict one another.
    ///
    /// # Errors
    /// An image with too many samples.
    pub(crate) fn sampler(&self, grid: Grid) -> Result<FineSampler<'_, Error>, Error> {
        let exterior = self.exterior;
        Ok(match &self.parts {
            Parts::OfPair { primitives, solids: [a, b] } => {
                let membership = SumMembership::new(a, exterior, b);
                let primitives = LatticeSolid::of_primitives(&grid, &primitives.positions, &primitives.triangles);
                Box::new(move |fine| {
                    let along = |axis| RaySpans::of_primitives_in_box(&primitives, fine, axis, exterior);
                    let images = spans(along).and_then(|spans| images_in_box(fine, spans, exterior, &membership));
                    Ok(images.map_err(Error::machine)?.map(|images| FineImages { images, normals: None }))
                })
            }
            Parts::OfBall { solid, two_sided, radius } => {
                let patches = BallPatches::new(two_sided.as_ref().unwrap_or(solid), *radius);
                let probe = BallProbe::new(BallMembership::between_rays(&grid, solid, *radius, exterior)?, solid);
                Box::new(move |fine| {
                    let along = |axis| patches.spans_in_box(&grid, fine, axis, exterior);
                    let images = spans(along).and_then(|spans| images_in_box(fine, spans, exterior, &probe));
                    let Some(images) = images.map_err(Error::machine)? else { return Ok(None) };
                    let (images, normals) = patches.sample_normals_from(fine.origin(), images).map_err(Error::input)?;
                    Ok(Some(FineImages { images, normals: Some(normals) }))
                })
            }
        })
    }
}

/// Returns the spans along x, y and z.
fn spans(
    along: impl Fn(Axis) -> Result<RaySpans<TriangleHit>, TooManySamples>,
) -> Result<[RaySpans<TriangleHit>; 3], TooManySamples> {
    Ok([along(Axis::X)?, along(Axis::Y)?, along(Axis::Z)?])
}
