//! Errors of mesh files, and their places.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use super::Format;

/// The reason why a file name does not determine a mesh format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The name has no extension.
    #[error("{}: the name has no extension; supported are {}", .path.display(), Format::known())]
    NoExtension {
        /// The path as given.
        path: PathBuf,
    },
    /// The extension belongs to no supported format.
    #[error("{}: `.{extension}` is not a supported mesh format; supported are {}", .path.display(), Format::known())]
    Unknown {
        /// The path as given.
        path: PathBuf,
        /// The extension, as spelt.
        extension: String,
    },
    /// The library was built without the format.
    #[error("{}: {format} files are not part of this build; build ldi_ops with the feature `{feature}`", .path.display())]
    NotBuilt {
        /// The path as given.
        path: PathBuf,
        /// The format.
        format: Format,
        /// The feature that has it.
        feature: &'static str,
    },
}

/// The reason why a mesh file could not be read. Every message begins with the file's name.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The extension does not determine the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The file, or a file it refers to, could not be opened or read.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file that failed, which may be a side file of the requested one.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file is valid but has no triangle, which its user cannot have intended.
    #[error("{}: the file has no triangles: {found}", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// The contents found instead.
        found: String,
    },
    /// The file breaks the rules of its format.
    #[error("{}{place}: {problem}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The place in the file.
        place: Place,
        /// The problem there.
        problem: Problem,
    },
    /// The file uses a part of its format that this reader does not support, and without it the shape would be wrong.
    #[error("{}{place}: {feature}", .path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The place in the file.
        place: Place,
        /// The feature used, as a sentence.
        feature: String,
    },
}

/// A place in a file. Lines count from 1, elements and bytes from 0.
///
/// Its text begins with a comma, to follow the file's name, and is empty for the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file.
    Line(usize),
    /// An element that stands on, or ends in, a line of a text file.
    ElementOnLine {
        /// The kind of element, as the format calls it.
        element: &'static str,
        /// Its number among its kind, from 0.
        index: usize,
        /// The line.
        line: usize,
    },
    /// An offset into a binary file.
    Byte(usize),
    /// An element of a file that has no lines.
    Element {
        /// The kind of element, as the format or the file's header calls it.
        element: Cow<'static, str>,
        /// Its number among its kind, from 0.
        index: usize,
    },
    /// A line of a part inside a container.
    Part {
        /// The part's name within the container.
        part: String,
        /// The line.
        line: usize,
    },
}

impl Place {
    pub(super) fn element(element: impl Into<Cow<'static, str>>, index: usize) -> Place {
        Place::Element { element: element.into(), index }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => Ok(()),
            Place::Line(line) => write!(f, ", line {line}"),
            Place::ElementOnLine { element, index, line } => write!(f, ", line {line}, {element} {index}"),
            Place::Byte(offset) => write!(f, ", byte {offset}"),
            Place::Element { element, index } => write!(f, ", {element} {index}"),
            Place::Part { part, line } => write!(f, ", {part} line {line}"),
        }
    }
}

/// A problem at a [`Place`], with the value found and the limit it breaks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// A word that should be a number is not one.
    #[error("`{found}` is not {expected}")]
    NotANumber {
        /// The expected item, with its article.
        expected: &'static str,
        /// The word, shortened and with control characters escaped.
        found: String,
    },
    /// The file holds something other than the format requires.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// The expected item.
        expected: Cow<'static, str>,
        /// The item found, or `the end of the file`.
        found: String,
    },
    /// A reference to something that the file does not contain.
    #[error("{what} {index} is out of range: there are {count}, counted from {first}")]
    IndexOutOfRange {
        /// The kind of thing referred to: a vertex, an accessor.
        what: &'static str,
        /// The index as written in the file.
        index: i64,
        /// Number of such things in the file.
        count: usize,
        /// The first index, as the format counts.
        first: u32,
    },
    /// A file ends before all that its header counts.
    #[error("{promised} {what} declared, {found} found")]
    Short {
        /// The kind of thing counted.
        what: Cow<'static, str>,
        /// The count in the header.
        promised: u64,
        /// Number that the bytes hold.
        found: u64,
    },
    /// A count that is impossible in a file of this size.
    #[error("{promised} {what} declared, which cannot fit in the {bytes} bytes that follow")]
    Impossible {
        /// The kind of thing counted.
        what: Cow<'static, str>,
        /// The count in the header.
        promised: u64,
        /// Number of bytes present.
        bytes: u64,
    },
    /// More than this library supports.
    #[error("{found} {what}; the limit is {limit}")]
    TooMany {
        /// The kind of thing counted.
        what: Cow<'static, str>,
        /// Number found.
        found: u64,
        /// The limit.
        limit: u64,
    },
    /// Any other problem, as a sentence.
    #[error("{0}")]
    Invalid(String),
}

/// A [`ReadError`] from inside a reader, which does not know the file's name.
#[derive(Debug)]
pub(super) enum Fault {
    Io(PathBuf, io::Error),
    Empty(String),
    Malformed(Place, Problem),
    Unsupported(Place, String),
}

impl Fault {
    pub(super) fn invalid(place: Place, sentence: impl Into<String>) -> Fault {
        Fault::Malformed(place, Problem::Invalid(sentence.into()))
    }

    pub(super) fn in_file(self, path: &Path) -> ReadError {
        let path = path.to_path_buf();
        match self {
            Fault::Io(path, source) => ReadError::Io { path, source },
            Fault::Empty(found) => ReadError::Empty { path, found },
            Fault::Malformed(place, problem) => ReadError::Malformed { path, place, problem },
            Fault::Unsupported(place, feature) => ReadError::Unsupported { path, place, feature },
        }
    }
}

/// The reason why a mesh file could not be written. The target is then absent, or as it was before.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The extension does not determine the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The format can be read but not written.
    #[error("{}: cannot write {format} files; supported are {}", .path.display(), Format::written())]
    NoWriter {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
    },
    /// A triangle refers to a position that the mesh does not have.
    #[error("{}: triangle {triangle} refers to position {index}, but the mesh has {count}", .path.display())]
    IndexOutOfRange {
        /// The target.
        path: PathBuf,
        /// The triangle, from 0.
        triangle: usize,
        /// The index of the triangle.
        index: u32,
        /// Number of positions.
        count: usize,
    },
    /// A finite coordinate is beyond the range of the format's numbers.
    #[error("{}: position {position} has the coordinate {value}, beyond the 32-bit range of {format}; write .obj, .ply or .off", .path.display())]
    Overflow {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
        /// The position, from 0.
        position: usize,
        /// The coordinate.
        value: f64,
    },
    /// Rounding to the 32-bit coordinates of the format would change the shape of the mesh.
    #[error(
        "{}: {format} holds 32-bit coordinates, which would move vertices by up to {moved:.1e}: {collapsed} of {triangles} \
         triangles would collapse, and the volume would change from {before:.6e} to {after:.6e}; write .obj, .ply, .off or \
         .3mf, which hold 64 bits, or pass --recentre",
        .path.display()
    )]
    Rounded {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
        /// The largest change of a coordinate, in units of the mesh.
        moved: f64,
        /// Number of triangles that would collapse.
        collapsed: usize,
        /// Number of triangles.
        triangles: usize,
        /// The signed volume of the mesh.
        before: f64,
        /// The signed volume of the rounded mesh.
        after: f64,
    },
    /// A coordinate is infinite or NaN, which the format cannot hold.
    #[error("{}: position {position} has the coordinate {value}, which {format} cannot hold", .path.display())]
    NotFinite {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
        /// The position, from 0.
        position: usize,
        /// The coordinate.
        value: f64,
    },
    /// A coordinate is farther from the origin than programs that read the format allow.
    #[error("{}: position {position} has the coordinate {value}; the limit of {format} is {limit}", .path.display())]
    TooFar {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
        /// The position, from 0.
        position: usize,
        /// The coordinate.
        value: f64,
        /// The largest allowed absolute value.
        limit: f64,
    },
    /// The file would be longer than the format can count.
    #[error("{}: the file would have {bytes} bytes; the limit of {format} is {limit}", .path.display())]
    TooManyBytes {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
        /// Length of the file in bytes.
        bytes: u64,
        /// The format's limit.
        limit: u64,
    },
    /// The mesh has more triangles than the format can count.
    #[error("{}: {triangles} triangles; the limit of {format} is {limit}", .path.display())]
    TooManyTriangles {
        /// The target.
        path: PathBuf,
        /// The format of its extension.
        format: Format,
        /// Number of triangles of the mesh.
        triangles: usize,
        /// The format's limit.
        limit: u32,
    },
    /// The file, or the temporary file beside it, could not be written.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The target.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}
