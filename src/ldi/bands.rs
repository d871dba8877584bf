//! Assembly of images from bands: the only place where parts computed in parallel become one compact image.

use std::ops::Range;

use crate::parallel::*;

#[cfg(feature = "gpu")]
use super::LdiError;
use super::{Ldi, Windings};
use crate::cancel::checkpoint;
use crate::grid::{Axis, Grid};

/// An image has more samples than its 32-bit offsets can index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the image along {axis} needs more than {limit} samples; lower the resolution", axis = axis.name(), limit = u32::MAX)]
pub struct TooManySamples {
    /// The direction of the rays.
    pub axis: Axis,
}

/// The part of an image in one band of rows, ray after ray.
#[derive(Default)]
pub struct BandImage {
    ends: Vec<u32>,
    depths: Vec<i32>,
    triangles: Vec<u32>,
    windings: Option<Windings>,
    unclosed: Vec<u32>,
}

impl BandImage {
    /// Returns the samples so far; the caller appends those of the next ray.
    pub fn depths(&mut self) -> &mut Vec<i32> {
        &mut self.depths
    }

    /// Returns the triangles of the samples: as many as depths, or none at all in the whole image.
    pub fn triangles(&mut self) -> &mut Vec<u32> {
        &mut self.triangles
    }

    /// Adds the winding sums of the crossings of the band.
    pub fn add_windings(&mut self, windings: Windings) {
        self.windings = Some(self.windings.unwrap_or_default().plus(windings));
    }

    /// Returns a band of rays without samples.
    #[cfg(feature = "gpu")]
    pub fn of_empty_rays(rays: u32, windings: Option<Windings>) -> BandImage {
        BandImage { ends: vec![0; rays as usize], windings, ..BandImage::default() }
    }

    /// Returns a band from its parts: the end of the samples of each ray, the samples, and their triangles or none.
    #[cfg(feature = "gpu")]
    pub fn from_parts(ends: Vec<u32>, depths: Vec<i32>, triangles: Vec<u32>, windings: Option<Windings>) -> BandImage {
        BandImage { ends, depths, triangles, windings, unclosed: Vec::new() }
    }

    /// Returns the band with its unclosed rays, counted from its first.
    #[cfg(feature = "gpu")]
    pub fn with_unclosed(self, unclosed: Vec<u32>) -> BandImage {
        BandImage { unclosed, ..self }
    }

    /// Ends the ray whose samples were just appended.
    pub fn end_ray(&mut self) {
        self.ends.push(self.depths.len() as u32);
    }

    /// Ends an unclosed ray; it has no samples.
    pub fn end_unclosed_ray(&mut self) {
        self.unclosed.push(self.ends.len() as u32);
        self.end_ray();
    }
}

/// Number of bands computed before their parts are moved into the image; bounds the memory that is held twice.
const WAVE: usize = 32;

/// Builds an image from bands of `band_rows` rows, in parallel. `run` appends the rays of the rows it is given; each
/// thread passes it its own stage, created by `new_stage`, so that bands may share scratch memory.
pub fn image_from_bands<S>(
    grid: Grid,
    axis: Axis,
    band_rows: u32,
    new_stage: impl Fn() -> S + Sync + Send,
    run: impl Fn(&mut S, Range<u32>, &mut BandImage) + Sync + Send,
) -> Result<Ldi, TooManySamples> {
    let (_, rows) = grid.image_size(axis);
    let whole = [(0..rows, ())];
    image_from_passes(grid, axis, band_rows, whole, new_stage, |stage, (), rows, image| run(stage, rows, image))
}

/// Builds an image in passes: ascending, adjoining ranges of rows that are all rows together, each but the last of whole bands. `run`
/// is given the data of its pass, which is dropped before the next pass is made.
pub fn image_from_passes<P: Sync, S>(
    grid: Grid,
    axis: Axis,
    band_rows: u32,
    passes: impl IntoIterator<Item = (Range<u32>, P)>,
    new_stage: impl Fn() -> S + Sync + Send,
    run: impl Fn(&mut S, &P, Range<u32>, &mut BandImage) + Sync + Send,
) -> Result<Ldi, TooManySamples> {
    let mut builder = ImageBuilder::new(grid, axis);
    for (rows, pass) in passes {
        let bands = rows.len().div_ceil(band_rows as usize);
        for wave in 0..bands.div_ceil(WAVE) {
            let wave = wave * WAVE..bands.min((wave + 1) * WAVE);
            let images: Vec<BandImage> = wave
                .into_par_iter()
                .map_init(&new_stage, |stage, band| {
                    checkpoint();
                    let first = rows.start + band as u32 * band_rows;
                    let mut image = BandImage::default();
                    run(stage, &pass, first..rows.end.min(first + band_rows), &mut image);
                    image
                })
                .collect();
            for image in images {
                builder.append(image)?;
            }
        }
    }
    Ok(builder.finish())
}

/// Appends a list to another; the first one of some is moved.
fn append<T: Copy>(to: &mut Vec<T>, list: Vec<T>) {
    match to.is_empty() {
        true => *to = list,
        false => to.extend_from_slice(&list),
    }
}

/// An image that is built band by band, in the order of the rays.
pub struct ImageBuilder {
    image: Ldi,
}

impl ImageBuilder {
    /// Returns an image without rays.
    pub fn new(grid: Grid, axis: Axis) -> ImageBuilder {
        let (columns, rows) = grid.image_size(axis);
        let mut offsets = Vec::with_capacity(columns as usize * rows as usize + 1);
        offsets.push(0u32);
        let (depths, triangles, unclosed) = (Vec::new(), Vec::new(), Vec::new());
        ImageBuilder { image: Ldi { grid, axis, offsets, depths, triangles, windings: None, unclosed } }
    }

    /// Appends the rays of a band.
    pub fn append(&mut self, band: BandImage) -> Result<(), TooManySamples> {
        let image = &mut self.image;
        if image.depths.len() + band.depths.len() > u32::MAX as usize {
            return Err(TooManySamples { axis: image.axis });
        }
        let (base, first_ray) = (image.depths.len() as u32, image.offsets.len() as u32 - 1);
        append(&mut image.depths, band.depths);
        append(&mut image.triangles, band.triangles);
        image.offsets.extend(band.ends.iter().map(|end| base + end));
        image.windings = match (image.windings, band.windings) {
            (Some(sum), Some(more)) => Some(sum.plus(more)),
            (sum, more) => sum.or(more),
        };
        image.unclosed.extend(band.unclosed.iter().map(|ray| first_ray + ray));
        Ok(())
    }

    /// Returns the image, which has all its rays and is valid by construction.
    pub fn finish(self) -> Ldi {
        debug_assert_eq!(self.image.check(), Ok(()));
        self.image
    }

    /// Returns the image, after checking parts that came from elsewhere.
    #[cfg(feature = "gpu")]
    pub fn finish_checked(self) -> Result<Ldi, LdiError> {
        self.image.check()?;
        Ok(self.image)
    }
}
