//! Faces of any number of corners, and their triangulation.
//!
//! A strictly convex face becomes a fan about its first corner. Any other is triangulated by ear clipping in the plane
//! of its two lesser normal components (the normal is Newell's, so that it exists for faces that are not quite flat). A
//! corner is an ear where it turns left and no other corner lies in or on its triangle; where no ear is left, as in
//! faces with self-intersections or collinear corners, the rest becomes a fan. In every case each side of the face is a
//! side of exactly one triangle, in the face's direction, and each diagonal is used once in each direction: a closed
//! mesh of polygons gives a closed mesh of triangles.

use glam::{DVec2, DVec3};

use super::checkpoint_at;
use super::note::ReadNote;

/// Largest number of corner tests for one file. Ear clipping takes quadratic time in the worst case, and a hostile file
/// could have a face of a million corners; beyond the limit faces become fans.
const CORNER_TESTS: u64 = 1 << 28;

/// The faces of a file, as concatenated lists of vertex indices.
#[derive(Default)]
pub(super) struct Polygons {
    corners: Vec<u32>,
    ends: Vec<usize>,
}

impl Polygons {
    /// Adds a corner to the face that [`Polygons::end_face`] will end.
    #[inline]
    pub(super) fn push_corner(&mut self, vertex: u32) {
        self.corners.push(vertex);
    }

    #[inline]
    pub(super) fn end_face(&mut self) {
        self.ends.push(self.corners.len());
    }

    pub(super) fn faces(&self) -> usize {
        self.ends.len()
    }

    /// Returns the corners of each face. Corners pushed since the last face ended belong to none.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        self.ends.iter().scan(0, |start, &end| {
            let face = &self.corners[*start..end];
            *start = end;
            Some(face)
        })
    }

    /// Returns the triangles of all faces, in order. Every index must be in range.
    ///
    /// Faces of fewer than three corners give none and are noted, as are the faces that were triangulated.
    pub(super) fn triangles(&self, positions: &[DVec3], notes: &mut Vec<ReadNote>) -> Vec<[u32; 3]> {
        let count = self.iter().map(|face| face.len().saturating_sub(2)).sum();
        let mut triangles = Vec::with_capacity(count);
        let mut cutter = Cutter { tests_left: CORNER_TESTS, ..Cutter::default() };
        let (mut cut, mut doubtful, mut ignored) = (0, 0, 0);
        for (number, face) in self.iter().enumerate() {
            checkpoint_at(number);
            match *face {
                [a, b, c] => triangles.push([a, b, c]),
                [_, _, _, ..] => {
                    cut += 1;
                    doubtful += usize::from(cutter.cut(face, positions, &mut triangles) == Cut::Doubtful);
                }
                _ => ignored += 1,
            }
        }
        if cut > 0 {
            notes.push(ReadNote::PolygonsTriangulated { count: cut });
        }
        if doubtful > 0 {
            notes.push(ReadNote::PolygonsNotSimple { count: doubtful });
        }
        if ignored > 0 {
            notes.push(ReadNote::PointsOrLinesIgnored { count: ignored });
        }
        triangles
    }
}

/// The triangles of a strip, corner by corner.
///
/// Every other triangle is reversed, so that all face the same way. Triangles that name a vertex twice are left out,
/// since they only lead from strip to strip.
#[derive(Default)]
pub(super) struct Strip {
    before_last: Option<u32>,
    last: Option<u32>,
    is_odd: bool,
}

impl Strip {
    /// Returns the triangle that this corner completes.
    pub(super) fn triangle(&mut self, corner: u32) -> Option<[u32; 3]> {
        let before_last = std::mem::replace(&mut self.before_last, self.last.replace(corner));
        let (Some(a), Some(b)) = (before_last, self.before_last) else { return None };
        let is_odd = self.is_odd;
        self.is_odd = !is_odd;
        let is_flat = a == b || b == corner || corner == a;
        (!is_flat).then_some(if is_odd { [b, a, corner] } else { [a, b, corner] })
    }
}

/// The result of a triangulation: whether the triangles of the face are known not to overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cut {
    Simple,
    Doubtful,
}

#[derive(Default)]
struct Cutter {
    tests_left: u64,
    plane: Vec<DVec2>,
    ring: Vec<usize>,
}

impl Cutter {
    fn cut(&mut self, face: &[u32], positions: &[DVec3], triangles: &mut Vec<[u32; 3]>) -> Cut {
        self.project(face, positions);
        if self.is_strictly_convex() {
            for k in 1..face.len() - 1 {
                triangles.push([face[0], face[k], face[k + 1]]);
            }
            return Cut::Simple;
        }
        self.ring.clear();
        self.ring.extend(0..face.len());
        // The search continues from the last ear, so that long ribbons do not always restart at the first corner.
        let mut at = 0;
        while self.ring.len() > 3 {
            let Some(ear) = self.next_ear(at) else { break };
            let n = self.ring.len();
            let (before, after) = (self.ring[(ear + n - 1) % n], self.ring[(ear + 1) % n]);
            triangles.push([face[before], face[self.ring[ear]], face[after]]);
            self.ring.remove(ear);
            at = if ear == 0 { 0 } else { ear - 1 };
        }
        let cut = if self.ring.len() == 3 && self.goes_round_once() { Cut::Simple } else { Cut::Doubtful };
        for k in 1..self.ring.len() - 1 {
            triangles.push([face[self.ring[0]], face[self.ring[k]], face[self.ring[k + 1]]]);
        }
        cut
    }

    /// Drops the axis along which the face's normal is longest, so that the face turns left.
    fn project(&mut self, face: &[u32], positions: &[DVec3]) {
        let corner = |k: usize| positions[face[k % face.len()] as usize];
        let origin = corner(0);
        let mut normal = DVec3::ZERO;
        for k in 1..face.len() - 1 {
            normal += (corner(k) - origin).cross(corner(k + 1) - origin);
        }
        let size = normal.abs();
        let flat = |p: DVec3| {
            let p = p - origin;
            if size.z >= size.x && size.z >= size.y {
                if normal.z < 0.0 { DVec2::new(p.y, p.x) } else { DVec2::new(p.x, p.y) }
            } else if size.y >= size.x {
                if normal.y < 0.0 { DVec2::new(p.x, p.z) } else { DVec2::new(p.z, p.x) }
            } else if normal.x < 0.0 {
                DVec2::new(p.z, p.y)
            } else {
                DVec2::new(p.y, p.z)
            }
        };
        self.plane.clear();
        self.plane.extend((0..face.len()).map(|k| flat(corner(k))));
    }

    /// Returns whether every corner turns left and the boundary goes round once.
    fn is_strictly_convex(&self) -> bool {
        let n = self.plane.len();
        let side = |k: usize| self.plane[(k + 1) % n] - self.plane[k % n];
        // In one round, the direction of a side changes from leftwards to rightwards once.
        let mut rounds = 0;
        for k in 0..n {
            let (from, to) = (side(k), side(k + 1));
            // The comparison is false for NaN.
            if !matches!(from.perp_dot(to).partial_cmp(&0.0), Some(std::cmp::Ordering::Greater)) {
                return false;
            }
            rounds += usize::from(
                (from.x < 0.0 || (from.x == 0.0 && from.y > 0.0)) && (to.x > 0.0 || to.y < 0.0 && to.x == 0.0),
            );
        }
        rounds == 1
    }

    /// Returns whether the boundary turns by one full turn in all, as that of every simple polygon does.
    fn goes_round_once(&self) -> bool {
        let n = self.plane.len();
        let side = |k: usize| self.plane[(k + 1) % n] - self.plane[k % n];
        let turn: f64 = (0..n).map(|k| side(k).angle_to(side(k + 1))).filter(|angle| !angle.is_nan()).sum();
        (turn / std::f64::consts::TAU).round() == 1.0
    }

    fn next_ear(&mut self, from: usize) -> Option<usize> {
        let n = self.ring.len();
        (0..n).map(|k| (from + k) % n).find(|&ear| self.is_ear(ear))
    }

    fn is_ear(&mut self, ear: usize) -> bool {
        let n = self.ring.len();
        let [a, b, c] = [(ear + n - 1) % n, ear, (ear + 1) % n].map(|k| self.plane[self.ring[k]]);
        if !matches!((b - a).perp_dot(c - b).partial_cmp(&0.0), Some(std::cmp::Ordering::Greater)) {
            return false;
        }
        let Some(left) = self.tests_left.checked_sub(n as u64) else { return false };
        self.tests_left = left;
        let covers = |p: DVec2| {
            (b - a).perp_dot(p - a) >= 0.0 && (c - b).perp_dot(p - b) >= 0.0 && (a - c).perp_dot(p - c) >= 0.0
        };
        // A corner in the place of one of these three (where the boundary touches itself) does not hide the ear.
        !self.ring.iter().any(|&k| {
            let p = self.plane[k];
            p != a && p != b && p != c && covers(p)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(points: &[[f64; 3]]) -> (Vec<[u32; 3]>, Vec<ReadNote>) {
        let positions: Vec<DVec3> = points.iter().copied().map(DVec3::from).collect();
        let mut polygons = Polygons::default();
        (0..points.len() as u32).for_each(|k| polygons.push_corner(k));
        polygons.end_face();
        let mut notes = Vec::new();
        (polygons.triangles(&positions, &mut notes), notes)
    }

    fn area(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
        let p = |k: u32| DVec3::from(points[k as usize]);
        triangles.iter().map(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)).length() / 2.0).sum()
    }

    #[test]
    fn convex_polygons_become_fans() {
        let square = [[0., 0., 5.], [1., 0., 5.], [1., 1., 5.], [0., 1., 5.]];
        let noted = vec![ReadNote::PolygonsTriangulated { count: 1 }];
        assert_eq!(cut(&square), (vec![[0, 1, 2], [0, 2, 3]], noted));
    }

    #[test]
    fn convex_polygons_become_fans_in_each_plane_and_direction() {
        for turn in 0..3 {
            for mirrored in [false, true] {
                let mut points =
                    vec![[0., 0., 0.], [2., 0., 0.], [3., 1., 0.], [2., 2., 0.], [0., 2., 0.], [-1., 1., 0.]];
                points.iter_mut().for_each(|p: &mut [f64; 3]| p.rotate_right(turn));
                if mirrored {
                    points.reverse();
                }
                assert_eq!(cut(&points).0, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], "{turn} {mirrored}");
            }
        }
    }

    #[test]
    fn a_dart_is_cut_along_its_inner_diagonal() {
        // Corner 2 is reflex, so the diagonal must start there.
        for turn in 0..3 {
            for start in 0..4 {
                let mut dart = vec![[0., 0., 0.], [4., 1., 0.], [1., 1., 0.], [1., 4., 0.]];
                dart.iter_mut().for_each(|p: &mut [f64; 3]| p.rotate_right(turn));
                dart.rotate_left(start);
                let (triangles, notes) = cut(&dart);
                assert_eq!(triangles.len(), 2);
                assert!((area(&dart, &triangles) - 3.0).abs() < 1e-12, "{turn} {start} {triangles:?}");
                assert_eq!(notes, [ReadNote::PolygonsTriangulated { count: 1 }]);
            }
        }
    }

    #[test]
    fn a_comb_is_cut_without_overlap() {
        let mut comb = vec![[0., -1., 0.]];
        comb.push([8., -1., 0.]);
        for tooth in (0..4).rev() {
            let x = 2.0 * f64::from(tooth);
            comb.extend([[x + 2., 0., 0.], [x + 1.5, 3., 0.], [x + 1., 3., 0.], [x + 0.5, 0., 0.]]);
        }
        comb.push([0., 0., 0.]);
        let (triangles, notes) = cut(&comb);
        assert_eq!(triangles.len(), comb.len() - 2);
        let exact = 8.0 + 4.0 * 3.0 * (1.5 + 0.5) / 2.0;
        assert!((area(&comb, &triangles) - exact).abs() < 1e-9, "{triangles:?}");
        assert_eq!(notes, [ReadNote::PolygonsTriangulated { count: 1 }]);
    }

    #[test]
    fn corners_in_a_line_keep_every_side() {
        let square = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [2., 2., 0.], [0., 2., 0.]];
        let (triangles, _) = cut(&square);
        assert!((area(&square, &triangles) - 4.0).abs() < 1e-12);
        for k in 0..5 {
            let side = [k, (k + 1) % 5];
            let uses = triangles.iter().filter(|t| (0..3).any(|i| [t[i], t[(i + 1) % 3]] == side)).count();
            assert_eq!(uses, 1, "side {side:?} of {triangles:?}");
        }
    }

    #[test]
    fn a_pentagram_and_nonsense_become_fans() {
        let star: Vec<[f64; 3]> = (0..5)
            .map(|k| {
                let angle = f64::from(k) * 2.0 * std::f64::consts::TAU / 5.0;
                [angle.cos(), angle.sin(), 0.0]
            })
            .collect();
        for points in [star, vec![[f64::NAN; 3]; 5], vec![[1.0; 3]; 5]] {
            let (triangles, notes) = cut(&points);
            assert_eq!(triangles.len(), 3);
            assert!(notes.contains(&ReadNote::PolygonsNotSimple { count: 1 }), "{notes:?}");
        }
    }

    #[test]
    fn a_spiral_of_200_000_corners_is_cut() {
        let spiral: Vec<[f64; 3]> = (0..200_000)
            .map(|k| {
                let (angle, radius) = (f64::from(k) * 0.1, 1.0 + f64::from(k));
                [angle.cos() * radius, angle.sin() * radius, 0.0]
            })
            .collect();
        assert_eq!(cut(&spiral).0.len(), spiral.len() - 2);
    }
}
