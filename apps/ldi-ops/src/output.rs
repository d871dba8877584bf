//! Files that the program writes; how they are put in place is [`ldi_ops::output`]'s to say.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use crate::exit::Failure;

/// Puts a new file in place of `path` once `fill` has written all of it.
pub fn replace(path: &Path, fill: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), Failure> {
    ldi_ops::output::replace(path, fill).map_err(|error| Failure::output(path, &error))
}

/// The folder that a path lies in.
pub fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether two paths lead to the same file, be it there yet or not.
pub fn is_same(a: &Path, b: &Path) -> bool {
    place(a) == place(b)
}

/// A path without links, `.` and `..`, as far as the file system knows it.
fn place(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| {
        let folder = fs::canonicalize(folder(path)).unwrap_or_default();
        folder.join(path.file_name().unwrap_or_default())
    })
}
