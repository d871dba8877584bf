//! Tests of `minkowski`, `offset`, `open` and `close`: known volumes, changes that leave a sum the same, and refusals.

use serde_json::Value;

use crate::{Folder, Triangle, assert_near, cube, cuboid, inside_out, one_sided, warning_codes};

/// A box with a smaller box as a cavity.
pub fn hollow(outer: f64, inner: f64) -> Vec<Triangle> {
    let margin = 0.5 * (outer - inner);
    [cube(0.0, outer), inside_out(&cube(margin, inner))].concat()
}

/// An L of three squares, a quarter of one high, with its inner edge along z.
pub fn ell(scale: f64) -> Vec<Triangle> {
    let section = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
    let at = |i: usize, z: f64| [section[i % 6][0] * scale, section[i % 6][1] * scale, 0.25 * z * scale];
    let mut triangles = Vec::new();
    for i in 0..6 {
        triangles.push([at(i, 0.0), at(i + 1, 0.0), at(i, 1.0)]);
        triangles.push([at(i + 1, 0.0), at(i + 1, 1.0), at(i, 1.0)]);
    }
    // From the inner edge every side is visible, so a fan from it triangulates the L.
    for i in [4, 5, 0, 1] {
        triangles.push([at(3, 1.0), at(i, 1.0), at(i + 1, 1.0)]);
        triangles.push([at(3, 0.0), at(i + 1, 0.0), at(i, 0.0)]);
    }
    triangles
}

/// Returns the JSON of `minkowski` for two files in mm.
fn sum(folder: &Folder, flags: &[&str]) -> Value {
    folder.json(&[&["minkowski", "--unit", "mm"], flags].concat())
}

fn volume(result: &Value) -> f64 {
    result["volume"]["value"].as_f64().unwrap()
}

fn numbers(value: &Value) -> Vec<u64> {
    value.as_array().unwrap().iter().map(|number| number.as_u64().unwrap()).collect()
}

#[test]
fn sums_of_boxes_are_boxes_in_every_mode() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [2.0, 1.0, 3.0]));
    folder.stl("b.stl", &cuboid([-0.5, 0.0, 4.0], [0.5, 1.0, 5.0]));
    for mode in ["over", "under", "exact"] {
        for axis in ["x", "y", "z", "all"] {
            let result = sum(&folder, &["a.stl", "b.stl", "--mode", mode, "--axis", axis, "--resolution", "64"]);
            assert_near(volume(&result), 3.0 * 2.0 * 4.0, 1e-6);
            assert_eq!(result["grid"]["rays"], serde_json::json!([48, 32, 64]));
        }
    }
}

#[test]
fn rays_of_sums_double_until_the_tolerance_is_reached_or_the_memory_ends() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let grown = 8.0 + 12.0 + std::f64::consts::PI * (1.5 + 1.0 / 6.0);
    let offset = ["offset", "a.stl", "--distance", "0.5", "--unit", "mm"];
    let with = |flags: &[&str]| folder.run(&[&offset[..], flags].concat());
    let result = with(&["--tolerance", "0.2%", "--json", "-"]).code(0).json();
    let told = |result: &Value, key: &str| result["tolerance"][key].clone();
    assert_eq!((told(&result, "asked"), told(&result, "reached")), (2e-3.into(), true.into()));
    assert_near(volume(&result), grown, 2e-3 * grown);
    assert_eq!(told(&result, "resolution"), result["grid"]["rays"][0]);
    // One round with as many rays gives the same.
    let rays = told(&result, "resolution").to_string();
    assert_eq!(with(&["--resolution", &rays, "--json", "-"]).code(0).json()["volume"], result["volume"]);

    let run = with(&["--tolerance", "0.0000001%", "--memory", "40M", "--json", "-"]).code(1);
    let result = run.json();
    assert_eq!(told(&result, "reached"), false);
    assert!(warning_codes(&result).contains(&"tolerance-not-reached"), "{result:#}");
    assert_near(volume(&result), grown, 1e-2 * grown);
    let stderr = run.stderr();
    for words in ["--tolerance 1e-7 %: not reached with ", "; with twice as many: ", "--memory allows 40 MB"] {
        assert!(stderr.contains(words), "no `{words}` in {stderr}");
    }
    with(&["--tolerance", "1%", "--resolution", "64"]).code(2).says(&["--tolerance", "--resolution"]);
}

#[test]
fn the_method_of_a_sum_can_be_named_and_no_other_can_be_had() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let offset = ["offset", "a.stl", "--distance", "0.5", "--resolution", "16", "--unit", "mm"];
    let with = |flags: &[&str]| folder.run(&[&offset[..], flags].concat());
    with(&["--exact"]).code(2).says(&["--exact", "images alone"]);
    folder.run(&["open", "a.stl", "--radius", "0.1", "--exact"]).code(2).says(&["--exact", "images alone"]);
    folder.run(&["minkowski", "a.stl", "a.stl", "--exact"]).code(2).says(&["--exact", "images alone"]);
    with(&["--mesh", "exact", "-o", "b.stl"]).code(2).says(&["--mesh exact", "images alone"]);
    assert!(!folder.path("b.stl").exists());
    with(&["--estimate", "--mesh", "sampled", "-o", "b.stl"]).code(0);
    assert!(folder.path("b.stl").exists());
    let text = with(&["--estimate"]).code(0).stdout();
    let plain = with(&[]).code(0).stdout();
    let first = |text: &str| text.lines().next().map(str::to_owned);
    assert_eq!(first(&text), first(&plain));
}

#[test]
fn the_volume_of_a_sum_lies_within_its_certified_bounds() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cube(0.5, 1.0));
    let offset = |distance: &str| {
        let json = folder.json(&["offset", "a.stl", "--distance", distance, "--resolution", "32", "--bounds"]);
        ["value", "lower", "upper", "at_least", "at_most", "estimate_error"].map(|name| json["volume"][name].as_f64())
    };
    // Nothing is left, and the bounds prove it.
    assert_eq!(offset("-0.6"), [Some(0.0); 6]);
    // Of two plates at the ends of their box, the certified bounds alone prove it.
    let plates = [[0.0, 0.5], [9.5, 10.0]].map(|[low, high]| cuboid([0.0, 0.0, low], [10.0, 10.0, high]));
    folder.stl("plates.stl", &plates.concat());
    let empty = ["offset", "plates.stl", "--distance", "-0.6", "--resolution", "32"];
    folder.run(&[&empty[..], &["--bounds"]].concat()).code(0).warns(&["no volume, as bounds of its volume prove"]);
    folder.run(&empty).code(0).warns(&["empty at a pitch", "hardly fits into the solid, if at all", "--resolution"]);
    // A volume that is proved to be zero reaches every tolerance.
    for mode in ["exact", "over"] {
        let to_a_tolerance =
            ["offset", "plates.stl", "--distance", "-0.6", "--tolerance", "1%", "--bounds", "--mode", mode];
        let json = folder.json(&to_a_tolerance);
        assert_eq!(
            (&json["tolerance"]["reached"], &json["tolerance"]["came_to"]),
            (&true.into(), &0.0.into()),
            "{mode}"
        );
    }
    folder.stl("between.stl", &cuboid([4.0; 3], [6.0; 3]));
    let common = ["intersect", "plates.stl", "between.stl", "--tolerance", "1%", "--bounds", "--unit", "mm"];
    folder.run(&[&common[..], &["-o", "common.npz"]].concat()).code(0);
    folder.run(&["difference", "a.stl", "a.stl", "--tolerance", "1%", "--unit", "mm"]).code(0);
    let [value, lower, upper, least, most, error] = offset("0.25").map(Option::unwrap);
    assert!((lower..=upper).contains(&value) && [least, most] == [lower, upper], "{lower} {value} {upper}");
    assert!(error <= (1.0 + 1e-9) * (upper - value).max(value - lower), "{value} ± {error} in {lower} to {upper}");
    let json = folder.json(&["minkowski", "a.stl", "b.stl", "--resolution", "32", "--bounds"]);
    assert_eq!(json["volume"]["at_least"], json["volume"]["lower"]);
}

/// On few rays the estimates of these are below the volumes of their inputs, and the error estimates far above.
#[test]
fn a_sum_is_no_smaller_than_the_inputs_allow() {
    let folder = Folder::new();
    folder.run(&["generate", "cylinder", "--radius", "1", "--height", "9", "-o", "rod.stl"]).code(0);
    folder.stl("a.stl", &cube(0.0, 0.5));
    let rod = std::f64::consts::PI * 9.0;
    let root = |volume: f64| volume.cbrt();
    let ball = root(4.0 / 3.0 * std::f64::consts::PI);
    let jobs = [
        (&["offset", "rod.stl", "--distance", "0.01"][..], (root(rod) + 0.01 * ball).powi(3)),
        (&["close", "rod.stl", "--radius", "0.3"], rod),
        (&["minkowski", "rod.stl", "a.stl"], (root(rod) + 0.5).powi(3)),
        (&["offset", "rod.stl", "--distance=-0.01"], 0.0),
        (&["open", "rod.stl", "--radius", "0.3"], 0.0),
        (&["minkowski", "rod.stl", "a.stl", "--difference"], 0.0),
    ];
    for (job, least) in jobs {
        let volume = &folder.json(&[job, &["--resolution", "24", "--unit", "mm"]].concat())["volume"];
        let [found, value] = ["at_least", "value"].map(|key| volume[key].as_f64().unwrap());
        // The generated cylinder is a prism.
        assert_near(found, least, 1e-2 * rod);
        assert!(value >= found, "{job:?}: {volume}");
    }
}

#[test]
fn json_of_a_sum_has_the_schema_its_steps_and_memory() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("b.stl", &cube(1.0, 1.0));
    let result = sum(&folder, &["a.stl", "b.stl", "--resolution", "30"]);
    for (key, value) in [("schema", "ldi-ops/1"), ("command", "minkowski"), ("backend", "cpu"), ("fill", "even-odd")] {
        assert_eq!(result[key], value, "{key}");
    }
    let keys: Vec<&String> = result.as_object().unwrap().keys().collect();
    for key in ["device", "mode", "seconds", "peak_memory_bytes", "warnings", "samples", "unclosed_rays", "layers_max"]
    {
        assert!(keys.iter().any(|known| *known == key), "no {key} in {keys:?}");
    }
    assert_eq!(result["inputs"].as_array().unwrap().len(), 2);
    assert_eq!((&result["layers_max"], &result["volume"]["unit"]), (&serde_json::json!([2, 2, 2]), &"mm^3".into()));
    assert_eq!(result["warnings"], serde_json::json!([]));
    let step = &result["steps"][0];
    assert_eq!((&step["operation"], &step["distance"]), (&"sum".into(), &Value::Null));
    // Each operand has 12 facets, 8 vertices and 18 edges.
    assert_eq!(step["pairs"]["candidates"], 2 * 12 * 8 + 18 * 18);
    let [visited, kept] = ["visited", "kept"].map(|key| step["pairs"][key].as_u64().unwrap());
    let primitives = step["primitives"].as_u64().unwrap();
    assert!(visited >= kept && kept > 0 && primitives >= 12, "{step:#}");
    // Each of the six faces is hit by 900 rays along its axis, and by none across it.
    assert!(numbers(&step["crossings"]).iter().all(|&crossings| crossings >= 1800), "{step:#}");
    assert_eq!(step["components"], serde_json::json!({ "tested": 0, "cavities": 0, "filled": 0 }));
    let memory = &result["memory"];
    assert!(memory["estimate_bytes"].as_u64().unwrap() > 1 << 20 && memory["limit_bytes"].is_u64(), "{memory}");
    let run = folder.run(&["minkowski", "a.stl", "b.stl", "--resolution", "30", "-v"]).code(0);
    assert!(run.stdout().starts_with("minkowski   27"), "{}", run.stdout());
    for words in ["step        sum: ", "components", "; estimate "] {
        assert!(run.stderr().contains(words), "no `{words}` in:\n{}", run.stderr());
    }
}

#[test]
fn translated_operands_give_the_same_sum() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cube(10.0, 1.0));
    let result = sum(&folder, &["a.stl", "b.stl", "--resolution", "64"]);
    assert_near(volume(&result), 8.0, 1e-6);
    for (a, b) in [("translate(0,0,0)", "translate(-10,-10,-10)"), ("translate(3,-5,0.25)", "translate(64,0,-1)")] {
        let flags = ["a.stl", "b.stl", "--resolution", "64", "--transform-a", a, "--transform-b", b];
        let moved = sum(&folder, &flags);
        for key in ["volume", "samples", "layers_max", "steps"] {
            assert_eq!(moved[key], result[key], "{key} with {a} and {b}");
        }
    }
}

#[test]
fn sums_of_two_ells_commute() {
    let folder = Folder::new();
    folder.stl("l.stl", &ell(1.0));
    folder.stl("l10.stl", &ell(10.0));
    let flags = ["--resolution", "176", "--mode", "exact"];
    for files in [["l.stl", "l10.stl"], ["l10.stl", "l.stl"]] {
        let result = sum(&folder, &[&files[..], &flags].concat());
        // The sections are stairs: widths 11, 1, 9 and 1 with heights 22, 21, 12 and 11.
        assert_near(volume(&result), 2.75 * (242.0 + 21.0 + 108.0 + 11.0), 1e-6);
    }
}

#[test]
fn a_hollow_cube_keeps_its_cavity_or_is_filled() {
    let folder = Folder::new();
    folder.stl("hollow.stl", &hollow(4.0, 2.0));
    folder.stl("small.stl", &cube(7.0, 1.0));
    folder.stl("large.stl", &cube(-3.0, 2.5));
    for resolution in ["50", "64", "101"] {
        let result = sum(&folder, &["hollow.stl", "small.stl", "--resolution", resolution]);
        let half_layer = 5.0f64.powi(3) / resolution.parse::<f64>().unwrap();
        assert_near(volume(&result), 125.0 - 1.0, 0.02 * half_layer);
        assert_eq!(result["steps"][0]["components"], serde_json::json!({ "tested": 1, "cavities": 1, "filled": 0 }));
        let filled = sum(&folder, &["hollow.stl", "large.stl", "--resolution", resolution]);
        assert_near(volume(&filled), 6.5f64.powi(3), 1e-5);
        assert_eq!(filled["steps"][0]["components"]["cavities"], 0);
    }
}

#[test]
fn differences_are_the_places_where_the_second_fits() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 4.0));
    folder.stl("b.stl", &cuboid([0.0; 3], [1.0, 2.0, 3.0]));
    let difference = ["a.stl", "b.stl", "--difference", "--mode", "exact", "--resolution", "64"];
    let result = sum(&folder, &difference);
    assert_near(volume(&result), 3.0 * 2.0 * 1.0, 1e-6);
    // The resolution counts pixels along A.
    assert_eq!(result["grid"]["pitch"], 0.0625);
    assert_eq!(result["steps"][0]["operation"], "difference");
    // The reflected B has the same room at another place: from (1, 2, 3) to (4, 4, 4) against from 0 to (3, 2, 1).
    for (flags, least) in [(&[][..], [0.0; 3]), (&["--reflect"], [1.0, 2.0, 3.0])] {
        sum(&folder, &[&difference[..], flags, &["-o", "out.ply"]].concat());
        let checked = folder.json(&["check", "out.ply"]);
        let bounds = &checked["results"][0]["bounds"];
        for i in 0..3 {
            assert_near(bounds["min"][i].as_f64().unwrap(), least[i], 1e-6);
            assert_near(bounds["max"][i].as_f64().unwrap(), least[i] + [3.0, 2.0, 1.0][i], 1e-6);
        }
    }
    // If B does not fit into A, the result is empty.
    let flags = ["b.stl", "a.stl", "--difference", "--resolution", "32", "-o", "none.stl"];
    let run = folder.run(&[&["minkowski"], &flags[..], &["--unit", "mm", "--json", "-"]].concat()).code(1);
    let result = run.json();
    assert_eq!(result["volume"]["value"], 0.0);
    assert_eq!(warning_codes(&result), ["empty", "empty-surface"]);
    assert!(!folder.path("none.stl").exists());
    run.warns(&["has no volume, as bounds of its volume prove: B cannot move within A"]);
}

#[test]
fn empty_results_have_the_bounds_of_the_inputs() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 20.0));
    let run = |flags: &[&str]| folder.run(&[flags, &["--unit", "mm", "--json", "-"]].concat());
    // The inputs prove it, so that the first raster decides.
    let corners = [&cuboid([0.0; 3], [1.0; 3])[..], &cuboid([9.0; 3], [10.0; 3])].concat();
    folder.stl("corners.stl", &corners);
    let none: [&[&str]; 5] = [
        // Balls that fit into the box, but are larger than the solid.
        &["offset", "corners.stl", "--distance", "-0.8"],
        &["open", "corners.stl", "--radius", "0.8"],
        &["offset", "a.stl", "--distance", "-10"],
        &["open", "a.stl", "--radius", "10.001"],
        &["minkowski", "a.stl", "a.stl", "--difference", "--transform-b", "scale(1.5)"],
    ];
    for flags in none {
        let proved = run(&[flags, &["--tolerance", "1%"]].concat()).code(0);
        let result = proved.warns(&["has no volume, as bounds of its volume prove"]).json();
        assert_eq!((volume(&result), &result["volume"]["at_most"]), (0.0, &0.0.into()), "{result:#}");
        assert_eq!((&result["tolerance"]["resolution"], &result["tolerance"]["came_to"]), (&128.into(), &0.0.into()));
    }
    // A ball that fits exactly leaves itself, so that nothing is proved.
    let result = run(&["open", "a.stl", "--radius", "10", "--resolution", "32"]).code(0).json();
    assert!(result["volume"]["at_most"].as_f64().unwrap() > 4189.0, "{result:#}");
    // A cube of 0.02 is left, and found between the rays.
    let offset = ["offset", "a.stl", "--distance", "-9.99", "--resolution", "64"];
    let mut found = run(&offset).code(0);
    for words in ["no ray at a pitch of 0.3125 mm meets the result", "solid of about"] {
        found = found.warns(&[words]);
    }
    let at_most = |result: &Value| result["volume"]["at_most"].as_f64().unwrap();
    assert_near(at_most(&found.json()), 0.02f64.powi(3), 1e-9);
    // The bounds of the offset alone are wider.
    let result = run(&[&offset[..], &["--assert-below", "1e-5"]].concat()).code(0).json();
    assert_near(at_most(&result), 0.02f64.powi(3), 1e-9);
    // Rays are doubled while a detail may lie between them.
    let result = run(&["offset", "a.stl", "--distance", "-9.9", "--tolerance", "20%"]).code(0).json();
    assert_near(volume(&result), 0.2f64.powi(3), 0.2 * 0.2f64.powi(3));
    // A ball may grow from what no ray meets between two steps; the large cube hides it.
    folder.stl("two.stl", &[&cube(0.0, 20.0)[..], &cuboid([30.0, 0.0, 0.0], [70.0, 40.0, 40.0])].concat());
    let result =
        run(&["open", "two.stl", "--radius", "9.95", "--resolution", "128"]).code(0).warns(&["between the two steps"]);
    let missed = 4.0 / 3.0 * std::f64::consts::PI * 9.95f64.powi(3);
    assert!(result.json()["volume"]["estimate_error"].as_f64().unwrap() > missed);
    // An opening is no larger than the solid.
    let result = folder.json(&["open", "corners.stl", "--radius", "0.6", "--resolution", "32"]);
    assert_near(result["volume"]["at_most"].as_f64().unwrap(), 2.0, 1e-9);
}

#[test]
fn pitches_with_too_many_rays_are_refused_with_the_least_one() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [10.0, 10.0, 40.0]));
    let jobs: [(&[&str], &str, &str); 5] = [
        (&["volume", "a.stl", "--estimate"], "4000000 rays", "0.0006103609"),
        (&["offset", "a.stl", "--distance", "-1"], "4000000 rays", "0.0006103609"),
        (&["minkowski", "a.stl", "a.stl"], "8000000 rays", "0.001220722"),
        (&["minkowski", "a.stl", "a.stl", "--difference"], "8000000 rays", "0.001220722"),
        (&["close", "a.stl", "--radius", "5"], "5000000 rays", "0.0007629"),
    ];
    for (job, rays, least) in jobs {
        let words = [rays, &format!("the least --pitch is {least}")];
        folder.run(&[job, &["--unit", "mm", "--pitch", "1e-5"]].concat()).code(2).says(&words);
    }
}

#[test]
fn solids_that_vanish_by_rounding_are_refused() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    let scaled = |scale| ["minkowski", "a.stl", "a.stl", "--unit", "mm", "--resolution", "32", "--transform-b", scale];
    for flags in [&[][..], &["--difference"]] {
        folder.run(&[&scaled("scale(1e-10)")[..], flags].concat()).code(2).says(&["a solid 1e-10 long", "a.stl"]);
        folder.run(&[&scaled("scale(1,1e-10,1e-10)")[..], flags].concat()).code(2).says(&["a solid 1 long"]);
    }
    folder.run(&["offset", "a.stl", "--unit", "mm", "--distance", "1e10"]).code(2).says(&["a solid 1 long"]);
    assert_near(volume(&folder.json(&scaled("scale(1e-8)"))), 1.0 + 3e-8, 1e-9);
}

/// A cube whose triangles are each divided by a point beside the side and a sliver beyond, as programs fill T-junctions.
fn with_slivers(triangles: &[Triangle]) -> Vec<Triangle> {
    let split = |(i, &[a, b, c]): (usize, &Triangle)| {
        let share = 0.2 + 0.05 * i as f64;
        let middle = [0, 1, 2].map(|k| a[k] + share * (b[k] - a[k]));
        [[a, middle, c], [middle, b, c], [a, b, middle]]
    };
    triangles.iter().enumerate().flat_map(split).collect()
}

/// Rounding turns some of the slivers over, so that both of their edges at an edge of the cube are reflex.
#[test]
fn slivers_open_no_boundary() {
    let folder = Folder::new();
    folder.stl("a.stl", &with_slivers(&cube(0.0, 1.0)));
    for degrees in 1..8 {
        let turn = format!("rotate(1,2,3,{})", 11 * degrees);
        let operands = ["a.stl", "a.stl", "--mode", "exact", "--transform-a", &turn, "--transform-b", &turn];
        let result = sum(&folder, &[&operands[..], &["--resolution", "48"]].concat());
        assert_near(volume(&result), 8.0, 0.04);
    }
}

/// A cube with a pyramid on each face, whose tip lies far beyond an edge of the face: the sides fold over one another.
#[test]
fn folds_are_part_of_the_sum() {
    let folder = Folder::new();
    let mut folded = Vec::new();
    for (i, &[a, b, c]) in cube(0.0, 1.0).iter().enumerate() {
        let tip = [0, 1, 2].map(|k| a[k] + (1.0 + 0.01 * i as f64) * (b[k] - a[k]) - 0.03 * (c[k] - a[k]) + 0.001);
        folded.extend([[a, b, tip], [b, c, tip], [c, a, tip]]);
    }
    folder.stl("a.stl", &folded);
    folder.stl("b.stl", &cube(0.0, 1.0));
    for turn in ["rotate(1,2,3,20)", "rotate(3,2,1,50)"] {
        let flags = ["a.stl", "b.stl", "--fill", "nonzero", "--transform-a", turn, "--transform-b", turn];
        let result = sum(&folder, &[&flags[..], &["--resolution", "48"]].concat());
        assert_near(volume(&result), 8.89, 0.02);
    }
}

#[test]
fn reflect_mirrors_the_second_operand_at_the_origin() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cuboid([2.0, 4.0, 8.0], [3.0, 5.0, 9.0]));
    for (flags, least) in [(&[][..], [2.0, 4.0, 8.0]), (&["--reflect"], [-3.0, -5.0, -9.0])] {
        let all = [&["a.stl", "b.stl", "--mode", "exact", "--resolution", "16", "-o", "out.stl"], flags].concat();
        assert_near(volume(&sum(&folder, &all)), 8.0, 1e-6);
        let checked = folder.json(&["check", "out.stl"]);
        for i in 0..3 {
            assert_near(checked["results"][0]["bounds"]["min"][i].as_f64().unwrap(), least[i], 1e-6);
        }
    }
}

#[test]
fn sums_are_written_as_meshes_and_images() {
    let folder = Folder::new();
    folder.stl("a.stl", &hollow(4.0, 2.0));
    folder.run(&["generate", "geodesic", "--radius", "0.5", "--frequency", "3", "-o", "b.stl"]).code(0);
    let of = |name| sum(&folder, &["a.stl", "b.stl", "--mode", "exact", "--resolution", "40", "-o", name]);
    let volume = volume(&of("sum.npz"));
    for name in ["sum.stl", "sum.3mf", "sum.glb", "sum.npz"] {
        let result = of(name);
        assert_eq!(result["output"], name);
        if name == "sum.npz" {
            let again = folder.json(&["surface", name, "-o", "again.ply"]);
            assert_near(again["surface"]["volume"].as_f64().unwrap(), volume, 0.02 * volume);
            continue;
        }
        assert_eq!((&result["surface"]["components"], &result["surface"]["crossing_pairs"]), (&2.into(), &0.into()));
        let checked = &folder.json(&["check", name])["results"][0];
        assert_eq!((&checked["solid"], &checked["shells"]), (&true.into(), &2.into()));
        assert_near(result["surface"]["volume"].as_f64().unwrap(), volume, 0.02 * volume);
    }
    let simplified = sum(
        &folder,
        &["a.stl", "b.stl", "--mode", "exact", "--resolution", "40", "--simplify", "0.1h", "-o", "small.ply"],
    );
    assert!(simplified["surface"]["simplified"]["triangles_before"].is_u64());
    // A command that reads meshes reads images, too.
    let of_images = sum(&folder, &["sum.npz", "b.stl", "--resolution", "40"]);
    assert!(self::volume(&of_images) > volume, "{of_images:#}");
}

#[test]
fn thread_count_changes_no_byte_of_a_sum() {
    let folder = Folder::new();
    folder.run(&["generate", "gyroid", "--cells", "1", "--resolution", "16", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "torus", "--major", "2", "--minor", "0.5", "-o", "b.stl"]).code(0);
    let of = |threads, name| {
        let result = sum(&folder, &["a.stl", "b.stl", "--threads", threads, "--resolution", "48", "-o", name]);
        (result["volume"].clone(), result["steps"].clone(), std::fs::read(folder.path(name)).unwrap())
    };
    assert!(of("1", "one.npz") == of("3", "three.npz"));
}

#[test]
fn jobs_above_the_memory_limit_are_refused_with_a_resolution_that_fits() {
    let folder = Folder::new();
    folder.run(&["generate", "gyroid", "--cells", "1", "--resolution", "16", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "geodesic", "--radius", "0.5", "--frequency", "3", "-o", "b.stl"]).code(0);
    let job = ["minkowski", "a.stl", "b.stl", "--memory", "60M"];
    let run = folder.run(&[&job[..], &["--resolution", "2000"]].concat()).code(3);
    let run = run.says(&["MB of memory", "--memory allows 60 MB", "would fit"]);
    let stderr = run.stderr();
    let rays = stderr.split("--resolution ").nth(1).unwrap().split(',').next().unwrap();
    assert!((50..2000).contains(&rays.parse::<u32>().unwrap()), "{stderr}");
    let result = folder.json(&[&job[..], &["--resolution", rays]].concat());
    assert_eq!(result["memory"]["limit_bytes"], 60_000_000);
    assert!(result["memory"]["estimate_bytes"].as_u64().unwrap() <= 60_000_000);
    // A run needs more than this, whatever the raster.
    folder.run(&["minkowski", "a.stl", "b.stl", "--memory", "1M"]).code(3).says(&["no raster would fit"]);
    folder.run(&["minkowski", "a.stl", "b.stl", "--memory", "much"]).code(2).says(&["800M, 2G or 1.5GiB"]);
}

/// Compares the estimated memory with the measured peak.
#[cfg(target_os = "linux")]
#[test]
fn the_memory_estimate_is_within_a_factor_of_two_of_the_peak() {
    let folder = Folder::new();
    folder.run(&["generate", "gyroid", "--cells", "2", "--resolution", "16", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "geodesic", "--radius", "0.5", "--frequency", "3", "-o", "b.stl"]).code(0);
    for flags in [&["--mode", "exact"][..], &["--mode", "exact", "-o", "out.npz"]] {
        let job = [&["a.stl", "b.stl", "--resolution", "512"], flags].concat();
        let result = sum(&folder, &job);
        let [expected, peak] =
            [&result["memory"]["estimate_bytes"], &result["peak_memory_bytes"]].map(|v| v.as_f64().unwrap());
        assert!(peak < 2.0 * expected && expected < 2.0 * peak, "{flags:?}: {expected} expected, {peak} at most");
    }
}

#[test]
fn overlapping_shells_unite_under_nonzero() {
    let folder = Folder::new();
    let overlapping = [cuboid([0.0; 3], [2.0, 1.0, 1.0]), cuboid([1.0, 0.0, 0.0], [3.0, 1.0, 1.0])].concat();
    folder.stl("a.stl", &overlapping);
    folder.stl("b.stl", &cube(0.0, 1.0));
    let job = ["a.stl", "b.stl", "--resolution", "64"];
    let run = folder.run(&[&["minkowski"], &job[..]].concat()).code(2);
    run.says(&["a.stl", "shells overlap in 33", "--fill nonzero unites them"]);
    let united = [&job[..], &["--fill", "nonzero"]].concat();
    assert_near(volume(&sum(&folder, &united)), 4.0 * 2.0 * 2.0, 1e-6);
    let shrunk = [&["minkowski"], &united[..], &["--difference"]].concat();
    folder.run(&shrunk).code(2).says(&["a.stl", "shells overlap", "`ldi-ops sample a.stl --fill nonzero"]);
}

#[test]
fn solids_that_are_inside_out_or_not_oriented_are_turned_and_one_sided_ones_refused() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("turned.stl", &inside_out(&cube(0.0, 1.0)));
    for files in [["a.stl", "turned.stl"], ["turned.stl", "a.stl"]] {
        let result = sum(&folder, &[&files[..], &["--resolution", "32"]].concat());
        assert_near(volume(&result), 27.0, 1e-6);
        assert_eq!(warning_codes(&result), ["inside-out"]);
    }
    folder.stl("mixed.stl", &[cube(0.0, 1.0), inside_out(&cube(2.0, 1.0))].concat());
    let run = folder.run(&["minkowski", "mixed.stl", "a.stl"]).code(2);
    run.says(&["mixed.stl", "some shells face outwards and others inwards"]);
    let mut open = cube(0.0, 1.0);
    open.pop();
    folder.stl("open.stl", &open);
    let run = folder.run(&["minkowski", "a.stl", "open.stl"]).code(2).says(&["open.stl", "not closed"]);
    assert!(!run.stderr().contains("--allow-open"), "{}", run.stderr());
    // A hollow cube of which some triangles are turned.
    let mut torn = [cube(0.0, 5.0), cube(1.0, 3.0)].concat();
    for triangle in [0, 1, 12, 20] {
        torn[triangle].swap(1, 2);
    }
    folder.stl("torn.stl", &torn);
    let result = sum(&folder, &["torn.stl", "a.stl", "--resolution", "64"]);
    assert_near(volume(&result), 7.0 * 7.0 * 7.0 - 1.0, 0.1);
    assert_eq!(warning_codes(&result), ["not-oriented"]);
    folder.stl("hollow.stl", &[cube(0.0, 5.0), inside_out(&cube(1.0, 3.0))].concat());
    assert_eq!(volume(&result), volume(&sum(&folder, &["hollow.stl", "a.stl", "--resolution", "64"])));
    // Overlapping shells: the way out that the error names is one.
    let mut overlapping = [cube(0.0, 2.0), cube(1.0, 2.0)].concat();
    overlapping[5].swap(1, 2);
    folder.stl("overlapping.stl", &overlapping);
    let measured = folder.run(&["volume", "overlapping.stl"]).code(0);
    assert!(!measured.stderr().contains("--fill nonzero"), "{}", measured.stderr());
    let one = ["csg", "a", "a=overlapping.stl", "-o", "one.stl"];
    for job in [&["minkowski", "overlapping.stl", "a.stl"][..], &["offset", "overlapping.stl", "--distance", "-0.2"]] {
        let run = folder.run(job).code(2);
        run.says(&["overlapping.stl: ", "shells", "ldi-ops csg a a=overlapping.stl -o one.stl"]);
    }
    folder.run(&one).code(0);
    let eroded = folder.json(&["offset", "one.stl", "--distance", "-0.2", "--resolution", "64"]);
    assert!(eroded["volume"]["value"].as_f64().unwrap() > 0.0);
    folder.stl("one-sided.stl", &one_sided());
    let run = folder.run(&["minkowski", "a.stl", "one-sided.stl"]).code(2);
    run.says(&["one-sided.stl", "not consistently oriented"]);
}

#[test]
fn offsets_grow_and_shrink_by_steiners_formula() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 4.0));
    let of = |distance: &str, flags: &[&str]| {
        folder.json(
            &[
                &["offset", "a.stl", "--distance", distance, "--resolution", "100", "--mode", "exact", "--unit", "mm"],
                flags,
            ]
            .concat(),
        )
    };
    // Steiner: V + S r + M r² + 4 π r³ / 3, with M = ½ Σ edge length × exterior angle.
    let pi = std::f64::consts::PI;
    let grown = of("1", &["-o", "grown.stl"]);
    assert_near(volume(&grown), 64.0 + 96.0 + 12.0 * 4.0 * pi / 4.0 + 4.0 * pi / 3.0, 0.1);
    assert_eq!(grown["grid"]["pitch"], 0.06);
    assert_eq!((&grown["steps"][0]["operation"], &grown["steps"][0]["distance"]), (&"offset".into(), &1.0.into()));
    assert_eq!(folder.json(&["check", "grown.stl"])["results"][0]["solid"], true);
    let shrunk = of("-1", &[]);
    assert_near(volume(&shrunk), 8.0, 1e-3);
    assert_eq!(shrunk["grid"]["pitch"], 0.04);
    let nothing = of("-2.5", &[]);
    assert_eq!(nothing["volume"]["value"], 0.0);
    assert_eq!(warning_codes(&nothing), ["empty"]);
    for wrong in ["0", "nan", "inf"] {
        folder.run(&["offset", "a.stl", "--distance", wrong]).code(2).says(&["--distance", "not a finite length"]);
    }
}

#[test]
fn opening_removes_thin_parts_and_closing_fills_thin_gaps() {
    let folder = Folder::new();
    // A cube with a fin, and one with a slot.
    let fin = cuboid([3.0, 1.0, 1.0], [6.0, 1.5, 3.0]);
    folder.stl("cube.stl", &cube(0.0, 4.0));
    folder.stl("fin.stl", &fin);
    let flags = ["--mode", "exact", "--resolution", "96", "--unit", "mm"];
    folder.run(&[&["union", "cube.stl", "fin.stl", "-o", "finned.stl"], &flags[..]].concat()).code(0);
    folder.run(&[&["difference", "cube.stl", "fin.stl", "-o", "slotted.stl"], &flags[..]].concat()).code(0);
    let of = |command, file| folder.json(&[&[command, file, "--radius", "0.5"], &flags[..]].concat());
    let pi = std::f64::consts::PI;
    // The result is a rounded cube, as if grown from a cube of side 3.
    let rounded = 27.0 + 54.0 * 0.5 + 12.0 * 3.0 * pi / 16.0 + 4.0 * pi / 3.0 / 8.0;
    let opened = of("open", "finned.stl");
    assert_near(volume(&opened), rounded, 0.02 * rounded);
    let operations = |result: &Value| {
        let steps = result["steps"].as_array().unwrap().iter();
        steps.map(|step| step["distance"].as_f64().unwrap()).collect::<Vec<f64>>()
    };
    assert_eq!(operations(&opened), [-0.5, 0.5]);
    let closed = of("close", "slotted.stl");
    assert_near(volume(&closed), 64.0, 0.02 * 64.0);
    assert_eq!(operations(&closed), [0.5, -0.5]);
    let nothing =
        folder.json(&["open", "cube.stl", "--radius", "3", "--resolution", "32", "--unit", "mm", "-o", "none.npz"]);
    assert_eq!((&nothing["volume"]["value"], &nothing["samples"]), (&0.0.into(), &0.into()));
    assert_eq!(warning_codes(&nothing), ["empty"]);
    folder.run(&["open", "cube.stl", "--radius", "-1"]).code(2).says(&["--radius -1"]);
}

#[test]
fn auto_stays_on_the_cpu_and_states_the_reason() {
    let folder = Folder::with_two_cubes();
    let flags = ["a.stl", "b.stl", "--resolution", "16"];
    let result = sum(&folder, &flags);
    assert_eq!((&result["backend"], &result["auto"]["backend"]), (&"cpu".into(), &"cpu".into()));
    let reason = result["auto"]["reason"].as_str().unwrap();
    assert!(reason.contains("no GPU has been measured for sums"), "{reason}");
    let asked = sum(&folder, &[&flags[..], &["--backend", "cpu"]].concat());
    assert_eq!((&asked["backend"], &asked["auto"]), (&"cpu".into(), &Value::Null));
}

#[test]
fn details_between_the_rays_are_named_with_place_and_size() {
    let folder = Folder::new();
    // At a pitch of 0.255 rays lie at 2.1175, 2.3725 and 2.6275, and the hollow between two of them along each axis.
    let hollow = [cube(0.0, 5.0), inside_out(&cuboid([2.4, 2.15, 1.9], [2.6, 2.35, 2.1]))].concat();
    folder.stl("hollow.stl", &hollow);
    let details = |result: &Value| result["steps"][0]["between_rays"]["details"].as_array().unwrap().clone();
    let offset = |distance: &str, pitch: &str| {
        let flags = ["hollow.stl", "--distance", distance, "--pitch", pitch, "--unit", "mm"];
        folder.json(&[&["offset"], &flags[..]].concat())
    };
    let left = offset("0.05", "0.255");
    assert_eq!(warning_codes(&left), ["between-rays"]);
    let message = left["warnings"][0]["message"].as_str().unwrap();
    for words in ["no ray meets 1 cavity", " mm at (2.5", "raise --resolution, or set --pitch to 0.0"] {
        assert!(message.contains(words), "no `{words}` in {message}");
    }
    let found = details(&left);
    assert_eq!((found.len(), &found[0]["kind"]), (1, &"cavity".into()));
    for (axis, place) in [2.5, 2.25, 2.0].into_iter().enumerate() {
        assert_near(found[0]["place"][axis].as_f64().unwrap(), place, 0.255 / 16.0);
        assert_near(found[0]["size"][axis].as_f64().unwrap(), 0.1, 0.255 / 8.0);
    }
    let step = &left["steps"][0]["between_rays"];
    assert_eq!(step["complete"], true);
    assert_near(step["searched_to"].as_f64().unwrap(), 0.255 / 16.0, 1e-6);
    assert!(left["volume"]["estimate_error"].as_f64().unwrap() >= found[0]["volume"].as_f64().unwrap());
    // The cavity closes, or finer rays meet it.
    for (distance, pitch) in [("0.11", "0.255"), ("0.05", "0.03")] {
        let result = offset(distance, pitch);
        assert_eq!(warning_codes(&result), Vec::<&str>::new(), "{distance} {pitch}");
        assert!(details(&result).is_empty());
    }
    let closed = folder.json(&["close", "hollow.stl", "--radius", "0.05", "--pitch", "0.255", "--unit", "mm"]);
    let messages = closed["warnings"].to_string();
    assert!(messages.contains("between the two steps: no ray meets 1 cavity"), "{messages}");
    folder.stl("tool.stl", &cube(-0.02, 0.04));
    let sum = sum(&folder, &["hollow.stl", "tool.stl", "--pitch", "0.255"]);
    assert_eq!(details(&sum).len(), 1);
    assert!(warning_codes(&sum).contains(&"between-rays"), "{:#}", sum["warnings"]);
}
