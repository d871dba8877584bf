//! The nodes of pieces that reach from end to end.

use super::geodesic::plane;
use crate::grid::Axis;
use crate::metrics::{BoundaryCondition, NodeSet};

/// Returns the nodes of all 6-connected pieces of a set that reach from the first plane across an axis to the last.
pub(super) fn spanning(nodes: &NodeSet, axis: Axis, edges: BoundaryCondition) -> NodeSet {
    let last = nodes.size()[axis.depth()] - 1;
    let from_near = connected(nodes, axis, 0, edges);
    connected(&from_near, axis, last, edges)
}

/// Returns the nodes that 6-neighbours connect with those of a plane.
fn connected(nodes: &NodeSet, axis: Axis, at: usize, edges: BoundaryCondition) -> NodeSet {
    let mut met = NodeSet::empty(nodes.size());
    let mut waiting: Vec<[u32; 3]> = Vec::new();
    let mut meet = |node: [usize; 3], waiting: &mut Vec<[u32; 3]>| {
        if nodes.contains(node) && !met.contains(node) {
            met.insert(node);
            waiting.push(node.map(|c| c as u32));
        }
    };
    plane(nodes.size(), axis, at).for_each(|node| meet(node, &mut waiting));
    while let Some(node) = waiting.pop() {
        let node = node.map(|c| c as usize);
        around(nodes.size(), axis, edges, node).into_iter().flatten().for_each(|other| meet(other, &mut waiting));
    }
    met
}

/// Returns the 6-neighbours of a node: below and above along x, y and z. Neighbours across the lateral faces of the raster
/// exist only with [`BoundaryCondition::Periodic`], and across the two end faces never.
#[inline]
pub(super) fn around(
    size: [usize; 3],
    ends: Axis,
    edges: BoundaryCondition,
    node: [usize; 3],
) -> [Option<[usize; 3]>; 6] {
    std::array::from_fn(|i| {
        let (along, up) = (i / 2, i % 2 == 1);
        let (at, side) = (node[along], size[along]);
        let wraps = edges == BoundaryCondition::Periodic && along != ends.depth();
        let next = match (up, at) {
            (false, 0) => wraps.then(|| side - 1),
            (false, _) => Some(at - 1),
            (true, _) if at + 1 == side => wraps.then_some(0),
            (true, _) => Some(at + 1),
        };
        next.map(|next| {
            let mut other = node;
            other[along] = next;
            other
        })
    })
}
