//! The command `clash`.

use std::collections::BTreeMap;
use std::fs;

use crate::{Folder, assert_near, cube, cuboid, one_sided, read, warning_codes};

/// Writes a cube of side 2, one that overlaps it by 1, one that touches it, one 0.25 away, and one far away.
fn with_parts() -> Folder {
    let folder = Folder::with_two_cubes();
    folder.stl("touching.stl", &cuboid([0.0, 2.0, 0.0], [2.0, 3.0, 0.5]));
    folder.stl("near.stl", &cuboid([-1.25, 0.0, 0.0], [-0.25, 2.0, 2.0]));
    folder.stl("far.stl", &cube(50.0, 1.0));
    folder
}

/// Returns a cube of side 2 with a corner pulled through the face below, and a surface with one side beyond the corner, so that
/// it has no exact volume.
pub fn without_exact_volume() -> Vec<[[f64; 3]; 3]> {
    let pulled = |corner: [f64; 3]| if corner == [2.0; 3] { [1.0, 1.0, -0.5] } else { corner };
    let away = |corner: [f64; 3]| corner.map(|coordinate| 2.0 + coordinate);
    let (block, far) = (cube(0.0, 2.0), one_sided());
    let block = block.iter().map(|triangle| triangle.map(pulled));
    block.chain(far.iter().map(|triangle| triangle.map(away))).collect()
}

#[test]
fn overlaps_have_volume_box_depth_and_place() {
    let folder = Folder::with_two_cubes();
    let run = folder.run(&["clash", "a.stl", "b.stl", "--unit", "mm"]).code(1);
    let text = run.stdout();
    assert!(text.starts_with("clash       1 finding in 1 near pair of 2 parts\n"), "{text}");
    assert!(text.contains("OVERLAP") && text.contains("a.stl : b.stl") && text.contains("mm³"), "{text}");
    let json = folder.run(&["clash", "a.stl", "b.stl", "--json", "-"]).code(1).json();
    let pair = &json["pairs"][0];
    assert_eq!((&pair["state"], &pair["finding"]), (&"overlapping".into(), &"overlap".into()));
    let overlap = &pair["overlap"];
    let [lower, value, upper] = ["lower", "value", "upper"].map(|key| overlap["volume"][key].as_f64().unwrap());
    assert_near(value, 1.0, 1e-3);
    assert!(lower <= 1.0 + 1e-9 && 1.0 <= upper + 1e-9, "{overlap}");
    assert_eq!(overlap["bounds"], serde_json::json!({ "min": [1.0, 1.0, 1.0], "max": [2.0, 2.0, 2.0] }));
    let [least, most] = ["lower", "upper"].map(|key| overlap["depth"][key].as_f64().unwrap());
    assert!(least > 0.97 && least <= 1.0 && most >= 1.0, "{overlap}");
    for i in 0..3 {
        assert_near(overlap["deepest"][i].as_f64().unwrap(), 1.5, 0.02);
    }
    assert_eq!((&json["passed"], &overlap["certain"]), (&false.into(), &true.into()));
}

#[test]
fn contacts_are_findings_unless_they_are_allowed() {
    let folder = with_parts();
    let run = folder.run(&["clash", "a.stl", "touching.stl"]).code(1);
    assert!(run.stdout().contains("TOUCHING  a.stl : touching.stl"), "{}", run.stdout());
    let run = folder.run(&["clash", "a.stl", "touching.stl", "--allow-touching"]).code(0);
    assert!(run.stdout().starts_with("clash       0 findings in 1 near pair of 2 parts\n"), "{}", run.stdout());
    // A gap below --touching is a contact.
    folder.run(&["clash", "a.stl", "near.stl"]).code(0);
    folder.run(&["clash", "a.stl", "near.stl", "--touching", "0.3"]).code(1);
}

#[test]
fn parts_and_folders_can_be_placed() {
    let folder = with_parts();
    let first = |arguments: &[&str]| {
        let run = folder.run(&[&["clash"], arguments, &["--clearance", "9", "--json", "-"]].concat()).code(1);
        let pair = &run.json()["pairs"][0];
        (pair["state"].as_str().unwrap().to_owned(), pair["distance"].as_f64())
    };
    let apart = ("separate".to_owned(), Some(1.0));
    assert_eq!(first(&["a.stl", "a.stl", "--transform-b", "translate(3,0,0)"]), apart);
    assert_eq!(first(&["a.stl", "a.stl", "--transform-a", "translate(0,-3,0)"]), apart);
    assert_eq!(first(&["a.stl", "far.stl", "a.stl", "--transform", "c=translate(0,0,3)"]), apart);
    fs::create_dir(folder.path("parts")).unwrap();
    fs::rename(folder.path("touching.stl"), folder.path("parts/touching.stl")).unwrap();
    assert_eq!(first(&["a.stl", "parts", "--transform-b", "translate(0,1,0)"]), apart);
    let wrong = ["clash", "a.stl", "parts", "--transform", "c=scale(2)"];
    folder.run(&wrong).code(2).says(&["--transform c=…: no input is named `c`; the inputs are a, b"]);
}

#[test]
fn turned_parts_touch_although_their_corners_are_rounded() {
    let folder = with_parts();
    let place = "rotate(1,2,3,40) translate(5,6,7)";
    let part = |file: &str| format!("[[part]]\nfile = \"{file}\"\ntransform = \"{place}\"\n");
    fs::write(folder.path("list.toml"), part("a.stl") + &part("touching.stl")).unwrap();
    let json = folder.run(&["clash", "--assembly", "list.toml", "--json", "-"]).code(1).json();
    assert_eq!(json["pairs"][0]["state"], "touching");
}

#[test]
fn small_parts_touch_larger_ones_by_no_noticeable_share_of_their_size() {
    let folder = Folder::new();
    folder.stl("small.stl", &cube(0.0, 1.0));
    folder.stl("large.stl", &cube(0.0, 1.0));
    let run = |x: &str, more: &[&str], code: i32| {
        let place = format!("scale(1e7) translate({x},0,0)");
        let all = ["clash", "small.stl", "large.stl", "--transform-b", &place, "--allow-touching", "-v"];
        folder.run(&[&all[..], more].concat()).code(code)
    };
    // Coordinates of 10^7 are rounded by 2.4 in files of 32-bit numbers.
    let warned = ["small.stl : large.stl: a depth of about 0.7", "2.384", "--touching"];
    assert!(run("0.25", &[], 1).warns(&warned).stdout().contains("OVERLAP"));
    run("2", &[], 0).warns(&["a distance of 1 is within 2.384"]);
    assert!(run("0.25", &["--touching", "2.5"], 0).stderr().contains("touching, at most 0.7"));
    assert!(run("2", &["--touching", "2.5"], 0).stderr().contains("touching, 1 apart"));
    // A foil of 0.1 that is turned has a large box.
    folder.stl("foil.stl", &cuboid([0.0; 3], [100.0, 100.0, 0.1]));
    let turned = "rotate(1,1,0,45) translate(1e6,0,0)";
    let pierced = [
        "clash",
        "foil.stl",
        "foil.stl",
        "--transform-a",
        turned,
        "--transform-b",
        "rotate(1,1,0,45) translate(1000000.05,0,0)",
    ];
    let run = folder.run(&[&pierced[..], &["--allow-touching"]].concat()).code(1);
    assert!(run.stdout().contains("OVERLAP"), "{}", run.stdout());
    let json = folder.run(&["clash", "small.stl", "large.stl", "--touching", "1", "--json", "-"]).code(1).json();
    let pair = &json["pairs"][0];
    assert_eq!((&pair["state"], &pair["distance"]), (&"touching".into(), &0.0.into()));
    assert!((0.99..=1.0).contains(&pair["depth"]["upper"].as_f64().unwrap()), "{pair}");
}

#[test]
fn a_part_within_another_does_not_touch_it_however_thin_it_is() {
    let folder = Folder::new();
    folder.stl("block.stl", &cube(0.0, 100.0));
    folder.stl("foil.stl", &cuboid([10.0, 10.0, 50.0], [90.0, 90.0, 50.01]));
    for (place, more) in
        [("translate(0,0,0)", &["--touching", "1"][..]), ("rotate(0,1,0,30) translate(6000,6000,6000)", &[])]
    {
        let all =
            ["clash", "block.stl", "foil.stl", "--transform-a", place, "--transform-b", place, "--allow-touching"];
        let run = folder.run(&[&all[..], more].concat()).code(1);
        assert!(run.stdout().contains("foil.stl lies in block.stl"), "{}", run.stdout());
    }
}

#[test]
fn distances_below_the_clearance_are_findings_with_two_points() {
    let folder = with_parts();
    let run = |clearance: &str| folder.run(&["clash", "a.stl", "near.stl", "--clearance", clearance, "--json", "-"]);
    let json = run("0.3").code(1).json();
    let pair = &json["pairs"][0];
    assert_eq!((&pair["state"], &pair["finding"]), (&"separate".into(), &"clearance".into()));
    assert_eq!(pair["distance"], 0.25);
    let x = |i: usize| pair["points"][i][0].as_f64().unwrap();
    assert_eq!([x(0), x(1)], [0.0, -0.25]);
    let json = run("0.25").code(0).json();
    assert_eq!((&json["passed"], &json["counts"]["near_pairs"]), (&true.into(), &1.into()));
    folder
        .run(&["clash", "a.stl", "near.stl", "--clearance", "0.3mm"])
        .code(2)
        .says(&["--clearance 0.3mm", "--unit mm"]);
    folder.run(&["clash", "a.stl", "near.stl", "--clearance", "300um", "--unit", "mm"]).code(1);
}

#[test]
fn a_part_within_another_overlaps_it() {
    let folder = Folder::new();
    folder.stl("outer.stl", &cube(0.0, 4.0));
    folder.stl("inner.stl", &cube(1.0, 1.0));
    let json = folder.run(&["clash", "outer.stl", "inner.stl", "--json", "-"]).code(1).json();
    let overlap = &json["pairs"][0]["overlap"];
    assert_eq!(overlap["contained"], "inner.stl");
    assert_near(overlap["volume"]["value"].as_f64().unwrap(), 1.0, 1e-3);
    // In a cavity it is separate.
    let hollow: Vec<_> = cube(0.0, 4.0).into_iter().chain(crate::inside_out(&cube(0.5, 3.0))).collect();
    folder.stl("hollow.stl", &hollow);
    let json = folder.run(&["clash", "hollow.stl", "inner.stl", "--json", "-"]).code(0).json();
    assert_eq!((&json["pairs"][0]["state"], &json["pairs"][0]["distance"]), (&"separate".into(), &0.5.into()));
}

#[test]
fn rules_ignore_pairs_and_allow_small_overlaps() {
    let folder = Folder::with_two_cubes();
    let json = folder.run(&["clash", "a.stl", "b.stl", "--ignore", "b.*:a?stl", "--json", "-"]).code(0).json();
    assert_eq!((&json["counts"]["ignored_pairs"], &json["pairs"]), (&1.into(), &serde_json::json!([])));
    let run = folder.run(&["clash", "a.stl", "b.stl", "--ignore", "a.stl:c.stl"]).code(1);
    run.warns(&["no part is named `c.stl`", "the parts are a.stl, b.stl"]);
    for (volume, code) in [("1.01", 0), ("0.99", 1), ("1mm3", 0), ("0.99 mm³", 1), ("0.0011ml", 0), ("1e8um3", 1)] {
        folder.run(&["clash", "a.stl", "b.stl", "--unit", "mm", "--max-volume", volume]).code(code);
    }
    folder.run(&["clash", "a.stl", "b.stl", "--max-volume", "1mm3"]).code(2).says(&["--max-volume 1mm3", "--unit mm"]);
    folder.run(&["clash", "a.stl", "b.stl", "--max-volume", "-1mm3"]).code(2).says(&["--max-volume -1mm3"]);
}

#[test]
fn names_may_have_colons_and_numbers() {
    let folder = Folder::with_two_cubes();
    let part = |file: &str, name: &str| format!("[[part]]\nfile = \"{file}\"\nname = \"{name}\"\n");
    let list = [part("a.stl", "M3:8"), part("b.stl", "M3"), part("b.stl", "M3"), part("b.stl", "M3#2")].concat();
    fs::write(folder.path("list.toml"), list).unwrap();
    let run = |ignored: &str| folder.run(&["clash", "--assembly", "list.toml", "--ignore", ignored, "--json", "-"]);
    let json = run("M3:8:M3#2").code(1).json();
    let names: Vec<&str> = json["parts"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!((names, &json["counts"]["ignored_pairs"]), (vec!["M3:8", "M3", "M3#3", "M3#2"], &1.into()));
    let run = folder.run(&["clash", "--assembly", "list.toml", "--ignore", "*:*:*"]);
    run.code(2).says(&["--ignore *:*:*", "`*` and `*:*`", "write ? for each colon"]);
}

#[test]
fn folders_give_all_their_parts_and_the_worst_pairs_come_first() {
    let folder = with_parts();
    let parts = folder.path("parts");
    fs::create_dir(&parts).unwrap();
    for name in ["a.stl", "b.stl", "touching.stl", "near.stl", "far.stl"] {
        fs::rename(folder.path(name), parts.join(name)).unwrap();
    }
    fs::write(parts.join("notes.txt"), "no mesh").unwrap();
    let run = folder.run(&["clash", "parts", "--clearance", "0.5", "--csv", "table.csv"]).code(1);
    let table = read(&folder.path("table.csv"));
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines[0][..5], ["finding", "state", "a", "b", "distance"]);
    let findings: Vec<&str> = lines[1..].iter().map(|line| line[0]).collect();
    // b.stl and touching.stl share the box from (1, 2, 1) upwards: they overlap nowhere and are near.
    assert_eq!((findings[0], findings[1]), ("overlap", "touching"), "{table}");
    assert!(findings[2..].iter().all(|finding| ["clearance", ""].contains(finding)), "{table}");
    assert!(!table.contains("far.stl") && run.stdout().contains("of 5 parts"), "{table}");
}

#[test]
fn lists_place_and_name_parts() {
    let folder = Folder::new();
    folder.stl("plate.stl", &cuboid([0.0, 0.0, 0.0], [10.0, 10.0, 1.0]));
    folder.stl("bolt.stl", &cuboid([-0.5, -0.5, -2.0], [0.5, 0.5, 2.0]));
    let part = |place: &str| format!("[[part]]\nfile = \"bolt.stl\"\nname = \"bolt\"\ntransform = \"{place}\"\n");
    fs::write(folder.path("bolts.toml"), part("translate(2,2,0)") + &part("translate(20,2,0)")).unwrap();
    let json = folder.run(&["clash", "plate.stl", "--assembly", "bolts.toml", "--json", "-"]).code(1).json();
    let names: Vec<&str> =
        json["parts"].as_array().unwrap().iter().map(|part| part["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["plate.stl", "bolt", "bolt#2"]);
    assert_eq!(json["pairs"].as_array().unwrap().len(), 1);
    assert_eq!((&json["pairs"][0]["a"], &json["pairs"][0]["b"]), (&"plate.stl".into(), &"bolt".into()));
    // A folder stands for its files, in one place.
    fs::create_dir(folder.path("parts")).unwrap();
    for file in ["bolt.stl", "plate.stl"] {
        fs::rename(folder.path(file), folder.path("parts").join(file)).unwrap();
    }
    fs::write(folder.path("all.toml"), part("translate(2,2,0)").replace("bolt.stl", "parts")).unwrap();
    let json = folder.run(&["clash", "--assembly", "all.toml", "--json", "-"]).code(1).json();
    assert_eq!((&json["pairs"][0]["a"], &json["pairs"][0]["b"]), (&"bolt/bolt.stl".into(), &"bolt/plate.stl".into()));
}

#[test]
fn bad_inputs_are_named() {
    let folder = with_parts();
    folder.run(&["clash", "a.stl"]).code(2).says(&["a.stl", "one part alone"]);
    folder.run(&["clash", "a.stl", "missing.stl"]).code(2).says(&["missing.stl"]);
    folder.run(&["clash"]).code(2);
    folder.stl("open.stl", &cube(0.0, 1.0)[1..]);
    let open = folder.run(&["clash", "a.stl", "open.stl"]).code(2).says(&["open.stl", "not closed", "ldi-ops check"]);
    // An option of other commands.
    assert!(!open.stderr().contains("--allow-open"), "{}", open.stderr());
    folder.run(&["volume", "open.stl"]).code(2).says(&["open.stl", "not closed", "--allow-open samples it"]);
    fs::create_dir(folder.path("empty")).unwrap();
    folder.run(&["clash", "a.stl", "empty"]).code(2).says(&["empty", "no mesh files"]);
    fs::write(folder.path("list.toml"), "[[part]]\nfile = \"a.stl\"\ntransform = \"turn(3)\"\n").unwrap();
    folder.run(&["clash", "a.stl", "--assembly", "list.toml"]).code(2).says(&["list.toml", "part 1"]);
    folder
        .run(&["clash", "a.stl", "list.toml"])
        .code(2)
        .says(&["list.toml: is not a mesh file", "--assembly list.toml"]);
    let placed = ["clash", "--assembly", "list.toml", "--transform-a", "scale(2)"];
    folder.run(&placed).code(2).says(&["no input is named `a`", "`transform` there"]);
    folder.run(&["clash", "a.stl", "b.stl", "--clearance", "-1"]).code(2).says(&["--clearance -1"]);
    folder.run(&["clash", "a.stl", "b.stl", "--ignore", "a.stl"]).code(2);
    folder.run(&["clash", "a.stl", "b.stl", "--csv", "a.stl"]).code(2).says(&["a.stl", "overwritten"]);
    folder.run(&["clash", "a.stl", "b.stl", "--memory", "1M"]).code(3).says(&["--memory allows 1 MB"]);
}

#[test]
fn a_folder_has_the_page_and_the_tables() {
    let folder = with_parts();
    let arguments =
        ["clash", "a.stl", "b.stl", "touching.stl", "near.stl", "--clearance", "0.3", "--unit", "mm", "-o", "out"];
    let run = folder.run(&arguments).code(1);
    assert!(run.stdout().contains("out/clash.html") && run.stderr().is_empty(), "{}{}", run.stdout(), run.stderr());
    let page = read(&folder.path("out/clash.html"));
    for text in ["4 parts", "a.stl", "near.stl", "Section across", "data:image/png;base64,", "id=\"matrix\"", "mm³"] {
        assert!(page.contains(text), "no {text}");
    }
    for text in ["NaN", "inf ", "http://", "https://"] {
        assert!(!page.contains(text), "{text}");
    }
    let json: serde_json::Value = serde_json::from_str(&read(&folder.path("out/clash.json"))).unwrap();
    assert_eq!((&json["schema"], &json["command"]), (&"ldi-ops/1".into(), &"clash".into()));
    assert_eq!(read(&folder.path("out/clash.csv")).lines().count(), 1 + json["pairs"].as_array().unwrap().len());
}

#[test]
fn pages_name_the_part_that_lies_in_another_and_say_that_none_are_near() {
    let folder = Folder::new();
    folder.stl("outer.stl", &cube(-2.0, 4.0));
    folder.stl("inner.stl", &cube(-0.5, 1.0));
    folder.stl("far.stl", &cube(50.0, 1.0));
    folder.run(&["clash", "outer.stl", "inner.stl", "--unit", "mm", "-o", "out"]).code(1);
    let page = read(&folder.path("out/clash.html"));
    for text in ["inner.stl lies in outer.stl.", "lies at (0, 0, 0) mm.", " at 0\u{a0}mm</figcaption>"] {
        assert!(page.contains(text), "no {text}");
    }
    folder.run(&["clash", "outer.stl", "far.stl", "--unit", "mm", "-o", "clean"]).code(0);
    let page = read(&folder.path("clean/clash.html"));
    assert!(page.contains("No two parts are near one another.") && !page.contains("Near pairs"));
}

#[test]
fn verbose_text_has_the_pairs_that_break_no_rule() {
    let folder = with_parts();
    let near = ["clash", "a.stl", "near.stl", "-v", "--touching", "0.26", "--allow-touching"];
    let run = folder.run(&near).code(0);
    assert!(run.stderr().contains("touching, 0.25 apart") && run.stderr().contains("time "), "{}", run.stderr());
    assert!(!run.stdout().contains("apart"), "{}", run.stdout());
}

#[test]
fn overlaps_without_an_exact_volume_are_sampled_as_asked() {
    let folder = Folder::new();
    folder.stl("a.stl", &without_exact_volume());
    folder.stl("b.stl", &cuboid([-1.0, -1.0, -0.25], [1.2, 1.2, 1.1]));
    let files = ["a.stl", "b.stl", "--unit", "mm"];
    let intersect = ["intersect", "--estimate", "--resolution", "600"];
    let known = folder.json(&[&intersect[..], &files].concat())["volume"]["value"].as_f64().unwrap();
    let volume = |flags: &[&str]| {
        let run = folder.run(&[&["clash", "--json", "-"], &files[..], flags].concat()).code(1);
        let volume = run.json()["pairs"][0]["overlap"]["volume"].clone();
        assert_eq!(volume["method"], "estimate", "{volume}");
        volume
    };
    let plain = volume(&[]);
    let [lower, value, upper] = ["lower", "value", "upper"].map(|key| plain[key].as_f64().unwrap());
    assert!(lower <= known + 1e-3 && known <= upper + 1e-3, "{known} in {plain}");
    assert_near(value, known, 0.05 * known);
    assert_eq!(volume(&["--resolution", "128"]), plain);
    assert_ne!(volume(&["--resolution", "40"]), plain);
    // The raster lies around both parts, as that of `intersect` does.
    let of_intersect = |flags: &[&str]| folder.json(&[&["intersect", "--estimate"], &files[..], flags].concat());
    for flags in [["--pitch", "0.02"], ["--pitch", "0.002cm"], ["--tolerance", "0.05%"]] {
        let (found, known) = (volume(&flags), &of_intersect(&flags)["volume"]);
        assert_eq!(found["value"], known["value"], "{flags:?}");
        let [lower, upper] = ["lower", "upper"].map(|key| found[key].as_f64().unwrap());
        assert_near(upper - lower, 2.0 * known["estimate_error"].as_f64().unwrap(), 1e-12);
    }
    assert_eq!(volume(&["--backend", "cpu"]), plain);
    let clash = |flags: &[&str]| folder.run(&[&["clash"], &files[..], flags].concat());
    clash(&["--backend", "cpu", "--adapter", "card"]).code(2).says(&["--adapter card", "--backend cpu"]);
    clash(&["--adapter", "no such card"]).code(3).says(&[]);
    // No ray meets a thin rod, which certainly overlaps.
    folder.stl("rod.stl", &cuboid([0.9, 0.9, -50.0], [0.91, 0.91, 50.0]));
    let run = folder.run(&["clash", "a.stl", "rod.stl", "--unit", "mm", "--json", "-"]).code(1);
    let pair = &run.json()["pairs"][0];
    assert_eq!((&pair["finding"], &pair["overlap"]["certain"]), (&"overlap".into(), &true.into()), "{pair}");
    let [lower, value, upper] = ["lower", "value", "upper"].map(|key| pair["overlap"]["volume"][key].as_f64().unwrap());
    assert_eq!([lower, value], [0.0; 2]);
    // The box around the overlap.
    assert_near(upper, 0.01 * 0.01 * 0.275, 1e-12);
    assert!(warning_codes(&run.json()).contains(&"not-resolved"));
    run.warns(&["a.stl and rod.stl: no ray meets the result at a pitch of", "at most 2.75e-5"]);
    let text = folder.run(&["clash", "a.stl", "rod.stl", "--unit", "mm"]).stdout();
    assert!(text.contains(" 0 ± 2.8e-5 mm³, 0.01 mm deep"), "{text}");
    // A few rays leave a volume of which the error is a large share.
    let coarse = folder.run(&[&["clash"], &files[..], &["--pitch", "0.5", "--json", "-"]].concat()).code(1);
    assert!(warning_codes(&coarse.json()).contains(&"imprecise"));
    coarse.warns(&["a.stl and b.stl: the volume may be off by", "; lower --pitch or set --tolerance"]);

    let rod = ["clash", "a.stl", "rod.stl", "--unit", "mm"];
    let found = folder.run(&[&rod[..], &["--tolerance", "1%", "--json", "-"]].concat()).code(1).json();
    let warning = found["warnings"].as_array().unwrap().iter().find(|w| w["code"] == "tolerance-not-reached").unwrap();
    assert!(
        warning["message"].as_str().unwrap().starts_with("a.stl and rod.stl: --tolerance 1 %: not reached"),
        "{warning}"
    );
    // Images that do not fit name the pair, and a pitch that does.
    let fine = |pitch: &str| {
        let flags = ["--pitch", pitch, "--memory", "100M"];
        folder.run(&[&["clash"], &files[..], &flags].concat())
    };
    let refused = fine("0.0003").code(3).says(&["a.stl and b.stl: the images of", "--memory allows 100 MB; --pitch "]);
    let refusal = refused.stderr();
    let proposed = refusal.split("; --pitch ").nth(1).and_then(|rest| rest.split(',').next()).unwrap();
    assert!((0.0003..0.01).contains(&proposed.parse::<f64>().unwrap()), "{refusal}");
    fine(proposed).code(1);
    folder.run(&[&rod[..], &["--pitch", "1e-9"]].concat()).code(2).says(&["a.stl, rod.stl", "the least --pitch is"]);
    folder.run(&[&rod[..], &["--pitch", "0"]].concat()).code(2).says(&["--pitch 0 is not a positive length"]);
    folder.run(&[&rod[..], &["--pitch", "1", "--tolerance", "1%"]].concat()).code(2).says(&["cannot be used with"]);
    // Several such pairs are sampled one after another, and found as each alone is.
    folder.stl("c.stl", &cuboid([0.5, 0.5, -0.25], [1.5, 1.5, 1.1]));
    let three = ["clash", "a.stl", "b.stl", "c.stl", "--unit", "mm", "--threads", "2", "--json", "-"];
    let overlaps = |flags: &[&str]| {
        let pairs = folder.run(&[&three[..], flags].concat()).code(1).json()["pairs"].as_array().unwrap().clone();
        let is_of_a = |pair: &&serde_json::Value| pair["a"] == "a.stl";
        let volume_of = |pair: &serde_json::Value| (pair["b"].to_string(), pair["overlap"]["volume"].clone());
        pairs.iter().filter(is_of_a).map(volume_of).collect::<BTreeMap<_, _>>()
    };
    for flags in [["--pitch", "0.02"], ["--tolerance", "0.05%"], ["--resolution", "300"]] {
        let of_a_and_c =
            folder.run(&[&["clash", "a.stl", "c.stl", "--unit", "mm", "--json", "-"], &flags[..]].concat());
        let of_a_and_c = of_a_and_c.code(1).json()["pairs"][0]["overlap"]["volume"].clone();
        let alone = [("b.stl", volume(&flags)), ("c.stl", of_a_and_c)];
        assert_eq!(overlaps(&flags), alone.map(|(name, volume)| (format!("\"{name}\""), volume)).into(), "{flags:?}");
    }
    folder.run(&["clash", "a.stl", "rod.stl", "--pitch", "1mm"]).code(2).says(&["--pitch 1mm", "states no unit"]);
}

/// Products of six lengths must be numbers.
#[test]
fn parts_of_sizes_for_which_no_distance_is_right_are_refused() {
    let folder = Folder::with_two_cubes();
    for (side, name) in [("1e-50", "other.off"), ("1e50", "all 2 parts")] {
        let corners = format!("0 0 0\n{side} 0 0\n0 {side} 0\n0 0 {side}\n");
        let text = format!("OFF\n4 4 0\n{corners}3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
        fs::write(folder.path("other.off"), text).unwrap();
        let run = folder.run(&["clash", "a.stl", "other.off", "--unit", "mm"]).code(2);
        run.says(&[name, side, "from 1e-45 to 1e45"]);
    }
}
