//! Volumes that are known exactly; the stated error must contain the true one.

use serde_json::Value;

use crate::{Folder, Triangle, assert_near, cube, cuboid, inside_out, one_sided, warning_codes};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

/// Asserts that the true volume lies within the error that a result states, and that this error is not needlessly large.
#[track_caller]
fn assert_honest(result: &Value, exact: f64, largest_error: f64) {
    let (value, error) = (number(&result["volume"]["value"]), number(&result["volume"]["estimate_error"]));
    assert!((value - exact).abs() <= error, "{value} ± {error} is not {exact}");
    assert!(error <= largest_error, "{value} ± {error} says less than it could of {exact}");
}

#[test]
fn a_thin_plate_has_its_exact_volume_and_inertia_on_any_axis() {
    let folder = Folder::new();
    folder.stl("plate.stl", &cuboid([0.0; 3], [100.0, 1.1, 100.0]));
    for (axis, rays) in [("z", "128"), ("z", "512"), ("all", "64")] {
        let arguments = ["volume", "plate.stl", "--axis", axis, "--resolution", rays];
        let result = folder.json(&arguments);
        assert_honest(&result, 11000.0, 1e-8);
        assert_eq!(result["volume"]["method"], "exact");
        assert_eq!(result["volume"]["exact"], result["volume"]["value"]);
        assert_eq!(
            (&result["samples"], &result["backend"]),
            (&0.into(), &Value::Null),
            "an exact volume needs no image"
        );
        let estimated = folder.json(&[&arguments[..], &["--estimate"]].concat());
        assert_honest(&estimated, 11000.0, f64::INFINITY);
        assert_eq!(estimated["volume"]["method"], "estimate");
        for (i, [a, b]) in [[1.1, 100.0], [100.0, 100.0], [1.1, 100.0]].into_iter().enumerate() {
            let exact = 11000.0 * (a * a + b * b) / 12.0;
            assert_near(number(&result["inertia"][i][i]), exact, 1e-9 * exact);
        }
        let text = folder.run(&arguments).code(0).stdout();
        assert!(text.starts_with("volume      11000 (exact)\n"), "{text}");
    }
}

#[test]
fn inside_out_and_hollow_meshes_have_their_exact_volume() {
    let folder = Folder::new();
    let (outer, inner) = (cuboid([0.0; 3], [4.0, 5.0, 6.0]), cuboid([1.0; 3], [2.0, 2.0, 2.0]));
    folder.stl("inside_out.stl", &inside_out(&outer));
    folder.stl("hollow.stl", &[outer.clone(), inside_out(&inner)].concat());
    for (file, exact) in [("inside_out.stl", 120.0), ("hollow.stl", 119.0)] {
        let result = folder.json(&["volume", file, "--resolution", "20"]);
        assert_eq!((number(&result["volume"]["value"]), &result["volume"]["method"]), (exact, &"exact".into()));
        assert!((0..3).all(|i| number(&result["inertia"][i][i]) > 0.0));
    }
}

#[test]
fn overlapping_and_touching_shells_have_exact_volumes() {
    let folder = Folder::new();
    let first = cuboid([0.0; 3], [2.0; 3]);
    folder.stl("overlapping.stl", &[first.clone(), cuboid([1.0; 3], [3.0; 3])].concat());
    folder.stl("touching.stl", &[first, cuboid([2.0, 0.5, 0.5], [3.0, 1.5, 1.5])].concat());
    // Even-odd removes the common cube, which counts twice in the mesh's own volume of 16.
    for (file, fill, exact) in
        [("overlapping.stl", "even-odd", 14.0), ("overlapping.stl", "nonzero", 15.0), ("touching.stl", "nonzero", 9.0)]
    {
        let result = folder.json(&["volume", file, "--fill", fill, "--exact", "--resolution", "64"]);
        assert_honest(&result, exact, 1e-9);
        assert_eq!(result["volume"]["method"], "exact");
    }
}

/// Returns a box of which a side of the lid is pressed through the bottom.
fn folded() -> Vec<Triangle> {
    let mut folded = cuboid([0.0; 3], [2.0; 3]);
    for corner in folded.iter_mut().flatten().filter(|corner| corner[0] == 2.0 && corner[2] == 2.0) {
        corner[2] = -1.0;
    }
    folded
}

#[test]
fn shells_that_cross_themselves_have_exact_volumes() {
    let folder = Folder::new();
    folder.stl("folded.stl", &folded());
    // Seen along y: a triangle of 4/3 by 2, and below the bottom one of 2/3 by 1, which is inside out.
    for fill in ["even-odd", "nonzero"] {
        let result = folder.json(&["volume", "folded.stl", "--fill", fill, "--exact", "--resolution", "64"]);
        assert_honest(&result, 10.0 / 3.0, 1e-9);
    }
}

#[test]
fn triangles_that_face_either_way_are_turned_under_the_even_odd_rule() {
    let folder = Folder::new();
    let shells = [folded(), cuboid([4.0; 3], [7.0; 3]), cuboid([5.0; 3], [6.0; 3])].concat();
    let turned = |(i, mut triangle): (usize, Triangle)| {
        if i % 3 == 1 {
            triangle.swap(1, 2);
        }
        triangle
    };
    let mixed: Vec<Triangle> = shells.into_iter().enumerate().map(turned).collect();
    folder.stl("mixed.stl", &mixed);
    let result = folder.json(&["volume", "mixed.stl", "--exact", "--unit", "mm"]);
    assert_honest(&result, 10.0 / 3.0 + 26.0, 1e-9);
    assert_eq!((&result["inputs"][0]["oriented"], warning_codes(&result)), (&false.into(), vec!["not-oriented"]));
    // Which of two sides of a surface stays is free, but all triangles of a shell agree.
    let warning = result["warnings"][0]["message"].as_str().unwrap();
    assert!(warning.contains(" of 36 were turned"), "{warning}");
    let made =
        folder.json(&["difference", "mixed.stl", "mixed.stl", "--transform-b", "translate(0,0,9)", "-o", "out.ply"]);
    assert_honest(&made, 10.0 / 3.0 + 26.0, 1e-9);
    assert_eq!(made["surface"]["method"], "exact");
    let run = folder.run(&["volume", "mixed.stl", "--fill", "nonzero"]).code(2);
    run.says(&["mixed.stl", "consistently oriented", "--fill even-odd"]);
}

#[test]
fn volumes_of_meshes_with_one_side_are_estimated_and_the_reason_is_stated() {
    let folder = Folder::new();
    folder.stl("one-sided.stl", &one_sided());
    let result = folder.json(&["volume", "one-sided.stl", "--resolution", "64"]);
    let volume = &result["volume"];
    assert_eq!((&volume["method"], &volume["exact"]), (&"estimate".into(), &Value::Null));
    assert!(volume["not_exact"].as_str().unwrap().contains("not consistently oriented"), "{volume}");
    folder.run(&["volume", "one-sided.stl", "--exact"]).code(2).says(&[
        "one-sided.stl",
        "not consistently oriented",
        "--exact",
    ]);
    folder.stl("folded.stl", &folded());
    folder.run(&["volume", "folded.stl", "--exact", "--estimate"]).code(2);
    folder.run(&["volume", "folded.stl", "--exact", "--mode", "over"]).code(2).says(&["--exact", "--mode over"]);
    folder.run(&["sample", "folded.stl", "--exact", "-o", "a.npz"]).code(2).says(&["--exact"]);
}

#[test]
fn booleans_have_exact_volumes_whatever_the_raster_and_beside_those_of_estimates() {
    let folder = Folder::with_two_cubes();
    for (command, exact) in [("intersect", 1.0), ("union", 15.0), ("difference", 7.0), ("xor", 14.0)] {
        for raster in [&["--resolution", "7"][..], &["--axis", "x", "--pitch", "0.3"], &["--tolerance", "50%"]] {
            let result = folder.json(&[&[command, "a.stl", "b.stl"], raster].concat());
            assert_honest(&result, exact, 1e-12);
            let volume = &result["volume"];
            assert_eq!((&volume["method"], &volume["exact"]), (&"exact".into(), &volume["value"]));
        }
        let over = folder.json(&[command, "a.stl", "b.stl", "--mode", "over", "--lod", "32", "--resolution", "30"]);
        assert_eq!(over["volume"]["method"], "estimate");
        assert_near(number(&over["volume"]["exact"]), exact, 1e-12);
        assert!(number(&over["volume"]["value"]) >= exact - 1e-6, "{command}: {}", over["volume"]);
    }
}

#[test]
fn unions_and_differences_respect_the_volumes_of_the_inputs() {
    let folder = Folder::new();
    // Two plates thinner than the pitch, far apart: their boxes do not overlap.
    folder.stl("a.stl", &cuboid([0.0; 3], [100.0, 1.1, 100.0]));
    folder.stl("b.stl", &cuboid([0.0, 50.0, 0.0], [100.0, 51.3, 100.0]));
    for mode in ["over", "exact", "under"] {
        let of = |command: &str| {
            folder.json(&[
                command,
                "a.stl",
                "b.stl",
                "--estimate",
                "--axis",
                "z",
                "--mode",
                mode,
                "--resolution",
                "128",
            ])
        };
        assert_honest(&of("union"), 24000.0, 1e-3);
        assert_honest(&of("difference"), 11000.0, 1e-3);
        assert_honest(&of("xor"), 24000.0, 1e-3);
        assert_honest(&of("intersect"), 0.0, 1e-9);
    }
}

#[test]
fn overlaps_that_no_ray_meets_are_bounded() {
    let folder = Folder::new();
    // Two boxes fill the box around both: the common part is the excess of their volumes.
    folder.stl("a.stl", &cuboid([0.0; 3], [100.0; 3]));
    folder.stl("b.stl", &cuboid([99.9, 0.0, 0.0], [199.9, 100.0, 100.0]));
    assert_honest(&folder.json(&["intersect", "a.stl", "b.stl", "--estimate", "--axis", "z"]), 1000.0, 1e-5);

    // Two needles that cross: the common part is at most the box that they share.
    folder.stl("x.stl", &cuboid([0.0; 3], [100.0, 0.01, 0.01]));
    folder.stl("y.stl", &cuboid([50.0, -50.0, 0.0], [50.01, 50.0, 0.01]));
    let arguments = ["intersect", "x.stl", "y.stl", "--estimate", "--resolution", "100", "--unit", "mm"];
    let result = folder.json(&arguments);
    assert_honest(&result, 1e-6, 1.1e-6);
    assert_eq!((&result["volume"]["value"], &result["volume"]["at_least"]), (&0.0.into(), &0.0.into()));
    assert_near(number(&result["volume"]["at_most"]), 1e-6, 1e-15);
    assert!(warning_codes(&result).contains(&"not-resolved"));
    let text = folder.run(&arguments).code(0).stdout();
    assert!(text.starts_with("intersect   at least 0 and at most ") && text.contains(": not resolved\n"), "{text}");
    // No tolerance is reached while no ray meets the common part.
    let run = folder.run(&[&arguments[..4], &["--tolerance", "1%", "--unit", "mm"]].concat()).code(1);
    run.warns(&["--tolerance 1 %: not reached with 1024 rays along the longest side, which resolve no volume"]);
    // Certified bounds are narrower than those of the inputs.
    let result = folder.json(&[&arguments[..], &["--bounds"]].concat());
    let [least, lower, most, upper] =
        ["at_least", "lower", "at_most", "upper"].map(|key| number(&result["volume"][key]));
    assert!(least >= lower && most <= upper && most - least < 1e-8, "{result:#}");
    assert_near(number(&result["volume"]["value"]), 1e-6, 1e-8);
}

#[test]
fn bounds_of_unmet_results_that_print_the_same_are_a_value() {
    let folder = Folder::new();
    // No ray along x meets the needle, of which the crumb makes a ten-millionth.
    folder.stl("needle.stl", &cuboid([0.0; 3], [100.0, 0.01, 0.01]));
    folder.stl("crumb.stl", &cuboid([50.0, -0.0005, 0.0], [50.001, 0.0005, 0.001]));
    let arguments =
        ["union", "needle.stl", "crumb.stl", "--estimate", "--resolution", "10", "--axis", "x", "--unit", "mm"];
    let run = folder.run(&arguments).code(0);
    assert!(run.stdout().starts_with("union       0.010000"), "{}", run.stdout());
    assert!(!run.stdout().contains("at least") && run.stdout().contains(" ± "), "{}", run.stdout());
    assert!(!run.stderr().contains("at least"), "{}", run.stderr());
}

#[test]
fn struts_aligned_with_the_rays_are_within_the_stated_error() {
    let folder = Folder::new();
    folder.run(&["generate", "cubic", "--cells", "8", "--radius", "0.8", "--resolution", "16", "-o", "l.stl"]).code(0);
    folder.stl("box.stl", &cuboid([-60.0; 3], [60.0; 3]));
    let exact = number(&folder.json(&["volume", "l.stl", "--resolution", "16"])["volume"]["value"]);
    for axis in ["x", "all"] {
        // The box is half as long again as the lattice, so that a cell has 32 rays.
        let result =
            folder.json(&["intersect", "l.stl", "box.stl", "--estimate", "--axis", axis, "--resolution", "384"]);
        assert_honest(&result, exact, 0.02 * exact);
    }
}

#[test]
fn sums_and_offsets_are_within_their_stated_error() {
    let folder = Folder::new();
    folder.stl("needle.stl", &cuboid([0.0; 3], [5.0, 0.01, 0.01]));
    folder.stl("cube.stl", &cuboid([0.0; 3], [1.0; 3]));
    folder.stl("rod.stl", &cuboid([0.0; 3], [0.3, 0.2, 0.7]));
    let pi = std::f64::consts::PI;
    // Steiner: V + A r + (half the lengths of the edges times their angle) r² + 4/3 π r³.
    let grown = |[a, b, c]: [f64; 3], r: f64| {
        a * b * c + 2.0 * (a * b + b * c + c * a) * r + pi * (a + b + c) * r * r + 4.0 / 3.0 * pi * r.powi(3)
    };
    let needle = folder.json(&["offset", "needle.stl", "--distance", "0.1", "--resolution", "128"]);
    assert_honest(&needle, grown([5.0, 0.01, 0.01], 0.1), 0.1);
    for (axis, rays) in [("all", "64"), ("y", "100")] {
        let options = ["--axis", axis, "--resolution", rays];
        let cube = folder.json(&[&["offset", "cube.stl", "--distance", "0.1"], &options[..]].concat());
        assert_honest(&cube, grown([1.0; 3], 0.1), 0.2);
        let sum = folder.json(&[&["minkowski", "cube.stl", "rod.stl"], &options[..]].concat());
        assert_honest(&sum, 1.3 * 1.2 * 1.7, 0.2);
        let left = folder.json(&[&["minkowski", "cube.stl", "rod.stl", "--difference"], &options[..]].concat());
        assert_honest(&left, 0.7 * 0.8 * 0.3, 0.05);
    }
}

#[test]
fn a_tolerance_that_rays_reached_is_not_that_of_the_exact_volume() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let all = ["intersect", "a.stl", "a.stl", "--transform-b", "rotate(1,2,3,20)", "--tolerance", "2%", "-v"];
    let reached = |more: &[&str]| folder.run(&[&all[..], more].concat()).code(0).stderr().to_owned();
    assert!(reached(&[]).contains("by the exact volume"));
    let by_rays = reached(&["-o", "i.npz"]);
    assert!(by_rays.contains("rays along the longest side") && !by_rays.contains("by the exact volume"), "{by_rays}");
}

#[test]
fn moments_of_needles_are_not_taken_for_rounding() {
    let folder = Folder::new();
    folder.stl("needle.stl", &cuboid([0.0; 3], [2e7, 1.0, 1.0]));
    let run = folder.run(&["volume", "needle.stl", "--unit", "mm", "--resolution", "64"]).code(0);
    assert!(run.stdout().contains("volume      20000000 mm³ (exact)\n"), "{}", run.stdout());
    // 3333333, in as many digits as sums over a needle keep.
    assert!(run.stdout().contains("inertia     (3") && run.stdout().contains(", 0, 0) mm⁵"), "{}", run.stdout());
}
