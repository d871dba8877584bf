//! Bodies on one lattice, where they meet, and the winding numbers on them.

use rayon::prelude::*;

use super::bodies::{Bodies, Body, Lattice, Wholeness};
use super::coincident::{self, Coincident};
use super::crossings::Crossings;
use super::near::NearFaces;
use super::pieces::Pieces;
use super::segments::{Meeting, Segment, meet};
use super::sums::Sums;
use super::triple::Triples;
use super::windings::Windings;
use super::{ExactProperties, NotExact, Rule, Source, fronts, growth, result};
use crate::boolean::Expression;
use crate::box_tree::Box32;
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
    /// A solid that is not consistently oriented, or of which a face near another body has no area.
    pub fn of(
        solids: &[&ClosedMesh],
        wholeness: &[Wholeness],
        growing_for: Option<&Expression>,
    ) -> Result<Arrangement, NotExact> {
        let bounds = solids.iter().map(|mesh| mesh.bounds()).reduce(Aabb::union).expect("an expression has inputs");
        let lattice = Lattice::around(bounds);
        let mut bodies = Bodies::default();
        let rates = growing_for.map(|expression| growth::rates(expression, solids.len()));
        for (input, (mesh, &wholeness)) in solids.iter().zip(wholeness).enumerate() {
            let rate = rates.as_ref().map(|rates| rates[input]);
            bodies.add(input, mesh, &lattice, wholeness, rate).map_err(|why| NotExact { input, why })?;
            checkpoint();
        }
        let (segments, coincident) = find_meetings(&bodies)?;
        let crossings = Crossings::of(&segments, &bodies);
        checkpoint();
        let windings = Windings::of(&bodies, solids.len(), &crossings);
        // Three faces of different bodies meet.
        let triples = match bodies.bodies.len() {
            0..=2 => Triples::default(),
            _ => Triples::of(&segments, &crossings, &bodies),
        };
        Ok(Arrangement { solids: solids.len(), lattice, bodies, segments, coincident, crossings, triples, windings })
    }

    /// Returns the first reason of each solid why a winding number on which the result depends is not proved.
    pub fn unproved(&self, rule: &Rule) -> Vec<NotExact> {
        let mut is_crossed = vec![false; self.bodies.faces.len()];
        self.segments.iter().flat_map(|segment| segment.faces).for_each(|face| is_crossed[face as usize] = true);
        let reason = |(own, body): (usize, &Body)| {
            checkpoint();
            let why = fronts::prove(own, &self.bodies, &is_crossed, &self.windings, rule).err()?;
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

/// Returns the segments in which faces of different bodies meet, and the pairs of faces that coincide.
///
/// # Errors
/// A face without area near another body.
fn find_meetings(bodies: &Bodies) -> Result<(Vec<Segment>, Vec<Coincident>), NotExact> {
    let all = &bodies.bodies;
    // Only faces near another body can meet one.
    let tree = |own: usize| {
        checkpoint();
        let others = (0..all.len()).filter(|&other| other != own && all[other].extent.touches(&all[own].extent));
        let around = others.map(|other| all[other].extent).reduce(Box32::union)?;
        let faces = all[own].faces.clone().into_par_iter().map(|face| (face, Box32::around(bodies.corners(face))));
        let faces: Vec<_> = faces.filter(|(_, extent)| extent.touches(&around)).collect();
        (!faces.is_empty()).then(|| NearFaces::new(faces))
    };
    let trees: Vec<Option<NearFaces>> = (0..all.len()).map(tree).collect();
    for (body, tree) in all.iter().zip(&trees) {
        let flat = tree.as_ref().and_then(|tree| tree.faces().find_first(|&face| bodies.plane(face).is_flat()));
        if let Some(face) = flat {
            let why = body.as_given(Unproved::Flat { triangle: (face - body.faces.start) as usize });
            return Err(NotExact { input: body.solid, why });
        }
    }
    let (mut segments, mut coincident) = (Vec::new(), Vec::new());
    for (i, first) in trees.iter().enumerate() {
        for (j, second) in trees.iter().enumerate().skip(i + 1) {
            let (Some(first), Some(second)) = (first, second) else { continue };
            if !all[i].extent.touches(&all[j].extent) {
                continue;
            }
            let found = first.pairs(second, |f, g| meet([f, g], &bodies.plane(f), &bodies.plane(g)));
            for meeting in found {
                match meeting {
                    Meeting::Segment(segment) => segments.push(segment),
                    Meeting::Coincident(pair) => coincident.push(pair),
                }
            }
        }
    }
    Ok((segments, coincident))
}
