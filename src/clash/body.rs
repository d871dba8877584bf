//! A solid with the hierarchy of its triangles, and questions about one point.

use std::sync::OnceLock;

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

use super::triangles::Corners;
use crate::box_tree::BoxTree;
use crate::closest;
use crate::mesh::TriangleMesh;
use crate::sampler::FillRule;
use crate::union_find::UnionFind;

/// A closed mesh with the hierarchy of its triangles.
pub struct Body<'m> {
    mesh: &'m TriangleMesh,
    fill: FillRule,
    pub(super) tree: BoxTree,
    /// A point of each connected part of the surface, found when it is first asked for.
    shells: OnceLock<Vec<DVec3>>,
}

impl<'m> Body<'m> {
    /// Builds the hierarchy of a closed mesh.
    pub fn new(mesh: &'m TriangleMesh, fill: FillRule) -> Body<'m> {
        Body { mesh, fill, tree: BoxTree::of_mesh(mesh), shells: OnceLock::new() }
    }

    pub(super) fn mesh(&self) -> &'m TriangleMesh {
        self.mesh
    }

    /// Returns the corners of a triangle.
    #[inline]
    pub(super) fn corners(&self, triangle: u32) -> Corners {
        self.mesh.triangles[triangle as usize].map(|index| self.mesh.positions[index as usize])
    }

    /// Returns whether a point that does not lie on the surface lies inside.
    ///
    /// Counts the triangles that the ray from the point along +x meets, by exact signs. The ray is moved by an
    /// infinitesimal amount along y and a smaller one along z, so that it meets no side and no corner.
    pub fn contains(&self, point: DVec3) -> bool {
        let (mut count, mut winding) = (0u32, 0i64);
        self.tree.visit(
            |bounds| bounds.is_ahead_of(point),
            |triangles| {
                for &triangle in triangles {
                    let side = crossing(&self.corners(triangle), point);
                    count += side.unsigned_abs();
                    winding += i64::from(side);
                }
            },
        );
        match self.fill {
            FillRule::EvenOdd => count % 2 == 1,
            FillRule::NonZero => winding != 0,
        }
    }

    /// Returns the distance of the surface from a point, if it is below a limit.
    pub(super) fn nearest_to(&self, point: DVec3, limit: f64) -> Option<f64> {
        let mut best = limit * limit;
        let mut is_found = false;
        let mut stack = vec![(self.tree.bounds(self.tree.root()).squared_distance_to(point), self.tree.root())];
        while let Some((squared, node)) = stack.pop() {
            if squared >= best {
                continue;
            }
            if let Some(triangles) = self.tree.items(node) {
                for &triangle in triangles {
                    let squared = closest::squared_distance(point, self.corners(triangle));
                    if squared < best {
                        (best, is_found) = (squared, true);
                    }
                }
                continue;
            }
            let first = stack.len();
            stack.extend(
                self.tree.children(node).map(|child| (self.tree.bounds(child).squared_distance_to(point), child)),
            );
            stack[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
        }
        is_found.then(|| best.sqrt())
    }

    /// Returns a point of each part of the surface that is connected by the numbers of corners.
    pub fn points_of_shells(&self) -> &[DVec3] {
        self.shells.get_or_init(|| self.find_shells())
    }

    fn find_shells(&self) -> Vec<DVec3> {
        let sets = UnionFind::new(self.mesh.positions.len() as u32);
        for [a, b, c] in &self.mesh.triangles {
            sets.join(*a, *b);
            sets.join(*b, *c);
        }
        let mut is_seen = vec![false; self.mesh.positions.len()];
        let mut points = Vec::new();
        for [a, ..] in &self.mesh.triangles {
            let set = sets.find(*a) as usize;
            if !std::mem::replace(&mut is_seen[set], true) {
                points.push(self.mesh.positions[*a as usize]);
            }
        }
        points
    }
}

/// Returns the side from which the ray from a point along +x meets a triangle: 1 from inside, −1 from outside, 0 where
/// it does not meet it.
fn crossing(&[a, b, c]: &Corners, point: DVec3) -> i32 {
    let turns = [turn(a, b, point), turn(b, c, point), turn(c, a, point)];
    if turns[0] == 0 || turns[0] != turns[1] || turns[1] != turns[2] {
        return 0;
    }
    let [a, b, c, d] = [a, b, c, point].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
    let below = orient3d(a, b, c, d);
    // The plane is ahead of the point where the point lies on the side that the normal's sign along x leaves.
    if below * f64::from(turns[0]) > 0.0 { turns[0] } else { 0 }
}

/// Returns the side of the line through two points, seen along x, on which a third lies once it has been moved.
fn turn(a: DVec3, b: DVec3, point: DVec3) -> i32 {
    let [u, v, p] = [a, b, point].map(|p| Coord { x: p.y, y: p.z });
    let exact = orient2d(u, v, p);
    let moved = [exact, u.y - v.y, v.x - u.x].into_iter().find(|&value| value != 0.0);
    moved.map_or(0, |value| if value > 0.0 { 1 } else { -1 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids;
    use crate::testing::meshes::{cube, hollowed, together};
    use crate::testing::random::Random;

    #[test]
    fn points_inside_a_ball_are_found_with_rays_through_corners_too() {
        let mesh = solids::geodesic(1.0, 8).unwrap();
        let body = Body::new(&mesh, FillRule::EvenOdd);
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let point = 1.2 * DVec3::new(random.unit(), random.unit(), random.unit());
            if (point.length() - 0.99).abs() > 0.02 {
                assert_eq!(body.contains(point), point.length() < 0.99, "{point}");
            }
        }
        for &corner in &mesh.positions {
            assert!(body.contains(DVec3::new(-0.5 * corner.x, corner.y, corner.z) * 0.9));
            assert!(!body.contains(DVec3::new(-2.0, corner.y, corner.z)));
        }
    }

    #[test]
    fn lattice_points_of_a_cube_are_classified_along_its_sides() {
        let mesh = cube(DVec3::ZERO, 2.0);
        let body = Body::new(&mesh, FillRule::EvenOdd);
        for y in 0..3 {
            for z in 0..3 {
                let point = |x: f64| DVec3::new(x, y.into(), z.into());
                assert!(!body.contains(point(-1.0)) && !body.contains(point(3.0)));
                // Moved along +y and +z, a ray at the lower sides is inside.
                assert_eq!(body.contains(point(1.0)), y < 2 && z < 2);
            }
        }
    }

    #[test]
    fn fill_rules_differ_where_shells_overlap() {
        let mesh = together(&[cube(DVec3::ZERO, 2.0), cube(DVec3::ONE, 2.0)]);
        let both = DVec3::splat(1.5);
        assert!(!Body::new(&mesh, FillRule::EvenOdd).contains(both));
        assert!(Body::new(&mesh, FillRule::NonZero).contains(both));
        assert_eq!(Body::new(&mesh, FillRule::NonZero).points_of_shells().len(), 2);
    }

    #[test]
    fn cavities_are_outside_and_distances_are_to_the_nearest_shell() {
        let mesh = hollowed(cube(DVec3::ZERO, 3.0), &cube(DVec3::ONE, 1.0));
        let body = Body::new(&mesh, FillRule::EvenOdd);
        assert!(!body.contains(DVec3::splat(1.5)) && body.contains(DVec3::splat(0.5)));
        assert_eq!(body.nearest_to(DVec3::splat(1.5), f64::INFINITY), Some(0.5));
        assert_eq!(body.nearest_to(DVec3::new(5.0, 1.0, 1.0), f64::INFINITY), Some(2.0));
        assert_eq!(body.nearest_to(DVec3::new(5.0, 1.0, 1.0), 2.0), None);
    }
}
