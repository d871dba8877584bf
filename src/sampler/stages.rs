//! The buffers between the stages of a sampler, to compare one backend with another stage by stage, or to inspect.
//!
//! Masks and classes of `rays` rays are stored word by word: word w of ray r at `w · rays + r`. Voxel z of a ray is bit
//! z % 32 of its word z / 32.

/// Marks an unclosed ray, in place of a count or of ranks.
pub const UNCLOSED: u32 = u32::MAX;

/// The buffers of the route by masks, which makes estimates under the even-odd rule.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MaskStages {
    /// Masks W and ANY of each solid.
    pub masks: Vec<[Vec<u32>; 2]>,
    /// Voxels that keep one sample.
    pub single: Vec<u32>,
    /// Voxels that keep two.
    pub pair: Vec<u32>,
    /// Number of samples of the ray in the words before each; [`UNCLOSED`] in all words of an unclosed ray.
    pub ranks: Vec<u32>,
    /// Number of samples of each ray, or [`UNCLOSED`].
    pub counts: Vec<u32>,
    /// The offset of the samples of each ray; one more entry than rays.
    pub offsets: Vec<u32>,
}

/// The buffers of the route by lists, which makes everything.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ListStages {
    /// The offset of the crossings of each ray; one more entry than rays.
    pub starts: Vec<u32>,
    /// The crossings ([`Crossing`](crate::fixed::Crossing)) of each ray, sorted.
    pub crossings: Vec<u32>,
}
