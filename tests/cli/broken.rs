//! Meshes that are not solids, or not the solids that they seem: a right answer with a warning, or a refusal that names the
//! place.

use crate::{Folder, Triangle, assert_near, cube, cuboid, inside_out, warning_codes};

#[test]
fn solids_that_meet_themselves_are_told() {
    let folder = Folder::new();
    let mut pulled = cube(0.0, 1.0);
    // One corner through the opposite face.
    for corner in pulled.iter_mut().flatten().filter(|corner| **corner == [1.0; 3]) {
        *corner = [0.4, 0.6, -0.5];
    }
    folder.stl("pulled.stl", &pulled);
    folder.stl("two.stl", &[cube(0.0, 2.0), cube(1.0, 2.0)].concat());
    folder.stl("apart.stl", &[cube(0.0, 1.0), cube(2.0, 1.0)].concat());
    folder.stl("flush.stl", &[cube(0.0, 1.0), cuboid([1.0, 0.25, 0.25], [2.0, 0.75, 0.75])].concat());
    let crossing = Some("cross near (");
    let told = [
        ("pulled.stl", crossing),
        ("two.stl", crossing),
        ("flush.stl", Some("touch or lie on one another, and none cross")),
        ("apart.stl", None),
    ];
    for (name, words) in told {
        let json = folder.json(&["check", name]);
        let result = &json["results"][0];
        assert_eq!(result["solid"], true, "{name}");
        assert_eq!(warning_codes(result).contains(&"meets-itself"), words.is_some(), "{name}");
        let run = folder.run(&["check", name]).code(0);
        if let Some(words) = words {
            run.warns(&[name, "triangles ", words, "--fill"]);
        }
    }
}

/// A prism over a polygon that may cross itself, with caps of fans from its first corner.
fn prism(outline: &[[f64; 2]]) -> Vec<Triangle> {
    let at = |i: usize, z: f64| {
        let [x, y] = outline[i % outline.len()];
        [x, y, z]
    };
    let caps = (1..outline.len() - 1)
        .flat_map(|i| [[at(0, 0.0), at(i + 1, 0.0), at(i, 0.0)], [at(0, 1.0), at(i, 1.0), at(i + 1, 1.0)]]);
    let sides = (0..outline.len()).flat_map(|i| {
        let [a, b, c, d] = [at(i, 0.0), at(i + 1, 0.0), at(i + 1, 1.0), at(i, 1.0)];
        [[a, b, c], [a, c, d]]
    });
    caps.chain(sides).collect()
}

#[test]
fn faces_of_a_star_that_lie_on_one_another_leave_no_walls() {
    let folder = Folder::new();
    let corner = |i: usize| (0.8 * std::f64::consts::PI * i as f64).sin_cos();
    let star: Vec<[f64; 2]> = (0..5).map(corner).map(|(y, x)| [x, y]).collect();
    folder.stl("star.stl", &prism(&star));
    folder.stl("cube.stl", &cube(0.0, 1.0));
    let unite = ["union", "star.stl", "cube.stl"];
    for more in [&[][..], &["--fill", "nonzero"], &["--mesh", "sampled"]] {
        for out in ["out.obj", "out.stl"] {
            let json = folder.json(&[&unite[..], more, &["-o", out]].concat());
            assert!(!warning_codes(&json).contains(&"walls-left"), "{json}");
            let checked = folder.run(&["check", out]).code(0);
            assert!(!checked.stderr().contains("cross near"), "{more:?} {out}: {}", checked.stderr());
            if more.is_empty() {
                // Both sides of walls counted, too: it was 16.6.
                let area = folder.json(&["check", out])["results"][0]["area"].as_f64().unwrap();
                assert_near(area, 13.20017, 1e-4);
            }
        }
    }
    // Rays tell which of the faces bound the solid: five points without the pentagon between them.
    let json = folder.json(&["volume", "star.stl"]);
    let [area, error, volume] =
        [&json["area"], &json["area_error"], &json["volume"]["value"]].map(|v| v.as_f64().unwrap());
    let outline = 5.0 * 2.0 * 72f64.to_radians().sin();
    assert!((area - (2.0 * volume + outline)).abs() <= error && error < 0.01 * area, "{json}");
    assert!(folder.run(&["volume", "star.stl"]).code(0).stdout().contains(" ± "));
    // Where no faces coincide, the area is exact.
    assert_eq!(folder.json(&["volume", "cube.stl"])["area_error"], 0.0);
}

#[test]
fn walls_that_are_left_between_faces_of_one_shell_are_told() {
    let folder = Folder::new();
    folder.stl("a.stl", &prism(&[[10.0, 4.0], [0.0, 7.0], [8.0, 5.0], [3.0, 6.0]]));
    folder.stl("b.stl", &prism(&[[4.0, 2.0], [9.0, 4.0], [7.0, 4.0], [4.0, 6.0]]));
    let words = ["faces of one shell lie on one another", "cross near (", "--fill nonzero"];
    folder.run(&["xor", "a.stl", "b.stl", "-o", "out.off"]).code(0).warns(&words);
}

#[test]
fn an_area_that_no_ray_tells_has_the_error_of_all_coincident_faces() {
    let folder = Folder::new();
    let corner = |i: usize| (0.8 * std::f64::consts::PI * i as f64).sin_cos();
    let star: Vec<[f64; 2]> = (0..5).map(corner).map(|(y, x)| [x, y]).collect();
    folder.stl("both.stl", &[prism(&star), cuboid([2.0; 3], [1000.0; 3])].concat());
    let json = folder.json(&["volume", "both.stl", "--resolution", "16"]);
    let [area, error] = ["area", "area_error"].map(|key| json[key].as_f64().unwrap());
    let of_star = 2.0 * 0.775_676_8 + 10.0 * 72f64.to_radians().sin();
    let expected = 6.0 * 998f64.powi(2) + of_star;
    assert!(error > 0.0 && (area - expected).abs() <= error, "{json}");
}

#[test]
fn overlaps_are_not_taken_for_parts_that_are_inside_out() {
    let folder = Folder::new();
    folder.stl("slight.stl", &[cube(0.0, 1.0), cuboid([0.999, 0.0, 0.0], [2.0, 1.0, 1.0])].concat());
    folder.stl("three.stl", &[cube(0.0, 1.0), cube(0.0, 1.0), cube(0.0, 1.0)].concat());
    for name in ["slight.stl", "three.stl"] {
        let json = folder.json(&["volume", name]);
        assert!(!warning_codes(&json).contains(&"parts-inside-out"), "{json}");
    }
}

#[test]
fn lobes_that_are_inside_out_are_told() {
    let folder = Folder::new();
    folder.stl("bow.stl", &prism(&[[0.0, 0.0], [3.0, 3.0], [3.0, 0.0], [0.0, 1.0]]));
    // Lobes of 0.375 and 3.375, of which one counts against the other.
    let json = folder.json(&["volume", "bow.stl"]);
    assert!(warning_codes(&json).contains(&"parts-inside-out"), "{json}");
    let words = ["bow.stl: parts of the surface are inside out", "mesh volume of -3", "the volume is 3.75"];
    folder.run(&["volume", "bow.stl"]).code(0).warns(&words);
    folder.run(&["check", "bow.stl"]).code(1).warns(&["triangles ", "cross near (0.75, 0.75"]);
}

#[test]
fn a_mesh_with_a_missing_triangle_is_refused_with_all_defects() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0)[1..]);
    folder.stl("b.stl", &cube(0.0, 2.0));
    let words = ["a.stl", "not closed", "3 edges are open", "--allow-open", "check"];
    folder.run(&["volume", "a.stl"]).code(2).says(&words);
    folder.run(&["intersect", "b.stl", "a.stl"]).code(2).says(&words);
    let run = folder.run(&["check", "b.stl", "a.stl"]).code(1);
    assert!(run.stdout().contains("b.stl: a solid") && run.stdout().contains("a.stl: NOT a solid"), "{}", run.stdout());
    assert!(run.stdout().contains("3 edges are open"));
}

#[test]
fn check_continues_after_a_bad_file() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    std::fs::write(folder.path("cut.stl"), "solid test\nfacet").unwrap();
    let files = ["cut.stl", "a.stl", "missing.stl", "open.stl"];
    let run = folder.run(&[&["check"], &files[..]].concat()).code(2);
    for verdict in ["a.stl: a solid\n", "open.stl: NOT a solid\n"] {
        assert!(run.stdout().contains(verdict), "{}", run.stdout());
    }
    let lines = run.stderr();
    let errors: Vec<&str> = lines.lines().filter_map(|line| line.strip_prefix("ldi-ops: error: ")).collect();
    assert!(
        errors.len() == 3 && errors[1].starts_with("cut.stl, line 2") && errors[2].starts_with("missing.stl: "),
        "{lines}"
    );
    let result = folder.run(&[&["check"], &files[..], &["--json", "-"]].concat()).code(2).json();
    let results = result["results"].as_array().unwrap();
    assert_eq!((&results[1]["solid"], &results[3]["solid"]), (&true.into(), &false.into()));
    for i in [0, 2] {
        assert_eq!((&results[i]["path"], &results[i]["error"]["kind"]), (&files[i].into(), &"input".into()));
    }
    assert_eq!(result["inputs"][2], serde_json::json!({ "path": "missing.stl" }));
    assert!(result["error"].is_null() && result["warnings"].is_array());
    let quiet = folder.run(&["check", "a.stl", "open.stl", "-q"]).code(1);
    let stdout = quiet.stdout();
    let verdicts: Vec<&str> = stdout.lines().filter(|line| !line.starts_with(' ')).collect();
    assert_eq!(verdicts, ["a.stl: a solid", "open.stl: NOT a solid"]);
    assert_eq!(quiet.stderr(), "");
}

#[test]
fn open_meshes_are_sampled_with_allow_open() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0)[1..]);
    let arguments = ["volume", "a.stl", "--allow-open", "--resolution", "64", "--axis", "all"];
    let result = folder.json(&arguments);
    // One triangle, half of one of the faces across x, is missing.
    let unclosed = result["unclosed_rays"].as_u64().unwrap();
    assert!((1950..2150).contains(&unclosed), "{unclosed}");
    assert_eq!(result["inputs"][0]["closed"], false);
    assert!(warning_codes(&result).contains(&"open"));
    folder.run(&arguments).code(0).warns(&[
        "a.stl",
        "not closed",
        "of 4096 along x",
        "0 of 4096 along z",
        "count as empty",
    ]);
    assert_near(folder.volume(&["volume", "a.stl", "--allow-open", "--resolution", "64", "--axis", "z"]), 8.0, 1e-6);
    // Files of such images are no better.
    folder.run(&["sample", "a.stl", "--allow-open", "--resolution", "32", "-o", "a.npz"]).code(0);
    folder.stl("b.stl", &cube(-1.0, 4.0));
    let open = ["a.npz: rays that did not close count as empty", "of 1024 along x"];
    let disagree = ["a.npz: the images along different axes disagree", "not exact images of one closed solid"];
    for job in [&["volume", "a.npz"][..], &["check", "a.npz"], &["intersect", "a.npz", "b.stl"]] {
        let result = folder.json(job);
        assert!(warning_codes(&result).starts_with(&["open", "images-disagree"]), "{result:#}");
    }
    folder.run(&["intersect", "a.npz", "b.stl"]).code(0).warns(&open).warns(&disagree);
    folder.run(&["surface", "a.npz", "-o", "c.stl"]).code(0).warns(&open).warns(&disagree);
}

#[test]
fn a_mesh_without_two_faces_has_the_centroid_of_the_images_that_meet_it() {
    let folder = Folder::new();
    let open: Vec<Triangle> =
        cube(0.0, 2.0).into_iter().filter(|t| t.iter().any(|corner| corner[0] != t[0][0])).collect();
    assert_eq!(open.len(), 8);
    folder.stl("tube.stl", &open);
    let job = ["volume", "tube.stl", "--allow-open", "--resolution", "32"];
    let result = folder.json(&job);
    assert_eq!(result["centroid"], serde_json::json!([1.0, 1.0, 1.0]));
    folder
        .run(&job)
        .code(0)
        .warns(&["a mesh is not closed, so that images along different axes may disagree", "repair the mesh"]);
}

#[test]
fn corners_without_a_position_are_no_holes() {
    let folder = Folder::new();
    let mut broken = cube(0.0, 2.0);
    broken[3][1][2] = f32::NAN.into();
    folder.stl("nan.stl", &broken);
    let run = folder
        .run(&["volume", "nan.stl"])
        .code(2)
        .says(&["nan.stl: the mesh has corners without a position", "not finite"]);
    assert!(!run.stderr().contains("--allow-open"), "{}", run.stderr());
}

#[test]
fn doubled_meshes_are_refused_by_even_odd() {
    let folder = Folder::new();
    let twice = [cube(0.0, 2.0), cube(0.0, 2.0)].concat();
    folder.stl("a.stl", &twice);
    folder.run(&["volume", "a.stl"]).code(2).says(&["a.stl", "every triangle", "even number", "--fill nonzero"]);
    assert_near(folder.volume(&["volume", "a.stl", "--fill", "nonzero", "--resolution", "32"]), 8.0, 1e-6);
    folder.run(&["check", "a.stl"]).code(1);
}

#[test]
fn inside_out_meshes_are_measured_with_a_warning() {
    let folder = Folder::new();
    folder.stl("a.stl", &inside_out(&cube(0.0, 2.0)));
    for fill in ["even-odd", "nonzero"] {
        let arguments = ["volume", "a.stl", "--resolution", "32", "--fill", fill];
        assert_near(folder.volume(&arguments), 8.0, 1e-6);
        let result = folder.json(&arguments);
        assert_eq!(result["inputs"][0]["volume"], -8.0);
        assert_eq!(warning_codes(&result), ["inside-out", "unit-assumed"]);
        folder.run(&arguments).code(0).warns(&["a.stl", "inside out"]);
    }
    folder.run(&["check", "a.stl"]).code(1);
}

#[test]
fn unoriented_meshes_are_measured_by_even_odd_alone() {
    let folder = Folder::new();
    let mut triangles = cube(0.0, 2.0);
    triangles[3].swap(1, 2);
    folder.stl("a.stl", &triangles);
    let result = folder.json(&["volume", "a.stl", "--resolution", "32"]);
    assert_near(result["volume"]["value"].as_f64().unwrap(), 8.0, 1e-6);
    assert_eq!((&result["inputs"][0]["oriented"], &result["inputs"][0]["closed"]), (&false.into(), &true.into()));
    assert!(warning_codes(&result).contains(&"not-oriented"));
    assert_eq!(result["volume"]["method"], "exact");
    let words = ["a.stl", "nonzero", "consistently oriented", "edges join triangles that face opposite ways"];
    folder.run(&["volume", "a.stl", "--fill", "nonzero"]).code(2).says(&words);
}

#[test]
fn coordinates_that_are_not_finite_are_refused_with_their_place() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let folder = Folder::new();
        let mut triangles = cube(0.0, 2.0);
        triangles[5][1][2] = bad;
        folder.stl("a.stl", &triangles);
        for allow in [&[][..], &["--allow-open"]] {
            let run = folder.run(&[&["volume", "a.stl"], allow].concat());
            run.code(2).says(&["a.stl", "not finite", "triangle 5"]);
        }
        folder.run(&["check", "a.stl"]).code(1);
    }
}

#[test]
fn meshes_without_extent_are_refused() {
    let folder = Folder::new();
    let point: Triangle = [[1.0; 3]; 3];
    folder.stl("a.stl", &[point, point]);
    let line: Triangle = [[0.0; 3], [1.0; 3], [1.0; 3]];
    folder.stl("b.stl", &[line]);
    for file in ["a.stl", "b.stl"] {
        folder.run(&["volume", file]).code(2).says(&[file, "no triangle has three different corners"]);
    }
}

#[test]
fn solids_between_the_rays_have_the_area_of_their_mesh() {
    let folder = Folder::new();
    folder.stl("a.stl", &[cube(0.0, 0.25), cube(9.75, 0.25)].concat());
    let result = folder.json(&["volume", "a.stl", "--resolution", "1"]);
    assert_eq!(result["area"], 0.75);
}

#[test]
fn very_small_and_very_large_meshes_are_measured() {
    for scale in [1e-30, 1e-9, 1e12, 1e30] {
        let folder = Folder::new();
        let triangles: Vec<Triangle> =
            cube(3.0, 2.0).iter().map(|t| t.map(|corner| corner.map(|c| c * scale))).collect();
        folder.stl("a.stl", &triangles);
        let volume = folder.volume(&["volume", "a.stl", "--resolution", "32"]);
        assert_near(volume / (scale * scale * scale), 8.0, 1e-6);
        let text = folder.run(&["volume", "a.stl", "--resolution", "32", "--unit", "m"]).code(0).stdout();
        assert!(text.starts_with("volume      8"), "{text}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_larger_than_memory_is_refused() {
    let folder = Folder::new();
    // The file is sparse: it takes no room on the disk.
    std::fs::File::create(folder.path("big.stl")).unwrap().set_len(1 << 43).unwrap();
    for command in ["volume", "check"] {
        folder.run(&[command, "big.stl"]).code(3).says(&["big.stl", "8796093022208", "memory"]);
    }
}

/// Nobody writes into the pipe, so a program that opened it would wait.
#[cfg(unix)]
#[test]
fn inputs_that_are_not_regular_files_are_refused() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    for name in ["pipe.stl", "pipe.npz", "pipe.toml"] {
        assert!(std::process::Command::new("mkfifo").arg(folder.path(name)).status().unwrap().success());
    }
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.stl")).unwrap();
    for (arguments, words) in [
        (&["volume", "pipe.stl"][..], ["pipe.stl", "is a pipe"]),
        (&["volume", "pipe.npz"], ["pipe.npz", "is a pipe"]),
        (&["surface", "pipe.npz", "-o", "b.stl"], ["pipe.npz", "is a pipe"]),
        (&["report", "a.stl", "-o", "out", "--limits", "pipe.toml"], ["pipe.toml", "is a pipe"]),
        (&["check", "zero.stl"], ["zero.stl", "is a device"]),
    ] {
        let run = folder.command(arguments).timeout(std::time::Duration::from_secs(60)).output().unwrap();
        crate::Run { output: run }.code(2).says(&words);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn files_that_end_in_zeros_are_refused_before_they_are_read() {
    let folder = Folder::new();
    folder.stl("text.stl", &cube(0.0, 2.0));
    folder.run(&["convert", "text.stl", "-o", "binary.stl"]).code(0);
    for (name, words) in [("text.stl", "the text ends with zero bytes"), ("binary.stl", "declares 684 bytes")] {
        std::fs::File::options().write(true).open(folder.path(name)).unwrap().set_len(1 << 43).unwrap();
        folder.run(&["volume", name]).code(2).says(&[name, words]);
    }
}

#[test]
fn errors_name_files_that_cannot_be_read() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    std::fs::create_dir(folder.path("folder.stl")).unwrap();
    std::fs::write(folder.path("empty.stl"), "").unwrap();
    std::fs::write(folder.path("short.stl"), "solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 zero 0\n").unwrap();
    std::fs::write(folder.path("a.xyz"), "0 0 0\n").unwrap();
    for (file, words) in [
        ("missing.stl", &["missing.stl", "No such file"][..]),
        ("folder.stl", &["folder.stl"]),
        ("empty.stl", &["empty.stl", "no bytes"]),
        ("short.stl", &["short.stl", "line 4", "zero"]),
        ("a.xyz", &["a.xyz", ".xyz", ".stl"]),
        ("a", &["a: ", "no extension"]),
    ] {
        for command in
            [&["volume", file][..], &["check", file], &["intersect", "a.stl", file], &["convert", file, "-o", "o.stl"]]
        {
            folder.run(command).code(2).says(words);
        }
    }
    assert!(!folder.names().contains(&"o.stl".to_owned()));
}

#[test]
fn all_inputs_that_cannot_be_used_are_named() {
    let folder = Folder::with_two_cubes();
    std::fs::write(folder.path("text.stl"), "no mesh").unwrap();
    let error = folder.run(&["union", "a.stl", "x.stl", "b.stl", "text.stl", "y.stl"]).code(2).stderr();
    for (line, name) in
        error.lines().zip(["3 inputs cannot be used:", "  x.stl: No such file", "  text.stl, byte 0: ", "  y.stl: "])
    {
        assert!(line.contains(name), "{error}");
    }
    assert_eq!(error.trim_end().lines().count(), 4, "{error}");
    let many: Vec<String> = (0..30).map(|i| format!("{i}.stl")).collect();
    let operands: Vec<&str> = many.iter().map(String::as_str).collect();
    let error = folder.run(&[&["union"][..], &operands].concat()).code(2).stderr();
    assert!(error.starts_with("ldi-ops: error: 30 inputs") && error.trim_end().ends_with("and 24 more"), "{error}");
    folder.run(&["union", "a.stl", "x.stl"]).code(2).says(&["error: x.stl: No such file"]);
}

#[test]
fn what_is_flat_or_has_no_triangles_is_not_said_to_consist_of_duplicates() {
    let folder = Folder::new();
    folder.stl("flat.stl", &cuboid([0.0; 3], [2.0, 2.0, 0.0]));
    folder.run(&["volume", "flat.stl"]).code(2).says(&["flat.stl", "flat"]);
    let text = "OFF\n3 2 0\n0.1 0.2 0.3\n1.7 0.4 0.9\n0.33 2.1 0.77\n3 0 0 1\n3 1 1 2\n";
    std::fs::write(folder.path("needles.off"), text).unwrap();
    let run = folder.run(&["check", "needles.off"]).code(1);
    let told = run.stdout();
    assert!(told.contains("NOT a solid") && !told.contains("even number"), "{told}");
    std::fs::write(folder.path("empty.npz"), "").unwrap();
    folder.run(&["volume", "empty.npz"]).code(2).says(&["empty.npz", "not an .npz archive"]);
}
