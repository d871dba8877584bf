//! Certified bounds of the volume of a sum or a difference.
//!
//! The primitives cover the boundary of the sum: culling drops a pair of features only if exact signs prove that it carries no
//! boundary, and a primitive only if it lies in the certain interior. So a cube of the raster that no primitive meets is
//! wholly in the sum or wholly out, as is its node; and exact membership tests decide the nodes. The cubes that no primitive
//! meets and whose node is in have a volume below that of the sum, and together with those that a primitive meets they have one
//! above it ([`VolumeBounds`]). Volumes are added as integers.
//!
//! The bounds hold for the sum of the operands as they are rounded to the lattice. Their width is of first order in the pitch.

use crate::Error;
use crate::fixed::Hit;
use crate::grid::{Grid, LatticeBox, LatticeSolid};
use crate::ldi::NodePlanes;
use crate::metrics::bounds::{Interval, Sampled, VolumeBounds, Within};
use crate::minkowski::{Primitives, RaySpans};
use crate::sampler::Mode;
use crate::sampler::cpu::CpuSampler;

/// Returns bounds from the primitives and the resolved spans along x.
pub fn certified_bounds<H: Hit + Sync>(
    grid: &Grid,
    primitives: &Primitives,
    along_x: &RaySpans<H>,
) -> Result<Interval, Error> {
    let image = along_x.image(grid, Mode::Exact, &CpuSampler::default()).map_err(Error::machine)?;
    let inside = NodePlanes::new([&image], Mode::Exact).expect("there is one image");
    let solid = LatticeSolid::of_primitives(grid, &primitives.positions, &primitives.triangles);
    let whole = LatticeBox { min: [0; 3], max: [0, 1, 2].map(|axis| grid.length(axis)) };
    Ok(VolumeBounds::of(&Sampled { solid: &solid, inside }, &Within::Box(whole)).solid)
}
