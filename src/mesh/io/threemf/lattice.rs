//! Beam lattices of 3MF: beams and balls between the vertices of a mesh, meshed as closed shells.
//!
//! A beam is a conical frustum with a cap at either end: half a ball, a whole ball, or none (`butt`). Each beam becomes
//! a shell of its own, oriented outwards: a tube of 24 sides with caps of hexagonal rings (6, 12, 18 and 24 corners)
//! that share the tube's corners. A whole ball is visible only where it is wider than the frustum behind it; there it
//! is one more shell. Shells of one node overlap, so that only the non-zero fill rule gives their union, which is the
//! solid that the extension describes.
//!
//! Corners lie slightly outside the round shape, such that volumes are right: a tube and a cap have those of the
//! frustum and the half ball, to the last digits. The surface then deviates by −0.29 % to +0.58 % of the radius on
//! tubes, and by −1.4 % to +2.5 % on caps. Inscribed rings of the same number would lose 1.1 % of a tube's volume.
//!
//! Where the extension leaves a choice to the reader: beams shorter than the lattice's least length are left out; balls
//! of `ballmode="all"` stand at every vertex that a beam ends in; sets of beams are only names and are ignored; a
//! representation mesh is for display alone. Clipped lattices are refused, since clipping needs a Boolean, which this
//! library does on two files.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::DVec3;
use quick_xml::events::BytesStart;

use super::super::error::{Fault, Place, Problem};
use super::super::text::quote;
use super::Xml;
use crate::mesh::TriangleMesh;

/// Largest number of triangles of the lattices of a file. A beam takes a few bytes of a file and 5.7 kB of memory; at
/// this limit, 140,000 beams, they take as much memory as the copies of parts may (`placement`).
pub(super) const TRIANGLES_MAX: u64 = 1 << 25;

/// Number of rings of a cap, from its pole to the end of the tube; ring k has 6k corners.
const RINGS: usize = 4;

/// Number of sides of a tube.
const SIDES: usize = 6 * RINGS;

/// Number of corners of a cap without those that it shares with the tube.
const CAP_CORNERS: usize = 1 + 3 * RINGS * (RINGS - 1);

/// The shape of a beam's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Cap {
    Sphere,
    Hemisphere,
    Butt,
}

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

/// A closed surface.
#[derive(Clone, Copy, Debug)]
enum Shell {
    Beam { ends: [End; 2] },
    Ball { centre: DVec3, radius: f64 },
}

impl Shell {
    fn triangles(&self) -> usize {
        let round = 6 * RINGS * RINGS;
        match self {
            Shell::Beam { ends } => {
                let cap = |end: &End| if end.cap == Cap::Butt { SIDES - 2 } else { round };
                2 * SIDES + ends.iter().map(cap).sum::<usize>()
            }
            Shell::Ball { .. } => 2 * round,
        }
    }
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
        for shell in shells {
            match shell {
                Shell::Beam { ends } => DOME.append_beam(mesh, ends),
                Shell::Ball { centre, radius } => DOME.append_ball(mesh, centre, radius),
            }
        }
        Ok(meshed)
    }

    fn shells(&self, positions: &[DVec3]) -> Result<(Vec<Shell>, Meshed), Fault> {
        let mut shells = Vec::with_capacity(self.beams.len());
        let mut meshed = Meshed { has_representation: self.has_representation, ..Meshed::default() };
        for &ends in &self.beams {
            let [first, second] = ends.map(|end| positions[end.vertex as usize]);
            let length = first.distance(second);
            if length < self.least_length || length == 0.0 {
                meshed.too_short += 1;
                continue;
            }
            meshed.meshed += 1;
            shells.push(Shell::Beam { ends });
            for [end, other] in [ends, [ends[1], ends[0]]] {
                if end.cap == Cap::Sphere && shows_whole_ball(end, other, length) {
                    shells.push(Shell::Ball { centre: positions[end.vertex as usize], radius: end.radius });
                }
            }
        }
        let balls = self.balls(positions.len())?;
        meshed.meshed += balls.len();
        let centre = |ball: &Ball| positions[ball.vertex as usize];
        shells.extend(balls.iter().map(|ball| Shell::Ball { centre: centre(ball), radius: ball.radius }));
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

/// Returns whether a whole ball at one end protrudes from the frustum, unlike half a ball: where the frustum grows
/// thinner behind it, or ends flat before the ball does.
fn shows_whole_ball(end: End, other: End, length: f64) -> bool {
    end.radius > other.radius || (end.radius > length && other.cap == Cap::Butt)
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

static DOME: LazyLock<Dome> = LazyLock::new(Dome::new);

/// A half ball of radius 1 about +z: the corners of its rings, from the pole to the equator, and its triangles,
/// counter-clockwise from outside.
struct Dome {
    corners: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Dome {
    fn new() -> Dome {
        // An equator of this radius has the area of the circle of radius 1.
        let sides = SIDES as f64;
        let equator = (TAU / (sides * (TAU / sides).sin())).sqrt();
        let triangles = Dome::numbered();
        let with_inner = |inner: f64| {
            let corners = (0..=RINGS).flat_map(|ring| {
                let (height, width) = (PI / 2.0 * (1.0 - ring as f64 / RINGS as f64)).sin_cos();
                let points = (6 * ring).max(1);
                (0..points).map(move |point| {
                    let (y, x) = (TAU * point as f64 / points as f64).sin_cos();
                    match ring {
                        RINGS => DVec3::new(x, y, 0.0) * equator,
                        _ => DVec3::new(x * width, y * width, height) * inner,
                    }
                })
            });
            Dome { corners: corners.collect(), triangles: triangles.clone() }
        };
        // The volume grows with the radius of the inner rings; bisection finds the one where it is that of half a ball.
        let (mut less, mut more) = (1.0, 1.1);
        loop {
            let middle = f64::midpoint(less, more);
            let dome = with_inner(middle);
            if middle <= less || middle >= more {
                return dome;
            }
            *(if dome.volume() < 2.0 / 3.0 * PI { &mut less } else { &mut more }) = middle;
        }
    }

    /// Numbers the triangles: each sextant between two rings is a row of them, point up and point down alternately.
    fn numbered() -> Vec<[u32; 3]> {
        let corner = |ring: usize, point: usize| {
            let first = if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
            (first + point % (6 * ring).max(1)) as u32
        };
        let mut triangles = Vec::with_capacity(6 * RINGS * RINGS);
        for ring in 0..RINGS {
            for sextant in 0..6 {
                let inner = |i: usize| corner(ring, sextant * ring + i);
                let outer = |i: usize| corner(ring + 1, sextant * (ring + 1) + i);
                triangles.extend((0..=ring).map(|i| [inner(i), outer(i), outer(i + 1)]));
                triangles.extend((0..ring).map(|i| [inner(i), outer(i + 1), inner(i + 1)]));
            }
        }
        triangles
    }

    /// Returns the volume over the plane of the equator, which contains the origin.
    fn volume(&self) -> f64 {
        let corners = self.triangles.iter().map(|triangle| triangle.map(|index| self.corners[index as usize]));
        corners.map(|[a, b, c]| a.dot(b.cross(c))).sum::<f64>() / 6.0
    }

    fn equator(&self) -> &[DVec3] {
        &self.corners[CAP_CORNERS..]
    }

    fn append_beam(&self, mesh: &mut TriangleMesh, ends: [End; 2]) {
        let [a, b] = ends.map(|end| mesh.positions[end.vertex as usize]);
        let axis = (b - a).normalize();
        let (u, v) = axis.any_orthonormal_pair();
        let first = mesh.positions.len() as u32;
        for (centre, end) in [a, b].into_iter().zip(ends) {
            mesh.positions.extend(self.equator().iter().map(|p| centre + (u * p.x + v * p.y) * end.radius));
        }
        let sides = SIDES as u32;
        for side in 0..sides {
            let next = (side + 1) % sides;
            let [a, a_next, b, b_next] = [side, next, sides + side, sides + next].map(|corner| first + corner);
            mesh.triangles.extend([[a, a_next, b_next], [a, b_next, b]]);
        }
        self.append_cap(mesh, a, [u, v, -axis], ends[0], first);
        self.append_cap(mesh, b, [u, v, axis], ends[1], first + sides);
    }

    fn append_ball(&self, mesh: &mut TriangleMesh, centre: DVec3, radius: f64) {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(self.equator().iter().map(|p| centre + p * radius));
        for pole in [DVec3::NEG_Z, DVec3::Z] {
            let end = End { vertex: first, radius, cap: Cap::Sphere };
            self.append_cap(mesh, centre, [DVec3::X, DVec3::Y, pole], end, first);
        }
    }

    /// Closes a ring of corners around `centre`, where `ring` is the first corner. The first two of `axes` are those of
    /// the ring and the last is the direction of the cap.
    fn append_cap(&self, mesh: &mut TriangleMesh, centre: DVec3, axes: [DVec3; 3], end: End, ring: u32) {
        let [u, v, pole] = axes;
        // A cap against the ring's own direction is a mirror image.
        let turned = |[a, b, c]: [u32; 3]| if u.cross(v).dot(pole) < 0.0 { [a, c, b] } else { [a, b, c] };
        if end.cap == Cap::Butt {
            let fan = (1..SIDES as u32 - 1).map(|corner| turned([ring, ring + corner, ring + corner + 1]));
            mesh.triangles.extend(fan);
            return;
        }
        let first = mesh.positions.len() as u32;
        let inner = &self.corners[..CAP_CORNERS];
        mesh.positions.extend(inner.iter().map(|p| centre + (u * p.x + v * p.y + pole * p.z) * end.radius));
        let count = CAP_CORNERS as u32;
        let corner = |index: u32| if index < count { first + index } else { ring + (index - count) };
        mesh.triangles.extend(self.triangles.iter().map(|triangle| turned(triangle.map(corner))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::check::check;

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

    #[track_caller]
    fn assert_solid(mesh: &TriangleMesh, volume: f64) {
        let report = check(mesh);
        assert!(report.is_solid(), "{:?}", report.defects());
        let found = mesh.signed_volume();
        assert!((found / volume - 1.0).abs() < 1e-12, "{found} is not {volume}");
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
    fn surfaces_deviate_by_the_documented_amount() {
        let dome = &*DOME;
        let farthest = dome.corners.iter().map(|corner| corner.length()).fold(0.0, f64::max);
        let mut nearest = f64::MAX;
        for triangle in &dome.triangles {
            let [a, b, c] = triangle.map(|index| dome.corners[index as usize]);
            // If the foot of the perpendicular from the centre lay outside the triangle, the distance would be larger.
            nearest = f64::min(nearest, (b - a).cross(c - a).normalize().dot(a));
        }
        assert!((1.024..1.025).contains(&farthest), "{farthest}");
        assert!((0.986..0.987).contains(&nearest), "{nearest}");
        let equator = dome.equator();
        assert!((equator[0].length() - 1.005_7).abs() < 1e-4, "{}", equator[0].length());
        let middle = equator[0].midpoint(equator[1]).length();
        assert!((middle - 0.997_1).abs() < 1e-4, "{middle}");
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
    fn meshed_balls_have_the_volume_of_a_ball() {
        let mut mesh = TriangleMesh::default();
        DOME.append_ball(&mut mesh, DVec3::new(3.0, 2.0, 1.0), RADIUS);
        assert_solid(&mesh, 4.0 / 3.0 * PI * RADIUS.powi(3));
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
