//! Separation of what touches: a closed, oriented mesh becomes a 2-manifold by its indices.
//!
//! Where solids touch in an edge or a vertex, more than two triangles share that edge, or the triangles around that vertex form
//! more than one fan. Around an edge, the two triangles between which the solid lies are taken to belong together; so solids
//! that touch stay two. Then each fan gets a vertex of its own, at the same position. An edge that is shared by more than two
//! triangles of one fan gets a vertex in the middle of all pairs but one. Triangles that lie on each other and face opposite ways
//! bound nothing and are removed first.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::manifold::{Faults, Stars, sides};
use crate::mesh::{Precision, TriangleMesh};

/// Separates what touches, as the module says. Edges must have as many uses in one direction as in the other. `sources`, with one
/// entry for each triangle, follow the triangles. New positions are rounded to a precision. Returns whether vertices were copied.
pub(super) fn separate<S: Copy>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, precision: Precision) -> bool {
    let mut faults = Faults::of(mesh);
    if remove_pairs(mesh, sources, &faults.duplicates) {
        faults = Faults::of(mesh);
    }
    if faults.edges.is_empty() && faults.vertices.is_empty() {
        return false;
    }
    let given = mesh.positions.len();
    let (partners, copied) = split(mesh, &faults);
    let origin = |vertex: u32| (vertex as usize).checked_sub(given).map_or(vertex, |copy| copied[copy]);
    let shared: Vec<[u32; 2]> = Faults::of(mesh).edges.into_iter().map(|edge| edge.ends).collect();
    let mut parts = Parts::at(&shared, mesh);
    for ends in shared {
        let whole_ends = sorted(ends.map(origin));
        let wholes = parts.wholes.remove(&ends).unwrap_or_default();
        let mut pairs: Vec<[u32; 2]> = wholes
            .iter()
            .filter_map(|&whole| Some(sorted([whole, *partners.get(&(whole, whole_ends))?])))
            .filter(|pair| wholes.contains(&pair[1]))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        for pair in pairs.into_iter().skip(1) {
            let pair = pair.map(|whole| parts.with(ends, whole, mesh));
            split_edge(mesh, ends, pair, precision);
            for triangle in pair {
                parts.add(triangle);
                sources.push(sources[triangle as usize]);
            }
        }
    }
    true
}

/// Triangles at shared edges, and the parts that they are split into.
struct Parts {
    /// The triangles at each edge, before any is split.
    wholes: HashMap<[u32; 2], Vec<u32>>,
    /// Further parts of triangles.
    further: HashMap<u32, Vec<u32>>,
    /// The triangles of which the last ones are parts, and the number of the first of these.
    of_last: Vec<u32>,
    first: u32,
}

impl Parts {
    fn at(edges: &[[u32; 2]], mesh: &TriangleMesh) -> Parts {
        let mut wholes: HashMap<[u32; 2], Vec<u32>> = edges.iter().map(|&edge| (edge, Vec::new())).collect();
        for (number, &[a, b, c]) in (0..).zip(&mesh.triangles) {
            for edge in [[a, b], [b, c], [c, a]].map(sorted) {
                if let Some(triangles) = wholes.get_mut(&edge) {
                    triangles.push(number);
                }
            }
        }
        Parts { wholes, further: HashMap::new(), of_last: Vec::new(), first: mesh.triangles.len() as u32 }
    }

    /// Returns the part of a triangle that has an edge.
    fn with(&self, edge: [u32; 2], whole: u32, mesh: &TriangleMesh) -> u32 {
        let has_edge = |part: &u32| edge.iter().all(|end| mesh.triangles[*part as usize].contains(end));
        let further = self.further.get(&whole).into_iter().flatten().copied();
        [whole].into_iter().chain(further).find(has_edge).unwrap_or(whole)
    }

    /// Adds the next triangle as a part of the one that `triangle` is a part of.
    fn add(&mut self, triangle: u32) {
        let whole = triangle.checked_sub(self.first).map_or(triangle, |last| self.of_last[last as usize]);
        self.further.entry(whole).or_default().push(self.first + self.of_last.len() as u32);
        self.of_last.push(whole);
    }
}

pub(super) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Puts a vertex into the middle of an edge, on two triangles that share it. Appends a part of each.
fn split_edge(mesh: &mut TriangleMesh, ends: [u32; 2], pair: [u32; 2], precision: Precision) {
    let [from, to] = ends.map(|vertex| mesh.positions[vertex as usize]);
    let middle = mesh.positions.len() as u32;
    mesh.positions.push(precision.round(from + 0.5 * (to - from)));
    for triangle in pair.map(|number| number as usize) {
        let (mut first, mut second) = (mesh.triangles[triangle], mesh.triangles[triangle]);
        first.iter_mut().filter(|corner| **corner == ends[1]).for_each(|corner| *corner = middle);
        second.iter_mut().filter(|corner| **corner == ends[0]).for_each(|corner| *corner = middle);
        mesh.triangles[triangle] = first;
        mesh.triangles.push(second);
    }
}

/// Removes pairs of triangles with the same corners in opposite order. Returns whether there were any.
fn remove_pairs<S>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, duplicates: &[[u32; 2]]) -> bool {
    let mut is_removed: HashSet<u32> = HashSet::new();
    let cycle = |triangle: u32| {
        let mut corners = mesh.triangles[triangle as usize];
        let lowest = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(lowest);
        corners
    };
    // All triangles with the same corners: the first of them and the others.
    for same in duplicates.chunk_by(|a, b| a[0] == b[0]) {
        let all = || [same[0][0]].into_iter().chain(same.iter().map(|pair| pair[1]));
        let way = cycle(same[0][0]);
        let (ahead, back): (Vec<u32>, Vec<u32>) = all().partition(|&triangle| cycle(triangle) == way);
        is_removed.extend(ahead.iter().zip(&back).flat_map(|(a, b)| [*a, *b]));
    }
    let kept: Vec<bool> = (0..mesh.triangles.len() as u32).map(|triangle| !is_removed.contains(&triangle)).collect();
    retain(mesh, sources, &kept);
    !is_removed.is_empty()
}

/// Keeps some of the triangles, and the vertices that they use.
pub(super) fn retain<S>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, is_kept: &[bool]) {
    if is_kept.iter().all(|&kept| kept) {
        return;
    }
    let mut kept = is_kept.iter();
    mesh.triangles.retain(|_| *kept.next().expect("one entry per triangle"));
    let mut kept = is_kept.iter();
    sources.retain(|_| *kept.next().expect("one entry per triangle"));
    let triangles = std::mem::take(&mut mesh.triangles);
    *mesh = mesh.of_triangles(triangles).0;
}

/// Gives each fan of triangles a vertex of its own. Returns the pairs at shared edges, and the vertices that new ones are copies of.
fn split(mesh: &mut TriangleMesh, faults: &Faults) -> (Partners, Vec<u32>) {
    let ends = faults.edges.iter().flat_map(|edge| edge.ends);
    let mut vertices: Vec<u32> = faults.vertices.iter().map(|&(vertex, _)| vertex).chain(ends).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let stars = Stars::of(mesh);
    let mut partners = Partners::new();
    for edge in &faults.edges {
        let star: Vec<u32> = stars.corners_at(edge.ends[0] as usize).iter().map(|corner| corner / 3).collect();
        pair_up(mesh, edge.ends, &star, &mut partners);
    }
    let mut changes = Vec::new();
    for vertex in vertices {
        let mut star = stars.corners_at(vertex as usize).to_vec();
        star.sort_unstable();
        let mut is_seen = vec![false; star.len()];
        let mut fans = 0;
        for first in 0..star.len() {
            if is_seen[first] {
                continue;
            }
            // Around the vertex from triangle to triangle, across the side that ends there.
            let mut at = first;
            while !is_seen[at] {
                is_seen[at] = true;
                if fans > 0 {
                    changes.push((star[at], fans));
                }
                let (_, previous) = sides(mesh, star[at]);
                let key = (star[at] / 3, [vertex.min(previous), vertex.max(previous)]);
                let next = match partners.get(&key) {
                    Some(&partner) => star.iter().position(|&corner| corner / 3 == partner),
                    None => star.iter().position(|&corner| sides(mesh, corner).0 == previous),
                };
                match next {
                    Some(next) => at = next,
                    None => break,
                }
            }
            fans += 1;
        }
    }
    let mut added: Option<(u32, u32)> = None;
    let mut copied = Vec::new();
    for (corner, fan) in changes {
        let vertex = mesh.triangles[corner as usize / 3][corner as usize % 3];
        if added != Some((vertex, fan)) {
            mesh.positions.push(mesh.positions[vertex as usize]);
            copied.push(vertex);
            added = Some((vertex, fan));
        }
        mesh.triangles[corner as usize / 3][corner as usize % 3] = mesh.positions.len() as u32 - 1;
    }
    (partners, copied)
}

/// A triangle at an edge, by its direction as seen along the edge.
#[derive(Clone, Copy)]
struct Use {
    angle: f64,
    triangle: u32,
    /// True if it runs from the edge's lower vertex to the higher.
    is_forward: bool,
}

/// The triangle with which each triangle at a shared edge belongs together.
type Partners = HashMap<(u32, [u32; 2]), u32>;

/// Pairs those triangles of a star that are at an edge, so that the solid lies between those of a pair.
fn pair_up(mesh: &TriangleMesh, ends: [u32; 2], star: &[u32], partners: &mut Partners) {
    let [low, high] = ends;
    let [from, to] = ends.map(|vertex| mesh.positions[vertex as usize]);
    let axis = (to - from).try_normalize().unwrap_or(DVec3::X);
    let right = axis.any_orthonormal_vector();
    let up = axis.cross(right);
    let mut uses: Vec<Use> = Vec::new();
    for &triangle in star {
        let corners = mesh.triangles[triangle as usize];
        let Some(place) = corners.iter().position(|&corner| corner == low) else { continue };
        let (next, previous) = (corners[(place + 1) % 3], corners[(place + 2) % 3]);
        if next != high && previous != high {
            continue;
        }
        let is_forward = next == high;
        let beside = mesh.positions[if is_forward { previous } else { next } as usize] - from;
        uses.push(Use { angle: beside.dot(up).atan2(beside.dot(right)), triangle, is_forward });
    }
    uses.sort_by(|a, b| a.angle.total_cmp(&b.angle).then(a.triangle.cmp(&b.triangle)));
    // The solid lies behind: at greater angles for a triangle that runs backward, at lesser ones for one that runs forward. So they
    // pair like brackets on a circle.
    let mut open: Vec<u32> = Vec::new();
    for _ in 0..2 {
        for own in &uses {
            if partners.contains_key(&(own.triangle, ends)) || open.contains(&own.triangle) {
                continue;
            }
            if !own.is_forward {
                open.push(own.triangle);
            } else if let Some(other) = open.pop() {
                partners.insert((own.triangle, ends), other);
                partners.insert((other, ends), own.triangle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::cuboid;
    use crate::surface::manifold::ManifoldReport;

    /// Boxes with shared vertices, as one mesh.
    fn boxes(corners: &[[f64; 3]]) -> TriangleMesh {
        let mut mesh = TriangleMesh::default();
        for &corner in corners {
            let corner = DVec3::from(corner);
            let one = cuboid(corner, corner + 1.0).unwrap();
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(one.positions);
            mesh.triangles.extend(one.triangles.iter().map(|triangle| triangle.map(|index| index + first)));
        }
        mesh.weld();
        mesh
    }

    fn separated(corners: &[[f64; 3]]) -> (usize, Option<usize>) {
        let mut mesh = boxes(corners);
        let mut sources: Vec<usize> = (0..mesh.triangles.len()).collect();
        separate(&mut mesh, &mut sources, Precision::Double);
        assert_eq!(sources.len(), mesh.triangles.len());
        let report = ManifoldReport::of(&mesh, Precision::Double);
        (report.components, report.genus)
    }

    #[test]
    fn boxes_that_touch_in_an_edge_or_a_vertex_stay_apart() {
        assert_eq!(separated(&[[0.0; 3], [1.0, 1.0, 0.0]]), (2, Some(0)));
        assert_eq!(separated(&[[0.0; 3], [1.0, 1.0, 1.0]]), (2, Some(0)));
        // Four boxes around an axis, opposite ones on either level.
        let four = [[0.0; 3], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
        assert_eq!(separated(&four), (4, Some(0)));
    }

    #[test]
    fn boxes_with_a_common_face_of_the_same_triangles_become_one() {
        assert_eq!(separated(&[[0.0; 3], [1.0, 0.0, 0.0]]), (1, Some(0)));
    }
}
