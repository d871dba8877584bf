//! Placements and units.

use crate::{Folder, assert_near, cube, cuboid, warning_codes};

fn with_box() -> Folder {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [1.0, 2.0, 3.0]));
    folder
}

#[test]
fn placement_steps_apply_from_left_to_right() {
    let folder = with_box();
    let centroid = |placement| {
        let result = folder.json(&["volume", "a.stl", "--resolution", "30", "--transform-a", placement]);
        let volume = result["volume"]["value"].as_f64().unwrap();
        (volume, [0, 1, 2].map(|i| result["centroid"][i].as_f64().unwrap()))
    };
    for (placement, volume, expected) in [
        ("translate(1,0,0) scale(2)", 48.0, [3.0, 2.0, 3.0]),
        ("scale(2) translate(1,0,0)", 48.0, [2.0, 2.0, 3.0]),
        ("rotate(0,0,1,90)", 6.0, [-1.0, 0.5, 1.5]),
        ("scale(1,1,-2)", 12.0, [0.5, 1.0, -3.0]),
    ] {
        let (found, place) = centroid(placement);
        assert_near(found, volume, 1e-6);
        for i in 0..3 {
            assert_near(place[i], expected[i], 1e-6);
        }
    }
}

#[test]
fn mirrored_meshes_face_outwards() {
    let folder = with_box();
    let result = folder.json(&["volume", "a.stl", "--resolution", "32", "--transform-a", "scale(-1,1,1)"]);
    assert_eq!(result["inputs"][0]["volume"], 6.0);
    assert!(!warning_codes(&result).contains(&"inside-out"));
}

#[test]
fn either_solid_can_be_placed() {
    let folder = with_box();
    let common = |placements: &[&str]| {
        folder.volume(&[&["intersect", "a.stl", "a.stl", "--resolution", "60"], placements].concat())
    };
    assert_near(common(&[]), 6.0, 1e-6);
    assert_near(common(&["--transform-b", "translate(0,0,1)"]), 4.0, 1e-6);
    assert_near(common(&["--transform-a", "translate(0,0,1)"]), 4.0, 1e-6);
    assert_near(common(&["--transform-a", "translate(0,0,1)", "--transform-b", "translate(0,0,1)"]), 6.0, 1e-6);
}

#[test]
fn beside_a_tool_of_a_million_times_its_size_half_of_a_solid_is_left() {
    let folder = Folder::new();
    folder.stl("block.stl", &cuboid([0.0; 3], [100.0, 60.0, 30.0]));
    folder.stl("tool.stl", &cube(-5.0, 10.0));
    let placement = "scale(1e6) translate(5000050,30,15)";
    for out in ["half.stl", "half.obj"] {
        let all = ["difference", "block.stl", "tool.stl", "--unit", "mm", "--transform-b", placement, "-o", out];
        assert_near(folder.volume(&all), 90_000.0, 0.1);
        assert_near(folder.json(&["check", out])["results"][0]["volume"].as_f64().unwrap(), 90_000.0, 0.1);
    }
    // The volume keeps the digits that the lattice around both has, and says how many these are.
    for (scale, shift, is_warned) in [("1e3", "5050", false), ("1e6", "5000050", false), ("1e11", "500000000050", true)]
    {
        let placement = format!("scale({scale}) translate({shift},30,15)");
        let all = ["difference", "block.stl", "tool.stl", "--unit", "mm", "--transform-b", &placement];
        let result = folder.json(&all);
        let number = |key: &str| result["volume"][key].as_f64().unwrap();
        let error = number("exact_error");
        assert!(
            (number("value") - 90_000.0).abs() <= error && error < 1e-3 * scale.parse::<f64>().unwrap(),
            "{result}"
        );
        assert!(number("at_least") <= 90_000.0 && 90_000.0 <= number("at_most"), "{result}");
        // The size of a tool that is scaled tells nothing about its unit.
        assert_eq!(warning_codes(&result), if is_warned { vec!["imprecise"] } else { vec![] }, "{result}");
        if is_warned {
            let run =
                folder.run(&all).code(0).warns(&["rounded by at most", "make the largest input, tool.stl, smaller"]);
            assert!(
                run.stdout().contains(" ± ") && run.stdout().contains("(exact within rounding)"),
                "{}",
                run.stdout()
            );
        }
    }
    // No volume is beyond what the box around the result holds.
    let all = ["difference", "block.stl", "tool.stl", "--bounds", "--transform-b", "scale(1e11) translate(-5e11,0,0)"];
    let volume = &folder.json(&[&all[..], &["--tolerance", "99%"]].concat())["volume"];
    let [at_least, at_most, lower, upper] =
        ["at_least", "at_most", "lower", "upper"].map(|k| volume[k].as_f64().unwrap());
    assert!(lower <= at_least && at_least < at_most && at_most <= upper && upper <= 180_000.001, "{volume}");
    let run = folder.run(&[&all[..], &["--tolerance", "1e-9"]].concat()).code(1);
    run.warns(&["--tolerance 1e-7 %: not reached by the exact volume"])
        .warns(&["make the largest input, tool.stl, smaller"]);
    // What has no volume has no mesh, either.
    let none =
        ["difference", "block.stl", "block.stl", "--transform-b", "scale(1.5) translate(-1,-1,-1)", "-o", "none.stl"];
    folder.run(&none).code(1).warns(&["the result is empty"]);
}

#[test]
fn a_corner_that_is_lost_to_rounding_costs_no_more_than_its_volume() {
    let folder = Folder::new();
    // A cube of 100 without a corner of 0.001.
    let corners = ["0 0 0", "100 0 0", "100 100 0", "0 100 0", "0 0 100", "100 0 100", "0 100 100"];
    let ends = ["99.999 100 100", "100 99.999 100", "100 100 99.999"];
    let faces = ["1 4 3 2", "1 2 6 5", "1 5 7 4", "5 6 9 8 7", "2 3 10 9 6", "4 7 8 10 3", "8 9 10"];
    let lines = |key: &str, lines: &[&str]| lines.iter().map(|line| format!("{key} {line}\n")).collect::<String>();
    let text = lines("v", &corners) + &lines("v", &ends) + &lines("f", &faces);
    std::fs::write(folder.path("block.obj"), text).unwrap();
    folder.stl("tool.stl", &cube(-5.0, 10.0));
    let placement = "scale(1e9) translate(5000000050,30,15)";
    let all = ["difference", "block.obj", "tool.stl", "--transform-b", placement];
    let json = folder.json(&all);
    assert_eq!((&json["volume"]["method"], json["inputs"][0]["closed"] == true), (&"exact".into(), true), "{json}");
    let [value, error] = ["value", "exact_error"].map(|key| json["volume"][key].as_f64().unwrap());
    assert!((value - 500_000.0).abs() <= error && error < 100.0, "{json}");
}

#[test]
fn meshes_that_rounding_changes_or_takes_are_told() {
    let folder = Folder::new();
    folder.stl("block.stl", &cuboid([0.0; 3], [100.0, 60.0, 30.0]));
    folder.stl("tool.stl", &cube(-5.0, 10.0));
    let halve = |x: &str, more: &[&str]| {
        let places = [
            "--transform-a",
            &format!("translate({x},0,0)"),
            "--transform-b",
            &format!("scale(15) translate({x},0,0)"),
        ];
        folder.run(&[&["intersect", "block.stl", "tool.stl"], &places[..], more].concat())
    };
    // At these distances, 32-bit numbers are 1 and 8 apart.
    let words = ["the mesh encloses ", "but the exact volume is ", "add --recentre", "64-bit numbers"];

    halve("12345678.5", &["-o", "half.stl"]).code(0).warns(&words);
    halve("1e8", &["-o", "none.stl"]).code(1).warns(&["no mesh was written", "so far from the origin", "--recentre"]);
    for more in [&["-o", "half.stl", "--recentre"][..], &["-o", "half.obj"]] {
        let run = halve("12345678.5", more).code(0);
        assert!(!run.stderr().contains("the mesh encloses"), "{}", run.stderr());
    }
    // The offset is that of the result, not of the tool.
    let recentred =
        ["difference", "block.stl", "tool.stl", "--transform-b", "scale(1e6) translate(5000050,30,15)", "--recentre"];
    folder.run(&[&recentred[..], &["-o", "near.stl"]].concat()).code(0);
    assert_near(folder.json(&["check", "near.stl"])["results"][0]["volume"].as_f64().unwrap(), 90_000.0, 0.1);
    // The numbers of an OBJ file are not to blame.
    let thin = ["intersect", "block.stl", "tool.stl", "--transform-b", "scale(1e10) translate(50000000000.0001,30,15)"];
    let run = folder.run(&[&thin[..], &["-o", "thin.obj"]].concat());
    assert!(!run.stderr().contains("64-bit"), "{}", run.stderr());
    // Triangles below the steps of the lattice in such numbers that their pairs fill the memory.
    let generate = ["generate", "geodesic", "--frequency", "64", "-o", "fine.stl"];
    folder.run(&generate).code(0);
    let placement = "scale(1e12) rotate(0,0,1,30) translate(4330127018950,2500000000000,15)";
    let cut = ["difference", "fine.stl", "tool.stl", "--transform-b", placement];
    folder
        .run(&cut)
        .code(0)
        .warns(&["fine.stl: corners of many of its triangles fall together", "so the volume is estimated"]);
}

#[test]
fn errors_mark_the_fault_in_a_placement() {
    let folder = with_box();
    let run = folder.run(&["volume", "a.stl", "--transform-a", "translate(1,0,0) rotate(0,0,z,30)"]);
    run.code(2).says(&["character 29", "`z` is not a finite number", "\n                                ^"]);
    folder.run(&["volume", "a.stl", "--transform-a", "scale(0)"]).code(2).says(&["scale of 0"]);
    folder.run(&["volume", "a.stl", "a.stl", "--transform-a", "scale(2)"]).code(2).says(&["--transform-a", "several"]);
}

#[test]
fn units_are_stated_or_assumed_with_a_warning() {
    let folder = with_box();
    for (given, named) in [("mm", "mm^3"), ("um", "um^3"), ("\u{b5}m", "um^3"), ("\u{3bc}m", "um^3"), ("in", "in^3")] {
        let result = folder.json(&["volume", "a.stl", "--resolution", "16", "--unit", given]);
        assert_eq!(result["volume"]["unit"], named);
        assert!(warning_codes(&result).is_empty());
    }
    let result = folder.json(&["volume", "a.stl", "--resolution", "16"]);
    assert!(result["volume"]["unit"].is_null());
    assert_eq!(warning_codes(&result), ["unit-assumed"]);
    folder.run(&["volume", "a.stl", "--resolution", "16"]).code(0).warns(&["a.stl", "no unit", "--unit"]);
    folder.run(&["volume", "a.stl", "--unit", "furlong"]).code(2).says(&["furlong", "mm, um"]);
}

#[test]
fn unit_names_ignore_case() {
    let folder = with_box();
    for (given, named) in
        [("MM", "mm^3"), ("Millimeters", "mm^3"), ("inches", "in^3"), ("IN", "in^3"), ("microns", "um^3")]
    {
        assert_eq!(folder.json(&["volume", "a.stl", "--resolution", "16", "--unit", given])["volume"]["unit"], named);
    }
}

#[test]
fn lengths_accept_units() {
    let folder = with_box();
    let json = |arguments: &[&str]| folder.json(&[arguments, &["--resolution", "16"]].concat());
    let pitch = |given| folder.json(&["volume", "a.stl", "--unit", "mm", "--pitch", given])["grid"]["pitch"].clone();
    assert_eq!((pitch("0.1mm"), pitch("100um"), pitch("0.01 CM")), (0.1.into(), 0.1.into(), 0.1.into()));
    let volume = |arguments: &[&str]| json(arguments)["volume"].clone();
    let offset = |given| volume(&["offset", "a.stl", "--unit", "mm", "--distance", given]);
    assert_eq!(offset("100um"), offset("0.1"));
    assert_eq!(offset("-0.01cm"), offset("-0.1"));
    let open = |given| volume(&["open", "a.stl", "--unit", "mm", "--radius", given]);
    assert_eq!(open("200um"), open("0.2"));
    let moved = |given| json(&["volume", "a.stl", "--unit", "cm", "--transform-a", given])["centroid"].clone();
    assert_eq!(moved("scale(2) translate(1mm,0,1in)"), moved("scale(2) translate(0.1,0,2.54)"));
    // A length in mm has no meaning in a file of unknown unit.
    for arguments in [
        &["volume", "a.stl", "--pitch", "0.1mm"][..],
        &["offset", "a.stl", "--distance", "0.1mm"],
        &["close", "a.stl", "--radius", "0.1mm"],
        &["render", "a.stl", "--slice", "z=1mm", "-o", "a.png"],
        &["volume", "a.stl", "--transform-a", "translate(1mm,0,0)"],
        &["convert", "a.stl", "-o", "b.stl", "--transform-a", "translate(1mm,0,0)"],
        &["sample", "a.stl", "--resolution", "16", "--simplify", "1mm", "-o", "b.stl"],
    ] {
        folder.run(arguments).code(2).says(&["mm", "the input states no unit", "--unit mm"]);
    }
    folder.run(&["volume", "a.stl", "--pitch", "-1mm"]).code(2).says(&["--pitch -1mm is not a positive length"]);
    folder.run(&["volume", "a.stl", "--pitch", "1 furlong"]).code(2).says(&["furlong", "mm, um"]);
}

#[test]
fn generate_converts_lengths_to_millimetres() {
    let folder = Folder::new();
    let size = |arguments: &[&str]| {
        let result = folder.json(&[&["generate"], arguments, &["-o", "a.stl"]].concat());
        result["bounds"]["max"].to_string()
    };
    assert_eq!(size(&["box", "--min", "0,0,0", "--max", "1cm,2mm,1in"]), "[10.0,2.0,25.4]");
    assert_eq!(size(&["sphere", "--radius", "500um"]), size(&["sphere", "--radius", "0.5"]));
    // 1.5 grid spacings of 0.2 are 0.30000000000000004 in binary.
    let gyroid = ["gyroid", "--cells", "1", "--cell-size", "5", "--resolution", "25"];
    size(&[&gyroid[..], &["--wall", "0.3mm"]].concat());
    let thin = [&["generate"], &gyroid[..], &["--wall", "0.29", "-o", "b.stl"]].concat();
    folder.run(&thin).code(2).says(&["wall is 0.29, but must be from 0.3 ("]);
    folder.run(&["generate", "gyroid", "--cells", "4mm", "-o", "b.stl"]).code(2).says(&["cells is `4mm`", "whole"]);
}

#[test]
fn implausible_sizes_suggest_another_unit() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [0.05, 0.02, 0.01]));
    let run = |unit| folder.run(&["volume", "a.stl", "--resolution", "16", "--unit", unit]).code(0);
    run("mm").warns(&["a.stl", "the model is 0.05 × 0.02 × 0.01 mm", "did you mean --unit m?"]);
    assert!(!run("m").stderr().contains("did you mean"));
    folder.stl("b.stl", &cube(0.0, 120.0));
    folder.run(&["volume", "b.stl", "--resolution", "16", "--unit", "m"]).code(0).warns(&["b.stl", "--unit mm?"]);
    folder.run(&["convert", "a.stl", "-o", "a.3mf", "--unit", "mm"]).code(0);
    folder.run(&["volume", "a.3mf", "--resolution", "16"]).code(0).warns(&["a.3mf", "may be wrong", "--unit m "]);
}

/// A tetrahedron of side 1, as glTF with its buffer inside; glTF is in metres.
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]},
{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
"buffers":[{"byteLength":60,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAIBAAEDAAMCAQID"}]}"#;

#[test]
fn files_are_converted_to_the_unit_of_the_first() {
    let folder = Folder::new();
    std::fs::write(folder.path("m.gltf"), GLTF).unwrap();
    folder.stl("mm.stl", &cube(0.0, 100.0));
    let result = folder.json(&["volume", "m.gltf", "--resolution", "256"]);
    assert_eq!(result["volume"]["unit"], "m^3");
    assert_near(result["volume"]["value"].as_f64().unwrap(), 1.0 / 6.0, 1e-3);
    // The cube of 100 mm lies in the corner of the tetrahedron.
    let arguments = ["intersect", "m.gltf", "mm.stl", "--unit", "mm", "--axis", "z", "--resolution", "500"];
    let result = folder.json(&arguments);
    assert_eq!(result["volume"]["unit"], "m^3");
    assert_near(result["volume"]["value"].as_f64().unwrap(), 1e-3, 1e-6);
    assert_eq!(warning_codes(&result), ["unit-converted"]);
    let arguments = ["intersect", "mm.stl", "m.gltf", "--unit", "mm", "--axis", "z", "--resolution", "500"];
    assert_near(folder.volume(&arguments), 1e6, 1e3);
    // Without a stated unit, the program assumes that of the other file.
    let result = folder.json(&["intersect", "mm.stl", "m.gltf", "--estimate", "--axis", "z", "--resolution", "16"]);
    assert_eq!(result["volume"]["unit"], "m^3");
    // At sixteen rays the pitch exceeds the smaller cube.
    assert_eq!(warning_codes(&result), ["unit-assumed", "thinner-than-pitch", "not-resolved"]);
    // The unit that a file states is kept.
    folder.run(&["volume", "m.gltf", "--unit", "mm", "--resolution", "16"]).code(0).warns(&[
        "m.gltf",
        "states m",
        "the model is 1 × 1 × 1 m, not 1 × 1 × 1 mm",
        "ldi-ops convert m.gltf -o FILE.stl",
    ]);
    let run = folder.run(&["convert", "m.gltf", "-o", "m.obj", "--unit", "mm"]).code(0);
    run.warns(&["m.gltf", "states m", "not 1 × 1 × 1 mm"]);
    let both = |unit| folder.json(&["intersect", "m.gltf", "m.gltf", "--unit", unit, "--resolution", "16"]);
    assert_eq!(warning_codes(&both("mm")), ["unit-ignored", "unit-ignored"]);
    assert!(warning_codes(&both("m")).is_empty());
}

#[test]
fn placements_that_round_64_bit_coordinates_warn_or_are_refused() {
    let folder = with_box();
    let run = |x: &str| {
        let placement = format!("translate({x},0,0)");
        folder.run(&["volume", "a.stl", "--resolution", "16", "--unit", "mm", "--transform-a", &placement])
    };
    assert_eq!(run("1e5").code(0).stderr(), "");
    run("1e9").code(0).warns(&["a.stl", "64-bit", "of its size"]);
    run("1e15").code(2).says(&["a.stl", "64-bit", "of its size", "nearer to the origin"]);
}
