//! The points in which three faces meet.

use std::cell::OnceCell;

use crate::parallel::*;
use glam::DVec3;

use super::bodies::Bodies;
use super::common::CommonLine;
use super::crossings::{Crossings, Side};
use super::segments::{End, Segment};
use super::signs::{Located, Plane};
use crate::box_tree::Box32;
use crate::cancel::checkpoint;

/// A point at which a segment crosses a third face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triple {
    pub face: u32,
    /// True if the segment, along its direction, passes from the front of the face to its back.
    pub enters: bool,
    /// The number of the point, which is the same on all three segments.
    pub point: u32,
}

/// The points in which three faces meet, along each segment.
#[derive(Default)]
pub(super) struct Triples {
    list: Vec<Triple>,
    /// The place in the list after the last one of each segment.
    ends: Vec<u32>,
    positions: Vec<Located>,
}

impl Triples {
    pub fn of(segments: &[Segment], crossings: &Crossings, bodies: &Bodies) -> Triples {
        let on_faces = OnFaces { bodies, segments, crossings, list: listed(segments), extents: Vec::new() };
        let extents = (0..segments.len() as u32).into_par_iter().map(|segment| on_faces.extent(segment)).collect();
        let on_faces = OnFaces { extents, ..on_faces };
        let found: Vec<Vec<Found>> = (0..segments.len() as u32)
            .into_par_iter()
            .with_min_len(256)
            .map(|segment| {
                checkpoint();
                on_faces.along(segment)
            })
            .collect();
        let key = |segment: &Segment, found: &Found| {
            let mut faces = [segment.faces[0], segment.faces[1], found.face];
            faces.sort_unstable();
            faces
        };
        let all =
            || segments.iter().zip(&found).flat_map(|(segment, found)| found.iter().map(move |found| (segment, found)));
        let mut points: Vec<([u32; 3], Located)> =
            all().map(|(segment, found)| (key(segment, found), found.position)).collect();
        points.par_sort_unstable_by_key(|(faces, _)| *faces);
        points.dedup_by_key(|(faces, _)| *faces);
        let number =
            |segment: &Segment, found: &Found| points.partition_point(|(faces, _)| *faces < key(segment, found)) as u32;
        let list = all().map(|(segment, found)| Triple {
            face: found.face,
            enters: found.enters,
            point: number(segment, found),
        });
        let mut end = 0;
        let ends = found.iter().map(|found| {
            end += found.len() as u32;
            end
        });
        Triples { list: list.collect(), ends: ends.collect(), positions: points.iter().map(|point| point.1).collect() }
    }

    /// Returns the points on a segment, in order.
    pub fn of_segment(&self, segment: u32) -> &[Triple] {
        let end =
            |segment: Option<u32>| segment.and_then(|segment| self.ends.get(segment as usize)).map_or(0, |&end| end);
        &self.list[end(segment.checked_sub(1)) as usize..end(Some(segment)) as usize]
    }

    /// Returns the positions of the points, by their numbers.
    pub fn positions(&self) -> &[Located] {
        &self.positions
    }
}

/// A crossing of a segment with a third face.
struct Found<'b> {
    plane: Plane<'b>,
    face: u32,
    enters: bool,
    position: Located,
}

/// The segments on each face.
struct OnFaces<'a> {
    bodies: &'a Bodies,
    segments: &'a [Segment],
    crossings: &'a Crossings,
    /// Faces with the indices of their segments, sorted.
    list: Vec<(u32, u32)>,
    extents: Vec<Box32>,
}

/// Returns the faces with the indices of their segments, sorted.
fn listed(segments: &[Segment]) -> Vec<(u32, u32)> {
    let mut list: Vec<(u32, u32)> =
        (0..).zip(segments).flat_map(|(i, segment)| segment.faces.map(|face| (face, i))).collect();
    list.par_sort_unstable();
    list
}

impl OnFaces<'_> {
    /// Returns a box around a segment. Positions are rounded; the box is wide enough for a crossing that lies at an end.
    fn extent(&self, segment: u32) -> Box32 {
        let points = &self.bodies.points;
        let position = |vertex: usize| match vertex.checked_sub(points.len()) {
            Some(place) => self.crossings.positions()[place].at,
            None => points[vertex],
        };
        let ends = self.crossings.ends_of(segment).map(|vertex| position(vertex as usize));
        Box32::around(ends.into_iter().flat_map(widened))
    }

    fn of_face(&self, face: u32) -> impl Iterator<Item = u32> {
        let start = self.list.partition_point(|&(other, _)| other < face);
        self.list[start..].iter().take_while(move |&&(other, _)| other == face).map(|&(_, segment)| segment)
    }

    /// Returns whether two faces of one body may meet on a third: they share no corner, or meet beyond it and it is not on the third.
    fn may_meet_on(&self, third: u32, [one, other]: [u32; 2]) -> bool {
        let Some(corner) = self.bodies.shared_corners(one, other).next() else { return true };
        let meets = |segment: u32| self.segments[segment as usize].faces.contains(&other);
        self.of_face(one).any(meets) && !self.bodies.faces[third as usize].contains(&corner)
    }

    fn placed(&self, segment: &Segment) -> Placed<'_> {
        Placed { segment: *segment, planes: segment.faces.map(|face| self.bodies.plane(face)) }
    }

    /// Returns the crossings of a segment with third faces, in order.
    fn along(&self, index: u32) -> Vec<Found<'_>> {
        let bodies = self.bodies;
        let own = &self.segments[index as usize];
        let [f, g] = own.faces;
        let second_body = bodies.body_of_face(g);
        let mut found: Vec<Found<'_>> = Vec::new();
        let (placed, line) = (OnceCell::new(), OnceCell::new());
        for other in self.of_face(f) {
            if other == index || !self.extents[other as usize].touches(&self.extents[index as usize]) {
                continue;
            }
            let beside = &self.segments[other as usize];
            let third = if beside.faces[0] == f { beside.faces[1] } else { beside.faces[0] };
            let is_of_second = bodies.body_of_face(third) == second_body;
            if is_of_second && !(bodies.bodies[second_body as usize].is_crossed && self.may_meet_on(f, [g, third])) {
                continue;
            }
            let placed = placed.get_or_init(|| self.placed(own));
            let Some((plane, enters)) = crossed(placed, &self.placed(beside), f, bodies) else { continue };
            let line = line.get_or_init(|| CommonLine::of(placed.planes.each_ref()));
            let position = line.crossing(&plane);
            found.extend(position.map(|position| Found { plane, face: third, enters, position }));
        }
        found.sort_by(|a, b| {
            if a.face == b.face {
                return std::cmp::Ordering::Equal;
            }
            // The segment starts in front of a face that it enters.
            let line = line.get().expect("two crossings were found");
            match line.crossing_is_in_front(&a.plane, &a.position, &b.plane) == b.enters {
                true => std::cmp::Ordering::Less,
                false => std::cmp::Ordering::Greater,
            }
        });
        found
    }
}

/// A segment with the planes of its faces.
struct Placed<'b> {
    segment: Segment,
    planes: [Plane<'b>; 2],
}

/// Returns the corners of a box around a rounded point: a millionth of its coordinates wide.
fn widened(point: DVec3) -> [DVec3; 2] {
    let margin = DVec3::splat(1e-6 * point.abs().max_element());
    [point - margin, point + margin]
}

/// Returns the plane of the third face if two segments on face `f` cross, and whether the first one enters there.
fn crossed<'b>(own: &Placed<'b>, beside: &Placed<'b>, f: u32, bodies: &Bodies) -> Option<(Plane<'b>, bool)> {
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
    (a != b).then_some((plane, starts_in_front))
}

/// Returns whether an end of a segment lies in front of the face of a third body.
fn end_is_in_front(placed: &Placed, end: End, of: &Plane, bodies: &Bodies) -> bool {
    let through = |of_second: bool| &placed.planes[usize::from(!of_second)];
    match (end, placed.segment.side(end, bodies)) {
        (End::Side { of_second, .. }, Some(Side { edge, .. })) => {
            let (through, ends) = (through(of_second), bodies.ends(edge));
            of.has_crossing_in_front(ends.each_ref(), through, through.is_in_front(&ends[0]))
        }
        (end, _) => end.corner(&placed.segment, bodies).is_some_and(|corner| of.is_in_front(&bodies.vertex(corner))),
    }
}
