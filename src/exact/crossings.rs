//! The crossings of edges with faces, sorted along each edge.

use std::cmp::Ordering;
use std::ops::Range;

use crate::parallel::*;

use super::bodies::Bodies;
use super::segments::{End, Segment};
use super::signs::{Located, Vertex};

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
    /// The vertices at the start and the end of each segment: points, and after these the places in the list.
    ends: Vec<[u32; 2]>,
    /// A bit per face whose outline is met: that has a crossing on a side, or a segment from a corner.
    is_crossed: Vec<bool>,
}

/// A crossing, and where the ends of segments that lie there are listed.
#[derive(Clone)]
struct Group {
    crossing: Crossing,
    ends: Range<usize>,
}

/// The side of a face that crosses another at the end of a segment.
pub(super) struct Side {
    /// The ends, the lower point first.
    pub edge: [u32; 2],
    /// The face that is crossed.
    pub crossed: u32,
    /// The face whose side it is.
    pub owner: u32,
}

impl Segment {
    /// Returns the side at an end, unless that is a corner.
    pub fn side(&self, end: End, bodies: &Bodies) -> Option<Side> {
        let End::Side { side, of_second } = end else { return None };
        let [owner, crossed] = if of_second { [1, 0] } else { [0, 1] }.map(|i: usize| self.faces[i]);
        let face = bodies.faces[owner as usize];
        let (u, v) = (face[usize::from(side)], face[(usize::from(side) + 1) % 3]);
        Some(Side { edge: [u.min(v), u.max(v)], crossed, owner })
    }
}

impl End {
    /// Returns the point of an end of a segment that is a corner of both faces.
    pub fn corner(self, segment: &Segment, bodies: &Bodies) -> Option<u32> {
        match self {
            End::Corner { corner } => Some(bodies.faces[segment.faces[0] as usize][usize::from(corner)]),
            End::Side { .. } => None,
        }
    }
}

impl Crossings {
    pub fn of(segments: &[Segment], bodies: &Bodies) -> Crossings {
        let mut is_crossed = vec![false; bodies.faces.len()];
        for segment in segments {
            for end in [segment.start, segment.end] {
                match segment.side(end, bodies) {
                    Some(side) => is_crossed[side.owner as usize] = true,
                    None => segment.faces.into_iter().for_each(|face| is_crossed[face as usize] = true),
                }
            }
        }
        // Every face at an edge reports the crossing.
        let mut reports: Vec<(Crossing, u32)> = segments
            .par_iter()
            .zip(0..segments.len() as u32)
            .flat_map_iter(|(segment, index)| {
                // A side of the first face comes from the back at the start; one of the second goes there.
                [(segment.start, true, 2 * index), (segment.end, false, 2 * index + 1)].into_iter().filter_map(
                    |(end, is_start, number)| {
                        let End::Side { side, of_second } = end else { return None };
                        let Side { edge, crossed, owner } = segment.side(end, bodies)?;
                        let is_upwards = bodies.faces[owner as usize][usize::from(side)] == edge[0];
                        let enters = (of_second == is_start) == is_upwards;
                        Some((Crossing { edge, face: crossed, enters }, number))
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
        let corners =
            |segment: &Segment| [segment.start, segment.end].map(|end| end.corner(segment, bodies).unwrap_or(0));
        let mut ends: Vec<[u32; 2]> = segments.iter().map(corners).collect();
        for (vertex, group) in (bodies.points.len() as u32..).zip(&groups) {
            for &(_, number) in &reports[group.ends.clone()] {
                ends[number as usize / 2][number as usize % 2] = vertex;
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

    /// Returns the vertices at the start and the end of a segment: points, or crossings, whose numbers follow those of the points.
    pub fn ends_of(&self, segment: u32) -> [u32; 2] {
        self.ends[segment as usize]
    }

    /// Returns the positions of all crossings.
    pub fn positions(&self) -> &[Located] {
        &self.positions
    }

    /// Returns whether a side of a face has a crossing, or a corner a segment.
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

/// Returns the order in which the line of an edge crosses the planes of two faces: of each the face, and whether the edge passes from its
/// front to its back.
pub(super) fn order_along(edge: [&Vertex; 2], [a, b]: [(u32, bool); 2], bodies: &Bodies) -> Ordering {
    let ((of_a, a_enters), (of_b, b_enters)) = (a, b);
    if of_a == of_b {
        return Ordering::Equal;
    }
    // The edge starts in front of a face that it enters. The crossing with `a` comes first if it lies on the side of `b` where the
    // edge starts.
    match bodies.plane(of_b).has_crossing_in_front(edge, &bodies.plane(of_a), a_enters) == b_enters {
        true => Ordering::Less,
        false => Ordering::Greater,
    }
}

/// Sorts the crossings of one edge from its lower point to its higher.
fn sort_along(group: &mut [Group], bodies: &Bodies) {
    let ends = bodies.ends(group[0].crossing.edge);
    let crossed = |group: &Group| (group.crossing.face, group.crossing.enters);
    group.sort_by(|a, b| order_along(ends.each_ref(), [crossed(a), crossed(b)], bodies));
}
