//! Reads a folder of real meshes, named by `LDI_CORPUS`, and compares them with the manifests of the folder.
//!
//! The manifests come from other software, in Python. The test also reads OBJ files with `tobj`.

#[path = "corpus/manifest.rs"]
mod manifest;

use std::panic::catch_unwind;

use glam::DVec3;
use ldi_ops::mesh::TriangleMesh;
use ldi_ops::mesh::io::{Format, ReadError, ReadNote, read};
use manifest::{Entry, entries};

/// Returns the volume by the divergence theorem, about the box's centre so that a place far from the origin costs no digits.
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

/// Compares a file with its manifest entry; returns the difference, or `None`.
fn compare(entry: &Entry) -> Option<String> {
    let path = &entry.path;
    let mut file = match read(path) {
        Ok(file) => file,
        // The manifest lists a scaffold of clipped beams alone without triangles.
        Err(ReadError::Unsupported { .. }) if entry.triangles.is_none() => return None,
        Err(error) => return Some(error.to_string()),
    };
    // The other software left beams out; this program puts them after the triangles.
    if file.notes.iter().any(|note| matches!(note, ReadNote::BeamsMeshed { .. })) {
        file.mesh.triangles.truncate(entry.triangles.map_or(0, |triangles| triangles as usize));
    }
    let triangles = file.mesh.triangles.len() as u64;
    if entry.triangles != Some(triangles) {
        let expected = entry.triangles;
        return Some(format!("{}: {triangles} triangles, and the manifest has {expected:?}", path.display()));
    }
    let (found, expected) = (volume(&file.mesh), entry.volume?);
    if !is_close(found, expected) && !entry.rounded_volume.is_some_and(|rounded| is_close(found, rounded)) {
        return Some(format!("{}: the volume is {found}, and the manifest has {expected}", path.display()));
    }
    None
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn solids_have_the_triangle_counts_and_volumes_of_the_manifest() {
    let entries = entries();
    let sound = entries.iter().filter(|entry| entry.class != "nasty");
    let wrong: Vec<String> = sound.clone().filter_map(compare).collect();
    assert!(sound.clone().count() >= 30, "only {} files", sound.count());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn nasty_files_are_read_with_the_triangle_count_of_the_manifest_or_refused() {
    let (mut wrong, mut nasty) = (Vec::new(), 0);
    for entry in entries().iter().filter(|entry| entry.class == "nasty") {
        nasty += 1;
        let path = &entry.path;
        match catch_unwind(|| read(path)) {
            Err(_) => wrong.push(format!("{}: a panic", path.display())),
            Ok(Err(error)) => {
                eprintln!("refused: {error}");
                if let Some(expected) = entry.triangles {
                    wrong.push(format!("{error}, and the manifest has {expected} triangles"));
                }
            }
            Ok(Ok(file)) => {
                let (found, expected) = (file.mesh.triangles.len() as u64, entry.triangles);
                eprintln!("{}: {found} triangles, {:?}", path.display(), file.notes);
                if expected.is_some_and(|expected| expected != found) {
                    wrong.push(format!("{}: {found} triangles, and the manifest has {expected:?}", path.display()));
                }
            }
        }
    }
    assert!(nasty >= 50, "only {nasty} nasty files");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "needs LDI_CORPUS"]
fn obj_files_of_triangles_equal_what_tobj_reads() {
    let mut compared = 0;
    for Entry { path, .. } in entries() {
        if Format::from_path(&path) != Ok(Format::Obj) {
            continue;
        }
        let options = tobj::LoadOptions { ignore_lines: true, ignore_points: true, ..Default::default() };
        let (Ok((models, _)), Ok(file)) = (tobj::load_obj(&path, &options), read(&path)) else { continue };
        // The two programs may cut faces of more corners differently.
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
