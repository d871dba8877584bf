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
//! | `unit` | text | () | what one unit of length is: `mm`; absent where it is not known |
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
//! Columns and rows run along the two other axes in increasing order: x → (y, z), y → (x, z), z → (x, y). Of several
//! images, `offsets`, `depths`, `normals` and `unclosed` carry the axis: `offsets_x`. The grid stands once, as it is the same.
//!
//! Entries are written without compression and without a time, so that equal images make equal files. What is read may also
//! have gone through numpy: compressed, with integers of any width, and without `step`; every value is checked to fit.

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

use super::Ldi;

/// A normal for each sample of an image, parallel to [`Ldi::depths`]: of length 1, outwards, in world axes; zero where it is
/// not known.
pub type Normals = Vec<[f32; 3]>;

/// Which image of a solid a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageMode {
    /// Every crossing. Images along several axes then agree about every lattice node.
    Exact,
    /// An over-estimate, which encloses the solid on every ray.
    Over,
    /// An under-estimate, which lies inside the solid on every ray.
    Under,
}

impl ImageMode {
    /// Every mode.
    pub const ALL: [ImageMode; 3] = [ImageMode::Exact, ImageMode::Over, ImageMode::Under];

    /// Its name in files: `exact`, `over` or `under`.
    pub fn name(self) -> &'static str {
        match self {
            ImageMode::Exact => "exact",
            ImageMode::Over => "over",
            ImageMode::Under => "under",
        }
    }
}

/// What a file may hold beside the images.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extras {
    /// The normals of each image, where they are known; an empty list says of all that they are not.
    pub normals: Vec<Option<Normals>>,
    /// What one unit of length is: a short word of letters, as `mm`.
    pub unit: Option<String>,
    /// Which image of the solid is kept.
    pub mode: Option<ImageMode>,
}

/// What a file held.
#[derive(Clone, Debug, PartialEq)]
pub struct Images {
    /// One image or several, on one grid along different axes, in the order of the file.
    pub images: Vec<Ldi>,
    /// What else is known of them; its list of normals has an entry for each image.
    pub extras: Extras,
    /// Names of arrays that mean nothing here and were not read.
    pub ignored: Vec<String>,
}

/// The most letters of a unit.
const UNIT_LETTERS: usize = 16;

/// Whether a text can stand as a unit of length.
fn is_unit(text: &str) -> bool {
    (1..=UNIT_LETTERS).contains(&text.chars().count()) && text.chars().all(char::is_alphabetic)
}

/// The first normal that is neither zero nor of length 1, as far as 32 bits tell, and its length.
fn not_normal(normals: &[[f32; 3]]) -> Option<(usize, f64)> {
    const ROUNDED: std::ops::RangeInclusive<f64> = 0.999..=1.001;
    let length = |normal: &[f32; 3]| normal.iter().map(|&n| f64::from(n) * f64::from(n)).sum::<f64>().sqrt();
    let mut lengths = normals.iter().map(length).enumerate();
    lengths.find(|(_, length)| *length != 0.0 && !ROUNDED.contains(length))
}

/// The name of an array of an image, which carries the axis where there are several images.
fn key(name: &str, image: &str, images: usize) -> String {
    if images == 1 { name.to_owned() } else { format!("{name}_{image}") }
}
