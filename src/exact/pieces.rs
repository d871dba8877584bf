//! The pieces of outline on the faces: parts of sides and of segments, and whether the result has a surface beside them.
//!
//! The vertices of the result are numbered by what meets there: first the points, then the crossings of edges with faces, then
//! the points in which three faces meet. So faces that share a vertex know it by the same number, whatever its position is
//! rounded to.

use super::Rule;
use super::bodies::{Bodies, Body};
use super::crossings::{Crossings, Side};
use super::numbers::Numbers;
use super::segments::Segment;
use super::signs::Located;
use super::triple::Triples;
use super::windings::Windings;
use crate::parallel::*;

/// The surface of the result on one side of a face's piece of outline: 1 where the result lies behind the face alone, −1 where
/// it lies in front alone, and 0 where there is no surface.
pub(super) type Weight = i32;

/// A piece of outline on a face, seen from the face's front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    /// The vertices at its start and at its end.
    pub ends: [u32; 2],
    /// The surface to its left and to its right.
    pub beside: [Weight; 2],
}

impl Piece {
    pub fn turned(self) -> Piece {
        let ([from, to], [left, right]) = (self.ends, self.beside);
        Piece { ends: [to, from], beside: [right, left] }
    }
}

/// The pieces of all faces.
pub(super) struct Pieces<'a> {
    pub bodies: &'a Bodies,
    pub segments: &'a [Segment],
    crossings: &'a Crossings,
    windings: &'a Windings,
    triples: &'a Triples,
    /// The numbers outside of all solids.
    outside: Numbers,
    /// The surface at the points of each patch.
    of_patch: Vec<Weight>,
}

impl<'a> Pieces<'a> {
    pub fn of(
        bodies: &'a Bodies,
        segments: &'a [Segment],
        (crossings, triples): (&'a Crossings, &'a Triples),
        windings: &'a Windings,
        rule: &Rule,
    ) -> Pieces<'a> {
        let outside = Numbers::of(rule, windings.solids());
        let mut pieces = Pieces { bodies, segments, crossings, windings, triples, outside, of_patch: Vec::new() };
        let patches = (0..windings.patches()).into_par_iter().with_min_len(4096);
        let of_patch = |numbers: &mut Numbers, patch: u32| pieces.at_patch(patch, numbers);
        pieces.of_patch = patches.map_init(|| pieces.numbers(), of_patch).collect();
        pieces
    }

    /// Returns scratch space for the numbers at a point.
    pub fn numbers(&self) -> Numbers {
        self.outside.clone()
    }

    /// Returns the position of a vertex on the lattice.
    pub fn position(&self, vertex: u32) -> Located {
        let points = &self.bodies.points;
        let crossing = vertex as usize;
        let Some(crossing) = crossing.checked_sub(points.len()) else { return Located::exactly(points[crossing]) };
        let crossings = self.crossings.positions();
        match crossing.checked_sub(crossings.len()) {
            Some(triple) => self.triples.positions()[triple],
            None => crossings[crossing],
        }
    }

    /// Returns the surface on a face at its first corner, from where its first side starts.
    pub fn at_first_corner(&self, face: u32) -> Weight {
        let [first, second, _] = self.bodies.faces[face as usize];
        self.at_start([first, second])
    }

    /// Returns the surface at the start of an edge, on the faces of its body.
    fn at_start(&self, edge: [u32; 2]) -> Weight {
        self.of_patch[self.windings.patch(edge) as usize]
    }

    /// Returns whether a side of a face has a crossing, or a corner a segment.
    pub fn is_crossed(&self, face: u32) -> bool {
        self.crossings.is_crossed(face)
    }

    fn at_patch(&self, patch: u32, numbers: &mut Numbers) -> Weight {
        let body = &self.bodies.bodies[self.bodies.body_of_point(self.windings.point_of(patch)) as usize];
        numbers.set(self.windings.of_patch(patch));
        numbers.add(body.solid, body.front);
        weight(numbers, body.solid)
    }

    /// Adds the change of winding numbers where a face is crossed.
    fn step(&self, face: u32, enters: bool, numbers: &mut Numbers) {
        numbers.add(self.bodies.solid_of_face(face), if enters { 1 } else { -1 });
    }

    fn crossing(&self, place: usize) -> u32 {
        (self.bodies.points.len() + place) as u32
    }

    /// Visits the pieces of a side of a face, which have the face to their left. `numbers` is scratch space.
    pub fn side(&self, body: &Body, face: u32, side: usize, numbers: &mut Numbers, mut visit: impl FnMut(Piece)) {
        let corners = self.bodies.faces[face as usize];
        let [u, v] = [corners[side], corners[(side + 1) % 3]];
        let edge = [u.min(v), u.max(v)];
        let places = if self.is_crossed(face) { self.crossings.range(edge) } else { 0..0 };
        if places.is_empty() {
            return visit(Piece { ends: [u, v], beside: [self.at_start([u, v]), 0] });
        }
        numbers.set(self.windings.at(edge));
        numbers.add(body.solid, body.front);
        let mut from = edge[0];
        for place in places.clone().map(Some).chain([None]) {
            let to = place.map_or(edge[1], |place| self.crossing(place));
            let ends = if u > v { [to, from] } else { [from, to] };
            visit(Piece { ends, beside: [weight(numbers, body.solid), 0] });
            if let Some(place) = place {
                let crossing = self.crossings.list()[place];
                self.step(crossing.face, crossing.enters, numbers);
            }
            from = to;
        }
    }

    /// Visits the pieces of a segment, on its first and on its second face. `numbers` is scratch space.
    pub fn segment(&self, index: u32, numbers: &mut Numbers, mut visit: impl FnMut([Piece; 2])) {
        let faces = self.segments[index as usize].faces;
        let solids = faces.map(|face| self.bodies.solid_of_face(face));
        let [start, end] = self.crossings.ends_of(index);
        self.go_to_start(index, start, numbers);
        let triples = self.triples.of_segment(index);
        let first_triple = self.crossing(self.crossings.list().len());
        let mut from = start;
        for i in 0..=triples.len() {
            let to = triples.get(i).map_or(end, |triple| first_triple + triple.point);
            visit([(0, 1), (1, 0)].map(|(own, other)| {
                let in_front = weight(numbers, solids[own]);
                numbers.add(solids[other], 1);
                let behind = weight(numbers, solids[own]);
                numbers.add(solids[other], -1);
                // The back of the second face lies to the left on the first, that of the first to the right on the second.
                Piece { ends: if own == 0 { [from, to] } else { [to, from] }, beside: [behind, in_front] }
            }));
            if let Some(triple) = triples.get(i) {
                self.step(triple.face, triple.enters, numbers);
            }
            from = to;
        }
    }

    /// Moves in front of both faces of a segment, at the vertex where it starts.
    fn go_to_start(&self, index: u32, start: u32, numbers: &mut Numbers) {
        let segment = &self.segments[index as usize];
        let points = self.bodies.points.len() as u32;
        let owner = match segment.side(segment.start, self.bodies) {
            Some(Side { edge, owner, .. }) => {
                numbers.set(self.windings.at(edge));
                let (list, start) = (self.crossings.list(), (start - points) as usize);
                let first =
                    list[..start].iter().rposition(|crossing| crossing.edge != edge).map_or(0, |before| before + 1);
                for crossing in &list[first..start] {
                    self.step(crossing.face, crossing.enters, numbers);
                }
                if !list[start].enters {
                    self.step(list[start].face, false, numbers);
                }
                owner
            }
            None => {
                // Around the corner, from the side that starts there.
                let owner = segment.faces[0];
                let [_, second, _] = self.bodies.corners_from(owner, start);
                numbers.set(self.windings.at([start, second]));
                for pass in self.windings.stars().passes(start, owner) {
                    let is_own = pass.segment == index;
                    if !(is_own && pass.enters) {
                        self.step(owner, pass.enters, numbers);
                    }
                    if is_own {
                        break;
                    }
                }
                owner
            }
        };
        let body = &self.bodies.bodies[self.bodies.body_of_face(owner) as usize];
        numbers.add(body.solid, body.front);
    }
}

/// Returns the surface on a face of a solid, given the winding numbers in front of it.
fn weight(numbers: &mut Numbers, solid: usize) -> Weight {
    Weight::from(numbers.holds_with(solid, 1)) - Weight::from(numbers.holds())
}
