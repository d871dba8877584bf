//! Minkowski sums and differences of any two solids, convex or not, as layered depth images.
//!
//! A ⊕ B = {a + b}. The seed paper (section V.B, after Li & McMains) culls pairs of features that cannot carry the boundary,
//! voxelises the surface of the rest, floods from outside and samples the flooded region. Here the same three steps work on
//! crossings instead of voxels, so that nothing finer than a voxel is lost and nothing leaks:
//!
//! 1. **Primitives** (`cull`): facet + vertex and edge + edge whose supporting planes agree, by exact signs. Together they
//!    cover the boundary of the sum, and more: parts of them lie inside. Those in the coarsely known interior (`interior`) are
//!    not sampled.
//! 2. **Certain spans** (`spans`): the rays meet the primitives in crossings, which divide them into intervals, each wholly in
//!    or wholly out of the sum. *Behind every primitive lies the sum*: a facet has its own solid behind it, and a convex edge
//!    on another spans the half space behind their common plane. So an interval is in unless the crossing before it leaves and
//!    the one after it enters. The remaining intervals are the **gaps**.
//! 3. **Gap resolution** (`resolve`): gaps of the three axes that share a lattice node are in or out together, and so are
//!    neighbouring nodes without a crossing between them. Sets of such nodes are found on bit masks, 64 nodes at a time; a set
//!    that touches neither certain outside nor certain inside is either a cavity or inside: one exact test of one point decides
//!    each, and each gap between two nodes.
//! 4. **Retrieval**: the remaining spans are crossings like those of any solid, from which the sampler's own stages make its
//!    exact, over- or under-estimated image.
//!
//! x ∈ A ⊕ B ⇔ A ∩ (x − B) ≠ ∅ is decided on the lattice by exact signs, with ties broken by the sampler's symbolic
//! perturbation (`membership`), so that no component and no gap stays undecided. Gaps shorter than four lattice steps, a few
//! millionths of a pitch, are closed unless a node lies in them.
//!
//! A GPU performs the second and the third step, too, with the same results: [`Primitives::spans`] takes either sampler, and
//! `resolve::gpu` floods masks of all nodes.
//!
//! The difference A ⊖ B = {x : x + B ⊆ A} is the complement of complement(A) ⊕ (−B): the same steps with A turned inside out
//! and everything beyond the outermost crossings counted as in.
//!
//! Overlapping shells unite: the sum of a heap of struts is the union of their sums. Shells whose overlaps should cancel, as
//! under the even-odd fill rule, have no sum of this kind.
//!
//! # Two boxes
//! ```
//! use glam::DVec3;
//! use ldi_ops::fixed::Crossing;
//! use ldi_ops::grid::{Axis, SumGrid};
//! use ldi_ops::integrate;
//! use ldi_ops::mesh::ClosedMesh;
//! use ldi_ops::minkowski::{Exterior, Polyhedron, SumMembership, cull, resolve};
//! use ldi_ops::sampler::{Mode, cpu::CpuSampler};
//! use ldi_ops::solids;
//!
//! let a = ClosedMesh::check(solids::cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0))?)?;
//! let b = ClosedMesh::check(solids::cuboid(DVec3::splat(9.0), DVec3::splat(10.0))?)?;
//! let grids = SumGrid::with_pitch(a.bounds(), b.bounds(), 0.0625, 1024)?;
//! let (a, b) = (Polyhedron::new(&grids.a.quantise(&a)?), Polyhedron::new(&grids.b.quantise(&b)?));
//!
//! let (primitives, _) = cull(&a, &b);
//! let sampler = CpuSampler::default();
//! let along = |axis| primitives.spans::<Crossing, _>(&grids.sum, axis, Exterior::Out, &sampler);
//! let spans = [along(Axis::X)?.0, along(Axis::Y)?.0, along(Axis::Z)?.0];
//! let membership = SumMembership::new(&a, Exterior::Out, &b);
//! let resolved = resolve(&grids.sum, spans, Exterior::Out, &membership, &|_, _| ())?;
//! let image = resolved.spans[2].image(&grids.sum, Mode::Exact, &sampler)?;
//! assert!((integrate::volume(&image) - 2.0 * 3.0 * 4.0).abs() < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod ball;
pub mod cull;
mod fine;
mod interior;
pub mod membership;
pub mod polyhedron;
pub mod probe;
pub mod resolve;
pub mod spans;
mod sum;

pub use cull::cull;
pub(crate) use fine::images_in_box;
pub use interior::Interior;
pub use membership::{SumMembership, SumProbe};
pub use polyhedron::Polyhedron;
pub use probe::{Probe, Probed};
pub use resolve::{ResolveCounts, ResolveError, ResolvedSpans, resolve};
pub use spans::{Exterior, RaySpans};

/// A solid with an exact point membership test, whose boundary is covered by primitives.
pub trait Membership: Sync {
    /// The memory of a thread from one test to the next. It makes tests faster where points lie close to one another, and never
    /// changes their results.
    type Memory: Default + Send;

    /// Returns whether the point is in the solid. `point` is a position on the lattice of the sum that lies on a ray along some
    /// axis (at least two odd coordinates, those of the ray; all three odd for a node) and stands for (x + ε₁, y + ε₂, z + ε₃),
    /// ε₁ ≫ ε₂ ≫ ε₃ > 0, as in [`sampler`](crate::sampler).
    fn contains(&self, point: [i32; 3], memory: &mut Self::Memory) -> bool;
}

/// The primitives of a sum: triangles that cover its boundary, with outward normals (b − a) × (c − a), on the sum's lattice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Primitives {
    /// Even lattice positions.
    pub positions: Vec<[i32; 3]>,
    /// Three indices for each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// The numbers of candidate, visited and kept pairs of features.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CullCounts {
    /// |F_A|·|V_B| + |V_A|·|F_B| + |E_A|·|E_B|.
    pub candidates: u128,
    /// Pairs whose exact signs were computed.
    pub visited: u64,
    /// Pairs that can carry the boundary.
    pub kept: u64,
    /// Distinct primitives among them.
    pub distinct: u64,
}
