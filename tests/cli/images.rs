//! Images in `.npz` files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::{Folder, assert_near, cube};

/// Reads the arrays of an archive: the text of each header, and the bytes after it.
fn arrays(path: &Path) -> BTreeMap<String, (String, Vec<u8>)> {
    let mut archive = zip::ZipArchive::new(File::open(path).unwrap()).unwrap();
    (0..archive.len())
        .map(|i| {
            let mut entry = archive.by_index(i).unwrap();
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).unwrap();
            assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
            let body = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            let header = String::from_utf8(bytes[10..body].to_vec()).unwrap();
            (entry.name().unwrap().trim_end_matches(".npy").to_owned(), (header, bytes[body..].to_vec()))
        })
        .collect()
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn number(bytes: &[u8]) -> f64 {
    f64::from_le_bytes(bytes.try_into().unwrap())
}

#[test]
fn images_hold_the_samples_of_the_volume() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.run(&["sample", "a.stl", "--axis", "z", "--resolution", "16", "-o", "a.npz"]).code(0);
    let arrays = arrays(&folder.path("a.npz"));
    let names: Vec<&str> = arrays.keys().map(String::as_str).collect();
    assert_eq!(names, ["axis", "depths", "grid", "mode", "normals", "offsets", "unclosed"]);
    assert!(arrays["normals"].0.contains("'<f4'") && arrays["normals"].0.contains("'shape': (512,3,)"));
    assert!(arrays["depths"].0.contains("'<i4'") && arrays["offsets"].0.contains("'shape': (257,)"));
    assert!(arrays["axis"].0.contains("'<U1'") && arrays["axis"].1 == [b'z', 0, 0, 0]);
    let (offsets, depths) = (words(&arrays["offsets"].1), words(&arrays["depths"].1));
    assert_eq!((offsets[256] as usize, depths.len()), (512, 512));
    let inside: f64 = depths.chunks_exact(2).map(|span| f64::from(span[1] - span[0])).sum();
    // origin (3 × 8), pitch, step, rays (3 × 4), shift, lod.
    let (header, grid) = &arrays["grid"];
    assert!(header.contains("[('origin', '<f8', (3,)), ('pitch', '<f8'), ('step', '<f8'), ('rays', '<u4', (3,)), "));
    let (pitch, step) = (number(&grid[24..32]), number(&grid[32..40]));
    assert_near(inside * step * pitch * pitch, 8.0, 1e-6);
    let whole = words(&grid[40..]);
    assert_eq!(whole[..3], [16, 16, 16]);
    assert_eq!(step, pitch / f64::from(1u32 << whole[3]));
    assert_eq!((whole[4], whole.len()), (1024, 5));
}

#[test]
fn images_hold_three_axes_and_the_results_of_operations() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("b.stl", &cube(1.0, 2.0));
    let result = folder.json(&["intersect", "a.stl", "b.stl", "--resolution", "30", "-o", "c.npz"]);
    let arrays = arrays(&folder.path("c.npz"));
    let samples: usize = ["x", "y", "z"].iter().map(|axis| words(&arrays[&format!("depths_{axis}")].1).len()).sum();
    assert_eq!(result["samples"], samples);
    assert!(arrays["axis"].0.contains("(3,)"));
    assert_eq!(result["output"], "c.npz");
}

#[test]
fn images_keep_a_known_unit() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.run(&["sample", "a.stl", "--unit", "mm", "--resolution", "8", "-o", "a.npz"]).code(0);
    let arrays = arrays(&folder.path("a.npz"));
    assert!(arrays["unit"].0.contains("'<U2'") && arrays["unit"].1 == b"m\0\0\0m\0\0\0");
}

#[test]
fn equal_images_give_equal_files() {
    let folder = Folder::new();
    folder.run(&["generate", "torus", "-o", "a.stl"]).code(0);
    for (name, threads) in [("one.npz", "1"), ("two.npz", "2")] {
        folder.run(&["sample", "a.stl", "--resolution", "64", "-o", name, "--threads", threads]).code(0);
    }
    assert_eq!(std::fs::read(folder.path("one.npz")).unwrap(), std::fs::read(folder.path("two.npz")).unwrap());
}

#[test]
fn images_keep_the_mode_that_surface_uses() {
    let folder = Folder::new();
    // Long voxels, so that over-estimates along the three axes disagree.
    folder.stl("a.stl", &cube(0.03, 2.0));
    folder.stl("b.stl", &cube(1.01, 2.0));
    for mode in ["exact", "over", "under"] {
        let operation =
            ["union", "a.stl", "b.stl", "--resolution", "150", "--lod", "32", "--mode", mode, "--unit", "mm"];
        folder.run(&[&operation[..], &["-o", "c.npz"]].concat()).code(0);
        let written = &arrays(&folder.path("c.npz"))["mode"];
        let letters: String = words(&written.1).into_iter().map(|c| char::from_u32(c).unwrap()).collect();
        assert_eq!(letters, mode);
        folder.run(&[&operation[..], &["--mesh", "sampled", "-o", "direct.ply"]].concat()).code(0);
        folder.run(&["surface", "c.npz", "-o", "again.ply"]).code(0);
        let read = |name| std::fs::read(folder.path(name)).unwrap();
        assert!(read("again.ply") == read("direct.ply"), "{mode}");
        folder.run(&["surface", "c.npz", "--mode", mode, "-o", "again.ply"]).code(0);
        let other = if mode == "over" { "exact" } else { "over" };
        let run = folder.run(&["surface", "c.npz", "--mode", other, "-o", "again.ply"]);
        run.code(2).says(&["c.npz", &format!("`{mode}`"), &format!("--mode {other} contradicts")]);
    }
}

#[test]
fn images_of_every_kind_are_read_back() {
    let folder = Folder::with_two_cubes();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    folder.run(&["generate", "torus", "-o", "t.stl"]).code(0);
    for command in [
        &["sample", "t.stl", "--fill", "nonzero"][..],
        &["sample", "open.stl", "--allow-open"],
        &["difference", "a.stl", "b.stl"],
        &["minkowski", "a.stl", "b.stl"],
        &["offset", "t.stl", "--distance", "1"],
        &["offset", "t.stl", "--distance", "-1"],
        &["close", "t.stl", "--radius", "1"],
    ] {
        for mode in ["exact", "over", "under"] {
            let arguments = [command, &["--mode", mode, "--resolution", "40", "-o", "c.npz"]].concat();
            folder.run(&arguments).code(0);
            folder.run(&["surface", "c.npz", "-o", "c.npy"]).code(0);
        }
    }
}

/// Older files did not state their mode.
#[test]
fn images_without_a_mode_are_read_as_exact() {
    let folder = Folder::new();
    let images = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/images/compressed.npz");
    let run = folder.run(&["surface", images, "-o", "out.stl"]).code(0);
    assert!(run.stderr().contains("states no mode"), "{}", run.stderr());
    let run = folder.run(&["surface", images, "--mode", "over", "-o", "out.stl"]).code(0);
    assert!(!run.stderr().contains("states no mode"), "{}", run.stderr());
}
