//! The JSON of results: every key of the schema, in every command that has it.

use crate::{Folder, cube, read, warning_codes};

const KEYS: [&str; 16] = [
    "schema",
    "command",
    "inputs",
    "volume",
    "grid",
    "layers_max",
    "samples",
    "unclosed_rays",
    "backend",
    "device",
    "mode",
    "fill",
    "seconds",
    "peak_memory_bytes",
    "warnings",
    "volume",
];

fn keys(value: &serde_json::Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

#[test]
fn results_have_every_key_of_the_schema() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("b.stl", &cube(1.0, 2.0));
    for command in ["intersect", "union", "difference", "xor", "volume"] {
        let files: &[&str] = if command == "volume" { &["a.stl"] } else { &["a.stl", "b.stl"] };
        let arguments = [&[command], files, &["--estimate", "--resolution", "64", "--unit", "mm"]].concat();
        let result = folder.json(&arguments);
        for key in KEYS {
            assert!(result.get(key).is_some(), "{command} has no {key}");
        }
        assert_eq!(result["schema"], "ldi-ops/1");
        assert_eq!(result["command"], command);
        assert_eq!(result["inputs"].as_array().unwrap().len(), files.len());
        assert_eq!(keys(&result["inputs"][0]), ["path", "sha256", "triangles", "closed", "oriented", "volume"]);
        const VOLUME: [&str; 11] = [
            "value",
            "estimate_error",
            "method",
            "exact",
            "exact_error",
            "not_exact",
            "rays",
            "at_least",
            "at_most",
            "lower",
            "upper",
        ];
        assert_eq!(keys(&result["volume"]), [&VOLUME[..], &["unit"]].concat());
        assert_eq!(result["volume"]["method"], "estimate");
        assert_eq!(keys(&result["grid"]), ["pitch", "rays", "lod", "quantisation"]);
        assert_eq!(keys(&result["seconds"]), ["read", "sample", "operate", "integrate", "write", "total"]);
        assert!(result["volume"]["lower"].is_null() && result["volume"]["upper"].is_null());
        assert_eq!(result["volume"]["unit"], "mm^3");
        assert_eq!(
            (&result["backend"], &result["mode"], &result["fill"]),
            (&"cpu".into(), &"exact".into(), &"even-odd".into())
        );
        assert_eq!(keys(&result["auto"]), ["backend", "reason"]);
        assert_eq!(result["auto"]["backend"], "cpu");
        assert!(result["samples"].as_u64().unwrap() > 0);
        assert_eq!(result["unclosed_rays"], 0);
        assert_eq!(result["warnings"].as_array().unwrap().len(), 0);
        let input = &result["inputs"][0];
        assert_eq!(
            (&input["path"], &input["triangles"], &input["closed"], &input["oriented"], &input["volume"]),
            (&"a.stl".into(), &12.into(), &true.into(), &true.into(), &8.0.into())
        );
        let seconds = result["seconds"].as_object().unwrap();
        assert!(seconds.values().all(|s| s.as_f64().unwrap() >= 0.0));
        for key in ["area", "centroid", "inertia"] {
            assert_eq!(result.get(key).is_some(), command == "volume");
        }
    }
}

#[test]
fn results_of_volume_have_the_same_keys_for_one_solid_and_several() {
    let folder = Folder::with_two_cubes();
    let of = |files: &[&str]| folder.json(&[&["volume"], files, &["--resolution", "32"]].concat());
    let (one, two) = (of(&["a.stl"]), of(&["a.stl", "b.stl"]));
    for (result, count) in [(&one, 1), (&two, 2)] {
        assert_eq!((&result["schema"], &result["command"]), (&"ldi-ops/1".into(), &"volume".into()));
        assert_eq!(result["inputs"].as_array().unwrap().len(), count);
        assert_eq!(result["results"].as_array().unwrap().len(), count);
        assert_eq!(warning_codes(result), vec!["unit-assumed"; count]);
        for each in result["results"].as_array().unwrap() {
            assert_eq!(each["command"], "volume");
            for key in KEYS.iter().chain(&["area", "centroid", "inertia"]) {
                assert!(each.get(key).is_some(), "no {key}");
            }
        }
    }
    // The keys of a single result stand at the top level as well.
    for key in keys(&one["results"][0]) {
        assert_eq!(one[key], one["results"][0][key], "{key}");
    }
    assert!(two.get("volume").is_none());
    let checked = folder.json(&["check", "a.stl"]);
    assert_eq!(keys(&checked), ["schema", "command", "inputs", "results", "warnings"]);
}

#[test]
fn errors_are_written_as_json() {
    let folder = Folder::with_two_cubes();
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    for (arguments, command, kind, code) in [
        (&["volume", "open.stl"][..], "volume", "input", 2),
        (&["intersect", "a.stl", "open.stl"], "intersect", "input", 2),
        (&["subtract", "a.stl", "missing.stl"], "difference", "input", 2),
        (&["check", "missing.stl"], "check", "input", 2),
        (&["volume", "a.stl", "--pitch", "-1"], "volume", "usage", 2),
        (&["volume", "a.stl", "--nonsense"], "volume", "usage", 2),
        (&["volume", "a.stl", "--estimate", "--resolution", "65535"], "volume", "machine", 3),
    ] {
        for json in [&["--json", "-"][..], &["--json=-"], &["--json", "e.json"]] {
            let run = folder.run(&[arguments, json].concat()).code(code);
            let object = if json[json.len() - 1] == "e.json" {
                assert_eq!(run.stdout(), "");
                serde_json::from_str(&read(&folder.path("e.json"))).unwrap()
            } else {
                run.json()
            };
            let error = &object["error"];
            assert_eq!((&object["schema"], &object["command"]), (&"ldi-ops/1".into(), &command.into()));
            assert_eq!((&error["kind"], &error["exit_code"]), (&kind.into(), &code.into()), "{object}");
            let message = error["message"].as_str().unwrap();
            assert!(run.stderr().contains(&format!("ldi-ops: error: {message}")), "{message}\n{}", run.stderr());
            assert_eq!(object["warnings"], serde_json::json!([]));
        }
    }
    let run = folder.run(&["frobnicate", "--json", "-"]).code(2);
    assert!(run.json()["command"].is_null());
    // The error does not overwrite an input.
    let before = read(&folder.path("a.stl"));
    folder.run(&["volume", "a.stl", "--nonsense", "--json", "a.stl"]).code(2);
    folder.run(&["intersect", "open.stl", "a.stl", "--json=./a.stl"]).code(2);
    assert_eq!(read(&folder.path("a.stl")), before);
}

#[test]
fn hashes_equal_the_sha256_of_the_inputs() {
    let folder = Folder::new();
    std::fs::write(
        folder.path("a.off"),
        "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
    )
    .unwrap();
    let result = folder.json(&["volume", "a.off", "--resolution", "16"]);
    // printf 'OFF\n…' | sha256sum
    assert_eq!(result["inputs"][0]["sha256"], "4f072cbdf9dc3283c7cee43490b2016f40ce22a1d5c35b1c59019d8ced4bd58e");
}

#[test]
fn axes_that_were_not_sampled_have_no_layers() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let layers = |axis| {
        folder.json(&["volume", "a.stl", "--estimate", "--resolution", "8", "--axis", axis])["layers_max"].to_string()
    };
    assert_eq!(layers("all"), "[2,2,2]");
    assert_eq!(layers("y"), "[null,2,null]");
}

#[test]
fn json_goes_to_a_file_and_the_text_to_stdout() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let run = folder.run(&["volume", "a.stl", "--resolution", "8", "--json", "a.json"]).code(0);
    assert!(run.stdout().starts_with("volume"), "{}", run.stdout());
    let json: serde_json::Value = serde_json::from_str(&read(&folder.path("a.json"))).unwrap();
    assert_eq!(json["command"], "volume");
    assert_eq!(folder.names(), ["a.json", "a.stl"]);
}

#[test]
fn empty_solids_have_null_centroid_and_inertia() {
    let folder = Folder::new();
    // The sheet is folded on itself: it is closed and encloses nothing.
    let [a, b, c] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [0.0, 1.0, 0.5]];
    folder.stl("a.stl", &[[a, b, c], [a, c, b]]);
    let result = folder.json(&["volume", "a.stl", "--fill", "nonzero", "--mode", "exact", "--resolution", "16"]);
    assert_eq!(result["volume"]["value"], 0.0);
    assert!(result["centroid"][0].is_null() && result["inertia"][1][2].is_null());
    assert!(warning_codes(&result).contains(&"not-finite"));
}

#[test]
fn check_convert_generate_and_devices_write_json() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let result = folder.json(&["check", "a.stl"]);
    assert_eq!(result["results"][0]["solid"], true);
    assert_eq!(result["results"][0]["defects"], serde_json::json!([]));
    let result = folder.json(&["convert", "a.stl", "-o", "a.obj"]);
    assert_eq!(result["output"]["triangles"], 12);
    let result = folder.json(&["generate", "cuboid", "-o", "c.obj"]);
    assert_eq!((&result["volume"], &result["output"]["unit"]), (&8000.0.into(), &"mm".into()));
    let result = folder.json(&["devices"]);
    assert_eq!(keys(&result["auto"]), ["backend", "reason"]);
    assert_eq!(result["devices"][0]["backend"], "cpu");
}
