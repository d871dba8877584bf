//! The place of the overlap of two bodies: its box, and the largest ball in it.

use std::collections::BinaryHeap;

use glam::DVec3;

use super::body::Body;
use super::triangles::{Corners, crossings, do_meet};
use crate::box_tree::{Node, opened};
use crate::cancel::checkpoint;
use crate::mesh::Aabb;
use crate::mesh::measure::{EMPTY, include};
use crate::polygon::Polygon;

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

/// Largest number of points of the octree at which the search for the largest ball computes distances.
const EVALUATIONS: usize = 1000;

/// Most steps from the best of these points uphill.
const CLIMB: usize = 64;

/// Number of corners, and of triangles, of either body that the search starts from.
const SEEDS: usize = 150;

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

/// Returns points at which the search for the largest ball starts: corners of either body within the box, and points in the middle
/// between the two surfaces, where a thin layer of the overlap, as of a press fit, is as thick as it is anywhere near.
fn seeds(a: &Body, b: &Body, bounds: Aabb) -> Vec<DVec3> {
    let mut seeds = vec![0.5 * (bounds.min + bounds.max)];
    for (body, other) in [(a, b), (b, a)] {
        let within: Vec<DVec3> =
            body.mesh().positions.iter().filter(|&&corner| holds(&bounds, corner)).copied().collect();
        seeds.extend(within.iter().step_by(within.len().div_ceil(SEEDS).max(1)));
        let meets = |&triangle: &u32| {
            let Aabb { min, max } = body.corners(triangle).into_iter().fold(EMPTY, include);
            common(Aabb { min, max }, bounds).is_some()
        };
        let triangles: Vec<u32> = (0..body.mesh().triangles.len() as u32).filter(meets).collect();
        // Of few triangles several points each.
        let points = if triangles.len() <= SEEDS / 8 { usize::MAX } else { 1 };
        for &triangle in triangles.iter().step_by(triangles.len().div_ceil(SEEDS).max(1)) {
            checkpoint();
            let [p, q, r] = body.corners(triangle);
            let normal = (q - p).cross(r - p).normalize_or_zero();
            let all = points_within([p, q, r], &bounds);
            for point in all.into_iter().take(points).filter(|&point| other.contains(point)) {
                let Some(distance) = other.nearest_to(point, f64::INFINITY) else { continue };
                let across = 0.5 * distance * normal;
                // Outwards, or inwards, as the body may face either way.
                seeds.extend([point - across, point + across]);
            }
        }
    }
    seeds
}

/// Returns points of the part of a triangle within a box: one in the middle, and those half the way from it to the corners.
fn points_within(corners: Corners, bounds: &Aabb) -> Vec<DVec3> {
    // Each of six planes adds half as many corners at most.
    let mut part = Polygon::<40>::of(corners.map(|corner| corner.to_array()));
    for axis in 0..3 {
        part = part.above(axis, bounds.min[axis], 1.0).above(axis, bounds.max[axis], -1.0);
    }
    let corners: Vec<DVec3> = part.corners().iter().copied().map(DVec3::from).collect();
    if corners.is_empty() {
        return corners;
    }
    let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
    std::iter::once(middle).chain(corners.into_iter().map(|corner| middle.midpoint(corner))).collect()
}

/// A cube that may hold the centre of a larger ball, ordered by the largest radius that is possible in it, and by that at its centre.
struct Cell {
    bound: f64,
    radius: f64,
    centre: DVec3,
    half: DVec3,
}

impl PartialEq for Cell {
    fn eq(&self, other: &Cell) -> bool {
        self.cmp(other).is_eq()
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
        self.bound.total_cmp(&other.bound).then(self.radius.total_cmp(&other.radius))
    }
}

/// Searches the largest ball in the overlap of two bodies, best first over an octree of its box: the radius at a point is
/// the least of its distances to both surfaces, and changes by no more than the distance between points.
fn deepest(a: &Body, b: &Body, bounds: Aabb, seeds: Vec<DVec3>) -> Region {
    let radius = |point: DVec3| radius_at(a, b, point);
    let (mut place, mut best) = (0.5 * (bounds.min + bounds.max), 0.0);
    for seed in seeds {
        checkpoint();
        let found = radius(seed);
        if found > best {
            (place, best) = (seed, found);
        }
    }
    let half = 0.5 * (bounds.max - bounds.min);
    let middle = 0.5 * (bounds.min + bounds.max);
    let mut evaluations = 0;
    let mut cells = BinaryHeap::from([Cell { bound: half.min_element(), radius: 0.0, centre: middle, half }]);
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
                        cells.push(Cell { bound, radius: found, centre, half });
                    }
                }
            }
        }
        bound = cells.peek().map_or(best * (1.0 + TOLERANCE), |cell| cell.bound);
    }
    // From the best place that was found, uphill along the axes, in longer steps while they lead there.
    let mut step = best;
    for _ in 0..CLIMB {
        checkpoint();
        let beside = DVec3::AXES.into_iter().flat_map(|axis| [place + step * axis, place - step * axis]);
        let farther = beside.map(|point| (point, radius(point))).max_by(|a, b| a.1.total_cmp(&b.1));
        match farther.filter(|(_, found)| *found > best) {
            Some(found) => (step, (place, best)) = (2.0 * step, found),
            None => step *= 0.5,
        }
        if step <= TOLERANCE * best {
            break;
        }
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
    fn a_press_fit_is_as_deep_as_its_interference() {
        for (count, interference) in [(16, 0.05), (64, 0.005), (128, 0.0005)] {
            let ring = |radius: f64, z: f64| {
                (0..count).map(move |i| {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(count)).sin_cos();
                    DVec3::new(radius * cos, radius * sin, z)
                })
            };
            // A tube of inner radius 4 around a pin of a larger one.
            let tube = [ring(8.0, -1.0), ring(8.0, 1.0), ring(4.0, 1.0), ring(4.0, -1.0)];
            let quad = |a: u32, b: u32, c: u32, d: u32| [[a, b, c], [a, c, d]];
            let around = |from: u32, to: u32| {
                (0..count).flat_map(move |i| {
                    let (n, next) = (count, (i + 1) % count);
                    quad(from * n + i, from * n + next, to * n + next, to * n + i)
                })
            };
            let triangles = (0..4).flat_map(|i| around(i, (i + 1) % 4)).collect();
            let tube = TriangleMesh { positions: tube.into_iter().flatten().collect(), triangles };
            let pin = solids::cylinder(4.0 + interference, 40.0, count).unwrap();
            let found = shared(&tube, &pin).unwrap();
            let flat = (std::f64::consts::PI / f64::from(count)).cos();
            let expected = interference * flat;
            assert!(found.depth > 0.9 * expected && found.depth < 1.02 * interference, "{count}: {found:?}");
            let radius = found.deepest.truncate().length();
            assert!((4.0 * flat..4.0 + interference).contains(&radius), "{count}: {found:?}");
        }
    }

    #[test]
    fn a_long_wedge_is_deepest_at_its_thick_end() {
        // From 0.01 to 0.02 thick over a length of 10^5.
        let mut wedge = solids::cuboid(DVec3::new(0.0, 0.0, -10.0), DVec3::new(1e5, 20.0, 0.0)).unwrap();
        for corner in wedge.positions.iter_mut().filter(|corner| corner.z == 0.0) {
            corner.z = if corner.x == 0.0 { 0.01 } else { 0.02 };
        }
        let block = solids::cuboid(DVec3::new(-5.0, -5.0, 0.0), DVec3::new(1e5 + 5.0, 25.0, 10.0)).unwrap();
        let found = shared(&wedge, &block).unwrap();
        assert!((0.0199..=0.02).contains(&found.depth) && found.deepest.x > 9.9e4, "{found:?}");
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
