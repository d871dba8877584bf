//! Opening of input files: ordinary files only, so that no read blocks or continues for ever.

use std::fs::{self, File, FileType};
use std::io;
use std::path::Path;

/// Opens an ordinary file.
///
/// # Errors
/// Fails if there is no such file, or if it is a folder, a pipe, a device or a socket: opening a pipe may block for
/// ever, and a device may have no end.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    if kind.is_file() {
        return File::open(path);
    }
    let message = format!("is {}, but an input must be a regular file; save the contents to one first", name(kind));
    Err(io::Error::new(io::ErrorKind::InvalidInput, message))
}

/// Returns the kind of a file that is not an ordinary one.
fn name(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "a pipe";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    if kind.is_dir() { "a folder" } else { "not a regular file" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        assert_eq!(open(&path).unwrap_err().kind(), io::ErrorKind::NotFound);
        fs::write(&path, "a").unwrap();
        assert!(open(&path).is_ok());
        assert!(open(folder.path()).unwrap_err().to_string().contains("is a folder"));
        #[cfg(unix)]
        assert!(open(Path::new("/dev/zero")).unwrap_err().to_string().contains("is a device"));
    }
}
