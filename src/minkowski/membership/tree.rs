//! A hierarchy of boxes on the lattice.
//!
//! `obvhs` clusters the boxes (locally ordered clustering, then reinsertion where that lowers the cost). It works in `f32`,
//! which cannot represent lattice positions, and has no descent through two hierarchies; so its nodes are copied with exact
//! boxes, and the descents are implemented here.

use std::ops::{ControlFlow, Range};
use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use crate::grid::LatticeBox;

/// A hierarchy of boxes over items, ordered such that each node has a range of them.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
}

/// A node of the hierarchy.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// The box around all items below.
    pub bounds: LatticeBox,
    /// The first item, or where there are none the first of two child nodes, which are adjacent.
    first: u32,
    items: u32,
}

/// Nodes yet to be entered.
pub type Stack = Vec<u32>;

/// Pairs of nodes yet to be entered.
pub type PairStack = Vec<[u32; 2]>;

impl Node {
    /// Returns the indices of its items, in the tree's order; only for a leaf.
    fn items(&self) -> Range<usize> {
        self.first as usize..(self.first + self.items) as usize
    }

    fn is_leaf(&self) -> bool {
        self.items > 0
    }

    fn below(&self) -> [u32; 2] {
        [self.first, self.first + 1]
    }

    /// Returns the sum of the three sides.
    #[inline]
    fn girth(&self) -> i64 {
        {
            let side = |i: usize| i64::from(self.bounds.max[i] - self.bounds.min[i]);
            side(0) + side(1) + side(2)
        }
    }
}

/// Returns whether a box of one solid meets that of another which was reflected and moved to a movable point.
#[inline]
pub fn do_meet(one: &LatticeBox, reflected: &LatticeBox, point: [i32; 3]) -> bool {
    let meet = |i: usize| (one.min[i] + reflected.min[i] <= point[i]) & (point[i] < one.max[i] + reflected.max[i]);
    meet(0) & meet(1) & meet(2)
}

impl Tree {
    /// Builds a tree over boxes; returns it with their indices in its order.
    pub fn new(boxes: &[LatticeBox]) -> (Tree, Vec<u32>) {
        if boxes.is_empty() {
            return (Tree::default(), Vec::new());
        }
        let rounded: Vec<Aabb> = boxes.iter().map(rounded).collect();
        // A better hierarchy takes longer to build than it saves.
        let params = BvhBuildParams { max_prims_per_leaf: 2, ..BvhBuildParams::fast_build() };
        let hierarchy = build_bvh2(&rounded, params, &mut Duration::default());
        let (mut nodes, order) = copied(&hierarchy);
        // Nodes come before those below them.
        for index in (0..nodes.len()).rev() {
            let node = nodes[index];
            let hull = |all: LatticeBox, one: &LatticeBox| all.hull(one);
            nodes[index].bounds = match node.is_leaf() {
                true => order[node.items()].iter().map(|&item| &boxes[item as usize]).fold(LatticeBox::EMPTY, hull),
                false => node.below().iter().map(|&n| &nodes[n as usize].bounds).fold(LatticeBox::EMPTY, hull),
            };
        }
        (Tree { nodes }, order)
    }

    /// Returns the box of all items; empty if there are none.
    pub fn bounds(&self) -> LatticeBox {
        self.nodes.first().map_or(LatticeBox::EMPTY, |root| root.bounds)
    }

    /// Calls `ask` with ranges of items below the nodes that `enter` accepts, until it breaks.
    pub fn visit(
        &self,
        stack: &mut Stack,
        enter: impl Fn(&LatticeBox) -> bool,
        mut ask: impl FnMut(Range<usize>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        stack.clear();
        stack.extend(self.nodes.first().map(|_| 0));
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if !enter(&node.bounds) {
                continue;
            }
            match node.is_leaf() {
                true => ask(node.items())?,
                false => stack.extend(node.below()),
            }
        }
        ControlFlow::Continue(())
    }

    /// Calls `ask` with pairs of ranges of items, of this tree and of another one that was reflected and moved to a movable
    /// point, whose boxes meet, until it breaks. Before the boxes of one tree are opened about a leaf of the other, `may_meet`
    /// or `may_meet_reflected` tests the leaf's items against the box, which prunes boxes far from large items.
    pub fn visit_pairs(
        &self,
        reflected: &Tree,
        point: [i32; 3],
        stack: &mut PairStack,
        may_meet: impl Fn(Range<usize>, &LatticeBox) -> bool,
        may_meet_reflected: impl Fn(&LatticeBox, Range<usize>) -> bool,
        mut ask: impl FnMut(Range<usize>, Range<usize>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        stack.clear();
        let (Some(one), Some(other)) = (self.nodes.first(), reflected.nodes.first()) else {
            return ControlFlow::Continue(());
        };
        if do_meet(&one.bounds, &other.bounds, point) {
            stack.push([0, 0]);
        }
        while let Some([i, j]) = stack.pop() {
            let (one, other) = (&self.nodes[i as usize], &reflected.nodes[j as usize]);
            if one.is_leaf() && other.is_leaf() {
                ask(one.items(), other.items())?;
                continue;
            }
            if one.is_leaf() && !may_meet(one.items(), &other.bounds)
                || other.is_leaf() && !may_meet_reflected(&one.bounds, other.items())
            {
                continue;
            }
            // The larger of the two is opened.
            if other.is_leaf() || (!one.is_leaf() && one.girth() >= other.girth()) {
                for i in one.below() {
                    if do_meet(&self.nodes[i as usize].bounds, &other.bounds, point) {
                        stack.push([i, j]);
                    }
                }
            } else {
                for j in other.below() {
                    if do_meet(&one.bounds, &reflected.nodes[j as usize].bounds, point) {
                        stack.push([i, j]);
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Returns the box in `f32`, rounded.
fn rounded(exact: &LatticeBox) -> Aabb {
    let corner = |position: [i32; 3]| position.map(|c| c as f32).into();
    Aabb::new(corner(exact.min), corner(exact.max))
}

/// Copies the nodes of a hierarchy from the root on, without their boxes, and the items in the order of leaves.
fn copied(hierarchy: &Bvh2) -> (Vec<Node>, Vec<u32>) {
    let unset = Node { bounds: LatticeBox::EMPTY, first: 0, items: 0 };
    let mut nodes = vec![unset];
    let mut order = Vec::with_capacity(hierarchy.primitive_indices.len());
    let mut stack = vec![(0, 0)];
    while let Some((index, place)) = stack.pop() {
        let node = &hierarchy.nodes[index];
        let first = node.first_index as usize;
        if node.is_leaf() {
            nodes[place] = Node { first: order.len() as u32, items: node.prim_count, ..unset };
            order.extend_from_slice(&hierarchy.primitive_indices[first..first + node.prim_count as usize]);
        } else {
            nodes[place].first = nodes.len() as u32;
            stack.extend([(first + 1, nodes.len() + 1), (first, nodes.len())]);
            nodes.extend([unset; 2]);
        }
    }
    (nodes, order)
}
