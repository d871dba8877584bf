//! The largest ball that gets from one end of a region to the other.

use super::ends::Ends;
use super::flood::{LEAST, widest};
use super::queue::{LEVELS, Queue};
use super::steps::{MIDDLE, Steps, bits};
use crate::metrics::{Edges, NodeSet};

/// What gets from one end to the other, and where it is narrowest for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percolation {
    /// Of the ball, in pitches; infinite where radii are, since there is no surface.
    pub diameter: f64,
    /// The node of the bottleneck: the first on the way whose room is, to 1/64 of a pitch, that of the narrowest.
    pub node: [usize; 3],
}

/// The largest ball that spans the region: the one of the widest path through `nodes` from one end to the other. Nothing if
/// no path leads there. It is found to less than 1/64 of a pitch in radius, along a path that is there.
///
/// `radii` says how large a ball has room in a node's cell, in pitches, as for [`bottlenecks`](super::bottlenecks), and both
/// ends are open: the faces of the box are not to be walls in them. What `edges` changes is the other faces.
/// [`Edges::Clip`]: balls may reach beyond them. [`Edges::Periodic`]: paths go on at the opposite face, and radii should
/// come from distances that wrap. [`Edges::Border`]: they are walls. Of a box those are put in here, at half a pitch beyond
/// its outermost nodes. Of other regions `radii` say whether the boundary is a wall; if it is, what spans the region is no
/// larger than there is room for at its very ends.
///
/// It takes a byte for each node and 4 for each that waits, in one thread, and ends as soon as the far end is met.
///
/// # Panics
/// As [`bottlenecks`](super::bottlenecks).
pub fn percolation(radii: &[f32], nodes: &NodeSet, ends: &Ends, edges: Edges) -> Option<Percolation> {
    assert_eq!(radii.len(), nodes.volume(), "a radius for each node");
    let steps = Steps::between_ends(nodes, edges, ends.axis());
    let room = Room { radii, walls: walls(ends, edges) };
    let mut ways = Ways { steps: &steps, from: vec![0; radii.len()] };
    // Queued by what got there; that is forgotten in between, for on the way back it is found again.
    let mut queue = Queue::new(widest(radii, nodes.size()));
    for source in ends.nodes_in(nodes, ends.low.clone()) {
        let index = steps.index(source);
        ways.from[index as usize] = MIDDLE as u8 + 1;
        queue.push(room.radius(index, source), index);
    }
    while let Some((so_far, index)) = queue.pop() {
        let node = steps.place(index);
        if ends.high.contains(&node[ends.axis().depth()]) {
            return Some(ways.narrowest(node, &room));
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

fn walls(ends: &Ends, edges: Edges) -> Walls {
    let sides = ends.sides.as_ref().filter(|_| edges == Edges::Border)?;
    let mut walls = sides.clone().map(|side| [side.start as f32 - 0.5, side.end as f32 - 0.5]);
    walls[ends.axis().depth()] = [f32::NEG_INFINITY, f32::INFINITY];
    Some(walls)
}

/// How large a ball has room where.
struct Room<'a> {
    radii: &'a [f32],
    walls: Walls,
}

impl Room<'_> {
    #[inline]
    fn radius(&self, index: u32, node: [usize; 3]) -> f32 {
        let free = self.radii[index as usize];
        let room = self.walls.iter().flatten().zip(node).fold(free, |room, ([low, high], at)| {
            // Half way between two walls there may be no node.
            let (at, half) = (at as f32, (high - low) / 2.0);
            let nearest = (at - low).min(high - at);
            room.min(if half - nearest <= 0.5 { half } else { nearest })
        });
        room.max(LEAST)
    }
}

/// Where the flood came from: of each node that it met, one more than the bit of the step to it.
struct Ways<'a> {
    steps: &'a Steps<'a>,
    from: Vec<u8>,
}

impl Ways<'_> {
    /// The narrowest place on the way to a node. Within the width of a level the flood wanders; where it first met the level
    /// of the bottleneck there was no wider way.
    fn narrowest(&self, end: [usize; 3], room: &Room) -> Percolation {
        let radius = self.back(end, room).map(|(radius, _)| radius).fold(f32::INFINITY, f32::min);
        let as_narrow = self.back(end, room).filter(|&(other, _)| other < radius + 1.0 / LEVELS);
        let (_, node) = as_narrow.last().expect("the narrowest is as narrow");
        Percolation { diameter: 2.0 * f64::from(radius), node }
    }

    /// The way from a node back to where the flood began, with the room there is.
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
