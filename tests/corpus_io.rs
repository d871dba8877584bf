//! Reads a folder of real meshes, named by `LDI_CORPUS`, and compares with what its manifests say.
//!
//! The manifests were made with other software, in Python. OBJ files are read a second time with `tobj` as well.

use std::collections::BTreeMap;
use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use glam::DVec3;
use ldi_ops::mesh::TriangleMesh;
use ldi_ops::mesh::io::{Format, ReadError, read, write};
use serde_json::Value;

/// Every file that a manifest in the corpus or in the folder `large` beside it lists, with its entry.
fn corpus() -> Vec<(PathBuf, Value)> {
    let folder = std::env::var_os("LDI_CORPUS").expect("LDI_CORPUS names the folder of the corpus");
    let folder = PathBuf::from(folder);
    let mut files = Vec::new();
    for folder in [folder.join("meshes"), folder.join("large"), folder.clone(), folder.join("../large")] {
        let Ok(text) = fs::read_to_string(folder.join("manifest.json")) else { continue };
        let entries: Vec<Value> = serde_json::from_str(&text).expect("the manifest is a JSON list");
        for entry in entries {
            let path = folder.join(entry["name"].as_str().expect("an entry has a name"));
            files.push((path, entry));
        }
    }
    assert!(!files.is_empty(), "{} has no manifest.json", folder.display());
    files
}

/// The volume by the divergence theorem, about the box's centre so that places far from the origin cost no digits.
fn volume(mesh: &TriangleMesh) -> f64 {
    let used = || mesh.triangles.iter().flatten().map(|&index| mesh.positions[index as usize]);
    let min = used().fold(DVec3::INFINITY, DVec3::min);
    let max = used().fold(DVec3::NEG_INFINITY, DVec3::max);
    let centre = min + (max - min) / 2.0;
    let corner = |index: u32| mesh.positions[index as usize] - centre;
    mesh.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

fn is_close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-6 * expected.abs()
}

/// What is wrong with a file that should be read, or nothing.
fn compare(path: &Path, entry: &Value) -> Option<String> {
    let file = match read(path) {
        Ok(file) => file,
        // A scaffold of beams alone is listed without triangles.
        Err(ReadError::Unsupported { .. }) if entry["tri"].is_null() => return None,
        Err(error) => return Some(error.to_string()),
    };
    let triangles = file.mesh.triangles.len() as u64;
    if entry["tri"].as_u64() != Some(triangles) {
        return Some(format!("{}: {triangles} triangles, and the manifest has {}", path.display(), entry["tri"]));
    }
    let (found, expected) = (volume(&file.mesh), entry["volume"].as_f64()?);
    let rounded = entry["volume_f32coords"].as_f64();
    if !is_close(found, expected) && !rounded.is_some_and(|rounded| is_close(found, rounded)) {
        return Some(format!("{}: the volume is {found}, and the manifest has {expected}", path.display()));
    }
    None
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn solids_have_the_triangles_and_volumes_of_the_manifest() {
    let files = corpus();
    let sound = files.iter().filter(|(_, entry)| entry["cls"] != "nasty");
    let wrong: Vec<String> = sound.clone().filter_map(|(path, entry)| compare(path, entry)).collect();
    assert!(sound.count() > 0);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn nasty_files_are_read_or_refused_and_counted_alike() {
    let mut wrong = Vec::new();
    for (path, entry) in corpus().iter().filter(|(_, entry)| entry["cls"] == "nasty") {
        match catch_unwind(|| read(path)) {
            Err(_) => wrong.push(format!("{}: a panic", path.display())),
            Ok(Err(error)) => {
                eprintln!("refused: {error}");
                if entry["tri"].is_u64() {
                    wrong.push(format!("{error}, and the manifest has {} triangles", entry["tri"]));
                }
            }
            Ok(Ok(file)) => {
                let (found, expected) = (file.mesh.triangles.len() as u64, entry["tri"].as_u64());
                eprintln!("{}: {found} triangles, {:?}", path.display(), file.notes);
                if expected.is_some_and(|expected| expected != found) {
                    wrong.push(format!("{}: {found} triangles, and the manifest has {expected:?}", path.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn obj_files_of_triangles_are_as_tobj_reads_them() {
    let mut compared = 0;
    for (path, _) in corpus() {
        if Format::from_path(&path) != Ok(Format::Obj) {
            continue;
        }
        let options = tobj::LoadOptions { ignore_lines: true, ignore_points: true, ..Default::default() };
        let (Ok((models, _)), Ok(file)) = (tobj::load_obj(&path, &options), read(&path)) else { continue };
        // Faces of more corners may be cut otherwise.
        if models.iter().any(|model| !model.mesh.face_arities.is_empty()) {
            continue;
        }
        let theirs: Vec<[f64; 3]> = models
            .iter()
            .flat_map(|model| {
                let p = &model.mesh.positions;
                model.mesh.indices.iter().map(|&i| 3 * i as usize).map(|i| [p[i], p[i + 1], p[i + 2]])
            })
            .collect();
        let ours = file.mesh.triangles.iter().flatten().map(|&i| file.mesh.positions[i as usize].to_array());
        assert!(ours.eq(theirs), "{}", path.display());
        compared += 1;
    }
    assert!(compared > 0);
}

/// Prints how long each large file takes; it is no test of speed, since machines differ.
#[test]
#[ignore = "needs LDI_CORPUS"]
fn times() {
    let mut slowest: BTreeMap<u128, String> = BTreeMap::new();
    let mut paths: Vec<PathBuf> = corpus().into_iter().map(|(path, _)| path).collect();
    // The largest once more in the form that most large files have.
    let largest = paths.iter().max_by_key(|path| fs::metadata(path).map_or(0, |data| data.len())).expect("a file");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let stl = folder.path().join("largest.stl");
    write(&stl, &read(largest).expect("the largest file is a mesh").mesh, None).expect("it can be written");
    paths.push(stl);
    for path in paths {
        let Ok(bytes) = fs::read(&path) else { continue };
        let Ok(format) = Format::from_path(&path) else { continue };
        let best = (0..20).map(|_| {
            let start = std::time::Instant::now();
            let parsed = ldi_ops::mesh::io::parse(&bytes, format, &path);
            let elapsed = start.elapsed().as_micros();
            drop(parsed);
            elapsed
        });
        slowest.insert(best.min().unwrap_or(0), format!("{} ({} KB)", path.display(), bytes.len() / 1024));
    }
    for (microseconds, name) in slowest.iter().rev().take(25) {
        eprintln!("{:8.2} ms  {name}", *microseconds as f64 / 1000.0);
    }
}
