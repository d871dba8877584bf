//! What goes to stdout and what to stderr, and what happens when nobody reads.

use std::io::Read;
use std::process::{Command, Stdio};

use crate::{Folder, cube};

fn with_cube() -> Folder {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder
}

#[test]
fn stdout_carries_the_result_alone() {
    let folder = with_cube();
    let run = folder.run(&["volume", "a.stl", "--resolution", "16", "-v"]).code(0);
    assert!(run.stdout().starts_with("volume      8.0000 ± 0.0015\n"), "{}", run.stdout());
    assert!(!run.stdout().contains("warning") && run.stderr().contains("ldi-ops: warning: "));
    assert!(run.stderr().contains(" threads (auto: "), "{}", run.stderr());
    // Without a terminal there is no bar, whatever the time it takes.
    assert!(run.stderr().lines().all(|line| line.starts_with("ldi-ops: ")), "{}", run.stderr());
    let run = folder.run(&["volume", "a.stl", "--resolution", "16", "--unit", "mm"]).code(0);
    assert_eq!(run.stderr(), "");
    let run = folder.run(&["volume", "a.stl", "--resolution", "16", "--json", "-", "--quiet"]).code(0);
    assert!(run.stdout().starts_with('{') && run.json()["command"] == "volume");
    // Quiet is about progress: what the user must not miss is still said.
    assert!(run.stderr().contains("warning"));
}

#[test]
fn the_text_tells_what_was_done() {
    let folder = with_cube();
    let text = folder.run(&["volume", "a.stl", "--resolution", "16", "--unit", "mm"]).code(0).stdout();
    let labels: Vec<&str> = text.lines().filter_map(|line| line.split_whitespace().next()).collect();
    for label in ["volume", "area", "centroid", "inertia", "input", "grid", "image", "backend", "layers", "time"] {
        assert!(labels.contains(&label), "no {label} in\n{text}");
    }
    for words in
        ["mm³", "a.stl: 12 triangles, closed, oriented, mesh volume 8 mm³", "16 × 16 × 16 rays", "threads (auto: "]
    {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let folder = with_cube();
    for arguments in [&["volume", "a.stl", "--resolution", "16"][..], &["--help"], &["volume", "a.stl", "--json", "-"]]
    {
        let mut child = Command::new(assert_cmd::cargo::cargo_bin!("ldi-ops"))
            .current_dir(folder.path("."))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(0), "{stderr}");
        assert!(!stderr.contains("panic") && !stderr.contains("error"), "{stderr}");
    }
}
