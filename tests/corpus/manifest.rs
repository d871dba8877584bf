//! The manifests of the corpus, one in `meshes` and one in `large`; the environment variable `LDI_CORPUS` names the folder of the
//! corpus.

// Each test binary that includes this file uses a part of it.
#![allow(dead_code)]

use std::fs;
use std::path::PathBuf;

use serde_json::Value;

/// A file of the corpus, with the values that its manifest states.
pub struct Entry {
    pub name: String,
    pub path: PathBuf,
    /// `solid`, `scaffold`, `bone` or `nasty`.
    pub class: String,
    /// The volume of the mesh in cubic file units, computed by other software; `None` where that software gave none.
    pub volume: Option<f64>,
    /// The same volume after the other software rounded the coordinates to 32 bits, where it did.
    pub rounded_volume: Option<f64>,
    /// The number of triangles of the file; `None` where the other software could not read it.
    pub triangles: Option<u64>,
}

/// Returns every file that the manifests list, sorted by name.
pub fn entries() -> Vec<Entry> {
    let folder = std::env::var_os("LDI_CORPUS").expect("LDI_CORPUS names the folder of the corpus");
    let folder = PathBuf::from(folder);
    let mut entries = Vec::new();
    for folder in ["meshes", "large"].map(|name| folder.join(name)) {
        let manifest = folder.join("manifest.json");
        let text = fs::read_to_string(&manifest).unwrap_or_else(|error| panic!("{}: {error}", manifest.display()));
        let listed: Vec<Value> = serde_json::from_str(&text).expect("the manifest is a JSON list");
        assert!(!listed.is_empty(), "{} lists no file", manifest.display());
        entries.extend(listed.iter().map(|entry| {
            let name = entry["name"].as_str().expect("an entry has a name").to_owned();
            let class = entry["cls"].as_str().expect("an entry has a class").to_owned();
            Entry {
                path: folder.join(&name),
                name,
                class,
                volume: entry["volume"].as_f64(),
                rounded_volume: entry["volume_f32coords"].as_f64(),
                triangles: entry["tri"].as_u64(),
            }
        }));
    }
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    entries
}
