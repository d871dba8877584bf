//! Bodies on one lattice, where they meet, and the winding numbers on them.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;

use super::bodies::{Bodies, Body, Lattice, Region, Wholeness};
use super::coincident::{self, Coincident};
use super::crossings::Crossings;
use super::near::Near;
use super::numbers::Numbers;
use super::pieces::Pieces;
use super::result::Surface;
use super::segments::{Meeting, Segment, meet, meet_beyond};
use super::signs::Plane;
use super::stars::Stars;
use super::sums::Sums;
use super::triple::Triples;
use super::windings::Windings;
use super::{Growth, NotExact, Rule, fronts, growth, result};
use crate::boolean::Expression;
use crate::cancel::checkpoint;
use crate::mesh::meet::{are_parted, widest_axis};
use crate::mesh::{self, Aabb, ClosedMesh, MassProperties, Unproved};
use crate::surface::Coordinates;

/// How far a crossing may be from faces as given, in lattice steps: half a step along each axis, as points are rounded to the lattice,
/// and 2^-46 of an edge, which is no longer than 2^41 steps.
const ERROR: f64 = 0.9;

/// The surfaces of all solids.
pub(super) struct Arrangement {
    solids: usize,
    lattice: Lattice,
    bodies: Bodies,
    segments: Vec<Segment>,
    coincident: Vec<Coincident>,
    /// For each solid, the area in which faces of one body overlap, in square lattice steps.
    pub own_overlaps: Vec<f64>,
    crossings: Crossings,
    triples: Triples,
    windings: Windings,
    /// For each body, the faces that were proved here to meet no others of it and to have its winding number in front.
    pub proved: Vec<Vec<bool>>,
}

impl Arrangement {
    /// Finds where the solids of an expression meet. If they grow, then at the rates that suit it, so that its result has as few walls
    /// without thickness as can be.
    ///
    /// # Errors
    /// A solid that is not consistently oriented, or with a face without area whose box touches that of a face of another body.
    pub fn of(
        solids: &[&ClosedMesh],
        wholeness: &[Wholeness],
        expression: &Expression,
        growth: Growth,
    ) -> Result<(Arrangement, Vec<Option<Near>>), NotExact> {
        let bounds = solids.iter().map(|mesh| mesh.bounds()).reduce(Aabb::union).expect("an expression has inputs");
        let lattice = Lattice::around(bounds);
        let mut bodies = Bodies::with_room_for(solids, Region::of(expression, solids, &lattice));
        let rates = (growth == Growth::Growing).then(|| growth::rates(expression, solids.len()));
        for (input, (mesh, &wholeness)) in solids.iter().zip(wholeness).enumerate() {
            let rate = rates.as_ref().map(|rates| rates[input]);
            bodies.add(input, mesh, &lattice, wholeness, rate).map_err(|why| NotExact { input, why })?;
            checkpoint();
        }
        let near: Vec<Option<Near>> =
            (0..bodies.bodies.len()).into_par_iter().map(|own| Near::of(own, &bodies)).collect();
        let (mut segments, coincident) = find_meetings(&bodies, &near)?;
        let mut own_overlaps = vec![0.0; solids.len()];
        for meeting in find_own_meetings(&bodies, &near) {
            segments.extend(meeting.segment);
            own_overlaps[meeting.solid] += meeting.overlap;
        }
        let crossings = Crossings::of(&segments, &bodies);
        checkpoint();
        let stars = Stars::of(&segments, &bodies);
        let windings = Windings::of(&bodies, solids.len(), (&crossings, stars), &near);
        let has_crossed = bodies.bodies.iter().any(|body| body.is_crossed);
        // Three faces meet of different bodies, or of one that meets itself.
        let triples = match bodies.bodies.len() {
            0..=2 if !has_crossed => Triples::default(),
            _ => Triples::of(&segments, &crossings, &bodies),
        };
        if let Some(face) = bodies.touching_face() {
            return Err(bodies.refusal(face, |triangle| Unproved::Touches { triangle }));
        }
        let found = Arrangement {
            solids: solids.len(),
            lattice,
            bodies,
            segments,
            coincident,
            own_overlaps,
            crossings,
            triples,
            windings,
            proved: Vec::new(),
        };
        Ok((found, near))
    }

    /// Proves the winding numbers on which the result depends, and returns the first reason of each solid why one is not proved.
    /// Faces that were proved in `resting`, which has the same bodies before they grew, need no second proof: whether faces of one body
    /// meet, and what is in front of them, is decided by their corners as given, and growth moves no corner by more than an
    /// infinitesimal.
    pub fn prove(&mut self, near: &[Option<Near>], rule: &Rule, resting: Option<&Arrangement>) -> Vec<NotExact> {
        let mut is_met = vec![false; self.bodies.faces.len()];
        self.segments.iter().flat_map(|segment| segment.faces).for_each(|face| is_met[face as usize] = true);
        let outside = Numbers::of(rule, self.solids);
        let prove = |(own, body): (usize, &Body)| {
            checkpoint();
            if body.is_crossed {
                return Ok(Vec::new());
            }
            let known = resting.map(|resting| &resting.proved[own][..]);
            fronts::prove(own, &self.bodies, near[own].as_ref(), (&is_met, &self.windings), &outside, known)
                .map_err(|why| NotExact { input: body.solid, why: body.as_given(why) })
        };
        let found: Vec<Result<Vec<bool>, NotExact>> = self.bodies.bodies.par_iter().enumerate().map(prove).collect();
        let (mut proved, mut unproved) = (Vec::new(), Vec::new());
        for found in found {
            match found {
                Ok(faces) => proved.push(faces),
                Err(why) => unproved.push(why),
            }
        }
        self.proved = proved;
        unproved.dedup_by_key(|unproved: &mut NotExact| unproved.input);
        unproved
    }

    /// Returns whether faces of different bodies coincide.
    pub fn has_coincident_faces(&self) -> bool {
        !self.coincident.is_empty()
    }

    /// Returns the length of a step of the lattice.
    pub fn step(&self) -> f64 {
        self.lattice.step
    }

    /// Returns which faces meet another one that they lie on, or almost on: none of its corners is farther than a distance from the
    /// other's plane.
    pub fn lies_on_another(&self, distance: f64) -> Vec<bool> {
        let steps = distance / self.lattice.step;
        let lies_on = |face: u32, other: u32| {
            let (corners, [a, b, c]) = (self.bodies.corners(face), self.bodies.corners(other));
            let normal = (b - a).cross(c - a).normalize_or_zero();
            corners.iter().all(|corner| normal.dot(*corner - a).abs() <= steps)
        };
        let found = self.segments.par_iter().with_min_len(1 << 10).map(|segment| segment.faces);
        let found = found.filter(|&[f, g]| lies_on(f, g) || lies_on(g, f));
        let mut is_on = vec![false; self.bodies.faces.len()];
        let coincident = self.coincident.iter().map(|pair| pair.faces);
        coincident.chain(found.collect::<Vec<_>>()).flatten().for_each(|face| is_on[face as usize] = true);
        is_on
    }

    fn pieces(&self, rule: &Rule) -> Pieces<'_> {
        let Arrangement { bodies, segments, crossings, triples, windings, .. } = self;
        Pieces::of(bodies, segments, (crossings, triples), windings, rule)
    }

    /// Returns the surface of the result, once nothing is unproved. The solids are those of the arrangement. `None` if outlines do not
    /// close, which happens only to proved bodies that touch themselves while they grow.
    pub fn surface(&self, rule: &Rule, solids: &[&ClosedMesh], coordinates: Coordinates) -> Option<Surface> {
        let pieces = self.pieces(rule);
        let Coordinates { precision, offset } = coordinates;
        let place = |vertex: u32| {
            let position = match self.bodies.given_vertex(vertex) {
                Some((solid, index)) => solids[solid].mesh().positions[index as usize],
                None => self.lattice.position(pieces.position(vertex).at),
            };
            precision.round(position - offset)
        };
        result::surface(&pieces, place, (precision, ERROR * self.lattice.step))
    }

    /// Returns the properties of the result, once nothing is unproved, and a bound on the error of the area.
    pub fn mass_properties(&self, rule: &Rule) -> (MassProperties, f64) {
        let bodies = &self.bodies;
        let sums = Sums::of(&self.pieces(rule));
        let mut mass = sums.mass_properties(&self.lattice, bodies);
        let square = self.lattice.step * self.lattice.step;
        let mut area_error = 0.0;
        match &bodies.bodies[..] {
            [first, second] if !first.is_crossed && !second.is_crossed => {
                // Across a face on which the result does not depend, and whose own number is not proved, nothing changes: so what
                // lies on it counts once as it is.
                let is_proved = |pair: &&Coincident| {
                    let of_body = |body: usize| (pair.faces[body] - bodies.bodies[body].faces.start) as usize;
                    (0..2).all(|body| self.proved[body][of_body(body)])
                };
                let pairs = self.coincident.iter().filter(is_proved);
                mass.area += square * coincident::area_change(pairs, [first, second], rule, self.solids)
            }
            _ => {
                let own_overlap = self.own_overlaps.iter().sum::<f64>();
                let overlap = own_overlap + self.coincident.iter().map(|pair| pair.area).sum::<f64>();
                area_error = 2.0 * square * overlap;
            }
        }
        (mass, area_error)
    }
}

/// Returns where faces of different bodies meet.
///
/// # Errors
/// A face without area whose box touches that of another body's face.
fn find_meetings(bodies: &Bodies, near: &[Option<Near>]) -> Result<(Vec<Segment>, Vec<Coincident>), NotExact> {
    let all = &bodies.bodies;
    let least_flat = AtomicU32::new(u32::MAX);
    let plane = |face: u32| {
        let plane = bodies.plane(face);
        if plane.is_flat() && !all[plane.body as usize].is_crossed {
            least_flat.fetch_min(face, Ordering::Relaxed);
            return None;
        }
        Some((face, plane))
    };
    type Prepared<'b> = Option<(u32, Plane<'b>)>;
    let look = |first: &Prepared, second: &Prepared| {
        let ((f, plane_of_f), (g, plane_of_g)) = (first.as_ref()?, second.as_ref()?);
        meet([*f, *g], plane_of_f, plane_of_g)
    };
    let (mut segments, mut coincident) = (Vec::new(), Vec::new());
    for (i, first) in near.iter().enumerate() {
        for (j, second) in near.iter().enumerate().skip(i + 1) {
            let (Some(first), Some(second)) = (first, second) else { continue };
            if !all[i].extent.touches(&all[j].extent) {
                continue;
            }
            for meeting in first.tree.pairs(&second.tree, plane, look) {
                match meeting {
                    Meeting::Segment(segment) => segments.push(segment),
                    Meeting::Coincident(pair) => coincident.push(pair),
                }
            }
        }
    }
    match least_flat.into_inner() {
        u32::MAX => Ok((segments, coincident)),
        face => Err(bodies.refusal(face, |triangle| Unproved::Flat { triangle })),
    }
}

/// Two faces of one body that meet elsewhere than in a corner or a side that they share, before the body trembles.
struct OwnMeeting {
    /// The solid of the body.
    solid: usize,
    /// The segment in which they meet once it trembles.
    segment: Option<Segment>,
    /// The area in which they overlap if they are coplanar, in square lattice steps.
    overlap: f64,
}

/// Returns where faces of bodies that meet themselves meet.
fn find_own_meetings(bodies: &Bodies, near: &[Option<Near>]) -> Vec<OwnMeeting> {
    let mut found = Vec::new();
    for (body, near) in bodies.bodies.iter().zip(near).filter(|(body, _)| body.is_crossed) {
        checkpoint();
        let all;
        let tree = match near.as_ref().and_then(Near::whole) {
            Some(tree) => tree,
            None => {
                all = bodies.tree(body);
                &all
            }
        };
        let prepare = |place: usize| {
            let face = tree.faces()[place];
            (face, bodies.plane(face))
        };
        let look = |(f, plane_of_f): &(u32, Plane), (g, plane_of_g): &(u32, Plane)| {
            if plane_of_f.is_beside(plane_of_g) || plane_of_g.is_beside(plane_of_f) {
                return None;
            }
            let (f, g, planes) = (*f, *g, [plane_of_f, plane_of_g]);
            let [of_f, of_g] = [f, g].map(|face| bodies.faces[face as usize]);
            let shared = of_g.map(|point| of_f.iter().position(|&own| own == point).unwrap_or(3));
            let corners = planes.map(Plane::positions);
            if are_parted(&corners[0], &corners[1], shared, widest_axis(corners[0])) {
                return None;
            }
            let place_of = |point: u32| bodies.points[point as usize];
            // The test is not one for faces without area.
            if !planes.iter().any(|plane| plane.is_flat()) && !mesh::meet::meet(of_f, of_g, place_of) {
                return None;
            }
            let sharing: Vec<usize> = (0..3).filter(|&corner| shared[corner] < 3).collect();
            let segment = match sharing[..] {
                [] => match meet([f, g], planes[0], planes[1]) {
                    Some(Meeting::Segment(segment)) => Some(segment),
                    _ => None,
                },
                [corner] => meet_beyond([f, g], planes, [shared[corner], corner]),
                // Faces that share a side are not folded flat once they tremble.
                _ => None,
            };
            let overlap = coincident::overlap(planes[0], planes[1]).map_or(0.0, |overlap| overlap.area);
            Some(OwnMeeting { solid: body.solid, segment, overlap })
        };
        found.extend(tree.own_pairs(|_| true, prepare, look));
    }
    found
}
