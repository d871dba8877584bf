//! Exact search for the triangle of a set that is closest to a point, by a tree of boxes.
//!
//! The tree is our own because none of the box-tree crates in use here has a closest query, and their boxes are in
//! `f32`. It splits triangles at the median along the longest side of the box of their centroids, or in the middle of a given
//! order, down to a few.

use glam::DVec3;

use crate::cancel::checkpoint;
use crate::parallel::join;

/// Largest number of triangles in a leaf.
const LEAF: usize = 4;

/// Halves of more triangles than this are split on two threads.
const APART: usize = 1 << 12;

/// A set of triangles in a tree of boxes.
pub struct ClosestTriangle {
    /// Nodes in depth-first order: the left child of a node comes directly after it.
    nodes: Vec<Node>,
    /// Corners in the order of leaves.
    corners: Vec<[DVec3; 3]>,
    /// The index of each of these in the original set.
    indices: Vec<u32>,
}

/// A triangle's centroid, and its index in the set.
type Place = (DVec3, u32);

struct Node {
    min: DVec3,
    max: DVec3,
    /// In a leaf, the first triangle; in another node, the offset of its right child.
    at: u32,
    /// Number of triangles of a leaf; 0 for another node.
    count: u32,
}

/// The triangle closest to a point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// The square of its distance.
    pub squared: f64,
    /// The index of the triangle in the tree: a start for a search from a point nearby.
    pub hint: u32,
}

impl ClosestTriangle {
    /// Builds the tree of a set that is not empty.
    pub fn new(set: &[[DVec3; 3]]) -> ClosestTriangle {
        let mut order: Vec<Place> =
            set.iter().zip(0..).map(|([a, b, c], index)| ((*a + *b + *c) / 3.0, index)).collect();
        sort(&mut order);
        let corners: Vec<[DVec3; 3]> = order.iter().map(|&(_, index)| set[index as usize]).collect();
        let indices = order.into_iter().map(|(_, index)| index).collect();
        ClosestTriangle { nodes: grow_apart(&corners, 0), corners, indices }
    }

    /// Builds the tree of a set that is not empty, in which triangles that follow one another are near one another.
    pub fn of_neighbours(set: Vec<[DVec3; 3]>) -> ClosestTriangle {
        ClosestTriangle { nodes: grow_apart(&set, 0), indices: (0..set.len() as u32).collect(), corners: set }
    }

    /// Returns the triangle closest to a point. A good hint (0 is always valid) makes it faster; it may select among
    /// triangles at the same distance.
    pub fn of(&self, point: DVec3, hint: u32) -> Closest {
        self.closer(point, Closest { squared: self.squared_from(point, hint), hint }, |_| true)
    }

    /// Returns the closest triangle to a point of those with a property, if the square of its distance is less than a limit.
    pub fn below(&self, point: DVec3, limit: f64, has: impl Fn([DVec3; 3]) -> bool) -> Option<Closest> {
        let closest = self.closer(point, Closest { squared: limit, hint: 0 }, has);
        Some(closest).filter(|closest| closest.squared < limit)
    }

    /// Returns the triangle with a property that is closest to a point, or another one if none is closer than that.
    fn closer(&self, point: DVec3, other: Closest, has: impl Fn([DVec3; 3]) -> bool) -> Closest {
        let Closest { mut squared, hint: mut best } = other;
        let mut stack = [(0u32, 0f64); 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (index, bound) = stack[depth];
            if bound >= squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for at in node.at..node.at + node.count {
                    let other = squared_distance(point, self.corners[at as usize]);
                    if other < squared && has(self.corners[at as usize]) {
                        (best, squared) = (at, other);
                    }
                }
                continue;
            }
            let bound = |child: u32| (child, self.nodes[child as usize].squared_distance(point));
            let (left, right) = (bound(index + 1), bound(index + node.at));
            let (near, far) = if left.1 <= right.1 { (left, right) } else { (right, left) };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
        Closest { squared, hint: best }
    }

    /// Returns the corners of the triangle with a [`hint`](Closest::hint).
    pub fn corners(&self, hint: u32) -> [DVec3; 3] {
        self.corners[hint as usize]
    }

    /// Returns the square of the distance of a point from the triangle with a [`hint`](Closest::hint).
    pub fn squared_from(&self, point: DVec3, hint: u32) -> f64 {
        squared_distance(point, self.corners[hint as usize])
    }

    /// Returns whether any triangle is within this distance of a point.
    pub fn any_within(&self, point: DVec3, distance: f64) -> bool {
        let limit = distance * distance;
        let mut stack = [0u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                let corners = &self.corners[node.at as usize..(node.at + node.count) as usize];
                if corners.iter().any(|triangle| squared_distance(point, *triangle) <= limit) {
                    return true;
                }
                continue;
            }
            let bound = |child: u32| (child, self.nodes[child as usize].squared_distance(point));
            let (left, right) = (bound(index + 1), bound(index + node.at));
            let (near, far) = if left.1 <= right.1 { (left, right) } else { (right, left) };
            // The nearer one is visited first.
            for (child, bound) in [far, near] {
                if bound <= limit {
                    stack[depth] = child;
                    depth += 1;
                }
            }
        }
        false
    }

    /// Returns all triangles within this distance of a point, in no particular order.
    pub fn within(&self, point: DVec3, distance: f64) -> Vec<u32> {
        let (mut found, mut open) = (Vec::new(), vec![0]);
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            if node.squared_distance(point) > distance * distance {
                continue;
            }
            if node.count == 0 {
                open.extend([index + 1, index + node.at]);
                continue;
            }
            let leaf = (node.at..node.at + node.count).filter(|&at| {
                let squared = squared_distance(point, self.corners[at as usize]);
                squared <= distance * distance
            });
            found.extend(leaf.map(|at| self.indices[at as usize]));
        }
        found
    }
}

impl Node {
    /// Returns the parent of a left child, which comes directly after it, and a right one.
    fn above(left: &Node, right: &Node, at: usize) -> Node {
        Node { min: left.min.min(right.min), max: left.max.max(right.max), at: at as u32, count: 0 }
    }

    fn squared_distance(&self, point: DVec3) -> f64 {
        (point.clamp(self.min, self.max) - point).length_squared()
    }
}

/// Builds the nodes of some triangles in order, the first of which is number `first`: large halves on two threads.
fn grow_apart(set: &[[DVec3; 3]], first: u32) -> Vec<Node> {
    checkpoint();
    let mut nodes = Vec::new();
    if set.len() <= APART {
        grow(&mut nodes, set, first);
        return nodes;
    }
    let (low, high) = set.split_at(set.len() / 2);
    let right = first + low.len() as u32;
    let (low, high) = join(|| grow_apart(low, first), || grow_apart(high, right));
    nodes.reserve(1 + low.len() + high.len());
    nodes.push(Node::above(&low[0], &high[0], 1 + low.len()));
    nodes.extend(low);
    nodes.extend(high);
    nodes
}

/// Adds the node of some triangles in order, the first of which is number `first`, and all below it.
fn grow(nodes: &mut Vec<Node>, set: &[[DVec3; 3]], first: u32) {
    if set.len() <= LEAF {
        let (min, max) = box_of(set.as_flattened().iter().copied());
        return nodes.push(Node { min, max, at: first, count: set.len() as u32 });
    }
    let node = nodes.len();
    nodes.push(Node { min: DVec3::ZERO, max: DVec3::ZERO, at: 0, count: 0 });
    let (low, high) = set.split_at(set.len() / 2);
    grow(nodes, low, first);
    let right = nodes.len();
    grow(nodes, high, first + low.len() as u32);
    nodes[node] = Node::above(&nodes[node + 1], &nodes[right], right - node);
}

/// Sorts triangles so that their halves, and the halves of these, are apart: large halves on two threads.
fn sort(order: &mut [Place]) {
    if order.len() <= LEAF {
        return;
    }
    let is_large = order.len() > APART;
    let (low, high) = halves(order);
    if is_large {
        checkpoint();
        join(|| sort(low), || sort(high));
    } else {
        sort(low);
        sort(high);
    }
}

/// Splits triangles into halves by their centroids, along the longest side of the box of these.
fn halves(order: &mut [Place]) -> (&mut [Place], &mut [Place]) {
    let (least, most) = box_of(order.iter().map(|(centroid, _)| *centroid));
    let (axis, half) = (longest(most - least), order.len() / 2);
    order.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    order.split_at_mut(half)
}

fn box_of(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), point| (min.min(point), max.max(point)))
}

/// Returns the axis along which a box is longest.
pub fn longest(extent: DVec3) -> usize {
    if extent.x >= extent.y && extent.x >= extent.z { 0 } else { usize::from(extent.y < extent.z) + 1 }
}

/// Returns the square of the distance of a point from a triangle, which may be degenerate.
///
/// After Ericson, "Real-Time Collision Detection" (2005), 5.1.5; where the triangle is too thin for it, the distance
/// from the closest of its sides.
pub fn squared_distance(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length_squared();
    }
    let bp = point - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length_squared();
    }
    let cp = point - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length_squared();
    }
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    if va > 0.0 && vb > 0.0 && vc > 0.0 {
        // Inside all three sides: the distance from the plane.
        let normal = ab.cross(ac);
        let height = normal.dot(ap);
        let squared = height * height / normal.length_squared();
        if squared.is_finite() {
            return squared;
        }
    }
    let sides = [[a, b], [a, c], [b, c]].map(|side| squared_distance_from_segment(point, side));
    sides[0].min(sides[1]).min(sides[2])
}

/// Returns the square of the distance of a point from a segment, which may have no length.
pub fn squared_distance_from_segment(point: DVec3, [from, to]: [DVec3; 2]) -> f64 {
    let along = to - from;
    let length = along.length_squared();
    let at = if length > 0.0 { ((point - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
    (from + along * at - point).length_squared()
}

/// Returns the point of a triangle closest to the origin, or nearly so: a combination of the corners with weights from 0 to 1
/// (Ericson, "Real-Time Collision Detection", 2005, 5.1.5). Its distance has an error of the size of the rounding of corners;
/// [`squared_distance`] keeps the digits of a small height above a large triangle.
pub fn closest_to_origin([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let on_side = |from: DVec3, along: DVec3| {
        let square = along.length_squared();
        let share = if square > 0.0 { (-from.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
        from + along * share
    };
    let normal = ab.cross(ac);
    let square = normal.length_squared();
    // Weights of the foot of the perpendicular.
    let (v, w) = (-a.cross(ac).dot(normal) / square, -ab.cross(a).dot(normal) / square);
    // Of a needle the weights have no digits, and a side may be nearer.
    let foot = (v >= 0.0 && w >= 0.0 && v + w <= 1.0).then_some(a + ab * v + ac * w);
    let candidates = [on_side(a, ab), on_side(b, c - b), on_side(a, ac)].into_iter().chain(foot);
    candidates.min_by(|p, q| p.length_squared().total_cmp(&q.length_squared())).unwrap_or(a)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns the least distance over a fine raster of points of the triangle: never less than the true one, and not
    /// much more.
    fn by_raster(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        const N: u32 = 200;
        let steps = (0..=N).flat_map(|i| (0..=N - i).map(move |j| (f64::from(i), f64::from(j))));
        steps
            .map(|(i, j)| (a + ((b - a) * i + (c - a) * j) / f64::from(N)).distance(point))
            .fold(f64::INFINITY, f64::min)
    }

    fn places(count: usize) -> impl Strategy<Value = Vec<DVec3>> {
        prop::collection::vec((0..9u8, 0..9u8, 0..9u8), count)
            .prop_map(|all| all.into_iter().map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into())).collect())
    }

    #[test]
    fn the_point_of_a_needle_next_to_the_origin_is_no_farther_than_its_sides() {
        // The weights of the foot of the perpendicular are rounding.
        for lift in [0.0, 1e-9, 1e-3] {
            let needle = [DVec3::new(-1e9, 1.0, 0.0), DVec3::new(1e9, 1.0, 0.0), DVec3::new(1.0, 1.0 + lift, lift)];
            assert!(closest_to_origin(needle).length() <= 1.0 + 1e-6, "{lift}");
        }
    }

    proptest! {
        #[test]
        fn distance_to_a_triangle_agrees_with_a_raster_of_points(places in places(4)) {
            let triangle = [places[0], places[1], places[2]];
            let exact = squared_distance(places[3], triangle).sqrt();
            let near = by_raster(places[3], triangle);
            prop_assert!(exact <= near + 1e-12 && near <= exact + 0.1, "{exact} {near}");
            let closest = closest_to_origin(triangle.map(|corner| corner - places[3])).length();
            prop_assert!((closest - exact).abs() <= 1e-12, "{exact} {closest}");
        }

        #[test]
        fn the_closest_triangle_agrees_with_brute_force(places in places(96), hint in 0..31u32, in_order: bool) {
            let set: Vec<[DVec3; 3]> = places.as_chunks().0.to_vec();
            let tree = if in_order { ClosestTriangle::of_neighbours(set.clone()) } else { ClosestTriangle::new(&set) };
            for point in &places {
                let point = *point * 1.2 + DVec3::splat(0.3);
                let brute = set.iter().map(|triangle| squared_distance(point, *triangle)).fold(f64::INFINITY, f64::min);
                let found = tree.of(point, hint);
                // Two triangles may be equally far to within the last bit.
                const ROUNDED: f64 = 1e-12;
                let same = |squared: f64| (squared - brute).abs() <= ROUNDED * brute.max(1.0);
                prop_assert!(same(found.squared), "{} {brute}", found.squared);
                prop_assert!(same(tree.squared_from(point, found.hint)));
                let within = tree.within(point, 2.0);
                prop_assert_eq!(tree.any_within(point, 2.0), !within.is_empty());
                let has = |[a, b, _]: [DVec3; 3]| a.x < b.x;
                let some = set.iter().filter(|triangle| has(**triangle));
                let least = some.map(|triangle| squared_distance(point, *triangle)).fold(f64::INFINITY, f64::min);
                for limit in [0.5 * least, 2.0 * least + 1e-9, f64::INFINITY] {
                    let below = tree.below(point, limit, has).map(|closest| closest.squared);
                    prop_assert_eq!(below, Some(least).filter(|least| *least < limit));
                }
                for (i, triangle) in set.iter().enumerate() {
                    let beyond = squared_distance(point, *triangle) - 4.0;
                    if beyond.abs() > ROUNDED * 4.0 {
                        prop_assert_eq!(within.contains(&(i as u32)), beyond < 0.0, "{}", beyond);
                    }
                }
            }
        }
    }

    #[test]
    fn trees_built_in_parallel_equal_trees_built_serially() {
        let place = |i: usize| DVec3::new((i * 7919 % 1009) as f64, (i * 104_729 % 997) as f64, (i * 31 % 83) as f64);
        let set: Vec<[DVec3; 3]> = (0..3 * APART).map(|i| [place(i), place(i + 1), place(i + 7)]).collect();
        fn sort_serially(order: &mut [Place]) {
            if order.len() > LEAF {
                let (low, high) = halves(order);
                sort_serially(low);
                sort_serially(high);
            }
        }
        let mut order: Vec<Place> = (0..).zip(&set).map(|(index, [a, b, c])| ((*a + *b + *c) / 3.0, index)).collect();
        sort_serially(&mut order);
        let ClosestTriangle { nodes: apart, corners, indices } = ClosestTriangle::new(&set);
        assert!(order.iter().map(|(_, index)| *index).eq(indices));
        let mut together = Vec::new();
        grow(&mut together, &corners, 0);
        assert_eq!(apart.len(), together.len());
        for (a, b) in apart.iter().zip(&together) {
            assert_eq!((a.min, a.max, a.at, a.count), (b.min, b.max, b.at, b.count));
        }
    }

    #[test]
    fn degenerate_triangles_have_distances() {
        let (o, x) = (DVec3::ZERO, DVec3::X);
        assert_eq!(squared_distance(DVec3::Y * 2.0, [o, o, o]), 4.0);
        assert_eq!(squared_distance(DVec3::new(0.5, 1.0, 0.0), [o, x, x * 0.5]), 1.0);
        assert_eq!(squared_distance(DVec3::new(3.0, 0.0, 0.0), [o, x, x]), 4.0);
    }
}
