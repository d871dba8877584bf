//! Why images could not be written to or read from a file.

use std::io;

use super::npy::HeaderError;
use crate::grid::GridError;
use crate::ldi::LdiError;

/// Why images could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum NpzError {
    /// There is no image.
    #[error("there is no image")]
    NoImage,
    /// The images of one file must share their grid and differ in their axis.
    #[error("images {first} and {second} do not belong together: their grids differ, or their axis is the same")]
    Mismatch {
        /// Index of one image.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// There are normals, and not one list for each image.
    #[error("{found} lists of normals for {images} images")]
    NormalLists {
        /// Lists given.
        found: usize,
        /// Images given.
        images: usize,
    },
    /// There is not one normal for each sample.
    #[error("{array}: {found} normals for {samples} samples")]
    NormalCount {
        /// The array that they are.
        array: String,
        /// Normals given.
        found: usize,
        /// Samples of the image.
        samples: usize,
    },
    /// Samples of all images together cannot be numbered.
    #[error("{samples} samples with normals; 4294967295 can be numbered")]
    TooManyNormals {
        /// The samples.
        samples: usize,
    },
    /// A normal is neither of length 1 nor zero.
    #[error("{array}: the normal of sample {sample} has length {length}, neither 1 nor 0")]
    NormalLength {
        /// The array that it is in.
        array: String,
        /// The sample.
        sample: usize,
        /// Its length; perhaps not a number.
        length: f64,
    },
    /// Normals point into the solid.
    #[error(
        "{array}: {count} normals point into the solid (first: sample {sample}); where a ray enters they point against it, \
         where it leaves along it"
    )]
    NormalSide {
        /// The array that they are in.
        array: String,
        /// Samples with such a normal.
        count: usize,
        /// The first of them.
        sample: usize,
    },
    /// Exact images disagree about what is inside.
    #[error(
        "the images are said to be exact, and along different axes they disagree about {count} lattice nodes (first: node \
         {node:?}); they are not of one solid on one grid, or not exact"
    )]
    NodesDisagree {
        /// The nodes.
        count: u64,
        /// The indices of the first, along x, y and z.
        node: [u32; 3],
    },
    /// A text names no mode.
    #[error("mode: {text:?} is none of exact, over and under")]
    Mode {
        /// The text.
        text: String,
    },
    /// A unit is no short word of letters.
    #[error("unit: {text:?} is no unit of length; a word of up to {limit} letters is", limit = super::UNIT_LETTERS)]
    Unit {
        /// What was given.
        text: String,
    },
    /// An array that has to be there is not.
    #[error("there is no array {array}")]
    Missing {
        /// Its name.
        array: String,
    },
    /// The archive names an array twice or more.
    #[error("names of arrays stand more than once among the {entries} of the archive")]
    Twice {
        /// Entries of the archive.
        entries: usize,
    },
    /// An array has no header that is understood.
    #[error("{array} {source}")]
    Header {
        /// The array.
        array: String,
        /// What is wrong with it.
        source: HeaderError,
    },
    /// The elements of an array have the wrong type.
    #[error("{array} has elements of type {found}, where {wanted} are needed")]
    Kind {
        /// The array.
        array: String,
        /// Their type.
        found: String,
        /// What is needed.
        wanted: &'static str,
    },
    /// A record lacks a field.
    #[error("{array} has no field {field} of {wanted}")]
    Field {
        /// The array.
        array: String,
        /// The field.
        field: &'static str,
        /// What it should hold.
        wanted: &'static str,
    },
    /// An array has the wrong shape.
    #[error("{array} has shape {found:?}, where {wanted} is needed")]
    Shape {
        /// The array.
        array: String,
        /// Its shape.
        found: Vec<u64>,
        /// What is needed.
        wanted: String,
    },
    /// An array of several dimensions stands in Fortran's order.
    #[error("{array} stands in Fortran's order; C's is needed, which numpy.ascontiguousarray gives")]
    Order {
        /// The array.
        array: String,
    },
    /// An entry is shorter or longer than the array in it.
    #[error("{array} has {found} bytes of elements, where its header tells of {wanted}")]
    Size {
        /// The array.
        array: String,
        /// Bytes that are there.
        found: u64,
        /// Bytes that its shape and type need.
        wanted: u64,
    },
    /// Compressed arrays are large beside the file that holds them.
    #[error(
        "{array}: compressed arrays need {needed} bytes of memory, and {allowed} are allowed for a file of this size; \
         numpy.savez writes them without compression"
    )]
    Compressed {
        /// The array that is too much.
        array: String,
        /// Bytes of all compressed arrays up to it.
        needed: u64,
        /// Bytes that are allowed.
        allowed: u64,
    },
    /// There is no memory for an array.
    #[error("{array}: there is no memory for {bytes} bytes")]
    Memory {
        /// The array.
        array: String,
        /// Bytes that it needs.
        bytes: u64,
    },
    /// A value is beyond what its meaning allows.
    #[error("{array}: value {value} at index {index} is outside {least} to {most}")]
    Range {
        /// The array.
        array: String,
        /// Where the value stands.
        index: usize,
        /// The value.
        value: i128,
        /// The least that is possible.
        least: i128,
        /// The most that is possible.
        most: i128,
    },
    /// A text is none of x, y and z.
    #[error("axis: {text:?} is none of x, y and z")]
    Axis {
        /// The text.
        text: String,
    },
    /// An axis is named twice.
    #[error("axis: {axis} is named twice")]
    AxisTwice {
        /// Its name.
        axis: &'static str,
    },
    /// The grid is none that images lie on.
    #[error("grid: {0}")]
    Grid(#[from] GridError),
    /// The length of a step contradicts the pitch.
    #[error("grid: a step of {found:e} contradicts the pitch and the shift, which make it {expected:e}")]
    Step {
        /// What the file states.
        found: f64,
        /// What follows from pitch and shift.
        expected: f64,
    },
    /// The arrays of one axis are no image.
    #[error("the image along {axis}: {source}")]
    Image {
        /// Direction of its rays.
        axis: &'static str,
        /// What is wrong with it.
        source: LdiError,
    },
    /// An array is damaged: it does not decompress, or its check sum is another.
    #[error("{array} is damaged: {source}")]
    Damaged {
        /// The array.
        array: String,
        /// What was found.
        source: io::Error,
    },
    /// The archive could not be written, or is none.
    #[error("{0}")]
    Zip(#[from] zip::result::ZipError),
    /// The file could not be written or read.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// What went wrong keeps its kind, so that a full disk is told from a wrong path.
impl From<NpzError> for io::Error {
    fn from(error: NpzError) -> io::Error {
        match error {
            NpzError::Io(error) | NpzError::Zip(zip::result::ZipError::Io(error)) => error,
            error => io::Error::other(error),
        }
    }
}
