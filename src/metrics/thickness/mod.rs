//! Local thickness: at each point the diameter of the largest ball within the phase that contains it.
//!
//! τ(p) = 2 max { r : p ∈ B(c, r) ⊂ Ω } (Hildebrand & Rüegsegger 1997); of the solid it is trabecular thickness (Tb.Th), of the
//! pores trabecular separation (Tb.Sp) and the pore size. Voxel programs measure to the centres of voxels and have balls around
//! nodes alone; the two together give a ball of radius 4 pitches only 0.6 to 0.8 of its diameter. Here distances are those to
//! the surface itself ([`distance`](super::distance)) and centres lie anywhere.
//!
//! # Method
//! 1. *Ridge*: nodes that the ridges of the distance pass, and for each the largest ball whose centre is in its cell
//!    ([`largest_balls`]).
//! 2. *Thin out*: balls that others nearby of similar radius cover to a fraction of a pitch are dropped.
//! 3. *Paint*: plane by plane, largest first, each node by the first ball that covers it ([`paint`]). Unpainted nodes are bits,
//!    so that a ball costs a few words per row rather than its volume.
//! 4. *Fill*: crescents that no ball covers, next to edges and to the surface, get the largest of their neighbours.
//!
//! # Accuracy
//! A ball of radius 2, 4, 8 or 24 pitches, wherever its centre lies, has its diameter to a thousandth. Rods and slabs have
//! theirs to 0.05 pitches from 6 pitches on; slabs of 2 pitches seem up to 0.4 thicker, since crossings are about a pitch apart
//! and balls dip between them (δ²/2r, see [`distance`](super::distance)). The same effect makes balls that touch only a concave
//! corner, as those in the nodes of strut lattices do, 0.1 to 0.8 pitches too large at any resolution: the nearest crossing is
//! about as far from the corner as rows are from one another. Next to obtuse edges, of more than about 140°, crescents have the
//! thickness of their neighbours.
//!
//! On shapes that are bumpy within a few pitches, single nodes have up to a pitch less than with balls around all nodes, where
//! a dropped ball extended farther than those around it.
//!
//! # Rejected alternatives
//! - Nodes whose distance does not grow by one step away from their own site: on voxels, whose faces have only three
//!   directions, every sixth node passed, most of them next to the surface. With the second test along the slope a quarter of
//!   them are left, and means differ by a thousandth.
//! - Painting balls at their exact size: false ridges next to the surface then painted the gap between a ball and the surface,
//!   with a tenth of the thickness here and there. Hence the margin of a quarter of a pitch in painting.

mod paint;
mod ridge;
mod thin;

pub use paint::paint;
pub use ridge::{largest_balls, largest_balls_between};

use crate::parallel::*;

use super::distance::DistanceField;
use super::{BoundaryCondition, NodeSet};
use crate::bits::Ones;
use crate::cancel::checkpoint;

/// A ball within a phase, in pitches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Its centre, in the cell of its node.
    pub centre: [f32; 3],
    /// Its radius.
    pub radius: f32,
    /// The index of its node, `(z · size[1] + y) · size[0] + x`.
    pub node: u32,
}

/// Computes the local thickness of a phase at each of its nodes, in pitches, and 0 at others: a diameter, never less than twice
/// the distance. Infinite where the field is.
///
/// # Panics
/// If field and nodes are of rasters of different sizes.
pub fn local_thickness(field: &DistanceField, nodes: &NodeSet) -> Vec<f32> {
    thickness_of(&largest_balls(field, nodes), field.values(), nodes, field.edges())
}

/// Computes the same from the largest balls of the phase, and the distances of all nodes.
///
/// # Panics
/// If there is not a distance for each node.
pub fn thickness_of(balls: &[Ball], distances: &[f32], nodes: &NodeSet, edges: BoundaryCondition) -> Vec<f32> {
    assert_eq!(distances.len(), nodes.volume(), "a distance for each node");
    let sizes: Vec<f32> = balls.iter().map(|ball| 2.0 * ball.radius).collect();
    let mut thickness = paint(balls, &sizes, nodes, edges);
    each_word(&mut thickness, nodes, |word, first, thickness| {
        let distances = &distances[first..][..thickness.len()];
        let at_least = |(thickness, &distance): (&mut f32, &f32)| *thickness = thickness.max(2.0 * distance);
        match word {
            // Most words are within the phase or outside.
            u64::MAX => thickness.iter_mut().zip(distances).for_each(at_least),
            _ => Ones(word).map(|bit| bit as usize).for_each(|x| at_least((&mut thickness[x], &distances[x]))),
        }
    });
    thickness
}

/// Turns the distances of all nodes into the radius, for each node of a phase, of the largest ball whose centre is in its cell, in
/// pitches: that of `balls`, or the distance where they have none there; 0 at other nodes.
///
/// # Panics
/// If there is not a distance for each node.
pub fn radii(distances: Vec<f32>, nodes: &NodeSet, balls: &[Ball]) -> Vec<f32> {
    assert_eq!(distances.len(), nodes.volume(), "a distance for each node");
    let mut radii = distances;
    each_word(&mut radii, nodes, |word, _, radii| match word {
        u64::MAX => {}
        0 => radii.fill(0.0),
        _ => (0..).zip(radii).filter(|&(bit, _)| word >> bit & 1 == 0).for_each(|(_, radius)| *radius = 0.0),
    });
    for ball in balls {
        let radius = &mut radii[ball.node as usize];
        *radius = radius.max(ball.radius);
    }
    radii
}

/// Changes a map by the words of a set: calls `change` with each word, the index of its first node, and its part of the map.
fn each_word(map: &mut [f32], nodes: &NodeSet, change: impl Fn(u64, usize, &mut [f32]) + Sync) {
    let [columns, rows, _] = nodes.size();
    map.par_chunks_mut(columns.max(1)).enumerate().with_min_len(16).for_each(|(row, map)| {
        checkpoint();
        let words = nodes.row(row % rows, row / rows).iter().zip(map.chunks_mut(64));
        words.enumerate().for_each(|(at, (&word, part))| change(word, row * columns + 64 * at, part));
    });
}

#[cfg(test)]
mod tests;
