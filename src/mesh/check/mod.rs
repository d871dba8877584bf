//! The exact check of a mesh: all its defects, with counts and first places.
//!
//! Identical coordinates are one vertex (−0 and 0 are identical). A triangle whose indices are in range and whose
//! corners are three different vertices is a *face*; only faces have edges. The check compares coordinates and counts
//! exactly, except in three questions: whether corners are collinear, which it decides exactly with expansions of
//! floating-point numbers (Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric
//! predicates", 1997); and the sign of the volume of a shell and whether one shell lies inside another, where an answer
//! too close to call counts as no finding.
//!
//! # Shells and components
//! A component is a set of faces connected by shared edges. A shell is a part of a component that bounds something by
//! itself: faces are joined across every edge that has two uses. At an edge with more, the parts that meet there and do
//! not each have as many uses in one direction as in the other are sorted by their angle around the edge, and two are
//! joined where the solid lies between them. So two cubes that touch in an edge or a whole face are one component and
//! two shells, and one that is inside out is found although it touches the other.
//!
//! # Inside and outside
//! The depth of a closed shell is the number of closed shells that contain it, by the parity of the crossings of a ray
//! upwards from one of its vertices. The ray is perturbed symbolically and its crossings with edges are decided
//! exactly, so it can pass through edges and vertices; where it starts too near the other surface to call, another
//! point of the shell is tried. At even depth a shell should face outwards; at odd depth it is a cavity and should face
//! inwards.

mod display;
mod edges;
mod exact;
mod nesting;
mod orient;
mod report;
mod shells;
#[cfg(test)]
mod tests;

use crate::parallel::*;
use glam::DVec3;

use super::TriangleMesh;
use super::hash::position_hash;
use edges::{connect, edge_uses};
use exact::are_collinear;
use nesting::judge;
pub(super) use orient::turns;
pub use report::{
    BadIndex, BadPosition, Defect, DuplicatePlace, EdgePlace, Findings, MeshReport, Severity, ShellPlace,
    TrianglePlace, VertexPlace,
};

/// Checks a mesh with exact comparisons and reports all its defects.
///
/// The report does not depend on the thread count. It takes about a second for a million triangles; use
/// [`super::ClosedMesh::check`] where the question is only whether the mesh is closed.
pub fn check(mesh: &TriangleMesh) -> MeshReport {
    let mut report = MeshReport {
        triangles: mesh.triangles.len(),
        signed_volume: mesh.signed_volume(),
        area: mesh.area(),
        bounds: mesh.bounds(),
        ..MeshReport::default()
    };
    let (vertices, faces) = weld(mesh, &mut report);
    report.vertices = vertices.len();
    find_collinear(&vertices, &faces, &mut report);
    let uses = edge_uses(&faces);
    let joined = connect(&vertices, &faces, &uses, &mut report);
    let shells = shells::closed(&vertices, &faces, &uses, &joined, &mut report);
    judge(&vertices, &faces, &shells, &mut report);
    report
}

/// A triangle that has edges: its corners are three different vertices.
struct Face {
    triangle: usize,
    corners: [u32; 3],
}

/// Welds identical positions into vertices, numbered in the order of use, and separates the triangles that have no
/// edges.
fn weld(mesh: &TriangleMesh, report: &mut MeshReport) -> (Vec<DVec3>, Vec<Face>) {
    const UNSEEN: u32 = u32::MAX;
    let TriangleMesh { positions, triangles } = mesh;
    let most = positions.len().min(3 * triangles.len());
    let mut table = vec![UNSEEN; (2 * most).next_power_of_two()];
    let mask = table.len() - 1;
    let mut vertices: Vec<DVec3> = Vec::new();
    let mut vertex_from_index = vec![UNSEEN; positions.len()];
    let mut faces = Vec::with_capacity(triangles.len());
    let bits = |position: DVec3| position.to_array().map(f64::to_bits);
    for (triangle, indices) in triangles.iter().enumerate() {
        let mut in_range = true;
        let corners = indices.map(|index| {
            let Some(&position) = positions.get(index as usize) else {
                report.bad_indices.add(|| BadIndex { triangle, index });
                in_range = false;
                return UNSEEN;
            };
            if vertex_from_index[index as usize] != UNSEEN {
                return vertex_from_index[index as usize];
            }
            if !position.is_finite() {
                report.bad_positions.add(|| BadPosition { triangle, index, position });
            }
            // Adding +0 turns −0 into +0 and changes no other number.
            let position = position + DVec3::ZERO;
            let mut slot = position_hash(position)[0] as usize & mask;
            let vertex = loop {
                let vertex = table[slot];
                if vertex == UNSEEN {
                    table[slot] = vertices.len() as u32;
                    vertices.push(position);
                    break table[slot];
                }
                if bits(vertices[vertex as usize]) == bits(position) {
                    break vertex;
                }
                slot = (slot + 1) & mask;
            };
            vertex_from_index[index as usize] = vertex;
            vertex
        });
        if !in_range {
            continue;
        }
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            let corners = corners.map(|vertex| vertices[vertex as usize]);
            report.repeated_corners.add(|| TrianglePlace { triangle, corners });
        } else {
            faces.push(Face { triangle, corners });
        }
    }
    (vertices, faces)
}

/// Reports the faces whose corners lie on one line.
fn find_collinear(vertices: &[DVec3], faces: &[Face], report: &mut MeshReport) {
    let collinear: Vec<&Face> =
        faces.par_iter().filter(|face| are_collinear(face.corners.map(|v| vertices[v as usize]))).collect();
    for face in collinear {
        let corners = face.corners.map(|v| vertices[v as usize]);
        report.collinear.add(|| TrianglePlace { triangle: face.triangle, corners });
    }
}
