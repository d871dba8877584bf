//! Tests of all formats: names, notes, hostile bytes, and files as other programs write them.

use std::fs;
use std::io::Write;
use std::path::PathBuf;

use glam::DVec3;

use super::*;
use crate::cancel::stops;
use crate::output;

fn sample_path(format: Format) -> PathBuf {
    PathBuf::from(format!("sample.{}", format.extension()))
}

/// Parses bytes that must be readable.
pub(super) fn parsed(bytes: &[u8], format: Format) -> MeshFile {
    parse(bytes, format, &sample_path(format)).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the text of the error that the bytes must give.
pub(super) fn error(bytes: &[u8], format: Format) -> String {
    match parse(bytes, format, &sample_path(format)) {
        Ok(file) => panic!("read without an error: {file:?}"),
        Err(error) => error.to_string(),
    }
}

pub(super) fn points(coordinates: &[[f64; 3]]) -> Vec<DVec3> {
    coordinates.iter().copied().map(DVec3::from).collect()
}

/// Encodes the text in UTF-16 with its byte order mark.
pub(super) fn utf_16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
    "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(bytes).collect()
}

#[test]
fn extensions_select_formats_in_any_case() {
    for (name, format) in [("a.stl", Format::Stl), ("b/A.3MF", Format::ThreeMf), ("x.y.GlTf", Format::Gltf)] {
        assert_eq!(Format::from_path(Path::new(name)), Ok(format));
    }
    let error = |name: &str| Format::from_path(Path::new(name)).unwrap_err().to_string();
    let known = "supported are .stl, .obj, .ply, .off, .gltf, .glb and .3mf";
    assert_eq!(error("part.step"), format!("part.step: `.step` is not a supported mesh format; {known}"));
    assert_eq!(error("dir.stl/part"), format!("dir.stl/part: the name has no extension; {known}"));
}

#[test]
fn readers_of_many_elements_stop_and_those_of_few_end() {
    let obj = |count| "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned() + &"f 1 2 3\n".repeat(count);
    let off = |count| format!("OFF\n3 {count} 0\n0 0 0\n1 0 0\n0 1 0\n") + &"3 0 1 2\n".repeat(count);
    let header = |format: &str, count: usize| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face {count}\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let ply = |count| header("ascii", count) + "0 0 0\n1 0 0\n0 1 0\n" + &"3 0 1 2\n".repeat(count);
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let stl = |count| "solid a\n".to_owned() + &facet.repeat(count) + "endsolid a\n";
    // Quadrilaterals, which the general reader of binary PLY takes one by one.
    let binary = |count| {
        let mut bytes = header("binary_little_endian", count).into_bytes();
        let corners = [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        bytes.extend(corners.as_flattened().iter().flat_map(|coordinate| coordinate.to_le_bytes()));
        let face: Vec<u8> = [4].into_iter().chain([0i32, 1, 2, 1].into_iter().flat_map(i32::to_le_bytes)).collect();
        bytes.extend(face.repeat(count));
        bytes
    };
    let glb = |count: usize| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mesh.glb");
        let positions = (0..count + 2).map(|i| DVec3::new(i as f64, (i * i % 7) as f64, 0.0)).collect();
        let triangles = (0..count as u32).map(|i| [i, i + 1, i + 2]).collect();
        write(&path, &TriangleMesh { positions, triangles }, None).unwrap();
        fs::read(path).unwrap()
    };
    type Bytes<'a> = &'a dyn Fn(usize) -> Vec<u8>;
    let files: [(Format, Bytes); 6] = [
        (Format::Obj, &|count| obj(count).into()),
        (Format::Off, &|count| off(count).into()),
        (Format::Ply, &|count| ply(count).into()),
        (Format::Ply, &binary),
        (Format::Stl, &|count| stl(count).into()),
        (Format::Glb, &glb),
    ];
    for (format, file) in files {
        for (count, is_large) in [(20, false), (10_000, true)] {
            let bytes = file(count);
            let read = || drop(parsed(&bytes, format));
            assert_eq!(stops(read), is_large, "{format:?}, {count} triangles");
        }
    }
}

#[test]
fn notes_have_codes_and_sentences() {
    let note = ReadNote::SupportsSkipped { count: 7 };
    assert_eq!((note.code(), note.to_string().as_str()), ("supports-skipped", "support objects skipped: 7"));
    let note = WriteNote::CollapsedLeftOut { count: 7 };
    let sentence = "triangles with two corners at one position left out (3MF does not allow them): 7";
    assert_eq!((note.code(), note.to_string().as_str()), ("collapsed-left-out", sentence));
}

#[test]
fn errors_name_missing_files() {
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
        assert_eq!(read(&path).unwrap().mesh.triangles.len(), 4);
    }
    let target = folder.path().join("mesh.stl");
    let before = fs::read(&target).unwrap();
    let mut broken = mesh.clone();
    broken.triangles[2] = [0, 1, 4];
    let error = write(&target, &broken, None).unwrap_err().to_string();
    assert_eq!(error, format!("{}: triangle 2 refers to position 4, but the mesh has 4", target.display()));
    broken = mesh.clone();
    broken.positions[1].y = -1e39;
    let error = write(&target, &broken, None).unwrap_err().to_string();
    let beyond = "position 1 has the coordinate -1000000000000000000000000000000000000000, beyond the 32-bit range of STL; write .obj, .ply or .off";
    assert_eq!(error, format!("{}: {beyond}", target.display()));
    let failed = output::replace(&target, |file| {
        file.write_all(b"half")?;
        Err(io::Error::other("the disk is full"))
    });
    assert_eq!(failed.unwrap_err().to_string(), "the disk is full");
    assert_eq!(fs::read(&target).unwrap(), before);
    let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");

    let error = write(Path::new("mesh.gltf"), &mesh, None).unwrap_err().to_string();
    assert_eq!(error, "mesh.gltf: cannot write glTF files; supported are .stl, .obj, .ply, .off, .glb and .3mf");
    let error = write(Path::new("mesh.step"), &mesh, None).unwrap_err().to_string();
    assert!(error.starts_with("mesh.step: `.step` is not a supported mesh format"), "{error}");
}

#[cfg(unix)]
#[test]
fn written_files_are_readable_by_other_users() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (written, plain) = (folder.path().join("mesh.stl"), folder.path().join("plain"));
    write(&written, &tetrahedron(), None).unwrap();
    fs::write(&plain, "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&written), mode(&plain));
}

/// Returns one small file of each format and form.
fn samples() -> Vec<(Format, Vec<u8>)> {
    let mesh = tetrahedron();
    let mut binary_stl = Vec::new();
    stl::write(&mut binary_stl, &mesh, None).unwrap();
    let text_stl = "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid";
    let obj = "# x\no a\nv 0 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 0 1 0 0\nvn 0 0 1\nf 1//1 2//1 -2 4\nf 1 \\\n2 3\nl 1 2\n";
    let off = "COFF # x\n4 2 0\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n4 0 1 2 3 1\n3 0 1 2\n";
    let vertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 2\nproperty list uchar int vertex_indices\nelement tristrips 1\n\
                 property list int int vertex_index\nend_header\n";
    let text_ply =
        format!("ply\nformat ascii 1.0\n{vertices}{faces}0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n4 0 1 2 -1\n");
    let mut binary_ply = format!("ply\nformat binary_little_endian 1.0\n{vertices}{faces}").into_bytes();
    binary_ply.extend(mesh.positions.iter().flat_map(|p| p.to_array()).flat_map(|v| (v as f32).to_le_bytes()));
    for face in [[0, 1, 2], [1, 2, 3]] {
        binary_ply.push(3);
        binary_ply.extend(face.into_iter().flat_map(i32::to_le_bytes));
    }
    binary_ply.extend([4, 0, 1, 2, -1].into_iter().flat_map(i32::to_le_bytes));
    let json = |buffer: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0,"scale":[1,2,3]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{{"count":1,"indices":{{"bufferView":0,"componentType":5121}},"values":{{"bufferView":0}}}}}}],"bufferViews":[{{"buffer":0,"byteLength":36,"byteStride":12}}],"buffers":[{{"byteLength":36{buffer}}}]}}"#
        )
    };
    let uri = format!(r#","uri":"data:,{}""#, "%00".repeat(36));
    let chunk = json("");
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((12 + 8 + chunk.len() as u32 + 8 + 36).to_le_bytes());
    glb.extend((chunk.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(chunk.as_bytes());
    glb.extend(36u32.to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend([0; 36]);
    let model = threemf::tests::model("unit=\"inch\"", threemf::tests::TRIANGLE, "<item objectid=\"1\"/>");
    vec![
        (Format::Stl, binary_stl),
        (Format::Stl, text_stl.into()),
        (Format::Obj, obj.into()),
        (Format::Obj, utf_16(obj, u16::to_be_bytes)),
        (Format::Off, off.into()),
        (Format::Ply, text_ply.into()),
        (Format::Ply, binary_ply),
        (Format::Gltf, json(&uri).into()),
        (Format::Glb, glb),
        (Format::ThreeMf, threemf::tests::package(&[("3D/root.model", &model)])),
    ]
}

/// Parses arbitrary bytes, and checks the guarantees that hold for every result.
fn survive(bytes: &[u8], format: Format) {
    let name = sample_path(format);
    match parse(bytes, format, &name) {
        Ok(file) => {
            let count = file.mesh.positions.len();
            assert!(!file.mesh.triangles.is_empty());
            assert!(file.mesh.triangles.iter().flatten().all(|&index| (index as usize) < count));
            // No format encodes a vertex or a triangle in less than a byte, but for data that ZIP compresses.
            let most = if format == Format::ThreeMf { 1 << 16 } else { bytes.len() + 2048 };
            assert!(count <= most && file.mesh.triangles.len() <= most, "{format}: {count} vertices");
        }
        // Buffers that a damaged name refers to are errors of another file.
        Err(ReadError::Io { .. }) if format == Format::Gltf || format == Format::Glb => {}
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with(&name.display().to_string()), "{text}");
            assert!(text.len() < 600 && !text.contains('\n'), "{text}");
        }
    }
}

#[test]
fn sample_files_of_every_format_are_read() {
    for (format, bytes) in samples() {
        parsed(&bytes, format);
    }
}

#[test]
fn files_cut_anywhere_are_read_or_refused() {
    for (format, bytes) in samples() {
        (0..bytes.len()).for_each(|length| survive(&bytes[..length], format));
    }
}

#[test]
fn files_with_any_byte_changed_are_read_or_refused() {
    for (format, bytes) in samples() {
        for at in 0..bytes.len() {
            let bits = (0..8).map(|bit| bytes[at] ^ (1 << bit));
            for byte in bits.chain([0, 0x7F, 0x80, 0xFF, b'-', b'9', b' ', b'\n', b'"']) {
                let mut changed = bytes.clone();
                changed[at] = byte;
                survive(&changed, format);
            }
        }
    }
}

#[test]
fn files_with_runs_of_bytes_changed_are_read_or_refused() {
    for (format, bytes) in samples() {
        for at in 0..bytes.len() {
            for (length, byte) in [(2, 0xFF), (4, 0xFF), (4, 0x7F), (8, 0xFF), (4, 0), (8, b'9'), (3, b'9')] {
                let mut changed = bytes.clone();
                let end = (at + length).min(bytes.len());
                changed[at..end].fill(byte);
                survive(&changed, format);
                // The same with the run removed, so that everything after it moves.
                changed.drain(at..end);
                survive(&changed, format);
            }
        }
    }
}

#[test]
fn packages_with_damaged_models_are_read_or_refused() {
    // Damage to a package as a whole shows in its checksums; this is damage from before it was packed.
    let lattice = "<b:beamlattice radius=\"1\" ballmode=\"all\" ballradius=\"2\"><b:beams><b:beam v1=\"0\" v2=\"1\"/>\
                   </b:beams><b:balls><b:ball vindex=\"1\"/></b:balls></b:beamlattice></mesh>";
    let components = "<object id=\"2\"><components><component objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 -1 0 0 9\"/>\
                      </components></object>";
    let objects = threemf::tests::TRIANGLE.replace("</mesh>", lattice) + components;
    let model = threemf::tests::model("unit=\"inch\"", &objects, "<item objectid=\"2\"/><item objectid=\"1\"/>");
    let try_model = |text: &str| survive(&threemf::tests::package(&[("3D/root.model", text)]), Format::ThreeMf);
    let whole = threemf::tests::package(&[("3D/root.model", &model)]);
    assert_eq!(parsed(&whole, Format::ThreeMf).notes[1], ReadNote::BeamsMeshed { count: 6 });
    try_model(&model);
    for at in 0..model.len() {
        try_model(&model[..at]);
        for piece in ["", "\"", "<", ">", "/", "&", "9", "-", " ", "\u{e9}", "<a>", "<!--", "<![CDATA["] {
            try_model(&format!("{}{piece}{}", &model[..at], &model[at + 1..]));
        }
    }
}

#[test]
fn files_read_as_any_format_never_panic() {
    for (_, bytes) in samples() {
        for format in Format::ALL {
            // A wrong extension is one more way for a file to be broken, and may even be read: GLB as glTF.
            survive(&bytes, format);
        }
    }
}

#[test]
fn files_that_end_in_zeros_are_refused_before_they_are_read() {
    let folder = tempfile::tempdir().unwrap();
    // Larger than any memory; the file is sparse.
    let padded = |name: &str, start: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, start).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_len(1 << 42).unwrap();
        crate::mesh::io::read(&path).unwrap_err().to_string()
    };
    let text =
        b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    for (name, start) in [
        ("a.stl", &text[..]),
        ("a.obj", b"v 0 0 0\n"),
        ("a.off", b"OFF\n"),
        ("a.ply", b"ply\nformat ascii 1.0\n"),
        ("a.gltf", b"{}"),
    ] {
        let message = padded(name, start);
        assert!(message.contains(name) && message.contains("the text ends with zero bytes"), "{message}");
    }
    let binary = [&[0; 80][..], &12u32.to_le_bytes(), &[0; 600]].concat();
    let message = padded("b.stl", &binary);
    assert!(message.contains("declares 684 bytes, but the file has 4398046511104"), "{message}");
    let message = padded("b.glb", b"glTF\x02\0\0\0\x0C\0\0\0");
    assert!(message.contains("declares 12 bytes, but the file has 4398046511104"), "{message}");
    // A few bytes more than counted are a note, not an error.
    let path = folder.path().join("c.stl");
    std::fs::write(&path, [&binary[..], &[0; 4 << 20]].concat()).unwrap();
    assert!(crate::mesh::io::examine(&path, Format::Stl).is_ok());
}
