//! Files that the program writes, and files that it must not write.

use std::fs;

use crate::{Folder, assert_near, cube, read, warning_codes};

#[test]
fn convert_keeps_and_places_meshes() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.1, 2.0));
    let text = folder.run(&["convert", "a.stl", "-o", "a.obj", "--unit", "mm"]).code(0).stdout();
    assert_eq!(text, "a.obj: 12 triangles, in mm\n");
    folder.run(&["convert", "a.obj", "-o", "b.stl", "--transform-a", "scale(-1,1,2)"]).code(0);
    let result = folder.json(&["check", "b.stl"]);
    let volume = result["results"][0]["volume"].as_f64().unwrap();
    assert!((volume - 16.0).abs() < 1e-5, "{volume}");
    assert_eq!(folder.names(), ["a.obj", "a.stl", "b.stl"]);
}

#[test]
fn formats_without_a_writer_are_refused_before_inputs_are_read() {
    let folder = Folder::new();
    for (target, words) in [
        ("b.gltf", &["b.gltf", "glTF", "cannot write", ".glb and .3mf"][..]),
        ("b.xyz", &[".xyz", ".stl"]),
        ("b", &["no extension"]),
        ("nowhere/b.stl", &["the folder nowhere does not exist"]),
    ] {
        folder.run(&["convert", "missing.stl", "-o", target]).code(2).says(words);
        folder.run(&["generate", "sphere", "-o", target]).code(2).says(words);
    }
    assert!(folder.names().is_empty());
}

#[test]
fn every_kind_of_model_passes_the_check() {
    let folder = Folder::new();
    let small: [(&str, &[&str]); 28] = [
        ("cuboid", &["--min", "-1,-2,-3", "--max", "1,2,3"]),
        ("box", &[]),
        ("sphere", &[]),
        ("geodesic", &["--frequency", "4"]),
        ("torus", &[]),
        ("cylinder", &[]),
        ("gyroid", &["--cells", "1"]),
        ("gyroid", &["--cells", "1", "--part", "network"]),
        ("primitive", &["--cells", "1,1,2"]),
        ("diamond", &["--cells", "1"]),
        ("cubic", &["--cells", "2", "--resolution", "12"]),
        ("bcc", &["--cells", "2", "--resolution", "12"]),
        ("bone", &["--resolution", "60"]),
        ("hyperboloid", &["--zones", "8"]),
        ("chain", &["--links", "2"]),
        ("brush", &["--bristles", "2,3"]),
        ("trabecular", &["--size", "3,3,4", "--resolution", "8"]),
        ("geodesic-frame", &["--frequency", "2"]),
        ("hyperboloid-frame", &["--bars", "12", "--crossings", "4"]),
        ("hyperboloid-frame", &["--bars", "8"]),
        ("weave", &["--yarns", "3,2", "--layers", "2"]),
        ("chain-mail", &["--columns", "2", "--rows", "2"]),
        ("ell", &["--notch", "0.5,0.25"]),
        ("hollow-box", &["--hollow", "5,6,7"]),
        ("star", &[]),
        ("knot", &["--sides", "5"]),
        ("organic", &["--resolution", "30"]),
        ("skull", &["--resolution", "30"]),
    ];
    for (kind, parameters) in small {
        let arguments = [&["generate", kind, "-o", "a.stl"], parameters].concat();
        let text = folder.run(&arguments).code(0).stdout();
        assert!(text.contains("mm³"), "{text}");
        folder.run(&["check", "a.stl"]).code(0);
    }
    folder.run(&["generate", "dodo", "-o", "a.stl"]).code(2).says(&["dodo"]);
    folder.run(&["generate", "sphere", "--wall", "2", "-o", "a.stl"]).code(2).says(&["--wall"]);
    folder.run(&["generate", "sphere", "--radius", "-2", "-o", "b.stl"]).code(2).says(&["radius", "-2"]);
    folder.run(&["generate", "sphere", "--radius", "big", "-o", "b.stl"]).code(2).says(&["radius", "big"]);
    folder.run(&["generate", "torus", "--minor", "12", "-o", "b.stl"]).code(2).says(&["--major is 10 by default"]);
    folder.run(&["generate", "sphere"]).code(2).says(&["-o"]);
    assert_eq!(folder.names(), ["a.stl"]);
}

#[test]
fn impossible_outputs_are_refused_before_inputs_are_read() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    for (target, words) in [
        ("b.gltf", &["b.gltf", "cannot write", ".3mf"][..]),
        ("nowhere/b.stl", &["the folder nowhere does not exist"]),
        ("b.doc", &["unknown extension", ".npz", ".vti"]),
        ("b", &["no extension", ".npz"]),
        ("nowhere/b.npz", &["the folder nowhere does not exist"]),
        ("nowhere/b.vti", &["the folder nowhere does not exist"]),
    ] {
        // The second input is missing, but the program does not get that far.
        folder.run(&["union", "a.stl", "missing.stl", "-o", target]).code(2).says(words);
        folder.run(&["sample", "missing.stl", "-o", target]).code(2).says(words);
    }
    for (target, words) in [
        ("b.gltf", &["cannot write glTF", ".3mf"][..]),
        ("b.npz", &["b.npz: `.npz` is not a mesh format to write; -o takes .stl, .obj, .ply, .off, .glb or .3mf"]),
        ("b", &["no extension", "-o takes .stl"]),
    ] {
        folder.run(&["convert", "missing.stl", "-o", target]).code(2).says(words);
    }
    folder.run(&["volume", "a.vti"]).code(2).says(&["a.vti: `.vti` is not a supported", ".3mf, and images in .npz"]);
    folder
        .run(&["volume", "missing.stl", "--json", "nowhere/a.json"])
        .code(2)
        .says(&["the folder nowhere does not exist"]);
}

#[test]
fn failed_runs_leave_no_new_output_and_keep_the_old_one() {
    let folder = Folder::new();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    fs::write(folder.path("old.npz"), "what was there before").unwrap();
    folder.run(&["sample", "open.stl", "-o", "old.npz"]).code(2);
    folder.run(&["sample", "open.stl", "-o", "new.npz", "--json", "new.json"]).code(2);
    // The JSON file holds the error.
    assert_eq!(folder.names(), ["new.json", "old.npz", "open.stl"]);
    assert!(read(&folder.path("new.json")).contains("not closed"));
    assert_eq!(read(&folder.path("old.npz")), "what was there before");
    // An infinite coordinate has no place among the 32-bit numbers of STL.
    fs::write(folder.path("big.obj"), "v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    folder.run(&["convert", "big.obj", "-o", "big.stl"]).code(2).says(&["big.stl", "coordinate", "32-bit"]);
    assert!(!folder.path("big.stl").exists());
}

/// Files cannot be created in /proc, whatever their permissions.
#[cfg(target_os = "linux")]
#[test]
fn errors_name_folders_that_cannot_be_written() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.run(&["sample", "a.stl", "--resolution", "8", "-o", "/proc/a.npz"]).code(2).says(&["/proc/a.npz"]);
}

#[cfg(unix)]
#[test]
fn devices_pipes_and_links_are_written_into() {
    use std::os::unix::fs::{FileTypeExt, symlink};

    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let with_json = |path| folder.run(&["volume", "a.stl", "--resolution", "8", "--json", path]).code(0);
    with_json("/dev/null");
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
    let run = with_json("/dev/stderr");
    assert!(run.stdout().starts_with("volume") && run.stderr().contains("\"schema\": \"ldi-ops/1\""));
    // A link stays a link, whether its target is created or replaced.
    symlink("b.json", folder.path("link.json")).unwrap();
    for _ in 0..2 {
        with_json("link.json");
        assert!(fs::symlink_metadata(folder.path("link.json")).unwrap().is_symlink());
        assert!(read(&folder.path("b.json")).starts_with('{'));
    }
    #[cfg(target_os = "linux")]
    {
        symlink("/dev/full", folder.path("full.npz")).unwrap();
        folder.run(&["sample", "a.stl", "--resolution", "8", "-o", "full.npz"]).code(3).says(&["full.npz"]);
    }
    // The program writes an archive into a pipe, too.
    let pipe = folder.path("pipe.npz");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    folder.run(&["sample", "a.stl", "--resolution", "8", "-o", "pipe.npz"]).code(0);
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    folder.run(&["sample", "a.stl", "--resolution", "8", "-o", "file.npz"]).code(0);
    assert!(reader.join().unwrap() == fs::read(folder.path("file.npz")).unwrap());
}

#[test]
fn two_outputs_to_one_file_are_refused() {
    let folder = Folder::new();
    for (json, output) in [("a.npz", "a.npz"), ("./a.npz", "a.npz")] {
        let arguments = ["sample", "missing.stl", "--json", json, "-o", output];
        folder.run(&arguments).code(2).says(&["--json", "same file"]);
    }
    for command in [&["convert", "missing.stl"][..], &["generate", "sphere"]] {
        let arguments = [command, &["--json", "a.stl", "-o", "a.stl"]].concat();
        folder.run(&arguments).code(2).says(&["same file"]);
    }
    assert!(folder.names().is_empty());
}

#[test]
fn meshes_are_converted_to_every_format_and_back_with_their_size() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    for format in ["obj", "ply", "off", "glb", "3mf"] {
        let file = format!("b.{format}");
        let result = folder.json(&["convert", "a.stl", "-o", &file, "--unit", "cm"]);
        let in_metres = format == "glb";
        assert_eq!(result["output"]["unit"], if in_metres { "m" } else { "cm" });
        assert_eq!(warning_codes(&result), [""; 0]);
        let checked = &folder.json(&["check", &file])["results"][0];
        let side: f64 = if in_metres { 0.02 } else { 2.0 };
        assert_near(checked["volume"].as_f64().unwrap() / side.powi(3), 1.0, 1e-6);
        // A soup of triangles has three corners of its own for each; these triangles share corners.
        assert_eq!((&checked["solid"], &checked["vertices"]), (&true.into(), &8.into()));
    }
    for (target, unit) in [("c.3mf", "in mm"), ("c.glb", "in m")] {
        folder.run(&["convert", "a.stl", "-o", target]).code(0).warns(&[target, "none is known", unit]);
        let result = folder.json(&["convert", "a.stl", "-o", target]);
        assert_eq!(warning_codes(&result), ["unit-assumed"]);
    }
}

/// A package with one object: two beams that meet in a right angle.
fn beams() -> Vec<u8> {
    const RELATIONSHIPS: &str = r#"<Relationships><Relationship Target="/3D/m.model" Id="r"
        Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>"#;
    const MODEL: &str = r#"<model unit="millimeter"><resources><object id="1"><mesh><vertices>
        <vertex x="0" y="0" z="0"/><vertex x="9" y="0" z="0"/><vertex x="0" y="9" z="0"/></vertices>
        <b:beamlattice radius="1" minlength="0.01"><b:beams><b:beam v1="0" v2="1"/><b:beam v1="0" v2="2"/></b:beams>
        </b:beamlattice></mesh></object></resources><build><item objectid="1"/></build></model>"#;
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, text) in [("_rels/.rels", RELATIONSHIPS), ("3D/m.model", MODEL)] {
        zip.start_file(name, options).unwrap();
        std::io::Write::write_all(&mut zip, text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

#[test]
fn beams_need_the_non_zero_rule() {
    let folder = Folder::new();
    fs::write(folder.path("beams.3mf"), beams()).unwrap();
    let even_odd = &["volume", "beams.3mf", "--resolution", "64"][..];
    folder.run(even_odd).code(2).says(&["beams.3mf", "beams", "use --fill nonzero"]);
    let result = folder.json(&[even_odd, &["--fill", "nonzero"]].concat());
    assert!(warning_codes(&result).contains(&"beams-meshed"), "{result}");
    // Two cylinders of length 9 with round ends, less their common part: a quarter of Steinmetz's solid between the beams, 4/3,
    // and three quarters of a ball around the corner.
    let pi = std::f64::consts::PI;
    let expected = 2.0 * (9.0 * pi + 4.0 / 3.0 * pi) - (4.0 / 3.0 + pi);
    assert_near(result["volume"]["value"].as_f64().unwrap(), expected, 0.01 * expected);
    folder.run(&["check", "beams.3mf"]).code(0).warns(&["beams", ": 2"]);
    let result = folder.json(&["convert", "beams.3mf", "-o", "beams.stl"]);
    assert_eq!(warning_codes(&result), ["beams-meshed", "unit-not-kept"]);
}

#[test]
fn coordinates_that_a_format_rounds_warn_and_spoiled_ones_are_refused() {
    let folder = Folder::new();
    let cube_at = |name: &str, x: f64| {
        let corners = (0..8).map(|i| format!("v {} {} {}\n", x + f64::from(i & 1), i >> 1 & 1, i >> 2));
        let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        std::fs::write(folder.path(name), corners.collect::<String>() + faces).unwrap();
    };
    // Rounding that moves coordinates gives a warning; rounding that spoils the mesh is refused.
    cube_at("far.obj", 1e5 + 0.3);
    cube_at("farthest.obj", 1e9);
    folder.run(&["convert", "farthest.obj", "-o", "farthest.stl"]).code(2).says(&["farthest.stl", "32"]);
    folder.run(&["convert", "far.obj", "-o", "far.stl"]).code(0).warns(&["far.stl", "32-bit coordinates"]);
    let run = folder.run(&["convert", "far.obj", "-o", "same.obj"]).code(0);
    assert!(!run.stderr().contains("32-bit"), "{}", run.stderr());
}

#[test]
fn surfaces_that_touch_in_a_vertex_are_parted_without_crossing() {
    let folder = Folder::new();
    folder.run(&["generate", "cuboid", "-o", "box.stl", "--min", "-10,-10,-10", "--max", "10,10,10"]).code(0);
    folder.run(&["generate", "sphere", "--radius", "10", "-o", "ball.stl"]).code(0);
    // Its ridge lies in the upper face of the box.
    let [a, b, c, d, e, f] =
        [[-5.0, -4.0, 3.0], [-5.0, 4.0, 3.0], [-5.0, 0.0, 10.0], [5.0, -4.0, 3.0], [5.0, 4.0, 3.0], [5.0, 0.0, 10.0]];
    let roof = [[a, c, b], [d, e, f], [a, b, e], [a, e, d], [b, c, f], [b, f, e], [c, a, d], [c, d, f]];
    folder.stl("roof.stl", &roof);
    for cavity in ["ball.stl", "roof.stl"] {
        for operation in ["difference", "xor"] {
            for file in ["out.stl", "out.obj", "out.3mf"] {
                folder.run(&[operation, "box.stl", cavity, "--unit", "mm", "-o", file]).code(0);
                folder.run(&["check", file]).code(0);
            }
        }
    }
    // The tip of a spike on the tip of a hill.
    let pyramid = |turn: f64, radius: f64, base: f64| {
        let corner = |angle: f64| {
            let (sin, cos) = angle.to_radians().sin_cos();
            [radius * cos, radius * sin, base]
        };
        let [a, b, c] = [turn, turn + 120.0, turn + 240.0].map(corner);
        let tip = [0.0, 0.0, 10.0];
        let sides = [[tip, a, b], [tip, b, c], [tip, c, a], [a, c, b]];
        if base < 10.0 { sides } else { sides.map(|[a, b, c]| [a, c, b]) }
    };
    folder.stl("hill.stl", &pyramid(90.0, 10.0, 8.0));
    for (turn, radius) in [(0.0, 0.3), (60.0, 0.3), (60.0, 2.0)] {
        folder.stl("above.stl", &pyramid(90.0 + turn, radius, 15.0));
        for inputs in [["hill.stl", "above.stl"], ["above.stl", "hill.stl"]] {
            folder.run(&["union", inputs[0], inputs[1], "--unit", "mm", "-o", "out.obj"]).code(0);
            let checked = folder.run(&["check", "out.obj"]).code(0);
            assert!(!checked.stderr().contains("touch or cross"), "{}", checked.stderr());
        }
    }
    // Spikes on both sides of a face.
    folder.stl("above.stl", &pyramid(30.0, 0.5, 15.0));
    folder.stl("within.stl", &pyramid(30.0, 0.5, 5.0));
    for inputs in [["above.stl", "within.stl", "box.stl"], ["box.stl", "within.stl", "above.stl"]] {
        for file in ["out.stl", "out.obj"] {
            folder.run(&[&["xor"], &inputs[..], &["--unit", "mm", "-o", file]].concat()).code(0);
            folder.run(&["check", file]).code(0);
        }
    }
    // Beside one another they touch from outside.
    folder.run(&["union", "box.stl", "roof.stl", "--transform-b", "translate(0,0,7)", "-o", "out.obj"]).code(0);
    folder.run(&["check", "out.obj"]).code(0);
}
