//! The flood that goes on where it is widest.

use rayon::prelude::*;

use super::queue::Queue;
use super::steps::{Steps, bits};
use crate::allocation::vec_with_room;
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
/// The values are those of paths that are there, and less than 1/64 of a pitch below the best. It takes one f32 a node for
/// the result and 4 bytes for each node that waits in the queue, in one thread.
///
/// # Panics
/// If there is not a radius for each node, the sets are of rasters of different sizes, or there are 2³² nodes or more.
pub fn bottlenecks(radii: &[f32], nodes: &NodeSet, sources: &NodeSet, edges: Edges) -> Vec<f32> {
    assert_eq!(radii.len(), nodes.volume(), "a radius for each node");
    let steps = Steps::new(nodes, edges);
    let mut reached: Vec<f32> = vec_with_room(radii.len());
    reached.resize(radii.len(), 0.0);
    let mut queue = Queue::new(widest(radii));
    for source in members(&sources.and(nodes)) {
        let index = steps.index(source);
        let radius = radii[index as usize].max(LEAST);
        reached[index as usize] = radius;
        queue.push(radius, index);
    }
    while let Some((_, index)) = queue.pop() {
        let node = steps.place(index);
        let so_far = reached[index as usize];
        for bit in bits(steps.from(node)) {
            let next = steps.index(steps.neighbour(node, bit));
            let radius = &mut reached[next as usize];
            if *radius == 0.0 {
                *radius = so_far.min(radii[next as usize]).max(LEAST);
                queue.push(*radius, next);
            }
        }
    }
    reached
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

/// The largest of some radii, 0 of none.
pub(super) fn widest(radii: &[f32]) -> f32 {
    radii.par_iter().with_min_len(1 << 14).copied().reduce(|| 0.0, f32::max)
}

/// The nodes of a set, in the order of their numbers.
fn members(nodes: &NodeSet) -> impl Iterator<Item = [usize; 3]> {
    let [_, height, depth] = nodes.size();
    (0..depth * height).flat_map(move |row| {
        let (y, z) = (row % height, row / height);
        nodes.row(y, z).iter().enumerate().flat_map(move |(word, &bits)| {
            let mut left = bits;
            std::iter::from_fn(move || {
                (left != 0).then(|| {
                    let x = word * 64 + left.trailing_zeros() as usize;
                    left &= left - 1;
                    [x, y, z]
                })
            })
        })
    })
}
