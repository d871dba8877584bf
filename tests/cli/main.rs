//! Tests of the command line as users and scripts see it: exit codes, stdout and stderr, JSON, files, refusals.
//!
//! Each test writes its own small input files.

mod broken;
mod certainty;
mod clash;
mod completions;
mod corpus;
mod csg;
mod devices;
mod files;
#[cfg(feature = "gpu")]
mod gpu;
mod help;
mod images;
#[cfg(unix)]
mod interrupt;
mod json;
mod library;
mod man;
#[cfg(target_os = "linux")]
mod memory;
mod operations;
mod overwriting;
mod placing;
mod render;
mod reports;
mod streams;
mod sum_references;
mod sums;
mod surfaces;
mod sweeps;
mod threads;
mod volumes;
mod voxels;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;

/// The three corners of a triangle.
type Triangle = [[f64; 3]; 3];

/// A temporary folder for one test, removed at the end.
struct Folder {
    folder: tempfile::TempDir,
}

/// The exit code and the output of one run.
struct Run {
    output: Output,
}

impl Folder {
    fn new() -> Folder {
        Folder { folder: tempfile::tempdir().unwrap() }
    }

    /// Creates a folder with two cubes of side 2 that share one of side 1.
    fn with_two_cubes() -> Folder {
        let folder = Folder::new();
        folder.stl("a.stl", &cube(0.0, 2.0));
        folder.stl("b.stl", &cube(1.0, 2.0));
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the names of everything in the folder.
    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Writes triangles as a text STL, which holds any number that can be written down.
    fn stl(&self, name: &str, triangles: &[Triangle]) {
        let mut text = String::from("solid test\n");
        for triangle in triangles {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in triangle {
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
        text += "endsolid test\n";
        fs::write(self.path(name), text).unwrap();
    }

    /// Runs ldi-ops in the folder.
    fn run(&self, arguments: &[&str]) -> Run {
        Run { output: self.command(arguments).output().unwrap() }
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("ldi-ops"));
        command.current_dir(self.folder.path()).args(arguments);
        command
    }

    /// Returns the JSON of a run and asserts that the run succeeds.
    fn json(&self, arguments: &[&str]) -> Value {
        let mut all = arguments.to_vec();
        all.extend(["--json", "-"]);
        self.run(&all).code(0).json()
    }

    /// Returns the volume that a run gives and asserts that the run succeeds.
    fn volume(&self, arguments: &[&str]) -> f64 {
        self.json(arguments)["volume"]["value"].as_f64().unwrap()
    }
}

impl Run {
    #[track_caller]
    fn code(self, code: i32) -> Run {
        assert_eq!(self.output.status.code(), Some(code), "stdout:\n{}\nstderr:\n{}", self.stdout(), self.stderr());
        self
    }

    fn stdout(&self) -> String {
        String::from_utf8(self.output.stdout.clone()).unwrap()
    }

    fn stderr(&self) -> String {
        String::from_utf8(self.output.stderr.clone()).unwrap()
    }

    #[track_caller]
    fn json(&self) -> Value {
        serde_json::from_slice(&self.output.stdout).unwrap_or_else(|e| panic!("{e}: {}", self.stdout()))
    }

    /// Asserts that the error on stderr contains all these words, and that stdout is empty.
    #[track_caller]
    fn says(self, words: &[&str]) -> Run {
        let stderr = self.stderr();
        assert!(stderr.contains("ldi-ops: error: "), "{stderr}");
        for word in words {
            assert!(stderr.contains(word), "no `{word}` in:\n{stderr}");
        }
        assert_eq!(self.stdout(), "");
        self
    }

    /// Asserts that a warning on stderr contains all these words.
    #[track_caller]
    fn warns(self, words: &[&str]) -> Run {
        let stderr = self.stderr();
        let said = stderr
            .lines()
            .any(|line| line.starts_with("ldi-ops: warning: ") && words.iter().all(|word| line.contains(word)));
        assert!(said, "no warning with {words:?} in:\n{stderr}");
        self
    }
}

/// Returns the codes of the warnings in a result.
fn warning_codes(result: &Value) -> Vec<&str> {
    result["warnings"].as_array().unwrap().iter().map(|warning| warning["code"].as_str().unwrap()).collect()
}

/// Returns the box between two corners, facing outwards.
fn cuboid(min: [f64; 3], max: [f64; 3]) -> Vec<Triangle> {
    let corner = |i: usize| -> [f64; 3] { std::array::from_fn(|k| if i >> k & 1 == 1 { max[k] } else { min[k] }) };
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    triangles.map(|triangle| triangle.map(corner)).collect()
}

/// Returns the cube of this side whose lower corner is on the diagonal.
fn cube(at: f64, side: f64) -> Vec<Triangle> {
    cuboid([at; 3], [at + side; 3])
}

/// Returns a closed surface with one side, a projective plane of ten triangles, in the unit cube.
fn one_sided() -> Vec<Triangle> {
    const CORNERS: [[f64; 3]; 6] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.1], [0.2, 1.0, 0.0], [0.0, 0.1, 1.0], [1.0, 0.9, 0.3], [0.3, 1.0, 1.0]];
    let faces =
        [[0, 1, 4], [0, 1, 5], [0, 2, 3], [0, 2, 5], [0, 3, 4], [1, 2, 3], [1, 2, 4], [1, 3, 5], [2, 4, 5], [3, 4, 5]];
    faces.map(|face| face.map(|corner: usize| CORNERS[corner])).to_vec()
}

fn inside_out(triangles: &[Triangle]) -> Vec<Triangle> {
    triangles.iter().map(|&[a, b, c]| [a, c, b]).collect()
}

#[track_caller]
fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected} ± {tolerance}");
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}
