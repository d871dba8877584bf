//! Sampling of a quantised solid into its layered depth image: the contract that every backend fulfils to the bit.
//!
//! The method is that of Leung & Wang, "Conservative Sampling of Solids in Image Space", in the cheaper equivalent form
//! of two masks in one geometry pass. Everything below is integer arithmetic on the lattice of the [`Grid`], so an
//! image has one right answer, and thread count, triangle order, band height and backend change no bit of it.
//!
//! # Rays and crossings
//! - All vertices lie on **even** lattice positions; pixel `i` of an axis spans `[i·S, (i+1)·S)` with `S = 2^shift`, and
//!   its ray (or node) position is `i·S + S/2 + 1`, which is **odd**.
//! - The image along an axis has the two other axes, *in increasing order*, as columns and rows: x → (y, z),
//!   y → (x, z), z → (x, y). Ray `row · columns + column` runs in the positive direction of its axis.
//! - Ties are broken by one perturbation of the world: a node at (X, Y, Z) stands for (X + ε₁, Y + ε₂, Z + ε₃) with
//!   ε₁ ≫ ε₂ ≫ ε₃ > 0. A triangle **crosses** a ray when the perturbed ray passes strictly through its projection; a
//!   triangle seen edge-on never does. In all three views the larger perturbation is that of the column axis.
//! - The **depth** `d` of a crossing is the rational number where the unperturbed ray meets the triangle's plane.
//!   `floor` is the largest even integer ≤ d, `ceil` the smallest even integer ≥ d, and `nearest` the even integer
//!   nearest to d. Where d is an odd integer, both neighbours are equally near: `nearest` is d + 1 if the perturbed plane
//!   depth lies above the perturbed node (d' > d + ε of the ray's axis) and d − 1 if below. A node is therefore on the
//!   same side of `nearest` as of the surface itself, and the three images of a solid agree about every node.
//! - A crossing **enters** (winding +1) when the outward normal (b − a) × (c − a) points against the ray, else it
//!   **leaves** (−1). (The view along y is left-handed: the direction comes from the normal in space.)
//! - All vertices lie inside the grid, 2 ≤ shift, and positions are below 2^30.
//!
//! # Images of one solid
//! An image lists for each ray an even number of non-decreasing depths; `[depth 2i, depth 2i+1)` is inside.
//!
//! **Exact**, even-odd: `nearest` of every crossing, sorted; nothing is merged or dropped. Non-zero: crossings are
//! grouped by `nearest`; a group gives one sample when the winding number changes between zero and non-zero over it.
//!
//! **Over** and **under** divide the ray into LOD-C voxels of `V` lattice steps (V even, the least with `LOD-C · V ≥`
//! the length of the axis). A crossing belongs to voxel `min(floor / V, LOD-C − 1)`. Let `in(z)` be the state at the near
//! face of voxel z (the parity of the crossings in voxels before z, or whether their winding sum is non-zero) and
//! `out(z)` that at its far face. A voxel is **touched** when it holds crossings and — under the non-zero rule only — the
//! winding number may be zero somewhere in it, where the order within a group of equal `floor` is unknown: starting from
//! the winding `w` before the group, every value from `w −` (leaving crossings) to `w +` (entering crossings) of the
//! group may occur.
//!
//! | in, out | class | over keeps | under keeps |
//! |---|---|---|---|
//! | 0, 1 | entering | least `floor` | greatest `ceil` |
//! | 1, 0 | leaving | greatest `ceil` | least `floor` |
//! | 0, 0 and touched | entering-leaving | least `floor`, greatest `ceil` | nothing |
//! | 1, 1 and touched | leaving-entering | nothing | least `floor`, greatest `ceil` |
//!
//! where least and greatest run over all crossings in the voxel.
//!
//! A ray whose crossings do not close (odd count; under the non-zero rule a final winding ≠ 0) gets **no samples** and is
//! listed as unclosed. A mesh that passed [`ClosedMesh::check`](crate::mesh::ClosedMesh::check) has none.
//!
//! # Windings
//! The image of an oriented solid by itself comes with the [`Windings`] of all rays that close.
//! - `wound` is −Σ `nearest` · winding over all crossings.
//! - The crossings of a ray are **grouped** by `nearest` in an exact image (with or without triangles), and by voxel in an
//!   estimate. A group of odd count **changes** the parity; the ray starts outside. `changes` counts such groups.
//! - `aligned` adds up, over the same groups, the sum of the windings in the group, taken as it is where the parity becomes
//!   odd over the group and negated where it becomes even.
//! - `unpaired` is −Σ position · winding over the crossings of all other groups, those of even count, where the position is
//!   that of the group: `nearest` in an exact image, the index of the voxel in an estimate.
//!
//! Windings use the parity under either fill rule, so that the rule decides only which rays close. Every sum depends on
//! the set of crossings in each group and not on their order: a mask of the parity of each voxel's crossings shows
//! which voxels change the parity, and its prefix parity in which direction.
//!
//! # Intersection of two solids
//! Exact is the sweep of the two exact images ([`crate::boolean`]). Over and under are found in masks:
//! `in∩ = in_A ∧ in_B`, `out∩ = out_A ∧ out_B`, and with `occ_X(z) = in_X ∨ out_X ∨ touched_X`
//!
//! | in∩, out∩ | class | over keeps | under keeps |
//! |---|---|---|---|
//! | 0, 1 | entering | least `floor` | greatest `ceil` |
//! | 1, 0 | leaving | greatest `ceil` | least `floor` |
//! | 0, 0, occ_A ∧ occ_B | entering-leaving | least `floor`, greatest `ceil` | nothing |
//! | 1, 1, touched_A ∨ touched_B | leaving-entering | nothing | least `floor`, greatest `ceil` |
//!
//! where least and greatest run over the crossings in the voxel of each solid that is touched there. A ray that is
//! unclosed in either solid is unclosed in the intersection.
//!
//! The masks need one geometry pass and no images of the operands, at the cost of tightness: an end may reach back to a
//! crossing of the other solid in the same voxel, so that under∩ ⊆ under_A ∩ under_B ⊆ exact ⊆ over_A ∩ over_B ⊆ over∩,
//! each end within one voxel.

pub mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub(crate) mod layout;
pub(crate) mod lists;
#[doc(hidden)]
pub mod stages;

use crate::diagram::Diagram;
use crate::gpu::DeviceError;
use crate::grid::{Axis, Closure, Grid, LatticeBox, LatticeSolid};
pub use crate::ldi::{Estimate, FillRule, Mode};
use crate::ldi::{Ldi, MomentSums, TooManySamples, VolumeSums, Windings};

/// The reason why an image could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The non-zero fill rule was requested for a closed mesh that is not consistently oriented.
    #[error("the non-zero fill rule needs a consistently oriented mesh; repair the mesh or use even-odd")]
    NotOriented,
    /// Two solids of one operation were quantised on different grids.
    #[error("the two solids lie on different grids (pitch {first:?} and {second:?})")]
    GridsDiffer {
        /// Pitch of the first solid's grid.
        first: f64,
        /// Pitch of the second solid's grid.
        second: f64,
    },
    /// The device failed.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// An image has more samples than it can index.
    #[error(transparent)]
    TooManySamples(#[from] TooManySamples),
}

/// A set expression of images, one image for each of its leaves.
#[derive(Clone, Copy, Debug)]
pub struct Combination<'a> {
    leaves: &'a [(&'a LatticeSolid<'a>, Mode)],
    diagram: &'a Diagram,
}

impl<'a> Combination<'a> {
    /// Combines the images of some leaves, each the solid and the mode of its image, by the diagram of a plan
    /// ([`Plan::diagram`](crate::boolean::Plan::diagram)).
    ///
    /// # Panics
    /// If there are no leaves, fewer than the diagram asks for, or more than [`Diagram::MOST_LEAVES`]; or if points in no leaf
    /// belong to the result.
    pub fn new(leaves: &'a [(&'a LatticeSolid<'a>, Mode)], diagram: &'a Diagram) -> Combination<'a> {
        assert!((diagram.leaves().max(1)..=Diagram::MOST_LEAVES).contains(&leaves.len()), "{} leaves", leaves.len());
        assert!(!diagram.holds(|_| false), "where no leaf is, there is no result");
        Combination { leaves, diagram }
    }

    /// Returns the solid and the mode of the image of each leaf.
    pub fn leaves(&self) -> &'a [(&'a LatticeSolid<'a>, Mode)] {
        self.leaves
    }

    /// Returns the diagram.
    pub fn diagram(&self) -> &'a Diagram {
        self.diagram
    }
}

/// The result of a combination, and the winding sums of the images that it was made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Combined<T> {
    /// The image, or its sums.
    pub result: T,
    /// The winding sums of the image of each leaf, as [`Ldi::windings`] gives them.
    pub windings: Vec<Option<Windings>>,
}

/// The sums over an image from which volume, centroid and inertia follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidSums {
    /// Those for the volume.
    pub volume: VolumeSums,
    /// Those for centroid and inertia.
    pub moments: MomentSums,
}

impl SolidSums {
    /// Sums an image.
    pub fn of(image: &Ldi) -> SolidSums {
        SolidSums { volume: image.volume_sums(), moments: image.moment_sums() }
    }
}

/// Makes layered depth images of solids. Every implementation returns the same bits, those of the contract in this module's
/// docs.
pub trait Sampler {
    /// Returns the image of a solid along `axis`.
    fn sample(&self, solid: &LatticeSolid, axis: Axis, mode: Mode, fill: FillRule) -> Result<Ldi, SampleError>;

    /// Returns the images of a solid along several axes, each once, which a device makes together.
    fn sample_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<Ldi>, SampleError> {
        axes.iter().map(|&axis| self.sample(solid, axis, mode, fill)).collect()
    }

    /// Returns the exact image of a solid, each sample with the triangle that made it ([`Ldi::triangles`]).
    fn sample_surface(&self, solid: &LatticeSolid, axis: Axis, fill: FillRule) -> Result<Ldi, SampleError>;

    /// Returns the sums over the image of [`sample`](Self::sample), for which a device need not transfer the image.
    fn volume_sums(
        &self,
        solid: &LatticeSolid,
        axis: Axis,
        mode: Mode,
        fill: FillRule,
    ) -> Result<VolumeSums, SampleError> {
        Ok(self.sample(solid, axis, mode, fill)?.volume_sums())
    }

    /// Returns the sums over the images along several axes, each once, which a device makes together.
    fn volume_sums_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<VolumeSums>, SampleError> {
        axes.iter().map(|&axis| self.volume_sums(solid, axis, mode, fill)).collect()
    }

    /// Returns all sums over the images of a solid along several axes, each once, which a device makes together.
    fn solid_sums_along(
        &self,
        solid: &LatticeSolid,
        axes: &[Axis],
        mode: Mode,
        fill: FillRule,
    ) -> Result<Vec<SolidSums>, SampleError> {
        axes.iter().map(|&axis| Ok(SolidSums::of(&self.sample(solid, axis, mode, fill)?))).collect()
    }

    /// Returns the image of a combination, without triangles: that which [`Plan::sweep`](crate::boolean::Plan::sweep) makes of the
    /// images of the leaves, but those stay on the device.
    ///
    /// Returns `None` if the sampler has no device, if the device has no room for all leaves at once, or if it is a software
    /// adapter and a ray has too many crossings for it. The caller then samples each leaf and sweeps the images.
    fn sample_combination(
        &self,
        _combination: Combination,
        _axis: Axis,
        _fill: FillRule,
    ) -> Result<Option<Combined<Ldi>>, SampleError> {
        Ok(None)
    }

    /// Returns the sums over the images of [`sample_combination`](Self::sample_combination) along several axes, each once, made
    /// together. Returns `None` in the same cases.
    fn combination_sums_along(
        &self,
        _combination: Combination,
        _axes: &[Axis],
        _fill: FillRule,
    ) -> Result<Option<Vec<Combined<VolumeSums>>>, SampleError> {
        Ok(None)
    }
}

/// Intersects two solids on one grid while it samples them, in bit masks (Leung & Wang, section 4): conservative images alone.
///
/// An exact intersection is the merge of two exact images.
pub trait MaskIntersection: Sampler {
    /// Returns a conservative image of the intersection of two solids.
    fn sample_intersection(
        &self,
        solids: [&LatticeSolid; 2],
        axis: Axis,
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Ldi, SampleError>;

    /// Returns the sums over the images of [`sample_intersection`](Self::sample_intersection) along several axes, each once,
    /// which a device makes together.
    fn intersection_sums_along(
        &self,
        solids: [&LatticeSolid; 2],
        axes: &[Axis],
        estimate: Estimate,
        fill: FillRule,
    ) -> Result<Vec<VolumeSums>, SampleError> {
        let image = |&axis: &Axis| self.sample_intersection(solids, axis, estimate, fill);
        axes.iter().map(|axis| Ok(image(axis)?.volume_sums())).collect()
    }
}

/// Checks the input before any sampling, for every backend.
pub(crate) fn admit(solids: &[&LatticeSolid], fill: FillRule) -> Result<Grid, SampleError> {
    let grid = *solids[0].grid();
    if let Some(other) = solids.iter().find(|s| *s.grid() != grid) {
        return Err(SampleError::GridsDiffer { first: grid.pitch(), second: other.grid().pitch() });
    }
    let unoriented = |s: &&LatticeSolid| s.closure() == Closure::Closed { oriented: false };
    match fill {
        FillRule::NonZero if solids.iter().any(unoriented) => Err(SampleError::NotOriented),
        _ => Ok(grid),
    }
}

/// Returns the box outside of which an intersection of two solids is empty without sampling.
pub(crate) fn region_of_both(a: &LatticeSolid, b: &LatticeSolid) -> LatticeBox {
    let region = a.region().intersection(b.region());
    match [a, b].iter().all(|solid| solid.closure() != Closure::Open) {
        // The intersection lies within both bounds; only open meshes are searched everywhere, for unclosed rays.
        true => region.intersection(a.bounds()).intersection(b.bounds()),
        false => region,
    }
}
