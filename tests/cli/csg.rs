//! Expressions over named solids, and placements by name.

use crate::{Folder, assert_near, cube, cuboid, warning_codes};

/// Two cubes and a slab in a box of side 3. Volumes: |A| 8, |B| 8, |C| 9, A∩B 1, A∩C 4; B∩C is empty.
fn three_solids() -> Folder {
    let folder = Folder::new();
    folder.stl("a.stl", &cube(0.0, 2.0));
    folder.stl("b.stl", &cube(1.0, 2.0));
    folder.stl("c.stl", &cuboid([0.0; 3], [3.0, 3.0, 1.0]));
    folder
}

const FILES: [&str; 3] = ["a=a.stl", "b=b.stl", "c=c.stl"];

#[test]
fn expressions_have_their_volumes_in_every_mode() {
    let folder = three_solids();
    for mode in ["over", "under", "exact"] {
        for (expression, files, expected) in [
            ("a", &FILES[..1], 8.0),
            ("a & b", &FILES[..2], 1.0),
            ("b & (a | c)", &FILES, 1.0),
            ("a & (b | c)", &FILES, 5.0),
            ("a | b & c", &FILES, 8.0),
            ("a - (b | c)", &FILES, 3.0),
            ("a - b - c", &FILES, 3.0),
            ("a - (b - c)", &FILES, 7.0),
            ("a ^ b ^ c", &FILES, 15.0),
            ("a ^ (b | c)", &FILES, 15.0),
            ("c - (a ^ b)", &FILES, 5.0),
            ("(a | b | c) - (a & c)", &FILES, 16.0),
        ] {
            let arguments =
                [&["csg", expression], files, &["--mode", mode, "--axis", "z", "--resolution", "300"]].concat();
            assert_near(folder.volume(&arguments), expected, 1e-6);
        }
    }
}

#[test]
fn expressions_give_the_numbers_of_the_equivalent_command() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "10", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "torus", "--major", "9", "-o", "b.stl"]).code(0);
    folder.run(&["generate", "gyroid", "--cells", "1", "-o", "c.stl"]).code(0);
    for mode in ["over", "under", "exact"] {
        for (command, sign) in [("intersect", "&"), ("union", "|"), ("difference", "-"), ("xor", "^")] {
            for count in [2, 3] {
                let files = ["a.stl", "b.stl", "c.stl"];
                let rest = ["--mode", mode, "--resolution", "64", "--lod", "64"];
                let by_command = folder.json(&[&[command], &files[..count], &rest].concat());
                let expression = ["a", "b", "c"][..count].join(sign);
                let named = ["a=a.stl", "b=b.stl", "c=c.stl"];
                let by_expression = folder.json(&[&["csg", &expression], &named[..count], &rest].concat());
                for key in ["volume", "samples", "layers_max", "grid"] {
                    assert_eq!(by_command[key], by_expression[key], "{command}, {count} solids, {mode}: {key}");
                }
            }
        }
    }
}

#[test]
fn estimates_of_nested_expressions_enclose_the_exact_volume() {
    let folder = Folder::new();
    folder.run(&["generate", "sphere", "--radius", "10", "-o", "a.stl"]).code(0);
    folder.run(&["generate", "torus", "--major", "9", "-o", "b.stl"]).code(0);
    folder.run(&["generate", "gyroid", "--cells", "1", "-o", "c.stl"]).code(0);
    for expression in ["a - (b - c)", "a ^ b ^ c", "a - (b ^ c)", "(a ^ b) & c"] {
        let volume = |mode| {
            let files = ["a=a.stl", "b=b.stl", "c=c.stl"];
            let rest = ["--estimate", "--mode", mode, "--lod", "64", "--resolution", "100", "--axis", "y"];
            folder.volume(&[&["csg", expression], &files[..], &rest].concat())
        };
        let (under, exact, over) = (volume("under"), volume("exact"), volume("over"));
        assert!(under <= exact && exact <= over && under < over, "{expression}: {under} {exact} {over}");
    }
}

#[test]
fn json_and_text_state_the_expression_and_the_names() {
    let folder = three_solids();
    let arguments = ["csg", "knochen & (b | größe)", "größe=c.stl", "b=b.stl", "knochen=a.stl", "--resolution", "30"];
    let result = folder.json(&arguments);
    assert_eq!(result["command"], "csg");
    assert_eq!(result["expression"], "knochen & (b | größe)");
    let names: Vec<&str> = (0..3).map(|i| result["inputs"][i]["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["größe", "b", "knochen"]);
    assert_eq!(result["inputs"][0]["path"], "c.stl");
    assert_near(result["volume"]["value"].as_f64().unwrap(), 5.0, 1e-6);
    let run = folder.run(&[&arguments[..], &["-v"]].concat()).code(0);
    assert!(run.stderr().contains("expression  knochen & (b | größe)\n"), "{}", run.stderr());
    for words in ["csg ", "größe = c.stl: 12 triangles", "knochen = a.stl"] {
        assert!(run.stdout().contains(words), "no `{words}` in:\n{}", run.stdout());
    }
    // The commands have no names from the user to repeat.
    let result = folder.json(&["union", "a.stl", "b.stl", "--resolution", "30"]);
    assert!(result.get("expression").is_none() && result["inputs"][0].get("name").is_none());
}

#[test]
fn errors_mark_the_fault_in_an_expression() {
    let folder = three_solids();
    let says = |arguments: &[&str], words: &[&str]| {
        folder.run(&[&["csg"], arguments].concat()).code(2).says(words);
    };
    says(&["a & @ b", "a=a.stl", "b=b.stl"], &["character 5", "a name or `(`, found `@`", "\n    a & @ b\n        ^"]);
    // The program counts characters, not bytes.
    says(&["größe b", "größe=a.stl", "b=b.stl"], &["character 7", "an operator, one of", "\n    größe b\n          ^"]);
    says(&["a | b)", "a=a.stl", "b=b.stl"], &["character 6", "has no matching", "\n    a | b)\n         ^"]);
    says(&["(a | b", "a=a.stl", "b=b.stl"], &["character 1", "no matching", "\n    (a | b\n    ^"]);
    says(&["a |", "a=a.stl"], &["character 4", "found the end"]);
    says(&["", "a=a.stl"], &["character 1", "found the end"]);
    says(&["a | d", "a=a.stl", "b=b.stl"], &["character 5", "no input is named `d`; the inputs are a, b"]);
    says(&["a", "a=a.stl", "b=b.stl"], &["the input `b` does not occur in the expression"]);
    says(&["a", "a=a.stl", "a=b.stl"], &["two inputs are named `a`"]);
    says(&["a", "a=none.stl"], &["none.stl"]);
    // A long expression is shortened around the fault.
    let long = format!("{}a @ a{}", "a | ".repeat(1000), " | a".repeat(1000));
    says(&[&long, "a=a.stl"], &["character 4003", "\n    … ", " …\n"]);
}

#[test]
fn deep_expressions_are_evaluated() {
    let folder = three_solids();
    // Longer expressions exceed the limit of Linux for one argument.
    let deep = format!("{}b{}", "a - (".repeat(15_000), ")".repeat(15_000));
    let volume = folder.volume(&["csg", &deep, "a=a.stl", "b=b.stl", "--axis", "z", "--resolution", "30"]);
    assert_near(volume, 1.0, 1e-6);
}

#[test]
fn inputs_are_placed_by_name() {
    let folder = three_solids();
    let common = |arguments: &[&str]| {
        folder.volume(&[arguments, &["--axis", "z", "--mode", "exact", "--resolution", "300"]].concat())
    };
    let csg = |rest: &[&str]| common(&[&["csg", "one & two", "one=a.stl", "two=a.stl"], rest].concat());
    assert_near(csg(&[]), 8.0, 1e-6);
    assert_near(csg(&["--transform", "two=translate(1,0,0) translate(0,1,0)"]), 2.0, 1e-6);
    assert_near(csg(&["--transform", "two=translate(1,0,0)", "--transform", "one=translate(0,1,0)"]), 2.0, 1e-6);
    // Inputs without names are called a, b, c, …
    let list = |rest: &[&str]| common(&[&["intersect", "a.stl", "a.stl", "a.stl"], rest].concat());
    assert_near(list(&["--transform", "c=translate(0,1,0)"]), 4.0, 1e-6);
    let three = ["--transform-a", "translate(1,0,0)", "--transform", "b=translate(0,1,0)", "--transform", "c=scale(2)"];
    assert_near(list(&three), 2.0, 1e-6);
    // The short flags mean the inputs with these names.
    let minus = ["csg", "b - a", "b=a.stl", "a=a.stl", "--transform-a"];
    assert_near(common(&[&minus[..], &["scale(0.5)"]].concat()), 7.0, 1e-6);
    assert_near(common(&[&minus[..], &["scale(0.5)", "--transform-b", "scale(2)"]].concat()), 63.0, 1e-6);
    let csg = ["csg", "one & two", "one=a.stl", "two=a.stl", "--transform-b", "scale(2)"];
    folder.run(&csg).code(2).says(&["--transform-b: no input is named `b`; the inputs are one, two"]);
    let picture = ["render", "a.stl", "-o", "a.png", "--transform-b", "scale(2)"];
    folder.run(&picture).code(2).says(&["--transform-b: no input is named `b`; the inputs are a"]);
    for (rest, words) in [
        (&["--transform", "d=scale(2)"][..], &["no input is named `d`; the inputs are a, b, c"][..]),
        (&["--transform-b", "scale(2)", "--transform", "b=scale(2)"], &["`b` has a placement already"]),
        (&["--transform", "c=scale(2)", "--transform", "c=scale(2)"], &["`c` has a placement already"]),
        (&["--transform", "c=scale(0)"], &["scale of 0", "^"]),
    ] {
        folder.run(&[&["union", "a.stl", "a.stl", "a.stl"], rest].concat()).code(2).says(words);
    }
}

#[test]
fn inputs_may_occur_twice_and_lie_far_apart() {
    let folder = three_solids();
    folder.stl("far.stl", &cube(40.0, 2.0));
    let result = folder.json(&[
        "csg",
        "(a - b) | (b - a) | far",
        "a=a.stl",
        "b=b.stl",
        "far=far.stl",
        "--mode",
        "exact",
        "--resolution",
        "420",
    ]);
    assert_near(result["volume"]["value"].as_f64().unwrap(), 22.0, 1e-6);
    assert!(warning_codes(&result).iter().all(|&code| code == "unit-assumed"), "{result}");
    let nothing = folder.volume(&["csg", "a & (far | far - a)", "a=a.stl", "far=far.stl", "--resolution", "42"]);
    assert_eq!(nothing, 0.0);
}

#[test]
fn open_meshes_are_evaluated_with_allow_open() {
    let folder = three_solids();
    folder.stl("open.stl", &cube(0.0, 2.0)[2..]);
    let arguments = ["csg", "a - o", "a=a.stl", "o=open.stl", "--resolution", "30"];
    folder.run(&arguments).code(2).says(&["open.stl", "--allow-open"]);
    let result = folder.json(&[&arguments[..], &["--allow-open"]].concat());
    assert!(result["unclosed_rays"].as_u64().unwrap() > 0);
    assert!(warning_codes(&result).contains(&"open"));
}

#[test]
fn expressions_write_their_image() {
    let folder = three_solids();
    let run = ["csg", "a & (b | c)", "a=a.stl", "b=b.stl", "c=c.stl", "--resolution", "30", "-o", "r.npz"];
    assert_eq!(folder.json(&run)["output"], "r.npz");
    assert!(folder.names().contains(&"r.npz".to_owned()));
    folder.run(&[&run[..7], &["-o", "r.doc"]].concat()).code(2).says(&["r.doc"]);
}
