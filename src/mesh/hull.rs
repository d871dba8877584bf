//! The convex hull of positions.
//!
//! Quickhull (Barber, Dobkin & Huhdanpaa 1996) on an integer lattice, where the side of a plane is exact: a point in
//! the plane of a facet is not beyond it, so that no triangle of the hull is degenerate and any number of positions may
//! lie in one plane or on one line.

use std::collections::HashMap;

use glam::DVec3;

use super::TriangleMesh;
use crate::cancel::checkpoint;

/// Largest number of lattice steps along the longest side: normals fit into 64 bits, distances from planes into 128.
const STEPS: f64 = (1u32 << 28) as f64;

/// Returns the convex hull of positions, facing outwards, or `None` where all of them lie in one plane.
///
/// Its corners are among the positions. All positions lie in it, to within 2⁻²⁷ of the longest side of their box.
pub fn convex_hull(positions: &[DVec3]) -> Option<TriangleMesh> {
    let min = positions.iter().copied().reduce(DVec3::min)?;
    let extent = positions.iter().copied().reduce(DVec3::max)? - min;
    // A power of two, so that coordinates of few digits stay exact and flat sets stay flat.
    let scale = (STEPS / extent.max_element()).log2().floor().exp2();
    if !scale.is_finite() {
        return None;
    }
    let points: Vec<Point> =
        positions.iter().map(|&p| ((p - min) * scale).round().to_array().map(|c| c as i64)).collect();
    let mut hull = Hull::simplex(&points)?;
    while let Some(face) = hull.waiting.pop() {
        hull.grow(face);
    }
    let mut corners: HashMap<u32, u32> = HashMap::new();
    let mut mesh = TriangleMesh::default();
    for face in hull.faces.iter().filter(|face| face.is_alive) {
        mesh.triangles.push(face.corners.map(|corner| {
            *corners.entry(corner).or_insert_with(|| {
                mesh.positions.push(positions[corner as usize]);
                mesh.positions.len() as u32 - 1
            })
        }));
    }
    Some(mesh)
}

type Point = [i64; 3];

struct Hull<'p> {
    points: &'p [Point],
    faces: Vec<Face>,
    /// Faces that may have points beyond them.
    waiting: Vec<usize>,
}

struct Face {
    corners: [u32; 3],
    /// The faces across the edges from each corner to the next.
    beside: [usize; 3],
    normal: [i64; 3],
    /// Points beyond the plane that are not yet in the hull.
    beyond: Vec<u32>,
    is_alive: bool,
}

impl<'p> Hull<'p> {
    /// Builds a tetrahedron from four of the points that do not lie in one plane.
    fn simplex(points: &'p [Point]) -> Option<Hull<'p>> {
        let all = || 0..points.len() as u32;
        let at = |i: u32| points[i as usize];
        let a = all().min_by_key(|&i| at(i))?;
        let b = all().max_by_key(|&i| length(minus(at(i), at(a))))?;
        let from_line = |i: u32| length(cross(minus(at(b), at(a)), minus(at(i), at(a))));
        let c = all().max_by_key(|&i| from_line(i)).filter(|&c| from_line(c) > 0)?;
        let normal = cross(minus(at(b), at(a)), minus(at(c), at(a)));
        let from_plane = |i: u32| dot(normal, minus(at(i), at(a)));
        let d = all().max_by_key(|&i| from_plane(i).abs()).filter(|&d| from_plane(d) != 0)?;
        let [b, c] = if from_plane(d) > 0 { [c, b] } else { [b, c] };
        let mut hull = Hull { points, faces: Vec::new(), waiting: Vec::new() };
        for (corners, beside) in
            [([a, b, c], [1, 2, 3]), ([a, d, b], [3, 2, 0]), ([b, d, c], [1, 3, 0]), ([c, d, a], [2, 1, 0])]
        {
            hull.add(corners, beside);
        }
        hull.hand_out(all(), 0);
        Some(hull)
    }

    fn add(&mut self, corners: [u32; 3], beside: [usize; 3]) -> usize {
        let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
        let normal = cross(minus(b, a), minus(c, a));
        self.faces.push(Face { corners, beside, normal, beyond: Vec::new(), is_alive: true });
        self.faces.len() - 1
    }

    /// Returns the height of a point above the plane of a face, times the length of the face's normal.
    fn height(&self, face: usize, point: u32) -> i128 {
        let Face { corners, normal, .. } = &self.faces[face];
        dot(*normal, minus(self.points[point as usize], self.points[corners[0] as usize]))
    }

    /// Assigns each point to the first face, from `first` on, that it lies beyond; points beyond none are in the hull.
    fn hand_out(&mut self, points: impl Iterator<Item = u32>, first: usize) {
        for point in points {
            checkpoint();
            if let Some(face) = (first..self.faces.len()).find(|&face| self.height(face, point) > 0) {
                self.faces[face].beyond.push(point);
            }
        }
        self.waiting.extend(first..self.faces.len());
    }

    /// Adds the point that lies farthest beyond a face, if there is any.
    fn grow(&mut self, face: usize) {
        if !self.faces[face].is_alive {
            return;
        }
        let Some(&apex) = self.faces[face].beyond.iter().max_by_key(|&&point| self.height(face, point)) else { return };
        // The faces that the point sees are connected, and so is the horizon around them.
        let mut seen = vec![face];
        self.faces[face].is_alive = false;
        let mut horizon = Vec::new();
        let mut next = 0;
        while let Some(&here) = seen.get(next) {
            next += 1;
            for edge in 0..3 {
                let other = self.faces[here].beside[edge];
                if !self.faces[other].is_alive {
                    continue;
                }
                if self.height(other, apex) > 0 {
                    self.faces[other].is_alive = false;
                    seen.push(other);
                } else {
                    let corners = self.faces[here].corners;
                    horizon.push((corners[edge], corners[(edge + 1) % 3], here, other));
                }
            }
        }
        let first = self.faces.len();
        let from: HashMap<u32, usize> = horizon.iter().enumerate().map(|(i, &(from, ..))| (from, first + i)).collect();
        let to: HashMap<u32, usize> = horizon.iter().enumerate().map(|(i, &(_, to, ..))| (to, first + i)).collect();
        for (a, b, here, other) in horizon {
            let new = self.add([a, b, apex], [other, from[&b], to[&a]]);
            let edge = self.faces[other].corners.iter().position(|&corner| corner == b);
            let edge = edge.expect("faces on both sides of an edge have its corners");
            debug_assert_eq!(self.faces[other].beside[edge], here);
            self.faces[other].beside[edge] = new;
        }
        let beyond: Vec<u32> = seen.iter().flat_map(|&face| std::mem::take(&mut self.faces[face].beyond)).collect();
        self.hand_out(beyond.into_iter(), first);
    }
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Point, b: Point) -> i128 {
    (0..3).map(|i| i128::from(a[i]) * i128::from(b[i])).sum()
}

/// Returns the squared length.
fn length(a: Point) -> i128 {
    dot(a, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::ClosedMesh;
    use crate::testing::random::Congruential;

    /// Checks that a hull is closed, faces outwards, has no flat triangle and contains all positions; returns its
    /// volume.
    fn checked(positions: &[DVec3]) -> f64 {
        let hull = convex_hull(positions).expect("positions of more than one plane");
        let closed = ClosedMesh::check(hull.clone()).expect("a closed hull");
        assert!(closed.oriented());
        assert_eq!(hull.positions.len() + hull.triangles.len(), hull.triangles.len() * 3 / 2 + 2, "V − E + F is 2");
        for triangle in &hull.triangles {
            let [a, b, c] = triangle.map(|corner| hull.positions[corner as usize]);
            let normal = (b - a).cross(c - a);
            assert!(normal.length() > 0.0);
            let beyond = positions.iter().map(|&p| normal.normalize().dot(p - a)).fold(0.0, f64::max);
            assert!(beyond < 1e-7, "a position lies {beyond} beyond a facet");
        }
        closed.signed_volume()
    }

    #[test]
    fn hulls_hold_positions_in_faces_edges_and_corners_of_a_box() {
        let grid = |side: usize| (0..side * side * side).map(move |i| [i % side, i / side % side, i / side / side]);
        let positions: Vec<DVec3> = grid(7).map(|p| DVec3::from_array(p.map(|c| c as f64))).collect();
        assert!((checked(&positions) - 216.0).abs() < 1e-9);
        let again: Vec<DVec3> = positions.iter().rev().chain(&positions).copied().collect();
        assert!((checked(&again) - 216.0).abs() < 1e-9);
    }

    #[test]
    fn random_lattice_positions_have_a_closed_hull() {
        let mut random = Congruential::new(7);
        for round in 0..300 {
            let mut coordinate = || random.below(2 + round % 5) as f64;
            let positions: Vec<DVec3> =
                (0..4 + round % 40).map(|_| DVec3::new(coordinate(), coordinate(), coordinate())).collect();
            if convex_hull(&positions).is_some() {
                checked(&positions);
            }
        }
    }

    #[test]
    fn the_hull_of_a_ball_is_the_ball() {
        let ball = crate::solids::geodesic(10.0, 16).unwrap();
        let volume = ball.signed_volume();
        assert!((checked(&ball.positions) / volume - 1.0).abs() < 1e-9);
    }

    #[test]
    fn flat_position_sets_have_no_hull() {
        let flat = |p: [f64; 2]| DVec3::new(p[0], p[1], p[0] + 2.0 * p[1]);
        let plane: Vec<DVec3> = (0..20).map(|i| flat([f64::from(i % 5), f64::from(i / 5)])).collect();
        assert!(convex_hull(&plane).is_none());
        assert!(convex_hull(&[DVec3::ZERO; 9]).is_none() && convex_hull(&[]).is_none());
    }
}
