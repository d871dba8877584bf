//! What gets to each node, and what becomes of balls by it.

use rayon::prelude::*;

use super::basins::Basins;
use super::steps::Steps;
use crate::metrics::{Edges, NodeSet};

/// The least radius of what gets anywhere: nodes of a piece that is open are reached, however narrow it is.
pub(super) const LEAST: f32 = f32::MIN_POSITIVE;

/// For each node the radius, in pitches, of the largest ball that gets there from one of `sources`: the greatest, of all
/// paths, of the least radius on the path. 0 of nodes that no path leads to, above 0 of all others.
///
/// `radii` says how large a ball has room in a node's cell, in pitches; paths go through `nodes`, and from one 6-connected
/// piece of them to another never. With [`Edges::Periodic`] they wrap; with the others they end where the raster does.
/// Sources outside `nodes` do not count. From outside, they are the [`boundary`](super::boundary) of the region.
///
/// The values are exact for those radii. It takes 4 bytes for each node beside the result, and the passes over the raster
/// are parallel.
///
/// # Panics
/// If there is not a radius for each node, the sets are of rasters of different sizes, or there are 2³¹ nodes or more.
pub fn bottlenecks(radii: &[f32], nodes: &NodeSet, sources: &NodeSet, edges: Edges) -> Vec<f32> {
    assert_eq!(radii.len(), nodes.volume(), "a radius for each node");
    let steps = Steps::new(nodes, edges);
    Basins::new(&steps, radii).bottlenecks(&sources.and(nodes))
}

/// The nodes that something gets to: those with a bottleneck. Of pores and the boundary of the region, the open pores.
///
/// # Panics
/// If there is not a bottleneck for each node of a raster of that size.
pub fn reached(bottlenecks: &[f32], size: [usize; 3]) -> NodeSet {
    assert_eq!(bottlenecks.len(), size.iter().product::<usize>(), "a bottleneck for each node");
    NodeSet::from_fn(size, |[x, y, z]| bottlenecks[(z * size[1] + y) * size[0] + x] > 0.0)
}

/// Lowers the radii of balls to what gets to their centres, both in pitches and one for each node. Painted, they give
/// access sizes: of a point, 2 · max { b(c) : |p − c| ≤ b(c) } over centres c with bottlenecks b.
///
/// # Panics
/// If there are more or fewer of one than of the other.
pub fn lower(radii: &mut [f32], bottlenecks: &[f32]) {
    assert_eq!(radii.len(), bottlenecks.len(), "a bottleneck for each ball");
    radii.par_iter_mut().zip(bottlenecks).with_min_len(1 << 14).for_each(|(radius, &most)| *radius = radius.min(most));
}

/// The largest of some radii, but no more than the sides of the raster together: where there is no surface, radii are infinite.
pub(super) fn widest(radii: &[f32], size: [usize; 3]) -> f32 {
    let largest = radii.par_iter().with_min_len(1 << 14).copied().reduce(|| 0.0, f32::max);
    largest.min(size.iter().sum::<usize>() as f32)
}
