//! Vertices, sides and triangles of a surface that lie near one another.

use glam::DVec3;

use super::parted::{Piece, extent};
use crate::closest::squared_distance;
use crate::face_tree::FaceTree;
use crate::mesh::Aabb;

/// What lies near one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Meeting {
    /// Two vertices, the lower one first.
    Vertices([u32; 2]),
    /// A vertex and an edge, its lower end first.
    Edge { vertex: u32, edge: [u32; 2] },
    /// Two edges, the lower one first.
    Edges([[u32; 2]; 2]),
    /// A vertex and the inside of a triangle, its corners in order.
    Face { vertex: u32, face: [u32; 3] },
    /// Two edges, of which one or both are diagonals between parts of a triangle.
    Diagonals([[u32; 2]; 2]),
}

/// A triangle with its plane.
struct Face {
    vertices: [u32; 3],
    corners: [DVec3; 3],
    is_outer: [bool; 3],
    /// The box around the side from each corner.
    around: [Aabb; 3],
    /// Of length 1; zero if the triangle has no area.
    normal: DVec3,
    /// Its least height.
    height: f64,
    /// A bound on the error of the distance of a point near it from its plane.
    error: f64,
}

impl Face {
    fn of(&Piece { corners: vertices, is_outer, .. }: &Piece, positions: &[DVec3]) -> Face {
        let corners = vertices.map(|vertex| positions[vertex as usize]);
        let ends = [0, 1, 2].map(|i| [corners[i], corners[(i + 1) % 3]]);
        let around = ends.map(|[p, q]| Aabb { min: p.min(q), max: p.max(q) });
        let lengths = ends.map(|[p, q]| p.distance(q));
        let (longest, normal) = across(corners, lengths);
        let height = normal.length() / lengths[longest];
        let error = 8.0 * f64::EPSILON * lengths.iter().product::<f64>() / normal.length();
        Face { vertices, corners, is_outer, around, normal: normal.normalize_or_zero(), height, error }
    }
}

/// Returns the longest side of a triangle, and the product of the shorter ones as vectors, whose rounding is least.
fn across(corners: [DVec3; 3], lengths: [f64; 3]) -> (usize, DVec3) {
    let longest = (0..3).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or(0);
    let [a, b, c] = [2, 0, 1].map(|i| corners[(longest + i) % 3]);
    (longest, (b - a).cross(c - a))
}

/// Returns the least height of a triangle; no number if it has no extent.
pub(super) fn least_height(corners: [DVec3; 3]) -> f64 {
    let lengths = [0, 1, 2].map(|i| corners[i].distance(corners[(i + 1) % 3]));
    let (longest, normal) = across(corners, lengths);
    normal.length() / lengths[longest]
}

/// Returns the tree of the boxes of pieces, enlarged by some distance.
pub(super) fn tree_of(pieces: &[Piece], positions: &[DVec3], beyond: f64) -> FaceTree {
    let numbers: Vec<u32> = (0..pieces.len() as u32).collect();
    FaceTree::of(&numbers, |piece| extent(pieces[piece as usize].corners, positions, beyond))
}

/// Returns what lies near one another of pairs of pieces of which one is new, in order.
pub(super) fn meetings(pieces: &[Piece], positions: &[DVec3], distance: f64) -> Vec<Meeting> {
    if pieces.is_empty() {
        return Vec::new();
    }
    let tree = tree_of(pieces, positions, 0.5 * distance);
    let prepare = |place: usize| Face::of(&pieces[tree.faces()[place] as usize], positions);
    let is_wanted = |place: usize| pieces[tree.faces()[place] as usize].is_new;
    let look = |one: &Face, other: &Face, found: &mut Vec<Meeting>| of_pair(one, other, distance, found);
    tree.distinct_of_own_pairs(is_wanted, prepare, look)
}

/// Adds what of two triangles lies near one another.
fn of_pair(one: &Face, other: &Face, distance: f64, found: &mut Vec<Meeting>) {
    let heights = |face: &Face, of: &Face| of.corners.map(|corner| face.normal.dot(corner - face.corners[0]));
    let both = [heights(one, other), heights(other, one)];
    for (face, heights) in [one, other].into_iter().zip(both) {
        let limit = distance + face.error;
        // The error of a triangle without area is no number.
        if heights.iter().all(|&height| height > limit) || heights.iter().all(|&height| height < -limit) {
            return;
        }
    }
    for (face, of, heights) in [(one, other, both[0]), (other, one, both[1])] {
        for (i, height) in heights.into_iter().enumerate() {
            let (vertex, point) = (of.vertices[i], of.corners[i]);
            let is_far = height.abs() > distance + face.error;
            if !is_far && !face.vertices.contains(&vertex) {
                beside(vertex, point, face, distance, found);
            }
        }
    }
    let are_apart = |edge: &[u32; 2], other: &[u32; 2]| !edge.iter().any(|end| other.contains(end));
    // A side that stays on one side of the other's plane passes none of its sides.
    let comes_near = |face: &Face, heights: [f64; 3], i: usize| {
        let (limit, ends) = (distance + face.error, [heights[i], heights[(i + 1) % 3]]);
        !(ends.iter().all(|&height| height > limit) || ends.iter().all(|&height| height < -limit))
    };
    for i in (0..3).filter(|&i| comes_near(other, both[1], i)) {
        let (edge, ends) = side(one, i);
        for j in (0..3).filter(|&j| comes_near(one, both[0], j)) {
            let (second, second_ends) = side(other, j);
            if are_apart(&edge, &second)
                && may_be_near(one.around[i], other.around[j], distance)
                && do_pass(ends, second_ends, distance)
            {
                let edges = [edge.min(second), edge.max(second)];
                found.push(match one.is_outer[i] && other.is_outer[j] {
                    true => Meeting::Edges(edges),
                    false => Meeting::Diagonals(edges),
                });
            }
        }
    }
}

/// Returns false for boxes whose contents are farther from one another than a distance, whatever rounding does.
fn may_be_near(one: Aabb, other: Aabb, distance: f64) -> bool {
    let slack = DVec3::splat(2.0 * distance);
    (one.min - slack).cmple(other.max).all() && (other.min - slack).cmple(one.max).all()
}

/// Returns a side of a face, its lower end first.
fn side(face: &Face, i: usize) -> ([u32; 2], [DVec3; 2]) {
    let (j, corners) = ((i + 1) % 3, &face.corners);
    let [u, v] = [face.vertices[i], face.vertices[j]];
    if u < v { ([u, v], [corners[i], corners[j]]) } else { ([v, u], [corners[j], corners[i]]) }
}

/// Adds the corner, or else the sides, or else the face that a vertex is near to.
fn beside(vertex: u32, point: DVec3, face: &Face, distance: f64, found: &mut Vec<Meeting>) {
    let near_corner = (0..3).find(|&i| face.corners[i].distance_squared(point) <= 4.0 * distance * distance);
    if let Some(i) = near_corner {
        let corner = face.vertices[i];
        return found.push(Meeting::Vertices([vertex.min(corner), vertex.max(corner)]));
    }
    let before = found.len();
    for i in 0..3 {
        let (edge, ends) = side(face, i);
        if may_be_near(Aabb { min: point, max: point }, face.around[i], distance) && is_beside(point, ends, distance) {
            found.push(Meeting::Edge { vertex, edge });
        }
    }
    let [a, b, _] = face.around;
    if found.len() == before
        && face.height > 2.0 * distance
        && may_be_near(Aabb { min: point, max: point }, a.union(b), distance)
        && squared_distance(point, face.corners) <= distance * distance
    {
        let mut corners = face.vertices;
        corners.sort_unstable();
        found.push(Meeting::Face { vertex, face: corners });
    }
}

/// Returns whether a point lies within a distance of the inside of a segment.
fn is_beside(point: DVec3, [from, to]: [DVec3; 2], distance: f64) -> bool {
    let along = to - from;
    let share = along.dot(point - from) / along.length_squared();
    (0.0..=1.0).contains(&share) && (from + share * along).distance_squared(point) <= distance * distance
}

/// Returns the shares of two segments at which they are closest, unless they are parallel. Of nearly parallel ones the first is as
/// precise as their distance from each other, and the second is where the other is closest to that point; of parallel ones the first
/// may be any by rounding.
pub(super) fn closest_shares([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> Option<[f64; 2]> {
    let (u, v, w) = (q - p, s - r, r - p);
    let across = |vector: DVec3| vector - vector.dot(v) / v.length_squared() * v;
    let aside = across(u);
    let share = across(w).dot(aside) / aside.length_squared();
    share.is_finite().then(|| [share, (share * u - w).dot(v) / v.length_squared()])
}

/// Returns whether two segments pass each other within a distance, and no end is as near to the other segment.
fn do_pass(one: [DVec3; 2], other: [DVec3; 2], distance: f64) -> bool {
    let Some([s, t]) = closest_shares(one, other) else { return false };
    if !(0.0..=1.0).contains(&s) || !(0.0..=1.0).contains(&t) {
        return false;
    }
    let (p, q) = (one[0].lerp(one[1], s), other[0].lerp(other[1], t));
    p.distance_squared(q) <= 0.25 * distance * distance
        && !one.iter().any(|&end| is_near(end, other, distance))
        && !other.iter().any(|&end| is_near(end, one, distance))
}

fn is_near(point: DVec3, segment: [DVec3; 2], distance: f64) -> bool {
    is_beside(point, segment, distance)
        || segment.iter().any(|&end| end.distance_squared(point) <= 4.0 * distance * distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearly_parallel_segments_pass_where_they_cross() {
        let one = [DVec3::new(0.3, 0.1, 0.7), DVec3::new(1.3, 0.1 + 1e-6, 0.7)];
        for share in [0.25, 0.5, 0.9] {
            let at = one[0].lerp(one[1], share);
            let along = DVec3::new(0.7, -1e-6, 0.0);
            let other = [at - share * along, at + (1.0 - share) * along];
            let [s, t] = closest_shares(one, other).unwrap();
            assert!((s - share).abs() < 1e-8 && (t - share).abs() < 1e-8, "{s} {t} {share}");
            assert!(do_pass(one, other, 1e-11));
            assert!(!do_pass(one, other.map(|end| end + 1e-11 * DVec3::Z), 1e-11));
        }
        assert_eq!(closest_shares([DVec3::ZERO, DVec3::X], [DVec3::Y, DVec3::Y + 2.0 * DVec3::X]), None);
    }
}
