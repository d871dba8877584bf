//! Help texts, and command lines that are refused.

use crate::{Folder, cube};

pub const COMMANDS: [&str; 18] = [
    "intersect",
    "union",
    "difference",
    "xor",
    "csg",
    "minkowski",
    "offset",
    "open",
    "close",
    "volume",
    "sample",
    "check",
    "convert",
    "generate",
    "render",
    "devices",
    "completions",
    "man",
];

#[test]
fn every_command_has_a_help_text() {
    let folder = Folder::new();
    let help = folder.run(&["--help"]).code(0).stdout();
    assert!(help.contains("Exit codes: 0 done"));
    for command in COMMANDS {
        assert!(help.contains(&format!("\n  {command} ")), "{command} is not in the help text");
        let text = folder.run(&[command, "--help"]).code(0).stdout();
        assert!(text.contains("Usage: ldi-ops"), "{text}");
        assert!(text.contains("Examples:") || command == "devices", "{command} has no examples");
        let wide = text.lines().find(|line| line.chars().count() > 100);
        assert!(wide.is_none(), "{command}: {wide:?}");
    }
    let text = folder.run(&["generate", "gyroid", "--help"]).code(0).stdout();
    assert!(text.contains("--wall") && text.contains("[default: 1]"), "{text}");
    folder.run(&["--version"]).code(0);
}

#[test]
fn the_examples_of_the_help_texts_run() {
    let folder = Folder::new();
    for (kind, name) in [
        ("sphere", "a"),
        ("torus", "b"),
        ("cylinder", "c"),
        ("cuboid", "scaffold"),
        ("cuboid", "bone"),
        ("sphere", "part"),
    ] {
        folder.run(&["generate", kind, "-o", &format!("{name}.stl")]).code(0);
    }
    for (from, to) in [("a", "block"), ("b", "drill"), ("c", "struts")] {
        std::fs::copy(folder.path(&format!("{from}.stl")), folder.path(&format!("{to}.stl"))).unwrap();
    }
    folder.run(&["convert", "a.stl", "-o", "part.obj"]).code(0);
    let mut ran = 0;
    for command in COMMANDS {
        let text = folder.run(&[command, "--help"]).code(0).stdout();
        for line in text.lines().filter_map(|line| line.trim_start().strip_prefix("ldi-ops ")) {
            // Formats that the program does not write, and names that the shell would expand.
            if line.contains(".3mf") || line.contains(".ply") || line.contains('*') {
                continue;
            }
            if cfg!(not(feature = "gpu")) && line.contains("--backend gpu") {
                continue;
            }
            // The shell writes what is printed into a file.
            let line = line.split(" > ").next().unwrap();
            let arguments = shell_words(line);
            let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
            // The last value counts, and a small one runs faster.
            if !line.contains("--resolution") && !line.contains("--tolerance") && line.contains(".stl") {
                match arguments[0] {
                    "check" | "convert" | "generate" => {}
                    "render" => arguments.extend(["--size", "64x48"]),
                    _ => arguments.extend(["--resolution", "32"]),
                }
            }
            folder.run(&arguments).code(0);
            ran += 1;
        }
    }
    assert!(ran >= 15, "{ran} examples");
}

/// Splits a command line into words; single quotes keep a word together.
fn shell_words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for (i, part) in line.split('\'').enumerate() {
        if i % 2 == 1 {
            words.last_mut().unwrap().push_str(part);
            continue;
        }
        for c in part.chars() {
            match c {
                ' ' => words.push(String::new()),
                c => words.last_mut().unwrap().push(c),
            }
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn wrong_usage_exits_with_two() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    for (arguments, words) in [
        (&[][..], &["Usage"][..]),
        (&["frobnicate"], &["frobnicate"]),
        (&["intersect", "a.stl"], &["<B>"]),
        (&["csg", "a"], &["<NAME=FILE>"]),
        (&["csg", "a", "a.stl"], &["'a.stl'", "NAME=FILE"]),
        (&["csg", "a", "a-b=a.stl"], &["`a-b` is not a valid name"]),
        (&["union", "a.stl", "a.stl", "--transform", "scale(2)"], &["NAME=PLACEMENT"]),
        (&["volume"], &["<A>"]),
        (&["volume", "a.stl", "--resolution", "10", "--pitch", "1"], &["--resolution", "--pitch"]),
        (&["volume", "a.stl", "--resolution", "10", "--tolerance", "1%"], &["--tolerance"]),
        (&["volume", "a.stl", "--pitch", "1", "--tolerance", "1%"], &["--tolerance"]),
        (&["volume", "a.stl", "--resolution", "0"], &["--resolution 0", "65536"]),
        (&["volume", "a.stl", "--resolution", "70000"], &["70000", "65536"]),
        (&["volume", "a.stl", "--resolution", "many"], &["many"]),
        (&["volume", "a.stl", "--pitch", "-1"], &["-1", "positive"]),
        (&["volume", "a.stl", "--pitch", "nan"], &["positive"]),
        (
            &["volume", "a.stl", "--pitch", "1e-9", "--estimate"],
            &["a.stl", "65536", "the least --pitch is 3.051805e-5"],
        ),
        (
            &["volume", "a.stl", "--pitch", "1e-300", "--estimate"],
            &["a.stl: more than 10^19 rays", "the least --pitch is 3.051805e-5"],
        ),
        (&["volume", "a.stl", "--tolerance", "0"], &["between 0 and 100 %"]),
        (&["volume", "a.stl", "--lod", "31"], &["--lod 31", "32 to 65536"]),
        (&["volume", "a.stl", "--axis", "w"], &["'w'", "x, y, z, all"]),
        (&["volume", "a.stl", "--threads", "0"], &["0"]),
        (&["volume", "a.stl", "--quiet", "-v"], &["--quiet"]),
        (&["volume", "a.stl", "--backend", "cpu", "--adapter", "A card"], &["--adapter A card", "--backend cpu"]),
        (&["sample", "a.stl"], &["--output"]),
        // A sample is an image, not a volume.
        (&["sample", "a.stl", "-o", "a.npz", "--bounds"], &["--bounds"]),
        (&["minkowski", "a.stl"], &["<B>"]),
        (&["minkowski", "a.stl", "a.stl", "--lod", "31"], &["--lod 31", "32 to 65536"]),
        (&["minkowski", "a.stl", "a.stl", "--allow-open"], &["--allow-open"]),
        (&["minkowski", "a.stl", "a.stl", "--axis", "x", "-o", "b.stl"], &["b.stl", "all axes"]),
        (&["minkowski", "a.stl", "a.stl", "-o", "a.stl"], &["a.stl", "overwritten"]),
        (&["offset", "a.stl"], &["--distance"]),
        (&["open", "a.stl"], &["--radius"]),
        (&["close", "a.stl", "--radius", "0"], &["--radius 0"]),
        (&["report"], &["<A>"]),
    ] {
        let run = folder.run(arguments).code(2);
        for word in words {
            assert!(run.stderr().contains(word), "no `{word}` in:\n{}", run.stderr());
        }
        assert_eq!(run.stdout(), "", "{arguments:?}");
    }
}

#[test]
fn requests_beyond_the_machine_exit_with_three() {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    // Four thousand million rays, and one row more than can be counted.
    folder.run(&["sample", "a.stl", "--resolution", "65535", "-o", "a.npz"]).code(3).says(&["rays"]);
    folder
        .run(&["sample", "a.stl", "--resolution", "65536", "-o", "a.npz"])
        .code(2)
        .says(&["too many rays: 65536 × 65536", "lower the resolution to 65535"]);
}

#[test]
fn commands_have_aliases() {
    let folder = Folder::with_two_cubes();
    for (word, command) in [
        ("subtract", "difference"),
        ("minus", "difference"),
        ("and", "intersect"),
        ("common", "intersect"),
        ("or", "union"),
        ("join", "union"),
        ("merge", "union"),
    ] {
        let result = folder.json(&[word, "a.stl", "b.stl", "--resolution", "30"]);
        assert_eq!(result["command"], command);
    }
    assert_eq!(folder.json(&["info", "a.stl"])["command"], "check");
    for arguments in [&["repair", "a.stl", "-o", "b.stl"][..], &["repair"], &["fix", "--holes", "a.stl"]] {
        let run = folder.run(arguments).code(2);
        run.says(&["no command repairs", "ldi-ops check", "--allow-open", "--fill nonzero", "ldi-ops sample"]);
    }
    assert!(!folder.run(&["--help"]).code(0).stdout().contains("repair"));
}
