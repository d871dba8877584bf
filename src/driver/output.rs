//! Atomic replacement of files, with the errors of operations.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use crate::mesh::io::WriteNote;
use crate::{Error, Warning};

/// Replaces `path` by a new file once `fill` has written all of it.
///
/// # Errors
/// Files that cannot be written.
pub fn replace(path: &Path, fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), Error> {
    crate::output::replace(path, fill).map_err(|error| Error::output(path, &error))
}

/// Writes a file as [`replace`] does, without a look at all others of its folder: for folders of many files.
///
/// # Errors
/// Files that cannot be written.
pub fn add(path: &Path, fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), Error> {
    crate::output::add(path, fill).map_err(|error| Error::output(path, &error))
}

/// Returns the notes of a writer as warnings.
pub fn write_notes(path: &Path, notes: &[WriteNote]) -> Vec<Warning> {
    notes.iter().map(|note| Warning::new(note.code(), format!("{}: {note}", path.display()))).collect()
}
