//! Certified bounds of a solid: the cubes certainly inside it, and those possibly inside.
//!
//! # Cubes that the surface meets
//! Each node stands for a cube of one pitch, the pixel of the raster that it lies in. Where no triangle meets a cube, all of it
//! has the state of its node, inside or outside. So the solid lies between two unions of cubes: *inner*, those of inside nodes
//! that no triangle meets, and *outer*, those of inside nodes and those that a triangle meets. Both are independent of the
//! space between rays, so a plate of a tenth of a pitch is bounded as surely as any other solid; and a quantity calculated on
//! either is a bound to the extent that it is monotonic in the solid.
//!
//! # Certified for the mesh as read
//! Vertices move by at most one lattice step along each axis when they are snapped to the lattice, and so does every point of
//! the surface. Cubes are enlarged by [`MARGIN`] steps on every side, so that a cube which the snapped surface does not meet is
//! not met by the mesh's own surface or by any in between; and therefore its node has the same state in both solids. One of
//! these steps covers the rounding of f64, in which triangles are cut to planes of cubes and sides to rows: corners are integers
//! below 2³⁰, so that points of a cut are off by less than 2⁻¹⁹ steps. Exact integers would give the same sets except for cubes
//! within a step or two of the surface, a millionth of a pitch at 512 rays, and need 128 bits.
//!
//! # Rows, not cubes
//! Instead of a test for each triangle and cube (Akenine-Möller, "Fast 3D triangle-box overlap testing", Journal of Graphics
//! Tools 6, 2001) a triangle is cut to each plane of cubes. In each row it meets the cubes from the least to the greatest x of the
//! remainder's corners in the row and of its sides where they enter or leave the row, set as bits at once.
//!
//! # Faces of the region
//! Where the region is the box of the solid, facets in the faces of the box arose from cutting. They bound nothing within the
//! region and exclude no cube from it.

mod cubes;
mod interval;
mod volume;

pub(crate) use self::cubes::SurfaceCubes;
use super::{NodeSet, Region};
use crate::grid::LatticeSolid;
use crate::parallel::join;

pub use interval::Interval;
pub use volume::{Sampled, VolumeBounds, Within, finer_grid};

/// Enlargement of cubes in lattice steps on every side: one for the snapping of vertices, one for its own rounding, one for
/// that of cutting triangles.
pub const MARGIN: i32 = 3;

/// The nodes whose cubes certainly lie in a solid, and those whose cubes may intersect it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SolidBounds {
    /// Cubes whose part within the region lies entirely in the solid.
    pub inner: NodeSet,
    /// Cubes that together contain all of the solid within the region.
    pub outer: NodeSet,
}

impl SolidBounds {
    /// Computes the bounds of a solid within a region, both on the raster of `inside`, the nodes inside by its exact images.
    /// Nodes outside the region are classified, too: intersect with the region's nodes to exclude them.
    ///
    /// # Panics
    /// If solid, nodes and region are not on one raster.
    pub fn of(solid: &LatticeSolid, inside: &NodeSet, region: &Region) -> SolidBounds {
        let size = solid.grid().rays().map(|n| n as usize);
        assert_eq!(inside.size(), size, "nodes of the solid's raster");
        assert_eq!(solid.grid(), region.grid(), "a solid and its region are on one raster");
        let cut_by = region.is_box().then(|| region.bounds());
        let met = SurfaceCubes::of(solid, cut_by).slab(0..size[2]);
        let combined = |combine: fn(u64, u64) -> u64| {
            let mut set = NodeSet::empty(size);
            for z in 0..size[2] {
                for y in 0..size[1] {
                    let met = &met[(z * size[1] + y) * inside.words()..][..inside.words()];
                    let both = inside.row(y, z).iter().zip(met);
                    set.row_mut(y, z)
                        .iter_mut()
                        .zip(both)
                        .for_each(|(word, (&inside, &met))| *word = combine(inside, met));
                }
            }
            set
        };
        let (inner, outer) = join(|| combined(|inside, met| inside & !met), || combined(|inside, met| inside | met));
        SolidBounds { inner, outer }
    }
}

#[cfg(test)]
mod tests;
