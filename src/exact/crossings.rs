//! The crossings of edges with faces of other bodies, sorted along each edge.

use rayon::prelude::*;

use super::bodies::Bodies;
use super::segments::{End, Segment};

/// A crossing of an edge, from its lower point to its higher, with a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crossing {
    pub edge: [u32; 2],
    pub face: u32,
    /// True if the edge passes from the front of the face to its back.
    pub enters: bool,
}

/// All crossings, by edge and along it.
pub(super) struct Crossings {
    list: Vec<Crossing>,
    /// A bit per face that has a crossing on a side.
    is_crossed: Vec<bool>,
}

impl Segment {
    /// Returns the edge of an end, from its lower point to its higher, the face it crosses, and the face whose side it is.
    pub fn edge(&self, end: End, bodies: &Bodies) -> ([u32; 2], u32, u32) {
        let [owner, other] = if end.of_second { [1, 0] } else { [0, 1] }.map(|i: usize| self.faces[i]);
        let face = bodies.faces[owner as usize];
        let (u, v) = (face[usize::from(end.side)], face[(usize::from(end.side) + 1) % 3]);
        ([u.min(v), u.max(v)], other, owner)
    }
}

impl Crossings {
    pub fn of(segments: &[Segment], bodies: &Bodies) -> Crossings {
        let mut is_crossed = vec![false; bodies.faces.len()];
        for segment in segments {
            for end in [segment.start, segment.end] {
                is_crossed[segment.edge(end, bodies).2 as usize] = true;
            }
        }
        let mut list: Vec<Crossing> = segments
            .par_iter()
            .flat_map_iter(|segment| {
                // A side of the first face comes from the back at the start; one of the second goes there.
                [(segment.start, segment.start.of_second), (segment.end, !segment.end.of_second)].map(
                    |(end, side_enters)| {
                        let (edge, face, owner) = segment.edge(end, bodies);
                        let is_upwards = bodies.faces[owner as usize][usize::from(end.side)] == edge[0];
                        Crossing { edge, face, enters: side_enters == is_upwards }
                    },
                )
            })
            .collect();
        // Every face at an edge reports the crossing.
        list.par_sort_unstable_by_key(|crossing| (crossing.edge, crossing.face));
        list.dedup();
        list.par_chunk_by_mut(|a, b| a.edge == b.edge).filter(|group| group.len() > 1).for_each(|group| {
            sort_along(group, bodies);
        });
        Crossings { list, is_crossed }
    }

    /// Returns whether a side of a face has a crossing.
    pub fn is_crossed(&self, face: u32) -> bool {
        self.is_crossed[face as usize]
    }

    /// Returns the crossings of an edge in order.
    pub fn along(&self, edge: [u32; 2]) -> &[Crossing] {
        &self.list[self.range(edge)]
    }

    /// Returns the place of the crossings of an edge among all.
    pub fn range(&self, edge: [u32; 2]) -> std::ops::Range<usize> {
        let start = self.list.partition_point(|crossing| crossing.edge < edge);
        let count = self.list[start..].iter().take_while(|crossing| crossing.edge == edge).count();
        start..start + count
    }

    pub fn list(&self) -> &[Crossing] {
        &self.list
    }
}

/// Sorts the crossings of one edge from its lower point to its higher.
fn sort_along(group: &mut [Crossing], bodies: &Bodies) {
    let edge = group[0].edge;
    let ends = edge.map(|index| bodies.points[index as usize]);
    let body = bodies.bodies.partition_point(|body| body.points.end <= edge[0]) as u32;
    group.sort_by(|a, b| {
        if a.face == b.face {
            return std::cmp::Ordering::Equal;
        }
        let [through, beside] = [a, b].map(|crossing| bodies.plane(crossing.face));
        // The edge starts in front of a face that it enters. The crossing with `a` comes first if it lies on the side of `b`
        // where the edge starts.
        match beside.has_crossing_in_front(ends, body, &through, a.enters) == b.enters {
            true => std::cmp::Ordering::Less,
            false => std::cmp::Ordering::Greater,
        }
    });
}
