//! What can be wrong with a mesh file, and where.

use std::borrow::Cow;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use super::Format;

/// Why a name tells no mesh format.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// The name has no extension to go by.
    #[error("{}: the name has no extension; known are {}", .path.display(), Format::known())]
    NoExtension {
        /// The path as given.
        path: PathBuf,
    },
    /// The extension belongs to no format that is read here.
    #[error("{}: `.{extension}` is no mesh format known here; known are {}", .path.display(), Format::known())]
    Unknown {
        /// The path as given.
        path: PathBuf,
        /// The extension, as it was spelt.
        extension: String,
    },
}

/// Why a mesh file could not be read. Every message begins with the file's name.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The extension does not tell the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The file, or a file it refers to, could not be opened or read.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The file that failed, which may be a side file of the one asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is sound but has no triangle, which is never what its user meant to hand over.
    #[error("{}: there are no triangles: {found}", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What was there instead.
        found: String,
    },
    /// The file breaks the rules of its format.
    #[error("{}{place}: {problem}", .path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: Place,
        /// What is wrong there.
        problem: Problem,
    },
    /// The file uses a part of its format that this reader does not understand, and without it the shape would be wrong.
    #[error("{}{place}: {feature}", .path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: Place,
        /// What is used, in a sentence.
        feature: String,
    },
}

/// Where in a file something was found. Lines count from 1, elements and bytes from 0.
///
/// Its text begins with a comma, ready to follow the file's name, and is empty for the file as a whole.
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

/// What is wrong at a [`Place`], with the value found and the limit it breaks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// A word that should be a number is none.
    #[error("`{found}` is not {expected}")]
    NotANumber {
        /// What should stand there, with its article.
        expected: &'static str,
        /// The word, shortened and with control characters escaped.
        found: String,
    },
    /// Something else stands where the format asks for one thing.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What should stand there.
        expected: Cow<'static, str>,
        /// What does, or `the end of the file`.
        found: String,
    },
    /// A reference to something that the file does not have.
    #[error("{what} {index} is out of range: there are {count}, counted from {first}")]
    IndexOutOfRange {
        /// What is referred to: a vertex, an accessor.
        what: &'static str,
        /// The index as the file has it.
        index: i64,
        /// How many there are.
        count: usize,
        /// The first index, by the format's way of counting.
        first: u32,
    },
    /// A file ends before all that it promised.
    #[error("{promised} {what} are promised, {found} are there")]
    Short {
        /// What is counted.
        what: Cow<'static, str>,
        /// The count in the header.
        promised: u64,
        /// How many the bytes hold.
        found: u64,
    },
    /// A count that could not be true of a file of this size.
    #[error("{promised} {what} are promised, which cannot fit in the {bytes} bytes that follow")]
    Impossible {
        /// What is counted.
        what: Cow<'static, str>,
        /// The count in the header.
        promised: u64,
        /// The bytes there are.
        bytes: u64,
    },
    /// More than this library takes.
    #[error("{found} {what}, and at most {limit} can be read")]
    TooMany {
        /// What is counted.
        what: Cow<'static, str>,
        /// How many there are.
        found: u64,
        /// The limit.
        limit: u64,
    },
    /// Anything else, in a sentence of its own.
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

/// Why a mesh file could not be written. Nothing is left at the target then, or what was there before.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The extension does not tell the format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The format is read here but not written.
    #[error("{}: {format} files are not written here; {} are", .path.display(), Format::written())]
    NoWriter {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
    },
    /// A triangle refers to a position that the mesh does not have.
    #[error("{}: triangle {triangle} refers to position {index}, and there are {count}", .path.display())]
    IndexOutOfRange {
        /// The target.
        path: PathBuf,
        /// The triangle, from 0.
        triangle: usize,
        /// The index it holds.
        index: u32,
        /// How many positions there are.
        count: usize,
    },
    /// A finite coordinate is beyond the numbers that the format has.
    #[error("{}: position {position} has the coordinate {value}, beyond the 32-bit numbers of {format}", .path.display())]
    Overflow {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
        /// The position, from 0.
        position: usize,
        /// The coordinate.
        value: f64,
    },
    /// Rounding to the 32-bit coordinates of the format would make another shape of the mesh.
    #[error(
        "{}: {format} holds 32-bit coordinates, which would move vertices by up to {moved:.1e}: {collapsed} of {triangles} \
         triangles would collapse, and the volume would change from {before:.6e} to {after:.6e}; write .obj, .ply, .off or \
         .3mf, which hold 64 bits, or pass --recentre",
        .path.display()
    )]
    Rounded {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
        /// By how much a coordinate would move at most, in units of the mesh.
        moved: f64,
        /// Triangles that would lose their extent.
        collapsed: usize,
        /// How many triangles there are.
        triangles: usize,
        /// The signed volume of the mesh.
        before: f64,
        /// The signed volume of the rounded mesh.
        after: f64,
    },
    /// A coordinate is infinite or not a number, and the format has no such numbers.
    #[error("{}: position {position} has the coordinate {value}, which {format} cannot hold", .path.display())]
    NotFinite {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
        /// The position, from 0.
        position: usize,
        /// The coordinate.
        value: f64,
    },
    /// A coordinate is farther from the origin than programs that read the format allow.
    #[error("{}: position {position} has the coordinate {value}, and {format} goes to {limit}", .path.display())]
    TooFar {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
        /// The position, from 0.
        position: usize,
        /// The coordinate.
        value: f64,
        /// The largest that is allowed, of either sign.
        limit: f64,
    },
    /// The file would be longer than the format can count.
    #[error("{}: the file would have {bytes} bytes, and {format} can count {limit}", .path.display())]
    TooManyBytes {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
        /// How many bytes the file would have.
        bytes: u64,
        /// The most the format has room for.
        limit: u64,
    },
    /// The mesh has more triangles than the format can count.
    #[error("{}: {triangles} triangles, and {format} can count {limit}", .path.display())]
    TooManyTriangles {
        /// The target.
        path: PathBuf,
        /// The format its extension tells.
        format: Format,
        /// How many the mesh has.
        triangles: usize,
        /// The most the format has room for.
        limit: u32,
    },
    /// The file, or the temporary file beside it, could not be written.
    #[error("{}: {source}", .path.display())]
    Io {
        /// The target.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}
