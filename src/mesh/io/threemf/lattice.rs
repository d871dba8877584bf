//! Beam lattices of 3MF: beams and balls between the vertices of a mesh, which become closed shells (`mesh::beam`).
//!
//! Shells of one node overlap, so that only the non-zero fill rule gives their union, which is the solid that the
//! extension describes. Where the extension leaves a choice to the reader: beams shorter than the lattice's least length
//! are left out; balls of `ballmode="all"` stand at every vertex that a beam ends in; sets of beams are only names and
//! are ignored; a representation mesh is for display alone. Clipped lattices are refused, since clipping needs a
//! Boolean, which this library does on two files.

use glam::DVec3;
use quick_xml::events::BytesStart;

use super::super::error::{Fault, Place, Problem};
use super::super::text::quote;
use super::Xml;
use crate::mesh::TriangleMesh;
use crate::mesh::beam::{self, Cap, Shell};

/// Largest number of triangles of the lattices of a file. A beam takes a few bytes of a file and 5.7 kB of memory; at
/// this limit, 140,000 beams, they take as much memory as the copies of parts may (`placement`).
pub(super) const TRIANGLES_MAX: u64 = 1 << 25;

/// The vertices that have balls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Balls {
    None,
    /// Those listed in the file.
    Listed,
    /// Those at the ends of beams.
    AtBeamEnds,
}

#[derive(Clone, Copy, Debug)]
struct End {
    vertex: u32,
    radius: f64,
    cap: Cap,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    vertex: u32,
    radius: f64,
}

/// The lattice of one object.
#[derive(Debug)]
pub(super) struct Lattice {
    beams: Vec<[End; 2]>,
    listed_balls: Vec<Ball>,
    radius: Option<f64>,
    cap: Cap,
    least_length: f64,
    balls: Balls,
    ball_radius: Option<f64>,
    /// The kind of clipping, and the line that states it.
    pub(super) clipping: Option<(String, usize)>,
    has_representation: bool,
}

/// The result of meshing a lattice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Meshed {
    /// Number of beams and balls that got shells.
    pub(super) meshed: usize,
    /// Number of beams shorter than the least length.
    pub(super) too_short: usize,
    /// True if a mesh stands in for the lattice on displays.
    pub(super) has_representation: bool,
}

impl Lattice {
    /// Parses the lattice that an element `beamlattice` begins.
    pub(super) fn parse(xml: &Xml<'_>, element: &BytesStart<'_>) -> Result<Lattice, Fault> {
        let mut lattice = Lattice {
            beams: Vec::new(),
            listed_balls: Vec::new(),
            radius: None,
            cap: Cap::Sphere,
            least_length: 0.0,
            balls: Balls::None,
            ball_radius: None,
            clipping: None,
            has_representation: false,
        };
        xml.attributes(element, |name, value| {
            match name {
                "radius" => lattice.radius = Some(radius(xml, value)?),
                "ballradius" => lattice.ball_radius = Some(radius(xml, value)?),
                "minlength" => lattice.least_length = xml.number(value)?,
                "cap" => lattice.cap = cap(xml, value)?,
                "ballmode" => {
                    lattice.balls = match value {
                        "none" => Balls::None,
                        "mixed" => Balls::Listed,
                        "all" => Balls::AtBeamEnds,
                        _ => return Err(xml.invalid(format!("`{}` is not a ball mode", quote(value.as_bytes())))),
                    }
                }
                // Before version 1.0 of the extension it was called `clipping`, and some files use that.
                "clippingmode" | "clipping" if value != "none" => {
                    lattice.clipping = Some((quote(value.as_bytes()), xml.line()));
                }
                "representationmesh" => lattice.has_representation = true,
                _ => {}
            }
            Ok(())
        })?;
        Ok(lattice)
    }

    /// Returns whether there is nothing to mesh.
    pub(super) fn is_empty(&self) -> bool {
        self.beams.is_empty() && self.listed_balls.is_empty()
    }

    /// Adds the beam of an element `beam`, between two of `count` vertices.
    pub(super) fn beam(&mut self, xml: &Xml<'_>, element: &BytesStart<'_>, count: usize) -> Result<(), Fault> {
        let (mut vertices, mut radii, mut caps) = ([None; 2], [None; 2], [self.cap; 2]);
        xml.attributes(element, |name, value| {
            match name {
                "v1" => vertices[0] = Some(xml.vertex_index(value, count)?),
                "v2" => vertices[1] = Some(xml.vertex_index(value, count)?),
                "r1" => radii[0] = Some(radius(xml, value)?),
                "r2" => radii[1] = Some(radius(xml, value)?),
                "cap1" => caps[0] = cap(xml, value)?,
                "cap2" => caps[1] = cap(xml, value)?,
                _ => {}
            }
            Ok(())
        })?;
        let [Some(a), Some(b)] = vertices else { return Err(xml.invalid("a beam lacks one of `v1` and `v2`")) };
        if a == b {
            return Err(xml.invalid(format!("a beam begins and ends at vertex {a}")));
        }
        let no_radius = || xml.invalid("neither the beam nor its lattice has a radius");
        let first = radii[0].or(self.radius).ok_or_else(no_radius)?;
        let second = radii[1].unwrap_or(first);
        let end = |vertex, radius, cap| End { vertex, radius, cap };
        self.beams.push([end(a, first, caps[0]), end(b, second, caps[1])]);
        Ok(())
    }

    /// Adds the ball of an element `ball`, at one of `count` vertices.
    pub(super) fn ball(&mut self, xml: &Xml<'_>, element: &BytesStart<'_>, count: usize) -> Result<(), Fault> {
        let (mut vertex, mut own_radius) = (None, None);
        xml.attributes(element, |name, value| {
            match name {
                "vindex" => vertex = Some(xml.vertex_index(value, count)?),
                "r" => own_radius = Some(radius(xml, value)?),
                _ => {}
            }
            Ok(())
        })?;
        let vertex = vertex.ok_or_else(|| xml.invalid("a ball lacks `vindex`"))?;
        let radius = own_radius.or(self.ball_radius);
        let radius = radius.ok_or_else(|| xml.invalid("neither the ball nor its lattice has a radius"))?;
        self.listed_balls.push(Ball { vertex, radius });
        Ok(())
    }

    /// Adds the shells to the mesh that holds the vertices of the beams. `room` is the number of triangles still
    /// allowed; it is reduced by those of this lattice.
    pub(super) fn mesh(&self, mesh: &mut TriangleMesh, room: &mut u64) -> Result<Meshed, Fault> {
        let (shells, meshed) = self.shells(&mesh.positions)?;
        let triangles: usize = shells.iter().map(Shell::triangles).sum();
        *room = room.checked_sub(triangles as u64).ok_or_else(|| {
            let found = TRIANGLES_MAX - *room + triangles as u64;
            let what = "triangles of beams and balls".into();
            Fault::Malformed(Place::File, Problem::TooMany { what, found, limit: TRIANGLES_MAX })
        })?;
        mesh.triangles.reserve(triangles);
        shells.iter().for_each(|shell| shell.append_to(mesh));
        Ok(meshed)
    }

    fn shells(&self, positions: &[DVec3]) -> Result<(Vec<Shell>, Meshed), Fault> {
        let mut shells = Vec::with_capacity(self.beams.len());
        let mut meshed = Meshed { has_representation: self.has_representation, ..Meshed::default() };
        for ends in &self.beams {
            let ends =
                ends.map(|End { vertex, radius, cap }| beam::End { centre: positions[vertex as usize], radius, cap });
            let length = ends[0].centre.distance(ends[1].centre);
            if length < self.least_length || length == 0.0 {
                meshed.too_short += 1;
                continue;
            }
            meshed.meshed += 1;
            shells.extend(beam::shells(ends));
        }
        let balls = self.balls(positions.len())?;
        meshed.meshed += balls.len();
        let shell = |&Ball { vertex, radius }: &Ball| Shell::Ball { centre: positions[vertex as usize], radius };
        shells.extend(balls.iter().map(shell));
        Ok((shells, meshed))
    }

    fn balls(&self, vertices: usize) -> Result<Vec<Ball>, Fault> {
        match self.balls {
            Balls::None => Ok(Vec::new()),
            Balls::Listed => Ok(self.listed_balls.clone()),
            Balls::AtBeamEnds => {
                let mut has_ball = vec![false; vertices];
                self.listed_balls.iter().for_each(|ball| has_ball[ball.vertex as usize] = true);
                let mut balls = self.listed_balls.clone();
                for &End { vertex, .. } in self.beams.as_flattened() {
                    if !std::mem::replace(&mut has_ball[vertex as usize], true) {
                        let radius = self.ball_radius.ok_or_else(|| {
                            Fault::invalid(Place::File, "a beam lattice has balls at all beams and no `ballradius`")
                        })?;
                        balls.push(Ball { vertex, radius });
                    }
                }
                Ok(balls)
            }
        }
    }
}

fn radius(xml: &Xml<'_>, text: &str) -> Result<f64, Fault> {
    let radius = xml.number(text)?;
    if !(radius > 0.0 && radius.is_finite()) {
        return Err(xml.invalid(format!("the radius {radius} is not above 0")));
    }
    Ok(radius)
}

fn cap(xml: &Xml<'_>, name: &str) -> Result<Cap, Fault> {
    match name {
        "sphere" => Ok(Cap::Sphere),
        "hemisphere" => Ok(Cap::Hemisphere),
        "butt" => Ok(Cap::Butt),
        _ => Err(xml.invalid(format!("`{}` is not a beam cap", quote(name.as_bytes())))),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::mesh::beam::tests::assert_solid;

    const RADIUS: f64 = 0.75;

    fn lattice(beams: &[[End; 2]]) -> Lattice {
        Lattice {
            beams: beams.to_vec(),
            listed_balls: Vec::new(),
            radius: None,
            cap: Cap::Sphere,
            least_length: 0.1,
            balls: Balls::None,
            ball_radius: None,
            clipping: None,
            has_representation: false,
        }
    }

    /// Returns the shells of one beam between two points that are on no axis, and what was meshed.
    fn beam(radii: [f64; 2], caps: [Cap; 2], length: f64) -> (TriangleMesh, Meshed) {
        let a = DVec3::new(1.0, -2.0, 0.5);
        let b = a + DVec3::new(0.3, 0.2, -0.7).normalize() * length;
        let mut mesh = TriangleMesh { positions: vec![a, b], triangles: Vec::new() };
        let end = |k: usize| End { vertex: k as u32, radius: radii[k], cap: caps[k] };
        let meshed = lattice(&[[end(0), end(1)]]).mesh(&mut mesh, &mut { TRIANGLES_MAX }).unwrap();
        (mesh, meshed)
    }

    #[test]
    fn beams_are_solids_with_the_volumes_of_round_beams() {
        let ball = |r: f64| 4.0 / 3.0 * PI * r.powi(3);
        for caps in [[Cap::Butt, Cap::Hemisphere], [Cap::Hemisphere; 2], [Cap::Sphere; 2], [Cap::Butt; 2]] {
            for radii in [[RADIUS; 2], [RADIUS, 0.25], [0.1, RADIUS]] {
                let [r, s] = radii;
                let mut volume = PI * 2.5 / 3.0 * (r * r + r * s + s * s);
                for (cap, radius) in caps.into_iter().zip(radii) {
                    volume += if cap == Cap::Butt { 0.0 } else { ball(radius) / 2.0 };
                }
                // The wider end's ball is visible behind its half.
                volume += if caps[0] == Cap::Sphere && r != s { ball(r.max(s)) } else { 0.0 };
                let (mesh, meshed) = beam(radii, caps, 2.5);
                assert_eq!(meshed, Meshed { meshed: 1, ..Meshed::default() });
                assert_solid(&TriangleMesh { positions: mesh.positions[2..].to_vec(), ..shifted(&mesh) }, volume);
            }
        }
    }

    /// Returns the same triangles with indices for a mesh without the first two positions.
    fn shifted(mesh: &TriangleMesh) -> TriangleMesh {
        let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|index| index - 2)).collect();
        TriangleMesh { positions: Vec::new(), triangles }
    }

    #[test]
    fn whole_balls_are_meshed_where_the_frustum_does_not_hide_them() {
        let triangles = |radii, caps, length| beam(radii, caps, length).0.triangles.len();
        let (round, flat, ball) = (96, 22, 192);
        assert_eq!(triangles([1.0, 1.0], [Cap::Sphere; 2], 3.0), 48 + 2 * round);
        assert_eq!(triangles([1.0, 0.5], [Cap::Hemisphere; 2], 3.0), 48 + 2 * round);
        assert_eq!(triangles([1.0, 0.5], [Cap::Sphere; 2], 3.0), 48 + 2 * round + ball);
        assert_eq!(triangles([0.5, 1.0], [Cap::Sphere, Cap::Hemisphere], 3.0), 48 + 2 * round);
        // Its ball is longer than the beam, which ends flat.
        assert_eq!(triangles([1.0, 1.0], [Cap::Sphere, Cap::Butt], 0.5), 48 + round + flat + ball);
    }

    #[test]
    fn beams_below_the_minimum_length_are_skipped_and_counted() {
        let (mesh, meshed) = beam([1.0; 2], [Cap::Sphere; 2], 0.05);
        assert_eq!((mesh.triangles.len(), meshed), (0, Meshed { too_short: 1, ..Meshed::default() }));
    }

    #[test]
    fn balls_are_meshed_where_listed_or_at_all_ends() {
        let end = |vertex, radius| End { vertex, radius, cap: Cap::Butt };
        let mut lattice = lattice(&[[end(0, 0.1), end(1, 0.1)], [end(1, 0.1), end(2, 0.1)]]);
        lattice.listed_balls = vec![Ball { vertex: 1, radius: 0.5 }];
        lattice.ball_radius = Some(0.25);
        let corners = [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 3.0, DVec3::Z];
        let meshed = |lattice: &Lattice| {
            let mut mesh = TriangleMesh { positions: corners.to_vec(), triangles: Vec::new() };
            (lattice.mesh(&mut mesh, &mut { TRIANGLES_MAX }).unwrap().meshed, mesh.triangles.len())
        };
        let beams = 2 * (48 + 2 * 22);
        assert_eq!(meshed(&lattice), (2, beams));
        lattice.balls = Balls::Listed;
        assert_eq!(meshed(&lattice), (3, beams + 192));
        lattice.balls = Balls::AtBeamEnds;
        assert_eq!(meshed(&lattice), (5, beams + 3 * 192));
        lattice.ball_radius = None;
        let mut mesh = TriangleMesh { positions: corners.to_vec(), triangles: Vec::new() };
        assert!(lattice.mesh(&mut mesh, &mut { TRIANGLES_MAX }).is_err());
    }

    #[test]
    fn lattice_triangles_are_limited() {
        let end = |vertex| End { vertex, radius: 1.0, cap: Cap::Butt };
        let mut mesh = TriangleMesh { positions: vec![DVec3::ZERO, DVec3::X], triangles: Vec::new() };
        let mut room = 48 + 2 * 22;
        lattice(&[[end(0), end(1)]]).mesh(&mut mesh, &mut room).unwrap();
        assert_eq!(room, 0);
        let Err(Fault::Malformed(_, problem)) = lattice(&[[end(0), end(1)]]).mesh(&mut mesh, &mut room) else {
            panic!("there is no room");
        };
        assert_eq!(problem.to_string(), "33554524 triangles of beams and balls; the limit is 33554432");
    }
}
