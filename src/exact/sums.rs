//! The weighted triangles of the result's surface, summed.

use rayon::prelude::*;

use glam::DVec3;

use super::Rule;
use super::bodies::{Bodies, Lattice, SCALE};
use super::crossings::{Crossing, Crossings};
use super::segments::Segment;
use super::signs::Located;
use super::triple::{OnFaces, Placed, Triple};
use super::windings::Windings;
use crate::cancel::checkpoint;
use crate::mesh::MassProperties;
use crate::mesh::mass::{TERMS, terms};
use crate::mesh::measure::Sum;

/// Number of faces or segments that one task sums. It decides the order of additions.
const CHUNK: usize = 4096;

/// The sums of the weighted triangles.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    sums: [Sum; TERMS],
    /// The change of the volume while all crossings move by their rounding.
    moved: Sum,
}

/// The weight of a piece of surface: in the volume, 1 where the result lies behind it and −1 where it lies in front; and in the area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Weight {
    volume: i32,
    area: i32,
}

impl Weight {
    fn of(behind: bool, in_front: bool) -> Weight {
        let volume = i32::from(behind) - i32::from(in_front);
        Weight { volume, area: volume.abs() }
    }

    fn less(self, other: Weight) -> Weight {
        Weight { volume: self.volume - other.volume, area: self.area - other.area }
    }
}

impl Sums {
    pub fn of(
        bodies: &Bodies,
        (segments, crossings): (&[Segment], &Crossings),
        windings: &Windings,
        rule: &Rule,
    ) -> Sums {
        let surface = Surface { bodies, rule, crossings, windings };
        let place = |segment: &Segment| surface.placed(segment);
        let triple_points = (bodies.bodies.len() > 2).then(|| OnFaces::of(segments, &place));
        let faces = surface.sum_faces();
        let chunks = segments.par_chunks(CHUNK).enumerate().map(|(chunk, members)| {
            checkpoint();
            let mut sums = Sums::default();
            for (i, segment) in members.iter().enumerate() {
                let triples = triple_points.as_ref().map_or_else(Vec::new, |on_faces| {
                    on_faces.triples((chunk * CHUNK + i) as u32, segments, bodies, &place)
                });
                surface.add_segment(segment, &triples, &mut sums);
            }
            sums
        });
        faces.into_iter().chain(chunks.collect::<Vec<_>>()).fold(Sums::default(), Sums::join)
    }

    /// Adds a triangle of a face, whose plane has this normal: a corner of the face and a piece of outline.
    fn add(&mut self, normal: DVec3, corner: DVec3, piece: [Located; 2], weight: Weight) {
        let [o, p, q] = [corner, piece[0].at, piece[1].at].map(|point| point * SCALE);
        let mut terms = terms([o, p, q]);
        let (volume, area) = (f64::from(weight.volume), f64::from(weight.area));
        let size = terms[11];
        terms[..10].iter_mut().for_each(|term| *term *= volume);
        terms[10] = area * normal.dot((p - o).cross(q - o));
        terms[11] = volume.abs() * size;
        self.sums.iter_mut().zip(terms).for_each(|(sum, term)| sum.add(term));
        // The chain is closed, so a corner that moves by δ changes the volume by at most δ / 6 times the product of the two
        // sides at that corner, in each triangle.
        let moved = piece[0].error * (p - o).length() + piece[1].error * (q - o).length();
        self.moved.add(volume.abs() * SCALE * moved * (q - p).length() / 6.0);
    }

    fn join(mut self, other: Sums) -> Sums {
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, other)| sum.join(other));
        self.moved.join(other.moved);
        self
    }

    pub fn mass_properties(&self, lattice: &Lattice, displaced: f64) -> MassProperties {
        let frame = lattice.frame();
        let mut found = MassProperties::from_sums(self.sums.map(Sum::total), &frame, 3f64.sqrt());
        let (unit, step) = (frame.unit(), lattice.step);
        found.volume_rounding += self.moved.total() * unit * unit * unit + displaced * step * step * step;
        found
    }
}

/// The surfaces of all bodies, with the winding numbers on them.
struct Surface<'s> {
    bodies: &'s Bodies,
    rule: &'s Rule<'s>,
    crossings: &'s Crossings,
    windings: &'s Windings,
}

impl Surface<'_> {
    fn placed(&self, segment: &Segment) -> Placed {
        let planes = segment.faces.map(|face| self.bodies.plane(face));
        let ends = [segment.start, segment.end].map(|end| {
            let (edge, _, _) = segment.edge(end, self.bodies);
            planes[usize::from(!end.of_second)].crossing(edge.map(|index| self.bodies.points[index as usize]))
        });
        Placed { segment: *segment, planes, ends }
    }

    fn solid_of_face(&self, face: u32) -> usize {
        self.bodies.bodies[self.bodies.body_of_face(face) as usize].solid
    }

    /// Returns the weight of a piece of surface of a solid, given the winding numbers in front of it.
    fn weight(&self, windings: &mut [i32], solid: usize) -> Weight {
        let in_front = self.rule.holds(windings);
        windings[solid] += 1;
        let behind = self.rule.holds(windings);
        windings[solid] -= 1;
        Weight::of(behind, in_front)
    }

    /// Adds the change of winding numbers where a face is crossed.
    fn step(&self, face: u32, enters: bool, windings: &mut [i32]) {
        windings[self.solid_of_face(face)] += if enters { 1 } else { -1 };
    }

    /// Sums the sides of all faces. The sides at the fan's centre contribute only the rounding of their crossings, which closes
    /// the chain.
    fn sum_faces(&self) -> Vec<Sums> {
        let Bodies { faces, bodies, .. } = self.bodies;
        let weights: Vec<Weight> = self.windings.first_points().iter().map(|&point| self.weight_at(point)).collect();
        let all = bodies.iter().flat_map(|body| {
            let starts = body.faces.clone().step_by(CHUNK);
            starts.map(move |start| (body, start..body.faces.end.min(start + CHUNK as u32)))
        });
        let all: Vec<_> = all.collect();
        let chunks = all.into_par_iter().map(|(body, chunk)| {
            checkpoint();
            let mut sums = Sums::default();
            let mut windings = Vec::new();
            for face in chunk {
                let corners = self.bodies.corners(face);
                let indices = faces[face as usize];
                let normal = unit_normal(corners);
                for side in 0..3 {
                    let (u, v) = (indices[side], indices[(side + 1) % 3]);
                    let edge = [u.min(v), u.max(v)];
                    let along = if self.crossings.is_crossed(face) { self.crossings.along(edge) } else { &[] };
                    if along.is_empty() {
                        let weight = weights[self.windings.patch(u) as usize];
                        if side == 1 && weight != Weight::default() {
                            sums.add(normal, corners[0], [corners[1], corners[2]].map(Located::exactly), weight);
                        }
                        continue;
                    }
                    windings.clear();
                    windings.extend_from_slice(self.windings.at(edge[0]));
                    windings[body.solid] += body.front;
                    let ends = edge.map(|point| self.bodies.points[point as usize]);
                    let fan = (normal, corners[0]);
                    self.add_side(fan, (ends, u > v), along, &mut windings, body.solid, &mut sums);
                }
            }
            sums
        });
        chunks.collect()
    }

    /// Returns the weight of the surface at a point.
    fn weight_at(&self, point: u32) -> Weight {
        let bodies = &self.bodies.bodies;
        let body = &bodies[bodies.partition_point(|body| body.points.end <= point)];
        let mut windings = self.windings.at(point).to_vec();
        windings[body.solid] += body.front;
        self.weight(&mut windings, body.solid)
    }

    /// Adds the pieces of a side of a face. `windings` are those at the side's lower point, in front of the face.
    fn add_side(
        &self,
        (normal, corner): (DVec3, DVec3),
        (edge, is_turned): ([DVec3; 2], bool),
        along: &[Crossing],
        windings: &mut [i32],
        solid: usize,
        sums: &mut Sums,
    ) {
        let mut from = Located::exactly(edge[0]);
        for i in 0..=along.len() {
            let to = along
                .get(i)
                .map_or(Located::exactly(edge[1]), |crossing| self.bodies.plane(crossing.face).crossing(edge));
            let weight = self.weight(windings, solid);
            if weight != Weight::default() {
                sums.add(normal, corner, if is_turned { [to, from] } else { [from, to] }, weight);
            }
            if let Some(crossing) = along.get(i) {
                self.step(crossing.face, crossing.enters, windings);
            }
            from = to;
        }
    }

    /// Returns the winding numbers in front of both faces of a segment, at its start.
    fn windings_at_start(&self, segment: &Segment) -> Vec<i32> {
        let bodies = self.bodies;
        let (edge, face, owner) = segment.edge(segment.start, bodies);
        let mut windings = self.windings.at(edge[0]).to_vec();
        for crossing in self.crossings.along(edge) {
            if crossing.face == face {
                if !crossing.enters {
                    self.step(face, false, &mut windings);
                }
                break;
            }
            self.step(crossing.face, crossing.enters, &mut windings);
        }
        let body = &bodies.bodies[bodies.body_of_face(owner) as usize];
        windings[body.solid] += body.front;
        windings
    }

    /// Adds the pieces of a segment to both of its faces.
    fn add_segment(&self, segment: &Segment, triples: &[Triple], sums: &mut Sums) {
        let solids = segment.faces.map(|face| self.solid_of_face(face));
        let mut windings = self.windings_at_start(segment);
        let Placed { planes, ends, .. } = self.placed(segment);
        let mut from = ends[0];
        for i in 0..=triples.len() {
            let to = triples.get(i).map_or(ends[1], |triple| triple.position);
            for (own, other) in [(0, 1), (1, 0)] {
                windings[solids[other]] += 1;
                let behind_other = self.weight(&mut windings, solids[own]);
                windings[solids[other]] -= 1;
                let weight = behind_other.less(self.weight(&mut windings, solids[own]));
                if weight != Weight::default() {
                    // The back of the second face lies to the left on the first, that of the first to the right on the second.
                    let piece = if own == 0 { [from, to] } else { [to, from] };
                    sums.add(planes[own].unit_normal(), planes[own].corners[0], piece, weight);
                }
            }
            if let Some(triple) = triples.get(i) {
                self.step(triple.face, triple.enters, &mut windings);
            }
            from = to;
        }
    }
}

fn unit_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
