//! No output overwrites an input or another output, whatever path leads to it.

use std::fs;

use crate::{Folder, cube, read};

/// Asserts that a command is refused for this reason, and that no file has changed.
#[track_caller]
fn is_refused(folder: &Folder, arguments: &[&str], words: &[&str]) {
    let contents = || -> Vec<(String, Vec<u8>)> {
        let files = folder.names().into_iter().filter(|name| folder.path(name).is_file());
        files.map(|name| (name.clone(), fs::read(folder.path(&name)).unwrap())).collect()
    };
    let before = contents();
    folder.run(arguments).code(2).says(words);
    assert!(contents() == before, "{arguments:?} changed a file");
}

#[test]
fn json_never_overwrites_an_input() {
    let folder = Folder::with_two_cubes();
    folder.run(&["sample", "a.stl", "--resolution", "8", "-o", "a.npz"]).code(0);
    fs::write(folder.path("limits.toml"), "").unwrap();
    for command in [
        &["volume", "a.stl"][..],
        &["volume", "b.stl", "a.stl"],
        &["intersect", "b.stl", "a.stl"],
        &["csg", "p | q", "p=b.stl", "q=a.stl"],
        &["minkowski", "b.stl", "a.stl"],
        &["offset", "a.stl", "--distance", "1"],
        &["open", "a.stl", "--radius", "1"],
        &["close", "a.stl", "--radius", "1"],
        &["check", "b.stl", "a.stl"],
        &["convert", "a.stl", "-o", "c.stl"],
        &["sample", "a.stl", "-o", "c.npz"],
        &["render", "a.stl", "-o", "c.png"],
        &["report", "a.stl", "-o", "out"],
        &["report", "b.stl", "--roi", "a.stl", "-o", "out"],
        &["report", "b.stl", "--compare", "a.stl", "-o", "out"],
    ] {
        let arguments = [command, &["--json", "a.stl"]].concat();
        is_refused(&folder, &arguments, &["--json a.stl", "the input a.stl", "overwritten"]);
    }
    is_refused(&folder, &["surface", "a.npz", "-o", "c.stl", "--json", "a.npz"], &["--json a.npz", "overwritten"]);
    let report = ["report", "a.stl", "-o", "out", "--limits", "limits.toml", "--json", "limits.toml"];
    is_refused(&folder, &report, &["--json limits.toml", "overwritten"]);
}

#[test]
fn reports_never_overwrite_what_they_read() {
    let folder = Folder::with_two_cubes();
    fs::create_dir(folder.path("out")).unwrap();
    fs::write(folder.path("out/metrics.csv"), "").unwrap();
    let arguments = ["report", "a.stl", "-o", "out", "--limits", "out/metrics.csv"];
    is_refused(&folder, &arguments, &["out/metrics.csv, a file of the report", "overwritten"]);
    let arguments = ["report", "a.stl", "-o", "out", "--json", "out/metrics.json"];
    is_refused(&folder, &arguments, &["--json out/metrics.json", "same file"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../a.stl", folder.path("out/report.html")).unwrap();
        is_refused(&folder, &["report", "a.stl", "-o", "out"], &["out/report.html", "the input a.stl"]);
    }
}

#[test]
fn inputs_are_protected_whatever_path_leads_to_them() {
    let folder = Folder::with_two_cubes();
    fs::create_dir(folder.path("inner")).unwrap();
    let whole = folder.path("a.stl");
    let mut paths = vec!["./a.stl", "inner/../a.stl", whole.to_str().unwrap()];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("a.stl", folder.path("soft.stl")).unwrap();
        fs::hard_link(folder.path("a.stl"), folder.path("hard.stl")).unwrap();
        std::os::unix::fs::symlink("inner", folder.path("linked")).unwrap();
        paths.extend(["soft.stl", "hard.stl", "linked/../a.stl"]);
    }
    for path in paths {
        is_refused(&folder, &["volume", "a.stl", "--json", path], &["--json", "overwritten"]);
        is_refused(&folder, &["convert", "a.stl", "-o", path], &["-o", "overwritten"]);
        is_refused(&folder, &["union", "b.stl", path, "-o", "a.stl"], &["-o a.stl", "overwritten"]);
    }
}

#[cfg(unix)]
#[test]
fn two_links_to_one_new_file_are_refused_as_outputs() {
    let folder = Folder::with_two_cubes();
    std::os::unix::fs::symlink("new.stl", folder.path("link.stl")).unwrap();
    is_refused(&folder, &["convert", "a.stl", "-o", "new.stl", "--json", "link.stl"], &["same file"]);
}

#[test]
fn files_that_an_input_refers_to_are_not_overwritten() {
    let folder = Folder::new();
    let corners = [[0f32, 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend([0u8, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]);
    fs::write(folder.path("a buffer.stl"), &bytes).unwrap();
    let document = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
            {"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":12}],
        "images":[{"uri":"skin.png"}],"buffers":[{"byteLength":60,"uri":"a%20buffer.stl"}]}"#;
    fs::write(folder.path("a.gltf"), document).unwrap();
    fs::write(folder.path("skin.png"), "").unwrap();
    let words = ["-o a buffer.stl", "which a.gltf refers to"];
    is_refused(&folder, &["convert", "a.gltf", "-o", "a buffer.stl"], &words);
    is_refused(&folder, &["volume", "a.gltf", "--json", "./a buffer.stl"], &["--json", "which a.gltf refers to"]);
    is_refused(&folder, &["render", "a.gltf", "-o", "skin.png"], &["-o skin.png", "which a.gltf refers to"]);
    folder.run(&["convert", "a.gltf", "-o", "b.stl"]).code(0);
    folder.stl("c.stl", &cube(0.0, 1.0));
    folder.run(&["convert", "c.stl", "-o", "b.stl", "--json", "b.json"]).code(0);
    assert!(read(&folder.path("b.json")).contains("b.stl"));
}
