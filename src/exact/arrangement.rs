//! Bodies on one lattice, where they meet, and the winding numbers on them.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::parallel::*;

use super::bodies::{Bodies, Body, Lattice, Wholeness};
use super::coincident::{self, Coincident};
use super::crossings::Crossings;
use super::near::Near;
use super::pieces::Pieces;
use super::segments::{Meeting, Segment, meet};
use super::signs::Plane;
use super::sums::Sums;
use super::triple::Triples;
use super::windings::Windings;
use super::{ExactProperties, NotExact, Rule, Source, fronts, growth, result};
use crate::boolean::Expression;
use crate::cancel::checkpoint;
use crate::mesh::{Aabb, ClosedMesh, TriangleMesh, Unproved};
use crate::surface::Coordinates;

/// The surfaces of all solids.
pub(super) struct Arrangement {
    solids: usize,
    lattice: Lattice,
    bodies: Bodies,
    segments: Vec<Segment>,
    coincident: Vec<Coincident>,
    crossings: Crossings,
    triples: Triples,
    windings: Windings,
}

impl Arrangement {
    /// Finds where the solids meet. With an expression they grow at the rates that suit it, so that its result has as few walls
    /// without thickness as can be.
    ///
    /// # Errors
    /// A solid that is not consistently oriented, or with a face without area whose box touches that of a face of another body.
    pub fn of(
        solids: &[&ClosedMesh],
        wholeness: &[Wholeness],
        growing_for: Option<&Expression>,
    ) -> Result<(Arrangement, Vec<Option<Near>>), NotExact> {
        let bounds = solids.iter().map(|mesh| mesh.bounds()).reduce(Aabb::union).expect("an expression has inputs");
        let lattice = Lattice::around(bounds);
        let mut bodies = Bodies::with_room_for(solids);
        let rates = growing_for.map(|expression| growth::rates(expression, solids.len()));
        for (input, (mesh, &wholeness)) in solids.iter().zip(wholeness).enumerate() {
            let rate = rates.as_ref().map(|rates| rates[input]);
            bodies.add(input, mesh, &lattice, wholeness, rate).map_err(|why| NotExact { input, why })?;
            checkpoint();
        }
        let near: Vec<Option<Near>> =
            (0..bodies.bodies.len()).into_par_iter().map(|own| Near::of(own, &bodies)).collect();
        let (segments, coincident) = find_meetings(&bodies, &near)?;
        let crossings = Crossings::of(&segments, &bodies);
        checkpoint();
        let windings = Windings::of(&bodies, solids.len(), &crossings, &near);
        // Three faces of different bodies meet.
        let triples = match bodies.bodies.len() {
            0..=2 => Triples::default(),
            _ => Triples::of(&segments, &crossings, &bodies),
        };
        let found =
            Arrangement { solids: solids.len(), lattice, bodies, segments, coincident, crossings, triples, windings };
        Ok((found, near))
    }

    /// Returns the first reason of each solid why a winding number on which the result depends is not proved.
    pub fn unproved(&self, near: &[Option<Near>], rule: &Rule) -> Vec<NotExact> {
        let mut is_crossed = vec![false; self.bodies.faces.len()];
        self.segments.iter().flat_map(|segment| segment.faces).for_each(|face| is_crossed[face as usize] = true);
        let reason = |(own, body): (usize, &Body)| {
            checkpoint();
            let why =
                fronts::prove(own, &self.bodies, near[own].as_ref(), (&is_crossed, &self.windings), rule).err()?;
            Some(NotExact { input: body.solid, why: body.as_given(why) })
        };
        let mut found: Vec<NotExact> = self.bodies.bodies.par_iter().enumerate().filter_map(reason).collect();
        found.dedup_by_key(|unproved| unproved.input);
        found
    }

    /// Returns whether faces of different bodies coincide.
    pub fn has_coincident_faces(&self) -> bool {
        !self.coincident.is_empty()
    }

    fn pieces<'a>(&'a self, rule: &'a Rule) -> Pieces<'a> {
        let Arrangement { bodies, segments, crossings, triples, windings, .. } = self;
        Pieces::of(bodies, segments, (crossings, triples), windings, rule)
    }

    /// Returns the surface of the result, once nothing is unproved, with the source of each triangle. The solids are those of the
    /// arrangement. `None` if outlines do not close, which happens only to bodies that touch themselves while they grow.
    pub fn surface(
        &self,
        rule: &Rule,
        solids: &[&ClosedMesh],
        coordinates: Coordinates,
    ) -> Option<(TriangleMesh, Vec<Source>)> {
        let pieces = self.pieces(rule);
        let Coordinates { precision, offset } = coordinates;
        let place = |vertex: u32| {
            let position = match self.bodies.given_vertex(vertex) {
                Some((solid, index)) => solids[solid].mesh().positions[index as usize],
                None => self.lattice.position(pieces.position(vertex).at),
            };
            precision.round(position - offset)
        };
        result::surface(&pieces, place, precision)
    }

    /// Returns the properties of the result, once nothing is unproved.
    pub fn properties(&self, rule: &Rule) -> ExactProperties {
        let bodies = &self.bodies;
        let sums = Sums::of(&self.pieces(rule));
        let mut mass = sums.mass_properties(&self.lattice, bodies.displaced);
        let square = self.lattice.step * self.lattice.step;
        let mut area_error = 0.0;
        match &bodies.bodies[..] {
            [first, second] => {
                mass.area += square * coincident::area_change(&self.coincident, [first, second], rule, self.solids)
            }
            _ => area_error = 2.0 * square * self.coincident.iter().map(|pair| pair.area).sum::<f64>(),
        }
        ExactProperties { mass, area_error, with_meeting_shells: Vec::new() }
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
        match plane.is_flat() {
            true => _ = least_flat.fetch_min(face, Ordering::Relaxed),
            false => return Some((face, plane)),
        }
        None
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
        face => {
            let body = &all[bodies.body_of_face(face) as usize];
            let why = body.as_given(Unproved::Flat { triangle: (face - body.faces.start) as usize });
            Err(NotExact { input: body.solid, why })
        }
    }
}
