//! The points in which three faces of different bodies meet.

use glam::DVec3;
use rayon::prelude::*;

use super::bodies::Bodies;
use super::segments::{End, Segment};
use super::signs::{Located, Plane, common_point, common_point_is_in_front};
use crate::box_tree::Box32;

/// A point at which a segment crosses a third face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triple {
    pub face: u32,
    /// True if the segment, along its direction, passes from the front of the face to its back.
    pub enters: bool,
    pub position: Located,
}

/// A segment with the planes of its faces and the positions of its ends.
pub(super) struct Placed {
    pub segment: Segment,
    pub planes: [Plane; 2],
    pub ends: [Located; 2],
}

/// The segments on each face.
pub(super) struct OnFaces {
    /// Faces with the indices of their segments, sorted.
    list: Vec<(u32, u32)>,
    extents: Vec<Box32>,
}

impl OnFaces {
    /// Sorts segments by their faces.
    pub fn of(segments: &[Segment], place: &(impl Fn(&Segment) -> Placed + Sync)) -> OnFaces {
        let mut list: Vec<(u32, u32)> =
            (0..).zip(segments).flat_map(|(i, segment)| segment.faces.map(|face| (face, i))).collect();
        list.par_sort_unstable();
        // Positions are rounded; the boxes are wide enough for a crossing that lies at an end.
        let extent = |segment| Box32::around(place(segment).ends.into_iter().flat_map(|end| widened(end.at)));
        let extents = segments.par_iter().map(extent).collect();
        OnFaces { list, extents }
    }

    fn of_face(&self, face: u32) -> impl Iterator<Item = u32> {
        let start = self.list.partition_point(|&(other, _)| other < face);
        self.list[start..].iter().take_while(move |&&(other, _)| other == face).map(|&(_, segment)| segment)
    }

    /// Returns the crossings of a segment with third faces, in order.
    pub fn triples(
        &self,
        index: u32,
        segments: &[Segment],
        bodies: &Bodies,
        place: &impl Fn(&Segment) -> Placed,
    ) -> Vec<Triple> {
        let own = &segments[index as usize];
        let [f, g] = own.faces;
        let second_body = bodies.body_of_face(g);
        let mut found: Vec<(Plane, Triple)> = Vec::new();
        let mut placed = None;
        for other in self.of_face(f) {
            if other == index || !self.extents[other as usize].touches(&self.extents[index as usize]) {
                continue;
            }
            let beside = &segments[other as usize];
            let third = if beside.faces[0] == f { beside.faces[1] } else { beside.faces[0] };
            if bodies.body_of_face(third) == second_body {
                continue;
            }
            let placed = placed.get_or_insert_with(|| place(own));
            found.extend(crossing(placed, &place(beside), f, third, bodies));
        }
        found.sort_by(|(a, first), (b, second)| {
            if first.face == second.face {
                return std::cmp::Ordering::Equal;
            }
            // The segment starts in front of a face that it enters.
            let planes = &placed.as_ref().expect("two crossings were found").planes;
            match common_point_is_in_front([&planes[0], &planes[1], a], b) == second.enters {
                true => std::cmp::Ordering::Less,
                false => std::cmp::Ordering::Greater,
            }
        });
        found.into_iter().map(|(_, triple)| triple).collect()
    }
}

/// Returns the corners of a box around a rounded point: a millionth of its coordinates wide.
fn widened(point: DVec3) -> [DVec3; 2] {
    let margin = DVec3::splat(1e-6 * point.abs().max_element());
    [point - margin, point + margin]
}

/// Returns the point at which two segments on face `f` cross, on the first, with the plane of the third face.
fn crossing(own: &Placed, beside: &Placed, f: u32, third: u32, bodies: &Bodies) -> Option<(Plane, Triple)> {
    let second = if own.segment.faces[0] == f { own.planes[1] } else { own.planes[0] };
    let plane = if beside.segment.faces[0] == f { beside.planes[1] } else { beside.planes[0] };
    let sides = |placed: &Placed, of: &Plane| {
        [placed.segment.start, placed.segment.end].map(|end| end_is_in_front(placed, end, of, bodies))
    };
    let [starts_in_front, ends_in_front] = sides(own, &plane);
    if starts_in_front == ends_in_front {
        return None;
    }
    let [a, b] = sides(beside, &second);
    if a == b {
        return None;
    }
    // The planes in the order of the faces, so that all three segments round the point in the same way.
    let [first, other] = if own.segment.faces[0] == f { [0, 1] } else { [1, 0] };
    let mut numbered = [(f, own.planes[first]), (own.segment.faces[other], second), (third, plane)];
    numbered.sort_by_key(|&(face, _)| face);
    let position = common_point([&numbered[0].1, &numbered[1].1, &numbered[2].1])?;
    Some((plane, Triple { face: third, enters: starts_in_front, position }))
}

/// Returns whether an end of a segment lies in front of the face of a third body.
fn end_is_in_front(placed: &Placed, end: End, of: &Plane, bodies: &Bodies) -> bool {
    let (edge, _, _) = placed.segment.edge(end, bodies);
    let through = &placed.planes[usize::from(!end.of_second)];
    let body = placed.planes[usize::from(end.of_second)].body;
    let ends = edge.map(|index| bodies.points[index as usize]);
    of.has_crossing_in_front(ends, body, through, through.is_in_front(ends[0], body))
}
