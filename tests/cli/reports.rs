//! Tests of `report`: metrics with known values, the files it writes, limits, several solids, and refusals.

use std::fs;

use serde_json::Value;

use crate::sums::hollow;
use crate::{Folder, Triangle, assert_near, cube, cuboid, inside_out};

/// A block with two square channels of side 1 through it along z.
fn channels() -> Vec<Triangle> {
    // Slabs and bars that share no face: the fill rule merges the boxes, which form the walls of the channels.
    [
        cuboid([0.0, 0.0, 0.0], [5.0, 1.0, 3.0]),
        cuboid([0.0, 2.0, 0.0], [5.0, 3.0, 3.0]),
        cuboid([0.0, 1.0, 0.0], [1.0, 2.0, 3.0]),
        cuboid([2.0, 1.0, 0.0], [3.0, 2.0, 3.0]),
        cuboid([4.0, 1.0, 0.0], [5.0, 2.0, 3.0]),
    ]
    .concat()
}

fn report(folder: &Folder, flags: &[&str]) -> Value {
    folder.json(&[&["report", "--unit", "mm", "-o", "out"], flags].concat())
}

fn metric<'s>(sheet: &'s Value, id: &str) -> &'s Value {
    let metrics = sheet["metrics"].as_array().unwrap();
    metrics.iter().find(|metric| metric["id"] == id).unwrap_or_else(|| panic!("no metric {id}"))
}

fn value(sheet: &Value, id: &str) -> f64 {
    metric(sheet, id)["value"].as_f64().unwrap_or_else(|| panic!("{}", metric(sheet, id)))
}

#[test]
fn a_hollow_box_has_its_known_metrics() {
    let folder = Folder::new();
    folder.stl("a.stl", &hollow(3.0, 1.0));
    let sheet = report(&folder, &["a.stl", "--resolution", "48"]);
    let pitch = 3.0 / 48.0;
    assert_near(value(&sheet, "volume.solid"), 26.0, 1e-6);
    assert_near(value(&sheet, "volume.total"), 27.0, 1e-6);
    assert_near(value(&sheet, "volume.mesh"), 26.0, 1e-6);
    assert_near(value(&sheet, "porosity"), 1.0 / 27.0, 1e-6);
    assert_near(value(&sheet, "porosity.closed"), 1.0 / 27.0, 1e-9);
    assert_eq!(value(&sheet, "porosity.open"), 0.0);
    // The faces of the outer box lie in the faces of the region: they are cut faces, not surface.
    assert_near(value(&sheet, "surface.area"), 6.0, 1e-6);
    assert_near(value(&sheet, "pore.largest"), 1.0, pitch);
    for (id, exact) in [("euler", 2.0), ("euler.mesh", 2.0), ("betti.0", 1.0), ("betti.1", 0.0), ("betti.2", 1.0)] {
        assert_eq!(value(&sheet, id), exact, "{id}");
    }
    for id in ["percolation", "percolation.x", "tortuosity.pore.diffusive.z"] {
        let metric = metric(&sheet, id);
        assert_eq!((&metric["value"], &metric["status"]), (&Value::Null, &"not-applicable".into()), "{id}");
        assert!(!metric["warnings"].as_array().unwrap().is_empty(), "{id} says nothing of why");
    }
    for id in ["volume.solid", "porosity"] {
        let metric = metric(&sheet, id);
        let [lower, upper] = ["lower", "upper"].map(|key| metric[key].as_f64().unwrap());
        assert!(lower <= value(&sheet, id) && value(&sheet, id) <= upper, "{metric}");
    }
    assert_near(value(&sheet, "centroid.solid.x"), 1.5, 1e-6);
    assert_near(value(&sheet, "inertia.zz"), 27.0 * 18.0 / 12.0 - 2.0 / 12.0, 1e-6);
}

#[test]
fn channels_percolate_along_their_axis_alone() {
    let folder = Folder::new();
    folder.stl("a.stl", &channels());
    let sheet = report(&folder, &["a.stl", "--fill", "nonzero", "--resolution", "50"]);
    assert_near(value(&sheet, "porosity"), 6.0 / 45.0, 1e-6);
    // The boxes touch: faces between two of them are not surface, and metrics that need facets alone are not given.
    assert_near(value(&sheet, "surface.area"), 24.0, 0.3);
    assert_eq!(metric(&sheet, "surface.curvature.mean")["value"], Value::Null);
    assert_near(value(&sheet, "percolation.z"), 1.0, 0.1);
    assert_near(value(&sheet, "tortuosity.pore.diffusive.z"), 1.0, 1e-6);
    assert_near(value(&sheet, "tortuosity.pore.geodesic.z"), 1.0, 1e-6);
    assert_eq!(metric(&sheet, "percolation.x")["value"], Value::Null);
    assert_eq!((value(&sheet, "betti.0"), value(&sheet, "betti.1")), (1.0, 2.0));
}

#[test]
fn inside_out_meshes_are_measured_facing_outwards() {
    let folder = Folder::new();
    folder.stl("a.stl", &hollow(3.0, 1.0));
    folder.stl("b.stl", &inside_out(&hollow(3.0, 1.0)));
    for name in ["a.stl", "b.stl"] {
        let sheet = report(&folder, &[name, "--resolution", "24"]);
        // Of the six faces of the hollow, the ceiling faces down.
        assert_near(value(&sheet, "overhang"), 1.0 / 6.0, 1e-9);
        assert_near(value(&sheet, "surface.curvature.mean"), -3.0 * std::f64::consts::PI, 1e-6);
    }
}

#[test]
fn a_box_shaped_region_of_interest_gives_the_metrics_of_the_box() {
    let folder = Folder::new();
    folder.stl("a.stl", &channels());
    folder.stl("roi.stl", &cuboid([0.5, 0.5, 0.5], [4.5, 2.5, 2.5]));
    let sheet = report(&folder, &["a.stl", "--fill", "nonzero", "--roi", "roi.stl", "--resolution", "40"]);
    assert_near(value(&sheet, "percolation.z"), 1.0, 0.1);
    assert_near(value(&sheet, "tortuosity.pore.diffusive.z"), 1.0, 1e-6);
    assert_near(value(&sheet, "porosity"), 4.0 / 16.0, 1e-6);
}

#[test]
fn rasters_that_do_not_fit_in_memory_are_refused_with_a_resolution() {
    let folder = Folder::with_two_cubes();
    let run = folder.run(&["report", "a.stl", "--resolution", "60000", "-o", "out"]).code(3);
    assert!(run.stderr().contains("GB") && run.stderr().contains("--resolution"), "{}", run.stderr());
    assert!(!folder.path("out").exists());
}

#[test]
fn report_files_hold_the_metrics_of_stdout() {
    let folder = Folder::new();
    folder.stl("a.stl", &channels());
    let sheet = report(&folder, &["a.stl", "--fill", "nonzero", "--resolution", "30"]);
    let names = |path: &str| {
        let mut names: Vec<String> =
            fs::read_dir(folder.path(path)).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    };
    assert_eq!(names("out"), ["methods.txt", "metrics.csv", "metrics.json", "report.html"]);
    let written: Value = serde_json::from_slice(&fs::read(folder.path("out/metrics.json")).unwrap()).unwrap();
    assert_eq!(written, sheet);
    assert_eq!(sheet["schema"], "ldi-ops-report/1");
    let provenance = &sheet["provenance"];
    assert_eq!(provenance["inputs"][0]["sha256"].as_str().unwrap().len(), 64);
    assert_eq!(provenance["rays"], serde_json::json!([30, 18, 18]));
    for metric in sheet["metrics"].as_array().unwrap() {
        for key in ["id", "symbol", "name", "definition", "unit", "method", "reference", "status"] {
            assert!(metric[key].is_string(), "{key} of {metric}");
        }
        let has_reason = !metric["warnings"].as_array().unwrap().is_empty();
        assert!(metric["value"].is_number() || has_reason, "no value and no reason: {metric}");
    }
    let table = fs::read_to_string(folder.path("out/metrics.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + sheet["metrics"].as_array().unwrap().len());
    let page = fs::read_to_string(folder.path("out/report.html")).unwrap();
    // Pictures are base64, in which any letters may follow one another.
    let words =
        page.split("base64,").map(|part| part.split_once('"').map_or(part, |(_, rest)| rest)).collect::<String>();
    assert!(words.contains("a.stl") && words.contains("Tb.Th") && !words.contains("NaN"));
    let methods = fs::read_to_string(folder.path("out/methods.txt")).unwrap();
    assert!(methods.contains("ldi-ops") && methods.contains("taken as a wall"), "{methods}");
}

#[test]
fn the_error_of_a_volume_holds_on_lattices_that_repeat_with_the_raster() {
    let folder = Folder::new();
    let model = |name: &str| format!("{}/../../data/models/{name}.stl", env!("CARGO_MANIFEST_DIR"));
    for (name, resolution) in [
        ("bcc_lattice", "32"),
        ("bcc_lattice", "64"),
        ("bcc_lattice", "96"),
        ("cubic_lattice", "100"),
        ("sphere", "64"),
    ] {
        let file = model(name);
        let exact = folder.volume(&["volume", &file, "--exact"]);
        let sizes = ["--resolution", resolution, "--tortuosity-resolution", "8"];
        let sheet = report(&folder, &[&[file.as_str()][..], &sizes].concat());
        let metric = metric(&sheet, "volume.solid");
        let [value, error] = ["value", "error"].map(|field| metric[field].as_f64().unwrap());
        assert!((value - exact).abs() <= error, "{name} {resolution}: {value} ± {error}, exactly {exact}");
    }
}

#[test]
fn a_value_beyond_its_bounds_is_told_and_does_not_keep_a_limit_that_they_break() {
    let folder = Folder::new();
    let file = format!("{}/../../data/models/bcc_lattice.stl", env!("CARGO_MANIFEST_DIR"));
    fs::write(folder.path("limits.toml"), "porosity = { max = \"82.5 %\" }\n").unwrap();
    let run = folder.run(&[
        "report",
        &file,
        "--unit",
        "mm",
        "--resolution",
        "32",
        "--tortuosity-resolution",
        "8",
        "--limits",
        "limits.toml",
        "-o",
        "out",
    ]);
    let run = run.code(1).warns(&["outside their bounds", "porosity", "--resolution"]);
    assert!(run.stdout().contains("BROKEN by its bounds"), "{}", run.stdout());
}

#[test]
fn broken_limits_exit_with_one_and_wrong_limits_with_two() {
    let folder = Folder::new();
    folder.stl("a.stl", &channels());
    let run = |limits: &str| {
        fs::write(folder.path("limits.toml"), limits).unwrap();
        let flags = ["report", "a.stl", "--fill", "nonzero", "--unit", "mm", "--resolution", "30", "-o", "out"];
        folder.run(&[&flags[..], &["--limits", "limits.toml"]].concat())
    };
    run("porosity = { min = \"13 %\", max = 0.14 }\n\"percolation.z\" = { min = \"500 um\" }\n").code(0);
    let broken = run("porosity = { min = \"60 %\" }\n").code(1);
    assert!(broken.stdout().contains("BROKEN"), "{}", broken.stdout());
    // A metric without a value breaks its limit.
    run("\"percolation.x\" = { min = \"1 um\" }\n").code(1);
    let unknown = run("porosty = { min = 0.5 }\n").code(2);
    assert!(unknown.stderr().contains("limits.toml") && unknown.stderr().contains("porosity"), "{}", unknown.stderr());
    for wrong in ["porosity = {}", "porosity = { min = \"3 mm\" }", "porosity = [", "porosity = { least = 1 }"] {
        run(wrong).code(2);
    }
}

#[test]
fn metrics_count_only_the_region_of_interest() {
    let folder = Folder::new();
    folder.stl("a.stl", &cuboid([0.0; 3], [4.0, 4.0, 1.0]));
    folder.stl("roi.stl", &cuboid([1.0, 1.0, -1.0], [3.0, 3.0, 3.0]));
    let sheet = report(&folder, &["a.stl", "--roi", "roi.stl", "--resolution", "32"]);
    assert_near(value(&sheet, "volume.total"), 16.0, 1e-6);
    assert_near(value(&sheet, "volume.solid"), 4.0, 1e-6);
    assert_near(value(&sheet, "surface.area"), 8.0, 0.05);
    assert_eq!(sheet["provenance"]["region"], "roi.stl");
    assert_eq!(sheet["provenance"]["inputs"][1]["role"], "roi");
}

#[test]
fn several_solids_share_a_table_and_have_a_page_each() {
    let folder = Folder::new();
    folder.stl("a.stl", &channels());
    fs::create_dir(folder.path("other")).unwrap();
    folder.stl("other/a.stl", &hollow(3.0, 1.0));
    let flags =
        ["report", "a.stl", "other/a.stl", "--fill", "nonzero", "--unit", "mm", "--resolution", "24", "-o", "out"];
    folder.run(&flags).code(0);
    for path in
        ["out/index.html", "out/metrics.csv", "out/a/report.html", "out/a-2/report.html", "out/a-2/metrics.json"]
    {
        assert!(folder.path(path).is_file(), "{path}");
    }
    let compared =
        ["report", "a.stl", "--compare", "other/a.stl", "--fill", "nonzero", "--resolution", "24", "-o", "two"];
    folder.run(&compared).code(0);
    for path in ["two/compare.html", "two/report.html", "two/compare/report.html"] {
        assert!(folder.path(path).is_file(), "{path}");
    }
}

#[test]
fn impossible_reports_are_refused_before_measuring() {
    let folder = Folder::with_two_cubes();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    folder.stl("odd.stl", &cuboid([0.0; 3], [1.0, 0.33, 1.0]));
    let refused = |flags: &[&str], part: &str| {
        let run = folder.run(&[&["report"], flags].concat()).code(2);
        assert!(run.stderr().contains(part), "{}", run.stderr());
    };
    refused(&["a.stl", "-o", "b.stl"], "is a file");
    refused(&["a.stl", "-o", "no/such/folder"], "does not exist");
    refused(&["open.stl", "-o", "out"], "not closed");
    refused(&["odd.stl", "-o", "out", "--edges", "periodic", "--resolution", "10"], "whole numbers of pitches");
    refused(&["a.stl", "--roi", "b.stl", "-o", "out", "--edges", "periodic"], "--roi");
    // What is advised for a period has sides of whole numbers of pitches.
    folder.stl("cell.stl", &cuboid([0.0; 3], [3.0, 2.0, 1.0]));
    periodic_reports_are_advised(&folder);
    refused(&["a.stl", "b.stl", "--compare", "a.stl", "-o", "out"], "--compare");
    refused(&["a.stl", "--compare", "open.stl", "-o", "out"], "open.stl");
    refused(&["a.stl", "--compare", "missing.stl", "-o", "out"], "missing.stl");
    refused(&["a.stl", "-o", "out", "--kozeny", "0"], "--kozeny");
    refused(&["a.stl", "-o", "out", "--kozeny", "-1"], "--kozeny");
    refused(&["a.stl", "-o", "out", "--overhang-angle", "91"], "--overhang-angle");
    refused(&["a.stl", "-o", "out", "--limits", "no.toml"], "no.toml");
    assert!(!folder.path("out").exists());
}

/// Runs reports on a periodic cell whose fields do not fit into memory, and one whose equations do not, and then what is advised.
#[track_caller]
fn periodic_reports_are_advised(folder: &Folder) {
    let report = |options: &[&str]| {
        let flags = ["--unit", "mm", "--edges", "periodic", "--memory", "40M"];
        folder.run(&[&["report", "cell.stl"], &flags[..], options].concat())
    };
    let advised = |refusal: &str, option: &str| {
        let words: Vec<&str> = refusal.split([' ', ',', '\n']).collect();
        let at = words.iter().position(|word| *word == option).unwrap_or_else(|| panic!("{option}: {refusal}"));
        words[at + 1].parse::<u32>().unwrap().to_string()
    };
    let equations = "--tortuosity-resolution";
    let refusal = report(&["--resolution", "300", equations, "1000"]).code(3).says(&["the fields of"]).stderr();
    let [fewer, of_equations] = ["--resolution", equations].map(|option| advised(&refusal, option));
    assert!((30..300).contains(&fewer.parse::<u32>().unwrap()), "{refusal}");
    report(&["--resolution", &fewer, equations, &of_equations]).code(0);
    let refusal = report(&["--resolution", &fewer, equations, "1000"]).code(3).says(&["the equations of"]).stderr();
    report(&["--resolution", &fewer, equations, &advised(&refusal, equations)]).code(0);
}

#[test]
fn equations_that_do_not_fit_are_refused_where_there_are_some() {
    let folder = Folder::with_two_cubes();
    folder.stl("large.stl", &cuboid([-1.0; 3], [2.0, 2.0, 2.0]));
    folder.run(&["generate", "sphere", "--radius", "1", "-o", "sphere.stl"]).code(0);
    let report = |region: &str| {
        let flags = ["--unit", "mm", "--resolution", "80", "--memory", "80M"];
        folder.run(&[&["report", "large.stl", "--roi", region], &flags[..]].concat())
    };
    // The region alone, which all of the solid covers.
    report("a.stl")
        .code(3)
        .says(&["the equations of tortuosity on 80 × 80 × 80 nodes", "--tortuosity-resolution 60 would fit"]);
    // No flow between flat ends.
    report("sphere.stl").code(0);
}

#[test]
fn a_missing_unit_is_an_alert() {
    let folder = Folder::with_two_cubes();
    let sheet = folder.json(&["report", "a.stl", "--resolution", "16", "-o", "out"]);
    assert!(
        sheet["alerts"].as_array().unwrap().iter().any(|alert| alert["code"] == "unit-assumed"),
        "{}",
        sheet["alerts"]
    );
    assert_eq!(sheet["unit"], Value::Null);
}

#[test]
fn walls_cut_by_the_box_do_not_count_as_thin() {
    let folder = Folder::new();
    let gyroid = ["generate", "gyroid", "--cells", "2", "--cell-size", "2.5", "--wall", "0.4", "--resolution", "24"];
    folder.run(&[&gyroid[..], &["-o", "a.stl"]].concat()).code(0);
    let thinnest = |edges: &str| {
        let sheet = report(&folder, &["a.stl", "--resolution", "64", "--edges", edges]);
        let [lower, upper] = ["lower", "upper"].map(|key| metric(&sheet, "wall.thinnest")[key].as_f64().unwrap());
        let found = value(&sheet, "wall.thinnest");
        assert!(lower <= found && found <= upper, "{}", metric(&sheet, "wall.thinnest"));
        found
    };
    let [border, clip] = ["border", "clip"].map(thinnest);
    assert_near(border, 0.4, 0.05);
    assert_near(border, clip, 0.05);
    fs::write(folder.path("limits.toml"), "\"wall.thinnest\" = { min = \"0.3 mm\" }\n").unwrap();
    let flags = ["report", "a.stl", "--unit", "mm", "--resolution", "64", "--limits", "limits.toml", "-o", "out"];
    folder.run(&flags).code(0);
    // The box cuts every face of a block, and all of it counts.
    folder.stl("block.stl", &cuboid([0.0; 3], [4.0, 4.0, 1.0]));
    let block = report(&folder, &["block.stl", "--resolution", "32"]);
    assert_eq!(value(&block, "wall.thinnest"), value(&block, "solid.thickness.p1"));
    assert_near(value(&block, "solid.thickness.max"), 1.0, 0.13);
}

#[test]
fn closed_pores_do_not_change_the_tortuosity_of_open_ones() {
    let folder = Folder::new();
    // Boxes within a box are holes: six channels along z, and a cavity.
    let channel = |i: usize| {
        let [x, y] = [1.0 + 2.0 * (i % 3) as f64, 1.0 + 4.0 * (i / 3) as f64];
        cuboid([x, y, 0.0], [x + 1.0, y + 1.0, 7.0])
    };
    let mut block = [cuboid([0.0; 3], [7.0; 3]), cuboid([1.0, 3.0, 1.0], [6.0, 4.0, 6.0])].concat();
    block.extend((0..6).flat_map(channel));
    folder.stl("a.stl", &block);
    let sheet = report(&folder, &["a.stl", "--resolution", "56"]);
    assert_near(value(&sheet, "porosity.closed"), 25.0 / 343.0, 1e-6);
    assert_near(value(&sheet, "tortuosity.pore.diffusive.z"), 1.0, 1e-6);
    assert_eq!(metric(&sheet, "tortuosity.pore.diffusive.x")["value"], Value::Null);
}

#[test]
fn roi_hull_measures_a_solid_within_its_convex_hull() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "5", "-o", "ball.stl"]).code(0);
    folder.stl("box.stl", &hollow(3.0, 1.0));
    let alert = |sheet: &Value| {
        let alerts = sheet["alerts"].as_array().unwrap();
        alerts.iter().find(|alert| alert["code"] == "box-not-filled").map(|alert| alert["message"].to_string())
    };
    let ball = report(&folder, &["ball.stl", "--resolution", "48"]);
    assert_near(value(&ball, "porosity"), 0.476, 0.01);
    let message = alert(&ball).expect("a ball does not fill its box");
    assert!(message.contains("--roi hull") && message.contains("porosity is 0 %"), "{message}");
    let within = report(&folder, &["ball.stl", "--resolution", "48", "--roi", "hull"]);
    assert_near(value(&within, "porosity"), 0.0, 1e-4);
    assert_eq!((alert(&within), &within["provenance"]["region"]), (None, &"hull".into()));
    let hollow = report(&folder, &["box.stl", "--resolution", "24"]);
    assert_eq!(alert(&hollow), None);
    let within = report(&folder, &["box.stl", "--resolution", "24", "--roi", "hull"]);
    for id in ["porosity", "porosity.closed", "surface.area", "volume.total"] {
        assert_near(value(&within, id), value(&hollow, id), 1e-6);
    }
    let refused = ["report", "ball.stl", "--roi", "hull", "--transform-roi", "scale(2)", "-o", "out"];
    assert!(folder.run(&refused).code(2).stderr().contains("--transform-roi"));
}

/// A ball of radius 5 with a channel of radius 1 through it.
#[test]
fn roi_wrap_measures_a_solid_within_what_a_ball_cannot_enter() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "5", "-o", "ball.stl"]).code(0);
    folder.run(&["generate", "cylinder", "--radius", "1", "--height", "12", "-o", "rod.stl"]).code(0);
    let drill = ["subtract", "ball.stl", "rod.stl", "--unit", "mm"];
    folder.run(&[&drill[..], &["--resolution", "128", "-o", "drilled.3mf"]].concat()).code(0);
    let within = |roi: &str| report(&folder, &["drilled.3mf", "--resolution", "64", "--roi", roi]);
    let channel = 1.0 - (1.0 - 1.0_f64 / 25.0).powf(1.5);
    let wrapped = within("wrap:3mm");
    assert_near(value(&wrapped, "porosity"), channel, 0.004);
    assert_eq!(wrapped["provenance"]["region"], "wrap:3 mm");
    assert_near(value(&within("wrap:1500um"), "porosity"), 0.0, 0.004);
    assert_eq!(within("wrap")["provenance"]["region"].as_str().unwrap().split(':').next(), Some("wrap"));
    for (roi, why) in [("wrap:0.01", "least: 0.1"), ("wrap:-1", "positive"), ("wrap:wide", "a length is a number")] {
        let refused = folder.run(&["report", "drilled.3mf", "--roi", roi, "-o", "out"]).code(2).stderr();
        assert!(refused.contains(why), "{refused}");
    }
}

#[test]
fn reports_without_a_folder_write_no_files() {
    let folder = Folder::new();
    folder.stl("a.stl", &hollow(3.0, 1.0));
    folder.stl("b.stl", &hollow(3.0, 2.0));
    let sheet = report(&folder, &["a.stl", "--resolution", "12"]);
    let before = fs::read_dir(folder.path("")).unwrap().count();
    let mut alone = folder.json(&["report", "--unit", "mm", "a.stl", "--resolution", "12"]);
    assert_eq!(alone["metrics"], sheet["metrics"]);
    assert_eq!(alone["alerts"].take(), sheet["alerts"]);
    for flags in [&["a.stl"][..], &["a.stl", "b.stl"], &["a.stl", "--compare", "b.stl"]] {
        let run = folder.run(&[&["report", "--unit", "mm", "--resolution", "12"], flags].concat()).code(0);
        let text = run.stdout();
        assert!(text.contains("Porosity") && !text.contains("written"), "{text}");
        assert_eq!(text.matches("report      ").count(), flags.iter().filter(|word| word.ends_with("stl")).count());
    }
    assert_eq!(fs::read_dir(folder.path("")).unwrap().count(), before);
}

#[test]
fn reports_state_the_area_of_the_mesh_and_of_the_pores() {
    let folder = Folder::new();
    folder.stl("a.stl", &hollow(3.0, 1.0));
    let sheet = report(&folder, &["a.stl", "--resolution", "24"]);
    assert_near(value(&sheet, "surface.mesh"), 60.0, 1e-9);
    assert_near(value(&sheet, "surface.area"), 6.0, 1e-6);
    let why = metric(&sheet, "surface.area")["warnings"][0].as_str().unwrap();
    assert!(why.starts_with("90 %") && why.contains("faces of the box"), "{why}");
}

#[test]
fn walls_thinner_than_the_pitch_are_not_resolved() {
    let folder = Folder::new();
    folder.stl("plate.stl", &cuboid([0.0; 3], [10.0, 10.0, 0.3]));
    folder.stl("roi.stl", &cuboid([0.0, 0.0, -5.0], [10.0, 10.0, 5.0]));
    for flags in [&["plate.stl", "--resolution", "16"][..], &["plate.stl", "--roi", "roi.stl", "--resolution", "16"]] {
        let sheet = report(&folder, flags);
        for id in ["solid.thickness.mean", "solid.thickness.max", "wall.thinnest"] {
            assert_eq!(metric(&sheet, id)["status"], "not-resolved", "{}", metric(&sheet, id));
        }
    }
    let sheet = report(&folder, &["plate.stl", "--pitch", "0.05"]);
    assert_eq!(metric(&sheet, "solid.thickness.mean")["status"], "measured");
}

#[test]
fn headline_figures_have_errors_and_no_bounds() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "5", "-o", "ball.stl"]).code(0);
    let run = folder.run(&["report", "ball.stl", "--unit", "mm", "--resolution", "24", "-o", "out"]);
    let run = run.code(0);
    let porosity = run.stdout().lines().find(|line| line.starts_with("Porosity (φ)")).unwrap().to_owned();
    assert!(porosity.contains(" ± ") && !run.stdout().contains('['), "{}", run.stdout());
    let page = fs::read_to_string(folder.path("out/report.html")).unwrap();
    let (_, figures) = page.split_once(r#"<section id="figures""#).unwrap();
    let (figures, rest) = figures.split_once("</section>").unwrap();
    assert!(figures.contains(" ± ") && !figures.contains("bounds "), "{figures}");
    assert!(rest.contains(r#"<span class="bounds">bounds "#));
}

#[test]
fn batches_continue_after_a_bad_file() {
    let folder = Folder::with_two_cubes();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    let flags = ["report", "a.stl", "open.stl", "b.stl", "no.stl", "--unit", "mm", "--resolution", "16", "-o", "out"];
    let run = folder.run(&flags).code(2);
    let told = run.stderr();
    assert!(told.contains("2 of 4 solids") && told.contains("open.stl") && told.contains("no.stl"), "{told}");
    assert!(folder.path("out/a/report.html").is_file() && folder.path("out/b/report.html").is_file());
    assert!(!folder.path("out/open").exists());
    let index = fs::read_to_string(folder.path("out/index.html")).unwrap();
    let (_, failures) = index.split_once(r#"<section id="failures""#).unwrap();
    assert!(failures.contains("open.stl") && failures.contains("not closed") && failures.contains("no.stl"));
    assert_eq!(index.matches(r#"<img class="thumbnail""#).count(), 2);
    let table = fs::read_to_string(folder.path("out/designs.csv")).unwrap();
    assert!(
        table.starts_with("\u{feff}design,length unit,limits,not measured because,volume.total [mm^3],"),
        "{table}"
    );
    for name in ["a.stl,mm,", "b.stl,mm,", "open.stl,,,", "no.stl,,,"] {
        assert!(table.lines().any(|line| line.starts_with(name)), "{name}: {table}");
    }
    let json = folder.run(&[&flags[..], &["--json", "-"]].concat()).code(2).json();
    assert_eq!(["results", "failures"].map(|key| json[key].as_array().unwrap().len()), [2, 2]);
    // Without a measured solid there is no page to open.
    let none = folder.run(&["report", "open.stl", "no.stl", "-o", "none"]).code(2);
    assert!(none.stderr().contains("2 of 2 solids") && !folder.path("none/index.html").exists());
}

/// Asserts the rules of any report of a solid: bounds enclose values, shares add up, sizes are in their order.
fn faults(sheet: &Value) -> Vec<String> {
    let mut faults = Vec::new();
    let known = |id: &str| metric(sheet, id)["value"].as_f64();
    for metric in sheet["metrics"].as_array().unwrap() {
        let [lower, value, upper] = ["lower", "value", "upper"].map(|key| metric[key].as_f64());
        if metric["status"] == "not-resolved" {
            continue;
        }
        if lower.zip(value).is_some_and(|(lower, value)| lower > value * (1.0 + 1e-9))
            || value.zip(upper).is_some_and(|(value, upper)| value > upper * (1.0 + 1e-9))
        {
            faults.push(format!("{} is {value:?} and not within {lower:?} to {upper:?}", metric["id"]));
        }
        if metric["value"].is_null() && metric["warnings"].as_array().unwrap().is_empty() {
            faults.push(format!("{} has neither value nor reason", metric["id"]));
        }
    }
    let mut ask = |what: &str, holds: bool| {
        if !holds {
            faults.push(what.to_owned());
        }
    };
    let sum = known("porosity.open").zip(known("porosity.closed")).map(|(open, closed)| open + closed);
    ask("open and closed pores are the pores", sum.zip(known("porosity")).is_none_or(|(a, b)| (a - b).abs() < 1e-9));
    let pitch = sheet["provenance"]["pitch"].as_f64().unwrap();
    for (least, most) in [("pore.access.max", "pore.thickness.max"), ("percolation", "pore.largest")] {
        ask(&format!("{least} is at most {most}"), known(least).zip(known(most)).is_none_or(|(a, b)| a <= b + pitch));
    }
    ask("χ is β₀ − β₁ + β₂", {
        let [chi, zero, one, two] = ["euler", "betti.0", "betti.1", "betti.2"].map(|id| known(id).unwrap());
        chi == zero - one + two
    });
    faults
}

#[test]
fn inconsistent_reports_fail_the_checks() {
    let folder = Folder::new();
    folder.stl("a.stl", &channels());
    let sheet = report(&folder, &["a.stl", "--fill", "nonzero", "--resolution", "20"]);
    assert_eq!(faults(&sheet), Vec::<String>::new());
    for (id, key, value) in [("porosity", "lower", 0.9), ("porosity.open", "value", 0.5), ("betti.1", "value", 7.0)] {
        let mut wrong = sheet.clone();
        let metrics = wrong["metrics"].as_array_mut().unwrap();
        metrics.iter_mut().find(|metric| metric["id"] == id).unwrap()[key] = value.into();
        assert_eq!(faults(&wrong).len(), 1, "{id}: {:?}", faults(&wrong));
    }
}

/// Scaffolds and a bone from other sources, and a scaffold within a bone.
#[test]
#[ignore = "needs LDI_CORPUS"]
fn reports_of_corpus_scaffolds_and_bones_are_consistent() {
    let meshes =
        std::path::PathBuf::from(std::env::var_os("LDI_CORPUS").expect("LDI_CORPUS names a folder")).join("meshes");
    let mesh = |name: &str| meshes.join(name).to_str().unwrap().to_owned();
    let folder = Folder::new();
    for name in ["gyroid.stl", "lattice_k.stl", "TP_BCC-2.5mm.stl", "femur_human.stl", "veins.stl"] {
        let sheet = report(&folder, &[&mesh(name), "--resolution", "64"]);
        assert_eq!(faults(&sheet), Vec::<String>::new(), "{name}");
    }
    // A block of gyroid around a metacarpal.
    let bone = mesh("human_metacarpal2.stl");
    let sheet = report(&folder, &[&bone, "--resolution", "16"]);
    let at = |axis| value(&sheet, ["centroid.solid.x", "centroid.solid.y", "centroid.solid.z"][axis]);
    let place = format!("translate({},{},{})", at(0), at(1), at(2));
    let side = value(&sheet, "volume.total").cbrt();
    let (cell, wall) = (format!("{}", side / 3.0), format!("{}", side / 20.0));
    let block = ["generate", "gyroid", "--cells", "9", "--cell-size", &cell, "--wall", &wall, "--resolution", "12"];
    folder.run(&[&block[..], &["-o", "block.stl"]].concat()).code(0);
    let within = ["block.stl", "--transform-a", &place, "--roi", &bone, "--resolution", "96"];
    let sheet = report(&folder, &within);
    assert_eq!(faults(&sheet), Vec::<String>::new());
    assert!((0.3..0.95).contains(&value(&sheet, "porosity")), "{}", value(&sheet, "porosity"));
}

/// Returns the numbers of the stages on stderr, and asserts that all are of so many.
fn stage_numbers(stderr: &str, total: usize) -> Vec<usize> {
    let stages = stderr.lines().filter_map(|line| line.strip_prefix("ldi-ops: stage "));
    let number = |line: &str| {
        let (number, rest) = line.split_once(" of ").unwrap();
        assert!(rest.starts_with(&format!("{total}, ")) && rest.ends_with(" s"), "{line}");
        number.parse().unwrap()
    };
    stages.map(number).collect()
}

#[test]
fn verbose_reports_time_every_stage_on_stderr() {
    let folder = Folder::new();
    folder.stl("a.stl", &hollow(3.0, 1.0));
    folder.run(&["generate", "sphere", "-o", "b.stl"]).code(0);
    fs::write(folder.path("broken.stl"), "solid").unwrap();
    let sizes = ["--unit", "mm", "--resolution", "12", "--tortuosity-resolution", "8", "-o", "out"];
    let run = |flags: &[&str]| folder.run(&[&["report"], flags, &sizes[..]].concat());
    let plain = run(&["a.stl"]).code(0);
    assert!(!plain.stderr().contains("stage"), "{}", plain.stderr());
    let verbose = run(&["a.stl", "-v"]).code(0);
    assert_eq!(stage_numbers(&verbose.stderr(), 17), (1..=17).collect::<Vec<_>>(), "{}", verbose.stderr());
    assert!(verbose.stderr().contains("stage 7 of 17, a.stl: access: "), "{}", verbose.stderr());
    assert!(verbose.stderr().contains("ldi-ops: time        a.stl: "), "{}", verbose.stderr());
    assert_eq!(verbose.stdout(), plain.stdout());
    // No diffusion outside a box; a wrapped region is a stage more.
    let stderr = run(&["b.stl", "--roi", "hull", "-v"]).code(0).stderr();
    assert_eq!(stage_numbers(&stderr, 11), (1..=11).collect::<Vec<_>>(), "{stderr}");
    let stderr = run(&["b.stl", "--roi", "wrap", "-v"]).code(0).stderr();
    assert_eq!(stage_numbers(&stderr, 12), (1..=12).collect::<Vec<_>>(), "{stderr}");
    // The stages of a solid that cannot be read are left out.
    let stderr = run(&["broken.stl", "a.stl", "-v"]).code(2).stderr();
    assert_eq!(stage_numbers(&stderr, 34), [1].into_iter().chain(18..=34).collect::<Vec<_>>(), "{stderr}");
}

#[test]
fn limits_of_reports_with_equal_ends_are_exact() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    fs::write(folder.path("limits.toml"), "porosity = { min = \"0 %\", max = \"0 %\" }\n").unwrap();
    let run =
        folder.run(&["report", "a.stl", "--unit", "mm", "--resolution", "8", "--limits", "limits.toml", "-o", "out"]);
    let text = run.code(0).stdout();
    assert!(text.contains("asked exactly 0 %"), "{text}");
}

/// Faces of a wrapped solid lie on those of the solid, and there are no pores between them.
#[test]
fn wrapped_solids_have_the_pores_of_the_solid_alone() {
    let folder = Folder::new();
    folder.stl("box.stl", &cube(0.0, 10.0));
    folder.stl("hollow.stl", &hollow(10.0, 4.0));
    for (file, diameter, closed) in [("box.stl", "5", 0.0), ("box.stl", "3", 0.0), ("hollow.stl", "3", 0.064)] {
        for resolution in ["50", "64"] {
            let region = format!("wrap:{diameter}");
            let sheet = report(&folder, &[file, "--roi", &region, "--resolution", resolution]);
            let [open, walled] = ["porosity.open", "porosity.closed"].map(|id| value(&sheet, id));
            assert!(open < 1e-6 && (walled - closed).abs() < 1e-3, "{file} {region} {resolution}: {open} {walled}");
            assert!(metric(&sheet, "percolation")["value"].is_null(), "{file} {region} {resolution}");
        }
    }
}
