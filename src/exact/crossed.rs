//! Shells that meet themselves, as bodies.
//!
//! Their faces cross one another in segments, as those of different bodies do. Where they touch at rest, they cross or part once every
//! point has moved by an infinitesimal vector of its own, the tremor, so that touching faces need no cases either. What one point or one
//! side cannot tell is parted before: the fans of faces at a point, and the pairs of faces at a side.

use std::collections::HashSet;
use std::sync::Mutex;

use glam::I64Vec3;

use super::bodies::for_each_seam;
use crate::mesh::{TriangleMesh, renumber};
use crate::union_find::UnionFind;

/// Returns the surface of shells that may meet themselves, of which each side has two faces and each point one fan, with the numbers of
/// faces and of points in the mesh as given. `numbers` and `vertices` are those of the mesh that is to be prepared, unless all are in order.
pub(super) fn prepare(
    mut mesh: TriangleMesh,
    numbers: Option<Vec<u32>>,
    mut vertices: Option<Vec<u32>>,
) -> (TriangleMesh, Option<Vec<u32>>, Option<Vec<u32>>) {
    let mut numbers = numbers.unwrap_or_else(|| (0..mesh.triangles.len() as u32).collect());
    remove_opposite(&mut mesh.triangles, &mut numbers);
    loop {
        let (apart, mut of_apart) = with_fans_apart(&mesh, vertices);
        mesh = apart;
        let is_changed = part_seams(&mut mesh, &mut numbers, &mut of_apart);
        vertices = Some(of_apart);
        if !is_changed {
            return (mesh, Some(numbers), vertices);
        }
        // The faces at a side that has more than two left may be paired in another way now, and so may the fans.
    }
}

/// Removes pairs of faces with the same corners in opposite order, which bound nothing.
fn remove_opposite(triangles: &mut Vec<[u32; 3]>, numbers: &mut Vec<u32>) {
    // From the lowest corner, with the lower one of the others first.
    let canonical = |[a, b, c]: [u32; 3]| {
        let least = a.min(b).min(c);
        let [p, q] = if a == least {
            [b, c]
        } else if b == least {
            [c, a]
        } else {
            [a, b]
        };
        ([least, p.min(q), p.max(q)], p < q)
    };
    let mut faces: Vec<([u32; 3], u32, bool)> = (0..)
        .zip(triangles.iter())
        .map(|(face, &corners)| {
            let (corners, is_forward) = canonical(corners);
            (corners, face, is_forward)
        })
        .collect();
    faces.sort_unstable();
    let mut is_removed = vec![false; triangles.len()];
    for same in faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1) {
        let of = |forward: bool| same.iter().filter(move |(.., is_forward)| *is_forward == forward);
        for (one, other) in of(true).zip(of(false)) {
            [one, other].into_iter().for_each(|&(_, face, _)| is_removed[face as usize] = true);
        }
    }
    if is_removed.contains(&true) {
        let stays = |(face, _): &(usize, u32)| !is_removed[*face];
        *numbers = numbers.iter().copied().enumerate().filter(stays).map(|(_, number)| number).collect();
        let mut face = 0;
        triangles.retain(|_| {
            face += 1;
            !is_removed[face - 1]
        });
    }
}

/// Gives each fan of faces at a point a point of its own, in the same place. `vertices` holds the number of each point in the mesh
/// as given, unless all are in order.
fn with_fans_apart(mesh: &TriangleMesh, vertices: Option<Vec<u32>>) -> (TriangleMesh, Vec<u32>) {
    let corners = UnionFind::new(3 * mesh.triangles.len() as u32);
    let corner = |face: u32, point: u32| {
        let place = mesh.triangles[face as usize].iter().position(|&other| other == point);
        3 * face + place.expect("a side of a face has its points") as u32
    };
    for_each_seam(mesh, |_, [a, b], side| {
        side.into_iter().for_each(|point| corners.join(corner(a, point), corner(b, point)));
    });
    let mut triangles = corners.roots().as_chunks().0.to_vec();
    let point_of = |corner: u32| mesh.triangles.as_flattened()[corner as usize];
    let points: Vec<u32> = renumber(&mut triangles).into_iter().map(point_of).collect();
    let positions = points.iter().map(|&point| mesh.positions[point as usize]).collect();
    let vertices = match vertices {
        Some(vertices) => points.into_iter().map(|point| vertices[point as usize]).collect(),
        None => points,
    };
    (TriangleMesh { positions, triangles }, vertices)
}

/// Gives some of the pairs of faces that meet at a side where others do a side of their own: a point is added to it, in the place of one
/// of its ends, with two faces without area beside it. Returns whether there were any. `numbers` and `vertices` hold the numbers of
/// faces and points in the mesh as given.
fn part_seams(mesh: &mut TriangleMesh, numbers: &mut Vec<u32>, vertices: &mut Vec<u32>) -> bool {
    let further = Mutex::new(Vec::new());
    for_each_seam(mesh, |place, faces, side| {
        if place > 0 {
            further.lock().expect("no thread panics with the list").push((side, faces));
        }
    });
    let mut further = further.into_inner().expect("no thread panics with the list");
    further.sort_unstable();
    let mut is_changed = HashSet::new();
    for ([end, other], faces) in further {
        // Faces that were changed have other sides now.
        if faces.iter().any(|face| is_changed.contains(face)) {
            continue;
        }
        is_changed.extend(faces);
        let added = mesh.positions.len() as u32;
        mesh.positions.push(mesh.positions[end as usize]);
        vertices.push(vertices[end as usize]);
        for face in faces {
            let corners = &mut mesh.triangles[face as usize];
            let place = corners.iter().position(|&corner| corner == end).expect("a side of a face has its points");
            let [next, last] = [1, 2].map(|step| corners[(place + step) % 3]);
            corners[place] = added;
            let beside = if next == other { [end, added, last] } else { [added, end, next] };
            mesh.triangles.push(beside);
            numbers.push(numbers[face as usize]);
        }
    }
    !is_changed.is_empty()
}

/// Returns a vector of small integers that differs from point to point without a pattern. By it a point of a body that meets itself
/// moves, in infinitesimal steps, so that what touches at rest crosses or parts.
pub(super) fn tremor(point: u32) -> I64Vec3 {
    // Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014.
    let component = |number: u64| {
        let mut bits = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        i64::from((bits >> 32) as i32)
    };
    I64Vec3::from_array([1, 2, 3].map(|axis| component(3 * u64::from(point) + axis)))
}
