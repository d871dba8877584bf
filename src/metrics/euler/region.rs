//! The topology of a solid within a region, and the region's contribution to its characteristic.

use super::{Betti, characteristic};
use crate::bits::ones;
use crate::metrics::components::Connectivity;
use crate::metrics::{BoundaryCondition, NodeSet, Region};

/// χ, Betti numbers and connectivity density of the solid within a region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Topology {
    /// χ of the nodes of the solid within the region.
    pub characteristic: i64,
    /// β₀, β₁ and β₂ of the same nodes.
    pub betti: Betti,
    /// Δχ: the region's contribution to the χ of a structure that continues beyond it; see [`contribution`].
    pub contribution: f64,
    /// Conn.D = (1 − Δχ) / TV, in 1 over cubic world units.
    pub connectivity_density: f64,
}

impl Topology {
    /// Computes the topology of the nodes of a solid; those outside the region do not count. [`BoundaryCondition::Periodic`] is
    /// for a region that is the whole raster.
    ///
    /// # Panics
    /// If the nodes are not of the region's raster.
    pub fn of(solid: &NodeSet, region: &Region, edges: BoundaryCondition) -> Topology {
        let solid = solid.and(region.nodes());
        let characteristic = characteristic(&solid, Connectivity::All, edges);
        let contribution = contribution(&solid, region, edges);
        Topology {
            characteristic,
            betti: Betti::of(&solid, Connectivity::All, edges),
            contribution,
            connectivity_density: (1.0 - contribution) / region.volume(),
        }
    }
}

/// Returns Δχ: a region's contribution to the Euler characteristic of a structure of which it shows a part. `solid` holds nodes
/// of the region, with 26 neighbours.
///
/// For a box: χ minus half the χ of each face's part, plus a quarter of that of each edge, minus an eighth of that of each
/// corner, so that the interior counts 1, a face ½, an edge ¼ and a corner ⅛ (Odgaard and Gundersen 1993; BoneJ does the same).
/// For another region: χ minus half the χ of the part in its boundary, made of the faces of nodes' cubes. For a periodic cell:
/// χ.
pub fn contribution(solid: &NodeSet, region: &Region, edges: BoundaryCondition) -> f64 {
    match (edges, region.is_box()) {
        (BoundaryCondition::Periodic, _) => characteristic(solid, Connectivity::All, edges) as f64,
        (_, true) => of_box(solid, nodes_of_box(region.nodes())),
        (_, false) => of_shape(solid, region.nodes()),
    }
}

/// The first node of a box and the one after its last, along x, y and z.
type NodeBox = [[usize; 2]; 3];

/// Returns the box that nodes fill; `None` for no nodes.
fn nodes_of_box(nodes: &NodeSet) -> Option<NodeBox> {
    let [_, rows, planes] = nodes.size();
    let has = |y: usize, z: usize| nodes.row(y, z).iter().any(|&word| word != 0);
    let z = (0..planes).find(|&z| (0..rows).any(|y| has(y, z)))?;
    let y = (0..rows).find(|&y| has(y, z))?;
    let first = ones(nodes.row(y, z)).next()?;
    let columns: usize = nodes.row(y, z).iter().map(|word| word.count_ones() as usize).sum();
    let end = |from: usize, most: usize, has: &dyn Fn(usize) -> bool| (from..most).find(|&i| !has(i)).unwrap_or(most);
    Some([[first, first + columns], [y, end(y, rows, &|y| has(y, z))], [z, end(z, planes, &|z| has(y, z))]])
}

fn of_box(solid: &NodeSet, nodes: Option<NodeBox>) -> f64 {
    let Some(nodes) = nodes else { return 0.0 };
    // Along each axis the whole range, or its lowest or its highest layer. A layer of cubes has the χ of its part in the face
    // beyond.
    let choices = nodes.map(|[low, end]| [[low, end], [low, low + 1], [end - 1, end]]);
    let mut eighths = 0;
    for choice in 0..27 {
        let taken = [choice % 3, choice / 3 % 3, choice / 9];
        let part = std::array::from_fn(|axis| choices[axis][taken[axis]]);
        let faces = taken.iter().filter(|&&which| which != 0).count();
        let weight = [8, -4, 2, -1][faces];
        eighths += weight * characteristic(&cut(solid, part), Connectivity::All, BoundaryCondition::Clip);
    }
    eighths as f64 / 8.0
}

/// Returns the nodes of a box within the raster, as a raster of their own.
fn cut(set: &NodeSet, part: NodeBox) -> NodeSet {
    let size = part.map(|[low, end]| end - low);
    if size == set.size() {
        return set.clone();
    }
    let at = part.map(|[low, _]| low);
    NodeSet::from_fn(size, |node| set.contains(std::array::from_fn(|axis| at[axis] + node[axis])))
}

fn of_shape(solid: &NodeSet, region: &NodeSet) -> f64 {
    // With one layer more on every side, the outside of the region closes around it.
    let [solid, region] = [solid, region].map(widened);
    let outside = NodeSet::full(region.size()).minus(&region);
    let of = |set: &NodeSet| characteristic(set, Connectivity::All, BoundaryCondition::Clip);
    // The χ of the intersection of two unions of closed cubes is the sum of their χ minus that of their union.
    let whole = of(&solid);
    let shared = whole + of(&outside) - of(&outside.or(&solid));
    whole as f64 - 0.5 * shared as f64
}

/// Returns the same nodes in a raster with one layer more on every side.
fn widened(set: &NodeSet) -> NodeSet {
    let [_, rows, planes] = set.size();
    let mut wide = NodeSet::empty(set.size().map(|n| n + 2));
    for z in 0..planes {
        for y in 0..rows {
            let mut carry = 0;
            for (to, &word) in wide.row_mut(y + 1, z + 1).iter_mut().zip(set.row(y, z).iter().chain([&0])) {
                *to = word << 1 | carry;
                carry = word >> 63;
            }
        }
    }
    wide
}
