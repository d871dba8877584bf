//! The surface of the result as triangles.
//!
//! A face that no other meets, or at which nothing changes, is kept, turned or dropped whole. Of the others, the region with a
//! surface is bounded by pieces of outline, and triangulated (`cut`). Every piece borders one triangle of each of the two
//! faces that meet there, or of the two at a side, and they know its ends by the same numbers. So the surface is closed and
//! oriented by its numbers, whatever the positions are rounded to.

use crate::parallel::*;
use glam::{DVec2, DVec3};

use super::cut::triangulate;
use super::numbers::Numbers;
use super::pieces::{Pieces, Weight};
use crate::cancel::checkpoint;
use crate::mesh::{Precision, TriangleMesh, renumber};

/// Number of faces that one task cuts; a single face may take milliseconds.
const FACES: usize = 128;

/// Number of segments whose pieces one task finds at least.
const SEGMENTS: usize = 4096;

/// The triangle of an input that a triangle of a result lies in, or one beside it in the same plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// The index of the input; of several with the same mesh, the first.
    pub input: u32,
    /// The index of its triangle.
    pub triangle: u32,
}

/// A piece of outline of the region of a face that has a surface of one weight.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Bound {
    face: u32,
    weight: Weight,
    ends: [u32; 2],
}

/// Triangles with their faces.
type Part = (Vec<[u32; 3]>, Vec<u32>);

/// The triangles of the result.
pub(super) struct Surface {
    pub mesh: TriangleMesh,
    /// The source of each triangle.
    pub sources: Vec<Source>,
    /// The number of the first vertex that is none of an input: those of cuts come last.
    pub first_of_cuts: u32,
    /// The faces that the triangles are parts of.
    pub faces: Vec<u32>,
}

/// Returns the surface of the result. `place` gives the position of a vertex in a file of a precision. `None` if an outline is not
/// closed, as winding numbers are others than a body may have.
pub(super) fn surface(
    pieces: &Pieces,
    place: impl Fn(u32) -> DVec3 + Sync + Send,
    (precision, error): (Precision, f64),
) -> Option<Surface> {
    let bounds = bounds(pieces);
    let faces = pieces.bodies.faces.len() as u32;
    let starts: Vec<u32> = (0..faces).step_by(FACES).collect();
    let parts: Option<Vec<Part>> = starts
        .into_par_iter()
        .map(|start| {
            checkpoint();
            let mut cutter = Cutter {
                pieces,
                place: &place,
                epsilon: precision.epsilon(),
                error,
                numbers: pieces.numbers(),
                outline: Vec::new(),
            };
            let mut part = (Vec::new(), Vec::new());
            let mut left = &bounds[bounds.partition_point(|bound| bound.face < start)..];
            for face in start..faces.min(start + FACES as u32) {
                let count = left.iter().take_while(|bound| bound.face == face).count();
                let (own, rest) = left.split_at(count);
                left = rest;
                if !cutter.face(face, own, &mut part.0) {
                    return None;
                }
                part.1.resize(part.0.len(), face);
            }
            Some(part)
        })
        .collect();
    let (mut triangles, mut faces) = (Vec::new(), Vec::new());
    for (some, their_faces) in parts? {
        triangles.extend(some);
        faces.extend(their_faces);
    }
    let source = |&face: &u32| {
        let body = &pieces.bodies.bodies[pieces.bodies.body_of_face(face) as usize];
        Source { input: body.solid as u32, triangle: body.triangle(face) }
    };
    let sources = faces.par_iter().with_min_len(SEGMENTS).map(source).collect();
    let used = renumber(&mut triangles);
    let points = pieces.bodies.points.len() as u32;
    let first_of_cuts = used.partition_point(|&vertex| vertex < points) as u32;
    let positions = used.into_par_iter().map(place).collect();
    Some(Surface { mesh: TriangleMesh { positions, triangles }, sources, first_of_cuts, faces })
}

/// Returns the pieces of segments beside which the surface changes, sorted by faces.
fn bounds(pieces: &Pieces) -> Vec<Bound> {
    let of_segment = |numbers: &mut Numbers, segment: u32| {
        let faces = pieces.segments[segment as usize].faces;
        let mut found = Vec::new();
        pieces.segment(segment, numbers, |both| {
            for (face, piece) in faces.into_iter().zip(both) {
                for (piece, [own, beyond]) in [(piece, piece.beside), (piece.turned(), piece.turned().beside)] {
                    if own != beyond && own != 0 {
                        found.push(Bound { face, weight: own, ends: piece.ends });
                    }
                }
            }
        });
        found
    };
    let segments = (0..pieces.segments.len() as u32).into_par_iter().with_min_len(SEGMENTS);
    let mut bounds: Vec<Bound> = segments.map_init(|| pieces.numbers(), of_segment).flatten_iter().collect();
    bounds.par_sort_unstable();
    bounds
}

/// Cuts faces.
struct Cutter<'a, P> {
    pieces: &'a Pieces<'a>,
    place: &'a P,
    epsilon: f64,
    error: f64,
    numbers: Numbers,
    outline: Vec<[u32; 2]>,
}

impl<P: Fn(u32) -> DVec3> Cutter<'_, P> {
    /// Appends the triangles of a face, given its pieces of segments. Returns false if its outline is not closed.
    fn face(&mut self, face: u32, bounds: &[Bound], triangles: &mut Vec<[u32; 3]>) -> bool {
        let corners = self.pieces.bodies.faces[face as usize];
        if bounds.is_empty() {
            match self.pieces.at_first_corner(face) {
                0 => {}
                weight => triangles.push(turned(corners, weight)),
            }
            return true;
        }
        for same in bounds.chunk_by(|a, b| a.weight == b.weight) {
            let weight = same[0].weight;
            self.outline.clear();
            self.outline.extend(same.iter().map(|bound| bound.ends));
            self.add_sides(face, weight);
            let first = triangles.len();
            let project = Projection::of(self.pieces.bodies.corners(face));
            if !triangulate(
                &mut self.outline,
                |vertex| project.flat((self.place)(vertex)),
                (self.epsilon, self.error),
                triangles,
            ) {
                return false;
            }
            triangles[first..].iter_mut().for_each(|triangle| *triangle = turned(*triangle, weight));
        }
        true
    }

    /// Adds the pieces of sides with a surface of a weight. Where it does not change, pieces are one.
    fn add_sides(&mut self, face: u32, weight: Weight) {
        let bodies = self.pieces.bodies;
        let body = &bodies.bodies[bodies.body_of_face(face) as usize];
        for side in 0..3 {
            let first = self.outline.len();
            let outline = &mut self.outline;
            let corners = bodies.faces[face as usize];
            let is_upwards = corners[side] < corners[(side + 1) % 3];
            self.pieces.side(body, face, side, &mut self.numbers, |piece| {
                if piece.beside[0] != weight {
                    return;
                }
                // From the lower point to the higher, whatever the direction of the pieces is.
                match outline[first..].last_mut() {
                    Some(last) if is_upwards && last[1] == piece.ends[0] => last[1] = piece.ends[1],
                    Some(last) if !is_upwards && last[0] == piece.ends[1] => last[0] = piece.ends[0],
                    _ => outline.push(piece.ends),
                }
            });
        }
    }
}

fn turned([a, b, c]: [u32; 3], weight: Weight) -> [u32; 3] {
    if weight < 0 { [a, c, b] } else { [a, b, c] }
}

/// The projection of a face along the axis that is nearest to its normal, seen from its front.
struct Projection {
    axes: [usize; 2],
}

impl Projection {
    fn of([a, b, c]: [DVec3; 3]) -> Projection {
        let normal = (b - a).cross(c - a);
        let axis = normal.abs().max_position();
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        Projection { axes: if normal[axis] < 0.0 { [v, u] } else { [u, v] } }
    }

    fn flat(&self, point: DVec3) -> DVec2 {
        let [u, v] = self.axes;
        DVec2::new(point[u], point[v])
    }
}
