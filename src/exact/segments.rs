//! The segments in which faces of different bodies meet.
//!
//! Where faces f and g meet, they do so along a part of the line of their planes, in the direction n_f × n_g. Seen from
//! the front of f, the back of g (its inside) lies to the left. Along the line, f begins at its side that comes from the back of g
//! and ends at the side that goes there; g begins at its side that goes to the back of f and ends at the one that comes
//! from there. So four orders of two crossings give the segment, and each order is the sign of the volume of a side of
//! f and a side of g (Guigue and Devillers, "Fast and robust triangle-triangle overlap test", 2003).

use super::coincident::Coincident;
use super::signs::{Plane, edges_turn};

/// One end of a segment: the crossing of a side of one face with the other face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct End {
    /// The side of the face from corner `side` to the next.
    pub side: u8,
    /// True if the side is one of the second face.
    pub of_second: bool,
}

/// A segment in which two faces meet, along the product of their normals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub faces: [u32; 2],
    pub start: End,
    pub end: End,
}

/// The way in which two faces of different bodies meet.
#[derive(Clone, Copy, Debug)]
pub(super) enum Meeting {
    Segment(Segment),
    Coincident(Coincident),
}

/// Returns the way in which two faces of different bodies meet, if they do.
pub(super) fn meet(faces: [u32; 2], f: &Plane, g: &Plane) -> Option<Meeting> {
    let beside = |plane: &Plane, of: &Plane| of.corners.each_ref().map(|corner| plane.is_in_front(corner));
    let of_f = beside(g, f);
    if of_f == [of_f[0]; 3] {
        // Coplanar faces are displaced to one side of each other.
        return Coincident::of(f, g).map(Meeting::Coincident);
    }
    let of_g = beside(f, g);
    if of_g == [of_g[0]; 3] {
        return None;
    }
    let [f_in, f_out] = passing_sides(of_f);
    let [g_in, g_out] = passing_sides(of_g);
    // Sides from front to back of the other face.
    let [ends_of_f, ends_of_g] =
        [f, g].map(|plane| |side: usize| [&plane.corners[side], &plane.corners[(side + 1) % 3]]);
    let turned = |[u, v]: [_; 2]| [v, u];
    let of_first = [turned(ends_of_f(f_out)), ends_of_f(f_in)];
    let of_second = [ends_of_g(g_in), turned(ends_of_g(g_out))];
    // Whether the crossing of a side of f comes before that of a side of g.
    let precedes = |own: usize, other: usize| edges_turn(of_first[own], of_second[other]);
    if !precedes(0, 1) || precedes(1, 0) {
        return None;
    }
    let first = |side: usize| End { side: side as u8, of_second: false };
    let second = |side: usize| End { side: side as u8, of_second: true };
    let start = if precedes(0, 0) { second(g_in) } else { first(f_out) };
    let end = if precedes(1, 1) { first(f_in) } else { second(g_out) };
    Some(Meeting::Segment(Segment { faces, start, end }))
}

/// Returns the side of a face that goes from the front of a plane to its back, and the one that returns.
fn passing_sides(in_front: [bool; 3]) -> [usize; 2] {
    let side = |from_front: bool| {
        (0..3).find(|&i| in_front[i] == from_front && in_front[(i + 1) % 3] != from_front).unwrap_or(0)
    };
    [side(true), side(false)]
}
