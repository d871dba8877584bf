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
    assert!(!run.stdout().contains("time ") && run.stderr().contains("ldi-ops: time "), "{}", run.stderr());
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
fn verbose_text_on_stderr_states_grid_and_backend() {
    let folder = with_cube();
    let volume = ["volume", "a.stl", "--estimate", "--resolution", "16", "--unit", "mm", "-v"];
    let run = folder.run(&volume).code(0);
    let (result, details) = (run.stdout(), run.stderr());
    for label in ["volume", "area", "centroid", "inertia", "input"] {
        assert!(labels(&result).contains(&label), "no {label} in\n{result}");
    }
    assert!(result.contains("mm³") && result.contains("a.stl: 12 triangles, mesh volume 8 mm³"), "{result}");
    for label in ["grid", "image", "backend", "layers", "time"] {
        assert!(details.contains(&format!("ldi-ops: {label:<11} ")), "no {label} in\n{details}");
    }
    assert!(details.contains("16 × 16 × 16 rays") && details.contains("threads (auto: "), "{details}");
    // Where there are several results, each has the name of its solid.
    folder.stl("b.stl", &cube(0.0, 3.0));
    let several = folder.run(&["volume", "a.stl", "b.stl", "-v"]).code(0).stderr();
    for name in ["ldi-ops: a.stl\n", "ldi-ops: b.stl\n"] {
        assert!(several.contains(name), "{several}");
    }
}

#[test]
fn stdout_is_the_same_at_every_verbosity() {
    let folder = Folder::with_two_cubes();
    folder.run(&["sample", "a.stl", "--resolution", "16", "--unit", "mm", "-o", "a.npz"]).code(0);
    for (command, code) in [
        ("volume a.stl b.stl", 0),
        ("intersect a.stl b.stl --bounds --assert-below 1 -o c.stl", 1),
        ("offset a.stl --distance 0.1 --resolution 16", 0),
        ("check a.stl", 0),
        ("surface a.npz -o d.stl", 0),
        ("generate sphere -o e.stl", 0),
        ("render a.stl --size 64x48 -o a.png", 0),
        ("clash a.stl b.stl", 1),
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let run = |flags: &[&str]| folder.run(&[&words[..], flags].concat()).code(code);
        let plain = run(&[]);
        for flag in ["--quiet", "--verbose"] {
            assert_eq!(run(&[flag]).stdout(), plain.stdout(), "{command} {flag}");
        }
        assert!(!plain.stdout().is_empty());
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
    let render = ["render", "a.stl", "--unit", "mm", "--size", "64x48", "-o", "a.png"];
    assert_eq!(labels(&run(&render)), ["render", "input"]);
    for (command, words) in [(&["surface", "a.npz", "-o", "b.stl"][..], "images "), (&render[..], "backend ")] {
        let details = folder.run(&[command, &["-v"]].concat()).code(0).stderr();
        assert!(details.contains(&format!("ldi-ops: {words}")), "{details}");
    }
    assert_eq!(labels(&run(&["generate", "sphere", "-o", "c.stl"])), ["sphere", "box", "volume", "area"]);
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
