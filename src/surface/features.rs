//! Vertices of edges and corners that belong beyond their cells.
//!
//! A mesh whose vertices are all in their cells has the signs of the lattice's nodes: the two triangles of an edge lie in the
//! block of its four cells, which has no other edge inside, and cross that one an odd number of times. When one vertex moves,
//! each of its triangles sweeps a tetrahedron, and the sign of a node changes only if it lies in an odd number of them. So a
//! vertex may move to its target if **no node lies in any tetrahedron that it sweeps**; and if moreover none lies in the
//! tetrahedron of the four corners of any of its quadrilaterals, either diagonal may be chosen afterwards. Both hold initially
//! and are invariant under every move, so that the mesh, sampled again on the same lattice, reproduces the same nodes, sharp
//! edges and all.
//!
//! A vertex whose move is not allowed moves part of the way, or stays in its cell. Neighbours that moved later may have made
//! room, so vertices that stayed are tried again. At first nodes have a margin of the rounding of 32-bit coordinates; moves
//! blocked by a node beside a face are retried with the lattice's own rounding: one mover in a thousand.

use std::collections::HashMap;

use crate::parallel::*;
use glam::DVec3;

use super::cells::MARGIN;
use super::feature::Feature;
use super::intersect::cell_of;
use super::quads::{OpenQuad, Quad};
use crate::cancel::checkpoint;

/// The number of attempts with either margin.
const ROUNDS: usize = 3;

/// The shares of its way that a blocked vertex tries.
const PART_WAYS: [f64; 3] = [0.75, 0.5, 0.25];

/// Distance below which readers of 32-bit coordinates would merge two vertices.
pub const APART: f64 = 1e-3;

/// The features of a mesh, and the quadrilaterals around each.
pub struct Features<'a> {
    /// All features, in the order of their vertices.
    pub all: &'a [Feature],
    /// For each vertex the number of its feature plus one, or zero.
    pub marks: &'a [u32],
    /// All quadrilaterals that hold a feature.
    pub quads: &'a [OpenQuad],
    /// The quadrilaterals of feature i are `around[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    around: Vec<u32>,
}

impl<'a> Features<'a> {
    /// Builds the index from features in the order of their vertices, the marks of all vertices, and all quadrilaterals that
    /// hold a feature.
    pub fn new(all: &'a [Feature], marks: &'a [u32], quads: &'a [OpenQuad]) -> Features<'a> {
        let mut features = Features { all, marks, quads, starts: vec![0; all.len() + 1], around: Vec::new() };
        let mut starts = vec![0; all.len() + 1];
        for open in quads {
            features.features_of(&open.quad).for_each(|feature| starts[feature + 1] += 1);
        }
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut around = vec![0; starts[all.len()] as usize];
        for (at, open) in (0u32..).zip(quads) {
            for feature in features.features_of(&open.quad) {
                around[next[feature] as usize] = at;
                next[feature] += 1;
            }
        }
        (features.starts, features.around) = (starts, around);
        features
    }

    /// Returns the feature of a vertex.
    pub fn of_vertex(&self, vertex: u32) -> Option<usize> {
        (*self.marks.get(vertex as usize)? as usize).checked_sub(1)
    }

    /// Returns the features among the corners of a quadrilateral.
    pub fn features_of(&self, quad: &Quad) -> impl Iterator<Item = usize> + use<'_, 'a> {
        quad.corners.into_iter().filter_map(|vertex| self.of_vertex(vertex))
    }

    /// Returns the numbers of the quadrilaterals around a feature.
    pub fn around(&self, feature: usize) -> &[u32] {
        &self.around[self.starts[feature] as usize..self.starts[feature + 1] as usize]
    }

    fn quads_of(&self, feature: usize) -> impl Iterator<Item = &'a Quad> + '_ {
        self.around(feature).iter().map(|&at| &self.quads[at as usize].quad)
    }

    /// Moves vertices to their targets, in coordinates of cells, in which nodes have integer coordinates. Returns the number of
    /// vertices that did not reach them.
    ///
    /// `rounding` is the greatest movement of a surface by the lattice's rounding, in pitches.
    pub fn resolve(&self, rounding: f64, vertices: &mut [DVec3]) -> u64 {
        let mut taken = self.others_near_targets(vertices);
        // Of several vertices with the same target, the nearest moves there.
        let way = |&feature: &usize| {
            let Feature { held, target, .. } = self.all[feature];
            target.map_or(0.0, |target| target.distance_squared(held))
        };
        let mut waiting: Vec<usize> = (0..self.all.len()).filter(|&i| self.all[i].target.is_some()).collect();
        waiting.sort_by(|a, b| way(a).total_cmp(&way(b)));
        for round in 0..2 * ROUNDS {
            checkpoint();
            let margin = if round < ROUNDS { MARGIN } else { rounding.min(MARGIN) };
            waiting.retain(|&i| !self.moves(i, 1.0, margin, vertices, &mut taken));
        }
        for &i in &waiting {
            let _ = PART_WAYS.iter().any(|&share| self.moves(i, share, MARGIN, vertices, &mut taken));
        }
        waiting.len() as u64
    }

    /// Returns the stationary vertices in the cells that movers go to: another loop may have found the same corner.
    fn others_near_targets(&self, vertices: &[DVec3]) -> Taken {
        let is_mover = |vertex: u32| self.of_vertex(vertex).is_some_and(|i| self.all[i].target.is_some());
        let targets: Vec<DVec3> = self.all.iter().filter_map(|feature| feature.target).collect();
        Taken::near(&targets, vertices, |vertex| !is_mover(vertex))
    }

    /// Moves a vertex by a share of its way if that is allowed; returns whether it moved.
    fn moves(&self, mover: usize, share: f64, margin: f64, vertices: &mut [DVec3], taken: &mut Taken) -> bool {
        let Feature { vertex, target: Some(target), .. } = self.all[mover] else { return false };
        let to = vertices[vertex as usize].lerp(target, share);
        let free = !taken.holds(to) && self.may_go(mover, to, margin, vertices);
        if free {
            taken.add(to);
            vertices[vertex as usize] = to;
        }
        free
    }

    /// Returns whether a feature may move to a point without a change of any node's sign, whatever the diagonals.
    pub fn may_go(&self, feature: usize, to: DVec3, margin: f64, vertices: &[DVec3]) -> bool {
        let vertex = self.all[feature].vertex;
        self.quads_of(feature).all(|quad| may_go(vertex, to, &quad.corners, vertices, margin))
    }

    /// Returns the distance of a quadrilateral's crossing from all triangles around its features: the face of this crossing may
    /// lie in the triangles of another crossing.
    pub fn distance(&self, open: &OpenQuad, vertices: &[DVec3]) -> f32 {
        let around = self.features_of(&open.quad).flat_map(|feature| self.quads_of(feature));
        around.map(|quad| open.quad.distance(quad, vertices)).fold(f32::INFINITY, f32::min)
    }
}

/// A Bloom filter: a set of cells with a few false positives.
pub struct CellFilter {
    bits: Vec<u64>,
}

impl CellFilter {
    /// Creates a filter for the given number of cells, with about 64 bits for each.
    pub fn new(cells: usize) -> CellFilter {
        CellFilter { bits: vec![0; cells.next_power_of_two().max(2)] }
    }

    fn place(&self, cell: [i32; 3]) -> (usize, u64) {
        let [x, y, z] = cell.map(|c| i64::from(c) as u64);
        let mixed = (x ^ y << 21 ^ z << 42).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        // The upper bits of a product depend on all bits of its factors, the lower ones on few.
        let hash = (mixed ^ mixed >> 32).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let bits = self.bits.len().trailing_zeros();
        ((hash >> (64 - bits)) as usize, 1 << (hash >> (58 - bits) & 63))
    }

    pub fn add(&mut self, cell: [i32; 3]) {
        let (word, bit) = self.place(cell);
        self.bits[word] |= bit;
    }

    pub fn may_be(&self, cell: [i32; 3]) -> bool {
        let (word, bit) = self.place(cell);
        self.bits[word] & bit != 0
    }

    /// Returns whether a point may lie in one of the cells.
    pub fn may_hold(&self, point: DVec3) -> bool {
        self.may_be(cell_of(point))
    }
}

/// The positions of vertices that others must keep away from.
#[derive(Default)]
pub struct Taken {
    by_place: HashMap<[i64; 3], Vec<DVec3>>,
}

impl Taken {
    /// Returns the places, among those of all vertices, of some that lie in the cells of targets.
    pub fn near(targets: &[DVec3], vertices: &[DVec3], is_wanted: impl Fn(u32) -> bool + Sync) -> Taken {
        let mut cells = CellFilter::new(targets.len());
        targets.iter().for_each(|&target| cells.add(cell_of(target)));
        let is_near = |(vertex, place): &(usize, &DVec3)| cells.may_hold(**place) && is_wanted(*vertex as u32);
        let numbered = vertices.par_iter().enumerate().with_min_len(1 << 14);
        let near: Vec<DVec3> = numbered.filter(is_near).map(|(_, place)| *place).collect();
        let mut taken = Taken::default();
        near.into_iter().for_each(|place| taken.add(place));
        taken
    }

    pub fn add(&mut self, point: DVec3) {
        self.by_place.entry(place(point)).or_default().push(point);
    }

    /// Returns whether a vertex is within [`APART`] of a point.
    pub fn holds(&self, point: DVec3) -> bool {
        let [x, y, z] = place(point);
        let near = |i: i64| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1];
        let is_near = |others: &Vec<DVec3>| others.iter().any(|other| other.distance(point) < APART);
        (0..27).any(|i| self.by_place.get(&near(i)).is_some_and(is_near))
    }
}

/// Returns the block of side [`APART`] that a point lies in.
fn place(point: DVec3) -> [i64; 3] {
    (point / APART).floor().to_array().map(|c| c as i64)
}

/// Returns whether a vertex of a quadrilateral may move to a point.
fn may_go(vertex: u32, target: DVec3, corners: &[u32; 4], vertices: &[DVec3], margin: f64) -> bool {
    let turn = corners.iter().position(|&corner| corner == vertex).expect("the quadrilateral is the vertex's");
    let at = |i: usize| vertices[corners[(turn + i) % 4] as usize];
    let (from, a, b, c) = (at(0), at(1), at(2), at(3));
    let apart = [a, b, c].into_iter().all(|other| other.distance(target) > APART);
    apart
        && !holds_node([from, target, a, b], margin)
        && !holds_node([from, target, b, c], margin)
        && !holds_node([target, a, b, c], margin)
}

/// Returns whether a node lies in a tetrahedron, or within a margin of it.
pub fn holds_node(corners: [DVec3; 4], margin: f64) -> bool {
    let least = corners.into_iter().fold(corners[0], DVec3::min) - margin;
    let greatest = corners.into_iter().fold(corners[0], DVec3::max) + margin;
    let (from, to) = (least.ceil(), greatest.floor());
    let mut node = from;
    while node.z <= to.z {
        node.y = from.y;
        while node.y <= to.y {
            node.x = from.x;
            while node.x <= to.x {
                if is_near(node, &corners, margin) {
                    return true;
                }
                node.x += 1.0;
            }
            node.y += 1.0;
        }
        node.z += 1.0;
    }
    false
}

/// Returns whether no plane through three corners separates a point from the fourth by more than the margin. A tetrahedron of
/// zero volume has planes as well, unless its corners are collinear; then its bounding box is tested instead.
fn is_near(point: DVec3, corners: &[DVec3; 4], margin: f64) -> bool {
    for apex in 0..4 {
        let [a, b, c] = [1, 2, 3].map(|i| corners[(apex + i) % 4]);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
        let (of_apex, of_point) = (normal.dot(corners[apex] - a), normal.dot(point - a));
        let outside = if of_apex >= 0.0 { of_point < -margin } else { of_point > margin };
        // Both sides of a flat tetrahedron are outside.
        if outside || (of_apex.abs() < margin && of_point.abs() > 2.0 * margin) {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_nodes_inside_tetrahedra_are_found() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let around = [at(0.6, 0.7, 0.8), at(1.5, 0.8, 0.9), at(0.9, 1.6, 0.8), at(0.9, 0.9, 1.7)];
        assert!(holds_node(around, MARGIN));
        for shift in [at(0.3, 0.3, 0.3), at(0.0, 0.0, 0.25), at(0.0, 0.45, 0.0)] {
            assert!(!holds_node(around.map(|p| p + shift), MARGIN), "{shift}");
        }
        // Flat, through a node and beside it.
        let flat = [at(0.5, 0.5, 1.0), at(1.5, 0.5, 1.0), at(1.0, 1.5, 1.0), at(1.2, 0.6, 1.0)];
        assert!(holds_node(flat, MARGIN));
        assert!(!holds_node(flat.map(|p| p + at(0.0, 0.0, 0.01)), MARGIN));
        // A box that holds many nodes, none of which the tetrahedron holds.
        assert!(!holds_node([at(0.1, 0.05, 0.1), at(3.1, 3.05, 3.1), at(3.1, 3.05, 3.2), at(3.12, 3.0, 3.1)], MARGIN));
    }
}
