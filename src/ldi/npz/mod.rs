//! Images as `.npz`: a zip archive of `.npy` arrays, which `numpy.load` opens.
//!
//! | key | type | shape | meaning |
//! |---|---|---|---|
//! | `axis` | text | () or (n,) | direction of the rays of each image |
//! | `offsets` | uint32 | (rays + 1,) | samples of ray `row · columns + column` are `depths[offsets[r]:offsets[r + 1]]` |
//! | `depths` | int32 | (samples,) | lattice steps from the near end of the grid |
//! | `normals` | float32 | (samples, 3) | of the surface at each sample: of length 1, outwards, in world axes; 0 where not known; may be absent |
//! | `unclosed` | uint32 | (k,) | rays that did not close; they have no samples |
//! | `grid` | record | () | the raster and lattice: fields below |
//! | `unit` | text | () | the unit of length: `mm`; absent if unknown |
//! | `mode` | text | () | which image of the solid is kept: `exact`, `over` or `under`; absent where it is not known |
//!
//! | field of `grid` | type | meaning |
//! |---|---|---|
//! | `origin` | float64 (3,) | world position of lattice position (0, 0, 0) |
//! | `pitch` | float64 | distance of neighbouring rays |
//! | `step` | float64 | length of one lattice step: `pitch / 2**shift` |
//! | `rays` | uint32 (3,) | pixels along x, y and z |
//! | `shift`, `lod` | uint32 | lattice steps in a pixel, as a power of two; LOD-C |
//!
//! So the depths of ray r in world units along z are `grid["origin"][2] + grid["step"] * depths[offsets[r]:offsets[r + 1]]`.
//!
//! Columns and rows run along the two other axes in increasing order: x → (y, z), y → (x, z), z → (x, y). With several
//! images, the names of `offsets`, `depths`, `normals` and `unclosed` carry the axis: `offsets_x`. The grid occurs
//! once, since all images share it.
//!
//! Entries are written without compression and without a time stamp, so that equal images make equal files. The reader
//! also accepts files that have gone through numpy: compressed, with integers of any width, and without `step`; it
//! checks that every value fits.

mod error;
mod normals;
pub(crate) mod npy;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use error::NpzError;
pub use normals::normals_of_samples;
pub use npy::HeaderError;
pub use read::read;
pub use write::write;

use super::{Ldi, Mode};

/// A normal for each sample of an image, parallel to [`Ldi::depths`]: of length 1, outwards, in world axes; zero where it is
/// not known.
pub type Normals = Vec<[f32; 3]>;

/// Optional contents of a file beside the images.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extras {
    /// The normals of each image, where they are known; an empty list if none are.
    pub normals: Vec<Option<Normals>>,
    /// The unit of length: a short word of letters, such as `mm`.
    pub unit: Option<String>,
    /// The kind of image.
    pub mode: Option<Mode>,
}

/// The contents of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Images {
    /// One image or several, on one grid along different axes, in the order of the file.
    pub images: Vec<Ldi>,
    /// Further contents; the list of normals has an entry for each image.
    pub extras: Extras,
    /// Names of unknown arrays, which were not read.
    pub ignored: Vec<String>,
}

/// Largest number of letters of a unit.
const UNIT_LETTERS: usize = 16;

/// Returns whether a text is a valid unit of length.
fn is_unit(text: &str) -> bool {
    (1..=UNIT_LETTERS).contains(&text.chars().count()) && text.chars().all(char::is_alphabetic)
}

/// Returns the first normal that is neither zero nor, to 32-bit rounding, of length 1, and its length.
fn not_normal(normals: &[[f32; 3]]) -> Option<(usize, f64)> {
    const ROUNDED: std::ops::RangeInclusive<f64> = 0.999..=1.001;
    let length = |normal: &[f32; 3]| normal.iter().map(|&n| f64::from(n) * f64::from(n)).sum::<f64>().sqrt();
    let mut lengths = normals.iter().map(length).enumerate();
    lengths.find(|(_, length)| *length != 0.0 && !ROUNDED.contains(length))
}

/// Returns the name of an array of an image, which carries the axis where there are several images.
fn key(name: &str, image: &str, images: usize) -> String {
    if images == 1 { name.to_owned() } else { format!("{name}_{image}") }
}
