//! The nodes of pieces that reach from end to end.

use crate::grid::Axis;
use crate::metrics::components::{Components, Connectivity};
use crate::metrics::{BoundaryCondition, NodeSet};

/// Returns the nodes of all 6-connected pieces of a set that reach from the first plane across an axis to the last.
pub(super) fn spanning(nodes: &NodeSet, axis: Axis, edges: BoundaryCondition) -> NodeSet {
    let (size, depth) = (nodes.size(), axis.depth());
    let last = size[depth] - 1;
    if edges != BoundaryCondition::Periodic {
        return spanning_within(nodes, axis, last, edges);
    }
    // An empty plane beyond the last parts the ends, which are no neighbours, while all other faces are.
    let mut longer = size;
    longer[depth] += 1;
    let parted = NodeSet::from_fn(longer, |node| node[depth] < size[depth] && nodes.contains(node));
    let found = spanning_within(&parted, axis, last, edges);
    NodeSet::from_fn(size, |node| found.contains(node))
}

/// Returns the nodes of all pieces of a set that have nodes in the first plane and in plane `last`.
fn spanning_within(nodes: &NodeSet, axis: Axis, last: usize, edges: BoundaryCondition) -> NodeSet {
    let pieces = Components::of(nodes, Connectivity::Faces, edges);
    let [near, far] =
        [0, last].map(|at| pieces.touched_by(&NodeSet::from_fn(nodes.size(), |node| node[axis.depth()] == at)));
    pieces.nodes(|piece| near[piece as usize] && far[piece as usize])
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
