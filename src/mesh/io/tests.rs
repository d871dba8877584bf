//! What holds for all formats: names, notes, hostile bytes, and files as they are written.

use std::path::PathBuf;

use glam::DVec3;

use super::*;

fn sample_path(format: Format) -> PathBuf {
    PathBuf::from(format!("sample.{}", format.extension()))
}

/// The file that the bytes are, which must be readable.
pub(super) fn parsed(bytes: &[u8], format: Format) -> MeshFile {
    parse(bytes, format, &sample_path(format)).unwrap_or_else(|error| panic!("{error}"))
}

/// The text of the error that the bytes must give.
pub(super) fn error(bytes: &[u8], format: Format) -> String {
    match parse(bytes, format, &sample_path(format)) {
        Ok(file) => panic!("read without an error: {file:?}"),
        Err(error) => error.to_string(),
    }
}

pub(super) fn points(coordinates: &[[f64; 3]]) -> Vec<DVec3> {
    coordinates.iter().copied().map(DVec3::from).collect()
}

/// The text in UTF-16 with its byte order mark.
pub(super) fn utf_16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
    "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(bytes).collect()
}

#[test]
fn extensions_tell_formats_in_any_case() {
    for (name, format) in [("a.stl", Format::Stl), ("b/A.3MF", Format::ThreeMf), ("x.y.GlTf", Format::Gltf)] {
        assert_eq!(Format::from_path(Path::new(name)), Ok(format));
    }
    let error = |name: &str| Format::from_path(Path::new(name)).unwrap_err().to_string();
    let known = "known are .stl, .obj, .ply, .off, .gltf, .glb and .3mf";
    assert_eq!(error("part.step"), format!("part.step: `.step` is no mesh format known here; {known}"));
    assert_eq!(error("dir.stl/part"), format!("dir.stl/part: the name has no extension; {known}"));
}

#[test]
fn notes_have_codes_and_sentences() {
    let note = ReadNote::BeamsLeftOut { count: 7 };
    assert_eq!((note.code(), note.to_string().as_str()), ("beams-left-out", "beams of beam lattices left out: 7"));
}

#[test]
fn files_that_are_not_there_are_named() {
    let error = read(Path::new("no/such.stl")).unwrap_err().to_string();
    assert!(error.starts_with("no/such.stl: "), "{error}");
}

fn tetrahedron() -> TriangleMesh {
    TriangleMesh {
        positions: points(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]),
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    }
}

#[test]
fn files_are_replaced_whole_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = tetrahedron();
    for name in ["mesh.stl", "mesh.OBJ"] {
        let path = folder.path().join(name);
        write(&path, &mesh, None).unwrap();
        write(&path, &mesh, Some(LengthUnit::Inch)).unwrap();
        let file = read(&path).unwrap();
        assert_eq!(file.mesh.triangles.len(), 4);
        let corners = |mesh: &TriangleMesh| -> Vec<DVec3> {
            mesh.triangles.iter().flatten().map(|&index| mesh.positions[index as usize]).collect()
        };
        assert_eq!(corners(&file.mesh), corners(&mesh));
    }
    let target = folder.path().join("mesh.stl");
    let before = fs::read(&target).unwrap();
    let mut broken = mesh.clone();
    broken.triangles[2] = [0, 1, 4];
    let error = write(&target, &broken, None).unwrap_err().to_string();
    assert_eq!(error, format!("{}: triangle 2 refers to position 4, and there are 4", target.display()));
    broken = mesh.clone();
    broken.positions[1].y = -1e39;
    let error = write(&target, &broken, None).unwrap_err().to_string();
    let beyond =
        "position 1 has the coordinate -1000000000000000000000000000000000000000, beyond the 32-bit numbers of STL";
    assert_eq!(error, format!("{}: {beyond}", target.display()));
    let failed = replace(&target, |file| {
        file.write_all(b"half")?;
        Err(io::Error::other("the disk is full"))
    });
    assert_eq!(failed.unwrap_err().to_string(), "the disk is full");
    assert_eq!(fs::read(&target).unwrap(), before);
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");

    let error = write(Path::new("mesh.ply"), &mesh, None).unwrap_err().to_string();
    assert_eq!(error, "mesh.ply: PLY files are not written here; .stl and .obj are");
    let error = write(Path::new("mesh.step"), &mesh, None).unwrap_err().to_string();
    assert!(error.starts_with("mesh.step: `.step` is no mesh format known here"), "{error}");
}

#[cfg(unix)]
#[test]
fn written_files_can_be_read_by_others() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (written, plain) = (folder.path().join("mesh.stl"), folder.path().join("plain"));
    write(&written, &tetrahedron(), None).unwrap();
    fs::write(&plain, "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&written), mode(&plain));
}
