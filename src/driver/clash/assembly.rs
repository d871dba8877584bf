//! Lists of parts with their places, `.toml`.

use std::fmt::Display;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::is_list;
use crate::driver::job::Input;
use crate::mesh::io::Format;
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
    if path.is_dir() {
        return Err(Error::input(format!("{name}: is a folder; give it as a part, without --assembly")));
    }
    if path.exists() && Format::from_path(path).is_ok() {
        return Err(Error::input(format!("{name}: is a mesh; give it as a part, without --assembly")));
    }
    let text = input::open(path).and_then(std::io::read_to_string).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => Error::input(format!("{name}: is not text; a list of parts is a TOML file")),
        _ => Error::input(format!("{name}: {error}")),
    })?;
    let list: List = toml::from_str(&text).map_err(|error| Error::input(format!("{name}: {error}")))?;
    if list.part.is_empty() {
        return Err(Error::input(format!("{name}: the list has no [[part]]")));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let source = |(i, Entry { file, name: given, transform }): (usize, Entry)| {
        let refused = |why: &dyn Display| Error::input(format!("{name}: part {}: {why}", i + 1));
        let placement = transform.as_deref().map(str::parse).transpose();
        let placement = placement.map_err(|error| refused(&format_args!("transform: {error}")))?;
        let path = folder.join(&file);
        let file = file.display();
        match () {
            _ if given.as_deref() == Some("") => Err(refused(&"the name is empty")),
            _ if is_list(&path) => Err(refused(&format_args!("{file}: lists cannot be parts of lists"))),
            _ if !path.exists() || path == folder => Err(refused(&format_args!("no file `{file}`"))),
            _ => Ok(Input { name: given, path, placement }),
        }
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
        fs::write(folder.path().join("bolt.stl"), "").unwrap();
        read(&path).map_err(|error| error.to_string().replace(&path.display().to_string(), "list.toml"))
    }

    #[test]
    fn parts_have_files_names_and_places() {
        let text = "[[part]]\nfile = \"bolt.stl\"\nname = \"M3\"\ntransform = \"translate(1,0,0)\"\n[[part]]\nfile = \"bolt.stl\"\n";
        let parts = listed(text).unwrap();
        assert!(parts[0].path.ends_with("bolt.stl") && parts[0].path.is_absolute());
        assert_eq!((parts[0].name.as_deref(), parts[0].placement.is_some()), (Some("M3"), true));
        assert_eq!((&parts[1].path, parts[1].placement.is_none()), (&parts[0].path, true));
    }

    #[test]
    fn errors_name_the_list_and_the_part() {
        let message = |text: &str| listed(text).err().unwrap();
        assert_eq!(message(""), "list.toml: the list has no [[part]]");
        for (part, why) in [
            ("file = \"\"", "no file ``"),
            ("file = \"nut.stl\"", "no file `nut.stl`"),
            ("file = \"list.toml\"", "list.toml: lists cannot be parts of lists"),
            ("file = \"bolt.stl\"\nname = \"\"", "the name is empty"),
        ] {
            assert_eq!(message(&format!("[[part]]\n{part}")), format!("list.toml: part 1: {why}"));
        }
        for (path, why) in [("data", "is a folder"), ("data/models/sphere.stl", "is a mesh")] {
            assert!(read(Path::new(path)).unwrap_err().to_string().contains(why), "{path}");
        }
        assert!(message("[[part]]\nfile = 3").starts_with("list.toml: "));
        assert!(message("[[part]]\nfile = \"a\"\nplace = \"b\"").contains("place"));
        assert!(
            message("[[part]]\nfile = \"a\"\ntransform = \"turn(3)\"").starts_with("list.toml: part 1: transform: ")
        );
    }
}
