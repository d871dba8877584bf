//! The distance of two bodies' surfaces.

use super::body::Body;
use super::triangles::{Corners, Nearest, ROUGH_ERROR, crossings, distance, do_meet, rough_distance};
use crate::box_tree::{Box32, Node, opened};
use crate::cancel::checkpoint;

/// Number of pairs of nodes between two checkpoints.
const BETWEEN_CHECKPOINTS: u32 = 1 << 10;

/// Returns the distance of the surfaces of two bodies; 0 with a common point, in both places, where they meet.
///
/// Visits pairs of nodes, the nearer ones first, and leaves out those that are farther apart than the nearest triangles
/// so far (Larsen, Gottschalk, Lin & Manocha 1999). The result is that of all pairs of triangles.
pub fn nearest(a: &Body, b: &Body) -> Nearest {
    let (start_a, start_b) = (a.corners(0), b.corners(0));
    let mut best =
        Search { bodies: [a, b], nearest: Nearest { distance: f64::INFINITY, points: [start_a[0], start_b[0]] } };
    let trees = [&a.tree, &b.tree];
    let gap = |[of_a, of_b]: [Node; 2]| a.tree.bounds(of_a).squared_distance(b.tree.bounds(of_b));
    let root = [a.tree.root(), b.tree.root()];
    let mut stack = vec![(gap(root), root)];
    let mut visited = 0u32;
    while let Some((squared, nodes)) = stack.pop() {
        visited += 1;
        if visited.is_multiple_of(BETWEEN_CHECKPOINTS) {
            checkpoint();
        }
        if squared >= best.squared() {
            continue;
        }
        let Some((pairs, count)) = opened(trees, nodes) else {
            best.leaves(nodes);
            if best.nearest.distance == 0.0 {
                break;
            }
            continue;
        };
        let first = stack.len();
        stack.extend(pairs[..count].iter().map(|&pair| (gap(pair), pair)));
        stack[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
    }
    best.nearest
}

/// The nearest points so far.
struct Search<'a, 'm> {
    bodies: [&'a Body<'m>; 2],
    nearest: Nearest,
}

impl Search<'_, '_> {
    fn squared(&self) -> f64 {
        self.nearest.distance * self.nearest.distance
    }

    /// Compares the triangles of two nodes of the lowest level.
    fn leaves(&mut self, [node_a, node_b]: [Node; 2]) {
        let [a, b] = self.bodies;
        let (items_a, items_b) = (a.tree.items(node_a).unwrap_or_default(), b.tree.items(node_b).unwrap_or_default());
        for &i in items_a {
            let of_a = a.corners(i);
            let around_a = Box32::around(of_a);
            for &j in items_b {
                let of_b = b.corners(j);
                let gap = around_a.squared_distance(&Box32::around(of_b));
                if gap >= self.squared() {
                    continue;
                }
                if gap == 0.0 && do_meet(&of_a, &of_b) {
                    let mut point = distance(&of_a, &of_b).points[0];
                    crossings(&of_a, &of_b, |crossing| point = crossing);
                    self.nearest = Nearest { distance: 0.0, points: [point; 2] };
                    return;
                }
                let longest = |[a, b, c]: Corners| a.distance(b).max(b.distance(c)).max(c.distance(a));
                let error = ROUGH_ERROR * longest(of_a).max(longest(of_b));
                if rough_distance(&of_a, &of_b) - error < self.nearest.distance {
                    let found = distance(&of_a, &of_b);
                    if found.distance < self.nearest.distance {
                        self.nearest = found;
                    }
                }
            }
        }
    }
}
