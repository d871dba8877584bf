//! The GLB writer: one node with one mesh of triangles.
//!
//! glTF has no unit but the metre, so the node scales the mesh to it. Positions are in the mesh's own unit, with 32 bits:
//! scaled and rounded again, two that differ could become one. Normals are left out, so that viewers shade each triangle
//! flat. Axes are not turned: y stays y, though glTF defines it as up.

use std::io::{self, Write};

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use super::super::formatted::write_each;
use crate::mesh::TriangleMesh;

/// Component types and buffer targets by their numbers in OpenGL.
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A file before it is written: the document, and the mesh for the binary chunk.
pub(in super::super) struct Glb<'m> {
    mesh: &'m TriangleMesh,
    document: Vec<u8>,
}

impl<'m> Glb<'m> {
    /// Lays out a mesh, relative to a place, whose unit is this many metres. All coordinates are finite, also with 32
    /// bits.
    pub(in super::super) fn new(mesh: &'m TriangleMesh, metres: f64, place: DVec3) -> Glb<'m> {
        let mut document = document(mesh, metres, place).to_string().into_bytes();
        // The length of a chunk is a multiple of 4 bytes.
        document.resize(document.len().next_multiple_of(4), b' ');
        Glb { mesh, document }
    }

    fn index_bytes(&self) -> u64 {
        size_of::<[u32; 3]>() as u64 * self.mesh.triangles.len() as u64
    }

    fn binary_bytes(&self) -> u64 {
        self.index_bytes() + size_of::<[f32; 3]>() as u64 * self.mesh.positions.len() as u64
    }

    /// Returns the length of the file in bytes: a header and two chunks with a header each; without triangles, one
    /// chunk.
    pub(in super::super) fn bytes(&self) -> u64 {
        let binary = if self.mesh.triangles.is_empty() { 0 } else { 8 + self.binary_bytes() };
        12 + 8 + self.document.len() as u64 + binary
    }

    /// Writes the file, which is known to have fewer than 2^32 bytes.
    pub(in super::super) fn write(&self, out: &mut (impl Write + Send)) -> io::Result<()> {
        let word = |value: u64| (value as u32).to_le_bytes();
        out.write_all(b"glTF\x02\0\0\0")?;
        out.write_all(&word(self.bytes()))?;
        out.write_all(&word(self.document.len() as u64))?;
        out.write_all(b"JSON")?;
        out.write_all(&self.document)?;
        if self.mesh.triangles.is_empty() {
            return Ok(());
        }
        out.write_all(&word(self.binary_bytes()))?;
        out.write_all(b"BIN\0")?;
        write_each(out, &self.mesh.triangles, |triangle, bytes| {
            bytes.extend_from_slice(triangle.map(u32::to_le_bytes).as_flattened());
        })?;
        write_each(out, &self.mesh.positions, |position, bytes| {
            bytes.extend_from_slice(position.as_vec3().to_array().map(f32::to_le_bytes).as_flattened());
        })
    }
}

fn document(mesh: &TriangleMesh, metres: f64, place: DVec3) -> Value {
    let asset = json!({ "version": "2.0", "generator": "ldi-ops" });
    if mesh.triangles.is_empty() {
        return json!({ "asset": asset });
    }
    let positions = || mesh.positions.iter().map(|&position| position.as_vec3());
    let mut node = json!({ "mesh": 0 });
    if place != DVec3::ZERO {
        node["translation"] = json!((place * metres).to_array());
    }
    if metres != 1.0 {
        node["scale"] = json!([metres, metres, metres]);
    }
    // The bounds are exactly those of the rounded numbers.
    let bound = |bound: Vec3| json!(bound.as_dvec3().to_array());
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    let (index_bytes, position_bytes) = (12 * triangles, 12 * vertices);
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 1 }, "indices": 0, "mode": 4 }] }],
        "accessors": [
            { "bufferView": 0, "componentType": UNSIGNED_INT, "count": 3 * triangles, "type": "SCALAR" },
            {
                "bufferView": 1, "componentType": FLOAT, "count": vertices, "type": "VEC3",
                "min": bound(positions().fold(Vec3::INFINITY, Vec3::min)),
                "max": bound(positions().fold(Vec3::NEG_INFINITY, Vec3::max)),
            },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": index_bytes, "target": ELEMENT_ARRAY_BUFFER },
            { "buffer": 0, "byteOffset": index_bytes, "byteLength": position_bytes, "target": ARRAY_BUFFER },
        ],
        "buffers": [{ "byteLength": index_bytes + position_bytes }],
    })
}
