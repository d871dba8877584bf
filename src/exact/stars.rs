//! Corners from which faces of one body cross.
//!
//! Where two faces share a corner and meet beyond it, they do so in a segment that starts there. On a small sphere around such a
//! point, its faces are arcs of a closed curve, its edges are the curve's corners, and the segments are where the curve crosses
//! itself. So the winding number of the body in front of its faces is not one around the point: it changes by one at each segment. Of
//! the edges at the point, those between which no face has a segment from there have the same number; they are a sector. One sector
//! has the number of the point, the others have further ones.

use std::collections::BTreeMap;

use super::bodies::{Bodies, Body};
use super::crossings::order_along;
use super::segments::Segment;
use super::signs::{Vertex, turns_left};

/// A segment from a corner of a face, as it is passed on the face around that corner, counter-clockwise seen from the front.
#[derive(Clone, Copy)]
pub(super) struct Pass {
    pub segment: u32,
    /// The other face of the segment.
    face: u32,
    /// True if the other face is passed from its front to its back.
    pub enters: bool,
}

/// The change of the winding number of a solid from one sector to the next.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    /// The numbers of both sectors.
    pub sectors: [u32; 2],
    pub solid: usize,
    pub change: i32,
}

/// The sectors of all points.
#[derive(Default)]
pub(super) struct Stars {
    /// The segments from a corner of a face, by the face and the corner, in the order in which they are passed.
    passes: BTreeMap<[u32; 2], Vec<Pass>>,
    /// The sectors with numbers of their own, by the point and the other end of an edge.
    sectors: BTreeMap<[u32; 2], u32>,
    /// The points of the sectors with numbers of their own, which follow those of the points.
    points: Vec<u32>,
    turns: Vec<Turn>,
    /// The number of points.
    first: u32,
}

impl Stars {
    pub fn of(segments: &[Segment], bodies: &Bodies) -> Stars {
        let mut stars = Stars { first: bodies.points.len() as u32, ..Stars::default() };
        for (index, segment) in (0..).zip(segments) {
            let Some(point) = [segment.start, segment.end].into_iter().find_map(|end| end.corner(segment, bodies))
            else {
                continue;
            };
            for [own, other] in [segment.faces, [segment.faces[1], segment.faces[0]]] {
                let [_, first, _] = bodies.corners_from(own, point);
                let enters = bodies.plane(other).is_in_front(&bodies.vertex(first));
                let pass = Pass { segment: index, face: other, enters };
                stars.passes.entry([point, own]).or_default().push(pass);
            }
        }
        for (&[point, face], passes) in &mut stars.passes {
            sort_around(passes, face, point, bodies);
        }
        let mut faces: BTreeMap<u32, Vec<u32>> = stars.passes.keys().map(|&[point, _]| (point, Vec::new())).collect();
        let crossed: &[Body] = if faces.is_empty() { &[] } else { &bodies.bodies };
        for body in crossed.iter().filter(|body| body.is_crossed) {
            for face in body.faces.clone() {
                for point in bodies.faces[face as usize] {
                    if let Some(faces) = faces.get_mut(&point) {
                        faces.push(face);
                    }
                }
            }
        }
        for (point, faces) in faces {
            stars.add_sectors(point, &faces, bodies);
        }
        stars
    }

    /// Adds the sectors of a point, given the faces at it, which are one fan.
    fn add_sectors(&mut self, point: u32, faces: &[u32], bodies: &Bodies) {
        let around = around(point, faces.iter().copied(), bodies);
        let change = |face: u32| {
            let passes = self.passes.get(&[point, face])?;
            Some(passes.iter().map(|pass| if pass.enters { 1 } else { -1 }).sum::<i32>())
        };
        // Once around, from behind a face with segments.
        let Some(&(first, _)) = around.values().find(|&&(_, face)| change(face).is_some()) else { return };
        let (mut edge, mut sector, mut turns, mut sectors) = (first, point, Vec::new(), Vec::new());
        let mut points = Vec::new();
        while let Some(&(to, face)) = around.get(&edge) {
            if let Some(change) = change(face) {
                let next = match to == first {
                    true => point,
                    false => {
                        points.push(point);
                        self.first + (self.points.len() + points.len()) as u32 - 1
                    }
                };
                turns.push(Turn { sectors: [sector, next], solid: bodies.solid_of_face(face), change });
                sector = next;
            }
            if to == first {
                break;
            }
            if sector != point {
                sectors.push(([point, to], sector));
            }
            edge = to;
        }
        self.points.extend(points);
        self.turns.extend(turns);
        self.sectors.extend(sectors);
    }

    /// Returns the number of all sectors.
    pub fn count(&self) -> u32 {
        self.first + self.points.len() as u32
    }

    /// Returns the sector of an edge at its first end.
    #[inline]
    pub fn sector(&self, edge: [u32; 2]) -> u32 {
        if self.sectors.is_empty() { edge[0] } else { self.sectors.get(&edge).copied().unwrap_or(edge[0]) }
    }

    /// Returns the point of a sector.
    pub fn point(&self, sector: u32) -> u32 {
        sector.checked_sub(self.first).map_or(sector, |own| self.points[own as usize])
    }

    /// Returns the changes from sectors to others of the same point.
    pub fn turns(&self) -> &[Turn] {
        &self.turns
    }

    /// Returns the segments from a corner of a face, in the order in which they are passed.
    pub fn passes(&self, point: u32, face: u32) -> &[Pass] {
        self.passes.get(&[point, face]).map_or(&[], Vec::as_slice)
    }
}

/// Returns the faces of a fan at a point by the ends of their edges there: of each the first end, the second, and the face.
fn around(point: u32, faces: impl Iterator<Item = u32>, bodies: &Bodies) -> BTreeMap<u32, (u32, u32)> {
    let corners = |face: u32| {
        let [_, from, to] = bodies.corners_from(face, point);
        (from, (to, face))
    };
    faces.map(corners).collect()
}

/// Returns an edge of a body that meets itself, from its lowest point along x, and the body's own winding number in front of the faces
/// at that edge, where it starts.
///
/// All edges at the point go upwards along x, and below is nothing of the body. Seen from beyond, along the point's directions (y / x,
/// z / x), its faces are the sides of a closed polygon, with their fronts to the left. Beside its lowest corner is nothing, too: on the
/// right if the polygon turns left there.
pub(super) fn outermost(own: usize, bodies: &Bodies) -> ([u32; 2], i32) {
    let body = &bodies.bodies[own];
    let at_rest = |point: u32| bodies.points[point as usize].x;
    let least = body.points.clone().map(at_rest).fold(f64::INFINITY, f64::min);
    let points = body.points.clone().filter(|&point| at_rest(point) == least);
    let point = points.min_by_key(|&point| bodies.growth(point, own as u32).x).expect("a body has points");
    let faces = body.faces.clone().filter(|&face| bodies.faces[face as usize].contains(&point));
    let around = around(point, faces, bodies);
    let vertex = |number: u32| Vertex::of(bodies, number, own as u32);
    let is_lower = |one: u32, other: u32| turns_left(&vertex(point), [&vertex(one), &vertex(other)]);
    let lowest = around.keys().copied().reduce(|low, other| if is_lower(low, other) { low } else { other });
    let lowest = lowest.expect("a point has edges");
    let (_, &(_, before)) = around.iter().find(|&(_, &(to, _))| to == lowest).expect("a fan is closed");
    let (after, _) = around[&lowest];
    let is_left_turn = bodies.plane(before).is_in_front(&vertex(after));
    ([point, lowest], if is_left_turn { -1 } else { 0 })
}

/// Sorts the segments from a corner of a face around it.
fn sort_around(passes: &mut [Pass], face: u32, point: u32, bodies: &Bodies) {
    if passes.len() < 2 {
        return;
    }
    let [_, from, to] = bodies.corners_from(face, point);
    // All segments, or their lines, cross the opposite side.
    let ends = [from, to].map(|end| bodies.vertex(end));
    passes.sort_by(|a, b| order_along(ends.each_ref(), [(a.face, a.enters), (b.face, b.enters)], bodies));
}
