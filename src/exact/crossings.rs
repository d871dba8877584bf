//! The crossings of edges with faces of other bodies, sorted along each edge.

use std::ops::Range;

use crate::parallel::*;

use super::bodies::Bodies;
use super::segments::{End, Segment};
use super::signs::Located;

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
    /// For each point, the place of the first crossing of edges that have it as their lower point or come later; and the end.
    starts: Vec<u32>,
    positions: Vec<Located>,
    /// The places in the list of the start and the end of each segment.
    ends: Vec<[u32; 2]>,
    /// A bit per face that has a crossing on a side.
    is_crossed: Vec<bool>,
}

/// A crossing, and where the ends of segments that lie there are listed.
#[derive(Clone)]
struct Group {
    crossing: Crossing,
    ends: Range<usize>,
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
        // Every face at an edge reports the crossing.
        let mut reports: Vec<(Crossing, u32)> = segments
            .par_iter()
            .zip(0..segments.len() as u32)
            .flat_map_iter(|(segment, index)| {
                // A side of the first face comes from the back at the start; one of the second goes there.
                let (start, end) = (segment.start, segment.end);
                [(start, start.of_second, 2 * index), (end, !end.of_second, 2 * index + 1)].map(
                    |(end, side_enters, number)| {
                        let (edge, face, owner) = segment.edge(end, bodies);
                        let is_upwards = bodies.faces[owner as usize][usize::from(end.side)] == edge[0];
                        (Crossing { edge, face, enters: side_enters == is_upwards }, number)
                    },
                )
            })
            .collect();
        reports.par_sort_unstable_by_key(|(crossing, number)| (crossing.edge, crossing.face, *number));
        let mut end = 0;
        let mut groups: Vec<Group> = reports
            .chunk_by(|(a, _), (b, _)| a == b)
            .map(|same| {
                end += same.len();
                Group { crossing: same[0].0, ends: end - same.len()..end }
            })
            .collect();
        groups
            .par_chunk_by_mut(|a, b| a.crossing.edge == b.crossing.edge)
            .filter(|group| group.len() > 1)
            .for_each(|group| sort_along(group, bodies));
        let mut ends = vec![[0; 2]; segments.len()];
        for (place, group) in (0..).zip(&groups) {
            for &(_, number) in &reports[group.ends.clone()] {
                ends[number as usize / 2][number as usize % 2] = place;
            }
        }
        let list: Vec<Crossing> = groups.into_iter().map(|group| group.crossing).collect();
        let position =
            |crossing: &Crossing| bodies.plane(crossing.face).crossing(bodies.ends(crossing.edge).each_ref());
        let positions = list.par_iter().map(position).collect();
        let mut starts = vec![0; bodies.points.len() + 1];
        list.iter().for_each(|crossing| starts[crossing.edge[0] as usize + 1] += 1);
        let mut end = 0;
        starts.iter_mut().for_each(|start| {
            end += *start;
            *start = end;
        });
        Crossings { list, starts, positions, ends, is_crossed }
    }

    /// Returns the places of the start and the end of a segment among all crossings.
    pub fn ends_of(&self, segment: u32) -> [u32; 2] {
        self.ends[segment as usize]
    }

    /// Returns the positions of all crossings.
    pub fn positions(&self) -> &[Located] {
        &self.positions
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
    #[inline]
    pub fn range(&self, edge: [u32; 2]) -> Range<usize> {
        let [lower, upper] = edge;
        let of_point = self.starts[lower as usize] as usize..self.starts[lower as usize + 1] as usize;
        let start = of_point.start + self.list[of_point].partition_point(|crossing| crossing.edge[1] < upper);
        let count = self.list[start..].iter().take_while(|crossing| crossing.edge == edge).count();
        start..start + count
    }

    pub fn list(&self) -> &[Crossing] {
        &self.list
    }
}

/// Sorts the crossings of one edge from its lower point to its higher.
fn sort_along(group: &mut [Group], bodies: &Bodies) {
    let ends = bodies.ends(group[0].crossing.edge);
    group.sort_by(|a, b| {
        let [a, b] = [a, b].map(|group| group.crossing);
        if a.face == b.face {
            return std::cmp::Ordering::Equal;
        }
        let [through, beside] = [a, b].map(|crossing| bodies.plane(crossing.face));
        // The edge starts in front of a face that it enters. The crossing with `a` comes first if it lies on the side of `b`
        // where the edge starts.
        match beside.has_crossing_in_front(ends.each_ref(), &through, a.enters) == b.enters {
            true => std::cmp::Ordering::Less,
            false => std::cmp::Ordering::Greater,
        }
    });
}
