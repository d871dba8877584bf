//! An interrupted job leaves no partial output.

use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::{Folder, cube};

/// The longest time that a step may take, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

fn spawn(folder: &Folder, arguments: &[&str]) -> Child {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("ldi-ops"));
    command.current_dir(folder.folder.path()).args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
    // Under `nohup` the tests ignore hangups, and the program would inherit that.
    let reset = || {
        // SAFETY: signal() may be called between fork and exec.
        unsafe { libc::signal(libc::SIGHUP, libc::SIG_DFL) };
        Ok(())
    };
    // SAFETY: the closure calls nothing else.
    unsafe { command.pre_exec(reset) };
    command.spawn().unwrap()
}

fn end(mut child: Child, signal: &str) -> ExitStatus {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    child.wait().unwrap()
}

/// Ends a job by a signal while it writes, and returns the names of the files it leaves.
fn end_while_it_writes(signal: &str, is_ended: impl Fn(ExitStatus) -> bool) -> (Folder, Vec<String>) {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    // The compression of 340 million voxels takes a while; still, a write may be done before the signal comes.
    for _ in 0..10 {
        let mut child = spawn(&folder, &["sample", "a.stl", "--resolution", "700", "--axis", "z", "-o", "out.vti"]);
        let start = Instant::now();
        while folder.names().len() == 1 && child.try_wait().unwrap().is_none() {
            assert!(start.elapsed() < PATIENCE, "nothing was written");
            sleep(Duration::from_micros(200));
        }
        let was_writing = folder.names().iter().any(|name| name.ends_with(".part"));
        let status = end(child, signal);
        if was_writing && is_ended(status) {
            let names = folder.names();
            return (folder, names);
        }
        assert_eq!((status.code(), status.signal()), (Some(0), None), "neither ended nor done");
        std::fs::remove_file(folder.path("out.vti")).unwrap();
    }
    panic!("no write could be interrupted");
}

#[test]
fn jobs_interrupted_while_writing_leave_no_files() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143), ("-HUP", 129)] {
        let (_, names) = end_while_it_writes(signal, |status| status.code() == Some(code));
        assert_eq!(names, ["a.stl"], "{signal}");
    }
}

#[test]
fn the_next_write_removes_the_files_of_a_killed_job() {
    let (folder, names) = end_while_it_writes("-KILL", |status| status.signal() == Some(9));
    assert!(names.iter().any(|name| name.ends_with(".part")), "{names:?}");
    folder.run(&["convert", "a.stl", "-o", "b.stl"]).code(0);
    assert_eq!(folder.names(), ["a.stl", "b.stl"]);
}

/// A sum that takes minutes.
const LONG_JOB: [&str; 11] =
    ["minkowski", "a.stl", "a.stl", "--memory", "1T", "--resolution", "2000", "-o", "out.npz", "--json", "out.json"];

fn folder_with_gyroid() -> Folder {
    let folder = Folder::new();
    folder.run(&["generate", "gyroid", "--cells", "2", "-o", "a.stl"]).code(0);
    folder
}

#[test]
fn jobs_that_ignore_hangups_finish() {
    let folder = folder_with_gyroid();
    let program = assert_cmd::cargo::cargo_bin!("ldi-ops").display().to_string();
    let script = format!("trap '' HUP; exec '{program}' {}", LONG_JOB.join(" "));
    let mut command = Command::new("sh");
    command.current_dir(folder.folder.path()).args(["-c", &script]).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    sleep(Duration::from_millis(500));
    let sent = Command::new("kill").args(["-HUP", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "the hangup ended the job");
    assert_eq!(end(child, "-TERM").code(), Some(143));
}

#[test]
fn interrupted_sums_leave_no_files() {
    let folder = folder_with_gyroid();
    let mut child = spawn(&folder, &LONG_JOB);
    sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "the job was to take longer");
    assert_eq!(end(child, "-INT").code(), Some(130));
    assert_eq!(folder.names(), ["a.stl"]);
}
