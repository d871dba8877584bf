//! Files that the program writes; [`ldi_ops::output`] puts them in place.

use std::fs;
use std::path::{Path, PathBuf};

pub use ldi_ops::driver::output::replace;

/// Returns the folder of a path.
pub fn folder(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The identity of a file, independent of the path to it.
#[derive(Debug, PartialEq, Eq, Hash)]
pub enum Identity {
    /// An existing file: its device and its number on it, which symbolic and hard links share.
    #[cfg(unix)]
    Existing(u64, u64),
    /// A path without links, `.` and `..`, as far as the file system can resolve it.
    Place(PathBuf),
}

/// Returns the identity of the file at a path, which need not exist yet.
pub fn identity(path: &Path) -> Identity {
    #[cfg(unix)]
    if let Ok(metadata) = fs::metadata(path) {
        use std::os::unix::fs::MetadataExt;
        return Identity::Existing(metadata.dev(), metadata.ino());
    }
    let target = ldi_ops::output::link_target(path);
    let known = target.ancestors().find_map(|known| {
        let place = fs::canonicalize(if known.as_os_str().is_empty() { Path::new(".") } else { known }).ok()?;
        Some(place.join(target.strip_prefix(known).ok()?))
    });
    Identity::Place(known.unwrap_or(target))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_to_a_file_has_its_identity() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a"), "a").unwrap();
        fs::write(at("b"), "a").unwrap();
        fs::create_dir(at("inner")).unwrap();
        assert_eq!(identity(&at("a")), identity(&at("./inner/../a")));
        assert_ne!(identity(&at("a")), identity(&at("b")));
        // Files and folders that do not exist yet.
        assert_eq!(identity(&at("c")), identity(&at("inner/../c")));
        assert_eq!(identity(&at("new/x/c")), identity(&at("inner/../new/x/c")));
        assert_ne!(identity(&at("new/x/c")), identity(&at("new/y/c")));
        #[cfg(unix)]
        {
            use std::os::unix::fs::symlink;
            fs::hard_link(at("a"), at("hard")).unwrap();
            symlink("a", at("soft")).unwrap();
            symlink("../c", at("inner/dangling")).unwrap();
            symlink("inner", at("linked")).unwrap();
            assert_eq!(identity(&at("a")), identity(&at("hard")));
            assert_eq!(identity(&at("a")), identity(&at("soft")));
            assert_eq!(identity(&at("c")), identity(&at("linked/dangling")));
        }
    }
}
