//! Tests that each operation gives the right volume in every mode.

use crate::{Folder, assert_near, cube, cuboid, warning_codes};

#[test]
fn booleans_of_two_cubes_are_exact_in_every_mode() {
    let folder = Folder::with_two_cubes();
    for mode in ["over", "under", "exact"] {
        for axis in ["x", "y", "z", "all"] {
            // 300 rays over the length of 3: the faces lie between rays and on lattice planes.
            let volume = |command| {
                folder.volume(&[command, "a.stl", "b.stl", "--mode", mode, "--axis", axis, "--resolution", "300"])
            };
            for (command, expected) in [("intersect", 1.0), ("union", 15.0), ("difference", 7.0), ("xor", 14.0)] {
                assert_near(volume(command), expected, 1e-6);
            }
        }
    }
}

#[test]
fn operations_fold_several_solids_from_left_to_right() {
    let folder = Folder::with_two_cubes();
    folder.stl("c.stl", &cuboid([0.0, 0.0, 0.0], [3.0, 3.0, 1.0]));
    // The volumes of A, B, C and their overlaps: 8, 8, 9; AB 1, AC 4, BC 0, ABC 0.
    for mode in ["over", "under", "exact"] {
        let volume = |command| {
            folder.volume(&[command, "a.stl", "b.stl", "c.stl", "--mode", mode, "--axis", "z", "--resolution", "300"])
        };
        for (command, expected) in [("intersect", 0.0), ("union", 20.0), ("difference", 3.0), ("xor", 15.0)] {
            assert_near(volume(command), expected, 1e-6);
        }
        folder.stl("d.stl", &cube(1.0, 0.5));
        let common = folder.volume(&["intersect", "a.stl", "b.stl", "d.stl", "--mode", mode, "--resolution", "300"]);
        assert_near(common, 0.125, 1e-6);
    }
}

#[test]
fn over_and_under_enclose_the_exact_volume() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "10", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "torus", "--major", "9", "-o", "b.stl"]).code(0);
    for command in ["intersect", "union", "difference", "xor"] {
        let volume = |mode| {
            folder.volume(&[
                command,
                "a.stl",
                "b.stl",
                "--mode",
                mode,
                "--estimate",
                "--lod",
                "64",
                "--resolution",
                "128",
                "--axis",
                "y",
            ])
        };
        let (under, exact, over) = (volume("under"), volume("exact"), volume("over"));
        assert!(under <= exact && exact <= over && under < over, "{command}: {under} {exact} {over}");
    }
}

#[test]
fn equal_solids_differ_by_nothing_without_a_warning() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cube(5.0, 1.0));
    for [command, other] in [["difference", "a.stl"], ["xor", "a.stl"], ["intersect", "b.stl"]] {
        let json = folder.json(&[command, "a.stl", other, "--unit", "mm", "--bounds"]);
        let volume = &json["volume"];
        assert_eq!((volume["value"].as_f64(), &volume["method"]), (Some(0.0), &"exact".into()), "{command}");
        assert_eq!(warning_codes(&json), [""; 0], "{command}");
    }
    // Of round solids, rounding is left.
    let sphere = format!("{}/../../data/models/sphere.stl", env!("CARGO_MANIFEST_DIR"));
    let json = folder.json(&["difference", &sphere, &sphere, "--unit", "mm"]);
    assert!(json["volume"]["value"].as_f64() <= json["volume"]["estimate_error"].as_f64());
    assert_eq!(warning_codes(&json), [""; 0]);
    // Their boxes are apart, so not even rounding is left.
    let text = folder.run(&["intersect", "a.stl", "b.stl", "--unit", "mm", "--bounds"]).code(0).stdout();
    assert!(text.contains("0 to 0 mm³ (certified)"), "{text}");
}

#[test]
fn touching_cubes_share_no_volume() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [1.0; 3]));
    folder.stl("b.stl", &cuboid([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]));
    for mode in ["over", "exact", "under"] {
        let volume = |command| folder.volume(&[command, "a.stl", "b.stl", "--mode", mode, "--resolution", "64"]);
        assert_eq!(volume("intersect"), 0.0, "{mode}");
        assert_near(volume("union"), 2.0, 1e-7);
    }
}

#[test]
fn booleans_of_coincident_cubes_are_exact() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    let mut reversed = cube(0.0, 1.0);
    reversed.reverse();
    folder.stl("b.stl", &reversed);
    // Of a copy, and of another mesh of the same cube.
    for other in ["a.stl", "b.stl"] {
        for mode in ["over", "exact", "under"] {
            let volume = |command| folder.volume(&[command, "a.stl", other, "--mode", mode, "--resolution", "64"]);
            assert_near(volume("intersect"), 1.0, 1e-7);
            assert_near(volume("union"), 1.0, 1e-7);
            assert_eq!((volume("difference"), volume("xor")), (0.0, 0.0), "{mode}");
        }
    }
}

#[test]
fn disjoint_solids_share_no_volume() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cube(5.0, 1.0));
    let result = folder.json(&["intersect", "a.stl", "b.stl", "--tolerance", "1%"]);
    assert_eq!(result["volume"]["value"], 0.0);
    assert_eq!(result["volume"]["estimate_error"], 0.0);
}

#[test]
fn volume_gives_area_centroid_and_inertia() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([1.0, 2.0, 3.0], [2.0, 4.0, 7.0]));
    for mode in ["over", "exact"] {
        let result = folder.json(&["volume", "a.stl", "--mode", mode, "--resolution", "128", "--axis", "z"]);
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        assert_near(number(&result["volume"]["value"]), 8.0, 1e-6);
        assert_near(number(&result["area"]), 28.0, 1e-6);
        for (i, expected) in [1.5, 3.0, 5.0].into_iter().enumerate() {
            assert_near(number(&result["centroid"][i]), expected, 1e-6);
        }
        let (a, b, c) = (1.0, 2.0, 4.0);
        let moments = [b * b + c * c, a * a + c * c, a * a + b * b].map(|sum: f64| 8.0 * sum / 12.0);
        for (i, moment) in moments.into_iter().enumerate() {
            for j in 0..3 {
                assert_near(number(&result["inertia"][i][j]), if i == j { moment } else { 0.0 }, 1e-4);
            }
        }
    }
}

#[test]
fn volume_reports_each_of_several_solids() {
    let folder = Folder::with_two_cubes();
    folder.stl("c.stl", &cube(0.0, 1.0));
    let result = folder.json(&["volume", "a.stl", "c.stl", "--resolution", "32"]);
    assert_eq!(result["schema"], "ldi-ops/1");
    let results = result["results"].as_array().unwrap();
    assert_eq!(results.len(), 2);
    let paths: Vec<&str> = (0..2).map(|i| result["inputs"][i]["path"].as_str().unwrap()).collect();
    assert_eq!(paths, ["a.stl", "c.stl"]);
    assert_eq!(warning_codes(&result), ["unit-assumed", "unit-assumed"]);
    assert_near(results[1]["volume"]["value"].as_f64().unwrap(), 1.0, 1e-9);
    let text = folder.run(&["volume", "a.stl", "c.stl", "--resolution", "32"]).code(0).stdout();
    assert_eq!(text.matches("volume      ").count(), 2);
}

#[test]
fn volume_continues_after_a_bad_file() {
    let folder = Folder::with_two_cubes();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    let files = ["a.stl", "open.stl", "missing.stl", "b.stl"];
    let arguments = [&["volume"], &files[..], &["--resolution", "32", "--unit", "mm"]].concat();
    let run = folder.run(&arguments).code(2);
    assert_eq!(run.stdout().matches("volume      8 mm³ (exact)").count(), 2, "{}", run.stdout());
    let stderr = run.stderr();
    let errors: Vec<&str> = stderr.lines().filter_map(|line| line.strip_prefix("ldi-ops: error: ")).collect();
    assert!(errors[0] == "2 inputs gave no result:" && errors.len() == 3, "{stderr}");
    assert!(errors[1].starts_with("open.stl: the mesh is not closed") && errors[2].starts_with("missing.stl: "));
    let result = folder.run(&[&arguments[..], &["--json", "-"]].concat()).code(2).json();
    let results = result["results"].as_array().unwrap();
    assert_eq!(results.len(), 4);
    assert_eq!(
        (&results[0]["inputs"][0]["path"], &results[3]["inputs"][0]["path"]),
        (&"a.stl".into(), &"b.stl".into())
    );
    let error = &results[1]["error"];
    assert_eq!(
        (&results[1]["path"], &error["kind"], &error["exit_code"]),
        (&"open.stl".into(), &"input".into(), &2.into())
    );
    assert!(error["message"].as_str().unwrap().contains("3 edges are open"));
    for (i, file) in files.iter().enumerate() {
        assert_eq!(result["inputs"][i]["path"], *file);
    }
    // The worst exit code wins: too many rays for the machine, and a missing file.
    folder
        .run(&["volume", "a.stl", "missing.stl", "--estimate", "--resolution", "65535"])
        .code(3)
        .says(&["a.stl", "missing.stl"]);
}

#[test]
fn volumes_meet_and_state_the_tolerance() {
    let folder = Folder::new();
    folder.run(&["generate", "geodesic", "-o", "a.stl"]).code(0);
    for given in ["0.01%", "0.0001"] {
        let result = folder.json(&["volume", "a.stl", "--tolerance", given]);
        let volume = &result["volume"];
        let (value, error) = (volume["value"].as_f64().unwrap(), volume["estimate_error"].as_f64().unwrap());
        assert!(error <= 1e-4 * value);
        assert_eq!(result["tolerance"]["reached"], true);
        assert_eq!(result["tolerance"]["asked"], 1e-4);
    }
    let stderr = folder.run(&["intersect", "a.stl", "a.stl", "--estimate", "--tolerance", "3%"]).code(0).stderr();
    assert!(stderr.contains("reached with 128 rays"), "{stderr}");
}

#[test]
fn unreachable_tolerances_give_the_best_volume_and_exit_with_one() {
    let folder = Folder::new();
    folder.run(&["generate", "geodesic", "--frequency", "2", "-o", "a.stl"]).code(0);
    let arguments = ["intersect", "a.stl", "a.stl", "--axis", "z", "--estimate", "--tolerance", "0.0001%"];
    let run = folder.run(&[&arguments[..], &["--json", "-"]].concat()).code(1).warns(&["not reached", "4096 rays"]);
    let result = run.json();
    assert!(crate::warning_codes(&result).contains(&"tolerance-not-reached"));
    assert_eq!((&result["tolerance"]["reached"], &result["tolerance"]["resolution"]), (&false.into(), &4096.into()));
    let own = result["inputs"][0]["volume"].as_f64().unwrap();
    assert_near(result["volume"]["value"].as_f64().unwrap(), own, 1e-4 * own);
}

#[test]
fn volumes_follow_the_fill_rule_and_warn_where_the_rules_differ() {
    let folder = Folder::new();
    // Two shells in one file overlap in half of each.
    let mut shells = cuboid([0.0; 3], [2.0, 1.0, 1.0]);
    shells.extend(cuboid([1.0, 0.0, 0.0], [3.0, 1.0, 1.0]));
    folder.stl("a.stl", &shells);
    let arguments = ["volume", "a.stl", "--resolution", "96", "--fill"];
    let with = |fill| [&arguments[..], &[fill]].concat();
    assert_near(folder.volume(&with("nonzero")), 3.0, 1e-6);
    assert_near(folder.volume(&with("even-odd")), 2.0, 1e-6);
    folder.run(&with("even-odd")).code(0).warns(&["a.stl", "fill rules differ", "differ by 3", "even-odd was used"]);
    let result = folder.json(&with("even-odd"));
    assert!(crate::warning_codes(&result).contains(&"fill-rules-differ"));
    // The area is that of the surface alone.
    assert_near(folder.json(&with("nonzero"))["area"].as_f64().unwrap(), 14.0, 1e-6);
    // Intersections compare the fill rules although they sample no solid on its own.
    folder.stl("b.stl", &cube(0.0, 1.0));
    let result = folder.json(&["intersect", "a.stl", "b.stl", "--resolution", "64"]);
    assert!(crate::warning_codes(&result).contains(&"fill-rules-differ"));
    let result = folder.json(&["volume", "b.stl", "--resolution", "64"]);
    assert!(!crate::warning_codes(&result).contains(&"fill-rules-differ"));
}

#[test]
fn exact_volumes_need_no_raster() {
    let folder = Folder::with_two_cubes();
    let fine = ["intersect", "a.stl", "b.stl", "--pitch", "1e-12"];
    let run = folder.run(&fine).code(0).warns(&["rays along the longest side are outside", "needs no raster"]);
    assert!(run.stdout().starts_with("intersect   1 (exact)\n"), "{}", run.stdout());
    for flags in [&["--estimate"][..], &["--mode", "over"]] {
        folder.run(&[&fine[..], flags].concat()).code(2).says(&["rays along the longest side are outside"]);
    }
}

#[test]
fn fill_rules_are_compared_exactly_beside_exact_volumes() {
    let folder = Folder::new();
    let mut shells = cuboid([0.0; 3], [2.0, 1.0, 1.0]);
    shells.extend(cuboid([1.0, 0.0, 0.0], [3.0, 1.0, 1.0]));
    folder.stl("a.stl", &shells);
    folder.run(&["volume", "a.stl"]).code(0).warns(&["even-odd gives a volume of 2, nonzero 3;"]);
    folder.run(&["volume", "a.stl", "--estimate"]).code(0).warns(&["on a coarse raster"]);
}

#[test]
fn text_of_over_and_under_estimates_has_the_exact_volume() {
    let folder = Folder::with_two_cubes();
    for mode in ["over", "under"] {
        let arguments = ["intersect", "a.stl", "b.stl", "--mode", mode, "--unit", "mm"];
        let text = folder.run(&arguments).code(0).stdout();
        assert!(text.lines().any(|line| line == "exact       1 mm³"), "{text}");
        let text = folder.run(&[&arguments[..], &["--estimate"]].concat()).code(0).stdout();
        assert!(!text.contains("\nexact "), "{text}");
    }
    let text = folder.run(&["intersect", "a.stl", "b.stl"]).code(0).stdout();
    assert!(!text.contains("\nexact "), "{text}");
}

#[test]
fn pitch_and_resolution_set_the_grid() {
    let folder = Folder::with_two_cubes();
    let result = folder.json(&["intersect", "a.stl", "b.stl", "--pitch", "0.1"]);
    assert_eq!(result["grid"]["pitch"], 0.1);
    assert_eq!(result["grid"]["rays"], serde_json::json!([30, 30, 30]));
    let result = folder.json(&["intersect", "a.stl", "b.stl", "--resolution", "60", "--mode", "over", "--lod", "32"]);
    assert_eq!(result["grid"]["rays"], serde_json::json!([60, 60, 60]));
    assert!(crate::warning_codes(&result).contains(&"coarse-voxels"));
    for fine in [&["--mode", "exact"][..], &["--mode", "over", "--lod", "60"]] {
        let command = ["intersect", "a.stl", "b.stl", "--resolution", "60"];
        let result = folder.json(&[&command, fine].concat());
        assert!(!crate::warning_codes(&result).contains(&"coarse-voxels"));
    }
    assert_eq!(result["grid"]["lod"], 32);
}

#[test]
fn thread_count_changes_no_number() {
    let folder = Folder::new();
    folder.run(&["generate", "gyroid", "--cells", "1", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "sphere", "--radius", "5", "-o", "b.stl"]).code(0);
    let of = |threads| {
        let result = folder.json(&["xor", "a.stl", "b.stl", "--threads", threads, "--resolution", "100"]);
        (result["volume"].clone(), result["samples"].clone(), result["layers_max"].clone(), result["inputs"].clone())
    };
    assert_eq!(of("1"), of("3"));
}
