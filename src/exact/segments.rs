//! The segments in which faces of different bodies meet, or of one that meets itself.
//!
//! Where faces f and g meet, they do so along a part of the line of their planes, in the direction n_f × n_g. Seen from
//! the front of f, the back of g (its inside) lies to the left. Along the line, f begins at its side that comes from the back of g
//! and ends at the side that goes there; g begins at its side that goes to the back of f and ends at the one that comes
//! from there. So four orders of two crossings give the segment, and each order is the sign of the volume of a side of
//! f and a side of g (Guigue and Devillers, "Fast and robust triangle-triangle overlap test", 2003).

use super::coincident::Coincident;
use super::signs::{Plane, edges_turn};

/// One end of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The crossing of a side of one face with the other face.
    Side {
        /// The side of the face from corner `side` to the next.
        side: u8,
        /// True if the side is one of the second face.
        of_second: bool,
    },
    /// A corner that the faces share.
    Corner {
        /// The corner of the first face.
        corner: u8,
    },
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
        return Coincident::of(faces, f, g).map(Meeting::Coincident);
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
    let first = |side: usize| End::Side { side: side as u8, of_second: false };
    let second = |side: usize| End::Side { side: side as u8, of_second: true };
    let start = if precedes(0, 0) { second(g_in) } else { first(f_out) };
    let end = if precedes(1, 1) { first(f_in) } else { second(g_out) };
    Some(Meeting::Segment(Segment { faces, start, end }))
}

/// Returns the segment in which two faces of one body meet beyond a corner that they share: the corner with a number of each face.
pub(super) fn meet_beyond(faces: [u32; 2], [f, g]: [&Plane; 2], corner: [usize; 2]) -> Option<Segment> {
    let [[f_from, f_to], [g_from, g_to]] = corner.map(|corner| [(corner + 1) % 3, (corner + 2) % 3]);
    let beside = |plane: &Plane, of: &Plane, ends: [usize; 2]| ends.map(|end| plane.is_in_front(&of.corners[end]));
    let (of_f, of_g) = (beside(g, f, [f_from, f_to]), beside(f, g, [g_from, g_to]));
    // Both faces begin at the corner, or both end there.
    let is_start = of_f[0];
    if of_f[0] == of_f[1] || of_g[0] == of_g[1] || of_g[0] == is_start {
        return None;
    }
    // The sides opposite the corner, from the front to the back of the other face at the first face's end, and so on.
    let turned = |[u, v]: [_; 2], is_turned: bool| if is_turned { [v, u] } else { [u, v] };
    let of_first = turned([&f.corners[f_from], &f.corners[f_to]], !is_start);
    let of_second = turned([&g.corners[g_from], &g.corners[g_to]], is_start);
    let first_precedes = edges_turn(of_first, of_second);
    let at_corner = End::Corner { corner: corner[0] as u8 };
    let beyond = match first_precedes == is_start {
        true => End::Side { side: f_from as u8, of_second: false },
        false => End::Side { side: g_from as u8, of_second: true },
    };
    let [start, end] = if is_start { [at_corner, beyond] } else { [beyond, at_corner] };
    Some(Segment { faces, start, end })
}

/// Returns the side of a face that goes from the front of a plane to its back, and the one that returns.
fn passing_sides(in_front: [bool; 3]) -> [usize; 2] {
    let side = |from_front: bool| {
        (0..3).find(|&i| in_front[i] == from_front && in_front[(i + 1) % 3] != from_front).unwrap_or(0)
    };
    [side(true), side(false)]
}
