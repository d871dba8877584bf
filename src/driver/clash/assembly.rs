//! Lists of parts with their places, `.toml`.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::driver::job::Input;
use crate::{Error, input};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    #[serde(default)]
    part: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    file: PathBuf,
    name: Option<String>,
    transform: Option<String>,
}

/// Reads a list of parts. Paths are relative to the folder of the list.
///
/// # Errors
/// Files that cannot be read or are no list of parts, and placements that cannot be parsed, with the number of the part.
pub fn read(path: &Path) -> Result<Vec<Input>, Error> {
    let name = path.display();
    let text = input::open(path)
        .and_then(std::io::read_to_string)
        .map_err(|error| Error::input(format!("{name}: {error}")))?;
    let list: List = toml::from_str(&text).map_err(|error| Error::input(format!("{name}: {error}")))?;
    if list.part.is_empty() {
        return Err(Error::input(format!("{name}: the list has no [[part]]")));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let source = |(i, entry): (usize, Entry)| {
        let placement = entry.transform.as_deref().map(str::parse).transpose();
        let placement =
            placement.map_err(|error| Error::input(format!("{name}: transform of part {}: {error}", i + 1)))?;
        Ok(Input { name: entry.name, path: folder.join(entry.file), placement })
    };
    list.part.into_iter().enumerate().map(source).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn listed(text: &str) -> Result<Vec<Input>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.toml");
        fs::write(&path, text).unwrap();
        read(&path).map_err(|error| error.to_string().replace(&path.display().to_string(), "list.toml"))
    }

    #[test]
    fn parts_have_files_names_and_places() {
        let text = "[[part]]\nfile = \"bolt.stl\"\nname = \"M3\"\ntransform = \"translate(1,0,0)\"\n[[part]]\nfile = \"/a.stl\"\n";
        let parts = listed(text).unwrap();
        assert!(parts[0].path.ends_with("bolt.stl") && parts[0].path.is_absolute());
        assert_eq!((parts[0].name.as_deref(), parts[0].placement.is_some()), (Some("M3"), true));
        assert_eq!((parts[1].path.as_path(), parts[1].placement.is_none()), (Path::new("/a.stl"), true));
    }

    #[test]
    fn errors_name_the_list_and_the_part() {
        let message = |text: &str| listed(text).err().unwrap();
        assert_eq!(message(""), "list.toml: the list has no [[part]]");
        assert!(message("[[part]]\nfile = 3").starts_with("list.toml: "));
        assert!(message("[[part]]\nfile = \"a\"\nplace = \"b\"").contains("place"));
        assert!(
            message("[[part]]\nfile = \"a\"\ntransform = \"turn(3)\"").starts_with("list.toml: transform of part 1: ")
        );
    }
}
