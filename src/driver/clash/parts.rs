//! Reading of parts: files, folders, assemblies.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::parallel::*;

use super::{ClashJob, Part};
use crate::driver::bytes;
use crate::driver::input::{self, InputRequirements, Solid};
use crate::driver::job::Input;
use crate::mesh::io::{self, Format, NamedMesh, PartsFile, ReadError, ReadNote};
use crate::progress::Monitor;
use crate::{Error, Warning};

/// Reads the parts of a job, and brings them to one unit.
pub fn read(job: &ClashJob, progress: &Monitor) -> Result<(Vec<Part>, Vec<Warning>), Error> {
    let sources = sources(job)?;
    input::admit_files(sources.iter().map(|source| source.path.as_path()), job.settings.memory)?;
    let requirements = super::requirements(job.unit, job.settings.fill);
    progress.expect(sources.len())?;
    let names = names_of_files(&sources);
    let read: Vec<Result<Vec<Part>, Error>> = sources
        .par_iter()
        .zip(&names)
        .map(|(source, name)| {
            let parts = parts_of(source, name, requirements);
            progress.step()?;
            parts
        })
        .collect();
    let mut parts: Vec<Part> = read.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    number_equal_names(&mut parts);
    let (mut solids, rest): (Vec<Solid>, Vec<(String, PathBuf)>) =
        parts.into_iter().map(|part| (part.solid, (part.name, part.path))).unzip();
    let warnings = input::ready(&mut solids, requirements)?;
    let parts = solids.into_iter().zip(rest).map(|(solid, (name, path))| Part { name, path, solid }).collect();
    Ok((parts, warnings))
}

/// Returns the files of a job: the named ones, those of the assembly, and those in named folders by their names.
fn sources(job: &ClashJob) -> Result<Vec<Input>, Error> {
    if let Some(list) = job.inputs.iter().find(|input| super::is_list(&input.path) && input.path.exists()) {
        let list = list.path.display();
        return Err(Error::input(format!("{list}: is not a mesh file; a list of parts is given by --assembly {list}")));
    }
    let listed = match &job.assembly {
        None => Vec::new(),
        #[cfg(feature = "report")]
        Some(path) => super::assembly::read(path)?,
        #[cfg(not(feature = "report"))]
        Some(path) => {
            let list = path.display();
            return Err(Error::input(format!(
                "{list}: build ldi_ops with the feature `report` to read lists of parts"
            )));
        }
    };
    let mut sources = Vec::new();
    for input in job.inputs.iter().cloned().chain(listed) {
        let Input { name, path, placement } = &input;
        if !path.is_dir() {
            sources.push(input);
            continue;
        }
        let failure = |error: std::io::Error| Error::input(format!("{}: {error}", path.display()));
        let entries = fs::read_dir(path).map_err(failure)?;
        let mut files: Vec<PathBuf> =
            entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>().map_err(failure)?;
        files.retain(|file| Format::from_path(file).is_ok() && file.is_file());
        if files.is_empty() {
            return Err(Error::input(format!("{}: the folder has no mesh files", path.display())));
        }
        files.sort();
        sources.extend(files.into_iter().map(|path| {
            let name = name.as_ref().map(|name| format!("{name}/{}", short(&path)));
            Input { name, path, placement: *placement }
        }));
    }
    Ok(sources)
}

/// Returns the name of a file without its folder.
fn short(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).display().to_string()
}

/// Returns the name of each source: that of its file, or its path if other files have that name.
fn names_of_files(sources: &[Input]) -> Vec<String> {
    let mut paths: HashMap<String, &Path> = HashMap::new();
    let mut is_shared: HashMap<String, bool> = HashMap::new();
    for Input { path, .. } in sources {
        let first = *paths.entry(short(path)).or_insert(path);
        *is_shared.entry(short(path)).or_default() |= first != path;
    }
    let name = |source: &Input| match (&source.name, short(&source.path)) {
        (Some(name), _) => name.clone(),
        (None, short) if is_shared[&short] => source.path.display().to_string(),
        (None, short) => short,
    };
    sources.iter().map(name).collect()
}

/// Gives parts of equal names numbers.
fn number_equal_names(parts: &mut [Part]) {
    let names = distinct(parts.iter().map(|part| part.name.as_str()).collect());
    for (part, name) in parts.iter_mut().zip(names) {
        if part.name != name {
            part.solid.path = PathBuf::from(&name);
            part.name = name;
        }
    }
}

/// Appends `#2`, `#3` … to names that occurred before, and leaves out numbers that another name has already.
fn distinct(names: Vec<&str>) -> Vec<String> {
    let given: HashSet<&str> = names.iter().copied().collect();
    let mut counts: HashMap<&str, usize> = HashMap::new();
    let numbered = |name| {
        let count = counts.entry(name).or_default();
        loop {
            *count += 1;
            match *count {
                1 => return name.to_owned(),
                count => {
                    let numbered = format!("{name}#{count}");
                    if !given.contains(numbered.as_str()) {
                        return numbered;
                    }
                }
            }
        }
    };
    names.iter().copied().map(numbered).collect()
}

/// Reads, places and checks the parts of a file.
fn parts_of(source: &Input, name: &str, requirements: InputRequirements) -> Result<Vec<Part>, Error> {
    let Input { path, placement, .. } = source;
    let PartsFile { meshes, unit, notes } = parse(path)?;
    let beams = notes.iter().find(|note| matches!(note, ReadNote::BeamsMeshed { .. })).map(ToString::to_string);
    let mut warnings: Vec<Warning> =
        notes.iter().map(|note| Warning::new(note.code(), format!("{}: {note}", path.display()))).collect();
    let map = placement.as_ref().map(|placement| placement.map(unit.or(requirements.unit)));
    let map = map.transpose().map_err(|error| Error::input(format!("{}: {error}", path.display())))?;
    let part = |NamedMesh { name: own, mut mesh }| {
        let name = own.map_or_else(|| name.to_owned(), |own| format!("{name}/{own}"));
        // Shells are found by the numbers of corners, and a file of loose triangles repeats each corner six times.
        if mesh.positions.len() > mesh.triangles.len() {
            mesh.weld();
        }
        if let Some(map) = &map {
            mesh.transform(map);
        }
        let mut solid = input::solid_of_mesh(mesh, Path::new(&name), requirements)?;
        (solid.stated_unit, solid.unit, solid.beams) = (unit, unit.or(requirements.unit), beams.clone());
        solid.warnings = std::mem::take(&mut warnings);
        Ok(Part { name, path: path.clone(), solid })
    };
    meshes.into_iter().map(part).collect()
}

/// Parses a mesh file, its instances apart, or a file of images, whose surface is the mesh.
fn parse(path: &Path) -> Result<PartsFile, Error> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npz")) {
        let file = input::read(path, false)?.file;
        return Ok(PartsFile {
            meshes: vec![NamedMesh { name: None, mesh: file.mesh }],
            unit: file.unit,
            notes: file.notes,
        });
    }
    let format = input::format_of(path)?;
    io::examine(path, format).map_err(Error::input)?;
    let bytes = bytes::open(path).and_then(|(file, length)| bytes::of_file(file, length)).map_err(|source| {
        let is_memory = source.kind() == ErrorKind::OutOfMemory;
        let error = ReadError::Io { path: path.to_path_buf(), source };
        if is_memory { Error::machine(error) } else { Error::input(error) }
    })?;
    io::parse_parts(&bytes, format, path).map_err(Error::input)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(paths: &[&str]) -> Vec<String> {
        let source = |path: &&str| Input { name: None, path: PathBuf::from(path), placement: None };
        names_of_files(&paths.iter().map(source).collect::<Vec<_>>())
    }

    #[test]
    fn files_of_equal_names_are_named_by_their_paths() {
        assert_eq!(named(&["x/a.stl", "x/b.stl"]), ["a.stl", "b.stl"]);
        assert_eq!(named(&["x/a.stl", "y/a.stl", "b.stl"]), ["x/a.stl", "y/a.stl", "b.stl"]);
        assert_eq!(named(&["x/a.stl", "x/a.stl"]), ["a.stl", "a.stl"]);
    }

    #[test]
    fn equal_names_get_numbers_that_no_other_name_has() {
        assert_eq!(distinct(vec!["a", "b", "a", "a"]), ["a", "b", "a#2", "a#3"]);
        assert_eq!(distinct(vec!["a", "a", "a#2", "a"]), ["a", "a#3", "a#2", "a#4"]);
        assert_eq!(distinct(vec!["a#2", "a#2", "a", "a"]), ["a#2", "a#2#2", "a", "a#3"]);
    }
}
