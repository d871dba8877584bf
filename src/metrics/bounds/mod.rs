//! What certainly is solid, and what may be.
//!
//! # Cubes that the surface meets
//! Each node stands for a cube of one pitch, the pixel of the raster that it lies in. Where no triangle meets a cube, all of
//! it is inside or all of it is outside, and its node says which. So the solid lies between two unions of cubes: *inner*,
//! those of inside nodes that no triangle meets, and *outer*, those of inside nodes and those that a triangle meets. Both are
//! found without a look at what lies between rays, a plate of a tenth of a pitch as surely as any other; and what is
//! calculated on either is a bound to the extent that it grows or shrinks with the solid.
//!
//! # Certified for the mesh as read
//! Vertices move by one lattice step at most along each axis when they are snapped to the lattice, and with them every point of
//! the surface. Cubes are taken [`MARGIN`] steps larger on every side, so that a cube which the snapped surface leaves alone is
//! left alone by the mesh's own and by all surfaces in between; and therefore its node is inside the one solid as it is inside
//! the other. One of these steps covers the rounding of f64, in which triangles are cut to the rows of cubes: corners are
//! integers below 2³⁰, so that points of a cut are off by less than 2⁻¹⁹ steps. Exact integers would give the same sets but for
//! cubes within a step or two of the surface, a millionth of a pitch at 512 rays, and need 128 bits.
//!
//! # Rows, not cubes
//! Instead of a test for each triangle and cube (Akenine-Möller, "Fast 3D triangle-box overlap testing", Journal of Graphics
//! Tools 6, 2001) a triangle is cut to each plane of cubes and that to each row: what is left is convex, and the cubes of the
//! row that it meets are those from its least x to its greatest, set as bits at once.
//!
//! # Faces of the region
//! Where the region is the box of the solid, faces in the faces of the box are where the solid was cut. They bound nothing
//! within the region and take no cube from it.

mod cubes;
mod interval;
mod volume;

use self::cubes::SurfaceCubes;
use super::{NodeSet, Region};
use crate::grid::LatticeSolid;

pub use interval::Interval;
pub use volume::{Sampled, VolumeBounds, Within, finer_grid};

/// By how many lattice steps cubes are enlarged on every side: one for the snapping of vertices, one for its own rounding, one
/// for that of cutting triangles.
pub const MARGIN: i32 = 3;

/// The nodes whose cubes certainly lie in a solid, and those whose cubes may have part in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SolidBounds {
    /// Cubes that lie in the solid, all of what of them lies in the region.
    pub inner: NodeSet,
    /// Cubes outside of which nothing of the solid lies within the region.
    pub outer: NodeSet,
}

impl SolidBounds {
    /// Of a solid within a region, both on the raster of `inside`, the nodes that its exact images have inside. Nodes outside
    /// the region are told apart, too: intersect with the region's nodes where they must not be.
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
        let (inner, outer) =
            rayon::join(|| combined(|inside, met| inside & !met), || combined(|inside, met| inside | met));
        SolidBounds { inner, outer }
    }
}

#[cfg(test)]
mod tests;
