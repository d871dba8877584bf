//! Tests of `--bounds`, `--assert-below` and `--assert-above`: text, JSON, exit codes and refusals.

use serde_json::Value;

use crate::{Folder, cube, cuboid, one_sided};

/// Creates a folder with the cubes a and b of side 2, which share one of side 1.
fn folder() -> Folder {
    let folder = Folder::with_two_cubes();
    folder.stl("small.stl", &cube(0.0, 0.5));
    folder
}

fn bounds(result: &Value) -> [f64; 2] {
    ["lower", "upper"].map(|key| result["volume"][key].as_f64().unwrap_or_else(|| panic!("no {key}: {result}")))
}

#[test]
fn bounds_contain_the_volume_in_every_command() {
    let folder = folder();
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.5f64.powi(3);
    let grown = 8.0 + 24.0 * 0.5 + std::f64::consts::PI * 0.25 * 6.0 + ball;
    let cases: [(&[&str], f64, f64); 9] = [
        (&["intersect", "a.stl", "b.stl"], 1.0, 1e-3),
        (&["union", "a.stl", "b.stl"], 15.0, 1e-3),
        (&["difference", "a.stl", "b.stl"], 7.0, 1e-3),
        (&["xor", "a.stl", "b.stl"], 14.0, 1e-3),
        (&["csg", "a & b | c", "a=a.stl", "b=b.stl", "c=small.stl"], 1.125, 1e-3),
        (&["volume", "a.stl"], 8.0, 1e-3),
        (&["minkowski", "a.stl", "small.stl"], 2.5f64.powi(3), 0.4),
        (&["minkowski", "a.stl", "small.stl", "--difference"], 1.5f64.powi(3), 0.8),
        (&["offset", "a.stl", "--distance", "0.5"], grown, 0.1),
    ];
    // Certified by cells, and from the exact value; sums and offsets have no exact value.
    let by_cells = cases[..6].iter().map(|&(arguments, volume, share)| (arguments, &["--estimate"][..], volume, share));
    let default = cases.iter().map(|&(arguments, volume, share)| (arguments, &[][..], volume, share));
    for (arguments, more, volume, share) in by_cells.chain(default) {
        let flags = [&["--bounds", "--resolution", "64", "--unit", "mm"], more].concat();
        let result = folder.json(&[arguments, &flags].concat());
        let [lower, upper] = bounds(&result);
        assert!(lower <= volume && volume <= upper, "{arguments:?}: {volume} is not in {lower} to {upper}");
        assert!(upper - lower <= share * volume, "{arguments:?}: {lower} to {upper}");
        assert!(result["volume"].get("assertions").is_none());
    }
}

#[test]
fn text_has_a_line_of_bounds_that_are_rounded_outwards() {
    let folder = folder();
    let run = folder.run(&["offset", "a.stl", "--distance", "0.5", "--resolution", "32", "--bounds", "--unit", "mm"]);
    let text = run.code(0).stdout();
    let line = text.lines().find(|line| line.starts_with("bounds ")).unwrap_or_else(|| panic!("{text}"));
    assert!(line.ends_with(" mm³ (certified)"), "{line}");
    let numbers: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    let json = folder.json(&["offset", "a.stl", "--distance", "0.5", "--resolution", "32", "--bounds", "--unit", "mm"]);
    let [lower, upper] = bounds(&json);
    assert!(numbers[0] <= lower && upper <= numbers[1], "{line} {lower} {upper}");
}

#[test]
fn assertions_have_verdicts_and_exit_codes() {
    let folder = folder();
    let offset = ["offset", "a.stl", "--distance", "0.5", "--resolution", "16", "--unit", "mm"];
    let known = 25.236;
    for (flags, verdicts, code) in [
        (&["--assert-below", "40"][..], &["certainly"][..], 0),
        (&["--assert-above", "10mm3"], &["certainly"], 0),
        (&["--assert-above", "0.01ml"], &["certainly"], 0),
        (&["--assert-below", "10 mm³"], &["certainly not"], 1),
        (&["--assert-above", "40"], &["certainly not"], 1),
        (&["--assert-below", "25.236"], &["not decided at this pitch"], 1),
        (&["--assert-below", "40", "--assert-above", "10"], &["certainly", "certainly"], 0),
        (&["--assert-below", "40", "--assert-above", "25.236"], &["certainly", "not decided at this pitch"], 1),
    ] {
        let arguments = [&offset[..], flags].concat();
        let text = folder.run(&arguments).code(code).stdout();
        for verdict in verdicts {
            assert!(
                text.lines().any(|line| line.starts_with("assert ") && line.ends_with(&format!(": {verdict}"))),
                "{text}"
            );
        }
        let result = folder.run(&[&arguments[..], &["--json", "-"]].concat()).code(code).json();
        let assertions = result["volume"]["assertions"].as_array().unwrap();
        let found: Vec<&str> = assertions.iter().map(|assertion| assertion["verdict"].as_str().unwrap()).collect();
        assert_eq!(found, verdicts, "{flags:?}");
        let [lower, upper] = bounds(&result);
        assert!(lower < known && known < upper);
        let kinds: Vec<String> =
            assertions.iter().map(|assertion| format!("--assert-{}", assertion["kind"].as_str().unwrap())).collect();
        assert_eq!(kinds, flags.iter().step_by(2).copied().collect::<Vec<_>>());
    }
    // A finer pitch does not decide about an exact volume.
    let exact = ["volume", "a.stl", "--assert-above", "8"];
    let text = folder.run(&exact).code(1).stdout();
    assert!(text.lines().any(|line| line == "assert      above 8: not decided within rounding"), "{text}");
    let result = folder.run(&[&exact[..], &["--json", "-"]].concat()).code(1).json();
    assert_eq!(result["volume"]["assertions"][0]["verdict"], "not decided within rounding");
    let result = folder.run(&["volume", "a.stl", "--assert-below", "8.1", "--json", "-"]).code(0).json();
    assert_eq!(
        result["volume"]["assertions"][0],
        serde_json::json!({"kind": "below", "value": 8.1, "verdict": "certainly"})
    );
}

#[test]
fn each_of_several_volumes_is_asserted() {
    let folder = folder();
    let run = folder.run(&["volume", "a.stl", "small.stl", "--assert-above", "1", "--unit", "mm"]).code(1);
    let text = run.stdout();
    let verdicts: Vec<&str> = text.lines().filter(|line| line.starts_with("assert ")).collect();
    assert!(verdicts[0].ends_with(": certainly") && verdicts[1].ends_with(": certainly not"), "{text}");
}

#[test]
fn a_tolerance_narrows_the_bounds() {
    let folder = folder();
    let turn = "translate(-1,-1,-1) rotate(1,2,3,40) translate(1,1,1)";
    for (tolerance, share) in [("5%", 0.05), ("0.1%", 0.001)] {
        let flags =
            ["union", "a.stl", "b.stl", "--estimate", "--transform-b", turn, "--tolerance", tolerance, "--bounds"];
        let [lower, upper] = bounds(&folder.json(&flags));
        assert!(upper - lower <= share * upper, "{tolerance}: {lower} to {upper}");
    }
}

#[test]
fn overlapping_shells_have_bounds_under_both_rules() {
    let folder = Folder::new();
    folder.stl("two.stl", &[cube(0.0, 2.0), cuboid([1.0; 3], [3.0, 3.0, 2.5])].concat());
    for (fill, volume) in [("nonzero", 8.0 + 6.0 - 1.0), ("even-odd", 8.0 + 6.0 - 2.0)] {
        let [lower, upper] = bounds(&folder.json(&[
            "volume",
            "two.stl",
            "--estimate",
            "--fill",
            fill,
            "--bounds",
            "--resolution",
            "60",
        ]));
        assert!(lower <= volume && volume <= upper && upper - lower < 0.05, "{fill}: {lower} to {upper}");
    }
}

#[test]
fn what_cannot_be_certified_is_refused() {
    let folder = folder();
    let mut open = cube(0.0, 1.0);
    open.pop();
    folder.stl("open.stl", &open);
    folder.run(&["volume", "open.stl", "--allow-open", "--bounds"]).code(2).says(&[
        "open.stl",
        "not closed",
        "--bounds",
    ]);
    folder.run(&["close", "a.stl", "--radius", "0.1", "--bounds"]).code(2).says(&["close", "cannot be certified"]);
    folder
        .run(&["open", "a.stl", "--radius", "0.1", "--assert-below", "9"])
        .code(2)
        .says(&["open", "cannot be certified"]);
    folder.stl("two.stl", &[cube(0.0, 2.0), cube(1.0, 2.0)].concat());
    let overlapping = ["offset", "two.stl", "--distance", "0.1", "--fill", "nonzero", "--resolution", "16", "--bounds"];
    folder.run(&overlapping).code(2).says(&["two.stl", "cannot be certified"]);
    folder.run(&["volume", "a.stl", "--assert-below", "1ml"]).code(2).says(&["--assert-below 1ml", "states no unit"]);
    folder.run(&["volume", "a.stl", "--assert-below", "much"]).code(2).says(&["a volume is a number"]);
    folder.stl("one-sided.stl", &one_sided());
    let run = folder.run(&["volume", "one-sided.stl", "--bounds"]).code(2);
    run.says(&["one-sided.stl", "not consistently oriented"]);
}
