//! Mesh files, one module for each format.
//!
//! [`read`] reads STL, OBJ, PLY, OFF, glTF, GLB and 3MF; [`write()`] writes all of them but glTF in text. Readers
//! return what the file holds: vertices are not welded (but for corners of binary STL that stand close together in the
//! file), coordinates that are not finite are kept for the mesh check to report, and text is parsed as `f64`.
//! [`MeshFile::notes`] lists what a reader had to change or leave out; where a file breaks the rules of its format, the
//! [`ReadError`] names the place and the value.
//!
//! No reader trusts a count in a header before it has seen the bytes that it counts, so that memory stays in proportion
//! to the file. Instances are the exception by their nature, and have a limit of their own (`placement`).

mod error;
mod formatted;
#[cfg(feature = "gltf")]
mod gltf;
mod note;
#[cfg(feature = "obj")]
mod obj;
#[cfg(feature = "off")]
mod off;
mod placement;
#[cfg(feature = "ply")]
mod ply;
mod polygon;
#[cfg(feature = "stl")]
mod stl;
mod text;
#[cfg(feature = "3mf")]
mod threemf;
mod write;

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::{Fold, LengthUnit, Precision, TriangleMesh};
use crate::cancel::checkpoint;
use crate::input;
use error::Fault;
pub use error::{FormatError, Place, Problem, ReadError, WriteError};
pub use note::{ReadNote, WriteNote};
use placement::Scene;
pub use write::{Written, write, write_at};

/// Lines, faces or elements of a file from one checkpoint to the next.
const BETWEEN_CHECKPOINTS: usize = 1 << 12;

/// Reaches a checkpoint after many lines, faces or elements of a file, of which `number` are done.
#[inline]
fn checkpoint_at(number: usize) {
    if number % BETWEEN_CHECKPOINTS == BETWEEN_CHECKPOINTS - 1 {
        checkpoint();
    }
}

/// A mesh file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Stereolithography, binary or text.
    Stl,
    /// Wavefront OBJ.
    Obj,
    /// The Stanford polygon format, binary or text.
    Ply,
    /// Geomview's object file format, in text.
    Off,
    /// glTF 2.0 with its buffers beside it or inside it as text.
    Gltf,
    /// glTF 2.0 in one binary file.
    Glb,
    /// The 3D Manufacturing Format.
    ThreeMf,
}

impl Format {
    /// Every format, in the order in which messages list them.
    pub const ALL: [Format; 7] =
        [Format::Stl, Format::Obj, Format::Ply, Format::Off, Format::Gltf, Format::Glb, Format::ThreeMf];

    /// Returns the format of a path's extension, in any case of letters.
    pub fn from_path(path: &Path) -> Result<Format, FormatError> {
        let Some(extension) = path.extension() else {
            return Err(FormatError::NoExtension { path: path.to_path_buf() });
        };
        let extension = extension.to_string_lossy();
        let named = Format::ALL.into_iter().find(|format| format.extension().eq_ignore_ascii_case(&extension));
        match named {
            Some(format) if format.is_built() => Ok(format),
            Some(format) => Err(format.not_built(path)),
            None => Err(FormatError::Unknown { path: path.to_path_buf(), extension: extension.into_owned() }),
        }
    }

    /// Returns whether this build reads and writes the format: whether its feature is on.
    pub fn is_built(self) -> bool {
        match self {
            Format::Stl => cfg!(feature = "stl"),
            Format::Obj => cfg!(feature = "obj"),
            Format::Ply => cfg!(feature = "ply"),
            Format::Off => cfg!(feature = "off"),
            Format::Gltf | Format::Glb => cfg!(feature = "gltf"),
            Format::ThreeMf => cfg!(feature = "3mf"),
        }
    }

    fn not_built(self, path: &Path) -> FormatError {
        let feature = if self == Format::Glb { "gltf" } else { self.extension() };
        FormatError::NotBuilt { path: path.to_path_buf(), format: self, feature }
    }

    /// Returns the extension, in lower case and without a dot.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Stl => "stl",
            Format::Obj => "obj",
            Format::Ply => "ply",
            Format::Off => "off",
            Format::Gltf => "gltf",
            Format::Glb => "glb",
            Format::ThreeMf => "3mf",
        }
    }

    /// Returns whether [`write()`] can write this format.
    pub fn is_written(self) -> bool {
        !matches!(self, Format::Gltf)
    }

    /// Returns whether a file holds the place to which its coordinates are relative; see [`write_at`].
    pub fn holds_place(self) -> bool {
        matches!(self, Format::Glb | Format::ThreeMf)
    }

    /// Returns the precision of coordinates in files that [`write()`] writes.
    pub fn precision(self) -> Precision {
        match self {
            Format::Stl | Format::Gltf | Format::Glb => Precision::Single,
            Format::Obj | Format::Ply | Format::Off | Format::ThreeMf => Precision::Double,
        }
    }

    /// Returns the extensions of all supported formats, as messages list them.
    fn known() -> String {
        let built: Vec<Format> = Format::ALL.into_iter().filter(|format| format.is_built()).collect();
        Format::list(&built)
    }

    /// Returns the extensions of all formats that can be written.
    fn written() -> String {
        let written: Vec<Format> =
            Format::ALL.into_iter().filter(|format| format.is_built() && format.is_written()).collect();
        Format::list(&written)
    }

    fn list(formats: &[Format]) -> String {
        let names: Vec<String> = formats.iter().map(|format| format!(".{}", format.extension())).collect();
        match names.split_last() {
            Some((last, [])) => last.clone(),
            Some((last, others)) => format!("{} and {last}", others.join(", ")),
            None => String::new(),
        }
    }
}

/// Writes the usual name: `STL`, `OBJ`, `PLY`, `OFF`, `glTF`, `GLB`, `3MF`.
impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Format::Stl => "STL",
            Format::Obj => "OBJ",
            Format::Ply => "PLY",
            Format::Off => "OFF",
            Format::Gltf => "glTF",
            Format::Glb => "GLB",
            Format::ThreeMf => "3MF",
        })
    }
}

/// The contents of a mesh file.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshFile {
    /// All triangles of the file, at least one, as one mesh.
    ///
    /// Every index is in range. Nothing else is guaranteed.
    pub mesh: TriangleMesh,
    /// The length of one unit of the coordinates, where the format or the file states it.
    pub unit: Option<LengthUnit>,
    /// Notes for the user about how the file was read.
    pub notes: Vec<ReadNote>,
}

impl MeshFile {
    fn unitless(mesh: TriangleMesh, notes: Vec<ReadNote>) -> MeshFile {
        MeshFile { mesh, unit: None, notes }
    }
}

/// The contents of a mesh file, its instances apart.
#[derive(Clone, Debug, PartialEq)]
pub struct PartsFile {
    /// The instances that have triangles, at least one, in the coordinates of the file.
    pub meshes: Vec<NamedMesh>,
    /// The length of one unit of the coordinates, where the format or the file states it.
    pub unit: Option<LengthUnit>,
    /// Notes for the user about how the file was read.
    pub notes: Vec<ReadNote>,
}

/// A mesh with the name that its file gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMesh {
    /// The name of the instance; `None` in formats that hold one mesh.
    pub name: Option<String>,
    /// The triangles. Every index is in range; nothing else is guaranteed.
    pub mesh: TriangleMesh,
}

/// Reads a mesh file, by its extension.
pub fn read(path: &Path) -> Result<MeshFile, ReadError> {
    let format = Format::from_path(path)?;
    examine(path, format)?;
    let bytes = load(path).map_err(|source| ReadError::Io { path: path.to_path_buf(), source })?;
    parse(&bytes, format, path)
}

/// Files below this size, in bytes, are read whatever they hold.
const SMALL: u64 = 4 << 20;

/// Checks the first and last bytes of a large file before the rest takes memory.
///
/// Refuses text that ends in bytes 0, and a binary file of more than twice the bytes that its header counts.
pub fn examine(path: &Path, format: Format) -> Result<(), ReadError> {
    let failure = |source| ReadError::Io { path: path.to_path_buf(), source };
    let mut file = input::open(path).map_err(failure)?;
    let length = file.metadata().map_err(failure)?.len();
    if length < SMALL {
        return Ok(());
    }
    let (mut start, mut end) = ([0; 1024], [0; 64]);
    let at = length - end.len() as u64;
    file.read_exact(&mut start).map_err(failure)?;
    file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut end)).map_err(failure)?;
    // The zeros may begin early.
    let head = &start[..start.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1)];
    let fault = match format {
        _ if is_text(format, head) && end.iter().all(|&byte| byte == 0) => {
            Fault::invalid(Place::File, "the text ends with zero bytes; remove them")
        }
        _ => match binary_length(format, &start) {
            Some(counted) if length - SMALL > 2 * counted => {
                let sentence =
                    format!("the header declares {counted} bytes, but the file has {length}; truncate it there");
                Fault::invalid(Place::File, sentence)
            }
            _ => return Ok(()),
        },
    };
    Err(fault.in_file(path))
}

/// Returns whether a file is text, by its first bytes and its format.
fn is_text(format: Format, start: &[u8]) -> bool {
    // UTF-16 contains many bytes 0.
    let is_wide = [&[0xFF, 0xFE], &[0xFE, 0xFF]].iter().any(|mark| start.starts_with(*mark));
    !is_wide
        && match format {
            Format::Obj | Format::Off => true,
            Format::Gltf => !start.starts_with(b"glTF"),
            #[cfg(feature = "stl")]
            Format::Stl => stl::is_text(start),
            #[cfg(feature = "ply")]
            Format::Ply => ply::is_text(start),
            _ => false,
        }
}

/// Returns the length in bytes that a binary file has by its header, where the format states it at the start.
fn binary_length(format: Format, start: &[u8]) -> Option<u64> {
    match format {
        #[cfg(feature = "stl")]
        Format::Stl => stl::binary_length(start),
        #[cfg(feature = "gltf")]
        Format::Gltf | Format::Glb => gltf::binary_length(start),
        _ => None,
    }
}

/// Reads all bytes of a file.
fn load(path: &Path) -> io::Result<Vec<u8>> {
    let file = input::open(path)?;
    let length = file.metadata()?.len();
    // One byte more, so that the end is detected without reallocation.
    let room = usize::try_from(length).unwrap_or_default().saturating_add(1);
    let mut bytes = crate::allocation::try_vec_with_room(room)?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the files that a mesh file refers to: buffers and images of glTF. Empty where the file cannot be read.
pub fn side_files(path: &Path) -> Vec<PathBuf> {
    match Format::from_path(path) {
        #[cfg(feature = "gltf")]
        Ok(format @ (Format::Gltf | Format::Glb)) if examine(path, format).is_ok() => {
            load(path).map_or(Vec::new(), |bytes| gltf::side_files(&bytes, path))
        }
        _ => Vec::new(),
    }
}

/// Parses a mesh from the bytes of a file. The path names the file in errors, and buffers that a glTF file refers to
/// are looked up beside it; the path itself is not opened.
pub fn parse(bytes: &[u8], format: Format, path: &Path) -> Result<MeshFile, ReadError> {
    Ok(parse_folded(bytes, format, path)?.0)
}

/// Reads an opened file piece by piece, so that its bytes are never in memory together, and folds its triangles for the mesh
/// check. Returns `None` for files that have to be parsed as a whole: all but binary STL of the length that its header counts.
#[cfg_attr(not(all(unix, feature = "stl")), expect(unused_variables))]
pub(crate) fn stream(file: &File, length: u64, format: Format) -> io::Result<Option<(MeshFile, Fold)>> {
    match format {
        #[cfg(all(unix, feature = "stl"))]
        Format::Stl => stl::stream(file, length),
        _ => Ok(None),
    }
}

/// Parses as [`parse`] does, and returns the fold of the triangles for the mesh check where the reader has made it.
pub(crate) fn parse_folded(bytes: &[u8], format: Format, path: &Path) -> Result<(MeshFile, Option<Fold>), ReadError> {
    let mut fold = None;
    let parsed: Result<MeshFile, Fault> = match format {
        _ if bytes.is_empty() => Err(Fault::Empty("the file has no bytes".to_owned())),
        #[cfg(feature = "stl")]
        Format::Stl => stl::parse(bytes).map(|(file, found)| {
            fold = found;
            file
        }),
        #[cfg(feature = "obj")]
        Format::Obj => obj::parse(bytes),
        #[cfg(feature = "ply")]
        Format::Ply => ply::parse(bytes),
        #[cfg(feature = "off")]
        Format::Off => off::parse(bytes),
        #[cfg(feature = "gltf")]
        Format::Gltf | Format::Glb => gltf::parse(bytes, format, path).and_then(Scene::merged),
        #[cfg(feature = "3mf")]
        Format::ThreeMf => threemf::parse(bytes).and_then(Scene::merged),
        #[cfg(not(feature = "cpu"))]
        _ => return Err(format.not_built(path).into()),
    };
    let file = parsed.map_err(|fault| fault.in_file(path))?;
    if file.mesh.triangles.is_empty() {
        let found = format!("the file has {} vertices and no faces", file.mesh.positions.len());
        return Err(ReadError::Empty { path: path.to_path_buf(), found });
    }
    Ok((file, fold))
}

/// Parses the meshes of a file as [`parse`] does, but keeps the instances of glTF and 3MF apart: the nodes with a mesh,
/// and the objects with triangles.
pub fn parse_parts(bytes: &[u8], format: Format, path: &Path) -> Result<PartsFile, ReadError> {
    let scene: Result<Scene, Fault> = match format {
        #[cfg(feature = "gltf")]
        Format::Gltf | Format::Glb if !bytes.is_empty() => gltf::parse(bytes, format, path),
        #[cfg(feature = "3mf")]
        Format::ThreeMf if !bytes.is_empty() => threemf::parse(bytes),
        _ => {
            let MeshFile { mesh, unit, notes } = parse(bytes, format, path)?;
            return Ok(PartsFile { meshes: vec![NamedMesh { name: None, mesh }], unit, notes });
        }
    };
    let file = scene.and_then(Scene::apart).map_err(|fault| fault.in_file(path))?;
    if file.meshes.is_empty() {
        return Err(ReadError::Empty { path: path.to_path_buf(), found: "no object has a face".to_owned() });
    }
    Ok(file)
}

#[cfg(all(test, feature = "cpu"))]
mod round_trips;
#[cfg(all(test, feature = "cpu"))]
mod tests;
