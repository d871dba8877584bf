//! Errors of image files.

use std::io;

use super::npy::HeaderError;
use crate::grid::GridError;
use crate::ldi::LdiError;

/// The reason why images could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
    /// The number of lists of normals is neither zero nor that of the images.
    #[error("{found} lists of normals for {images} images")]
    NormalLists {
        /// Number of lists given.
        found: usize,
        /// Number of images given.
        images: usize,
    },
    /// The number of normals is not that of the samples.
    #[error("{array}: {found} normals for {samples} samples")]
    NormalCount {
        /// The name of the array.
        array: String,
        /// Number of normals given.
        found: usize,
        /// Number of samples of the image.
        samples: usize,
    },
    /// The samples of all images together cannot be numbered.
    #[error("too many samples with normals: {samples} (limit 4,294,967,295); lower the resolution")]
    TooManyNormals {
        /// Number of samples.
        samples: usize,
    },
    /// A normal is neither of length 1 nor zero.
    #[error("{array}: the normal of sample {sample} has length {length}, neither 1 nor 0")]
    NormalLength {
        /// The name of the array.
        array: String,
        /// The sample.
        sample: usize,
        /// Its length; may be NaN.
        length: f64,
    },
    /// Normals point into the solid.
    #[error(
        "{array}: {count} normals point into the solid (first: sample {sample}); where a ray enters they point against it, \
         where it leaves along it"
    )]
    NormalSide {
        /// The name of the array.
        array: String,
        /// Number of samples with such a normal.
        count: usize,
        /// The first of them.
        sample: usize,
    },
    /// Exact images disagree about which nodes are inside.
    #[error(
        "the file says that its images are exact, but along different axes they disagree about {count} lattice nodes \
         (first: node {node:?}); they are not of one solid on one grid, or not exact"
    )]
    NodesDisagree {
        /// Number of such nodes.
        count: u64,
        /// The indices of the first, along x, y and z.
        node: [u32; 3],
    },
    /// A text is not the name of a mode.
    #[error("mode: {text:?} is not exact, over or under")]
    Mode {
        /// The text.
        text: String,
    },
    /// A unit is not a short word of letters.
    #[error("unit: {text:?} is not a unit of length; a unit is a word of up to {limit} letters", limit = super::UNIT_LETTERS)]
    Unit {
        /// The given text.
        text: String,
    },
    /// A required array is missing.
    #[error("the array {array} is missing")]
    Missing {
        /// Its name.
        array: String,
    },
    /// The archive contains an array name more than once.
    #[error("the archive has duplicate names of arrays ({entries} entries)")]
    Twice {
        /// Number of entries of the archive.
        entries: usize,
    },
    /// The header of an array cannot be interpreted.
    #[error("{array} {source}")]
    Header {
        /// The array.
        array: String,
        /// The problem with the header.
        source: HeaderError,
    },
    /// The elements of an array have the wrong type.
    #[error("{array} has elements of type {found}; {wanted} are required")]
    Kind {
        /// The array.
        array: String,
        /// The type found.
        found: String,
        /// The required type.
        wanted: &'static str,
    },
    /// A record lacks a field.
    #[error("{array} has no field {field} of {wanted}")]
    Field {
        /// The array.
        array: String,
        /// The field.
        field: &'static str,
        /// The required content.
        wanted: &'static str,
    },
    /// An array has the wrong shape.
    #[error("{array} has shape {found:?}; {wanted} is required")]
    Shape {
        /// The array.
        array: String,
        /// The shape found.
        found: Vec<u64>,
        /// The required shape.
        wanted: String,
    },
    /// An array of several dimensions is in Fortran order.
    #[error("{array} is in Fortran order; convert it to C order with numpy.ascontiguousarray")]
    Order {
        /// The array.
        array: String,
    },
    /// An entry is shorter or longer than its array.
    #[error("{array} has {found} bytes of elements; its header declares {wanted}")]
    Size {
        /// The array.
        array: String,
        /// Number of bytes present.
        found: u64,
        /// Number of bytes for its shape and type.
        wanted: u64,
    },
    /// Compressed arrays are too large compared with the file that holds them.
    #[error(
        "{array}: decompression needs {needed} bytes of memory; the limit for a file of this size is {allowed}: \
         write the file without compression, with numpy.savez"
    )]
    Compressed {
        /// The array that exceeds the limit.
        array: String,
        /// Number of bytes of all compressed arrays up to it.
        needed: u64,
        /// Number of bytes allowed.
        allowed: u64,
    },
    /// Memory for an array could not be allocated.
    #[error("{array}: not enough memory for {bytes} bytes")]
    Memory {
        /// The array.
        array: String,
        /// Number of bytes required.
        bytes: u64,
    },
    /// A value is out of range.
    #[error("{array}: value {value} at index {index} is outside {least} to {most}")]
    Range {
        /// The array.
        array: String,
        /// The index of the value.
        index: usize,
        /// The value.
        value: i128,
        /// The least allowed value.
        least: i128,
        /// The greatest allowed value.
        most: i128,
    },
    /// A text is not x, y or z.
    #[error("axis: {text:?} is not x, y or z")]
    Axis {
        /// The text.
        text: String,
    },
    /// An axis is named twice.
    #[error("axis: {axis} occurs twice")]
    AxisTwice {
        /// Its name.
        axis: &'static str,
    },
    /// The grid is not a valid one.
    #[error("grid: {0}")]
    Grid(#[from] GridError),
    /// The length of a step contradicts the pitch.
    #[error("grid: a step of {found:e} contradicts the pitch and the shift, which give {expected:e}")]
    Step {
        /// The step that the file states.
        found: f64,
        /// The step that follows from pitch and shift.
        expected: f64,
    },
    /// The arrays of one axis do not form an image.
    #[error("the image along {axis}: {source}")]
    Image {
        /// Direction of its rays.
        axis: &'static str,
        /// The problem with the image.
        source: LdiError,
    },
    /// An array is damaged: it does not decompress, or its checksum is wrong.
    #[error("{array} is damaged: {source}")]
    Damaged {
        /// The array.
        array: String,
        /// The error found.
        source: io::Error,
    },
    /// The file is not an archive, or not all of one.
    #[error("the file is not an .npz archive, or was cut off ({source})")]
    NoArchive {
        /// What was found.
        source: zip::result::ZipError,
    },
    /// The archive could not be written or read.
    #[error("{0}")]
    Zip(#[from] zip::result::ZipError),
    /// The file could not be written or read.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// Keeps the kind of an I/O error, so that a full disk is distinguished from a wrong path.
impl From<NpzError> for io::Error {
    fn from(error: NpzError) -> io::Error {
        match error {
            NpzError::Io(error) | NpzError::Zip(zip::result::ZipError::Io(error)) => error,
            error => io::Error::other(error),
        }
    }
}
