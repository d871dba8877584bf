//! Round trips: a format of 64 bits reads back the same mesh, a format of 32 bits the rounded one.

use std::fs;
use std::path::PathBuf;

use glam::DVec3;
use proptest::prelude::*;

use super::tests::points;
use super::*;

/// Coordinates of every kind that all formats hold: few different ones, so that corners coincide, zeros of both signs,
/// and numbers of any exponent.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => (-2i8..3).prop_map(f64::from),
        1 => Just(-0.0),
        3 => -1e3..1e3f64,
        2 => proptest::num::f64::ANY.prop_filter("within what 3MF holds", |value| value.abs() <= 1e9),
    ]
}

fn any_mesh() -> impl Strategy<Value = TriangleMesh> {
    let positions = proptest::collection::vec([coordinate(), coordinate(), coordinate()], 3..40);
    positions.prop_flat_map(|positions| {
        let corner = 0..positions.len() as u32;
        let triangles = proptest::collection::vec([corner.clone(), corner.clone(), corner], 1..60);
        triangles.prop_map(move |triangles| TriangleMesh { positions: points(&positions), triangles })
    })
}

fn any_unit() -> impl Strategy<Value = LengthUnit> {
    use LengthUnit::{Centimetre, Foot, Inch, Metre, Micrometre, Millimetre};
    proptest::sample::select(vec![Micrometre, Millimetre, Centimetre, Inch, Foot, Metre])
}

/// Writes and reads a mesh; returns the file read and what `write` returned.
fn through(format: Format, mesh: &TriangleMesh, unit: Option<LengthUnit>) -> (MeshFile, Written) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("mesh.{}", format.extension()));
    let written = write(&path, mesh, unit).unwrap_or_else(|error| panic!("{error}"));
    (read(&path).unwrap_or_else(|error| panic!("{error}")), written)
}

fn corners(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|index| mesh.positions[index as usize])).collect()
}

/// Returns the bits, so that 0 and −0 differ.
fn bits(corners: &[[DVec3; 3]]) -> Vec<[[u64; 3]; 3]> {
    corners.iter().map(|triangle| triangle.map(|corner| corner.to_array().map(f64::to_bits))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn formats_of_64_bits_return_the_written_mesh(mesh in any_mesh(), unit in any_unit()) {
        for format in [Format::Obj, Format::Ply, Format::Off] {
            let (file, written) = through(format, &mesh, Some(unit));
            prop_assert_eq!(&file.mesh, &mesh);
            prop_assert_eq!(bits(&corners(&file.mesh)), bits(&corners(&mesh)));
            prop_assert_eq!((file.unit, file.notes), (None, vec![]));
            prop_assert_eq!(written, Written { unit: Some(unit), notes: vec![] });
        }
    }

    #[test]
    fn a_3mf_file_has_every_triangle_with_three_corners(mesh in any_mesh(), unit in any_unit()) {
        let expected: Vec<[DVec3; 3]> =
            corners(&mesh).into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect();
        prop_assume!(!expected.is_empty());
        let (file, written) = through(Format::ThreeMf, &mesh, Some(unit));
        prop_assert_eq!(corners(&file.mesh), expected.clone());
        prop_assert_eq!((file.unit, file.notes), (Some(unit), vec![]));
        let count = mesh.triangles.len() - expected.len();
        let notes = if count > 0 { vec![WriteNote::CollapsedLeftOut { count }] } else { vec![] };
        prop_assert_eq!(written, Written { unit: Some(unit), notes });
        // No two positions are the same.
        let mut welded = file.mesh.clone();
        welded.weld();
        prop_assert_eq!(welded, file.mesh);
    }

    #[test]
    fn formats_of_32_bits_return_the_rounded_mesh(mesh in any_mesh(), unit in any_unit()) {
        let rounded = |scale: f64| -> Vec<[DVec3; 3]> {
            let round = |corner: DVec3| corner.as_vec3().as_dvec3() * scale;
            corners(&mesh).into_iter().map(|triangle| triangle.map(round)).collect()
        };
        let (file, written) = through(Format::Stl, &mesh, Some(unit));
        prop_assert_eq!(bits(&corners(&file.mesh)), bits(&rounded(1.0)));
        prop_assert_eq!((file.unit, written.unit), (None, Some(unit)));
        let (file, written) = through(Format::Glb, &mesh, Some(unit));
        // But for the sign of zero, which the node's transform does not keep.
        prop_assert_eq!(corners(&file.mesh), rounded(unit.metres()));
        prop_assert_eq!((file.unit, written.unit), (Some(LengthUnit::Metre), Some(LengthUnit::Metre)));
    }
}

fn tetrahedron(size: f64, at: f64) -> TriangleMesh {
    let mut positions = points(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]);
    positions.iter_mut().for_each(|position| *position = *position * size + DVec3::splat(at));
    TriangleMesh { positions, triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] }
}

#[test]
fn assumed_units_and_visible_rounding_give_notes() {
    let mesh = tetrahedron(1.0, 0.0);
    for (format, unit) in [(Format::Glb, LengthUnit::Metre), (Format::ThreeMf, LengthUnit::Millimetre)] {
        let (file, written) = through(format, &mesh, None);
        assert_eq!((file.unit, written.unit), (Some(unit), Some(unit)));
        assert_eq!(corners(&file.mesh), corners(&mesh));
        assert_eq!(written.notes, [WriteNote::UnitAssumed { format, unit }]);
    }
    let far = tetrahedron(1.0, 1e3);
    let codes = |format| {
        let (_, written) = through(format, &far, Some(LengthUnit::Inch));
        written.notes.iter().map(WriteNote::code).collect::<Vec<_>>()
    };
    for format in [Format::Stl, Format::Glb] {
        assert_eq!(codes(format), ["coordinates-rounded"], "{format}");
    }
    for format in [Format::Obj, Format::Ply, Format::Off] {
        assert_eq!(codes(format), [""; 0], "{format}");
    }
}

/// Of numbers that are scaled to metres and then rounded, two that differ may become one, near zero and at 1000.
#[test]
fn positions_in_glb_files_stay_apart() {
    let least = f64::from(f32::from_bits(1));
    let mut mesh = tetrahedron(1024.0, 0.0);
    mesh.positions.extend([DVec3::X * least, DVec3::Y * 1000.0, DVec3::Y * f64::from(1000f32.next_up())]);
    mesh.triangles.extend([[4, 5, 6], [5, 4, 6]]);
    let (file, _) = through(Format::Glb, &mesh, Some(LengthUnit::Millimetre));
    let mut welded = file.mesh.clone();
    welded.weld();
    assert_eq!((welded.positions.len(), file.mesh.triangles), (7, mesh.triangles));
}

#[test]
fn meshes_that_a_format_cannot_hold_are_refused_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let said = |name: &str, at: f64, unit| {
        let path = folder.path().join(name);
        let error = write(&path, &tetrahedron(1.0, at), unit).unwrap_err().to_string();
        error.strip_prefix(&format!("{}: ", path.display())).unwrap().to_owned()
    };
    let infinite = "position 0 has the coordinate inf, which";
    assert_eq!(said("a.glb", f64::INFINITY, None), format!("{infinite} GLB cannot hold"));
    assert_eq!(said("a.3mf", f64::INFINITY, None), format!("{infinite} 3MF cannot hold"));
    let beyond = "position 0 has the coordinate 2000000000; the limit of 3MF is 1000000000";
    assert_eq!(said("a.3mf", 2e9, None), beyond);
    assert!(said("a.glb", 1e39, None).ends_with("beyond the 32-bit range of GLB; write .obj, .ply or .off"));
    for name in ["a.stl", "a.glb"] {
        let refused = said(name, 1e9, Some(LengthUnit::Metre));
        assert!(refused.contains("4 of 4 triangles would collapse") && refused.ends_with("--recentre"), "{refused}");
        let path = folder.path().join(name);
        let small = write(&path, &tetrahedron(1e-46, 0.0), None).unwrap_err().to_string();
        assert!(small.contains("4 of 4 triangles would collapse"), "{small}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn meshes_without_triangles_are_written_and_read_back_as_empty() {
    let folder = tempfile::tempdir().unwrap();
    for format in Format::ALL.into_iter().filter(|format| format.is_written()) {
        let path: PathBuf = folder.path().join(format!("empty.{}", format.extension()));
        write(&path, &TriangleMesh::default(), Some(LengthUnit::Metre)).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, ReadError::Empty { .. }), "{error}");
    }
}

#[test]
fn writing_a_mesh_twice_gives_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = crate::solids::geodesic(1.0, 30).unwrap();
    for format in Format::ALL.into_iter().filter(|format| format.is_written()) {
        let path = folder.path().join(format!("mesh.{}", format.extension()));
        let bytes = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| write(&path, &mesh, Some(LengthUnit::Inch))).unwrap();
            fs::read(&path).unwrap()
        };
        assert!(bytes(1) == bytes(3), "{format}");
    }
}

#[test]
fn glb_files_are_aligned_to_words_and_have_exact_bounds() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.glb");
    write(&path, &tetrahedron(0.1, 0.7), Some(LengthUnit::Millimetre)).unwrap();
    let bytes = fs::read(&path).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let json = word(12);
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    assert_eq!((json % 4, &bytes[16..20]), (0, &b"JSON"[..]));
    assert_eq!((word(20 + json), &bytes[24 + json..28 + json]), (4 * 12 + 4 * 12, &b"BIN\0"[..]));
    let document: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json]).unwrap();
    let bound = |name: &str| document["accessors"][1][name][0].as_f64().unwrap();
    assert_eq!((bound("min"), bound("max")), (f64::from(0.7f32), f64::from((0.7 + 0.1) as f32)));
}

#[test]
fn ply_and_off_files_begin_with_their_headers() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| {
        let path = folder.path().join(name);
        write(&path, &tetrahedron(1.0, 0.0), Some(LengthUnit::Micrometre)).unwrap();
        fs::read(&path).unwrap()
    };
    let ply = bytes("mesh.ply");
    assert!(ply.starts_with(b"ply\nformat binary_little_endian 1.0\ncomment PLY by ldi-ops\ncomment unit um\n"));
    let header = b"property list uchar int vertex_indices\nend_header\n";
    let at = ply.windows(header.len()).position(|window| window == header).unwrap() + header.len();
    assert_eq!(ply.len() - at, 4 * 24 + 4 * 13);
    assert!(bytes("mesh.off").starts_with(b"OFF\n# OFF by ldi-ops\n# unit um\n4 4 0\n0.0 0.0 0.0\n1.0 0.0 0.0\n"));
}
