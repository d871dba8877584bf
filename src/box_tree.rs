//! A hierarchy of boxes: items in the order of a space-filling curve, under an implicit binary tree.
//!
//! The nodes of a level are numbered from 0; those below node i are 2 i and 2 i + 1, so that the tree has no pointers.
//! The lowest level holds a few items in each node. Boxes are rounded outwards to `f32`. The order is that of Morton
//! codes of the centres (Morton 1966), which a sort finds in a fraction of the time of a surface heuristic.

use std::ops::Range;

use crate::parallel::*;
use glam::{DVec3, Vec3A, Vec4};

use crate::allocation::{vec_with_room, zeroed};
use crate::cancel::checkpoint;
use crate::mesh::{Aabb, TriangleMesh};

/// Number of items that one task handles.
const CHUNK: usize = 4096;

/// Number of items of a node of the lowest level.
pub(crate) const LEAF: usize = 4;

/// A box whose sides are rounded outwards to 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Box32 {
    min: Vec3A,
    max: Vec3A,
}

impl Box32 {
    /// The box that touches none.
    pub const EMPTY: Box32 = Box32 { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };
    /// The box of all space.
    pub const WHOLE: Box32 = Box32 { min: Vec3A::NEG_INFINITY, max: Vec3A::INFINITY };

    /// Returns the box around points.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Box32 {
        let mut bounds = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        for point in points {
            bounds = Aabb { min: bounds.min.min(point), max: bounds.max.max(point) };
        }
        Box32::of(bounds)
    }

    /// Returns a box in 32 bits.
    #[inline]
    pub fn of(bounds: Aabb) -> Box32 {
        // Half a unit in the last place of f32 and a little more, so that rounding to the nearest cannot return. Without
        // branches, which would be mispredicted.
        const SHARE: f64 = (1.0 + 1e-3) * (f32::EPSILON / 2.0) as f64;
        let room = |corner: DVec3| corner.abs() * SHARE + DVec3::splat(f32::MIN_POSITIVE as f64);
        // Numbers beyond the range of f32 become infinite, which is outwards on one side alone.
        Box32 {
            min: (bounds.min - room(bounds.min)).as_vec3a().min(Vec3A::MAX),
            max: (bounds.max + room(bounds.max)).as_vec3a().max(Vec3A::MIN),
        }
    }

    /// Returns whether two boxes have a common point.
    #[inline]
    pub fn touches(&self, other: &Box32) -> bool {
        (self.min.cmple(other.max) & other.min.cmple(self.max)).all()
    }

    /// Returns whether another box lies within this one.
    pub fn contains(&self, other: &Box32) -> bool {
        (self.min.cmple(other.min) & other.max.cmple(self.max)).all()
    }

    /// Returns the lengths of the sides.
    fn extent(&self) -> Vec3A {
        self.max - self.min
    }

    /// Returns the box around two boxes.
    pub fn union(self, other: Box32) -> Box32 {
        Box32 { min: self.min.min(other.min), max: self.max.max(other.max) }
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

    /// Returns the least and the greatest corner.
    pub fn corners(&self) -> [DVec3; 2] {
        [self.min, self.max].map(|corner| corner.as_dvec3())
    }

    /// Returns the sum of the sides, by which the larger of two nodes is opened first.
    #[inline]
    fn girth(&self) -> f32 {
        self.extent().element_sum()
    }
}

/// Four boxes, by coordinates, so that one is compared with four at once.
#[derive(Clone, Copy)]
pub(crate) struct FourBoxes {
    min: [Vec4; 3],
    max: [Vec4; 3],
}

impl FourBoxes {
    /// Returns the first four boxes; if there are fewer, the others touch none.
    #[inline]
    pub fn of(boxes: impl Iterator<Item = Box32>) -> FourBoxes {
        let mut four = [Box32::EMPTY; 4];
        four.iter_mut().zip(boxes).for_each(|(slot, found)| *slot = found);
        let [a, b, c, d] = four;
        let along = |axis: usize, of: fn(Box32) -> Vec3A| Vec4::new(of(a)[axis], of(b)[axis], of(c)[axis], of(d)[axis]);
        FourBoxes {
            min: [0, 1, 2].map(|axis| along(axis, |of| of.min)),
            max: [0, 1, 2].map(|axis| along(axis, |of| of.max)),
        }
    }

    /// Returns a box four times.
    #[inline]
    pub fn repeating(of: &Box32) -> FourBoxes {
        let lanes = |corner: Vec3A| corner.to_array().map(Vec4::splat);
        FourBoxes { min: lanes(of.min), max: lanes(of.max) }
    }

    /// Returns the box around all.
    #[inline]
    pub fn union(&self) -> Box32 {
        Box32 {
            min: Vec3A::from(self.min.map(|lanes| lanes.min_element())),
            max: Vec3A::from(self.max.map(|lanes| lanes.max_element())),
        }
    }

    /// Returns one of the boxes.
    pub fn get(&self, i: usize) -> Box32 {
        Box32 { min: Vec3A::from(self.min.map(|lanes| lanes[i])), max: Vec3A::from(self.max.map(|lanes| lanes[i])) }
    }

    /// Returns one of the boxes, four times.
    #[inline]
    pub fn repeated(&self, i: usize) -> FourBoxes {
        let repeated = |lanes: Vec4| Vec4::splat(lanes[i]);
        FourBoxes { min: self.min.map(repeated), max: self.max.map(repeated) }
    }

    /// Returns a bit for each box that touches its counterpart.
    #[inline]
    pub fn touching(&self, other: &FourBoxes) -> u32 {
        let along = |axis: usize| self.min[axis].cmple(other.max[axis]) & other.min[axis].cmple(self.max[axis]);
        (along(0) & along(1) & along(2)).bitmask()
    }
}

/// A node: its level, 0 for the lowest, and its number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Node {
    level: u32,
    index: u32,
}

impl Node {
    /// Returns a node of the lowest level.
    pub fn leaf(index: u32) -> Node {
        Node { level: 0, index }
    }
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
        let items = || (0..count as u32).into_par_iter().with_min_len(CHUNK);
        let all = items().map(&box_of).reduce(|| Box32::EMPTY, Box32::union);
        let order = in_order(&all, items().map(|item| (item, box_of(item))));
        let around = |items: &[u32]| items.iter().map(|&item| box_of(item)).fold(Box32::EMPTY, Box32::union);
        let leaves = order.par_chunks(LEAF).with_min_len(CHUNK / LEAF).map(around).collect();
        BoxTree::over(order, leaves)
    }

    /// Builds the hierarchy over items in this order, with the boxes of the lowest level.
    pub fn over(order: Vec<u32>, leaves: Vec<Box32>) -> BoxTree {
        let mut boxes = leaves;
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
        let held = 2.0 * size_of::<Box32>() as f64 / LEAF as f64 + size_of::<u32>() as f64;
        // The list that is sorted, and the one that it is sorted into, exist only while the hierarchy is built.
        held.max(2.0 * size_of::<(u64, u32)>() as f64)
    }

    /// Returns the items in the order of the hierarchy.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Returns the number of nodes of the lowest level.
    pub fn leaves(&self) -> u32 {
        self.order.len().div_ceil(LEAF) as u32
    }

    /// Returns the places in the order of the items of a node of the lowest level.
    #[inline]
    pub fn places(&self, leaf: u32) -> Range<usize> {
        let first = leaf as usize * LEAF;
        first..self.order.len().min(first + LEAF)
    }

    /// Returns the nodes of the lowest level that lie under a node.
    #[inline]
    pub fn leaves_under(&self, node: Node) -> Range<u32> {
        let end = u64::from(node.index + 1) << node.level;
        node.index << node.level..end.min(u64::from(self.leaves())) as u32
    }

    /// Returns the nodes of a level, or the root where there is none.
    pub fn nodes(&self, level: u32) -> impl IndexedParallelIterator<Item = Node> + use<> {
        let level = level.min(self.root().level);
        (0..self.leaves().div_ceil(1 << level)).into_par_iter().map(move |index| Node { level, index })
    }

    /// Returns the number of a node among all, from the lowest level to the root.
    #[inline]
    pub fn number(&self, node: Node) -> usize {
        (self.levels[node.level as usize] + node.index) as usize
    }

    /// Returns for all nodes, by their numbers, whether one under them is marked, given the marks of the lowest level.
    pub fn marks(&self, mut marks: Vec<bool>) -> Vec<bool> {
        for level in 1..self.levels.len() {
            let below = self.levels[level - 1] as usize..self.levels[level] as usize;
            let above: Vec<bool> = marks[below].chunks(2).map(|pair| pair.contains(&true)).collect();
            marks.extend(above);
        }
        marks
    }

    pub fn root(&self) -> Node {
        Node { level: self.levels.len() as u32 - 1, index: 0 }
    }

    #[inline]
    pub fn bounds(&self, node: Node) -> &Box32 {
        &self.boxes[self.number(node)]
    }

    /// Returns the items of a node of the lowest level; of others, nothing.
    #[inline]
    pub fn items(&self, node: Node) -> Option<&[u32]> {
        (node.level == 0).then(|| &self.order[self.places(node.index)])
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

/// Bits of the code for each axis.
const BITS: u32 = 21;

/// A space-filling curve through a box.
struct Curve {
    low: Vec3A,
    /// The number of steps along an axis for each unit of length.
    scale: Vec3A,
}

impl Curve {
    fn within(all: &Box32) -> Curve {
        // The comparison also rejects NaN, and sides of no length are one step.
        let scale = |side: f32| if side > 0.0 { ((1u32 << BITS) - 1) as f32 / side } else { 0.0 };
        let scale = Vec3A::from(all.extent().to_array().map(scale));
        Curve { low: all.min, scale: scale.min(Vec3A::MAX) }
    }

    /// Returns the Morton code of the centre of a box, 21 bits for each axis.
    fn code(&self, item: &Box32) -> u64 {
        // Casts take NaN to 0, and numbers beyond the range to its end.
        let steps = (0.5 * (item.min - self.low) + 0.5 * (item.max - self.low)) * self.scale;
        let [x, y, z] = steps.to_array().map(|step| spread(u64::from((step as u32).min((1 << BITS) - 1))));
        x | y << 1 | z << 2
    }
}

/// Returns items, each with its box, in the order of the curve through a box.
pub(crate) fn in_order(all: &Box32, items: impl ParallelIterator<Item = (u32, Box32)>) -> Vec<u32> {
    let curve = Curve::within(all);
    let mut coded: Vec<(u64, u32)> = vec_with_room(items.opt_len().unwrap_or_default());
    coded.par_extend(items.map(|(item, extent)| (curve.code(&extent), item)));
    checkpoint();
    by_code(coded)
}

/// Returns items in the order of their codes, and those with the same code in that of their numbers.
fn by_code(coded: Vec<(u64, u32)>) -> Vec<u32> {
    sorted(coded).into_par_iter().with_min_len(CHUNK).map(|(_, item)| item).collect()
}

/// Returns items sorted by their codes, and those with the same code by their numbers.
fn sorted(mut coded: Vec<(u64, u32)>) -> Vec<(u64, u32)> {
    const DIGIT: u32 = 11;
    if coded.len() < CHUNK {
        coded.sort_unstable();
        return coded;
    }
    // First into buckets by the most significant digit; these are then sorted side by side, in the cache.
    let digit = |code: u64| (code >> (3 * BITS - DIGIT)) as usize;
    let mut places = [0; 1 << DIGIT];
    coded.iter().for_each(|&(code, _)| places[digit(code)] += 1);
    let mut end = 0u32;
    for place in &mut places {
        end += std::mem::replace(place, end);
    }
    let mut sorted: Vec<(u64, u32)> = zeroed(coded.len());
    checkpoint();
    for item in coded {
        let place = &mut places[digit(item.0)];
        sorted[*place as usize] = item;
        *place += 1;
    }
    sorted.par_chunk_by_mut(|a, b| digit(a.0) == digit(b.0)).for_each(|bucket| {
        checkpoint();
        bucket.par_sort_unstable();
    });
    sorted
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
    fn numbers_beyond_the_range_of_f32_are_rounded_outwards() {
        let bounds = Aabb { min: DVec3::new(1e300, -1e300, 0.0), max: DVec3::new(2e300, -1e200, 1e-300) };
        let [min, max] = Box32::of(bounds).corners();
        assert!(min.cmple(bounds.min).all() && max.cmpge(bounds.max).all());
    }

    #[test]
    fn many_codes_are_sorted_as_by_comparisons() {
        // Some with the same code, and some that differ in a single digit.
        let code = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (1 + i % 3 * 20);
        let mut coded: Vec<(u64, u32)> = (0..3 * CHUNK as u32).map(|item| (code(u64::from(item) / 2), item)).collect();
        let found = sorted(coded.clone());
        coded.sort_unstable();
        assert_eq!(found, coded);
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
