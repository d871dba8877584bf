//! The layered depth image: for every ray of a raster, the sorted depths at which it enters and leaves a solid.

mod bands;
mod coverage;
mod error;
mod kind;
mod moment_sums;
mod nodes;
#[cfg(feature = "npz")]
pub mod npz;
mod spans;
mod triangle_ids;
mod volume_sums;
mod window;

#[cfg(feature = "gpu")]
pub(crate) use bands::ImageBuilder;
pub use bands::TooManySamples;
pub(crate) use bands::{BandImage, image_from_bands, image_from_passes};
pub use coverage::coverage;
pub use error::LdiError;
pub use kind::{Estimate, FillRule, Mode};
pub use moment_sums::MomentSums;
pub use nodes::{NodePlanes, NodeSlab, NodesError};
pub use spans::Spans;
pub use triangle_ids::NO_TRIANGLE;
#[cfg(feature = "gpu")]
pub(crate) use volume_sums::{ALONG_COLUMNS, ALONG_ROWS, THROUGH_NODES, level_tolerance};
pub use volume_sums::{RaySums, VolumeSums};

use crate::grid::{Axis, Grid};

/// A layered depth image along one axis.
///
/// Storage is compact: the samples of ray `r = row · columns + column` are `depths[offsets[r] .. offsets[r + 1]]`, in
/// lattice steps of [`Grid::step`] from the near end of the grid, non-decreasing and of even count, so that
/// `[depth 2i, depth 2i + 1)` is inside. Rays that did not close have no samples and are listed in
/// [`unclosed`](Self::unclosed).
#[derive(Clone, Debug, PartialEq)]
pub struct Ldi {
    grid: Grid,
    axis: Axis,
    offsets: Vec<u32>,
    depths: Vec<i32>,
    triangles: Vec<u32>,
    windings: Option<Windings>,
    unclosed: Vec<u32>,
}

/// Sums over the crossings of a solid that describe the orientation of its surfaces, over the rays that close.
///
/// Crossings that the image cannot distinguish form one group: those at one lattice depth in an exact image, those in
/// one voxel in an estimate. The contract is in the docs of [`sampler`](crate::sampler).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Windings {
    /// The length of the rays inside, in lattice steps, each point weighted by its winding number: the divergence
    /// theorem applied to the exact crossings, in every mode.
    pub wound: i64,
    /// The windings of the groups that [`changes`](Self::changes) counts, negated for those over which the parity
    /// becomes even: +1 for each crossing in the direction that parity implies, −1 for each in the other direction.
    pub aligned: i64,
    /// The number of groups with an odd number of crossings: how often the parity changes.
    pub changes: i64,
    /// The length, in lattice steps in an exact image and in voxels in an estimate, that the rays enter and leave
    /// through groups of even count, each point weighted by its winding number. Zero where each such group has as many
    /// entries as exits.
    pub unpaired: i64,
}

impl Windings {
    /// Returns whether every surface has the direction that parity implies, or every one the opposite, as in a solid
    /// turned inside out. Shells that overlap on the rays violate this, so where it holds both fill rules give the same
    /// solid.
    ///
    /// It is not a proof. It misses:
    /// - in an estimate, overlaps within one voxel;
    /// - overlaps and inside-out shells that cancel: through three crossings in one group in the same direction, or
    ///   through equal lengths of coinciding shells in both directions.
    pub fn fill_rules_agree(self) -> bool {
        self.aligned.abs() == self.changes && self.unpaired == 0
    }

    pub(crate) fn plus(self, other: Windings) -> Windings {
        Windings {
            wound: self.wound + other.wound,
            aligned: self.aligned + other.aligned,
            changes: self.changes + other.changes,
            unpaired: self.unpaired + other.unpaired,
        }
    }
}

impl Ldi {
    /// Returns an image from its parts, checked: offsets start at 0, do not decrease, are one more than the rays and
    /// end at the number of depths; each ray has an even number of non-decreasing depths within the grid; unclosed rays
    /// are ascending and empty.
    pub fn from_parts(
        grid: Grid,
        axis: Axis,
        offsets: Vec<u32>,
        depths: Vec<i32>,
        unclosed: Vec<u32>,
    ) -> Result<Ldi, LdiError> {
        let image = Ldi { grid, axis, offsets, depths, triangles: Vec::new(), windings: None, unclosed };
        image.check()?;
        Ok(image)
    }

    /// Returns the image with a triangle for each sample, parallel to [`depths`](Self::depths), in place of its
    /// previous ones.
    ///
    /// # Errors
    /// Fails if there are not as many triangles as samples.
    pub fn with_triangles(self, triangles: Vec<u32>) -> Result<Ldi, LdiError> {
        match triangles.len() == self.depths.len() {
            true => Ok(Ldi { triangles, ..self }),
            false => Err(LdiError::TriangleCount { found: triangles.len(), samples: self.depths.len() }),
        }
    }

    fn check(&self) -> Result<(), LdiError> {
        let (columns, rows) = self.grid.image_size(self.axis);
        let rays = columns as usize * rows as usize;
        if self.offsets.len() != rays + 1 {
            return Err(LdiError::OffsetCount { found: self.offsets.len(), expected: rays + 1 });
        }
        if self.offsets[0] != 0 || self.offsets[rays] as usize != self.depths.len() {
            return Err(LdiError::OffsetEnds {
                first: self.offsets[0],
                last: self.offsets[rays],
                samples: self.depths.len(),
            });
        }
        if !(self.triangles.is_empty() || self.triangles.len() == self.depths.len()) {
            return Err(LdiError::TriangleCount { found: self.triangles.len(), samples: self.depths.len() });
        }
        let length = self.grid.length(self.axis.depth());
        for (ray, ends) in self.offsets.windows(2).enumerate() {
            let samples = self.depths.get(ends[0] as usize..ends[1] as usize);
            let samples = samples.ok_or(LdiError::OffsetOrder { ray })?;
            if samples.len() % 2 != 0 {
                return Err(LdiError::OddCount { ray, samples: samples.len() });
            }
            if !samples.is_sorted() || samples.iter().any(|d| !(0..=length).contains(d)) {
                return Err(LdiError::Depths { ray, length });
            }
        }
        let ascending = self.unclosed.windows(2).all(|w| w[0] < w[1]);
        match self.unclosed.iter().find(|&&r| r as usize >= rays || !self.samples(r).is_empty()) {
            Some(&ray) => Err(LdiError::Unclosed { ray: ray as usize }),
            None if !ascending => Err(LdiError::Unclosed { ray: self.unclosed[0] as usize }),
            None => Ok(()),
        }
    }

    /// Returns the grid under the image.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Returns the direction of the rays.
    pub fn axis(&self) -> Axis {
        self.axis
    }

    /// Returns the numbers of columns and rows of the raster.
    pub fn size(&self) -> (u32, u32) {
        self.grid.image_size(self.axis)
    }

    /// Returns the number of rays.
    pub fn rays(&self) -> u32 {
        (self.offsets.len() - 1) as u32
    }

    /// Returns the offset of the samples of each ray; one more entry than rays, the last being the number of samples.
    pub fn offsets(&self) -> &[u32] {
        &self.offsets
    }

    /// Returns all depths, ray after ray, in lattice steps.
    pub fn depths(&self) -> &[i32] {
        &self.depths
    }

    /// Returns the depths on ray `row · columns + column`.
    pub fn samples(&self, ray: u32) -> &[i32] {
        let ray = ray as usize;
        &self.depths[self.offsets[ray] as usize..self.offsets[ray + 1] as usize]
    }

    /// Returns the triangle of each sample, if the image was sampled with triangles; parallel to
    /// [`depths`](Self::depths).
    pub fn triangles(&self) -> Option<&[u32]> {
        (self.triangles.len() == self.depths.len()).then_some(&self.triangles[..])
    }

    /// Returns the winding sums of the crossings that the image was made from; known for images of an oriented solid by
    /// itself, in every mode, and the same under either fill rule where the mesh is closed.
    pub fn windings(&self) -> Option<Windings> {
        self.windings
    }

    /// Returns the rays whose crossings did not close, ascending. Empty for every closed mesh.
    pub fn unclosed(&self) -> &[u32] {
        &self.unclosed
    }

    /// Returns whether the crossings of a ray did not close.
    pub fn is_unclosed(&self, ray: u32) -> bool {
        !self.unclosed.is_empty() && self.unclosed.binary_search(&ray).is_ok()
    }

    /// Returns n_max: the largest number of samples on any ray.
    pub fn layers(&self) -> u32 {
        self.offsets.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0)
    }
}
