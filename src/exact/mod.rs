//! Exact volumes, areas and moments of Boolean expressions over closed meshes, without a mesh of the result.
//!
//! # Method
//! The divergence theorem turns the volume of a solid into a sum over its surface, and Green's theorem turns the sum over a plane
//! piece of surface into one over the pieces of its outline. So the pieces may be summed in any order, and no topology of the
//! result is built (Franklin, "UNION3: mass properties of the union of millions of identical cubes", 2005):
//! - The surface of the result consists of parts of faces of the inputs. On a face, the part is bounded by parts of the
//!   face's sides and of the segments in which other faces meet it.
//! - With o a corner of the face, a piece of outline from p to q contributes the triangle (o, p, q), with the change of the result
//!   across the piece as its weight. The weighted triangles of all faces form a closed chain, so their divergence sums
//!   ([`MassProperties`]) are those of the result.
//! - A change depends only on the winding numbers beside the piece. Those at points come from one ray per connected surface
//!   and the crossings of edges (`windings`); along an edge or a segment they change by one at each crossing.
//!
//! # Why it is exact
//! Coordinates are rounded to a lattice of 2^40 steps along the longest side, which keeps nearly every `f32`. From there
//! on, every decision is the sign of an integer (`signs`). Bodies are displaced by infinitesimal vectors, so that no decision is a
//! tie: coincident faces and touching edges need no cases. The volume is continuous in the displacements; so it is
//! that of the solids as given. Positions and sums are rounded in `f64`, and the bound of that error is returned.
//!
//! # What it takes
//! Consistently oriented meshes. A body is a mesh whose winding numbers are proved to be 0 and 1 ([`prove_simple`]), or
//! else each shell of one; a shell that meets itself is refused.

mod bodies;
mod coincident;
mod crossings;
mod near;
mod segments;
mod signs;
mod sums;
mod triple;
mod windings;

use std::fmt;

use bodies::{Bodies, Lattice, Wholeness};
use coincident::Coincident;
use near::NearFaces;
use rayon::prelude::*;
use segments::{Meeting, Segment, meet};
use signs::Plane;
use sums::Sums;

use crate::boolean::Expression;
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::ldi::FillRule;
use crate::mesh::{Aabb, ClosedMesh, MassProperties, Unproved, prove_simple};

/// The reason why the volume of an expression is not known exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotExact {
    /// The index of the input.
    pub input: usize,
    /// The reason why its winding numbers are not proved.
    pub why: Unproved,
}

impl fmt::Display for NotExact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "input {}: {}", self.input + 1, self.why)
    }
}

/// The exact properties of the result of an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactProperties {
    /// Volume, area, centroid and inertia. [`MassProperties::volume_rounding`] bounds the rounding of coordinates, of positions and
    /// of sums.
    pub mass: MassProperties,
    /// A bound on the error of the area, from coincident faces of more than two shells, whose order is not defined.
    pub area_error: f64,
    /// The inputs whose shells overlap or touch, so that the fill rules may differ.
    pub with_meeting_shells: Vec<usize>,
}

/// Returns volume, area, centroid and inertia of an expression over closed meshes, whose unit is the same.
///
/// The result does not depend on threads. The order of triangles changes it within the rounding that it states.
///
/// # Errors
/// An input whose winding numbers are not proved to be 0 and 1, and of which a shell meets itself.
///
/// # Panics
/// Panics if there is no input, or if the expression refers to one that does not exist.
pub fn mass_properties(
    inputs: &[&ClosedMesh],
    expression: &Expression,
    fill: FillRule,
) -> Result<ExactProperties, NotExact> {
    let bounds = inputs.iter().map(|mesh| mesh.bounds()).reduce(Aabb::union).expect("an expression has inputs");
    let lattice = Lattice::around(bounds);
    let mut bodies = Bodies::default();
    let mut with_meeting_shells = Vec::new();
    for (input, mesh) in inputs.iter().enumerate() {
        let wholeness = bodies.add(input, mesh, &lattice).map_err(|why| NotExact { input, why })?;
        if wholeness == Wholeness::Shells {
            with_meeting_shells.push(input);
        }
    }
    checkpoint();
    let plane = |face: u32| Plane::new(bodies.corners(face), bodies.body_of_face(face));
    let (segments, coincident) = find_meetings(&bodies, &plane);
    let rule = Rule { expression, fill };
    let sums = Sums::of(&bodies, inputs.len(), &segments, &rule, &plane);
    let mut mass = sums.mass_properties(&lattice, bodies.displaced);
    let square = lattice.step * lattice.step;
    let mut area_error = 0.0;
    match &bodies.bodies[..] {
        [first, second] => {
            mass.area += square * coincident::area_change(&coincident, [first, second], &rule, inputs.len())
        }
        _ => area_error = 2.0 * square * coincident.iter().map(|pair| pair.area).sum::<f64>(),
    }
    Ok(ExactProperties { mass, area_error, with_meeting_shells })
}

/// Returns volume, area, centroid and inertia of one solid: from the sums over its triangles if its winding numbers are
/// proved to be 0 and 1, else as [`mass_properties`] of its shells.
///
/// # Errors
/// A mesh of which a shell meets itself, or which is not consistently oriented.
pub fn of_solid(mesh: &ClosedMesh, fill: FillRule) -> Result<ExactProperties, NotExact> {
    match prove_simple(mesh) {
        Ok(()) => {
            let mut mass = mesh.mass_properties();
            // Inside-out, a whole solid is the same solid.
            let sign = mass.volume.signum();
            (mass.volume, mass.inertia) = (sign * mass.volume, sign * mass.inertia);
            Ok(ExactProperties { mass, area_error: 0.0, with_meeting_shells: Vec::new() })
        }
        Err(Unproved::TrianglesMeet { .. } | Unproved::ShellFacing { .. }) => {
            mass_properties(&[mesh], &Expression::input(0), fill)
        }
        Err(why) => Err(NotExact { input: 0, why }),
    }
}

/// The rule that decides about a point from its winding numbers.
struct Rule<'e> {
    expression: &'e Expression,
    fill: FillRule,
}

impl Rule<'_> {
    fn holds(&self, windings: &[i32]) -> bool {
        self.expression.holds(|input| match self.fill {
            FillRule::EvenOdd => windings[input] & 1 != 0,
            FillRule::NonZero => windings[input] != 0,
        })
    }
}

/// Returns the segments in which faces of different bodies meet, and the pairs of faces that coincide.
fn find_meetings(bodies: &Bodies, plane: &(impl Fn(u32) -> Plane + Sync)) -> (Vec<Segment>, Vec<Coincident>) {
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
    let (mut segments, mut coincident) = (Vec::new(), Vec::new());
    for (i, first) in trees.iter().enumerate() {
        for (j, second) in trees.iter().enumerate().skip(i + 1) {
            let (Some(first), Some(second)) = (first, second) else { continue };
            if !all[i].extent.touches(&all[j].extent) {
                continue;
            }
            let found = first.pairs(second, |f, g| meet([f, g], &plane(f), &plane(g)));
            for meeting in found {
                match meeting {
                    Meeting::Segment(segment) => segments.push(segment),
                    Meeting::Coincident(pair) => coincident.push(pair),
                }
            }
        }
    }
    (segments, coincident)
}
