//! Conversion of primitives to certain spans, and of resolved spans to images.

use super::{Exterior, Primitives, RaySpans};
use crate::fixed::Hit;
use crate::grid::{Axis, Grid, LatticeSolid};
use crate::ldi::{Ldi, TooManySamples};
use crate::sampler::Mode;
use crate::sampler::cpu::CpuSampler;
use crate::sampler::lists::{ListSampler, RayLists};

impl Primitives {
    /// Computes the certain spans with all possible gaps of the rays along an axis, and the number of crossings. The result is
    /// the same for every sampler.
    pub fn spans<H: Hit, S: ListSampler>(
        &self,
        grid: &Grid,
        axis: Axis,
        exterior: Exterior,
        sampler: &S,
    ) -> Result<(RaySpans<H>, u64), S::Error> {
        let triangles = LatticeSolid::of_primitives(grid, &self.positions, &self.triangles);
        let lists = sampler.crossings(&triangles, axis, exterior.keep())?;
        Ok((RaySpans { axis, offsets: lists.offsets, hits: lists.hits }, lists.crossings))
    }

    /// Returns the sorted crossings of each ray that `keep` keeps.
    pub(super) fn lists<H: Hit>(
        &self,
        grid: &Grid,
        axis: Axis,
        sampler: &CpuSampler,
        keep: impl Fn(&[H], &mut Vec<H>) + Sync,
    ) -> Result<RayLists<H>, TooManySamples> {
        let triangles = LatticeSolid::of_primitives(grid, &self.positions, &self.triangles);
        sampler.lists(&triangles, axis, keep)
    }

    /// Returns the unit normal of each triangle, outwards, in world axes; zero for a triangle without area.
    pub fn normals(&self, grid: &Grid) -> Vec<[f32; 3]> {
        LatticeSolid::of_primitives(grid, &self.positions, &self.triangles).normals()
    }
}

impl<H: Hit + Sync> RaySpans<H> {
    /// Returns the image of the spans, or with [`Exterior::In`] that of their gaps: of the complement, which is bounded. Exact
    /// images of hits that record their triangles have them.
    pub fn image(&self, grid: &Grid, mode: Mode, sampler: &CpuSampler) -> Result<Ldi, TooManySamples> {
        sampler.image_of_lists(grid, self.axis, mode, |ray| self.of_ray(ray))
    }
}
