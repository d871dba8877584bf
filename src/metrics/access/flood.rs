//! Bottlenecks of nodes, and the access sizes of balls.

use crate::parallel::*;

use super::basins::Basins;
use super::steps::Steps;
use crate::metrics::thickness::{Ball, paint};
use crate::metrics::{BoundaryCondition, NodeSet};

/// Computes for each node the radius, in pitches, of the largest ball that reaches it from one of `sources`: the maximum, over
/// all paths, of the least radius on the path. 0 for nodes that no path leads to, above 0 for all others.
///
/// `radii` holds the radius of the largest ball centred in each node's cell, in pitches; paths go through `nodes`, and never
/// from one 6-connected piece of them to another. With [`BoundaryCondition::Periodic`] they wrap; otherwise they end at the
/// raster's faces. Sources outside `nodes` do not count. For access from outside, `nodes` are the open pores
/// ([`open_pores`](crate::metrics::components::open_pores)), and sources the [`rim`](crate::metrics::components::rim) of the
/// region.
///
/// The values are exact for those radii; what is not positive counts as the least positive radius. Needs no memory for each node
/// besides the result; the passes over the raster are parallel.
///
/// # Panics
/// If there is not a radius for each node, the sets are of rasters of different sizes, or there are 2³¹ nodes or more.
pub fn bottlenecks(radii: &[f32], nodes: &NodeSet, sources: &NodeSet, edges: BoundaryCondition) -> Vec<f32> {
    assert_eq!(radii.len(), nodes.volume(), "a radius for each node");
    let steps = Steps::new(nodes, edges);
    Basins::new(&steps, radii).bottlenecks(&sources.and(nodes))
}

/// Computes the access size of each of the open nodes, a diameter in pitches: that of the largest ball from outside that covers
/// the node. 0 for other nodes.
///
/// `balls` are the largest of the pores ([`largest_balls`](crate::metrics::thickness::largest_balls)) and `bottlenecks` are
/// those of the open nodes, from outside. Sizes are accurate to half a pitch, as painting is.
///
/// # Panics
/// If there is not a bottleneck for each node.
pub fn access_sizes(balls: &[Ball], bottlenecks: &[f32], open: &NodeSet, edges: BoundaryCondition) -> Vec<f32> {
    assert_eq!(bottlenecks.len(), open.volume(), "a bottleneck for each node");
    let lowered = |ball: &Ball| 2.0 * ball.radius.min(bottlenecks[ball.node as usize]);
    let sizes: Vec<f32> = balls.par_iter().with_min_len(1 << 12).map(lowered).collect();
    paint(balls, &sizes, open, edges)
}

/// Returns the largest of some radii, limited to the sum of the raster's sides: where there is no surface, radii are infinite.
pub(super) fn widest(radii: &[f32], size: [usize; 3]) -> f32 {
    let largest = radii.par_iter().with_min_len(1 << 14).copied().reduce(|| 0.0, f32::max);
    largest.min(size.iter().sum::<usize>() as f32)
}
