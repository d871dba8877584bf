//! A hierarchy of boxes: items in the order of a space-filling curve, under an implicit binary tree.
//!
//! The nodes of a level are numbered from 0; those below node i are 2 i and 2 i + 1, so that the tree has no pointers.
//! The lowest level holds a few items in each node. Boxes are rounded outwards to `f32`. The order is that of Morton
//! codes of the centres (Morton 1966), which a parallel sort finds in a fraction of the time of a surface heuristic.

use glam::DVec3;
use rayon::prelude::*;

use crate::cancel::checkpoint;
use crate::mesh::{Aabb, TriangleMesh};

/// Number of items of a node of the lowest level.
const LEAF: usize = 4;

/// A box whose sides are rounded outwards to 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Box32 {
    min: [f32; 3],
    max: [f32; 3],
}

impl Box32 {
    const EMPTY: Box32 = Box32 { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] };

    /// Returns the box around points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Box32 {
        let mut bounds = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        for point in points {
            bounds = Aabb { min: bounds.min.min(point), max: bounds.max.max(point) };
        }
        Box32::of(bounds)
    }

    /// Returns a box in 32 bits.
    pub fn of(bounds: Aabb) -> Box32 {
        let down =
            |value: f64| Some(value as f32).filter(|&v| f64::from(v) <= value).unwrap_or((value as f32).next_down());
        let up = |value: f64| Some(value as f32).filter(|&v| f64::from(v) >= value).unwrap_or((value as f32).next_up());
        Box32 { min: bounds.min.to_array().map(down), max: bounds.max.to_array().map(up) }
    }

    /// Returns whether two boxes have a common point.
    #[inline]
    pub fn touches(&self, other: &Box32) -> bool {
        // Without short-circuiting, so that the comparisons become vector instructions.
        let spans = |i: usize| (self.min[i] <= other.max[i]) & (other.min[i] <= self.max[i]);
        spans(0) & spans(1) & spans(2)
    }

    /// Returns the box around two boxes.
    pub fn union(self, other: Box32) -> Box32 {
        Box32 {
            min: [0, 1, 2].map(|i| self.min[i].min(other.min[i])),
            max: [0, 1, 2].map(|i| self.max[i].max(other.max[i])),
        }
    }

    /// Returns the square of the distance of two boxes.
    #[inline]
    pub fn squared_distance(&self, other: &Box32) -> f64 {
        let gap = |i: usize| f64::from((self.min[i] - other.max[i]).max(other.min[i] - self.max[i]).max(0.0));
        // Differences of 32-bit numbers are rounded.
        [0, 1, 2].map(gap).iter().map(|gap| gap * gap).sum::<f64>() * (1.0 - 1e-6)
    }

    /// Returns the square of the distance of a point.
    #[inline]
    pub fn squared_distance_to(&self, point: DVec3) -> f64 {
        let gap = |i: usize| (f64::from(self.min[i]) - point[i]).max(point[i] - f64::from(self.max[i])).max(0.0);
        [0, 1, 2].map(gap).iter().map(|gap| gap * gap).sum()
    }

    /// Returns whether the ray from a point along +x can meet the box.
    #[inline]
    pub fn is_ahead_of(&self, point: DVec3) -> bool {
        let spans = |i: usize| f64::from(self.min[i]) <= point[i] && point[i] <= f64::from(self.max[i]);
        spans(1) && spans(2) && f64::from(self.max[0]) >= point.x
    }

    /// Returns the sum of the sides, by which the larger of two nodes is opened first.
    #[inline]
    fn girth(&self) -> f32 {
        (0..3).map(|i| self.max[i] - self.min[i]).sum()
    }
}

/// A node: its level, 0 for the lowest, and its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Node {
    level: u32,
    index: u32,
}

/// The hierarchy over a list of items.
pub(crate) struct BoxTree {
    /// The items, in the order of the curve.
    order: Vec<u32>,
    /// The boxes of all nodes, from the lowest level to the root.
    boxes: Vec<Box32>,
    /// The first box of each level.
    levels: Vec<u32>,
}

impl BoxTree {
    /// Builds the hierarchy of the triangles of a mesh, of which there is at least one.
    pub fn of_mesh(mesh: &TriangleMesh) -> BoxTree {
        let corners = |item: u32| mesh.triangles[item as usize].map(|index| mesh.positions[index as usize]);
        BoxTree::new(mesh.triangles.len(), |item| Box32::around(corners(item)))
    }

    /// Builds the hierarchy of `count` items, at least one, by their boxes.
    pub fn new(count: usize, box_of: impl Fn(u32) -> Box32 + Sync) -> BoxTree {
        let all = (0..count as u32).into_par_iter().map(&box_of).reduce(|| Box32::EMPTY, Box32::union);
        let mut coded: Vec<(u64, u32)> =
            (0..count as u32).into_par_iter().map(|item| (code(&box_of(item), &all), item)).collect();
        checkpoint();
        coded.par_sort_unstable();
        let order: Vec<u32> = coded.into_par_iter().map(|(_, item)| item).collect();
        checkpoint();
        let around = |items: &[u32]| items.iter().map(|&item| box_of(item)).fold(Box32::EMPTY, Box32::union);
        let mut boxes: Vec<Box32> = order.par_chunks(LEAF).map(around).collect();
        let mut levels = vec![0];
        loop {
            let first = levels[levels.len() - 1] as usize;
            let below = &boxes[first..];
            if below.len() == 1 {
                break;
            }
            let above: Vec<Box32> =
                below.chunks(2).map(|pair| pair.iter().copied().fold(Box32::EMPTY, Box32::union)).collect();
            levels.push(boxes.len() as u32);
            boxes.extend(above);
        }
        BoxTree { order, boxes, levels }
    }

    /// Returns the bytes of the hierarchy of a mesh, for each of its triangles.
    pub fn bytes_of_triangle() -> f64 {
        let boxes = 2.0 * size_of::<Box32>() as f64 / LEAF as f64;
        // The list that is sorted exists only while the hierarchy is built.
        boxes + (size_of::<u32>() + size_of::<(u64, u32)>()) as f64
    }

    pub fn root(&self) -> Node {
        Node { level: self.levels.len() as u32 - 1, index: 0 }
    }

    #[inline]
    pub fn bounds(&self, node: Node) -> &Box32 {
        &self.boxes[(self.levels[node.level as usize] + node.index) as usize]
    }

    /// Returns the items of a node of the lowest level; of others, nothing.
    #[inline]
    pub fn items(&self, node: Node) -> Option<&[u32]> {
        let first = node.index as usize * LEAF;
        (node.level == 0).then(|| &self.order[first..self.order.len().min(first + LEAF)])
    }

    /// Returns the nodes under a node that is not of the lowest level.
    #[inline]
    pub fn children(&self, node: Node) -> impl Iterator<Item = Node> {
        let level = node.level - 1;
        let count = self.levels[node.level as usize] - self.levels[level as usize];
        (2 * node.index..count.min(2 * node.index + 2)).map(move |index| Node { level, index })
    }

    /// Visits the nodes of the lowest level that lie under nodes which `enter` accepts.
    pub fn visit(&self, enter: impl Fn(&Box32) -> bool, mut each: impl FnMut(&[u32])) {
        let mut stack = vec![self.root()];
        while let Some(node) = stack.pop() {
            if !enter(self.bounds(node)) {
                continue;
            }
            match self.items(node) {
                Some(items) => each(items),
                None => stack.extend(self.children(node)),
            }
        }
    }
}

/// Opens the larger of two nodes, or the one that can be opened; `None` where both are of the lowest level. Returns the
/// pairs of nodes below.
#[inline]
pub(crate) fn opened(trees: [&BoxTree; 2], [a, b]: [Node; 2]) -> Option<([[Node; 2]; 2], usize)> {
    let is_first = match (a.level, b.level) {
        (0, 0) => return None,
        (0, _) => false,
        (_, 0) => true,
        _ => trees[0].bounds(a).girth() >= trees[1].bounds(b).girth(),
    };
    let mut pairs = [[a, b]; 2];
    let mut count = 0;
    let below = if is_first { trees[0].children(a) } else { trees[1].children(b) };
    for child in below {
        pairs[count] = if is_first { [child, b] } else { [a, child] };
        count += 1;
    }
    Some((pairs, count))
}

/// Returns the Morton code of the centre of a box within another, 21 bits for each axis.
fn code(item: &Box32, all: &Box32) -> u64 {
    let bits = |i: usize| {
        let (low, side) = (f64::from(all.min[i]), f64::from(all.max[i]) - f64::from(all.min[i]));
        let centre = 0.5 * (f64::from(item.min[i]) + f64::from(item.max[i]));
        // The comparison also rejects NaN, of a box without a side.
        let share = if side > 0.0 { (centre - low) / side } else { 0.0 };
        spread((share.clamp(0.0, 1.0) * f64::from((1u32 << 21) - 1)) as u64)
    };
    bits(0) | bits(1) << 1 | bits(2) << 2
}

/// Moves bit i of the lowest 21 bits to bit 3 i.
fn spread(bits: u64) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.into_iter().fold(bits, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids;

    #[test]
    fn every_item_lies_in_one_node_and_within_the_boxes_above() {
        for count in [1, 4, 5, 8, 9, 100, 1000] {
            let place = |item: u32| DVec3::new(f64::from(item * 7 % 13), f64::from(item % 17), f64::from(item)) / 3.0;
            let tree = BoxTree::new(count, |item| Box32::around([place(item)]));
            let mut seen = vec![0; count];
            let mut stack = vec![(tree.root(), *tree.bounds(tree.root()))];
            while let Some((node, above)) = stack.pop() {
                let bounds = *tree.bounds(node);
                assert_eq!(above.union(bounds), above);
                match tree.items(node) {
                    Some(items) => {
                        for &item in items {
                            seen[item as usize] += 1;
                            assert_eq!(bounds.squared_distance_to(place(item)), 0.0);
                        }
                    }
                    None => stack.extend(tree.children(node).map(|child| (child, bounds))),
                }
            }
            assert_eq!(seen, vec![1; count]);
        }
    }

    #[test]
    fn boxes_are_rounded_outwards() {
        let point = DVec3::new(0.1, -1e-50, 16_777_217.0);
        let around = Box32::around([point]);
        for i in 0..3 {
            assert!(f64::from(around.min[i]) <= point[i] && point[i] <= f64::from(around.max[i]));
        }
        assert!(around.max[2] - around.min[2] <= 2.0);
    }

    #[test]
    fn bits_are_spread_by_three() {
        assert_eq!(spread(0b1011), 0b1_000_001_001);
        assert_eq!(spread((1 << 21) - 1).count_ones(), 21);
    }

    #[test]
    fn the_forecast_covers_the_memory_of_a_hierarchy() {
        let mesh = solids::geodesic(1.0, 24).unwrap();
        let tree = BoxTree::of_mesh(&mesh);
        let bytes = tree.order.len() * 4 + tree.boxes.len() * size_of::<Box32>();
        assert!((bytes as f64) < BoxTree::bytes_of_triangle() * mesh.triangles.len() as f64);
    }
}
