//! Completion scripts of shells.

use std::io::Write;
use std::process::{Command, Stdio};

use crate::Folder;
use crate::help::COMMANDS;

#[test]
fn completions_name_every_command_in_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = folder.run(&["completions", shell]).code(0).stdout();
        for word in COMMANDS.into_iter().chain(["report", "surface", "tortuosity-resolution"]) {
            assert!(script.contains(word), "{shell} does not complete {word}");
        }
    }
    folder.run(&["completions", "tcsh"]).code(2).says(&["'tcsh'", "bash, elvish, fish, powershell, zsh"]);
    folder.run(&["completions"]).code(2).says(&["<SHELL>"]);
}

#[test]
fn completions_of_bash_parse() {
    let script = Folder::new().run(&["completions", "bash"]).code(0).stdout();
    let mut bash = Command::new("bash").arg("-n").stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    bash.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
    let output = bash.wait_with_output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}
