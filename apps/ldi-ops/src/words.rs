//! The words of a command line before parsing, for the `--json` option of a command line that fails.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};

use clap::CommandFactory;

use crate::args::Arguments;
use crate::output::identity;

/// The words after the program's name, up to `--`.
pub struct Words(Vec<OsString>);

impl Words {
    pub fn new(words: impl Iterator<Item = OsString>) -> Words {
        Words(words.take_while(|word| word != "--").collect())
    }

    /// Returns the name of the command, if any.
    pub fn command(&self) -> Option<String> {
        let word = self.0.iter().find(|word| !word.as_encoded_bytes().starts_with(b"-"))?;
        let command = Arguments::command();
        Some(command.find_subcommand(word)?.get_name().to_owned())
    }

    /// Returns the argument of `--json` and the index of the word that holds it.
    fn json_at(&self) -> Option<(usize, PathBuf)> {
        (0..self.0.len()).rev().find_map(|at| match self.0[at].to_str()? {
            "--json" => Some((at + 1, self.0.get(at + 1)?.into())),
            word => Some((at, word.strip_prefix("--json=")?.into())),
        })
    }

    /// Returns the file of `--json`, or `-`; `None` if no JSON is requested, or if another word names the same file, which may
    /// be an input.
    pub fn json(&self) -> Option<PathBuf> {
        let (at, path) = self.json_at()?;
        let others = self.0.iter().enumerate().filter(|(i, _)| *i != at).map(|(_, word)| word.as_os_str());
        let is_other = |word: &OsStr| {
            // NAME=FILE and --option=FILE.
            let file = word.to_str().and_then(|word| word.split_once('=')).map(|(_, file)| file);
            let is_it = |file: &Path| identity(file) == identity(&path);
            is_it(word.as_ref()) || file.is_some_and(|file| is_it(file.as_ref()))
        };
        let is_apart = path.as_os_str() == "-" || !others.into_iter().any(is_other);
        is_apart.then_some(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Words {
        Words::new(line.split(' ').map(OsString::from))
    }

    #[test]
    fn the_command_and_its_json_are_found_in_any_line() {
        let line = words("--nonsense subtract a.stl --json a.json b.stl --nonsense");
        assert_eq!((line.command().as_deref(), line.json()), (Some("difference"), Some("a.json".into())));
        assert_eq!(words("volume --json=- a.stl").json(), Some("-".into()));
        for without in ["volume a.stl", "volume a.stl --json", "volume -- --json a.json"] {
            assert_eq!(words(without).json(), None, "{without}");
        }
        assert_eq!(words("frobnicate --json -").command(), None);
    }

    #[test]
    fn a_file_that_another_word_names_is_left_alone() {
        for line in [
            "volume a.stl --json a.stl",
            "volume --json=a.stl ./a.stl",
            "csg a a=a.stl --json a.stl",
            "report b.stl --roi=a.stl --json a.stl",
        ] {
            assert_eq!(words(line).json(), None, "{line}");
        }
    }
}
