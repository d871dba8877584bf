//! The nodes of pieces that reach from end to end.

use super::geodesic::plane;
use crate::grid::Axis;
use crate::metrics::components::{Components, Connectivity};
use crate::metrics::{BoundaryCondition, NodeSet};

/// Returns the nodes of all 6-connected pieces of a set that reach from the first plane across an axis to the last.
pub(super) fn spanning(nodes: &NodeSet, axis: Axis, edges: BoundaryCondition) -> NodeSet {
    if edges != BoundaryCondition::Periodic {
        return spanning_within(nodes, nodes.size(), axis, edges);
    }
    // An empty plane beyond the last parts the ends, which are no neighbours, while all other faces are.
    let (size, depth) = (nodes.size(), axis.depth());
    let mut longer = size;
    longer[depth] += 1;
    let parted = NodeSet::from_fn(longer, |node| node[depth] < size[depth] && nodes.contains(node));
    let found = spanning_within(&parted, size, axis, edges);
    NodeSet::from_fn(size, |node| found.contains(node))
}

/// Returns the nodes of all pieces of a set that have nodes in the first and the last plane of a raster of that size.
fn spanning_within(nodes: &NodeSet, size: [usize; 3], axis: Axis, edges: BoundaryCondition) -> NodeSet {
    let pieces = Components::of(nodes, Connectivity::Faces, edges);
    let mut ends = vec![[false; 2]; pieces.count()];
    for (end, at) in [0, size[axis.depth()] - 1].into_iter().enumerate() {
        plane(size, axis, at)
            .filter_map(|node| pieces.piece_of(node))
            .for_each(|piece| ends[piece as usize][end] = true);
    }
    pieces.nodes(|piece| ends[piece as usize] == [true; 2])
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
