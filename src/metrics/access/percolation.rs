//! The largest ball that passes from one end of a region to the other.

use super::ends::Ends;
use super::flood::widest;
use super::queue::{LEVELS, Queue};
use super::steps::{LEAST, MIDDLE, Steps, bits};
use crate::cancel::checkpoint;
use crate::metrics::{BoundaryCondition, NodeSet};

/// The largest ball that passes from one end to the other, and its bottleneck.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percolation {
    /// The diameter of the ball, in pitches; infinite where radii are, since there is no surface.
    pub diameter: f64,
    /// The node of the bottleneck: the first on the path whose radius is, to 1/64 of a pitch, the least.
    pub node: [usize; 3],
}

/// Finds the largest ball that spans the region: the one of the widest path through `nodes` from one end to the other. `None`
/// if no path leads there. Its radius is accurate to less than 1/64 of a pitch, along an actual path.
///
/// `radii` holds the radius of the largest ball centred in each node's cell, in pitches, as for
/// [`bottlenecks`](super::bottlenecks), and both ends are open: they must not count the faces of the box as walls. `edges`
/// determines the other faces. [`BoundaryCondition::Clip`]: balls may extend beyond them. [`BoundaryCondition::Periodic`]:
/// paths continue at the opposite face, and radii should come from distances that wrap. [`BoundaryCondition::Border`]: they are
/// walls. For a box these are added here, at half a pitch beyond its outermost nodes. For other regions `radii` determine
/// whether the boundary is a wall; if it is, the spanning ball is limited by the clearance at the very ends.
///
/// Needs a byte for each node and 4 for each waiting one, in one thread, and ends as soon as the far end is met.
///
/// # Panics
/// If there is not a radius for each node, or there are 2³² nodes or more.
pub fn percolation(radii: &[f32], nodes: &NodeSet, ends: &Ends, edges: BoundaryCondition) -> Option<Percolation> {
    assert_eq!(radii.len(), nodes.volume(), "a radius for each node");
    let walls = walls(ends, edges);
    let radius = |index: u32, node: [usize; 3]| {
        let free = radii[index as usize];
        walls.iter().flatten().zip(node).fold(free, |room, ([low, high], at)| {
            // Half way between two walls there may be no node.
            let (at, half) = (at as f32, (high - low) / 2.0);
            let nearest = (at - low).min(high - at);
            room.min(if half - nearest <= 0.5 { half } else { nearest })
        })
    };
    flood(nodes, ends, edges, &Room { widest: widest(radii, nodes.size()), radius: &radius })
}

/// Finds the largest ball that spans a box whose faces around the axis are walls, as [`percolation`] does with
/// [`BoundaryCondition::Border`], but from balls that were found between these walls, too. Near the ends a ball may reach outside, as
/// far as the distance to the walls around. `free` holds the radii of balls that may reach beyond all faces, and `within` those of
/// balls that lie within all; `bounds` are the lower and the upper corner of the box in pitches, node i at i.
pub(crate) fn percolation_between_walls(
    free: &[f32],
    within: &[f32],
    nodes: &NodeSet,
    ends: &Ends,
    bounds: [[f64; 3]; 2],
) -> Option<Percolation> {
    assert!([free, within].iter().all(|radii| radii.len() == nodes.volume()), "a radius for each node");
    let [low, high] = bounds;
    let to_face = |axis: usize, at: usize| (at as f64 - low[axis]).min(high[axis] - at as f64) as f32;
    let Ends { axis, .. } = ends;
    let radius = |index: u32, node: [usize; 3]| {
        let (free, within) = (free[index as usize], within[index as usize]);
        if to_face(axis.depth(), node[axis.depth()]) > free {
            return within;
        }
        let walls = [axis.column(), axis.row()].map(|across| to_face(across, node[across]));
        within.max(free.min(walls[0]).min(walls[1]))
    };
    let widest = widest(free, nodes.size()).max(widest(within, nodes.size()));
    flood(nodes, ends, BoundaryCondition::Clip, &Room { widest, radius: &radius })
}

/// Floods from one end, from the widest node that it met, until it meets the other.
fn flood(nodes: &NodeSet, ends: &Ends, edges: BoundaryCondition, room: &Room) -> Option<Percolation> {
    let steps = Steps::between_ends(nodes, edges, ends.axis());
    let mut ways = Ways { steps: &steps, from: vec![0; nodes.volume()] };
    // Queued by bottleneck; this is not stored, since the way back recomputes it.
    let mut queue = Queue::new(room.widest);
    for source in ends.nodes_in(nodes, ends.low.clone()) {
        let index = steps.index(source);
        ways.from[index as usize] = MIDDLE as u8 + 1;
        queue.push(room.radius(index, source), index);
    }
    while let Some((so_far, index)) = queue.pop() {
        checkpoint();
        let node = steps.place(index);
        if ends.high.contains(&node[ends.axis().depth()]) {
            return Some(ways.narrowest(node, room));
        }
        for bit in bits(steps.from(node)) {
            let neighbour = steps.neighbour(node, bit);
            let next = steps.index(neighbour);
            let from = &mut ways.from[next as usize];
            if *from == 0 {
                *from = bit as u8 + 1;
                queue.push(so_far.min(room.radius(next, neighbour)), next);
            }
        }
    }
    None
}

/// The planes between which balls must lie, in pitches: lower and upper along each axis.
type Walls = Option<[[f32; 2]; 3]>;

fn walls(ends: &Ends, edges: BoundaryCondition) -> Walls {
    let sides = ends.sides.as_ref().filter(|_| edges == BoundaryCondition::Border)?;
    let mut walls = sides.clone().map(|side| [side.start as f32 - 0.5, side.end as f32 - 0.5]);
    walls[ends.axis().depth()] = [f32::NEG_INFINITY, f32::INFINITY];
    Some(walls)
}

/// The radius of the largest ball at each node, by its number and place.
struct Room<'a> {
    /// An upper bound of them all.
    widest: f32,
    radius: &'a dyn Fn(u32, [usize; 3]) -> f32,
}

impl Room<'_> {
    fn radius(&self, index: u32, node: [usize; 3]) -> f32 {
        (self.radius)(index, node).max(LEAST)
    }
}

/// The predecessor of each node that the flood met, as one more than the bit of the step to it.
struct Ways<'a> {
    steps: &'a Steps<'a>,
    from: Vec<u8>,
}

impl Ways<'_> {
    /// Returns the narrowest point on the path to a node. Within the width of a level the flood wanders; where it first met the
    /// level of the bottleneck there was no wider path.
    fn narrowest(&self, end: [usize; 3], room: &Room) -> Percolation {
        let radius = self.back(end, room).map(|(radius, _)| radius).fold(f32::INFINITY, f32::min);
        let as_narrow = self.back(end, room).filter(|&(other, _)| other < radius + 1.0 / LEVELS);
        let (_, node) = as_narrow.last().expect("the narrowest is as narrow");
        Percolation { diameter: 2.0 * f64::from(radius), node }
    }

    /// Returns the path from a node back to where the flood began, with the radii on it.
    fn back(&self, end: [usize; 3], room: &Room) -> impl Iterator<Item = (f32, [usize; 3])> {
        let mut next = Some(end);
        std::iter::from_fn(move || {
            let node = next?;
            let index = self.steps.index(node);
            let bit = u32::from(self.from[index as usize]) - 1;
            next = (bit != MIDDLE).then(|| self.steps.neighbour(node, 2 * MIDDLE - bit));
            Some((room.radius(index, node), node))
        })
    }
}
