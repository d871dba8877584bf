//! The weighted triangles of the result's surface, summed.

use crate::parallel::*;

use glam::DVec3;

use super::bodies::{Lattice, SCALE};
use super::pieces::{Piece, Pieces};
use super::signs::Located;
use crate::cancel::checkpoint;
use crate::mesh::MassProperties;
use crate::mesh::mass::{TERMS, terms};
use crate::mesh::measure::{self, Sum};

/// Number of faces or segments that one task sums. It decides the order of additions.
const CHUNK: usize = 4096;

/// The sums of the weighted triangles.
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
        let chunks = starts.into_par_iter().map(|start| {
            checkpoint();
            let mut sums = Sums::default();
            (start..count.min(start + CHUNK as u32)).for_each(|segment| sums.add_segment(pieces, segment));
            sums
        });
        faces.into_iter().chain(chunks.collect::<Vec<_>>()).fold(Sums::default(), Sums::join)
    }

    /// Adds the pieces of a segment to both of its faces.
    fn add_segment(&mut self, pieces: &Pieces, segment: u32) {
        let corners = pieces.segments[segment as usize].faces.map(|face| pieces.bodies.corners(face));
        let normals = corners.map(unit_normal);
        pieces.segment(segment, |both| {
            for (face, piece) in both.iter().enumerate() {
                self.add_piece(pieces, normals[face], corners[face][0], piece);
            }
        });
    }

    fn add_piece(&mut self, pieces: &Pieces, normal: DVec3, corner: DVec3, piece: &Piece) {
        if let Some(share) = Share::across(piece) {
            self.add(normal, corner, piece.ends.map(|vertex| pieces.position(vertex)), share);
        }
    }

    /// Adds a triangle of a face, whose plane has this normal: a corner of the face and a piece of outline.
    fn add(&mut self, normal: DVec3, corner: DVec3, piece: [Located; 2], weight: Share) {
        let [o, p, q] = [corner, piece[0].at, piece[1].at].map(|point| point * SCALE);
        let mut terms = terms([o, p, q]);
        let (volume, area) = (f64::from(weight.volume), f64::from(weight.area));
        let size = terms[11];
        terms[..10].iter_mut().for_each(|term| *term *= volume);
        terms[10] = area * normal.dot((p - o).cross(q - o));
        terms[11] = volume.abs() * size;
        self.sums.add(terms);
        // The chain is closed, so a corner that moves by δ changes the volume by at most δ / 6 times the product of the two
        // sides at that corner, in each triangle.
        let moved = piece[0].error * (p - o).length() + piece[1].error * (q - o).length();
        self.moved.add(volume.abs() * SCALE * moved * (q - p).length() / 6.0);
    }

    fn join(mut self, other: Sums) -> Sums {
        self.sums.join(other.sums);
        self.moved.join(other.moved);
        self
    }

    pub fn mass_properties(&self, lattice: &Lattice, displaced: f64) -> MassProperties {
        let frame = lattice.frame();
        let mut found = MassProperties::from_sums(self.sums.totals(), &frame, 3f64.sqrt());
        let (unit, step) = (frame.unit(), lattice.step);
        found.volume_rounding += self.moved.total() * unit * unit * unit + displaced * step * step * step;
        found
    }
}

/// Sums the sides of all faces. The sides at the fan's centre contribute only the rounding of their crossings, which closes
/// the chain.
fn sum_faces(pieces: &Pieces) -> Vec<Sums> {
    let bodies = pieces.bodies;
    let all = bodies.bodies.iter().flat_map(|body| {
        let starts = body.faces.clone().step_by(CHUNK);
        starts.map(move |start| (body, start..body.faces.end.min(start + CHUNK as u32)))
    });
    let all: Vec<_> = all.collect();
    let chunks = all.into_par_iter().map(|(body, chunk)| {
        checkpoint();
        let mut sums = Sums::default();
        let mut windings = Vec::new();
        for face in chunk {
            let corners = bodies.corners(face);
            if pieces.is_crossed(face) {
                let normal = unit_normal(corners);
                for side in 0..3 {
                    pieces.side(body, face, side, &mut windings, |piece| {
                        sums.add_piece(pieces, normal, corners[0], &piece);
                    });
                }
                continue;
            }
            let weight = pieces.at_first_corner(face);
            if weight != 0 {
                let piece = [corners[1], corners[2]].map(Located::exactly);
                sums.add(unit_normal(corners), corners[0], piece, Share { volume: weight, area: 1 });
            }
        }
        sums
    });
    chunks.collect()
}

fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
