//! Runs the program on the nasty files of a corpus, in a folder named by `LDI_CORPUS`. Each file gives a right answer, with a
//! warning where the mesh is odd, or a refusal that names the place; never a panic, a signal, a run of a minute or 2 GiB.
//!
//! Every file has a line in [`FILES`] that a person has reviewed.

#[path = "../corpus/manifest.rs"]
mod manifest;

use std::process::Output;
use std::time::{Duration, Instant};

use assert_cmd::Command;
use serde_json::Value;

use crate::Folder;

/// The expected result for a file.
#[derive(Clone, Copy)]
enum Expected {
    /// Exit code 0, and the volume within a share of this one or twice the printed estimate.
    Volume { even_odd: f64, non_zero: NonZero, warnings: &'static [&'static str] },
    /// Exit code 2 by either rule, with these words on stderr.
    Refused(&'static [&'static str]),
}

/// The expected result with `--fill nonzero`.
#[derive(Clone, Copy)]
enum NonZero {
    /// The same volume: no shells overlap.
    Same,
    /// Another volume, since the rule unites overlaps.
    Volume(f64),
    /// A refusal, as the triangles are not consistently oriented.
    NotOriented,
}

use Expected::{Refused, Volume};

/// The relative error up to which a volume is right, whatever the estimate says.
const SHARE: f64 = 1e-3;

const TIME: Duration = Duration::from_secs(60);
const MEMORY_KIB: u64 = 2 << 20;

const fn same(volume: f64, warnings: &'static [&'static str]) -> Expected {
    Volume { even_odd: volume, non_zero: NonZero::Same, warnings }
}

const fn overlapping(even_odd: f64, non_zero: f64, warnings: &'static [&'static str]) -> Expected {
    Volume { even_odd, non_zero: NonZero::Volume(non_zero), warnings }
}

const fn not_oriented(volume: f64, warnings: &'static [&'static str]) -> Expected {
    Volume { even_odd: volume, non_zero: NonZero::NotOriented, warnings }
}

/// Every nasty file by name. The volume is that of the mesh itself where no shells overlap and the triangles agree on what is
/// outside; elsewhere that of a raster eight times as fine, along all axes.
const FILES: &[(&str, Expected)] = &[
    ("20mmbox-CR.stl", same(8000.0, &[])),
    ("20mmbox-nonstandard.stl", same(8000.0, &[])),
    ("2CylinderEngine.glb", Refused(&["13308 edges are open", "of triangle"])),
    ("5cm_BCC-2.5mm.stl", same(1670.9081359842246, &[])),
    ("BoxWithInfinites.glb", Refused(&["24 positions are not finite", "position 0", "inf"])),
    ("COURT2018VNS.ply", same(4902976.4670988545, &["inside-out"])),
    ("Cray_left.obj", same(1956864649950.981, &[])),
    ("Cray_right.obj", same(1.5760799710533451e116, &[])),
    ("FLYWIRE_whole_brain.ply", same(2.7837581710287556e16, &[])),
    // Sheets of 1 and 2 units at a pitch of 15, whose triangles touch.
    ("Generic_Twin_7081_left.obj", same(101590.8775582339, &[])),
    ("Generic_Twin_7081_right.obj", same(43004.36805158224, &[])),
    ("IndexOutOfRange.gltf", Refused(&["accessor 0", "vertex 255 is out of range"])),
    ("Offset1.obj", same(1614716.5045550906, &[])),
    ("OutOfMemory.off", Refused(&["line 2", "353535235358 vertices declared"])),
    ("P_XPM_0331_01.3mf", same(166666.66666666666, &[])),
    ("adns2610_dev_circuit_inv.stl", same(1059.0719759658523, &[])),
    ("ah_lattice.stl", Refused(&["192 edges are open", "of triangle 16"])),
    ("blobby-shuffled.off", not_oriented(0.05008248, &["not-oriented"])),
    ("boeing.off", not_oriented(210.56931, &["not-oriented"])),
    ("bones.off", overlapping(18.53530, 18.59771, &["fill-rules-differ"])),
    ("box_UTF16BE.obj", same(1.0, &["polygons-triangulated"])),
    ("bunny_open.ply", Refused(&["123 edges are open", "of triangle 39"])),
    ("cow.off", same(0.053479926671566085, &[])),
    ("cube_gears.3mf", same(112366.33164558854, &["objects-merged"])),
    ("degtri_sliding.off", Refused(&["6 edges are open", "of triangle 0"])),
    ("dog_jaw.stl", same(6.209275638011382e-5, &[])),
    ("dragon_vrip_res3.ply", same(0.0004761543576582822, &[])),
    ("ellipe0.003.off", same(1.4740223021516563, &["inside-out"])),
    ("empty.ply", Refused(&["no triangles"])),
    ("empty0.stl", Refused(&["no bytes"])),
    (
        "extruder_idler_quads.obj",
        overlapping(5349.922, 5359.178, &["polygons-triangulated", "polygons-not-simple", "fill-rules-differ"]),
    ),
    ("featuretype.STL", Refused(&["576 edges are open", "of triangle 542"])),
    ("frog_legs.obj", Refused(&["12 edges are open", "of triangle 6434"])),
    ("heartgears.3mf", same(120179.29753396341, &[])),
    ("igea.ply", same(0.00027852446, &[])),
    ("import_bin_solid.stl", same(2.871073697883142, &[])),
    ("invalid.off", Refused(&["line 8", "vertex 20 is out of range"])),
    ("invalidvertex.stl", Refused(&["line 89", "`blah` is not a number"])),
    ("issue1580-back-to-back.stl", same(10.666666666666666, &[])),
    ("issue1580-zero-area-triangle.stl", same(1000.0, &[])),
    ("joined_tetrahedra.obj", same(0.8660254, &["objects-merged"])),
    ("malformed.obj", Refused(&["line 28", "vertex 0 is out of range"])),
    ("multibody.stl", not_oriented(0.0074232205, &["solids-merged", "not-oriented"])),
    ("negative_indices.obj", same(8.0, &["polygons-triangulated"])),
    ("openscad-nonmanifold-crash.obj", overlapping(348.964, 389.517, &["fill-rules-differ"])),
    ("polygonfaces.obj", Refused(&["5 edges are open", "of triangle 0"])),
    ("pond.0.ply", Refused(&["70051 elements `vertex` declared", "70048"])),
    // A sliver of 1.5e-8 of its box, far below a pixel, whose triangles do not touch: the volume is exact.
    ("rounding.glb", same(8.029641044085545e-8, &[])),
    ("seam_test_object.3mf", same(15550.53099740922, &[])),
    ("self_intersectA.obj", overlapping(0.13737112, 0.14266238, &["fill-rules-differ"])),
    ("self_intersectB.obj", overlapping(0.13737317, 0.14266454, &["fill-rules-differ"])),
    ("soup.stl", Refused(&["300 edges are open", "of triangle 0"])),
    ("stl_empty_ascii.stl", Refused(&["no facet"])),
    ("stl_empty_bin.stl", Refused(&["no triangles", "counts 0"])),
    ("suzanne.obj", Refused(&["42 edges are open", "of triangle 4"])),
    ("teapot.stl", Refused(&["64 edges are open", "of triangle 1"])),
    ("toomanyvertices.stl", Refused(&["line 92", "facet 12"])),
    ("unparseable.stl", Refused(&["line 4", "is not a number"])),
];

/// Runs `ldi-ops volume` on a file within the limits.
fn volume(path: &std::path::Path, fill: &str) -> (Output, Duration) {
    let start = Instant::now();
    // The limit is on the address space, which every system can limit; the memory in use stays below it.
    let script = format!("ulimit -v {MEMORY_KIB} && exec \"$0\" \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &script])
        .arg(assert_cmd::cargo::cargo_bin!("ldi-ops"))
        .arg("volume")
        .arg(path)
        .args(["--axis", "all", "--resolution", "512", "--threads", "2", "--json", "-", "--fill", fill])
        .timeout(2 * TIME)
        .output()
        .unwrap();
    (output, start.elapsed())
}

/// Compares an answer with the expected result; returns the difference, or `None`.
fn fault(output: &Output, volume: f64, warnings: &[&str]) -> Option<String> {
    let stderr = String::from_utf8_lossy(&output.stderr);
    if output.status.code() != Some(0) {
        return Some(format!("{}: {stderr}", output.status));
    }
    let result: Value = match serde_json::from_slice(&output.stdout) {
        Ok(result) => result,
        Err(error) => return Some(format!("stdout is no JSON: {error}")),
    };
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let (value, estimate) = (number(&result["volume"]["value"]), number(&result["volume"]["estimate_error"]));
    let off = (value - volume).abs();
    let is_right = value >= 0.0 && (off <= SHARE * volume || off <= 2.0 * estimate);
    if !is_right {
        return Some(format!("{value} ± {estimate} is not {volume}"));
    }
    let memory = number(&result["peak_memory_bytes"]);
    if !(memory > 0.0 && memory <= (MEMORY_KIB * 1024) as f64) {
        return Some(format!("{memory} bytes"));
    }
    if result["unclosed_rays"] != 0 {
        return Some(format!("{} unclosed rays", result["unclosed_rays"]));
    }
    // The warning about the missing unit does not concern the mesh.
    let mut codes = crate::warning_codes(&result);
    codes.retain(|code| *code != "unit-assumed");
    if codes != warnings {
        return Some(format!("warnings {codes:?} instead of {warnings:?}"));
    }
    codes.iter().find(|_| !stderr.contains("ldi-ops: warning: ")).map(|code| format!("{code} is not said on stderr"))
}

/// Checks a refusal; returns what is wrong with it, or `None`.
fn refusal_fault(output: &Output, file: &str, words: &[&str]) -> Option<String> {
    let stderr = String::from_utf8_lossy(&output.stderr);
    if output.status.code() != Some(2) {
        return Some(format!("{} instead of a refusal", output.status));
    }
    match serde_json::from_slice::<Value>(&output.stdout) {
        Ok(object) if object["error"]["exit_code"] == 2 && object.get("volume").is_none() => {}
        _ => return Some("a refusal has an error in its JSON, and no result".to_owned()),
    }
    let said = ["ldi-ops: error: ", file].into_iter().chain(words.iter().copied());
    said.into_iter().find(|word| !stderr.contains(*word)).map(|word| format!("no `{word}` in: {stderr}"))
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn nasty_files_give_the_listed_answer_or_refusal() {
    let mut wrong = Vec::new();
    let mut nasty = manifest::entries();
    nasty.retain(|entry| entry.class == "nasty");
    for entry in &nasty {
        let Some((name, expected)) = FILES.iter().find(|(name, _)| *name == entry.name) else {
            wrong.push(format!("{}: nobody has judged this file yet", entry.name));
            continue;
        };
        for fill in ["even-odd", "nonzero"] {
            let (output, elapsed) = volume(&entry.path, fill);
            let fault = match *expected {
                Refused(words) => refusal_fault(&output, name, words),
                Volume { even_odd, non_zero, warnings } => match (fill, non_zero) {
                    ("even-odd", _) | (_, NonZero::Same) => fault(&output, even_odd, warnings),
                    (_, NonZero::Volume(volume)) => fault(&output, volume, warnings),
                    (_, NonZero::NotOriented) => refusal_fault(&output, name, &["--fill nonzero", "opposite ways"]),
                },
            };
            wrong.extend(fault.map(|fault| format!("{name}, {fill}: {fault}")));
            if elapsed > TIME {
                wrong.push(format!("{name}, {fill}: took {elapsed:?}"));
            }
        }
    }
    let missing = FILES.iter().filter(|(name, _)| nasty.iter().all(|entry| entry.name != *name));
    wrong.extend(missing.map(|(name, _)| format!("{name}: not in the corpus")));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A mesh of thousands of small parts, of which one was inside out.
#[test]
#[ignore = "needs LDI_CORPUS"]
fn a_bone_shaped_scaffold_passes_the_check() {
    let bone = manifest::entries().into_iter().find(|entry| entry.name == "human_metacarpal2.stl").unwrap();
    let bone = bone.path.canonicalize().unwrap();
    let folder = Folder::new();
    let scaffold = ["generate", "gyroid", "--cells", "12,34,11", "--cell-size", "2", "--wall", "0.4"];
    folder.run(&[&scaffold[..], &["--resolution", "10", "-o", "g.stl"]].concat()).code(0);
    let bone = ["intersect", "g.stl", bone.to_str().unwrap(), "--transform-b", "scale(1000)", "--unit", "mm"];
    for method in ["sampled", "exact"] {
        let made = folder.json(&[&bone[..], &["--mesh", method, "-o", "out.stl"]].concat());
        let crossing = &made["surface"]["crossing_pairs"];
        assert!(*crossing == if method == "sampled" { Value::from(0) } else { Value::Null }, "{crossing}");
        let found = &folder.json(&["check", "out.stl"])["results"][0];
        assert!(found["solid"] == true && found["defects"] == Value::Array(vec![]), "{method}: {found:#}");
    }
}

#[cfg(unix)]
#[test]
fn wrong_answers_and_refusals_are_rejected() {
    use std::os::unix::process::ExitStatusExt;
    use std::process::ExitStatus;
    let output = |code: i32, stdout: &str, stderr: &str| Output {
        status: ExitStatus::from_raw(code << 8),
        stdout: stdout.as_bytes().to_vec(),
        stderr: stderr.as_bytes().to_vec(),
    };
    let json = |value: f64, estimate: f64, memory: u64, unclosed: u64, warnings: &[&str]| {
        let warnings: Vec<Value> = warnings.iter().map(|code| serde_json::json!({"code": code})).collect();
        let volume = serde_json::json!({"value": value, "estimate_error": estimate});
        let all = serde_json::json!({
            "volume": volume, "peak_memory_bytes": memory, "unclosed_rays": unclosed, "warnings": warnings,
        });
        all.to_string()
    };
    let said = "ldi-ops: warning: x";
    assert_eq!(fault(&output(0, &json(1.0, 0.0, 9, 0, &["a", "unit-assumed"]), said), 1.0, &["a"]), None);
    assert_eq!(fault(&output(0, &json(1.1, 0.1, 9, 0, &[]), ""), 1.0, &[]), None);
    for bad in [
        output(1, &json(1.0, 0.0, 9, 0, &[]), ""),
        output(0, "", ""),
        output(0, &json(1.1, 0.01, 9, 0, &[]), ""),
        output(0, &json(-1e-6, 2.0, 9, 0, &[]), ""),
        output(0, &json(f64::NAN, 0.0, 9, 0, &[]), ""),
        output(0, &json(1.0, 0.0, 3 << 30, 0, &[]), ""),
        output(0, &json(1.0, 0.0, 9, 1, &[]), ""),
        output(0, &json(1.0, 0.0, 9, 0, &["b"]), said),
    ] {
        assert!(fault(&bad, 1.0, &[]).is_some(), "{bad:?}");
    }
    assert!(fault(&output(0, &json(1.0, 0.0, 9, 0, &[]), ""), 1.0, &["a"]).is_some());
    assert!(fault(&output(0, &json(1.0, 0.0, 9, 0, &["a"]), ""), 1.0, &["a"]).is_some());

    let error = r#"{"error": {"exit_code": 2}}"#;
    assert_eq!(refusal_fault(&output(2, error, "ldi-ops: error: f.stl: line 3"), "f.stl", &["line 3"]), None);
    for bad in [
        output(0, error, "ldi-ops: error: f.stl: line 3"),
        output(2, "{}", "ldi-ops: error: f.stl: line 3"),
        output(2, "", "ldi-ops: error: f.stl: line 3"),
        output(2, r#"{"error": {"exit_code": 2}, "volume": {}}"#, "ldi-ops: error: f.stl: line 3"),
        output(2, error, "ldi-ops: error: f.stl: line 4"),
        output(2, error, "ldi-ops: error: line 3"),
        output(101, error, "thread panicked at f.stl line 3"),
    ] {
        assert!(refusal_fault(&bad, "f.stl", &["line 3"]).is_some(), "{bad:?}");
    }
}
