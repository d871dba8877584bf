//! The uses of edges by faces, and what they determine: defects of edges, duplicates, components, fans, genus.

use crate::parallel::*;
use glam::DVec3;

use super::Face;
use super::report::{DuplicatePlace, EdgePlace, FIRST, MeshReport, VertexPlace};
use crate::union_find::UnionFind;

/// One use of an edge by a face. Sorting brings the uses of an edge together, in the order of faces.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Use {
    /// The lower vertex in the high half, the higher in the low half.
    pub(super) edge: u64,
    /// Face, then side, then direction: (3 · face + side) · 2 + 1 where the use goes from the lower vertex to the higher.
    at: u64,
}

impl Use {
    pub(super) fn face(self) -> usize {
        self.corner() / 3
    }

    /// Returns three times the face plus the corner that the side starts from.
    pub(super) fn corner(self) -> usize {
        (self.at >> 1) as usize
    }

    pub(super) fn is_forward(self) -> bool {
        self.at & 1 == 1
    }

    /// Returns the corners at the lower and the higher vertex.
    fn corners(self) -> [u32; 2] {
        let from = self.corner() as u32;
        let to = if from % 3 == 2 { from - 2 } else { from + 1 };
        if self.is_forward() { [from, to] } else { [to, from] }
    }
}

/// Returns all uses of edges, sorted.
pub(super) fn edge_uses(faces: &[Face]) -> Vec<Use> {
    let mut uses: Vec<Use> = faces
        .par_iter()
        .enumerate()
        .flat_map_iter(|(face, Face { corners, .. })| {
            (0..3).map(move |side| {
                let (from, to) = (u64::from(corners[side]), u64::from(corners[(side + 1) % 3]));
                let edge = from.min(to) << 32 | from.max(to);
                Use { edge, at: (3 * face + side) as u64 * 2 + u64::from(from < to) }
            })
        })
        .collect();
    uses.par_sort_unstable();
    uses
}

/// Returns the uses of each edge.
pub(super) fn edges(uses: &[Use]) -> impl Iterator<Item = &[Use]> {
    uses.chunk_by(|a, b| a.edge == b.edge)
}

/// Finds everything that edges determine: their defects, duplicates, components, genus. Returns the sets of faces that
/// edges of two uses join.
pub(super) fn connect(vertices: &[DVec3], faces: &[Face], uses: &[Use], report: &mut MeshReport) -> UnionFind {
    let corners = u32::try_from(3 * faces.len()).expect("a mesh has fewer than 2³² corners");
    let [components, shells, fans] = [corners / 3, corners / 3, corners].map(UnionFind::new);
    let position = |vertex: u64| vertices[vertex as u32 as usize];
    let (mut duplicates, mut even) = (Vec::new(), 0);
    for run in edges(uses) {
        report.edges += 1;
        let (count, forward) = (run.len(), run.iter().filter(|u| u.is_forward()).count());
        let place = || EdgePlace {
            ends: [position(run[0].edge >> 32), position(run[0].edge)],
            uses: count,
            forward,
            triangles: run.iter().take(FIRST).map(|u| faces[u.face()].triangle).collect(),
        };
        match count {
            1 => report.open_edges.add(place),
            _ if !count.is_multiple_of(2) => report.odd_edges.add(place),
            _ => {
                if 2 * forward != count {
                    report.unbalanced_edges.add(place);
                }
                if count > 2 {
                    report.non_manifold_edges.add(place);
                }
            }
        }
        for pair in run.windows(2) {
            components.join(pair[0].face() as u32, pair[1].face() as u32);
            let (first, second) = (pair[0].corners(), pair[1].corners());
            fans.join(first[0], second[0]);
            fans.join(first[1], second[1]);
        }
        if count == 2 {
            shells.join(run[0].face() as u32, run[1].face() as u32);
        }
        if count > 1 {
            even += find_duplicates(faces, run, &mut duplicates);
        }
    }
    report_duplicates(vertices, faces, duplicates, report);
    report.every_triangle_even = even == faces.len();
    report.components = (0..corners / 3).filter(|&face| components.find(face) == face).count();
    count_fans(vertices, faces, &fans, report);
    shells
}

/// A face that has the corners of an earlier one.
struct Duplicate {
    face: usize,
    earlier: usize,
    opposed: bool,
}

/// Finds the faces of an edge that have the third corner in common. Each is found at one of its edges only, the one
/// between its two lower vertices. Returns the number of faces that occur an even number of times.
fn find_duplicates(faces: &[Face], run: &[Use], duplicates: &mut Vec<Duplicate>) -> usize {
    let apex = |u: &Use| faces[u.face()].corners[(u.corner() + 2) % 3];
    if let [a, b] = run
        && apex(a) != apex(b)
    {
        return 0;
    }
    let high = run[0].edge as u32;
    let mut sorted: Vec<(u32, Use)> = run.iter().map(|u| (apex(u), *u)).filter(|(apex, _)| *apex > high).collect();
    sorted.sort_unstable();
    let mut even = 0;
    for same in sorted.chunk_by(|a, b| a.0 == b.0) {
        even += if same.len().is_multiple_of(2) { same.len() } else { 0 };
        let forward = same.iter().filter(|(_, u)| u.is_forward()).count();
        // The surplus after faces back to back have cancelled, without the one that would be right.
        let mut surplus = forward.abs_diff(same.len() - forward).saturating_sub(1);
        let is_surplus = |u: Use| u.is_forward() == (2 * forward > same.len());
        for (_, later) in same[1..].iter().rev() {
            let opposed = surplus == 0 || !is_surplus(*later);
            surplus -= usize::from(!opposed);
            duplicates.push(Duplicate { face: later.face(), earlier: same[0].1.face(), opposed });
        }
    }
    even
}

fn report_duplicates(vertices: &[DVec3], faces: &[Face], mut duplicates: Vec<Duplicate>, report: &mut MeshReport) {
    duplicates.sort_unstable_by_key(|duplicate| duplicate.face);
    for Duplicate { face, earlier, opposed } in duplicates {
        let findings = if opposed { &mut report.opposed_duplicates } else { &mut report.duplicates };
        findings.add(|| DuplicatePlace {
            triangle: faces[face].triangle,
            earlier: faces[earlier].triangle,
            corners: faces[face].corners.map(|vertex| vertices[vertex as usize]),
        });
    }
}

/// Counts the fans of faces at every vertex, then classifies the surface by its Euler characteristic.
fn count_fans(vertices: &[DVec3], faces: &[Face], fans: &UnionFind, report: &mut MeshReport) {
    let mut at_vertex = vec![0; vertices.len()];
    for corner in 0..3 * faces.len() {
        if fans.find(corner as u32) == corner as u32 {
            at_vertex[faces[corner / 3].corners[corner % 3] as usize] += 1;
        }
    }
    for (&position, &fans) in vertices.iter().zip(&at_vertex) {
        if fans > 1 {
            report.non_manifold_vertices.add(|| VertexPlace { position, fans });
        }
    }
    let used = at_vertex.iter().filter(|fans| **fans > 0).count();
    report.euler_characteristic = used as i64 - report.edges as i64 + faces.len() as i64;
    let manifold = report.non_manifold_edges.count == 0 && report.non_manifold_vertices.count == 0;
    if report.is_closed() && report.is_oriented() && manifold {
        // A closed, oriented surface of genus g has the characteristic 2 − 2g, so the difference is even.
        report.genus = Some((2 * report.components as i64 - report.euler_characteristic) as usize / 2);
    }
}
