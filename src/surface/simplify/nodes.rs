//! The nodes of a lattice that a change of the surface would move to its other side.

use glam::DVec3;

use crate::grid::Grid;
use crate::mesh::hash::{PI, mix};

/// Rounding of a coordinate, in pitches.
const ROUNDED: f64 = 1e-6;

/// Tells whether parts of a surface may be exchanged so that all nodes of a grid keep their sides.
///
/// Two parts with the same boundary enclose the nodes that would change. Columns of nodes cross both; the nodes of one keep their
/// sides if between any two nodes the number of crossings is even. Each crossing is known by a hash of the node above it, and
/// the hashes of a column are combined by XOR, so that a pair of equal ones cancels. The XOR is zero where all cancel; where they do
/// not, it is zero with a chance of 2⁻⁶⁴. Coordinates are rounded, so that nodes on the surface may change: the result is sampled
/// afterwards.
pub(super) struct NodeGuard {
    origin: DVec3,
    /// One over the pitch.
    density: f64,
    /// The greatest node.
    last: DVec3,
}

impl NodeGuard {
    /// Returns the guard of a grid for coordinates relative to a point.
    pub fn new(grid: &Grid, relative_to: DVec3) -> NodeGuard {
        let [first, second] = [0, 1].map(|node| grid.step() * f64::from(grid.node(node)));
        let last = DVec3::from_array(grid.rays().map(|rays| f64::from(rays) - 1.0));
        NodeGuard { origin: grid.origin() + first - relative_to, density: 1.0 / (second - first), last }
    }

    /// Returns whether the nodes keep their sides if triangles replace others, which have all their corners. `hashes` is scratch
    /// space.
    pub fn keeps_sides(
        &self,
        before: impl Iterator<Item = [DVec3; 3]> + Clone,
        after: impl Iterator<Item = [DVec3; 3]>,
        hashes: &mut Vec<u64>,
    ) -> bool {
        let by_nodes = |triangle: [DVec3; 3]| triangle.map(|corner| (corner - self.origin) * self.density);
        let (mut low, mut high, mut facing) = (DVec3::INFINITY, DVec3::NEG_INFINITY, DVec3::ZERO);
        for [a, b, c] in before.clone().map(by_nodes) {
            (low, high) = (low.min(a).min(b).min(c), high.max(a).max(b).max(c));
            facing += (b - a).cross(c - a);
        }
        let (first, last) = (low.ceil().max(DVec3::ZERO), high.floor().min(self.last));
        if first.cmpgt(last).any() {
            return true;
        }
        // Along the axis that they face most, the surface is crossed least often.
        let axis = facing.abs().max_position();
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        // Most fans are nearly flat: between the two planes that hold them there is seldom a node.
        let height = |place: DVec3| facing.dot(place);
        let (lowest, highest) = before
            .clone()
            .flat_map(by_nodes)
            .map(height)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lowest, highest), height| {
                (lowest.min(height), highest.max(height))
            });
        let has_node_between = |x: i64, y: i64| {
            let ends = [lowest, highest].map(|end| (end - facing[u] * x as f64 - facing[v] * y as f64) / facing[axis]);
            let (from, to) = (ends[0].min(ends[1]) - ROUNDED, ends[0].max(ends[1]) + ROUNDED);
            ceiling(from.max(first[axis])) <= floor(to.min(last[axis]))
        };
        let [xs, ys] = [u, v].map(|i| first[i] as i64..=last[i] as i64);
        if facing[axis] != 0.0 && !ys.into_iter().any(|y| xs.clone().any(|x| has_node_between(x, y))) {
            return true;
        }
        let [width, rows] = [u, v].map(|i| (last[i] - first[i]) as usize + 1);
        let columns = Columns { axis, first, last, width };
        hashes.clear();
        hashes.resize(width * rows, 0);
        before.chain(after).for_each(|triangle| columns.cross(by_nodes(triangle), hashes));
        hashes.iter().all(|&hash| hash == 0)
    }
}

/// The columns of nodes along an axis in a box.
struct Columns {
    axis: usize,
    /// The least node, and the greatest.
    first: DVec3,
    last: DVec3,
    /// The number of columns in a row.
    width: usize,
}

impl Columns {
    /// Combines the hash of each column that crosses a triangle with that of the first node above the crossing.
    fn cross(&self, corners: [DVec3; 3], hashes: &mut [u64]) {
        let (u, v, w) = ((self.axis + 1) % 3, (self.axis + 2) % 3, self.axis);
        let [a, b, c] = corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let [ys, xs] = [v, u].map(|i| ceiling(low[i].max(self.first[i]))..=floor(high[i].min(self.last[i])));
        if ys.is_empty() || xs.is_empty() {
            return;
        }
        let normal = (b - a).cross(c - a);
        if normal[w] == 0.0 {
            return;
        }
        let is_up = normal[w] > 0.0;
        let sides = [Side::new(a, b, u, v), Side::new(b, c, u, v), Side::new(c, a, u, v)];
        let slopes = [normal[u] / normal[w], normal[v] / normal[w]];
        for y in ys {
            let row = (y - self.first[v] as i64) as usize * self.width;
            for x in xs.clone() {
                let (px, py) = (x as f64, y as f64);
                if sides.iter().all(|side| side.has(px, py, is_up)) {
                    let depth = a[w] - slopes[0] * (px - a[u]) - slopes[1] * (py - a[v]);
                    let above = ceiling(depth.clamp(low[w], high[w]));
                    hashes[row + (x - self.first[u] as i64) as usize] ^= mix(above as u64 ^ PI[0], PI[1]);
                }
            }
        }
    }
}

/// Returns the least whole number that is not less. Conversions are quicker than `f64::ceil`, which is a call without SSE 4.1.
fn ceiling(number: f64) -> i64 {
    let whole = number as i64;
    whole.saturating_add(i64::from((whole as f64) < number))
}

/// Returns the greatest whole number that is not greater.
fn floor(number: f64) -> i64 {
    ceiling(-number).saturating_neg()
}

/// A side of a triangle, seen along an axis. Two triangles that share it compute the same numbers.
struct Side {
    from: [f64; 2],
    along: [f64; 2],
    is_turned: bool,
}

impl Side {
    fn new(from: DVec3, to: DVec3, u: usize, v: usize) -> Side {
        let ends = [[from[u], from[v]], [to[u], to[v]]];
        let is_turned = ends[0] > ends[1];
        let [from, to] = if is_turned { [ends[1], ends[0]] } else { ends };
        Side { from, along: [to[0] - from[0], to[1] - from[1]], is_turned }
    }

    /// Returns whether a column lies on the inner side; one on the side belongs to one of the two triangles that share it.
    fn has(&self, x: f64, y: f64, is_up: bool) -> bool {
        let turn = self.along[0] * (y - self.from[1]) - self.along[1] * (x - self.from[0]);
        (turn >= 0.0) == (self.is_turned != is_up)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    /// Returns whether the nodes at whole coordinates keep their sides where the apex of a pyramid without base moves.
    fn keeps(base: &[DVec3], [from, to]: [DVec3; 2]) -> bool {
        let fan = |apex: DVec3| (0..base.len()).map(move |i| [base[i], base[(i + 1) % base.len()], apex]);
        let guard = NodeGuard { origin: DVec3::splat(-20.0), density: 1.0, last: DVec3::splat(40.0) };
        // The box of the triangles before must hold those after.
        let (before, after): (Vec<_>, Vec<_>) = (fan(from).collect(), fan(to).collect());
        guard.keeps_sides(before.iter().copied(), after.iter().copied(), &mut Vec::new())
    }

    #[test]
    fn nodes_between_two_parts_are_noticed() {
        let base = [[-2.5, -2.5, -0.5], [2.5, -2.5, -0.5], [2.5, 2.5, -0.5], [-2.5, 2.5, -0.5]].map(DVec3::from_array);
        let apex = |z: f64| DVec3::new(0.01, 0.02, z);
        // Along every axis, and where the column through the middle has several nodes.
        for turn in 0..3 {
            let turned = |p: DVec3| DVec3::from_array([0, 1, 2].map(|i| p[(i + turn) % 3]));
            let keeps = |from: f64, to: f64| keeps(&base.map(turned), [apex(from), apex(to)].map(turned));
            assert!(keeps(3.9, 3.8) && keeps(0.9, 0.4));
            assert!(!keeps(3.9, 0.4) && !keeps(1.9, 0.9) && !keeps(0.5, -0.4));
        }
        // A node on a column that lies on a side of the triangles.
        let on_side = |from: f64, to: f64| keeps(&base, [DVec3::new(0.0, 0.0, from), DVec3::new(0.0, 0.0, to)]);
        assert!(on_side(1.6, 1.4) && !on_side(1.6, 0.8));
    }

    #[test]
    fn nodes_keep_their_sides_where_each_is_inside_as_often_as_before() {
        let mut random = Random::new(5);
        let mut counts = [0; 2];
        for _ in 0..2000 {
            let mut place =
                |flat: f64| DVec3::from_array([3.0, 3.0, flat].map(|extent| extent * (2.0 * random.share() - 1.0)));
            let base: Vec<DVec3> = (0..4).map(|_| place(0.7)).collect();
            let (from, to) = (place(1.5), base[0]);
            // Seen along z, which no side is parallel to.
            let above = |node: DVec3, apex: DVec3| {
                let crosses = |i: usize| {
                    let [a, b, c] = [base[i], base[(i + 1) % 4], apex].map(|corner| corner - node);
                    let turn = |p: DVec3, q: DVec3| p.x * q.y - p.y * q.x;
                    let [u, v, w] = [turn(b, c), turn(c, a), turn(a, b)];
                    let is_over = (u > 0.0) == (v > 0.0) && (v > 0.0) == (w > 0.0);
                    is_over && (u * a.z + v * b.z + w * c.z) / (u + v + w) > 0.0
                };
                (0..4).filter(|&i| crosses(i)).count()
            };
            let nodes = (0..343).map(|i| DVec3::from_array([i % 7, i / 7 % 7, i / 49].map(|c| f64::from(c) - 3.0)));
            let expected = nodes.into_iter().all(|node| (above(node, from) + above(node, to)) % 2 == 0);
            assert_eq!(keeps(&base, [from, to]), expected, "{base:?} {from}");
            counts[usize::from(expected)] += 1;
        }
        assert!(counts.iter().all(|count| *count > 200), "{counts:?}");
    }

    #[test]
    fn folds_do_not_hide_what_they_sweep() {
        // The apex beside the base: one side is turned over, and what the other sweeps up this sweeps down.
        let base = [[-2.5, -2.5, 0.5], [2.5, -2.5, 0.5], [2.5, 2.5, 0.5], [-2.5, 2.5, 0.5]].map(DVec3::from_array);
        assert!(!keeps(&base, [DVec3::new(9.3, 0.1, 1.6), DVec3::new(0.0, 0.0, 0.6)]));
        assert!(keeps(&base, [DVec3::new(1.3, 0.1, 0.7), DVec3::new(0.0, 0.0, 0.6)]));
    }
}
