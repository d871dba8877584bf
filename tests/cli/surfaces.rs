//! Meshes of results: `-o out.stl`, `surface`, `--surface-error`.

use std::fs;

use serde_json::Value;

use crate::{Folder, assert_near, cube, cuboid, inside_out, one_sided, read, warning_codes};

/// Returns the JSON that `check` gives for a mesh.
fn checked(folder: &Folder, path: &str) -> Value {
    folder.json(&["check", path])["results"][0].clone()
}

#[test]
fn every_operation_writes_a_solid_in_every_format() {
    let folder = Folder::with_two_cubes();
    let cases = [
        ("intersect", 1.0, "i.stl"),
        ("union", 15.0, "u.obj"),
        ("difference", 7.0, "d.ply"),
        ("xor", 14.0, "x.off"),
        ("union", 15.0, "u.glb"),
        ("intersect", 1.0, "i.3mf"),
    ];
    for (operation, volume, target) in cases {
        for (mode, mesh) in [("exact", "exact"), ("exact", "sampled"), ("over", "sampled"), ("under", "sampled")] {
            let arguments =
                [operation, "a.stl", "b.stl", "--mode", mode, "--resolution", "32", "--unit", "m", "-o", target];
            let result = folder.json(&[&arguments[..], &["--mesh", mesh]].concat());
            let surface = &result["surface"];
            assert_eq!(surface["method"], mesh);
            assert_eq!((&result["output"], &surface["path"]), (&target.into(), &target.into()));
            assert_near(surface["volume"].as_f64().unwrap(), volume, 2e-3 * volume);
            let found = checked(&folder, target);
            // The two cubes of an xor touch along six edges; the mesh keeps them apart or joins them by whole faces.
            assert!(
                found["solid"] == true && found["defects"] == Value::Array(vec![]),
                "{operation} {mode}: {found:#}"
            );
            for key in ["triangles", "vertices", "components", "genus"] {
                assert_eq!(found[key], surface[key], "{operation} {mode} {key}");
            }
            assert_near(found["volume"].as_f64().unwrap(), volume, 2e-3 * volume);
        }
    }
}

#[test]
fn a_cube_keeps_its_corners_and_loses_its_triangles() {
    let folder = Folder::with_two_cubes();
    let full = folder.json(&["sample", "a.stl", "--resolution", "20", "--surface-error", "0", "-o", "full.ply"]);
    assert_eq!(
        (&full["surface"]["triangles"], &full["surface"]["simplified"]),
        (&(20 * 20 * 6 * 2).into(), &Value::Null)
    );
    assert_eq!(full["surface"]["sub_resolution"], serde_json::json!({ "walls": 0, "gaps": 0 }));
    let arguments = ["sample", "a.stl", "--resolution", "20", "--simplify", "0.1h", "-o", "small.ply"];
    let simplified = folder.json(&arguments);
    let surface = &simplified["surface"];
    assert_eq!((&surface["triangles"], &surface["simplified"]["triangles_before"]), (&12.into(), &4800.into()));
    assert_near(surface["simplified"]["bound"].as_f64().unwrap(), 0.01, 1e-12);
    assert!(surface["simplified"]["distance"].as_f64().unwrap() <= 0.01);
    assert_near(checked(&folder, "small.ply")["volume"].as_f64().unwrap(), 8.0, 1e-6);
    let run = folder.run(&[&arguments[..], &["-v"]].concat()).code(0);
    let words = "12 triangles, 8 vertices, 1 components, genus 0; from images, simplified from 4800 within";
    assert!(run.stderr().contains(words), "{}", run.stderr());
}

#[test]
fn surface_errors_are_bounds_with_units() {
    let folder = Folder::with_two_cubes();
    let sample = ["sample", "a.stl", "--resolution", "100", "-o", "few.ply"];
    let surface = &folder.json(&[&sample[..], &["--surface-error", "0.05h"]].concat())["surface"];
    assert_eq!(surface["triangles"], 12, "{surface}");
    assert_near(checked(&folder, "few.ply")["volume"].as_f64().unwrap(), 8.0, 1e-6);
    for same in [&["--simplify", "0.05h"][..], &[]] {
        assert_eq!(&folder.json(&[&sample[..], same].concat())["surface"], surface, "{same:?}");
    }
    folder.run(&[&sample[..], &["--surface-error", "0mm"]].concat()).code(0);
    folder.run(&[&sample[..], &["--surface-error", "1um"]].concat()).code(2).says(&["--surface-error 1um", "--unit"]);
    folder.run(&[&sample[..], &["--surface-error=-1h"]].concat()).code(2).says(&["--surface-error", "0 for the full"]);
    // Where memory lacks, the default keeps the full mesh, and what was asked for is refused.
    let large = ["sample", "a.stl", "--resolution", "256", "--memory", "150M", "-o", "few.ply"];
    let full = folder.json(&large);
    assert!(warning_codes(&full).contains(&"mesh-not-simplified"));
    assert_eq!(
        (&full["surface"]["triangles"], &full["surface"]["simplified"]),
        (&(256 * 256 * 12).into(), &Value::Null)
    );
    folder.run(&[&large[..], &["--surface-error", "0.05h"]].concat()).code(3).says(&["--surface-error 0"]);
    let without_file = ["intersect", "a.stl", "b.stl", "--surface-error", "0.05h"];
    folder.run(&without_file).code(2).says(&["--surface-error", "-o FILE"]);
}

#[test]
fn surface_of_an_image_file_equals_the_mesh_of_the_operation() {
    let folder = Folder::with_two_cubes();
    for mode in ["exact", "over"] {
        let operation = ["difference", "a.stl", "b.stl", "--mode", mode, "--resolution", "31", "--unit", "mm"];
        folder.run(&[&operation[..], &["--mesh", "sampled", "-o", "direct.ply"]].concat()).code(0);
        folder.run(&[&operation[..], &["-o", "images.npz"]].concat()).code(0);
        let again = folder.json(&["surface", "images.npz", "--mode", mode, "-o", "again.ply"]);
        assert_eq!((&again["unit"], &again["warnings"]), (&"mm".into(), &Value::Array(vec![])));
        let read = |name| std::fs::read(folder.path(name)).unwrap();
        assert!(read("again.ply") == read("direct.ply"), "{mode}");
    }
    let voxels = folder.json(&["surface", "images.npz", "-o", "voxels.npy"]);
    assert_eq!((&voxels["output"], voxels.get("surface")), (&"voxels.npy".into(), None));
}

#[test]
fn booleans_are_written_exactly_wherever_they_can_be() {
    let folder = Folder::with_two_cubes();
    // Neither the raster nor the axis matters.
    let union = ["union", "a.stl", "b.stl", "--axis", "z", "--resolution", "3", "--unit", "mm"];
    let made = folder.json(&[&union[..], &["-o", "u.ply"]].concat());
    let surface = &made["surface"];
    assert_eq!((&surface["method"], surface["volume"].as_f64()), (&"exact".into(), Some(15.0)));
    assert_eq!((&surface["sub_resolution"], &surface["largest_distance"]), (&Value::Null, &Value::Null));
    assert_eq!(made["samples"], 0);
    let found = checked(&folder, "u.ply");
    assert!(found["solid"] == true && found["defects"] == Value::Array(vec![]), "{found:#}");
    assert_eq!((found["volume"].as_f64(), &found["triangles"]), (Some(15.0), &surface["triangles"]));
    assert!(found["triangles"].as_u64().unwrap() < 60);
    let text = folder.run(&[&union[..], &["-v", "-o", "u.ply"]].concat()).code(0).stderr();
    assert!(text.contains("genus 0; exact") && text.contains("2-manifold around 15 mm"), "{text}");
    let far = ["--recentre", "--transform-a", "translate(5e4,0,0)", "-o", "far.stl"];
    let surface = &folder.json(&[&union[..], &far].concat())["surface"];
    assert_eq!((&surface["method"], surface["recentred"].is_array()), (&"exact".into(), true));
    assert_near(checked(&folder, "far.stl")["volume"].as_f64().unwrap(), 16.0, 1e-2);
    // Parts are dropped from exact meshes, too.
    folder.stl("two.stl", &[cube(0.0, 2.0), cube(3.0, 0.2)].concat());
    folder.stl("all.stl", &cube(-1.0, 9.0));
    let one = folder.json(&["intersect", "two.stl", "all.stl", "--drop-parts", "1%", "-o", "one.stl"]);
    assert_eq!((&one["surface"]["triangles"], &one["surface"]["dropped_parts"]["count"]), (&12.into(), &1.into()));
    folder.stl("alike.stl", &[cube(0.0, 2.0), cube(3.0, 2.0)].concat());
    for mesh in ["exact", "sampled"] {
        let none = ["intersect", "alike.stl", "all.stl", "--drop-parts", "60%", "--mesh", mesh, "-o", "none.stl"];
        let why = "no mesh was written: --drop-parts 60% drops all of its 2 parts, of which the largest has 50 % of the volume";
        folder.run(&none).code(1).warns(&[why]);
    }
    // Several operations at once, and operands whose shells overlap.
    folder.stl("lapping.stl", &[cube(0.0, 2.0), cube(1.0, 2.0)].concat());
    let csg = ["csg", "l - a & all", "l=lapping.stl", "a=a.stl", "all=all.stl", "--fill", "nonzero", "-o", "csg.obj"];
    let csg = folder.json(&csg);
    assert_eq!(csg["surface"]["method"], "exact");
    assert_near(
        checked(&folder, "csg.obj")["volume"].as_f64().unwrap(),
        csg["volume"]["value"].as_f64().unwrap(),
        1e-9,
    );
    // A part of the surface has one side.
    folder.stl(
        "part.stl",
        &[cuboid([0.0; 3], [2.0; 3]), one_sided().iter().map(|t| t.map(|c| c.map(|x| x + 3.0))).collect()].concat(),
    );
    let command = ["intersect", "part.stl", "all.stl", "--resolution", "64", "-o", "f.stl"];
    assert_eq!(folder.json(&command)["surface"]["method"], "sampled");
    let insisting = [&command[..], &["--mesh", "exact"]].concat();
    folder.run(&insisting).code(2).says(&["part.stl", "not consistently oriented", "--mesh exact"]);
    let along_one = [&command[..], &["--axis", "z"]].concat();
    folder.run(&along_one).code(2).says(&["images along all axes", "--axis"]);
}

#[test]
fn empty_results_exit_with_one_and_keep_the_old_file() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 1.0));
    folder.stl("b.stl", &cube(2.0, 1.0));
    let command = ["intersect", "a.stl", "b.stl", "--resolution", "16", "-o", "none.stl"];
    let result = folder.run(&[&command[..], &["--json", "-"]].concat()).code(1).json();
    assert_eq!((result["volume"]["value"].as_f64(), &result["surface"]["triangles"]), (Some(0.0), &0.into()));
    assert!(warning_codes(&result).contains(&"empty-surface"));
    assert!(result.get("output").is_none() && !folder.path("none.stl").exists());
    assert!(!folder.run(&command).code(1).stderr().contains("earlier run"));
    fs::write(folder.path("none.stl"), "yesterday's").unwrap();
    let words = ["no mesh was written", "none.stl is from an earlier run and was left as it was"];
    folder.run(&command).code(1).warns(&words);
    folder.run(&["intersect", "a.stl", "b.stl", "--resolution", "16", "-o", "none.npz"]).code(0);
    folder.run(&["surface", "none.npz", "-o", "none.stl"]).code(1).warns(&words);
    assert_eq!(read(&folder.path("none.stl")), "yesterday's");
}

#[test]
fn meshes_that_lack_measured_volume_are_not_written() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("b.stl", &cube(0.001, 3.0));
    // The difference leaves a wall of a thousandth at each of three faces, which the mesh has, but thicker.
    let command = ["difference", "a.stl", "b.stl", "--resolution", "16", "--mesh", "sampled", "-o", "thin.stl"];
    let result = folder.run(&[&command[..], &["--json", "-"]].concat()).code(1).json();
    assert!(warning_codes(&result).contains(&"mesh-far-from-volume"));
    assert!(result["surface"]["sub_resolution"]["walls"].as_u64().unwrap() < 100, "{:#}", result["surface"]);
    // A plate of a thousandth of its sides, which is kept, and one of a tenth of that beside a small cube, which is widened too much.
    folder.stl("a.stl", &[cuboid([0.0; 3], [2.0, 2.0, 0.002]), cube(3.0, 0.1)].concat());
    folder.run(&["sample", "a.stl", "--resolution", "64", "-o", "kept.stl"]).code(0);
    folder.stl("a.stl", &[cuboid([0.0; 3], [2.0, 2.0, 0.0002]), cube(3.0, 0.1)].concat());
    fs::write(folder.path("plate.stl"), "yesterday's").unwrap();
    let command = ["sample", "a.stl", "--resolution", "64", "-o", "plate.stl"];
    let words = ["plate.stl", "no mesh was written", "walls", "earlier run"];
    let result = folder.run(&[&command[..], &["--json", "-"]].concat()).code(1).warns(&words).json();
    assert_eq!((&result["surface"]["path"], result.get("output")), (&Value::Null, None));
    assert!(
        result["surface"]["triangles"].as_u64().unwrap() > 0 && result["volume"]["value"].as_f64().unwrap() > 0.0015
    );
    assert_eq!(read(&folder.path("plate.stl")), "yesterday's");
    folder.run(&["sample", "a.stl", "--resolution", "64", "-o", "plate.npz"]).code(0);
    folder.run(&["surface", "plate.npz", "-o", "plate.stl"]).code(1).warns(&words);
    folder.run(&["volume", "plate.npz"]).code(0).warns(&["plate.npz", "encloses"]);
    // The program compares the volume of the mesh before it drops parts.
    folder.stl("a.stl", &[cube(0.0, 2.0), cube(3.0, 1.0)].concat());
    folder.run(&["sample", "a.stl", "--resolution", "64", "--drop-parts", "20%", "-o", "one.stl"]).code(0);
}

#[test]
fn impossible_mesh_outputs_are_refused() {
    let folder = Folder::with_two_cubes();
    let along_one = ["intersect", "a.stl", "b.stl", "--axis", "x", "--mesh", "sampled", "-o", "out.stl"];
    folder.run(&along_one).code(2).says(&["out.stl", "all axes", "--axis"]);
    for (rest, words) in [
        (&["--estimate", "-o", "out.stl"][..], &["--mesh exact", "--estimate"][..]),
        (&["--mode", "over", "-o", "out.stl"], &["--mesh exact", "--mode"]),
        (&["--simplify", "0.1h", "-o", "out.stl"], &["--mesh exact", "--surface-error"]),
        (&["-o", "out.npz"], &["--mesh exact", "-o FILE"]),
        (&[], &["--mesh exact", "-o FILE"]),
    ] {
        folder.run(&[&["intersect", "a.stl", "b.stl", "--mesh", "exact"], rest].concat()).code(2).says(words);
    }
    assert!(!folder.path("out.stl").exists() && !folder.path("out.npz").exists());
    folder.run(&["intersect", "a.stl", "b.stl", "--simplify", "0.1h"]).code(2).says(&["--surface-error", "-o FILE"]);
    folder.run(&["sample", "a.stl", "--simplify", "0.1h", "-o", "a.npz"]).code(2).says(&["--surface-error", "meshes"]);
    folder.run(&["sample", "a.stl", "--simplify", "2x", "-o", "a.stl"]).code(2).says(&["0.1h"]);
    folder.run(&["sample", "a.stl", "--axis", "x", "--resolution", "8", "-o", "x.npz"]).code(0);
    folder.run(&["surface", "x.npz", "-o", "x.stl"]).code(2).says(&[
        "x.npz",
        "all three axes",
        "x only; sample with --axis all",
    ]);
    folder.run(&["surface", "a.stl", "-o", "x.stl"]).code(2).says(&["a.stl"]);
    folder.run(&["surface", "none.npz", "-o", "x.stl"]).code(2).says(&["none.npz", "No such file"]);
}

/// Images without normals, as another program may write them.
#[test]
fn images_without_normals_give_cut_edges_and_a_warning() {
    let folder = Folder::new();
    let images = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/images/compressed.npz");
    let result = folder.json(&["surface", images, "-o", "out.stl"]);
    assert_eq!(warning_codes(&result), ["no-normals"]);
    // A box of 2 × 2 × 1 pixels of a quarter.
    let volume = result["surface"]["volume"].as_f64().unwrap();
    assert!(volume < 0.0625 && volume > 0.015, "{volume}");
}

#[test]
fn small_parts_are_counted_and_dropped_with_drop_parts() {
    let folder = Folder::new();
    folder.stl("a.stl", &[cube(0.0, 2.0), cube(3.0, 0.2)].concat());
    let whole = folder.json(&["sample", "a.stl", "--resolution", "64", "-o", "whole.ply"]);
    assert_eq!((&whole["surface"]["components"], &whole["surface"]["dropped_parts"]["count"]), (&2.into(), &0.into()));
    assert_near(whole["surface"]["largest_component_share"].as_f64().unwrap(), 8.0 / 8.008, 1e-4);
    let dropping = ["sample", "a.stl", "--resolution", "64", "--drop-parts", "0.5%", "-o", "large.ply"];
    let dropped = folder.json(&dropping);
    assert_eq!(
        (&dropped["surface"]["components"], &dropped["surface"]["dropped_parts"]["count"]),
        (&1.into(), &1.into())
    );
    assert_near(dropped["surface"]["dropped_parts"]["volume"].as_f64().unwrap(), 0.008, 1e-4);
    assert_near(checked(&folder, "large.ply")["volume"].as_f64().unwrap(), 8.0, 1e-3);
    let run = folder.run(&[&dropping[..], &["-v"]].concat()).code(0);
    assert!(run.stderr().contains("1 small parts dropped"), "{}", run.stderr());
    folder.run(&["sample", "a.stl", "--drop-parts", "1%", "-o", "a.npz"]).code(2).says(&["--drop-parts", "meshes"]);
    folder.run(&["intersect", "a.stl", "a.stl", "--drop-parts", "1%"]).code(2).says(&["--drop-parts", "-o FILE"]);
}

/// Returns the path of a model in `data/models`.
fn model(name: &str) -> String {
    format!("{}/../../data/models/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// Booleans in which vertices outside their cells keep one another from going back, so that triangles crossed.
#[test]
fn meshes_of_booleans_pass_the_check_without_self_intersections() {
    let folder = Folder::new();
    let cases = [
        ("difference", "cubic_lattice.stl", "bcc_lattice.stl", "rotate(-9,-2,-9,204) scale(1.3)", "d.stl"),
        ("xor", "gyroid_sheet.stl", "gyroid_sheet.stl", "rotate(-4,-5,-5,164) scale(0.7)", "x.ply"),
    ];
    for (operation, a, b, placement, target) in cases {
        let arguments =
            [operation, &model(a), &model(b), "--transform-b", placement, "--resolution", "40", "-o", target];
        for bound in ["0", "0.05h"] {
            let made = folder.json(&[&arguments[..], &["--mesh", "sampled", "--surface-error", bound]].concat());
            assert_eq!(made["surface"]["crossing_pairs"], 0, "{operation}");
            let found = checked(&folder, target);
            assert!(found["solid"] == true && found["defects"] == Value::Array(vec![]), "{operation}: {found:#}");
            // If a quadrilateral is cut into four triangles, they are still of the same surface.
            for key in ["triangles", "components", "genus"] {
                assert_eq!(found[key], made["surface"][key], "{operation} {key}");
            }
        }
    }
}

#[test]
fn far_meshes_are_refused_by_formats_that_would_round_them() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "1", "-o", "s.stl"]).code(0);
    let near = folder.volume(&["volume", "s.stl", "--resolution", "64"]);
    let sample = |target: &'static str| {
        let far = ["sample", "s.stl", "--transform-a", "translate(1e6,0,0)", "--resolution", "64", "--unit", "m"];
        [&far[..], &["-o", target]].concat()
    };
    for target in ["far.stl", "far.glb"] {
        folder.run(&sample(target)).code(2).says(&["32-bit", ".ply", "--recentre"]);
        let full = [&sample(target)[..], &["--surface-error", "0"]].concat();
        folder.run(&full).code(2).says(&["f32", ".ply", "--recentre"]);
        assert!(!folder.path(target).exists());
    }
    let least_x = |found: &Value| found["bounds"]["min"][0].as_f64().unwrap();
    for target in ["far.obj", "far.ply", "far.off", "far.3mf"] {
        let made = folder.json(&sample(target));
        assert_eq!((&made["surface"]["crossing_pairs"], &made["surface"]["recentred"]), (&0.into(), &Value::Null));
        let found = checked(&folder, target);
        assert!(found["solid"] == true && found["genus"] == 0, "{found:#}");
        assert_near(found["volume"].as_f64().unwrap(), near, 5e-3 * near);
        assert_near(least_x(&found), 999_999.0, 1e-3);
    }
    // GLB and 3MF hold the place of the model.
    for (target, place) in [("near.stl", 0.0), ("near.ply", 0.0), ("near.glb", 1e6), ("near.3mf", 1e6)] {
        let made = folder.json(&[&sample(target)[..], &["--recentre"]].concat());
        assert_eq!(made["surface"]["recentred"], serde_json::json!([1e6, 0.0, 0.0]));
        let found = checked(&folder, target);
        assert!(found["solid"] == true && found["genus"] == 0, "{found:#}");
        assert_near(found["volume"].as_f64().unwrap(), near, 5e-3 * near);
        assert_near(least_x(&found), place - 1.0, 1e-3);
    }
    let run = folder.run(&[&sample("near.stl")[..], &["--recentre", "-v"]].concat()).code(0);
    assert!(run.stderr().contains("recentred by (1000000, 0, 0) m"), "{}", run.stderr());
    // Without -v, too, but for files that hold it.
    for (target, said) in [("near.stl", "near.stl; recentred by (1000000, 0, 0) m\n"), ("near.glb", "near.glb\n")] {
        let text = folder.run(&[&sample(target)[..], &["--recentre"]].concat()).code(0).stdout();
        assert!(text.ends_with(&format!("written     {said}")), "{text}");
    }
    folder.stl("one.stl", &cube(0.25, 1.0));
    let far = ["convert", "one.stl", "--transform-a", "translate(1e9,0,-1e9)", "--recentre", "-o", "r.stl"];
    let [text, json] = [folder.run(&far).code(0).stdout(), folder.json(&far)["output"]["recentred"].to_string()];
    assert!(text.contains("recentred by (1.000000001e9, 1, -999999999)"), "{text}");
    assert_eq!(json, "[1000000001.0,1.0,-999999999.0]");
    // In the unit that is printed with it.
    let metres =
        ["convert", "one.stl", "--unit", "mm", "--transform-a", "translate(1e6,0,0)", "--recentre", "-o", "r.glb"];
    let [text, json] = [folder.run(&metres).code(0).stdout(), folder.json(&metres)["output"]["recentred"].to_string()];
    assert!(text.ends_with("in m; recentred by (1000.001, 0.001, 0.001) m\n"), "{text}");
    assert_eq!(json, "[1000.001,0.001,0.001]");
    folder.run(&["convert", "one.stl", "--transform-a", "translate(1e9,0,-1e9)", "-o", "f.obj"]).code(0);
    let text = folder.run(&["check", "f.obj"]).code(0).stdout();
    assert!(
        text.contains("(1.00000000025e9, 0.25, -999999999.75) to (1.00000000125e9, 1.25, -999999998.75)"),
        "{text}"
    );
}

#[test]
fn conversions_to_32_bits_that_change_the_shape_are_refused() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "1", "-o", "s.obj"]).code(0);
    let volume = checked(&folder, "s.obj")["volume"].as_f64().unwrap();
    folder.run(&["convert", "s.obj", "--transform-a", "translate(1e7,0,0)", "-o", "far.obj"]).code(0);
    for target in ["far.stl", "far.glb"] {
        folder.run(&["convert", "far.obj", "-o", target, "--unit", "m"]).code(2).says(&[
            "32-bit",
            "volume",
            "--recentre",
        ]);
        assert!(!folder.path(target).exists());
        let made = folder.json(&["convert", "far.obj", "-o", target, "--unit", "m", "--recentre"]);
        assert_eq!(made["output"]["recentred"], serde_json::json!([1e7, 0.0, 0.0]));
        assert_near(checked(&folder, target)["volume"].as_f64().unwrap(), volume, 1e-5 * volume);
    }
    assert_near(checked(&folder, "far.glb")["bounds"]["min"][0].as_f64().unwrap(), 1e7 - 1.0, 1e-3);
    // A little rounding still gives a warning.
    folder
        .run(&["convert", "s.obj", "--transform-a", "translate(1e3,0,0)", "-o", "told.stl"])
        .code(0)
        .warns(&["32-bit"]);
}

/// A block with a bubble between nodes: on 20 rays the pitch is a twentieth of its side.
#[test]
fn details_below_the_pitch_are_refined_where_there_are_finer_rays() {
    let folder = Folder::new();
    let bubble = inside_out(&cuboid([0.4425, 0.5175, 0.5175], [0.4575, 0.5325, 0.5325]));
    folder.stl("a.stl", &[cube(0.0, 1.0), bubble].concat());
    let sampled = ["sample", "a.stl", "--resolution", "20", "-o", "out.ply"];
    let surface = |more: &[&str]| folder.json(&[&sampled[..], more].concat())["surface"].clone();
    let blocks = |count: u64, finest: u64| serde_json::json!({ "count": count, "finest": finest });
    let plain = surface(&["--refine", "0"]);
    assert_eq!((&plain["components"], &plain["sub_resolution"]["gaps"]), (&1.into(), &1.into()), "{plain:#}");
    assert_eq!(plain["finer_blocks"], blocks(0, 0));
    let warned = folder.run(&[&sampled[..], &["--refine", "0"]].concat()).code(0);
    warned.warns(&["1 gap between", "raise --resolution to keep more"]);
    let fine = surface(&[]);
    assert_eq!((&fine["components"], &fine["sub_resolution"]["gaps"]), (&2.into(), &0.into()), "{fine:#}");
    assert_eq!(fine["finer_blocks"], blocks(1, 2));
    let details = folder.run(&[&sampled[..], &["-v"]].concat()).code(0).stderr();
    assert!(details.contains("1 block of cells 2 times finer"), "{details}");

    let (lattice, sheet) = (model("bcc_lattice.stl"), model("gyroid_sheet.stl"));
    let common = ["intersect", &lattice, &sheet, "--mesh", "sampled", "--resolution", "64", "-o", "c.stl"];
    let warned = folder.run(&[&common[..], &["--memory", "50M"]].concat()).code(0);
    warned.warns(&["705 walls", "raise --resolution, or --memory for finer cells, to keep more"]);

    let refused = |arguments: &[&str], why: &str| {
        folder.run(arguments).code(2).says(&[why]);
    };
    refused(&[&sampled[..], &["--mode", "over", "--refine", "1"]].concat(), "have the cells of their raster");
    let grown = ["offset", "a.stl", "--distance", "0.1", "--resolution", "20", "-o", "b.stl"];
    refused(&[&grown[..], &["--mode", "under", "--refine", "1"]].concat(), "have the cells of their raster");
    refused(&[&sampled[..], &["--refine", "5"]].concat(), "0..=4");
    folder.run(&["sample", "a.stl", "--resolution", "20", "-o", "a.npz"]).code(0);
    refused(&["surface", "a.npz", "--refine", "1", "-o", "b.stl"], "sample the solid with more");
    folder.run(&["surface", "a.npz", "--refine", "0", "-o", "b.stl"]).code(0);
    refused(&["volume", "a.stl", "--refine", "1"], "--refine");
    let exact = ["intersect", "a.stl", "a.stl", "--mesh", "exact", "--refine", "1", "-o", "b.stl"];
    refused(&exact, "--refine is for meshes from images");
}

/// A bubble or a speck of 0.3 pitches around the middle between two nodes, all that an operation leaves of a larger one.
#[test]
fn details_that_sums_leave_are_refined() {
    let folder = Folder::new();
    let around = |centre: [f64; 3], [below, above]: [f64; 2]| {
        cuboid(centre.map(|at| at - 0.0075 - below), centre.map(|at| at + 0.0075 + above))
    };
    // On rasters with a pitch of 0.05 around all of these, rays lie at 0.02 and from there on.
    let block = cube(0.0, 0.99);
    let with_bubble = |centre, by| [block.clone(), inside_out(&around(centre, by))].concat();
    // The last block vanishes, and makes the raster longer.
    let with_speck = |centre, by| [block.clone(), around(centre, by), cuboid([1.9; 3], [1.99; 3])].concat();
    folder.stl("b.stl", &cube(0.0, 0.2));
    folder.stl("grown.stl", &with_bubble([0.445, 0.42, 0.42], [0.1, 0.1]));
    folder.stl("sum.stl", &with_bubble([0.545, 0.52, 0.52], [0.2, 0.0]));
    folder.stl("shrunk.stl", &with_speck([1.445, 0.42, 0.42], [0.1, 0.1]));
    folder.stl("difference.stl", &with_speck([1.445, 0.42, 0.42], [0.0, 0.2]));
    let cases: [&[&str]; 4] = [
        &["offset", "grown.stl", "--distance", "0.1"],
        &["minkowski", "sum.stl", "b.stl"],
        &["offset", "shrunk.stl", "--distance=-0.1"],
        &["minkowski", "difference.stl", "b.stl", "--difference"],
    ];
    for operation in cases {
        let surface = |more: &[&str]| {
            let all = [operation, &["--pitch", "0.05", "--surface-error", "0", "-o", "out.ply"], more].concat();
            folder.json(&all)["surface"].clone()
        };
        let lost = |surface: &Value| {
            let lost = &surface["sub_resolution"];
            lost["walls"].as_u64().unwrap() + lost["gaps"].as_u64().unwrap()
        };
        let (plain, fine) = (surface(&["--refine", "0"]), surface(&[]));
        assert_eq!((&plain["components"], lost(&plain)), (&1.into(), 1), "{operation:?} {plain:#}");
        assert_eq!(plain["finer_blocks"]["count"], 0);
        assert_eq!((&fine["components"], lost(&fine)), (&2.into(), 0), "{operation:?} {fine:#}");
        assert_eq!(fine["finer_blocks"], serde_json::json!({ "count": 1, "finest": 2 }));
        folder.run(&["check", "out.ply"]).code(0);
        let by = |surface: &Value| surface["volume"].as_f64().unwrap();
        let detail = (by(&fine) - by(&plain)).abs();
        assert!((detail - 0.015f64.powi(3)).abs() < 1e-7, "{operation:?} {detail}");
    }
}

/// The slivers at the sides of a box that a turned copy leaves: images on 20 rays know their volume to some parts in a hundred.
#[test]
fn finer_cells_stay_where_images_know_the_volume_worse_than_they() {
    let folder = Folder::new();
    folder.stl("box.stl", &cube(-10.0, 20.0));
    let place = "translate(0.11,0.13,0.05) rotate(1,1,1,1)";
    let common =
        ["difference", "box.stl", "box.stl", "--transform-b", place, "--mesh", "sampled", "--resolution", "20"];
    let [plain, fine] = ["0", "3"].map(|levels| {
        let result = folder.json(&[&common[..], &["--refine", levels, "-o", "out.ply"]].concat());
        let exact = result["volume"]["exact"].as_f64().unwrap();
        let walls = result["surface"]["sub_resolution"]["walls"].as_u64().unwrap();
        (walls, (result["surface"]["volume"].as_f64().unwrap() / exact - 1.0).abs())
    });
    assert!(plain.0 > 3 * fine.0 && plain.1 > 4.0 * fine.1, "{plain:?} {fine:?}");
}

/// Whiskers in a lattice of struts, on few rays: crumbs thinner than the pitch, of which one had its sides exchanged.
#[test]
fn no_crumb_of_a_mesh_of_images_is_inside_out() {
    let folder = Folder::new();
    for kind in ["brush", "bcc"] {
        folder.run(&["generate", kind, "-o", &format!("{kind}.stl")]).code(0);
    }
    let place = "rotate(2,1,1,12) translate(0,2,0.3)";
    let common =
        ["intersect", "brush.stl", "bcc.stl", "--mesh", "sampled", "--resolution", "32", "--transform-b", place];
    for levels in ["0", "3"] {
        folder.run(&[&common[..], &["--refine", levels, "-o", "common.stl"]].concat()).code(0);
        folder.run(&["check", "common.stl"]).code(0);
    }
}
