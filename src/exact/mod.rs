//! Exact volumes, areas, moments and meshes of Boolean expressions over closed meshes.
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
//! The mesh of the result follows from the same pieces (`result`): faces at which nothing changes are kept whole, and of the others
//! the outlines of the parts that bound the result are triangulated (`cut`).
//!
//! # Why it is exact
//! Coordinates are rounded to a lattice of 2^40 steps along the longest side, which keeps nearly every `f32`. From there
//! on, every decision is the sign of an integer (`signs`). Bodies are displaced by infinitesimal vectors, so that no decision is a
//! tie: coincident faces and touching edges need no cases. The volume is continuous in the displacements; so it is
//! that of the solids as given. Positions and sums are rounded in `f64`, and the bound of that error is returned.
//!
//! # What it takes
//! Consistently oriented meshes. A body is a mesh whose winding number is proved to be 0 and 1 wherever the result
//! depends on it (`fronts`), or else each shell of one. Where shells meet themselves, or have triangles without area near others, the
//! segments in which triangles of one shell meet count as well (`crossed`, `stars`), and its own winding number is found like those of
//! others.

mod arrangement;
mod bodies;
mod coincident;
mod common;
mod crossed;
mod crossings;
mod cut;
mod fronts;
mod growth;
mod lines;
mod near;
mod numbers;
mod pieces;
mod polynomial;
mod result;
mod segments;
mod signs;
mod stars;
mod sums;
mod triple;
mod windings;

use std::fmt;

use arrangement::Arrangement;
use bodies::Wholeness;

use result::Surface;

pub use result::Source;

use glam::DVec3;

use crate::boolean::{Expression, box_volume};
use crate::cancel::checkpoint;
use crate::ldi::FillRule;
use crate::mesh::{Aabb, ClosedMesh, MassProperties, Precision, TriangleMesh, Unproved, prove_simple};
use crate::surface::{Apart, Coordinates, remove_flat, snap, take_apart};

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
    /// The least and the greatest volume that this rounding and the boxes of the inputs allow.
    pub possible: [f64; 2],
    /// A bound on the error of the area, from coincident faces of one shell or of more than two, whose order is not defined.
    pub area_error: f64,
    /// The inputs whose shells overlap, touch or meet themselves, or have triangles without area, so that the fill rules may differ.
    pub with_meeting_shells: Vec<usize>,
}

impl ExactProperties {
    /// Returns the properties of a solid that lies in a box of the given volume.
    fn within(greatest: f64, mut mass: MassProperties, area_error: f64, with_meeting_shells: Vec<usize>) -> Self {
        let MassProperties { volume, volume_rounding: rounding, .. } = mass;
        let mut possible = [volume - rounding, volume + rounding];
        // Nothing is known of what exceeds the range of f64.
        if possible.iter().all(|end| end.is_finite()) {
            // The box is rounded, too.
            let inside = |volume: f64| volume.max(0.0).min(greatest * (1.0 + 8.0 * f64::EPSILON));
            possible = possible.map(inside);
            mass.volume = inside(volume);
            mass.volume_rounding = rounding.min((mass.volume - possible[0]).max(possible[1] - mass.volume));
        }
        ExactProperties { mass, possible, area_error, with_meeting_shells }
    }
}

/// Returns volume, area, centroid and inertia of an expression over closed meshes, whose unit is the same.
///
/// # Errors
/// See [`Solution::of`].
///
/// # Panics
/// See [`Solution::of`].
pub fn mass_properties(
    inputs: &[&ClosedMesh],
    expression: &Expression,
    fill: FillRule,
) -> Result<ExactProperties, NotExact> {
    Ok(Solution::of(inputs, expression, fill)?.properties())
}

/// The solid of an expression over closed meshes, whose unit is the same: where their surfaces meet, and what lies on either side.
///
/// It does not depend on threads. The order of triangles changes the properties within the rounding that they state.
pub struct Solution<'a> {
    inputs: Distinct<'a>,
    /// Over the distinct inputs.
    expression: Expression,
    fill: FillRule,
    arrangement: Arrangement,
    wholeness: Vec<Wholeness>,
}

/// Thickness of walls and gaps that rounding may leave, in steps of the lattice.
const LATTICE_STEPS: f64 = 4.0;

/// The same in steps of the greatest coordinate of a file.
const FILE_STEPS: f64 = 8.0;

/// The surface of an expression's solid: a closed, oriented 2-manifold.
#[derive(Clone, Debug, Default)]
pub struct ExactMesh {
    /// The mesh. Vertices of inputs have the coordinates that they have there, rounded for the file.
    pub mesh: TriangleMesh,
    /// The source of each triangle.
    pub sources: Vec<Source>,
    /// Vertices that rounding let fall together.
    pub apart: Apart,
    /// What is taken for rounding.
    pub rounding: Rounding,
}

/// The thickness below which walls and gaps of an exact mesh are taken for rounding.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rounding {
    /// The thickness.
    pub thickness: f64,
    /// True if the numbers of the file round by more than the lattice.
    pub is_of_file: bool,
}

impl<'a> Solution<'a> {
    /// Finds where the surfaces meet: of each input as a whole, or, where its winding numbers are not proved to be 0 and 1, of its
    /// shells. Inputs with the same mesh are one.
    ///
    /// # Errors
    /// An input that is not consistently oriented. There may be others of which infinitesimal vectors drawn at random do not part what
    /// touches; none is known.
    ///
    /// # Panics
    /// Panics if there is no input, or if the expression refers to one that does not exist.
    pub fn of(inputs: &[&'a ClosedMesh], expression: &Expression, fill: FillRule) -> Result<Solution<'a>, NotExact> {
        let inputs = Distinct::of(inputs);
        let expression = expression.renumbered(|input| inputs.numbers[input]);
        let wholeness = vec![Wholeness::Whole; inputs.meshes.len()];
        Solution::of_bodies(inputs, expression, fill, wholeness)
    }

    fn of_bodies(
        inputs: Distinct<'a>,
        expression: Expression,
        fill: FillRule,
        mut wholeness: Vec<Wholeness>,
    ) -> Result<Solution<'a>, NotExact> {
        let rule = Rule { expression: &expression, fill };
        match proved(&inputs.meshes, rule, &mut wholeness, None) {
            Ok(arrangement) => Ok(Solution { inputs, expression, fill, arrangement, wholeness }),
            Err(NotExact { input, why }) => Err(NotExact { input: inputs.firsts[input], why }),
        }
    }

    fn rule(&self) -> Rule<'_> {
        Rule { expression: &self.expression, fill: self.fill }
    }

    /// Returns volume, area, centroid and inertia.
    pub fn properties(&self) -> ExactProperties {
        let has_meeting_shells = |&(_, &number): &(usize, &usize)| self.wholeness[number] != Wholeness::Whole;
        let numbers = self.inputs.numbers.iter().enumerate();
        let with_meeting_shells = numbers.filter(has_meeting_shells).map(|(input, _)| input).collect();
        let (mass, area_error) = self.arrangement.mass_properties(&self.rule());
        ExactProperties::within(box_volume(self.corners()), mass, area_error, with_meeting_shells)
    }

    /// Returns the least and the greatest corner of a box that contains the result; the least is not below the greatest if it is empty.
    pub fn corners(&self) -> [DVec3; 2] {
        self.expression.corners(|input| {
            let Aabb { min, max } = self.inputs.meshes[input].bounds();
            [min, max]
        })
    }

    /// Returns the inputs with a shell of which faces lie on one another. Their order is not defined: the area of the result is not
    /// exact, and its mesh may keep walls of no thickness between them, which cross others.
    pub fn with_own_overlaps(&self) -> Vec<usize> {
        let overlaps = &self.arrangement.own_overlaps;
        let numbers = self.inputs.numbers.iter().enumerate();
        numbers.filter(|(_, number)| overlaps[**number] > 0.0).map(|(input, _)| input).collect()
    }

    /// Returns the surface, with positions rounded for a file. Solids that touch in an edge or a vertex have vertices of their own
    /// there, and no two vertices have the same position: where rounding lets vertices fall together, they are merged, or moved
    /// apart by steps of the file's precision. Where faces coincide, one is taken to lie before the other, as it suits the
    /// expression. Walls and gaps that are no thicker than what rounding leaves, some steps of the lattice or of the file's numbers,
    /// mostly vanish, and so do vertices of cuts within flat parts and on straight edges. A few walls of no thickness may be left at
    /// saddles, and where several operations contradict each other.
    pub fn mesh(&self, coordinates: Coordinates) -> ExactMesh {
        let (rule, meshes) = (self.rule(), &self.inputs.meshes);
        let precision = coordinates.precision;
        let surface = |arrangement: &Arrangement| {
            let surface = arrangement.surface(&rule, meshes, coordinates)?;
            let rounding = self.rounding(&surface.mesh, precision);
            let is_on = arrangement.lies_on_another(rounding.thickness);
            let suspects = surface.faces.iter().map(|&face| is_on[face as usize]).collect();
            Some((surface, suspects, rounding))
        };
        let grown = || {
            let has_walls = self.arrangement.has_coincident_faces();
            let grown = || proved(meshes, rule, &mut self.wholeness.clone(), Some(&self.arrangement)).ok();
            surface(&has_walls.then(grown)??)
        };
        let (surface, suspects, rounding): (_, Vec<bool>, _) =
            grown().or_else(|| surface(&self.arrangement)).expect("outlines of bodies at rest are closed");
        let Surface { mut mesh, mut sources, first_of_cuts, .. } = surface;
        checkpoint();
        sources.iter_mut().for_each(|source| source.input = self.inputs.firsts[source.input as usize] as u32);
        let distance = rounding.thickness;
        let first_of_cuts = snap(&mut mesh, &mut sources, (first_of_cuts, suspects), distance, precision);
        remove_flat(&mut mesh, &mut sources, first_of_cuts, 0.5 * distance, |source| source.input);
        let apart = take_apart(&mut mesh, &mut sources, precision);
        ExactMesh { mesh, sources, apart, rounding }
    }

    /// Returns what is taken for rounding in a surface: some steps of the lattice, or of the numbers in a file.
    fn rounding(&self, surface: &TriangleMesh, precision: Precision) -> Rounding {
        let farthest = surface.bounds().map_or(0.0, |bounds| bounds.min.abs().max(bounds.max.abs()).max_element());
        let (lattice, file) = (LATTICE_STEPS * self.arrangement.step(), FILE_STEPS * precision.epsilon() * farthest);
        Rounding { thickness: lattice.max(file), is_of_file: file > lattice }
    }
}

/// Returns volume, area, centroid and inertia of one solid: from the sums over its triangles if its winding numbers are
/// proved to be 0 and 1, else as [`mass_properties`] of its shells.
///
/// # Errors
/// A mesh that is not consistently oriented, or encloses no volume; see [`Solution::of`].
pub fn of_solid(mesh: &ClosedMesh, fill: FillRule) -> Result<ExactProperties, NotExact> {
    match prove_simple(mesh) {
        Ok(()) => {
            let mut mass = mesh.mass_properties();
            // Inside-out, a whole solid is the same solid.
            let sign = mass.volume.signum();
            (mass.volume, mass.inertia) = (sign * mass.volume, sign * mass.inertia);
            let Aabb { min, max } = mesh.bounds();
            Ok(ExactProperties::within(box_volume([min, max]), mass, 0.0, Vec::new()))
        }
        Err(Unproved::TrianglesMeet { .. } | Unproved::ShellFacing { .. }) => {
            let (inputs, expression) = (Distinct::of(&[mesh]), Expression::input(0));
            Ok(Solution::of_bodies(inputs, expression, fill, vec![Wholeness::Shells])?.properties())
        }
        Err(why) => Err(NotExact { input: 0, why }),
    }
}

/// Returns the volumes of one solid under the even-odd and the non-zero rule.
///
/// # Errors
/// See [`of_solid`].
pub fn volumes_of_solid(mesh: &ClosedMesh) -> Result<[f64; 2], NotExact> {
    match prove_simple(mesh) {
        Ok(()) => return Ok([mesh.mass_properties().volume.abs(); 2]),
        Err(Unproved::TrianglesMeet { .. } | Unproved::ShellFacing { .. }) => {}
        Err(why) => return Err(NotExact { input: 0, why }),
    }
    let of_shells = |fill: FillRule| {
        Solution::of_bodies(Distinct::of(&[mesh]), Expression::input(0), fill, vec![Wholeness::Shells])
    };
    let even_odd = of_shells(FillRule::EvenOdd)?;
    let first = even_odd.properties().mass.volume;
    let non_zero = match even_odd.wholeness[..] {
        // Nothing of it depends on the rule.
        [Wholeness::Crossed] => Solution { fill: FillRule::NonZero, ..even_odd },
        _ => of_shells(FillRule::NonZero)?,
    };
    Ok([first, non_zero.properties().mass.volume])
}

/// Returns where the surfaces of solids meet, once their winding numbers are proved: of each as a whole, or of its shells, which
/// `wholeness` then says. Solids rest, or they grow, if it is given where they meet while they rest.
///
/// # Errors
/// See [`Solution::of`].
fn proved(
    solids: &[&ClosedMesh],
    rule: Rule,
    wholeness: &mut [Wholeness],
    mut resting: Option<&Arrangement>,
) -> Result<Arrangement, NotExact> {
    let growth = if resting.is_some() { Growth::Growing } else { Growth::Resting };
    loop {
        // Only while they are of the same bodies.
        let resting = resting.take();
        let mut found = Arrangement::of(solids, wholeness, rule.expression, growth);
        let unproved = match &mut found {
            Ok((arrangement, near)) => arrangement.prove(near, &rule, resting),
            Err(refused) => vec![*refused],
        };
        if unproved.is_empty() {
            return found.map(|(arrangement, _)| arrangement);
        }
        for unproved in unproved {
            let own = &mut wholeness[unproved.input];
            *own = match (unproved.why, *own) {
                (Unproved::NotOriented | Unproved::TooSmall, _) | (_, Wholeness::Crossed) => return Err(unproved),
                (Unproved::Flat { .. }, _) | (_, Wholeness::Shells) => Wholeness::Crossed,
                (_, Wholeness::Whole) => Wholeness::Shells,
            };
        }
    }
}

/// The different meshes among inputs. In the expression, the first input with a mesh stands for its copies, whose faces would all
/// coincide with its own.
struct Distinct<'a> {
    meshes: Vec<&'a ClosedMesh>,
    /// The number of each input's mesh.
    numbers: Vec<usize>,
    /// The first input with each mesh.
    firsts: Vec<usize>,
}

impl<'a> Distinct<'a> {
    fn of(inputs: &[&'a ClosedMesh]) -> Distinct<'a> {
        let mut distinct = Distinct { meshes: Vec::new(), numbers: Vec::new(), firsts: Vec::new() };
        for (input, &mesh) in inputs.iter().enumerate() {
            let is_same = |other: &&ClosedMesh| other.bounds() == mesh.bounds() && other.mesh() == mesh.mesh();
            let number = distinct.meshes.iter().position(is_same).unwrap_or(distinct.meshes.len());
            if number == distinct.meshes.len() {
                distinct.meshes.push(mesh);
                distinct.firsts.push(input);
            }
            distinct.numbers.push(number);
        }
        distinct
    }
}

/// Whether bodies grow by an infinitesimal.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Growth {
    Resting,
    Growing,
}

/// The rule that decides about a point from its winding numbers.
#[derive(Clone, Copy)]
struct Rule<'e> {
    expression: &'e Expression,
    fill: FillRule,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boolean::BooleanOperation;

    #[test]
    fn solids_that_grow_are_proved_where_they_were_not_at_rest() {
        let cuboid = |corners: [[f64; 3]; 2]| {
            let [min, max] = corners.map(DVec3::from);
            ClosedMesh::check(crate::solids::cuboid(min, max).unwrap()).unwrap()
        };
        // Two sides lie in sides of the other one.
        let (a, b) = (cuboid([[0.0; 3], [2.0; 3]]), cuboid([[2.0, 0.0, 0.5], [4.0, 1.0, 1.5]]));
        let expression = Expression::of_inputs(BooleanOperation::Union, 2);
        let mut solution = Solution::of(&[&a, &b], &expression, FillRule::NonZero).unwrap();
        assert!(solution.arrangement.proved.iter().flatten().filter(|is_proved| **is_proved).count() > 12);
        let mut proved_with = |known: &dyn Fn(usize) -> bool| {
            solution.arrangement.proved = [0, 1].map(|_| (0..12).map(known).collect()).into();
            let (rule, mut wholeness) = (solution.rule(), solution.wholeness.clone());
            let found = proved(&solution.inputs.meshes, rule, &mut wholeness, Some(&solution.arrangement));
            found.unwrap().proved
        };
        let needed = proved_with(&|_| false);
        assert_eq!(proved_with(&|_| true), [[false; 12]; 2]);
        let of_every_third = proved_with(&|face| face % 3 != 0);
        for (found, needed) in of_every_third.iter().zip(&needed) {
            let expected: Vec<bool> = needed.iter().zip(0..).map(|(needed, face)| *needed && face % 3 == 0).collect();
            assert!(*found == expected && expected.contains(&true));
        }
    }

    #[test]
    fn no_volume_is_beyond_the_box_of_its_solid() {
        let within = |volume, volume_rounding| {
            let (centroid, inertia) = (DVec3::NAN, glam::DMat3::NAN);
            let mass = MassProperties { volume, volume_rounding, area: 0.0, centroid, inertia };
            let found = ExactProperties::within(8.0, mass, 0.0, Vec::new());
            ([found.mass.volume, found.mass.volume_rounding], found.possible)
        };
        assert_eq!(within(5.0, 1.0), ([5.0, 1.0], [4.0, 6.0]));
        assert_eq!(within(1.0, 3.0), ([1.0, 3.0], [0.0, 4.0]));
        assert_eq!(within(-1.0, 3.0), ([0.0, 2.0], [0.0, 2.0]));
        let ([volume, rounding], [least, most]) = within(9.0, 3.0);
        assert!((8.0..8.000001).contains(&volume) && (2.0..2.000001).contains(&rounding));
        assert_eq!((least, most), (6.0, volume));
        // What exceeds the range of f64 is not known.
        assert_eq!(within(f64::INFINITY, f64::INFINITY).0, [f64::INFINITY; 2]);
        assert!(within(f64::NAN, f64::NAN).0.iter().all(|value| value.is_nan()));
        // Products of small sides alone would be none.
        let needle = box_volume([DVec3::ZERO, DVec3::new(1e-200, 1e-200, 1e300)]);
        assert!((needle / 1e-100 - 1.0).abs() < 1e-12);
    }
}
