//! Voxels as `.npy` and `.vti`.

use std::fs;

use crate::{Folder, assert_near, cube, cuboid, read};

/// Returns the shape in the header of a `.npy` file, and its elements, with x fastest.
fn array(folder: &Folder, name: &str) -> (String, Vec<u8>) {
    let bytes = fs::read(folder.path(name)).unwrap();
    assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
    let body = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    (String::from_utf8(bytes[10..body].to_vec()).unwrap(), bytes[body..].to_vec())
}

#[test]
fn voxels_equal_the_nodes_inside() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [8.0, 4.0, 2.0]));
    // 16 × 8 × 4 pixels, of which those on the near side of each axis are outside the smaller box.
    folder.stl("b.stl", &cuboid([2.0, 1.0, 0.5], [8.0, 4.0, 2.0]));
    let arguments = ["intersect", "a.stl", "b.stl", "--resolution", "16", "--mode", "exact", "-o", "c.npy"];
    let result = folder.json(&arguments);
    assert_eq!(result["output"], "c.npy");
    let (header, voxels) = array(&folder, "c.npy");
    assert!(header.starts_with("{'descr': '|u1', 'fortran_order': True, 'shape': (16,8,4,), }"), "{header}");
    let expected = |i: usize| i % 16 >= 4 && i / 16 % 8 >= 2 && i / 128 >= 1;
    assert_eq!(voxels.len(), 16 * 8 * 4);
    assert!((0..voxels.len()).all(|i| voxels[i] == u8::from(expected(i))));
}

#[test]
fn voxels_from_one_axis_agree_and_estimates_enclose() {
    let folder = Folder::new();
    folder.run(&["generate", "torus", "-o", "a.stl"]).code(0);
    let count = |mode, axis| {
        folder.run(&["sample", "a.stl", "--resolution", "64", "--mode", mode, "--axis", axis, "-o", "a.npy"]).code(0);
        array(&folder, "a.npy").1
    };
    let exact = count("exact", "all");
    assert!(["x", "y", "z"].iter().all(|axis| count("exact", axis) == exact));
    let (under, over) = (count("under", "all"), count("over", "all"));
    assert!((0..exact.len()).all(|i| under[i] <= exact[i] && exact[i] <= over[i]));
    let result = folder.json(&["sample", "a.stl", "--resolution", "64", "--mode", "exact", "-o", "a.npy"]);
    let pitch = result["grid"]["pitch"].as_f64().unwrap();
    let inside: f64 = exact.iter().map(|&voxel| f64::from(voxel)).sum();
    let volume = result["volume"]["value"].as_f64().unwrap();
    assert_near(inside * pitch.powi(3), volume, 0.02 * volume);
}

#[test]
fn image_data_states_its_place_and_unit() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(1.0, 2.0));
    let run = folder.run(&["sample", "a.stl", "--resolution", "16", "--unit", "um", "-o", "A.VTI", "-v"]).code(0);
    assert!(run.stderr().contains("16 × 16 × 16 voxels, of which 4096 are inside"), "{}", run.stderr());
    let bytes = fs::read(folder.path("A.VTI")).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    for words in [
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\"",
        "WholeExtent=\"0 16 0 16 0 16\"",
        "Origin=\"1.0",
        "Spacing=\"0.125 0.125 0.125\"",
        "Name=\"unit\" NumberOfTuples=\"1\" format=\"ascii\">117 109 0<",
        "</AppendedData>\n</VTKFile>\n",
    ] {
        assert!(text.contains(words), "no {words} in {}", &text[..900]);
    }
}

#[test]
fn voxels_do_not_depend_on_the_thread_count() {
    let folder = Folder::new();
    folder.run(&["generate", "torus", "-o", "a.stl"]).code(0);
    for extension in ["vti", "npy"] {
        for threads in ["1", "2"] {
            let output = format!("{threads}.{extension}");
            folder.run(&["sample", "a.stl", "--resolution", "200", "-o", &output, "--threads", threads]).code(0);
        }
        let [one, two] = ["1", "2"].map(|name| fs::read(folder.path(&format!("{name}.{extension}"))).unwrap());
        assert!(one == two && one.len() > 1000);
    }
}

#[test]
fn failed_runs_leave_no_voxels() {
    let folder = Folder::new();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    fs::write(folder.path("old.vti"), "what was there before").unwrap();
    folder.run(&["sample", "open.stl", "-o", "old.vti"]).code(2);
    folder.run(&["sample", "open.stl", "-o", "new.npy"]).code(2);
    assert_eq!(folder.names(), ["old.vti", "open.stl"]);
    assert_eq!(read(&folder.path("old.vti")), "what was there before");
}
