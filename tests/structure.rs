//! Checks the text of the sources: which modules may import which, where printing, file formats and the GPU may be named, that
//! every module has a doc comment, and that no large file is in the tree.
//!
//! The checks first remove comments, string literals and code that only tests compile. They expand `use` trees and resolve
//! `super`, `self` and the crate's own name, so that every spelling of an import is found.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The largest size of a file in the tree, in bytes; a larger file does not belong in the history of the sources.
const LARGEST_FILE: u64 = 2 << 20;

/// Crates that read or write file formats.
const FORMAT_CRATES: &[&str] = &[
    "tobj",
    "gltf",
    "gltf_json",
    "png",
    "zip",
    "flate2",
    "quick_xml",
    "serde_json",
    "ply_rs_bw",
    "stl_io",
    "threemf2",
    "ndarray_npy",
];

/// Paths that may name those crates.
const FORMAT_PLACES: &[&str] = &[
    "src/mesh/io/",
    "src/ldi/npz/",
    "src/voxels/",
    "src/picture/png.rs",
    // By way of `picture::png`.
    "src/driver/render.rs",
    // Pages hold pictures, and metrics are written as JSON.
    "src/report/",
];

/// The upper floors: the facade, and the driver and the reports behind it. No other module imports them.
const UPPER_FLOORS: &[&str] = &[
    "src/driver/",
    "src/report/",
    "src/lib.rs",
    "src/solid.rs",
    "src/shape.rs",
    "src/settings.rs",
    "src/sampled.rs",
    "src/estimate.rs",
];

/// Sources that divide work by Rayon's own iterators, which compile their work stealing anew for each closure. All others take
/// those of `src/parallel.rs`, which have no sets and maps.
const OWN_DIVISION: &[&str] = &["src/parallel.rs", "src/surface/cuts/choice.rs"];

/// Modules that work on images and must not depend on the modules that make them.
const OPERATIONS: &[&str] = &[
    "src/boolean",
    "src/integrate",
    "src/minkowski",
    "src/metrics",
    "src/surface",
    "src/voxels",
    "src/ldi",
    "src/picture",
];

#[test]
fn no_source_breaks_the_structure_rules() {
    let root = root();
    let mut wrong = Vec::new();
    let mut seen = 0;
    for path in rust_files(&root) {
        let text = fs::read_to_string(root.join(&path)).unwrap();
        wrong.extend(faults(&path, &text));
        seen += 1;
    }
    assert!(seen > 40, "only {seen} sources were found");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// Asserts that no constant is declared both in Rust and in WGSL; shared constants are declared in Rust and emitted into WGSL
/// (`src/sampler/gpu/view.rs`).
#[test]
fn no_constant_is_declared_in_both_rust_and_wgsl() {
    let root = root();
    let constants = |text: &str, of: &[char]| -> Vec<String> {
        let names = text.lines().filter_map(|line| line.trim_start().trim_start_matches("pub ").strip_prefix("const "));
        names.map(|rest| rest.split(of).next().unwrap_or_default().trim().to_owned()).collect()
    };
    let read = |path: &String| fs::read_to_string(root.join(path)).unwrap();
    let all = files(&root);
    let shaders: Vec<&String> = all.iter().filter(|path| path.ends_with(".wgsl")).collect();
    assert!(shaders.len() > 10, "only {} shaders were found", shaders.len());
    let in_wgsl: Vec<String> = shaders.into_iter().flat_map(|path| constants(&read(path), &[':', '='])).collect();
    assert!(!in_wgsl.is_empty());
    let sources = rust_files(&root).into_iter().filter(|path| path.starts_with("src/"));
    for path in sources {
        let twice: Vec<String> =
            constants(&read(&path), &[':']).into_iter().filter(|name| in_wgsl.contains(name)).collect();
        assert!(twice.is_empty(), "{path} and a shader both declare {twice:?}");
    }
}

#[test]
fn no_file_of_the_tree_exceeds_the_size_limit() {
    let root = root();
    let mut seen = 0;
    for path in files(&root) {
        // Git still lists a removed file until the removal is committed.
        let Ok(data) = fs::metadata(root.join(&path)) else { continue };
        seen += 1;
        assert!(!is_large(data.len()), "{path} has {} bytes", data.len());
    }
    assert!(seen > 60, "only {seen} files were found");
}

fn is_large(bytes: u64) -> bool {
    bytes > LARGEST_FILE
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the files of the tree by their paths from the root: those that git tracks or would add, or all where git is not
/// available.
fn files(root: &Path) -> Vec<String> {
    let listed = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root)
        .output();
    if let Ok(output) = listed
        && output.status.success()
        && !output.stdout.is_empty()
    {
        let names = output.stdout.split(|&byte| byte == 0).filter(|name| !name.is_empty());
        return names.map(|name| String::from_utf8(name.to_vec()).unwrap()).collect();
    }
    let mut found = Vec::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            if name.starts_with('.') || name == "target" {
                continue;
            }
            match entry.file_type().unwrap().is_dir() {
                true => folders.push(entry.path()),
                false => found.push(entry.path().strip_prefix(root).unwrap().to_str().unwrap().to_owned()),
            }
        }
    }
    found
}

fn rust_files(root: &Path) -> Vec<String> {
    let mut paths: Vec<String> = files(root).into_iter().filter(|path| path.ends_with(".rs")).collect();
    paths.retain(|path| root.join(path).exists());
    paths
}

/// Returns everything that is wrong with one source.
fn faults(path: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fault = |what: String| found.push(format!("{path}: {what}"));
    if !text.trim_start().starts_with("//!") {
        fault("does not begin with the docs of its module".to_owned());
    }
    let code = without_comments_and_strings(text);
    let whole = imports(path, &code);
    if ["tests/oracle/brute_force.rs", "tests/oracle/sums.rs"].contains(&path) && names_crate(&whole, "ldi_ops") {
        fault("the oracle imports the library".to_owned());
    }
    if !path.starts_with("src/") {
        return found;
    }
    // A test module with its own file or folder stands behind `#[cfg(test)]` in the parent module.
    let code = match path.starts_with("src/") && (path.ends_with("/tests.rs") || path.contains("/tests/")) {
        true => String::new(),
        false => without_tests(&code),
    };
    let paths = imports(path, &code);
    let in_gpu = path.starts_with("src/sampler/gpu") || path.split('/').any(|folder| folder == "gpu");
    if !in_gpu && names_crate(&paths, "wgpu") {
        fault("names wgpu outside a gpu folder".to_owned());
    }
    if !FORMAT_PLACES.iter().any(|place| path.starts_with(place)) {
        for name in FORMAT_CRATES.iter().filter(|name| names_crate(&paths, name)) {
            fault(format!("names {name}, a file format"));
        }
    }
    let is_division = |path: &Vec<String>| {
        let names = |at: usize, names: &[&str]| path.get(at).is_some_and(|name| names.contains(&name.as_str()));
        let is_iterator = names(1, &["iter"]) && !names(2, &["Either"]);
        names(0, &["rayon"]) && (is_iterator || names(1, &["join", "join_context", "prelude", "slice"]))
    };
    if !OWN_DIVISION.contains(&path) && paths.iter().any(is_division) {
        fault("names Rayon's iterators; take crate::parallel".to_owned());
    }
    for name in ["clap", "anyhow", "indicatif"].into_iter().filter(|name| names_crate(&paths, name)) {
        fault(format!("names {name}, which is for applications"));
    }
    for name in ["print", "println", "eprint", "eprintln", "dbg"].into_iter().filter(|name| calls_macro(&code, name)) {
        fault(format!("prints with {name}!"));
    }
    let imports = |module: &str| {
        let module: Vec<&str> = ["crate"].into_iter().chain(module.split("::")).collect();
        paths.iter().any(|path| path.len() >= module.len() && path.iter().zip(&module).all(|(a, b)| a == b))
    };
    if !UPPER_FLOORS.iter().any(|floor| path.starts_with(floor)) {
        for name in
            ["driver", "report", "solid", "shape", "settings", "sampled"].into_iter().filter(|name| imports(name))
        {
            fault(format!("imports {name} from an upper floor"));
        }
    }
    let is_operation = OPERATIONS
        .iter()
        .any(|operation| path.strip_prefix(operation).is_some_and(|rest| rest == ".rs" || rest.starts_with('/')));
    if is_operation {
        // A sum has no mesh to sample: the sampler's stages make its images from the crossings of its primitives.
        if imports("sampler") && !path.starts_with("src/minkowski") {
            fault("an operation imports the sampler".to_owned());
        }
        if imports("mesh") && !path.starts_with("src/surface") {
            fault("an operation imports meshes".to_owned());
        }
    }
    if path.starts_with("src/sampler/cpu") && imports("sampler::gpu") {
        fault("the cpu's sampler imports the gpu's".to_owned());
    }
    if path.starts_with("src/sampler/gpu") && imports("sampler::cpu") {
        fault("the gpu's sampler imports the cpu's".to_owned());
    }
    found
}

/// Returns the code with comments and the contents of literals replaced by spaces; line numbers stay the same.
fn without_comments_and_strings(text: &str) -> String {
    let bytes: Vec<char> = text.chars().collect();
    let at = |i: usize| bytes.get(i).copied().unwrap_or('\0');
    let mut code = String::new();
    let mut i = 0;
    let blank = |code: &mut String, c: char| code.push(if c == '\n' { '\n' } else { ' ' });
    while i < bytes.len() {
        let after_name = i > 0 && (at(i - 1).is_alphanumeric() || at(i - 1) == '_');
        if at(i) == '/' && at(i + 1) == '/' {
            while i < bytes.len() && at(i) != '\n' {
                i += 1;
            }
        } else if at(i) == '/' && at(i + 1) == '*' {
            let mut depth = 0;
            loop {
                if at(i) == '/' && at(i + 1) == '*' {
                    depth += 1;
                    i += 2;
                } else if at(i) == '*' && at(i + 1) == '/' {
                    depth -= 1;
                    i += 2;
                } else {
                    blank(&mut code, at(i));
                    i += 1;
                }
                if depth == 0 || i >= bytes.len() {
                    break;
                }
            }
        } else if !after_name && at(i) == 'r' && (at(i + 1) == '"' || (at(i + 1) == '#' && "#\"".contains(at(i + 2)))) {
            let hashes = (0..).take_while(|k| at(i + 1 + k) == '#').count();
            i += hashes + 2;
            let closes = |i: usize| at(i) == '"' && (1..=hashes).all(|k| at(i + k) == '#');
            while i < bytes.len() && !closes(i) {
                blank(&mut code, at(i));
                i += 1;
            }
            i += hashes + 1;
        } else if at(i) == '"' {
            i += 1;
            while i < bytes.len() && at(i) != '"' {
                blank(&mut code, at(i));
                i += if at(i) == '\\' { 2 } else { 1 };
            }
            i += 1;
            code.push(' ');
        } else if at(i) == '\'' && (at(i + 2) == '\'' || at(i + 1) == '\\') {
            // This is a character literal; any other quote begins a lifetime.
            i += if at(i + 1) == '\\' { 3 } else { 2 };
            while i < bytes.len() && at(i) != '\'' {
                i += 1;
            }
            i += 1;
            code.push(' ');
        } else {
            code.push(at(i));
            i += 1;
        }
    }
    code
}

/// Returns the code without the items behind `#[cfg(test)]`.
fn without_tests(code: &str) -> String {
    let mut rest = code;
    let mut kept = String::new();
    while let Some(start) = rest.find("#[cfg(test)]") {
        kept.push_str(&rest[..start]);
        let item = &rest[start + "#[cfg(test)]".len()..];
        // An item ends with its block, or with a semicolon if one comes first.
        let end = match (item.find('{'), item.find(';')) {
            (Some(block), semicolon) if semicolon.is_none_or(|semicolon| block < semicolon) => {
                let mut depth = 0;
                let close = item[block..].char_indices().find(|&(_, c)| {
                    depth += i32::from(c == '{') - i32::from(c == '}');
                    depth == 0
                });
                close.map_or(item.len(), |(close, _)| block + close + 1)
            }
            (_, Some(semicolon)) => semicolon + 1,
            _ => item.len(),
        };
        rest = &item[end..];
    }
    kept + rest
}

/// Returns every path in the code, with `use` trees expanded and `self` and `super` resolved by the file's module.
fn imports(file: &str, code: &str) -> Vec<Vec<String>> {
    let tokens = tokens(code);
    let mut found = Vec::new();
    let mut i = 0;
    while i < tokens.len() {
        if tokens[i] == "use" {
            i += 1;
            tree(&tokens, &mut i, Vec::new(), &mut found);
        } else if is_name(&tokens[i]) && (i == 0 || tokens[i - 1] != "::") {
            let mut path = vec![tokens[i].clone()];
            while i + 2 < tokens.len() && tokens[i + 1] == "::" && is_name(&tokens[i + 2]) {
                path.push(tokens[i + 2].clone());
                i += 2;
            }
            found.push(path);
            i += 1;
        } else {
            i += 1;
        }
    }
    let module = module_of(file);
    found.into_iter().map(|path| resolved(&module, path)).collect()
}

/// Reads one `use` tree from `tokens[*i]` on and adds its paths, each prefixed with `before`.
fn tree(tokens: &[String], i: &mut usize, mut before: Vec<String>, found: &mut Vec<Vec<String>>) {
    while *i < tokens.len() {
        match tokens[*i].as_str() {
            "::" => *i += 1,
            "{" => {
                *i += 1;
                while *i < tokens.len() && tokens[*i] != "}" {
                    tree(tokens, i, before.clone(), found);
                    if tokens.get(*i).is_some_and(|token| token == ",") {
                        *i += 1;
                    }
                }
                *i += 1;
                return;
            }
            "as" => *i += 2,
            token if is_name(token) || token == "*" => {
                before.push(token.to_owned());
                *i += 1;
            }
            _ => break,
        }
    }
    found.push(before);
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Splits code into names, `::`, and every other single character that is not a space.
fn tokens(code: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let mut characters = code.chars().peekable();
    while let Some(c) = characters.next() {
        if c.is_alphanumeric() || c == '_' {
            let mut name = c.to_string();
            while let Some(c) = characters.next_if(|c| c.is_alphanumeric() || *c == '_') {
                name.push(c);
            }
            tokens.push(name);
        } else if c == ':' && characters.next_if_eq(&':').is_some() {
            tokens.push("::".to_owned());
        } else if !c.is_whitespace() {
            tokens.push(c.to_string());
        }
    }
    tokens
}

/// Returns the module path, from the crate on, of a file of the library.
fn module_of(file: &str) -> Vec<String> {
    let inner = file.strip_prefix("src/").unwrap_or(file).trim_end_matches(".rs");
    let names = inner.split('/').filter(|name| !["mod", "lib", "main"].contains(name)).map(str::to_owned);
    ["crate".to_owned()].into_iter().chain(names).collect()
}

fn resolved(module: &[String], path: Vec<String>) -> Vec<String> {
    match path.first().map(String::as_str) {
        Some("self") => module.iter().cloned().chain(path.into_iter().skip(1)).collect(),
        Some("super") => {
            let up = path.iter().take_while(|name| *name == "super").count();
            let above = module[..module.len().saturating_sub(up).max(1)].to_vec();
            above.into_iter().chain(path.into_iter().skip(up)).collect()
        }
        Some("ldi_ops") if module.len() > 1 && module[1] != "tests" => {
            ["crate".to_owned()].into_iter().chain(path.into_iter().skip(1)).collect()
        }
        _ => path,
    }
}

fn names_crate(paths: &[Vec<String>], name: &str) -> bool {
    // A path of one name is a variable or a type, except in `use`, where a bare crate is useful only for its macros.
    paths.iter().any(|path| path.first().is_some_and(|first| first == name) && path.len() > 1)
}

fn calls_macro(code: &str, name: &str) -> bool {
    let tokens = tokens(code);
    tokens.windows(2).any(|pair| pair[0] == name && pair[1] == "!")
}

mod tests {
    use super::*;

    /// Returns the faults of a source that has a module comment.
    fn faults_of(path: &str, code: &str) -> Vec<String> {
        faults(path, &format!("//! A module.\n{code}"))
    }

    #[test]
    fn snippets_that_break_a_rule_are_found() {
        let bad = [
            ("src/sampler/cpu/mod.rs", "use wgpu::Device;"),
            ("src/boolean/mod.rs", "fn f(device: &wgpu::Device) {}"),
            ("src/mesh/check/mod.rs", "use tobj::load_obj;"),
            ("src/ldi/mod.rs", "use zip::{CompressionMethod, ZipWriter};"),
            ("src/mesh/mod.rs", "fn f() { let v: serde_json::Value = serde_json::from_str(x).unwrap(); }"),
            ("src/grid/mod.rs", "use gltf::Gltf;"),
            ("src/ldi/nodes.rs", "use flate2::Compression;"),
            ("src/voxels/vti.rs", "use crate::mesh::LengthUnit;"),
            ("src/grid.rs", "use quick_xml::{Reader, events::Event};"),
            ("src/lib.rs", "use clap::Parser;"),
            ("src/lib.rs", "fn f() -> anyhow::Result<()> { Ok(()) }"),
            ("src/grid/mod.rs", "use crate::driver::machine;"),
            ("src/metrics/mod.rs", "fn f(report: &crate::report::Report) {}"),
            ("src/fixed.rs", "use rayon::prelude::*;"),
            ("src/fixed.rs", "use rayon::iter::{IntoParallelIterator, ParallelIterator};"),
            ("src/fixed.rs", "fn f() { rayon::join(a, b); }"),
            ("src/fixed.rs", "fn f() { println!(\"x\") }"),
            ("src/fixed.rs", "fn f() { eprintln ! (\"x\") }"),
            ("src/fixed.rs", "fn f() { std::print!(\"x\"); }"),
            ("src/boolean.rs", "use crate::sampler::Mode;"),
            ("src/boolean.rs", "use crate::{grid::Axis, sampler::{FillRule, Mode}};"),
            ("src/boolean.rs", "use super::sampler;"),
            ("src/integrate.rs", "fn f(mesh: &crate::mesh::TriangleMesh) {}"),
            ("src/integrate.rs", "use crate::mesh as triangles;"),
            ("src/minkowski/flood.rs", "use super::super::mesh::Aabb;"),
            ("src/metrics/porosity.rs", "use ldi_ops::sampler::FillRule;"),
            ("src/surface/mod.rs", "use crate::sampler::Sampler;"),
            ("src/picture/scene.rs", "use crate::mesh::TriangleMesh;"),
            ("src/picture/canvas.rs", "use png::Encoder;"),
            ("src/ldi/spans.rs", "use super::super::{mesh, grid};"),
            ("src/sampler/cpu/raster.rs", "use super::super::gpu::Buffers;"),
            ("src/sampler/cpu/mod.rs", "use crate::sampler::{FillRule, gpu};"),
            ("src/sampler/gpu/mod.rs", "use super::cpu::CpuSampler;"),
            ("tests/oracle/brute_force.rs", "use ldi_ops::fixed::Pixels;"),
            ("tests/oracle/sums.rs", "use ldi_ops::fixed::Crossing;"),
            ("tests/oracle/brute_force.rs", "mod tests { fn f() { ldi_ops::grid::f() } }"),
        ];
        for (path, code) in bad {
            assert_eq!(faults_of(path, code).len(), 1, "{path}: {code}: {:?}", faults_of(path, code));
        }
        for undocumented in
            ["", "use glam::DVec3;", "// A remark.\nuse glam::DVec3;", "/// Of the next.\nuse glam::DVec3;"]
        {
            assert_eq!(faults("src/x.rs", undocumented).len(), 1, "{undocumented}");
            assert_eq!(faults("apps/ldi-ops/src/x.rs", undocumented).len(), 1, "{undocumented}");
        }
    }

    #[test]
    fn snippets_that_keep_the_rules_pass() {
        let good = [
            ("src/sampler/gpu/mod.rs", "use wgpu::Device; use super::layout::Voxels;"),
            ("src/minkowski/gpu/flood.rs", "use wgpu::Queue;"),
            ("src/mesh/io/gltf.rs", "use gltf::Gltf; use serde_json::Value;"),
            ("src/ldi/npz/write.rs", "use zip::ZipWriter;"),
            ("src/minkowski/sum.rs", "use crate::sampler::cpu::CpuSampler;"),
            ("src/surface/mod.rs", "use crate::mesh::TriangleMesh;"),
            (
                "src/fixed.rs",
                "use rayon::iter::Either; use crate::parallel::*; fn f() { rayon::current_num_threads(); }",
            ),
            ("src/boolean.rs", "use crate::grid::Axis; use crate::ldi::{Ldi, TooManySamples};"),
            ("src/integrate.rs", "#[cfg(test)]\nmod tests { use crate::sampler::Mode; use crate::mesh::ClosedMesh; }"),
            ("src/minkowski/ball/tests.rs", "use crate::mesh::ClosedMesh;"),
            ("src/minkowski/cull/tests/solids.rs", "use crate::mesh::ClosedMesh;"),
            ("src/integrate.rs", "#[cfg(test)] use crate::mesh::Aabb;\nuse crate::grid::Grid;"),
            ("src/fixed.rs", "/// Like `println!(x)`.\nfn f() { let s = \"eprintln!()\"; } /* wgpu::Device */"),
            ("src/fixed.rs", "fn f(zip: u32) -> u32 { a.iter().zip(b); let c = '\"'; zip }"),
            ("src/fixed.rs", "fn f<'a>(s: &'a str) { let r = r#\"use wgpu::X; \" \"#; write!(s, \"{}\", 1); }"),
            ("src/sampler/cpu/mod.rs", "use super::layout::Voxels; use crate::fixed::Pixels;"),
            ("apps/ldi-ops/src/main.rs", "use clap::Parser; fn f() { println!(\"x\") }"),
            ("tests/oracle/brute_force.rs", "use std::collections::BTreeMap; // not ldi_ops::fixed"),
        ];
        for (path, code) in good {
            assert_eq!(faults_of(path, code), [""; 0], "{path}: {code}");
        }
    }

    #[test]
    fn code_after_a_test_module_is_checked() {
        let code = "#[cfg(test)]\nmod tests { fn f() { if true { } } }\nuse crate::sampler::Mode;";
        assert_eq!(faults_of("src/boolean.rs", code).len(), 1);
        let code = "#[cfg(test)]\nmod testing;\nuse crate::sampler::Mode;";
        assert_eq!(faults_of("src/boolean.rs", code).len(), 1);
    }

    #[test]
    fn files_above_the_limit_are_large() {
        assert!(is_large((2 << 20) + 1) && !is_large(2 << 20) && !is_large(0));
    }
}
