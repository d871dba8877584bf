//! Errors in the parts of an image.

/// Parts that do not form a layered depth image.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LdiError {
    /// The offsets do not fit the raster.
    #[error("{found} offsets; the raster needs {expected}")]
    OffsetCount {
        /// Number of offsets given.
        found: usize,
        /// One more than the number of rays.
        expected: usize,
    },
    /// The offsets do not begin at 0 and end at the number of samples.
    #[error("offsets run from {first} to {last} over {samples} samples")]
    OffsetEnds {
        /// The first offset.
        first: u32,
        /// The last offset.
        last: u32,
        /// Number of depths given.
        samples: usize,
    },
    /// The number of triangles is neither zero nor that of the samples.
    #[error("{found} triangles for {samples} samples")]
    TriangleCount {
        /// Number of triangles given.
        found: usize,
        /// Number of depths given.
        samples: usize,
    },
    /// Two images that are to be compared have different rays.
    #[error("the images lie on different rays")]
    RaysDiffer,
    /// An offset is less than the one before it.
    #[error("the offsets of ray {ray} run backwards")]
    OffsetOrder {
        /// The ray between the two.
        ray: usize,
    },
    /// A ray has an odd number of samples.
    #[error("ray {ray} has {samples} samples, an odd number")]
    OddCount {
        /// The ray.
        ray: usize,
        /// Number of its samples.
        samples: usize,
    },
    /// The depths of a ray are not sorted, or lie outside the grid.
    #[error("the depths of ray {ray} are not sorted within 0 to {length}")]
    Depths {
        /// The ray.
        ray: usize,
        /// The length of the grid along the rays, in lattice steps.
        length: i32,
    },
    /// The list of unclosed rays is not ascending, or contains a ray that does not exist or has samples.
    #[error("the list of unclosed rays has the invalid entry ray {ray}")]
    Unclosed {
        /// The ray.
        ray: usize,
    },
}
