//! Tests that files read back unchanged, also after other programs rewrote them, and that invalid ones are refused by
//! name.

use std::io::{self, Cursor, Read, Seek, Write};

use glam::DVec3;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::*;
use crate::grid::{Axis, Grid};
use crate::ldi::LdiError;

fn image(axis: Axis) -> Ldi {
    let grid = Grid::from_parts(DVec3::new(0.1, -2.0, 3e5), 0.3, [4, 3, 2], 4, 64).unwrap();
    let (columns, rows) = grid.image_size(axis);
    let rays = (columns * rows) as usize;
    let mut offsets = vec![4; rays + 1];
    (offsets[0], offsets[1]) = (0, 2);
    Ldi::from_parts(grid, axis, offsets, vec![4, 20, 6, 6], vec![rays as u32 - 1]).unwrap()
}

/// Returns outward normals: against the ray, across it, against it and along it.
fn normals(axis: Axis) -> Normals {
    let along_z = [[0.6f32, 0.0, -0.8], [1.0, 0.0, 0.0], [-0.36, 0.48, -0.8], [0.0, 0.0, 1.0]];
    along_z
        .map(|mut normal| {
            normal.rotate_right((axis.depth() + 1) % 3);
            normal
        })
        .to_vec()
}

fn written(images: &[Ldi], extras: &Extras) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    write(images, extras, &mut file).unwrap();
    file.into_inner()
}

/// Returns the entries of an archive.
fn entries(file: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut zip = zip::ZipArchive::new(Cursor::new(file)).unwrap();
    (0..zip.len())
        .map(|i| {
            let mut entry = zip.by_index(i).unwrap();
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).unwrap();
            (entry.name().unwrap().into_owned(), bytes)
        })
        .collect()
}

/// Returns an archive of entries.
fn archive(entries: &[(String, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(name, SimpleFileOptions::default().compression_method(method)).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Returns an array with its header.
fn array(descr: &str, shape: &[usize], bytes: &[u8]) -> Vec<u8> {
    let mut array = Vec::new();
    npy::write_header(&mut array, descr, npy::Order::C, shape).unwrap();
    [array, bytes.to_vec()].concat()
}

fn bytes<T: Copy, const N: usize>(values: &[T], to_le: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| to_le(value)).collect()
}

/// Reads the image along z with one array replaced, or left out.
#[track_caller]
fn with(name: &str, replacement: Option<Vec<u8>>) -> Result<Images, NpzError> {
    let extras = Extras { normals: vec![Some(normals(Axis::Z))], unit: Some("mm".to_owned()), mode: Some(Mode::OVER) };
    let mut entries = entries(&written(&[image(Axis::Z)], &extras));
    let place = entries.iter().position(|(entry, _)| entry == &format!("{name}.npy")).unwrap();
    match replacement {
        Some(bytes) => entries[place].1 = bytes,
        None => drop(entries.remove(place)),
    }
    read(Cursor::new(archive(&entries, CompressionMethod::Deflated)))
}

#[track_caller]
fn refuses(name: &str, replacement: Vec<u8>, words: &[&str]) {
    let error = with(name, Some(replacement)).expect_err(&format!("{name}: {words:?}")).to_string();
    for word in words {
        assert!(error.contains(word), "no `{word}` in `{error}`");
    }
}

#[test]
fn written_images_are_read_back() {
    let three = Axis::ALL.map(image);
    let all = Extras {
        normals: vec![Some(normals(Axis::X)), None, Some(normals(Axis::Z))],
        unit: Some("mm".to_owned()),
        mode: Some(Mode::UNDER),
    };
    let none = Extras { normals: vec![None; 3], ..Extras::default() };
    for (images, extras) in [
        (&three[..], &all),
        (&three[..], &none),
        (
            &three[1..2],
            &Extras { normals: vec![Some(normals(Axis::Y))], unit: Some("µm".to_owned()), mode: Some(Mode::Exact) },
        ),
    ] {
        let file = written(images, extras);
        let expected = Images { images: images.to_vec(), extras: extras.clone(), ignored: Vec::new() };
        assert_eq!(read(Cursor::new(&file)).unwrap(), expected);
        // So do compressed archives of the same arrays, and those whose entries are in another order.
        let mut entries = entries(&file);
        entries.reverse();
        let compressed = archive(&entries, CompressionMethod::Deflated);
        assert_eq!(read(Cursor::new(compressed)).unwrap(), expected);
    }
    let without = written(&three, &Extras::default());
    assert_eq!(without, written(&three, &none));
    assert_ne!(without, written(&three, &all));
}

#[test]
fn images_that_numpy_wrote_are_read() {
    let stored = read(Cursor::new(include_bytes!("../../../data/images/stored.npz"))).unwrap();
    assert_eq!((stored.images.len(), stored.ignored), (1, vec!["note".to_owned()]));
    assert_eq!(stored.extras.unit.as_deref(), Some("mm"));
    let z = &stored.images[0];
    assert_eq!(z.grid(), &Grid::from_parts(DVec3::new(-1.0, 0.5, 2.0), 0.25, [4, 3, 2], 4, 64).unwrap());
    assert_eq!(z.offsets(), [0, 0, 2, 4, 4, 4, 6, 8, 8, 8, 8, 8, 8]);
    assert_eq!(z.depths(), [16, 32, 16, 32, 16, 32, 16, 32]);
    assert_eq!(stored.extras.normals, [Some([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]].repeat(4))]);

    let compressed = read(Cursor::new(include_bytes!("../../../data/images/compressed.npz"))).unwrap();
    assert_eq!(compressed.images.iter().map(Ldi::axis).collect::<Vec<_>>(), Axis::ALL);
    assert_eq!(compressed.images[2], *z);
    assert_eq!(compressed.images[0].samples(3), [16, 48]);
    assert_eq!(compressed.extras, Extras { normals: vec![None; 3], ..Extras::default() });
}

#[test]
fn arrays_have_padded_headers_followed_by_the_numbers() {
    let entries = entries(&written(&[image(Axis::Z)], &Extras::default()));
    let (_, depths) = entries.iter().find(|(name, _)| name == "depths.npy").unwrap();
    assert_eq!(&depths[..8], b"\x93NUMPY\x01\x00");
    let length = 10 + usize::from(u16::from_le_bytes([depths[8], depths[9]]));
    assert_eq!((length % 64, depths[length - 1]), (0, b'\n'));
    assert!(depths[10..].starts_with(b"{'descr': '<i4', 'fortran_order': False, 'shape': (4,), }"));
    assert_eq!(depths[length..length + 8], [4, 0, 0, 0, 20, 0, 0, 0]);
}

#[test]
fn arrays_of_several_images_are_named_by_axis() {
    let extras = Extras { normals: vec![None, Some(normals(Axis::Y))], ..Extras::default() };
    let entries = entries(&written(&[image(Axis::X), image(Axis::Y)], &extras));
    let names: Vec<&str> = entries.iter().map(|(name, _)| name.trim_end_matches(".npy")).collect();
    let of_x = ["offsets_x", "depths_x", "unclosed_x"];
    let of_y = ["offsets_y", "depths_y", "normals_y", "unclosed_y"];
    assert_eq!(names, [&["axis", "grid"][..], &of_x, &of_y].concat());
}

#[test]
fn one_image_may_name_its_axis_and_omit_derivable_arrays() {
    let bare: Vec<(String, Vec<u8>)> = entries(&written(&[image(Axis::Z)], &Extras::default()))
        .into_iter()
        .filter(|(name, _)| name != "unclosed.npy")
        .map(|(name, bytes)| (name.replace("offsets", "offsets_z").replace("depths", "depths_z"), bytes))
        .collect();
    let found = read(Cursor::new(archive(&bare, CompressionMethod::Stored))).unwrap();
    assert_eq!(found.images[0].depths(), image(Axis::Z).depths());
    assert_eq!((found.images[0].unclosed(), found.ignored), (&[0; 0][..], vec![]));
}

#[test]
fn missing_arrays_are_named() {
    for name in ["axis", "grid", "offsets", "depths"] {
        let error = with(name, None).unwrap_err();
        assert!(matches!(&error, NpzError::Missing { array } if array == name), "{error}");
    }
    assert_eq!(with("unit", None).unwrap().extras.unit, None);
    assert_eq!(with("normals", None).unwrap().extras.normals, [None]);
}

#[test]
fn integers_of_any_width_are_checked_to_fit() {
    let depths = [4, 20, 6, 6];
    for (descr, bytes) in [
        ("'<i8'", bytes(&depths.map(i64::from), i64::to_le_bytes)),
        ("'<u8'", bytes(&depths.map(|d| d as u64), u64::to_le_bytes)),
        ("'<u2'", bytes(&depths.map(|d| d as u16), u16::to_le_bytes)),
        ("'|i1'", bytes(&depths.map(|d| d as i8), i8::to_le_bytes)),
    ] {
        let read = with("depths", Some(array(descr, &[4], &bytes))).unwrap();
        assert_eq!(read.images[0].depths(), depths, "{descr}");
    }
    let far = bytes(&[4, 20, 6, 1 << 31], i64::to_le_bytes);
    refuses("depths", array("'<i8'", &[4], &far), &["depths", "2147483648 at index 3", "-2147483648 to 2147483647"]);
    let far = bytes(&[u64::MAX; 4], u64::to_le_bytes);
    refuses("depths", array("'<u8'", &[4], &far), &["depths", "18446744073709551615 at index 0"]);
    let mut offsets = [4i64; 13];
    (offsets[0], offsets[5]) = (0, -4);
    refuses(
        "offsets",
        array("'<i8'", &[13], &bytes(&offsets, i64::to_le_bytes)),
        &["offsets", "-4 at index 5", "0 to"],
    );
}

#[test]
fn wrong_types_and_shapes_are_named() {
    let four = |descr: &str, shape: &[usize]| array(descr, shape, &bytes(&[4, 20, 6, 6], i32::to_le_bytes));
    refuses("depths", four("'<f4'", &[4]), &["depths", "<f4", "integers"]);
    refuses("depths", four("'>i4'", &[4]), &["depths", ">i4", "little-endian"]);
    refuses("depths", four("'<c8'", &[2]), &["depths", "<c8"]);
    refuses("depths", four("[('a', '<i4')]", &[4]), &["depths", "record of a", "integers"]);
    refuses("depths", four("'<i4'", &[2, 2]), &["depths", "[2, 2]", "(4,)", "last of the offsets"]);
    refuses("depths", four("'<i8'", &[4]), &["depths", "16 bytes", "32"]);
    refuses("depths", four("'<i2'", &[4]), &["depths", "16 bytes", "8"]);
    refuses("offsets", four("'<i4'", &[4]), &["offsets", "[4]", "(13,)"]);
    refuses("offsets", array("'<u4'", &[usize::MAX], &[]), &["offsets", "18446744073709551615", "(13,)"]);
    refuses("normals", array("'<f4'", &[4, 2], &[0; 32]), &["normals", "[4, 2]", "(4, 3)"]);
    refuses("normals", array("'<i4'", &[4, 3], &[0; 48]), &["normals", "<i4", "floats"]);
    refuses("unclosed", array("'<u4'", &[13], &[0; 52]), &["unclosed", "[13]", "12 rays"]);
    refuses("grid", four("'<i4'", &[]), &["grid", "<i4", "records"]);
    refuses("axis", four("'<U1'", &[4]), &["axis", "[4]"]);
    refuses("axis", array("'<U999999999'", &[], &[]), &["axis", "<U999999999"]);
    refuses("axis", array("'<U1'", &[], b"w\0\0\0"), &["axis", "\"w\""]);
    refuses("axis", array("'<U1'", &[2], b"z\0\0\0z\0\0\0"), &["axis", "z occurs twice"]);
    refuses("axis", array("'<U1'", &[2], b"x\0\0\0z\0\0\0"), &["array offsets_x is missing"]);
    refuses("unit", array("'<U3'", &[], b"1\0\0\0m\0\0\0m\0\0\0"), &["unit", "\"1mm\""]);
    refuses("depths", b"{\"format\": 1}".to_vec(), &["depths", "signature of a .npy"]);
    refuses("depths", Vec::new(), &["depths", "header"]);
}

#[test]
fn normals_must_have_length_one_or_zero() {
    let with_normal = |normal: [f32; 3]| {
        let mut all = normals(Axis::Z);
        all[2] = normal;
        array("'<f4'", &[4, 3], &bytes(all.as_flattened(), f32::to_le_bytes))
    };
    assert_eq!(with("normals", Some(with_normal([0.0, 0.0, -1.0]))).unwrap().extras.normals.len(), 1);
    assert!(with("normals", Some(with_normal([0.0; 3]))).is_ok(), "not known");
    refuses("normals", with_normal([0.5, 0.0, 0.0]), &["normals", "sample 2", "length 0.5"]);
    refuses("normals", with_normal([1.0, 1.0, 0.0]), &["sample 2", "1.41"]);
    refuses("normals", with_normal([f32::NAN, 1.0, 0.0]), &["sample 2", "NaN"]);
    refuses("normals", with_normal([f32::INFINITY, 0.0, 0.0]), &["sample 2", "inf"]);
    let wide: Vec<f64> = normals(Axis::Z).as_flattened().iter().map(|&n| f64::from(n)).collect();
    let read = with("normals", Some(array("'<f8'", &[4, 3], &bytes(&wide, f64::to_le_bytes)))).unwrap();
    assert_eq!(read.extras.normals, [Some(normals(Axis::Z))]);
    let mut fortran = Vec::new();
    npy::write_header(&mut fortran, "'<f4'", npy::Order::Fortran, &[4, 3]).unwrap();
    refuses("normals", [fortran, vec![0; 48]].concat(), &["normals", "Fortran"]);
}

/// Returns the record of a grid.
fn grid_array(origin: f64, pitch: f64, step: f64, rays: [u32; 3], shift: u32, lod: u32) -> Vec<u8> {
    let descr = "[('origin', '<f8', (3,)), ('pitch', '<f8'), ('step', '<f8'), ('rays', '<u4', (3,)), ('shift', '<u4'), \
                 ('lod', '<u4')]";
    let whole = [rays.as_slice(), &[shift, lod]].concat();
    let floats = bytes(&[origin, 0.0, 0.0, pitch, step], f64::to_le_bytes);
    array(descr, &[], &[floats, bytes(&whole, u32::to_le_bytes)].concat())
}

#[test]
fn impossible_grids_are_refused() {
    let good = [4, 3, 2];
    assert!(with("grid", Some(grid_array(0.0, 16.0, 1.0, good, 4, 64))).is_ok());
    for (grid, words) in [
        (grid_array(0.0, 16.0, 1.5, good, 4, 64), &["step of 1.5e0", "1e0"][..]),
        (grid_array(0.0, 16.0, f64::NAN, good, 4, 64), &["step of NaN"]),
        (grid_array(f64::INFINITY, 16.0, 1.0, good, 4, 64), &["origin", "inf"]),
        (grid_array(0.0, -16.0, -1.0, good, 4, 64), &["pitch of -16"]),
        (grid_array(0.0, 5e-324, 0.0, good, 4, 64), &["pitch of 0.000"]),
        (grid_array(0.0, 1e200, 1e200 / 16.0, good, 4, 64), &["longest side of its box is 4e200"]),
        (grid_array(0.0, 16.0, 1.0, [0, 3, 2], 4, 64), &["0 rays"]),
        (grid_array(0.0, 16.0, 1.0, [u32::MAX; 3], 4, 64), &["4294967295"]),
        (grid_array(0.0, 16.0, 1.0, good, 99, 64), &["2^99"]),
        (grid_array(0.0, 16.0, 1.0, [1 << 14, 3, 2], 20, 64), &["16384 rays of 2^20"]),
        (grid_array(0.0, 16.0, 1.0, good, 4, 7), &["LOD-C 7"]),
        (array("[('origin', '<f8', (3,))]", &[], &[0; 24]), &["no field pitch of one float"]),
        (array("[('origin', '<f8', (2,))]", &[], &[0; 16]), &["no field origin of three floats"]),
        (array("[('origin', '|V1', (99999,))]", &[], &[0; 99999]), &["small records"]),
        (array("[]", &[], &[]), &["small records"]),
    ] {
        refuses("grid", grid, words);
    }
}

#[test]
fn arrays_that_form_no_valid_image_are_refused() {
    let mut offsets = vec![4u32; 13];
    (offsets[0], offsets[1], offsets[3]) = (0, 2, 9);
    let beyond = with("offsets", Some(array("'<u4'", &[13], &bytes(&offsets, u32::to_le_bytes)))).unwrap_err();
    assert!(matches!(beyond, NpzError::Image { axis: "z", source: LdiError::OffsetOrder { ray: 2 } }), "{beyond}");
    let outside = array("'<i4'", &[4], &bytes(&[4, 20, 6, 33], i32::to_le_bytes));
    refuses("depths", outside, &["along z", "ray 1", "0 to 32"]);
    let unclosed = array("'<u4'", &[1], &bytes(&[12], u32::to_le_bytes));
    refuses("unclosed", unclosed, &["along z", "ray 12"]);
}

#[test]
fn modes_other_than_exact_over_and_under_are_refused() {
    let text = |text: &str| {
        array(
            "'<U5'",
            &[],
            &bytes(&[0, 1, 2, 3, 4].map(|i| text.as_bytes().get(i).map_or(0, |&b| u32::from(b))), u32::to_le_bytes),
        )
    };
    assert_eq!(with("mode", Some(text("exact"))).unwrap().extras.mode, Some(Mode::Exact));
    assert_eq!(with("mode", None).unwrap().extras.mode, None);
    refuses("mode", text("Exact"), &["mode", "Exact", "exact, over or under"]);
    refuses("mode", array("'<U5'", &[1], &bytes(&[0; 5], u32::to_le_bytes)), &["mode", "shape"]);
}

#[test]
fn normals_that_point_into_the_solid_are_refused() {
    let mut turned = normals(Axis::Z);
    turned.iter_mut().for_each(|normal| *normal = normal.map(|n| -n));
    let of = |normals: &Normals| array("'<f4'", &[4, 3], &bytes(normals.as_flattened(), f32::to_le_bytes));
    // The second is perpendicular to its ray, whichever way it points.
    refuses("normals", of(&turned), &["normals: 3 normals point into the solid", "sample 0"]);
    let mut one = normals(Axis::Z);
    one[3] = [0.0, 0.6, -0.8];
    refuses("normals", of(&one), &["normals: 1 normals point into the solid", "sample 3"]);
    let error =
        write(&[image(Axis::Z)], &Extras { normals: vec![Some(one)], ..Extras::default() }, Cursor::new(vec![]));
    assert!(matches!(error, Err(NpzError::NormalSide { count: 1, sample: 3, .. })));
    // A rounded normal perpendicular to the ray.
    let mut rounded = normals(Axis::Z);
    rounded[1] = [1.0, 0.0, -1e-4];
    assert!(with("normals", Some(of(&rounded))).is_ok());
}

#[test]
fn exact_images_that_disagree_about_nodes_are_refused() {
    let grid = Grid::from_parts(DVec3::ZERO, 1.0, [2, 2, 2], 4, 64).unwrap();
    // Node (0, 0, 0) is inside; nodes lie half a pixel, 8 lattice steps, from the sides of pixels.
    let of =
        |axis, depths: [i32; 2]| Ldi::from_parts(grid, axis, vec![0, 2, 2, 2, 2], depths.to_vec(), vec![]).unwrap();
    let agreeing = Axis::ALL.map(|axis| of(axis, [4, 20]));
    let other = [of(Axis::X, [4, 20]), of(Axis::Y, [4, 20]), of(Axis::Z, [4, 32])];
    let read_as = |images: &[Ldi], mode| {
        let extras = Extras { mode, ..Extras::default() };
        read(Cursor::new(written(images, &extras)))
    };
    for mode in Mode::ALL {
        assert_eq!(read_as(&agreeing, Some(mode)).unwrap().extras.mode, Some(mode));
    }
    let error = read_as(&other, Some(Mode::Exact)).unwrap_err();
    assert!(matches!(error, NpzError::NodesDisagree { count: 1, node: [0, 0, 1] }), "{error}");
    let error = read_as(&other[1..], Some(Mode::Exact)).unwrap_err();
    assert!(matches!(error, NpzError::NodesDisagree { count: 1, .. }), "{error}");
    for mode in [None, Some(Mode::OVER), Some(Mode::UNDER)] {
        assert!(read_as(&other, mode).is_ok());
    }
    // An unclosed ray has no samples, whatever the others have.
    let open = Ldi::from_parts(grid, Axis::Z, vec![0; 5], vec![], vec![0]).unwrap();
    assert!(read_as(&[agreeing[0].clone(), agreeing[1].clone(), open], Some(Mode::Exact)).is_ok());
}

#[test]
fn damaged_files_are_refused() {
    let file = written(&[image(Axis::Z)], &Extras { normals: vec![Some(normals(Axis::Z))], ..Extras::default() });
    assert!(matches!(read(Cursor::new(&b""[..])), Err(NpzError::NoArchive { .. })));
    for length in 0..file.len() {
        assert!(read(Cursor::new(&file[..length])).is_err(), "cut to {length} bytes");
    }
    // Depths are uncompressed in the file: another value is another checksum.
    let place = file.windows(8).position(|bytes| bytes == [4, 0, 0, 0, 20, 0, 0, 0]).unwrap();
    let mut other = file.clone();
    other[place] = 6;
    let error = read(Cursor::new(other)).unwrap_err();
    assert!(matches!(&error, NpzError::Damaged { array, .. } if array == "depths"), "{error}");
    // No byte of a file, changed to another, makes the reader panic.
    for place in 0..file.len() {
        for change in [1, 0x80, 0xff] {
            let mut other = file.clone();
            other[place] ^= change;
            let _ = read(Cursor::new(other));
        }
    }
}

#[test]
fn oversized_arrays_are_refused_before_allocation() {
    // 2^15 by 2^15 rays: 4 GiB of offsets, in an archive that declares them and holds a small part of them.
    let grid = grid_array(0.0, 16.0, 1.0, [1 << 15, 1 << 15, 1], 4, 64);
    let offsets = array("'<u4'", &[(1 << 30) + 1], &vec![0; 1 << 20]);
    let files = [("axis.npy".to_owned(), array("'<U1'", &[], b"z\0\0\0")), ("grid.npy".to_owned(), grid)];
    let with_offsets = [&files[..], &[("offsets.npy".to_owned(), offsets)]].concat();
    let error = read(Cursor::new(archive(&with_offsets, CompressionMethod::Deflated))).unwrap_err();
    assert!(matches!(error, NpzError::Size { wanted: 4294967300, .. }), "{error}");

    let mut bomb = archive(&with_offsets, CompressionMethod::Deflated);
    assert!(bomb.len() < 4000);
    // The size of the offsets in the central directory, raised to that in the header.
    let entry = bomb.windows(11).rposition(|name| name == b"offsets.npy").unwrap();
    let size = entry - 46 + 24;
    bomb[size..size + 4].copy_from_slice(&0xf000_0000u32.to_le_bytes());
    let error = read(Cursor::new(bomb)).unwrap_err();
    assert!(matches!(&error, NpzError::Compressed { array, allowed: 268435456, .. } if array == "offsets"), "{error}");
}

#[test]
fn full_disks_give_a_storage_full_error() {
    /// A file that has room for some bytes.
    struct Disk(Cursor<Vec<u8>>, usize);
    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            match self.0.get_ref().len() + bytes.len() > self.1 {
                true => Err(io::ErrorKind::StorageFull.into()),
                false => self.0.write(bytes),
            }
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    impl Seek for Disk {
        fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
            self.0.seek(to)
        }
    }
    for room in (0..1000).step_by(50) {
        let error = write(&[image(Axis::Z)], &Extras::default(), Disk(Cursor::new(Vec::new()), room)).unwrap_err();
        assert_eq!(io::Error::from(error).kind(), io::ErrorKind::StorageFull, "{room} bytes");
    }
}

#[test]
fn mismatched_images_and_normals_are_not_written() {
    let write = |images: &[Ldi], extras: &Extras| write(images, extras, Cursor::new(Vec::new()));
    let (one, none) = ([image(Axis::Z)], Extras::default());
    assert!(matches!(write(&[], &none), Err(NpzError::NoImage)));
    let twice = [image(Axis::X), image(Axis::X)];
    assert!(matches!(write(&twice, &none), Err(NpzError::Mismatch { first: 0, second: 1 })));
    let of = |normals| Extras { normals, ..Extras::default() };
    let error = write(&one, &of(vec![None, None]));
    assert!(matches!(error, Err(NpzError::NormalLists { found: 2, images: 1 })));
    let error = write(&one, &of(vec![Some(normals(Axis::Z)[1..].to_vec())]));
    assert!(matches!(error, Err(NpzError::NormalCount { found: 3, samples: 4, .. })));
    let error = write(&one, &of(vec![Some(vec![[0.5; 3]; 4])]));
    assert!(matches!(error, Err(NpzError::NormalLength { sample: 0, .. })));
    for unit in ["", "1 mm", "a very long unit of length", "m\0"] {
        let error = write(&one, &Extras { unit: Some(unit.to_owned()), ..Extras::default() });
        assert!(matches!(error, Err(NpzError::Unit { .. })), "{unit}");
    }
}
