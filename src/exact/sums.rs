//! The weighted triangles of the result's surface, summed.

use std::ops::Range;

use crate::parallel::*;

use glam::DVec3;

use super::bodies::{Bodies, Body, Lattice};
use super::numbers::Numbers;
use super::pieces::{Piece, Pieces};
use super::signs::Located;
use crate::cancel::checkpoint;
use crate::closest::closest_to_origin;
use crate::mesh::MassProperties;
use crate::mesh::mass::{TERMS, terms};
use crate::mesh::measure::{self, Sum};

/// Number of faces or segments that one task sums. It decides the order of additions.
const CHUNK: usize = 4096;

/// The sums of the weighted triangles, in local coordinates of the region that the result lies in: beside a solid that is far larger,
/// they lose no digits.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    sums: measure::Sums<TERMS>,
    /// The change of the volume while all crossings move by their rounding.
    moved: Sum,
}

/// The weight of a triangle in the volume and in the area.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Share {
    volume: i32,
    area: i32,
}

impl Share {
    /// Returns the difference of the surfaces on the two sides of a piece.
    fn across(piece: &Piece) -> Option<Share> {
        let [left, right] = piece.beside;
        (left != right).then(|| Share { volume: left - right, area: left.abs() - right.abs() })
    }
}

impl Sums {
    pub fn of(pieces: &Pieces) -> Sums {
        let faces = sum_faces(pieces);
        let count = pieces.segments.len() as u32;
        let starts: Vec<u32> = (0..count).step_by(CHUNK).collect();
        let of_chunk = |numbers: &mut Numbers, start: u32| {
            checkpoint();
            let mut sums = Sums::default();
            (start..count.min(start + CHUNK as u32)).for_each(|segment| sums.add_segment(pieces, segment, numbers));
            sums
        };
        let chunks = starts.into_par_iter().map_init(|| pieces.numbers(), of_chunk);
        faces.into_iter().chain(chunks.collect::<Vec<_>>()).fold(Sums::default(), Sums::join)
    }

    /// Adds the pieces of a segment to both of its faces.
    fn add_segment(&mut self, pieces: &Pieces, segment: u32, numbers: &mut Numbers) {
        let fans = pieces.segments[segment as usize].faces.map(|face| Fan::of(face, pieces.bodies));
        pieces.segment(segment, numbers, |both| {
            for (fan, piece) in fans.iter().zip(&both) {
                self.add_piece(pieces, fan, piece);
            }
        });
    }

    fn add_piece(&mut self, pieces: &Pieces, fan: &Fan, piece: &Piece) {
        if let Some(share) = Share::across(piece) {
            let ends = piece.ends.map(|vertex| pieces.position(vertex));
            self.add(fan, ends.map(|end| Located { at: pieces.bodies.region.local(end.at), ..end }), share);
        }
    }

    /// Adds a triangle of a face, from the centre of its fan to a piece of outline.
    fn add(&mut self, fan: &Fan, piece: [Located; 2], weight: Share) {
        let &Fan { normal, centre: Located { at: o, error } } = fan;
        let [p, q] = [piece[0].at, piece[1].at];
        let mut terms = terms([o, p, q]);
        let (volume, area) = (f64::from(weight.volume), f64::from(weight.area));
        let size = terms[11];
        terms[..10].iter_mut().for_each(|term| *term *= volume);
        terms[10] = area * normal.dot((p - o).cross(q - o));
        terms[11] = volume.abs() * size;
        self.sums.add(terms);
        // The chain is closed, so a corner that moves by δ changes the volume by at most δ / 6 times the product of the two
        // sides at that corner, in each triangle.
        let [to_p, to_q, along] = [p - o, q - o, q - p].map(DVec3::length);
        let moved = error * to_p * to_q + (piece[0].error * to_p + piece[1].error * to_q) * along;
        self.moved.add(volume.abs() * moved / 6.0);
    }

    fn join(mut self, other: Sums) -> Sums {
        self.sums.join(other.sums);
        self.moved.join(other.moved);
        self
    }

    pub fn mass_properties(&self, lattice: &Lattice, bodies: &Bodies) -> MassProperties {
        let frame = lattice.frame(&bodies.region);
        let mut found = MassProperties::from_sums(self.sums.totals(), &frame);
        let (unit, step) = (frame.unit(), lattice.step);
        // The errors of points are in lattice steps.
        let moved = self.moved.total() * unit * unit * step;
        found.volume_rounding += moved + bodies.displaced * step * step * step;
        found
    }
}

/// What the triangles of a face's pieces of outline have in common.
struct Fan {
    /// The unit normal of the face.
    normal: DVec3,
    /// The point of the face next to the middle of the region, in local coordinates, however large the face is. Of a needle it may be
    /// another one, by rounding: any combination of the corners lies in the face's plane, and the bound counts how far it is from the
    /// pieces.
    centre: Located,
}

impl Fan {
    fn of(face: u32, bodies: &Bodies) -> Fan {
        let corners = bodies.corners(face).map(|corner| bodies.region.local(corner));
        let reach: f64 = corners.iter().map(|corner| corner.length()).sum();
        let error = 8.0 * f64::EPSILON * reach * bodies.region.unit();
        Fan { normal: unit_normal(corners), centre: Located { at: closest_to_origin(corners), error } }
    }
}

/// Sums the sides of all faces.
fn sum_faces(pieces: &Pieces) -> Vec<Sums> {
    let bodies = pieces.bodies;
    let all = bodies.bodies.iter().flat_map(|body| {
        let starts = body.faces.clone().step_by(CHUNK);
        starts.map(move |start| (body, start..body.faces.end.min(start + CHUNK as u32)))
    });
    let all: Vec<_> = all.collect();
    let of_chunk = |numbers: &mut Numbers, (body, chunk): (&Body, Range<u32>)| {
        checkpoint();
        let mut sums = Sums::default();
        for face in chunk {
            if pieces.is_crossed(face) {
                let fan = Fan::of(face, bodies);
                for side in 0..3 {
                    pieces.side(body, face, side, numbers, |piece| {
                        sums.add_piece(pieces, &fan, &piece);
                    });
                }
                continue;
            }
            let weight = pieces.at_first_corner(face);
            if weight != 0 {
                let corners = bodies.corners(face).map(|corner| bodies.region.local(corner));
                let [centre, from, to] = corners.map(Located::exactly);
                let fan = Fan { normal: unit_normal(corners), centre };
                sums.add(&fan, [from, to], Share { volume: weight, area: 1 });
            }
        }
        sums
    };
    all.into_par_iter().map_init(|| pieces.numbers(), of_chunk).collect()
}

fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
