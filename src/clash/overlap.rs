//! The place of the overlap of two bodies: its box, and the largest ball in it.

use std::collections::BinaryHeap;

use glam::DVec3;

use super::body::Body;
use super::triangles::{crossings, do_meet};
use crate::box_tree::{Node, opened};
use crate::cancel::checkpoint;
use crate::mesh::Aabb;
use crate::mesh::measure::{EMPTY, include};

/// The region that two bodies share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The box around it.
    pub bounds: Aabb,
    /// The centre of the largest ball in it that was found.
    pub deepest: DVec3,
    /// The diameter of this ball: a lower bound of the depth of the overlap.
    pub depth: f64,
    /// An upper bound of the diameter of any ball in it.
    pub depth_bound: f64,
}

/// Largest number of points at which the search for the largest ball computes distances.
const EVALUATIONS: usize = 1500;

/// Number of corners of either body that the search starts from.
const SEEDS: usize = 200;

/// The search ends where the upper bound exceeds the ball found by this share.
const TOLERANCE: f64 = 0.02;

/// Number of pairs of triangles between two checkpoints.
const BETWEEN_CHECKPOINTS: u32 = 1 << 12;

/// Returns the region that two bodies share; `None` where no corner of one lies in the other and no surfaces cross.
pub fn region(a: &Body, b: &Body) -> Option<Region> {
    let bounds = bounds_of_overlap(a, b)?;
    Some(deepest(a, b, bounds, seeds(a, b, bounds)))
}

/// Returns the common part of two boxes.
fn common(a: Aabb, b: Aabb) -> Option<Aabb> {
    let common = Aabb { min: a.min.max(b.min), max: a.max.min(b.max) };
    common.min.cmple(common.max).all().then_some(common)
}

/// Returns whether a point lies in a box.
fn holds(bounds: &Aabb, point: DVec3) -> bool {
    point.cmpge(bounds.min).all() && point.cmple(bounds.max).all()
}

/// Returns the box around the overlap: around the corners of one body in the other, and the crossings of sides and faces.
/// These are the corners of the overlap.
fn bounds_of_overlap(a: &Body, b: &Body) -> Option<Aabb> {
    let around = common(a.mesh().bounds()?, b.mesh().bounds()?)?;
    let mut bounds = EMPTY;
    for (body, other) in [(a, b), (b, a)] {
        for (i, &corner) in body.mesh().positions.iter().enumerate() {
            if i % BETWEEN_CHECKPOINTS as usize == 0 {
                checkpoint();
            }
            if holds(&around, corner) && !holds(&bounds, corner) && other.contains(corner) {
                bounds = include(bounds, corner);
            }
        }
    }
    common(include_crossings(a, b, bounds), around)
}

/// Returns a box with the crossings of sides and faces of two bodies. Triangles cross in what their boxes have in common:
/// where this is in the box already they are not looked at, because coincident surfaces meet in all their triangles.
fn include_crossings(a: &Body, b: &Body, mut bounds: Aabb) -> Aabb {
    let trees = [&a.tree, &b.tree];
    let mut stack: Vec<[Node; 2]> = vec![[a.tree.root(), b.tree.root()]];
    let mut visited = 0u32;
    while let Some(nodes) = stack.pop() {
        visited += 1;
        if visited.is_multiple_of(BETWEEN_CHECKPOINTS) {
            checkpoint();
        }
        let boxes = [a.tree.bounds(nodes[0]), b.tree.bounds(nodes[1])];
        let [around_a, around_b] = boxes.map(|around| around.corners()).map(|[min, max]| Aabb { min, max });
        if !may_add(&bounds, around_a, around_b) {
            continue;
        }
        if let Some((below, count)) = opened(trees, nodes) {
            stack.extend(&below[..count]);
            continue;
        }
        for &i in a.tree.items(nodes[0]).unwrap_or_default() {
            let of_a = a.corners(i);
            for &j in b.tree.items(nodes[1]).unwrap_or_default() {
                let of_b = b.corners(j);
                let [around_a, around_b] = [of_a, of_b].map(|corners| corners.into_iter().fold(EMPTY, include));
                if may_add(&bounds, around_a, around_b) && do_meet(&of_a, &of_b) {
                    crossings(&of_a, &of_b, |point| bounds = include(bounds, point));
                }
            }
        }
    }
    bounds
}

/// Returns whether two boxes have a common point outside of another box.
fn may_add(bounds: &Aabb, a: Aabb, b: Aabb) -> bool {
    common(a, b).is_some_and(|common| !(holds(bounds, common.min) && holds(bounds, common.max)))
}

/// Returns points at which the search for the largest ball starts: corners of either body within the box.
fn seeds(a: &Body, b: &Body, bounds: Aabb) -> Vec<DVec3> {
    let mut seeds = vec![0.5 * (bounds.min + bounds.max)];
    for body in [a, b] {
        let within: Vec<DVec3> =
            body.mesh().positions.iter().filter(|&&corner| holds(&bounds, corner)).copied().collect();
        seeds.extend(within.iter().step_by(within.len().div_ceil(SEEDS).max(1)));
    }
    seeds
}

/// A cube that may hold the centre of a larger ball, ordered by the largest radius that is possible in it.
struct Cell {
    bound: f64,
    centre: DVec3,
    half: DVec3,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Cell) -> bool {
        self.bound.total_cmp(&other.bound).is_eq()
    }
}

impl Eq for Cell {}

impl PartialOrd for Cell {
    fn partial_cmp(&self, other: &Cell) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cell {
    fn cmp(&self, other: &Cell) -> std::cmp::Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

/// Searches the largest ball in the overlap of two bodies, best first over an octree of its box: the radius at a point is
/// the least of its distances to both surfaces, and changes by no more than the distance between points.
fn deepest(a: &Body, b: &Body, bounds: Aabb, seeds: Vec<DVec3>) -> Region {
    let radius = |point: DVec3| radius_at(a, b, point);
    let (mut place, mut best) = (0.5 * (bounds.min + bounds.max), 0.0);
    let mut evaluations = 0;
    for seed in seeds {
        checkpoint();
        let found = radius(seed);
        evaluations += 1;
        if found > best {
            (place, best) = (seed, found);
        }
    }
    let half = 0.5 * (bounds.max - bounds.min);
    let middle = 0.5 * (bounds.min + bounds.max);
    let mut cells = BinaryHeap::from([Cell { bound: half.min_element(), centre: middle, half }]);
    let widest = half.min_element();
    let mut bound = widest;
    while let Some(cell) = cells.pop() {
        checkpoint();
        bound = cell.bound;
        if bound <= best * (1.0 + TOLERANCE) || evaluations >= EVALUATIONS {
            break;
        }
        // Halving the longest sides alone keeps the cells close to cubes.
        let longest = cell.half.max_element();
        let steps = [0, 1, 2].map(|i| if cell.half[i] > 0.6 * longest { &[-0.5, 0.5][..] } else { &[0.0][..] });
        let half = DVec3::from([0, 1, 2].map(|i| cell.half[i] * if steps[i].len() == 2 { 0.5 } else { 1.0 }));
        for &x in steps[0] {
            for &y in steps[1] {
                for &z in steps[2] {
                    let centre = cell.centre + DVec3::new(x, y, z) * cell.half;
                    let found = radius(centre);
                    evaluations += 1;
                    if found > best {
                        (place, best) = (centre, found);
                    }
                    let bound = (found + half.length()).min(cell.bound);
                    if bound > best * (1.0 + TOLERANCE) {
                        cells.push(Cell { bound, centre, half });
                    }
                }
            }
        }
        bound = cells.peek().map_or(best * (1.0 + TOLERANCE), |cell| cell.bound);
    }
    // Cells that could exceed the best ball by no more than the tolerance were dropped.
    let bound = bound.max(best * (1.0 + TOLERANCE)).min(widest).max(best);
    Region { bounds, deepest: place, depth: 2.0 * best, depth_bound: 2.0 * bound }
}

/// Returns the radius of the largest ball about a point that lies in both bodies; below 0, the distance to the farther
/// of the bodies that the point is outside of.
fn radius_at(a: &Body, b: &Body, point: DVec3) -> f64 {
    let mut radius = f64::INFINITY;
    for body in [a, b] {
        let distance = body.nearest_to(point, f64::INFINITY).unwrap_or(f64::INFINITY);
        radius = radius.min(if body.contains(point) { distance } else { -distance });
    }
    radius
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleMesh;
    use crate::sampler::FillRule;
    use crate::solids;
    use crate::testing::meshes::cube;

    fn shared(a: &TriangleMesh, b: &TriangleMesh) -> Option<Region> {
        region(&Body::new(a, FillRule::EvenOdd), &Body::new(b, FillRule::EvenOdd))
    }

    #[test]
    fn cubes_that_overlap_share_a_slab() {
        let found = shared(&cube(DVec3::ZERO, 2.0), &cube(DVec3::new(1.75, 0.25, -0.5), 2.0)).unwrap();
        assert_eq!(found.bounds, Aabb { min: DVec3::new(1.75, 0.25, 0.0), max: DVec3::new(2.0, 2.0, 1.5) });
        assert!(found.depth > 0.24 && found.depth <= 0.25 && found.depth_bound >= 0.25, "{found:?}");
        assert!((found.deepest.x - 1.875).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_body_within_another_is_the_region() {
        let inner = solids::geodesic(0.5, 12).unwrap();
        let found = shared(&cube(DVec3::splat(-2.0), 4.0), &inner).unwrap();
        assert_eq!(Some(found.bounds), inner.bounds());
        assert!(found.deepest.length() < 0.02 && found.depth > 0.95 && found.depth_bound <= 1.05, "{found:?}");
    }

    #[test]
    fn the_lens_of_two_balls_has_its_width() {
        let ball = solids::geodesic(1.0, 32).unwrap();
        let mut other = ball.clone();
        other.positions.iter_mut().for_each(|position| position.x += 1.9);
        let found = shared(&ball, &other).unwrap();
        assert!((found.depth - 0.1).abs() < 0.005, "{found:?}");
        assert!((found.deepest - DVec3::new(0.95, 0.0, 0.0)).length() < 0.02, "{found:?}");
        assert!(
            (found.bounds.extent().x - 0.1).abs() < 0.005 && (found.bounds.max.y - 0.312).abs() < 0.01,
            "{found:?}"
        );
    }

    #[test]
    fn identical_bodies_share_themselves() {
        let body = cube(DVec3::ONE, 3.0);
        let found = shared(&body, &body).unwrap();
        assert_eq!(Some(found.bounds), body.bounds());
        assert!(found.depth > 2.9 && found.depth <= 3.0);
    }

    #[test]
    fn triangles_that_are_left_out_would_not_change_the_box() {
        let ball = solids::geodesic(1.0, 6).unwrap();
        let block = cube(DVec3::ZERO, 2.0);
        // The same ball, one that crosses it, and a box of which four sides are flush.
        for (mesh, shift) in [(&ball, DVec3::ZERO), (&ball, DVec3::new(0.3, 0.2, -0.6)), (&block, DVec3::X)] {
            let mut other = mesh.clone();
            other.positions.iter_mut().for_each(|position| *position += shift);
            let [a, b] = [mesh, &other].map(|mesh| Body::new(mesh, FillRule::EvenOdd));
            let mut all = EMPTY;
            for (body, other) in [(&a, &b), (&b, &a)] {
                let within = body.mesh().positions.iter().filter(|&&corner| other.contains(corner));
                within.for_each(|&corner| all = include(all, corner));
            }
            for i in 0..a.mesh().triangles.len() as u32 {
                for j in 0..b.mesh().triangles.len() as u32 {
                    crossings(&a.corners(i), &b.corners(j), |point| all = include(all, point));
                }
            }
            let found = bounds_of_overlap(&a, &b).unwrap();
            let distance = (found.min - all.min).abs().max((found.max - all.max).abs()).max_element();
            assert!(distance < 1e-15, "{shift}: {found:?} instead of {all:?}");
        }
    }

    #[test]
    fn bodies_apart_share_nothing() {
        assert_eq!(shared(&cube(DVec3::ZERO, 1.0), &cube(DVec3::splat(3.0), 1.0)), None);
    }
}
