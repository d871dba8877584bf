//! Vertices that an exact mesh does not need: those of cuts that lie within flat parts of it, or on straight edges between two.
//!
//! Where a cut crosses an edge between coplanar triangles it gets a vertex there. Each is moved along an edge to a neighbour and so
//! removed, if no triangle turns and all parts of the surface stay within a tolerance of their planes.

use glam::DVec3;

use super::contract::Contraction;
use super::manifold::Stars;
use crate::cancel::checkpoint;
use crate::closest::squared_distance_from_segment;
use crate::mesh::TriangleMesh;
use crate::parallel::*;

/// Cosine of the greatest angle between the normals of triangles that may be parts of one plane: a first guess.
const COPLANAR: f64 = 1.0 - 1e-9;

/// Most triangles at a vertex that is removed.
const MOST_AROUND: usize = 64;

/// Most passes over the vertices; each may leave some that the next one can remove.
const PASSES: usize = 2;

/// Removes vertices from number `first` on that the surface does not need, and returns their number. The surface stays within a
/// tolerance. `part_of` tells to which part of the surface a triangle belongs, whose borders stay; `sources` follow the triangles.
pub(crate) fn remove_flat<S>(
    mesh: &mut TriangleMesh,
    sources: &mut Vec<S>,
    first: u32,
    tolerance: f64,
    part_of: impl Fn(&S) -> u32,
) -> usize {
    let vertices = first..mesh.positions.len() as u32;
    if vertices.is_empty() {
        return 0;
    }
    let stars = Stars::of(mesh);
    let may_go = |vertex: &u32| {
        let mut corners = stars.corners_at(*vertex as usize).to_vec();
        corners.sort_unstable();
        let triangles = corners.iter().map(|corner| mesh.triangles[*corner as usize / 3]);
        let normals =
            triangles.map(|triangle| normal(triangle.map(|v| mesh.positions[v as usize])).normalize_or_zero());
        corners.len() <= MOST_AROUND && are_two_planes(normals.filter(|normal| *normal != DVec3::ZERO))
    };
    let mut left: Vec<u32> = vertices.into_par_iter().with_min_len(1 << 10).filter(may_go).collect();
    if left.is_empty() {
        return 0;
    }
    let parts: Vec<u32> = sources.iter().map(part_of).collect();
    let (errors, has_changed) = (vec![0.0; mesh.positions.len()], vec![true; mesh.positions.len()]);
    let edges = Contraction::of(mesh, &stars);
    let mut surface = Surface { edges, parts, tolerance, errors, has_changed };
    let candidates = left.len();
    for _ in 0..PASSES {
        checkpoint();
        // What could not be moved before can only be moved since something changed around it.
        left.retain(|&vertex| {
            let is_new = std::mem::take(&mut surface.has_changed[vertex as usize]);
            !(is_new && surface.remove(vertex))
        });
    }
    surface.edges.finish(sources);
    candidates - left.len()
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Returns whether normals are those of one or two planes, about.
fn are_two_planes(normals: impl Iterator<Item = DVec3>) -> bool {
    let mut planes = [DVec3::ZERO; 2];
    for normal in normals {
        let is_of = |plane: &DVec3| *plane == DVec3::ZERO || plane.dot(normal) >= COPLANAR;
        match planes.iter_mut().find(|plane| is_of(plane)) {
            Some(plane) if *plane == DVec3::ZERO => *plane = normal,
            Some(_) => {}
            None => return false,
        }
    }
    true
}

/// The surface, and the part that each triangle belongs to.
struct Surface<'m> {
    edges: Contraction<'m>,
    parts: Vec<u32>,
    tolerance: f64,
    /// Bounds of how far what was removed near a vertex is from the surface.
    errors: Vec<f64>,
    /// Whether triangles at each vertex have changed since it was last tried.
    has_changed: Vec<bool>,
}

impl Surface<'_> {
    /// Moves a vertex to the neighbour that leaves the best triangles, if it may be moved to any.
    fn remove(&mut self, vertex: u32) -> bool {
        let star = self.edges.star(vertex);
        if star.len() > MOST_AROUND {
            return false;
        }
        let ring = self.edges.ring(vertex, &star);
        let around: Vec<Around> = star.iter().map(|&triangle| self.around(vertex, triangle)).collect();
        let borders: Vec<u32> = ring.iter().copied().filter(|&other| is_border(other, &around)).collect();
        let error = self.errors[vertex as usize];
        let left = self.tolerance - error;
        let least = around.iter().map(|around| around.thickness).fold(16.0 * self.tolerance * self.tolerance, f64::min);
        let at = |vertex: u32| self.edges.mesh.positions[vertex as usize];
        let mut fits: Vec<(f64, f64, u32)> = ring
            .iter()
            .filter_map(|&to| {
                let aside = aside(to, &borders, at, vertex)?;
                let (quality, height) = worst([vertex, to].map(at), &around, to, least)?;
                Some((quality, height.max(aside), to))
            })
            .filter(|&(_, height, _)| height <= left)
            .collect();
        fits.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.cmp(&b.2)));
        let Some((_, height, _)) = fits.into_iter().find(|&(.., to)| self.edges.contract(to, vertex)) else {
            return false;
        };
        for beside in ring {
            self.has_changed[beside as usize] = true;
            // What was removed before may lie anywhere around the vertex.
            let own = &mut self.errors[beside as usize];
            *own = own.max(error) + height;
        }
        true
    }

    fn around(&self, vertex: u32, triangle: u32) -> Around {
        let [a, b, c] = self.edges.mesh.triangles[triangle as usize];
        let others = match vertex {
            _ if vertex == a => [b, c],
            _ if vertex == b => [c, a],
            _ => [a, b],
        };
        let [from, to] = others.map(|other| self.edges.mesh.positions[other as usize]);
        let at = self.edges.mesh.positions[vertex as usize];
        let normal = normal([at, from, to]);
        Around {
            others,
            ends: [from, to],
            normal,
            thickness: thickness(normal, [at, from, to]),
            part: self.parts[triangle as usize],
        }
    }
}

/// A triangle at a vertex.
struct Around {
    /// Its other corners, as it turns, and their positions.
    others: [u32; 2],
    ends: [DVec3; 2],
    normal: DVec3,
    /// The square of its height over the longest side.
    thickness: f64,
    part: u32,
}

fn longest([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a))
}

fn thickness(normal: DVec3, corners: [DVec3; 3]) -> f64 {
    normal.length_squared() / longest(corners)
}

/// Returns whether a border of parts leads to a neighbour, or a fold by a right angle or more, given the triangles around a vertex.
fn is_border(other: u32, around: &[Around]) -> bool {
    let mut at_edge = around.iter().filter(|around| around.others.contains(&other));
    let Some(one) = at_edge.next() else { return false };
    at_edge.any(|two| one.part != two.part || one.normal.dot(two.normal) <= 0.0)
}

/// Returns the quality of the worst triangle after a vertex was moved to a neighbour, and the vertex's greatest distance from the
/// planes of all; `None` if a triangle would turn, or be no thicker than `least`.
fn worst([from, to]: [DVec3; 2], around: &[Around], neighbour: u32, least: f64) -> Option<(f64, f64)> {
    let (mut worst, mut farthest) = (f64::INFINITY, 0.0f64);
    for around in around.iter().filter(|around| !around.others.contains(&neighbour)) {
        let corners = [to, around.ends[0], around.ends[1]];
        let normal = normal(corners);
        let length = normal.length();
        let height = normal.dot(from - to).abs() / length;
        if thickness(normal, corners) <= least || around.normal.dot(normal) <= 0.0 || !height.is_finite() {
            return None;
        }
        worst = worst.min(length / longest(corners));
        farthest = farthest.max(height);
    }
    Some((worst, farthest))
}

/// Returns how far a vertex with borders to some neighbours is from the straight border that is left once it is moved to one; `None`
/// if it is to stay.
fn aside(to: u32, borders: &[u32], at: impl Fn(u32) -> DVec3, vertex: u32) -> Option<f64> {
    match *borders {
        [] => Some(0.0),
        [one, other] if to == one || to == other => {
            Some(squared_distance_from_segment(at(vertex), [at(one), at(other)]).sqrt())
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::mesh::Precision;
    use crate::solids::{cuboid, geodesic};
    use crate::surface::manifold::ManifoldReport;

    /// Splits each triangle at the middles of its sides.
    fn split(mesh: &TriangleMesh) -> TriangleMesh {
        let mut split = TriangleMesh { positions: mesh.positions.clone(), triangles: Vec::new() };
        let mut middles = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                    let middle = 0.5 * (split.positions[from as usize] + split.positions[to as usize]);
                    split.positions.push(middle);
                    split.positions.len() as u32 - 1
                })
            });
            split.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        split
    }

    #[test]
    fn vertices_in_faces_and_on_edges_go_and_others_stay() {
        let cube = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let mut fine = split(&split(&cube));
        let mut sources = vec![0; fine.triangles.len()];
        let removed = remove_flat(&mut fine, &mut sources, 8, 1e-12, |_| 0);
        let report = ManifoldReport::of(&fine, Precision::Double);
        assert!(report.passed(), "{:?}", report.failures());
        assert_eq!((fine.triangles.len(), sources.len(), removed), (12, 12, 90));
        assert_eq!((fine.signed_volume(), fine.area()), (1.0, 6.0));
        // Those that were given stay, and so do all of a round surface.
        let mut given = split(&cube);
        assert_eq!(remove_flat(&mut given, &mut vec![0; 48], 26, 1e-12, |_| 0), 0);
        let mut round = geodesic(1.0, 8).unwrap();
        let count = round.triangles.len();
        assert_eq!(remove_flat(&mut round, &mut vec![0; count], 0, 1e-12, |_| 0), 0);
    }

    #[test]
    fn borders_of_parts_stay() {
        // The triangles of a cube's upper half are another part.
        let mut fine = split(&split(&cuboid(DVec3::ZERO, DVec3::ONE).unwrap()));
        let is_upper = |triangle: &[u32; 3]| triangle.iter().map(|&v| fine.positions[v as usize].z).sum::<f64>() > 1.5;
        let mut sources: Vec<u32> = fine.triangles.iter().map(|triangle| u32::from(is_upper(triangle))).collect();
        remove_flat(&mut fine, &mut sources, 8, 1e-12, |&part| part);
        assert!(ManifoldReport::of(&fine, Precision::Double).passed());
        let area = |part: u32| -> f64 {
            let of_part = fine.triangles.iter().zip(&sources).filter(|(_, own)| **own == part);
            of_part.map(|(triangle, _)| 0.5 * normal(triangle.map(|v| fine.positions[v as usize])).length()).sum()
        };
        assert!((area(0) - 3.0).abs() < 1e-12 && (area(1) - 3.0).abs() < 1e-12);
        assert!(fine.triangles.len() < 48);
    }
}
