//! Compares Minkowski sums and differences with those of CGAL and manifold3d, pinned in `data/reference/minkowski`.
//!
//! # The tolerance
//! Let h be the pitch and S the area of the result. As `tests/reference.rs` derives, the error of a volume from three images is
//! the sum of the errors of the N = S / h² pixels that the surface cuts, which are nearly independent: √7 h S / √(12 N), one
//! standard deviation, of which three are allowed. Edges and corners add a hundredth of h S. So the tolerance is **h S (0.01 + 3
//! √(7 / 12 N))**, a fiftieth of h S where N is 52 500. Faces between rays, which all cubes have, cost a first order only along
//! single axes, and the three images correct it. The sum itself adds no error: the only gaps that it closes are shorter than four
//! steps of a lattice that is thousands of times finer than h. Images of the peers' own results are off by a four-hundredth of h
//! S at most.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::Folder;

const RESOLUTION: &str = "256";

/// One case: A ⊕ B or A ⊖ B, and the answers of the peers.
struct Case {
    name: String,
    difference: bool,
    inputs: [Value; 2],
    /// The answers, by the way that a peer computed them.
    results: Vec<Value>,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn case(path: &Path) -> Case {
    let value: Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    Case {
        name: value["case"].as_str().unwrap().to_owned(),
        difference: value["operation"] == "difference",
        inputs: [0, 1].map(|i| value["inputs"][i].clone()),
        results: value["results"].as_array().unwrap().clone(),
    }
}

fn cases() -> Vec<Case> {
    let entries = fs::read_dir(root().join("data/reference/minkowski")).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    let cases: Vec<Case> = paths.iter().map(|path| case(path)).collect();
    assert!(cases.len() >= 15, "only {} cases", cases.len());
    assert!(cases.iter().filter(|case| case.difference).count() >= 2);
    cases
}

impl Case {
    /// Returns the volume on which the peers agree.
    fn volume(&self) -> f64 {
        let values: Vec<f64> = self.results.iter().filter_map(|result| result["volume"].as_f64()).collect();
        for value in &values {
            assert!((value - values[0]).abs() <= 1e-9 * values[0], "{}: the peers differ: {values:?}", self.name);
        }
        *values.first().unwrap_or_else(|| panic!("{}: all refuse", self.name))
    }

    /// Returns a number that some of the ways state.
    fn told(&self, name: &str) -> f64 {
        let told = self.results.iter().find_map(|result| result[name].as_f64());
        told.unwrap_or_else(|| panic!("{}: nobody tells {name}", self.name))
    }

    /// Returns the command line without its outputs.
    fn arguments(&self) -> Vec<String> {
        let path = |input: &Value| root().join(input["path"].as_str().unwrap()).to_str().unwrap().to_owned();
        let mut words = vec!["minkowski".to_owned(), path(&self.inputs[0]), path(&self.inputs[1])];
        if let Some(transform) = self.inputs[1]["transform"].as_str() {
            words.extend(["--transform-b".to_owned(), transform.to_owned()]);
        }
        words.extend(self.difference.then(|| "--difference".to_owned()));
        words.extend(["--mode", "exact"].map(str::to_owned));
        words
    }

    /// Returns the program's result for the same inputs that the peers had.
    fn run(&self, more: &[&str]) -> Value {
        let words = self.arguments();
        let words: Vec<&str> = words.iter().map(String::as_str).chain(more.iter().copied()).collect();
        let result = Folder::new().json(&words);
        for (used, pinned) in result["inputs"].as_array().unwrap().iter().zip(&self.inputs) {
            assert_eq!(used["sha256"], pinned["sha256"], "{} was changed", pinned["path"]);
            assert_eq!(used["triangles"], pinned["triangles"], "{}", pinned["path"]);
        }
        result
    }
}

/// Returns the tolerance of a volume, as the head of this file derives it.
fn tolerance(pitch: f64, area: f64) -> f64 {
    let pixels = area / pitch.powi(2);
    assert!(pixels >= 5000.0, "{pixels} pixels are too few");
    pitch * area * (0.01 + 3.0 * (7.0 / (12.0 * pixels)).sqrt())
}

fn is_within(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance
}

#[test]
fn volumes_of_sums_are_within_the_tolerance_of_the_peers() {
    let mut wrong = Vec::new();
    eprintln!("{:26}{:>16}{:>16}{:>12}{:>12}{:>12}", "case", "peers", "found", "error", "estimate", "tolerance");
    for case in cases() {
        let result = case.run(&["--resolution", RESOLUTION]);
        let [pitch, found, estimate] =
            [&result["grid"]["pitch"], &result["volume"]["value"], &result["volume"]["estimate_error"]]
                .map(|number| number.as_f64().unwrap());
        let (expected, area) = (case.volume(), case.told("area"));
        let tolerance = tolerance(pitch, area);
        assert_eq!(result["unclosed_rays"], 0, "{}", case.name);
        let error = found - expected;
        let line = format!("{:26}{expected:16.6}{found:16.6}{error:12.2e}{estimate:12.2e}{tolerance:12.2e}", case.name);
        eprintln!("{line}");
        if !is_within(found, expected, tolerance) {
            wrong.push(line);
        }
    }
    assert!(wrong.is_empty(), "beyond the tolerance:\n{}", wrong.join("\n"));
}

#[test]
fn cavities_of_sums_are_found_at_every_resolution() {
    let mut seen = 0;
    for case in cases() {
        let [components, cavities] = ["components", "cavities"].map(|name| case.told(name));
        if cavities == 0.0 {
            continue;
        }
        seen += 1;
        for resolution in ["64", "101", "160"] {
            let folder = Folder::new();
            let target = folder.path("sum.ply");
            let result = case.run(&["--resolution", resolution, "-o", target.to_str().unwrap()]);
            let found = result["surface"]["components"].as_f64().unwrap();
            // Each cavity has a surface of its own.
            assert_eq!(found, components + cavities, "{} at {resolution}", case.name);
        }
    }
    assert!(seen >= 5, "only {seen} cases have cavities");
}

#[test]
fn the_comparison_rejects_filled_cavities_and_offset_surfaces() {
    assert!(is_within(1.0, 1.5, 0.5) && !is_within(1.0, 1.6, 0.5) && !is_within(1.0, 0.4, 0.5));
    assert!(!is_within(f64::NAN, 1.0, 0.5) && !is_within(1.0, f64::NAN, 0.5));
    // The comparison rejects a filled cavity, and a sum in place of a difference.
    let cases = cases();
    let named = |name: &str| cases.iter().find(|case| case.name == name).unwrap();
    let case = named("hollow_cube_cube");
    let allowed = tolerance(10.0 / 256.0, case.told("area"));
    assert!(is_within(992.0, case.volume(), allowed) && !is_within(1000.0, case.volume(), allowed));
    let sum = named("star_tetrahedron");
    let difference = named("star_less_tetrahedron");
    let allowed = tolerance(45.0 / 256.0, sum.told("area"));
    assert!(!is_within(difference.volume(), sum.volume(), allowed));
    // It also rejects a sum that is wrong by a tenth of a pitch all over.
    assert!(!is_within(sum.volume() + 0.1 * 45.0 / 256.0 * sum.told("area"), sum.volume(), allowed));
}
