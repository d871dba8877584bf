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

use crate::parallel::*;

use super::bodies::{Bodies, Body};
use super::lines::{Line, Turned, seen_along_axes};
use super::near::Near;
use super::numbers::Numbers;
use super::windings::Windings;
use crate::cancel::checkpoint;
use crate::mesh::{Unproved, prove_embedded};
use crate::union_find::UnionFind;

/// Proves the numbers of a body; see the module's docs. `near` holds its faces near other bodies, and `is_crossed` tells which
/// faces of all bodies others meet; `outside` has the winding numbers of a point in no solid. Returns the faces that were proved, which
/// lack those that are `known`.
///
/// # Errors
/// Faces that meet, and a set of faces that has another number; faces are numbered within the body.
pub(super) fn prove(
    own: usize,
    bodies: &Bodies,
    near: Option<&Near>,
    (is_crossed, windings): (&[bool], &Windings),
    outside: &Numbers,
    known: Option<&[bool]>,
) -> Result<Vec<bool>, Unproved> {
    let body = &bodies.bodies[own];
    let mut is_needed = needed(body, bodies, is_crossed, windings, outside);
    if let Some(known) = known {
        is_needed.iter_mut().zip(known).for_each(|(is_needed, is_known)| *is_needed &= !is_known);
    }
    let needed = is_needed.par_iter().with_min_len(4096).filter(|&&is_needed| is_needed).count();
    if needed == 0 {
        return Ok(is_needed);
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
    check(own, bodies, &is_needed, &sheets.parts)?;
    Ok(is_needed)
}

/// Returns for each face of a body whether it touches a place where the result depends on the body's solid.
fn needed(body: &Body, bodies: &Bodies, is_crossed: &[bool], windings: &Windings, outside: &Numbers) -> Vec<bool> {
    let own = windings.patches_from(&body.points);
    let first = own.start;
    let depends = |numbers: &mut Numbers, patch: u32| {
        numbers.set(windings.of_patch(patch));
        numbers.depends_on(body.solid)
    };
    let depends: Vec<bool> = own.into_par_iter().with_min_len(4096).map_init(|| outside.clone(), depends).collect();
    // The corners of a face that is not crossed are of one patch.
    let of_face = |face: u32| {
        let [one, other, _] = bodies.faces[face as usize];
        is_crossed[face as usize] || depends[(windings.patch([one, other]) - first) as usize]
    };
    body.faces.clone().into_par_iter().map(of_face).collect()
}

/// Checks the winding number in front of one face of each set.
fn check(own: usize, bodies: &Bodies, is_needed: &[bool], parts: &UnionFind) -> Result<(), Unproved> {
    let axes = seen_along_axes(bodies, own);
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
    let counted = axes.iter().zip(lines).filter(|(_, lines)| !lines.is_empty());
    let wrong =
        counted.flat_map(|(axis, lines)| axis.fronts(lines)).filter(|&(_, front)| front != bodies.bodies[own].front);
    match wrong.map(|(face, _)| face).min() {
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
