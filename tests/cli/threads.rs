//! The function `run` of the command line, called more than once in one process.

use std::ffi::OsString;

use serde_json::Value;

use crate::{Folder, cube, read};

/// Runs a command line in this process and returns its exit code.
fn run(arguments: &[&str]) -> u8 {
    ldi_ops_cli::run(["ldi-ops"].iter().chain(arguments).map(OsString::from))
}

fn path(folder: &Folder, name: &str) -> String {
    folder.path(name).into_os_string().into_string().unwrap()
}

#[test]
fn each_run_in_a_process_has_the_threads_that_it_asks_for() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    let (solid, json) = (path(&folder, "a.stl"), path(&folder, "a.json"));
    let mut volumes = Vec::new();
    for threads in ["2", "3", "1"] {
        let job =
            ["volume", &solid, "--estimate", "--resolution", "16", "--backend", "cpu", "--quiet", "--json", &json];
        assert_eq!(run(&[&job[..], &["--threads", threads]].concat()), 0);
        let result: Value = serde_json::from_str(&read(&folder.path("a.json"))).unwrap();
        let device = result["device"].as_str().unwrap();
        assert!(device.ends_with(&format!(", {threads} threads")), "{device}");
        volumes.push(result["volume"].clone());
    }
    assert!(volumes.iter().all(|volume| *volume == volumes[0]), "{volumes:?}");
}

#[test]
fn far_more_threads_than_any_machine_has_are_refused() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.run(&["volume", "a.stl", "--threads", "1000000"]).code(2).says(&["--threads", "1000000", "at most 1024"]);
    for [flag, wrong, expected] in
        [["--threads", "0", "at least 1"], ["--resolution", "-5", "whole number"], ["--memory", "-1", "size of memory"]]
    {
        folder.run(&["volume", "a.stl", flag, wrong]).code(2).says(&[flag, wrong, expected]);
    }
    folder.run(&["volume", "a.stl", "--threads", "16"]).code(0);
}

#[test]
fn reports_of_a_process_state_the_arguments_that_the_run_was_given() {
    let folder = Folder::new();
    folder.stl("a b.stl", &cube(0.0, 2.0));
    let (solid, out) = (path(&folder, "a b.stl"), path(&folder, "out"));
    let sizes = ["--resolution", "8", "--tortuosity-resolution", "8"];
    assert_eq!(run(&[&["report", &solid, "--unit", "mm", "-o", &out], &sizes[..]].concat()), 0);
    let sheet: Value = serde_json::from_str(&read(&folder.path("out/metrics.json"))).unwrap();
    let line = format!("ldi-ops report '{solid}' --unit mm -o {out} --resolution 8 --tortuosity-resolution 8");
    assert_eq!(sheet["provenance"]["command_line"], line);
}
