//! Faces in the order of a space-filling curve, with their boxes, under a hierarchy: which of them may meet.
//!
//! Pairs are looked for block by block, a block being some faces that follow one another along the curve. What a test needs of a
//! face is prepared once for each block that the face is near to.

use std::cmp::Ordering::{Equal, Greater, Less};

use crate::parallel::*;
use glam::DVec3;

use crate::allocation::vec_with_room;
use crate::box_tree::{Box32, BoxTree, FourBoxes, LEAF, Node, in_order};
use crate::cancel::checkpoint;

/// The level of the nodes that are blocks, where the lowest has 0.
const BLOCK_LEVEL: u32 = 4;

/// Number of leaves that a block is compared with at once: a block with a long face may touch all, and what is prepared of them
/// takes memory.
const MOST_BESIDE: usize = 1024;

/// The pairs of the faces of two leaves, a bit each: in the lowest four bits those of the first face with the first to the fourth
/// of the other leaf.
const ALL_PAIRS: u16 = u16::MAX;

/// Those of two faces of one leaf, once each.
const LATER_PAIRS: u16 = 0x08ce;

/// Some faces with their boxes, and the hierarchy over them.
pub(crate) struct FaceTree {
    /// The boxes of the faces of each leaf.
    extents: Vec<FourBoxes>,
    tree: BoxTree,
}

impl FaceTree {
    /// Returns the hierarchy of at least one face within a box, each with its own, which `extent` returns again.
    pub fn new(
        bounds: &Box32,
        faces: impl ParallelIterator<Item = (u32, Box32)>,
        extent: impl Fn(u32) -> Box32 + Sync,
    ) -> FaceTree {
        let order = in_order(bounds, faces);
        let of_leaf = |faces: &[u32]| FourBoxes::of(faces.iter().map(|&face| extent(face)));
        let mut extents: Vec<FourBoxes> = vec_with_room(order.len().div_ceil(LEAF));
        extents.par_extend(order.par_chunks(LEAF).with_min_len(1 << 10).map(of_leaf));
        FaceTree::over(order, extents)
    }

    /// Returns the hierarchy of at least one face, each with its own box.
    pub fn of(faces: &[u32], extent: impl Fn(u32) -> Box32 + Sync + Send) -> FaceTree {
        let all = || faces.par_iter().with_min_len(1 << 10).map(|&face| (face, extent(face)));
        let bounds = all().map(|(_, extent)| extent).reduce(|| Box32::EMPTY, Box32::union);
        FaceTree::new(&bounds, all(), &extent)
    }

    /// Returns the hierarchy over faces in this order, with their boxes.
    fn over(order: Vec<u32>, extents: Vec<FourBoxes>) -> FaceTree {
        let leaves = extents.par_iter().with_min_len(1 << 10).map(FourBoxes::union).collect();
        FaceTree { extents, tree: BoxTree::over(order, leaves) }
    }

    /// Returns the face at each place, in the order of the curve.
    pub fn faces(&self) -> &[u32] {
        self.tree.order()
    }

    /// Returns the box of the face at a place.
    pub fn extent(&self, place: usize) -> Box32 {
        self.extents[place / LEAF].get(place % LEAF)
    }

    /// Returns what `look` finds of the pairs of faces whose boxes touch, in an order that does not depend on threads. `prepare`
    /// returns what it needs of a face.
    pub fn pairs<P, T: Send>(
        &self,
        other: &FaceTree,
        prepare: impl Fn(u32) -> P + Sync,
        look: impl Fn(&P, &P) -> Option<T> + Sync,
    ) -> Vec<T> {
        // By the blocks of the tree that has more, as they are the tasks.
        let is_turned = self.tree.leaves() < other.tree.leaves();
        let (more, fewer) = if is_turned { (other, self) } else { (self, other) };
        let of_block = |scratch: &mut Scratch<P>, block| {
            let mut found = Vec::new();
            let beside = fewer.leaves(more.tree.bounds(block), 0, |_| true);
            let prepare = |tree: &FaceTree, place: usize| prepare(tree.faces()[place]);
            for beside in beside.chunks(MOST_BESIDE) {
                let look = |p: &P, q: &P| found.extend(if is_turned { look(q, p) } else { look(p, q) });
                more.visit_pairs(block, (fewer, beside), |_| ALL_PAIRS, (scratch, &prepare), look);
            }
            found
        };
        let found: Vec<Vec<T>> = more.blocks().map_init(Scratch::default, of_block).collect();
        found.into_iter().flatten().collect()
    }

    /// Returns what `look` finds of the pairs of places of faces whose boxes touch, of which at least one is wanted, in an order that
    /// does not depend on threads. `prepare` returns what `look` needs of the face at a place.
    pub fn own_pairs<P, T: Send>(
        &self,
        is_wanted: impl Fn(usize) -> bool + Sync,
        prepare: impl Fn(usize) -> P + Sync,
        look: impl Fn(&P, &P) -> Option<T> + Sync,
    ) -> Vec<T> {
        let look = |p: &P, q: &P, found: &mut Vec<T>| found.extend(look(p, q));
        let found: Vec<Vec<T>> = self.own_pairs_by_block(is_wanted, &prepare, &look).collect();
        found.into_iter().flatten().collect()
    }

    /// Returns what `look` adds to a list for the same pairs, each item once and in order. Where pairs share corners, they add the same
    /// items again and again: those of a block are reduced before the next, so that not all are held at once.
    pub fn distinct_of_own_pairs<P, T: Ord + Send>(
        &self,
        is_wanted: impl Fn(usize) -> bool + Sync,
        prepare: impl Fn(usize) -> P + Sync,
        look: impl Fn(&P, &P, &mut Vec<T>) + Sync,
    ) -> Vec<T> {
        let distinct = |mut found: Vec<T>| {
            found.sort_unstable();
            found.dedup();
            found.shrink_to_fit();
            found
        };
        let found: Vec<Vec<T>> = self.own_pairs_by_block(is_wanted, &prepare, &look).map(distinct).collect();
        let mut found: Vec<T> = found.into_iter().flatten().collect();
        found.par_sort_unstable();
        found.dedup();
        found
    }

    /// Returns what [`own_pairs`](Self::own_pairs) finds in the first block that has any; those after it may not be looked at.
    pub fn first_of_own_pairs<P, T: Send>(
        &self,
        is_wanted: impl Fn(usize) -> bool + Sync,
        prepare: impl Fn(usize) -> P + Sync,
        look: impl Fn(&P, &P) -> Option<T> + Sync,
    ) -> Option<Vec<T>> {
        let look = |p: &P, q: &P, found: &mut Vec<T>| found.extend(look(p, q));
        self.own_pairs_by_block(is_wanted, &prepare, &look).find_first(|found| !found.is_empty())
    }

    /// Returns what `look` adds to a list for the pairs of each block.
    fn own_pairs_by_block<P, T: Send>(
        &self,
        is_wanted: impl Fn(usize) -> bool + Sync,
        prepare: &(impl Fn(usize) -> P + Sync),
        look: &(impl Fn(&P, &P, &mut Vec<T>) + Sync),
    ) -> impl IndexedParallelIterator<Item = Vec<T>> {
        let wanted_of_leaf = |leaf: u32| -> u16 {
            self.tree.places(leaf).zip(0..).map(|(place, i)| u16::from(is_wanted(place)) << i).sum()
        };
        let wanted: Vec<u16> =
            (0..self.tree.leaves()).into_par_iter().with_min_len(1 << 10).map(wanted_of_leaf).collect();
        let nodes = self.tree.marks(wanted.iter().map(|&faces| faces != 0).collect());
        let pairs = move |[a, b]: [u32; 2], wanted: &[u16]| {
            let (of_a, of_b) = (wanted[a as usize], wanted[b as usize]);
            let one_is_wanted = (0..4).map(|i| (if of_a >> i & 1 != 0 { 0xf } else { of_b }) << (4 * i)).sum::<u16>();
            match a.cmp(&b) {
                Less => one_is_wanted,
                Equal => one_is_wanted & LATER_PAIRS,
                Greater => 0,
            }
        };
        let of_block = move |scratch: &mut Scratch<P>, block| {
            let mut found = Vec::new();
            let first = self.tree.leaves_under(block).start;
            let all = nodes[self.tree.number(block)];
            let beside = self.leaves(self.tree.bounds(block), first, |node| all || nodes[node]);
            let prepare = |_: &FaceTree, place: usize| prepare(place);
            for beside in beside.chunks(MOST_BESIDE) {
                let pairs = |leaves| pairs(leaves, &wanted);
                self.visit_pairs(block, (self, beside), pairs, (scratch, &prepare), |p, q| look(p, q, &mut found));
            }
            found
        };
        self.blocks().map_init(Scratch::default, of_block)
    }

    /// Calls `visit` for the faces whose boxes the ray from a point along +x may meet.
    pub fn ahead_of(&self, point: DVec3, mut visit: impl FnMut(u32)) {
        self.tree.visit(|extent| extent.is_ahead_of(point), |faces| faces.iter().for_each(|&face| visit(face)));
    }

    /// Returns the blocks, in order.
    fn blocks(&self) -> impl IndexedParallelIterator<Item = Node> + '_ {
        self.tree.nodes(BLOCK_LEVEL)
    }

    /// Returns the leaves, from one of them on, that touch a box and lie under nodes that are all open; in order.
    fn leaves(&self, extent: &Box32, from: u32, is_open: impl Fn(usize) -> bool) -> Vec<u32> {
        let tree = &self.tree;
        let (mut found, mut stack) = (Vec::new(), vec![tree.root()]);
        while let Some(node) = stack.pop() {
            let under = tree.leaves_under(node);
            if under.end <= from || !is_open(tree.number(node)) || !tree.bounds(node).touches(extent) {
                continue;
            }
            match under.len() {
                1 => found.push(under.start),
                _ => tree.children(node).for_each(|child| stack.push(child)),
            }
        }
        found.sort_unstable();
        found
    }

    /// Visits the pairs of a face of a block and one of some leaves of a tree, which may be the same tree, whose boxes touch.
    /// `tested` returns which pairs of the faces of two leaves are wanted, in the form of [`ALL_PAIRS`].
    fn visit_pairs<P>(
        &self,
        block: Node,
        (other, beside): (&FaceTree, &[u32]),
        tested: impl Fn([u32; 2]) -> u16,
        (scratch, prepare): (&mut Scratch<P>, &impl Fn(&FaceTree, usize) -> P),
        mut visit: impl FnMut(&P, &P),
    ) {
        checkpoint();
        let Scratch { around_beside, prepared, is_met, pairs, touching } = scratch;
        let is_same = std::ptr::eq(self, other);
        let own = self.tree.leaves_under(block);
        let around = |leaves: &[u32]| FourBoxes::of(leaves.iter().map(|&b| *other.tree.bounds(Node::leaf(b))));
        around_beside.clear();
        around_beside.extend(beside.chunks(4).map(around));
        let slots = (own.len() + beside.len()) * LEAF;
        prepared.resize_with(slots.max(prepared.len()), || None);
        is_met.clear();
        is_met.resize(slots, false);
        pairs.clear();
        for (a, row) in own.clone().zip(0..) {
            let around_a = FourBoxes::repeating(self.tree.bounds(Node::leaf(a)));
            touching.clear();
            for (four, first) in around_beside.iter().zip((0..).step_by(4)) {
                for i in bits(four.touching(&around_a)) {
                    let tested = tested([a, beside[first + i]]);
                    touching.extend((tested != 0).then_some((first + i, tested)));
                }
            }
            for (i, slot) in (0..self.tree.places(a).len()).zip(row * LEAF..) {
                let extent = self.extents[a as usize].repeated(i);
                for &(place, tested) in touching.iter() {
                    let b = beside[place];
                    let meeting = other.extents[b as usize].touching(&extent) & u32::from(tested >> (LEAF * i));
                    let row = if is_same && b < own.end { (b - own.start) as usize } else { own.len() + place };
                    for j in bits(meeting) {
                        let slots = [slot, row * LEAF + j];
                        slots.iter().for_each(|&slot| is_met[slot] = true);
                        pairs.push(slots);
                    }
                }
            }
        }
        // All together, so that the loads of one do not wait for another's.
        for (slot, _) in is_met.iter().enumerate().filter(|(_, is_met)| **is_met) {
            let (leaf, tree) = match own.start as usize + slot / LEAF {
                leaf if leaf < own.end as usize => (leaf, self),
                _ => (beside[slot / LEAF - own.len()] as usize, other),
            };
            prepared[slot] = Some(prepare(tree, leaf * LEAF + slot % LEAF));
        }
        for &[slot, beside] in pairs.iter() {
            if let (Some(p), Some(q)) = (&prepared[slot], &prepared[beside]) {
                visit(p, q);
            }
        }
    }
}

/// The room in which the pairs of one block after another are found.
struct Scratch<P> {
    /// The boxes of the leaves beside the block.
    around_beside: Vec<FourBoxes>,
    /// What is prepared of each face: first of those of the block, then of those beside it. Only faces that are met have theirs.
    prepared: Vec<Option<P>>,
    is_met: Vec<bool>,
    /// The pairs of faces, by their places in `prepared`.
    pairs: Vec<[usize; 2]>,
    /// The leaves that touch one of the block's, by their places among those beside, and which pairs of faces are wanted.
    touching: Vec<(usize, u16)>,
}

impl<P> Default for Scratch<P> {
    fn default() -> Self {
        Scratch {
            around_beside: Vec::new(),
            prepared: Vec::new(),
            is_met: Vec::new(),
            pairs: Vec::new(),
            touching: Vec::new(),
        }
    }
}

/// Returns the places of the bits that are set, from the lowest.
fn bits(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lowest = (mask != 0).then(|| mask.trailing_zeros() as usize)?;
        mask &= mask - 1;
        Some(lowest)
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use proptest::prelude::*;

    use super::*;

    /// Boxes of different sizes, with coordinates that often coincide.
    fn boxes() -> impl Strategy<Value = Vec<Box32>> {
        let side = || (-8..8i8, 0..5i8).prop_map(|(low, length)| (f64::from(low), f64::from(length) / 2.0));
        let extent = [side(), side(), side()].prop_map(|sides| {
            let low = DVec3::from(sides.map(|(low, _)| low));
            Box32::around([low, low + DVec3::from(sides.map(|(_, length)| length))])
        });
        prop::collection::vec(extent, 1..400)
    }

    /// Returns the tree of boxes whose faces are numbered from `first`.
    fn tree(boxes: &[Box32], first: u32) -> FaceTree {
        let bounds = boxes.iter().copied().fold(Box32::EMPTY, Box32::union);
        let extent = |face: u32| boxes[(face - first) as usize];
        FaceTree::new(
            &bounds,
            (first..first + boxes.len() as u32).into_par_iter().map(|face| (face, extent(face))),
            extent,
        )
    }

    #[test]
    fn a_face_that_touches_more_leaves_than_are_compared_at_once_has_all_its_pairs() {
        let cube = |i: u32| DVec3::new(f64::from(2 * (i % 100)), f64::from(2 * (i / 100)), 0.0);
        let mut boxes: Vec<Box32> = (0..9000).map(|i| Box32::around([cube(i), cube(i) + DVec3::ONE])).collect();
        let all = boxes.iter().copied().fold(Box32::EMPTY, Box32::union);
        boxes.insert(4000, all);
        let tree = tree(&boxes, 0);
        assert!(tree.tree.leaves() as usize > 2 * MOST_BESIDE);
        let count = AtomicU32::new(0);
        let look = |&f: &u32, &g: &u32| {
            count.fetch_add(1, Ordering::Relaxed);
            (f != 4000 && g != 4000).then_some(())
        };
        assert!(tree.first_of_own_pairs(|_| true, |place| tree.faces()[place], look).is_none());
        assert_eq!(count.into_inner(), 9000);
        let pairs = tree.pairs(&super::tests::tree(&[all], 0), |face| face, |&face, _| Some(face));
        assert_eq!(pairs.len(), 9001);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        #[test]
        fn pairs_are_those_whose_boxes_touch(a in boxes(), b in boxes()) {
            let mut found = tree(&a, 5).pairs(&tree(&b, 900), |face| face, |&f, &g| Some([f - 5, g - 900]));
            found.sort_unstable();
            let all = (0..a.len() as u32).flat_map(|f| (0..b.len() as u32).map(move |g| [f, g]));
            let touching: Vec<_> = all.filter(|&[f, g]| a[f as usize].touches(&b[g as usize])).collect();
            prop_assert_eq!(found, touching);
        }

        #[test]
        fn own_pairs_are_those_of_which_one_is_wanted(boxes in boxes(), period in 1..40u32) {
            let tree = tree(&boxes, 0);
            let is_wanted = |face: u32| face.is_multiple_of(period);
            let place_is_wanted = |place: usize| is_wanted(tree.faces()[place]);
            let pair = |&f: &u32, &g: &u32| Some([f.min(g), f.max(g)]);
            let mut all = tree.own_pairs(place_is_wanted, |place| tree.faces()[place], pair);
            let first = tree.first_of_own_pairs(place_is_wanted, |place| tree.faces()[place], pair).unwrap_or_default();
            prop_assert!(all.starts_with(&first) && first.is_empty() == all.is_empty());
            let distinct =
                tree.distinct_of_own_pairs(place_is_wanted, |place| tree.faces()[place], |&f, &g, found| {
                    found.extend([f.min(g), f.max(g), f]);
                });
            let mut corners: Vec<u32> = all.as_flattened().to_vec();
            corners.sort_unstable();
            corners.dedup();
            prop_assert_eq!(distinct, corners);
            all.sort_unstable();
            let count = boxes.len() as u32;
            let expected = (0..count).flat_map(|f| (f + 1..count).map(move |g| [f, g]));
            let touch = |&[f, g]: &[u32; 2]| boxes[f as usize].touches(&boxes[g as usize]);
            let expected: Vec<_> = expected.filter(|[f, g]| is_wanted(*f) || is_wanted(*g)).filter(touch).collect();
            prop_assert_eq!(all, expected);
        }

        #[test]
        fn places_have_the_boxes_of_their_faces(boxes in boxes()) {
            let tree = tree(&boxes, 0);
            let mut faces = tree.faces().to_vec();
            for (place, &face) in faces.iter().enumerate() {
                prop_assert_eq!(tree.extent(place), boxes[face as usize]);
            }
            faces.sort_unstable();
            prop_assert!(faces.into_iter().eq(0..boxes.len() as u32));
        }
    }
}
