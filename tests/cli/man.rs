//! Man pages of the program and its commands.

use std::fs;
use std::process::{Command, Stdio};

use crate::help::COMMANDS;
use crate::{Folder, read};

/// Returns a page as its reader sees it, but for fonts and line breaks.
fn unescaped(page: &str) -> String {
    page.replace("\\*(Aq", "'").replace("\\-", "-").replace("\\&", "").replace("\\\\", "\\")
}

/// Asserts that a page has the sections of a man page and that its requests are known and balanced.
fn assert_well_formed(name: &str, page: &str) {
    for section in ["TH ", "SH NAME\n", "SH SYNOPSIS\n", "SH DESCRIPTION\n"] {
        assert_eq!(page.matches(&format!("\n.{section}")).count(), 1, "{name}: .{section}");
    }
    for (open, close) in [("nf", "fi"), ("RS", "RE")] {
        let mut depth = 0;
        for line in page.lines() {
            match line.strip_prefix('.').and_then(|request| request.split(' ').next()) {
                Some(request) if request == open => depth += 1,
                Some(request) if request == close => depth -= 1,
                _ => {}
            }
            assert!((0..=1).contains(&depth), "{name}: .{open} and .{close} at {line}");
        }
        assert_eq!(depth, 0, "{name}: .{open} without .{close}");
    }
    for line in page.lines().filter(|line| line.starts_with(['.', '\''])) {
        let request = line[1..].split(' ').next().unwrap();
        let known = ["TH", "SH", "PP", "TP", "IP", "RS", "RE", "nf", "fi", "br", "ie", "el"];
        assert!(known.contains(&request), "{name}: {line}");
    }
}

/// Asserts that groff formats a page without a warning, where there is a groff.
fn assert_accepted_by_groff(folder: &Folder, name: &str) {
    let mut groff = Command::new("groff");
    groff.args(["-K", "utf8", "-T", "utf8", "-man", "-ww", name]).current_dir(folder.path("man1"));
    let Ok(output) = groff.stdin(Stdio::null()).output() else { return };
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stdout.len() > 200, "{name}");
}

#[test]
fn man_writes_a_page_of_each_command_with_its_examples() {
    let folder = Folder::new();
    let text = folder.run(&["man", "man1"]).code(0).stdout();
    let mut names: Vec<String> =
        fs::read_dir(folder.path("man1")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(text, format!("written     {} pages in man1\n", names.len()));
    assert!(!names.iter().any(|name| name.contains("repair") || name.contains("help")), "{names:?}");
    let mut pages = vec![("ldi-ops.1".to_owned(), vec![])];
    for command in COMMANDS.into_iter().chain(["report", "surface", "clash"]) {
        pages.push((format!("ldi-ops-{command}.1"), vec![command]));
    }
    pages.push(("ldi-ops-generate-gyroid.1".to_owned(), vec!["generate", "gyroid"]));
    for (name, command) in &pages {
        assert!(names.contains(name), "no {name} in {names:?}");
        let page = unescaped(&read(&folder.path("man1").join(name)));
        let help = folder.run(&[&command[..], &["--help"]].concat()).code(0).stdout();
        // The help wraps long lines.
        for example in help.lines().filter_map(|line| line.strip_prefix("  ldi-ops ")) {
            assert!(page.contains(&format!("\nldi-ops {example}")), "{name} lacks ldi-ops {example}");
        }
        assert_eq!(help.contains("Examples:"), page.contains("\n.SH EXAMPLES\n"), "{name}");
    }
    for name in &names {
        let page = read(&folder.path("man1").join(name));
        assert!(page.len() > 500, "{name} is empty");
        assert_well_formed(name, &page);
        assert_accepted_by_groff(&folder, name);
    }
    // Without a folder the page of the program goes to stdout.
    assert_eq!(folder.run(&["man"]).code(0).stdout(), read(&folder.path("man1/ldi-ops.1")));
}

#[test]
fn man_writes_all_pages_or_none() {
    let folder = Folder::new();
    fs::create_dir_all(folder.path("man1/ldi-ops-volume.1")).unwrap();
    fs::write(folder.path("man1/ldi-ops.1"), "old").unwrap();
    folder.run(&["man", "man1"]).code(2).says(&["ldi-ops-volume.1", "is a folder"]);
    assert_eq!(fs::read_dir(folder.path("man1")).unwrap().count(), 2);
    assert_eq!(read(&folder.path("man1/ldi-ops.1")), "old");
    // Pages that exist are replaced.
    fs::remove_dir(folder.path("man1/ldi-ops-volume.1")).unwrap();
    folder.run(&["man", "man1"]).code(0);
    assert!(read(&folder.path("man1/ldi-ops.1")).contains(".SH NAME"));
    folder.run(&["man", "absent/man1"]).code(2).says(&["absent/man1", "the folder absent does not exist"]);
    folder.run(&["man", "man1/ldi-ops.1"]).code(2).says(&["man1/ldi-ops.1", "is a file"]);
}
