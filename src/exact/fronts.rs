//! The proof that the winding number of each body's own surface is known wherever the result depends on it.
//!
//! # The argument
//! The weights of the result's surface take for granted that a body's own winding number is [`Body::front`] in front of
//! its faces. That matters only where the result depends on whether a point is in the body's solid; elsewhere the weight is zero
//! whatever the number is. So it is proved for the faces that such a place touches, as a whole each:
//! 1. They meet no face of their body elsewhere than in corners and sides that they share ([`prove_embedded`]). So
//!    the number is constant in front of each.
//! 2. Faces at a side that no third one uses have the same number, since they use it in opposite directions.
//! 3. For one face of each set that such sides connect, the number is counted with exact signs along an axis, from outside
//!    the body to the face.
//!
//! The winding numbers of the other bodies need no proof: they are counted.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicI32, Ordering};

use crate::parallel::*;
use glam::{DVec2, DVec3, Vec3Swizzles};

use super::Rule;
use super::bodies::{Bodies, Body, SCALE};
use super::near::Near;
use super::signs::{Plane, Vertex, is_left_of};
use super::windings::Windings;
use crate::cancel::checkpoint;
use crate::mesh::{Unproved, prove_embedded};
use crate::union_find::UnionFind;

/// The body of a line, which is displaced beyond all others.
const LINE: u32 = u32::MAX;

/// A coordinate beyond the lattice.
const BEYOND: f64 = 1.0 / SCALE + 1.0;

/// Proves the numbers of a body; see the module's docs. `near` holds its faces near other bodies, and `is_crossed` tells which
/// faces of all bodies others meet.
///
/// # Errors
/// Faces that meet, and a set of faces that has another number; faces are numbered within the body.
pub(super) fn prove(
    own: usize,
    bodies: &Bodies,
    near: Option<&Near>,
    (is_crossed, windings): (&[bool], &Windings),
    rule: &Rule,
) -> Result<(), Unproved> {
    let body = &bodies.bodies[own];
    let is_needed = needed(body, bodies, is_crossed, windings, rule);
    let needed = is_needed.par_iter().with_min_len(4096).filter(|&&is_needed| is_needed).count();
    if needed == 0 {
        return Ok(());
    }
    let first = body.faces.start;
    let all;
    let tree = match near {
        Some(near) if near.has_all_around(&is_needed, needed, first) => &near.tree,
        _ => {
            all = bodies.tree(body);
            &all
        }
    };
    let of_flat = |why: Unproved| match why {
        // Triangles without area meet their neighbours, and that is the better reason.
        Unproved::TrianglesMeet { triangles } => {
            let flat = triangles.into_iter().find(|face| bodies.plane(first + face).is_flat());
            flat.map_or(why, |face| Unproved::Flat { triangle: face as usize })
        }
        _ => why,
    };
    let sheets = prove_embedded(tree, first, |face| bodies.corners(face), &is_needed).map_err(of_flat)?;
    checkpoint();
    check(own, bodies, &is_needed, &sheets.parts)
}

/// Returns for each face of a body whether it touches a place where the result depends on the body's solid.
fn needed(body: &Body, bodies: &Bodies, is_crossed: &[bool], windings: &Windings, rule: &Rule) -> Vec<bool> {
    let patches = windings.first_points();
    let own = patches.partition_point(|&point| point < body.points.start)
        ..patches.partition_point(|&point| point < body.points.end);
    let start = own.start;
    let depends: Vec<bool> = own.map(|patch| rule.depends_on(body.solid, windings.of_patch(patch as u32))).collect();
    // The corners of a face that is not crossed are of one patch.
    let of_face = |face: u32| {
        is_crossed[face as usize] || depends[windings.patch(bodies.faces[face as usize][0]) as usize - start]
    };
    body.faces.clone().into_par_iter().map(of_face).collect()
}

/// A line along an axis through a face, from one side of the lattice to the other.
struct Line<'b> {
    /// The number of the face within its body.
    face: u32,
    plane: Plane<'b>,
    ends: [Vertex<'b>; 2],
    /// True if the first end is in front of the face.
    enters: bool,
}

impl<'b> Line<'b> {
    /// Returns a line along x through a point of the lattice in a face, if there is one near its centroid.
    fn through(face: u32, plane: Plane<'b>) -> Option<Line<'b>> {
        let [a, b, c] = plane.positions();
        let middle = ((a + b + c) / 3.0).round();
        let ends = [-BEYOND, BEYOND].map(|x| Vertex::still(DVec3::new(x, middle.y, middle.z), LINE));
        crosses(&plane, &ends[0]).then(|| Line { face, ends, enters: plane.is_in_front(&ends[0]), plane })
    }

    /// Returns a point of the line.
    fn point(&self) -> DVec3 {
        self.ends[0].at
    }

    /// Returns by how much the winding number grows at a face if the line crosses that before its own.
    fn change(&self, plane: &Plane) -> i32 {
        let enters = plane.is_in_front(&self.ends[0]);
        // The line starts in front of a face that it enters.
        let is_later = plane.has_crossing_in_front(self.ends.each_ref(), &self.plane, self.enters) == enters;
        match (is_later, enters) {
            (true, _) => 0,
            (false, true) => 1,
            (false, false) => -1,
        }
    }
}

/// Returns whether the line along x through a point crosses a face.
fn crosses(plane: &Plane, point: &Vertex) -> bool {
    let [a, b, c] = &plane.corners;
    let [first, second, third] = [[a, b], [b, c], [c, a]].map(|side| is_left_of(point, side));
    first == second && second == third
}

/// A body with the coordinates brought forward, so that another axis is the first.
struct Turned<'b> {
    bodies: &'b Bodies,
    own: u32,
    turns: usize,
}

impl Turned<'_> {
    fn body(&self) -> &Body {
        &self.bodies.bodies[self.own as usize]
    }

    /// Returns the corners of a face by its number within the body.
    fn corners(&self, face: u32) -> [DVec3; 3] {
        self.bodies.corners(self.body().faces.start + face).map(|point| self.turned(point))
    }

    fn turned(&self, point: DVec3) -> DVec3 {
        match self.turns {
            0 => point,
            1 => DVec3::new(point.y, point.z, point.x),
            _ => DVec3::new(point.z, point.x, point.y),
        }
    }

    /// Returns the plane of a face, which does not grow.
    fn plane(&self, face: u32) -> Plane<'static> {
        Plane::new(self.corners(face).map(|corner| Vertex::still(corner, self.own)))
    }

    /// Returns twice the area of a face's projection along the axis in which that is largest, and that axis.
    fn widest(&self, face: u32) -> (f64, usize) {
        let [a, b, c] = self.corners(face);
        let projections = (b - a).cross(c - a).abs();
        let axis = projections.max_position();
        (projections[axis], axis)
    }

    fn line(&self, face: u32) -> Option<Line<'static>> {
        Line::through(face, self.plane(face))
    }

    /// Returns the lowest of the lines' faces with another winding number in front than that of the body.
    fn least_wrong(&self, mut lines: Vec<Line<'_>>) -> Option<u32> {
        lines.sort_unstable_by(|a, b| a.point().y.total_cmp(&b.point().y).then(a.face.cmp(&b.face)));
        let numbers: Vec<AtomicI32> = lines.iter().map(|_| AtomicI32::new(0)).collect();
        let places: Vec<DVec2> = lines.iter().map(|line| line.point().yz()).collect();
        self.bodies.runs(self.body()).for_each(|(extent, faces)| {
            // Most runs are beside all lines.
            if within(&places, extent.corners().map(|corner| self.turned(corner).yz())).next().is_none() {
                return;
            }
            checkpoint();
            for face in faces.map(|face| face - self.body().faces.start) {
                let [a, b, c] = self.corners(face).map(DVec3::yz);
                for i in within(&places, [a.min(b).min(c), a.max(b).max(c)]) {
                    let change = self.change(&lines[i], face);
                    if change != 0 {
                        numbers[i].fetch_add(change, Ordering::Relaxed);
                    }
                }
            }
        });
        let is_wrong = |(line, number): &(Line, AtomicI32)| {
            // The count ends before the face: behind it if the line leaves there.
            number.load(Ordering::Relaxed) != self.body().front + i32::from(!line.enters)
        };
        lines.into_iter().zip(numbers).filter(is_wrong).map(|(line, _)| line.face).min()
    }

    /// Returns by how much the winding number changes where a line crosses a face before its own.
    fn change(&self, line: &Line, face: u32) -> i32 {
        let plane = self.plane(face);
        if face != line.face && crosses(&plane, &line.ends[0]) { line.change(&plane) } else { 0 }
    }
}

/// Returns the numbers of the places in a box, where places are in the order of their first coordinates.
fn within(places: &[DVec2], [min, max]: [DVec2; 2]) -> impl Iterator<Item = usize> {
    let start = places.partition_point(|place| place.x < min.x);
    let numbered = (start..).zip(&places[start..]).take_while(move |(_, place)| place.x <= max.x);
    numbered.filter(move |(_, place)| (min.y..=max.y).contains(&place.y)).map(|(number, _)| number)
}

/// Checks the winding number in front of one face of each set.
fn check(own: usize, bodies: &Bodies, is_needed: &[bool], parts: &UnionFind) -> Result<(), Unproved> {
    let axes = [0, 1, 2].map(|turns| Turned { bodies, own: own as u32, turns });
    let mut lines: [Vec<Line>; 3] = Default::default();
    // The root of a set is its first face. Where that is too thin for a line, the widest of the set is tried.
    let is_root = |&face: &u32| is_needed[face as usize] && parts.find(face) == face;
    let roots: Vec<u32> = (0..is_needed.len() as u32).into_par_iter().with_min_len(4096).filter(is_root).collect();
    let mut are_thin = BTreeSet::new();
    for root in roots {
        let axis = axes[0].widest(root).1;
        match axes[axis].line(root) {
            Some(line) => lines[axis].push(line),
            None => _ = are_thin.insert(root),
        }
    }
    for (face, axis) in widest_of_sets(&axes[0], &are_thin, is_needed, parts) {
        let line = axes[axis].line(face).ok_or(Unproved::TooThin { triangle: face as usize })?;
        lines[axis].push(line);
    }
    let wrong = axes.iter().zip(lines).filter(|(_, lines)| !lines.is_empty());
    match wrong.filter_map(|(axis, lines)| axis.least_wrong(lines)).min() {
        Some(face) => Err(Unproved::ShellFacing { triangle: face as usize }),
        None => Ok(()),
    }
}

/// Returns the face of each of some sets that is widest along an axis, and that axis.
fn widest_of_sets(body: &Turned, sets: &BTreeSet<u32>, is_needed: &[bool], parts: &UnionFind) -> Vec<(u32, usize)> {
    type Widest = BTreeMap<u32, (f64, Reverse<u32>, usize)>;
    if sets.is_empty() {
        return Vec::new();
    }
    let widest = |face: u32| {
        let (width, axis) = body.widest(face);
        (width, Reverse(face), axis)
    };
    let include = |mut widest: Widest, set: u32, found: (f64, Reverse<u32>, usize)| {
        let known = widest.entry(set).or_insert(found);
        if found > *known {
            *known = found;
        }
        widest
    };
    let faces = (0..is_needed.len() as u32).into_par_iter().with_min_len(4096);
    let found = faces
        .filter(|&face| is_needed[face as usize] && sets.contains(&parts.find(face)))
        .fold(Widest::new, |known, face| include(known, parts.find(face), widest(face)))
        .reduce(Widest::new, |known, other| {
            other.into_iter().fold(known, |known, (set, found)| include(known, set, found))
        });
    found.into_values().map(|(_, Reverse(face), axis)| (face, axis)).collect()
}
