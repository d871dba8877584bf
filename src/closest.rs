//! The triangle of a set that is closest to a point, exactly, by a tree of boxes.
//!
//! Of the crates for trees of boxes in use here none asks for the closest, and their boxes are in `f32`, so the tree is
//! our own: triangles are split at the median along the longest side of the box of their centroids, down to a few.

use glam::DVec3;

/// Triangles in a leaf, at most.
const LEAF: usize = 4;

/// A set of triangles, by boxes.
pub struct ClosestTriangle {
    /// Depth first: the left child of a node comes right after it.
    nodes: Vec<Node>,
    /// Corners in the order of leaves.
    corners: Vec<[DVec3; 3]>,
    /// For each of these its index in the set as it was given.
    indices: Vec<u32>,
}

struct Node {
    min: DVec3,
    max: DVec3,
    /// Of a leaf, the first triangle; of another node, its right child.
    at: u32,
    /// Triangles of a leaf; 0 for another node.
    count: u32,
}

/// What is closest to a point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// The triangle, as an index into the set.
    pub triangle: u32,
    /// The square of its distance.
    pub squared: f64,
    /// Where the triangle is in the tree: a start for a search from a point nearby.
    pub hint: u32,
}

impl ClosestTriangle {
    /// The tree of a set that is not empty.
    pub fn new(set: &[[DVec3; 3]]) -> ClosestTriangle {
        let mut order: Vec<(DVec3, u32)> =
            set.iter().zip(0..).map(|([a, b, c], index)| ((*a + *b + *c) / 3.0, index)).collect();
        let mut nodes = Vec::with_capacity(2 * set.len() / LEAF + 1);
        grow(&mut nodes, set, &mut order, 0);
        let indices: Vec<u32> = order.into_iter().map(|(_, index)| index).collect();
        let corners = indices.iter().map(|&index| set[index as usize]).collect();
        ClosestTriangle { nodes, corners, indices }
    }

    /// The triangle closest to a point. A good hint (0 will do) makes it faster; among triangles at the same distance it
    /// may decide which.
    pub fn of(&self, point: DVec3, hint: u32) -> Closest {
        let (mut best, mut squared) = (hint, squared_distance(point, self.corners[hint as usize]));
        let mut stack = [(0u32, 0f64); 64];
        let mut depth = 1;
        while depth > 0 && squared > 0.0 {
            depth -= 1;
            let (index, bound) = stack[depth];
            if bound >= squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for at in node.at..node.at + node.count {
                    let other = squared_distance(point, self.corners[at as usize]);
                    if other < squared {
                        (best, squared) = (at, other);
                    }
                }
                continue;
            }
            let bound = |child: u32| (child, self.nodes[child as usize].squared_distance(point));
            let (left, right) = (bound(index + 1), bound(node.at));
            let (near, far) = if left.1 <= right.1 { (left, right) } else { (right, left) };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
        Closest { triangle: self.indices[best as usize], squared, hint: best }
    }

    /// Whether any triangle is no farther from a point than this.
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
            let (left, right) = (bound(index + 1), bound(node.at));
            let (near, far) = if left.1 <= right.1 { (left, right) } else { (right, left) };
            // The nearer one is looked at first.
            for (child, bound) in [far, near] {
                if bound <= limit {
                    stack[depth] = child;
                    depth += 1;
                }
            }
        }
        false
    }

    /// All triangles no farther from a point than this, in no order.
    pub fn within(&self, point: DVec3, distance: f64) -> Vec<u32> {
        let (mut found, mut open) = (Vec::new(), vec![0]);
        while let Some(index) = open.pop() {
            let node = &self.nodes[index as usize];
            if node.squared_distance(point) > distance * distance {
                continue;
            }
            if node.count == 0 {
                open.extend([index + 1, node.at]);
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
    fn squared_distance(&self, point: DVec3) -> f64 {
        (point.clamp(self.min, self.max) - point).length_squared()
    }
}

/// Adds the node of some triangles, the first of which is number `first` in the order, and all below it.
fn grow(nodes: &mut Vec<Node>, set: &[[DVec3; 3]], order: &mut [(DVec3, u32)], first: u32) {
    let box_of = |points: &mut dyn Iterator<Item = DVec3>| {
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), point| (min.min(point), max.max(point)))
    };
    let (min, max) = box_of(&mut order.iter().flat_map(|(_, index)| set[*index as usize]));
    let node = nodes.len();
    if order.len() <= LEAF {
        nodes.push(Node { min, max, at: first, count: order.len() as u32 });
        return;
    }
    nodes.push(Node { min, max, at: 0, count: 0 });
    let (least, most) = box_of(&mut order.iter().map(|(centroid, _)| *centroid));
    let (axis, half) = (longest(most - least), order.len() / 2);
    order.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (low, high) = order.split_at_mut(half);
    grow(nodes, set, low, first);
    nodes[node].at = nodes.len() as u32;
    grow(nodes, set, high, first + half as u32);
}

/// The axis along which a box is longest.
pub fn longest(extent: DVec3) -> usize {
    if extent.x >= extent.y && extent.x >= extent.z { 0 } else { usize::from(extent.y < extent.z) + 1 }
}

/// The square of the distance of a point from a triangle, which may be degenerate.
///
/// After Ericson, "Real-Time Collision Detection" (2005), 5.1.5; where the triangle is too thin for it, the closest of its
/// sides.
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
    let side = |from: DVec3, along: DVec3| {
        let length = along.length_squared();
        let at = if length > 0.0 { ((point - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        (from + along * at - point).length_squared()
    };
    side(a, ab).min(side(a, ac)).min(side(b, c - b))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The least over a fine raster of points of the triangle: never less than the truth, and not much more.
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

    proptest! {
        #[test]
        fn distance_from_a_triangle(places in places(4)) {
            let triangle = [places[0], places[1], places[2]];
            let exact = squared_distance(places[3], triangle).sqrt();
            let near = by_raster(places[3], triangle);
            prop_assert!(exact <= near + 1e-12 && near <= exact + 0.1, "{exact} {near}");
        }

        #[test]
        fn the_closest_of_many(places in places(96), hint in 0..31u32) {
            let set: Vec<[DVec3; 3]> = places.as_chunks().0.to_vec();
            let tree = ClosestTriangle::new(&set);
            for point in &places {
                let point = *point * 1.2 + DVec3::splat(0.3);
                let brute = set.iter().map(|triangle| squared_distance(point, *triangle)).fold(f64::INFINITY, f64::min);
                let found = tree.of(point, hint);
                // Two triangles may be equally far but for the last bit.
                const ROUNDED: f64 = 1e-12;
                let same = |squared: f64| (squared - brute).abs() <= ROUNDED * brute.max(1.0);
                prop_assert!(same(found.squared), "{} {brute}", found.squared);
                prop_assert!(same(squared_distance(point, set[found.triangle as usize])));
                let within = tree.within(point, 2.0);
                prop_assert_eq!(tree.any_within(point, 2.0), !within.is_empty());
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
    fn degenerate_triangles_have_distances() {
        let (o, x) = (DVec3::ZERO, DVec3::X);
        assert_eq!(squared_distance(DVec3::Y * 2.0, [o, o, o]), 4.0);
        assert_eq!(squared_distance(DVec3::new(0.5, 1.0, 0.0), [o, x, x * 0.5]), 1.0);
        assert_eq!(squared_distance(DVec3::new(3.0, 0.0, 0.0), [o, x, x]), 4.0);
    }
}
