//! The division of output between stdout and stderr, and the behaviour when a reader goes away.

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
    assert!(run.stdout().starts_with("volume      8 (exact)\n"), "{}", run.stdout());
    assert!(!run.stdout().contains("warning") && run.stderr().contains("ldi-ops: warning: "));
    assert!(run.stderr().contains("ldi-ops: exact volume, in "), "{}", run.stderr());
    // Without a terminal the program shows no progress bar, however long it runs.
    assert!(run.stderr().lines().all(|line| line.starts_with("ldi-ops: ")), "{}", run.stderr());
    let run = folder.run(&["volume", "a.stl", "--resolution", "16", "--unit", "mm"]).code(0);
    assert_eq!(run.stderr(), "");
    let run = folder.run(&["volume", "a.stl", "--resolution", "16", "--json", "-", "--quiet"]).code(0);
    assert!(run.stdout().starts_with('{') && run.json()["command"] == "volume");
    // `--quiet` silences progress; warnings remain.
    assert!(run.stderr().contains("warning"));
}

#[test]
fn verbose_text_states_inputs_grid_and_backend() {
    let folder = with_cube();
    let text =
        folder.run(&["volume", "a.stl", "--estimate", "--resolution", "16", "--unit", "mm", "-v"]).code(0).stdout();
    let labels = labels(&text);
    for label in ["volume", "area", "centroid", "inertia", "input", "grid", "image", "backend", "layers", "time"] {
        assert!(labels.contains(&label), "no {label} in\n{text}");
    }
    for words in
        ["mm³", "a.stl: 12 triangles, closed, oriented, mesh volume 8 mm³", "16 × 16 × 16 rays", "threads (auto: "]
    {
        assert!(text.contains(words), "no `{words}` in\n{text}");
    }
}

/// Returns the first word of each line.
fn labels(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.split_whitespace().next()).collect()
}

#[test]
fn default_text_is_the_value_the_inputs_and_the_file() {
    let folder = Folder::with_two_cubes();
    let run = |arguments: &[&str]| {
        let run = folder.run(&[arguments, &["--resolution", "30", "--unit", "mm"]].concat()).code(0);
        assert_eq!(run.stderr(), "");
        run.stdout()
    };
    let text = run(&["intersect", "a.stl", "b.stl", "-o", "c.stl"]);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "intersect   1 mm³ (exact)");
    assert_eq!(lines[1], "input       a.stl: 12 triangles, mesh volume 8 mm³");
    assert_eq!(lines[2], "            b.stl: 12 triangles, mesh volume 8 mm³");
    assert_eq!(lines[3..], ["written     c.stl"]);
    let text = run(&["volume", "a.stl"]);
    assert_eq!(labels(&text), ["volume", "area", "centroid", "inertia", "(0,", "(0,", "input"], "{text}");
    assert_eq!(labels(&run(&["offset", "a.stl", "--distance", "0.1"])), ["offset", "input"]);
    for arguments in [&["intersect", "a.stl", "b.stl", "-q"][..], &["volume", "a.stl", "-q"]] {
        assert_eq!(labels(&run(arguments)), [arguments[0]]);
    }
    // Where there are several values, each line names its solid.
    let text = run(&["volume", "a.stl", "b.stl", "-q"]);
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines.len() == 2 && lines[0].ends_with(" mm³ (exact)  a.stl") && lines[1].ends_with(" mm³ (exact)  b.stl"),
        "{text}"
    );
    folder.stl("open.stl", &cube(0.0, 2.0)[1..]);
    let open = ["volume", "open.stl", "--allow-open", "--resolution", "16"];
    assert!(folder.run(&open).code(0).stdout().contains("open.stl: 11 triangles, not closed, not oriented, mesh"));
}

#[test]
fn surface_and_render_print_a_few_lines() {
    let folder = with_cube();
    folder.run(&["sample", "a.stl", "--resolution", "16", "--unit", "mm", "-o", "a.npz"]).code(0);
    let run = |arguments: &[&str]| folder.run(arguments).code(0).stdout();
    assert_eq!(labels(&run(&["surface", "a.npz", "-o", "b.stl"])), ["mesh", "written"]);
    assert_eq!(run(&["surface", "a.npz", "-o", "b.stl", "-q"]), "written     b.stl\n");
    assert_eq!(labels(&run(&["surface", "a.npz", "-o", "b.stl", "-v"]))[0], "images");
    let render = ["render", "a.stl", "--unit", "mm", "--size", "64x48", "-o", "a.png"];
    assert_eq!(labels(&run(&render)), ["render", "input"]);
    assert_eq!(labels(&run(&[&render[..], &["-q"]].concat())), ["render"]);
    assert!(labels(&run(&[&render[..], &["-v"]].concat())).contains(&"backend"));
    assert_eq!(labels(&run(&["generate", "sphere", "-o", "c.stl"])), ["sphere", "box", "volume", "area"]);
    assert_eq!(labels(&run(&["generate", "sphere", "-o", "c.stl", "-q"])), ["sphere"]);
}

#[test]
fn a_closed_stdout_is_no_failure() {
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
