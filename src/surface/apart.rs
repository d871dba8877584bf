//! Vertices that fall together once they are rounded for a file, and solids that touch.
//!
//! A reader welds equal positions, so no two vertices of a written mesh may have the same one. Two that an edge joins become one.
//! If that leaves edges or vertices at which several parts of the surface touch, these are separated. All others of one
//! position are moved apart by single steps of the file's precision: into the solid, or out of it where that lies between them.

use std::cmp::Ordering;
use std::collections::HashSet;

use glam::DVec3;

use super::cones::Cone;
use super::contract::Contraction;
use super::fans::{retain, separate};
use super::manifold::{Stars, welded};
use crate::cancel::checkpoint;
use crate::mesh::{Precision, TriangleMesh};
use crate::parallel::*;
use crate::union_find::UnionFind;

/// Number of triangles that one task looks at, at least.
const CHUNK: usize = 4096;

/// Most rounds of steps; each begins with the vertices that still fall together.
const ROUNDS: i32 = 64;

/// The outcome of moving vertices apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Apart {
    /// Vertices that became one with another.
    pub merged: usize,
    /// Vertices that were moved.
    pub moved: usize,
}

/// Makes a closed, oriented mesh a 2-manifold of which no two vertices have the same position. Positions are rounded to the
/// precision already. Edges must have as many uses in one direction as in the other. `sources`, with one entry for each
/// triangle, follow the triangles.
pub(crate) fn take_apart<S: Copy>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, precision: Precision) -> Apart {
    let mut apart = Apart::default();
    let pairs = equal_positions(mesh, precision);
    if !pairs.is_empty() {
        join_opposite(mesh, sources, &lowest_of(&pairs, mesh));
    }
    let is_separated = separate(mesh, sources, precision);
    // What is separated has copies of vertices.
    if pairs.is_empty() && !is_separated {
        return apart;
    }
    apart.merged = contract_edges(mesh, sources, &groups(&equal_positions(mesh, precision)));
    let joined = join_edges(mesh, sources, &equal_positions(mesh, precision));
    if joined > 0 {
        apart.merged += joined;
        separate(mesh, sources, precision);
    }
    apart.moved = step_apart(mesh, precision);
    apart
}

/// The entry in [`lowest_of`] of a vertex whose position no other has.
const ALONE: u32 = u32::MAX;

/// A triangle that may lie on others: the numbers of its corners' positions, the lowest first and the highest last; whether this
/// reverses the triangle; its number; and its corners in the same order.
type Side = ([u32; 3], bool, u32, [u32; 3]);

/// Gives triangles that lie on each other and face opposite ways the same vertices, so that they bound nothing. `lowest` is
/// what [`lowest_of`] returns.
fn join_opposite<S>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, lowest: &[u32]) {
    let side = |(&triangle, number): (&[u32; 3], u32)| -> Option<Side> {
        // Each corner with the number of its position.
        let mut corners = triangle.map(|vertex| (lowest[vertex as usize].min(vertex), vertex));
        let [a, b, c] = corners.map(|(position, _)| position);
        let may_join = triangle.iter().any(|&vertex| lowest[vertex as usize] != ALONE);
        if !may_join || a == b || b == c || c == a {
            return None;
        }
        let is_back = lowest_first(&mut corners);
        Some((corners.map(|(position, _)| position), is_back, number, corners.map(|(_, vertex)| vertex)))
    };
    let triangles = &mesh.triangles;
    let mut sides: Vec<Side> =
        triangles.par_iter().zip(0..triangles.len() as u32).with_min_len(CHUNK).filter_map(side).collect();
    sides.par_sort_unstable();
    let vertices = UnionFind::new(mesh.positions.len() as u32);
    let mut has_joined = false;
    for same in sides.chunk_by(|one, other| one.0 == other.0) {
        let (front, back) = same.split_at(same.partition_point(|(_, is_back, ..)| !is_back));
        for ((.., one), (.., other)) in front.iter().zip(back) {
            one.iter().zip(other).for_each(|(&a, &b)| vertices.join(a, b));
            has_joined = true;
        }
    }
    if has_joined {
        join(mesh, sources, &vertices);
    }
}

/// Orders the corners of a triangle, the lowest first and the highest last, and returns whether this reverses it.
pub(super) fn lowest_first<T: Copy + Ord>(corners: &mut [T; 3]) -> bool {
    let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
    corners.rotate_left(first);
    let is_back = corners[1] > corners[2];
    if is_back {
        corners.swap(1, 2);
    }
    is_back
}

/// Makes one vertex of each set, drops the triangles that lose a side by it, and returns the number of vertices that are gone.
fn join<S>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, vertices: &UnionFind) -> usize {
    let kept_vertices = vertices.roots();
    mesh.triangles.as_flattened_mut().iter_mut().for_each(|corner| *corner = kept_vertices[*corner as usize]);
    let kept: Vec<bool> = mesh.triangles.iter().map(|&[a, b, c]| a != b && b != c && c != a).collect();
    retain(mesh, sources, &kept);
    (0..).zip(&kept_vertices).filter(|(vertex, kept)| vertex != *kept).count()
}

/// Returns the vertices whose position others have, too, once they are rounded: pairs of the lowest and another one, in order.
fn equal_positions(mesh: &TriangleMesh, precision: Precision) -> Vec<[u32; 2]> {
    let all_used = vec![true; mesh.positions.len()];
    let mut pairs = welded(mesh, &all_used, precision);
    pairs.par_sort_unstable();
    pairs
}

/// Returns for each vertex the lowest with its position, or [`ALONE`].
fn lowest_of(pairs: &[[u32; 2]], mesh: &TriangleMesh) -> Vec<u32> {
    let mut lowest = vec![ALONE; mesh.positions.len()];
    for &[first, other] in pairs {
        lowest[first as usize] = first;
        lowest[other as usize] = first;
    }
    lowest
}

/// Contracts edges without length where the surface stays a manifold, and returns their number.
fn contract_edges<S>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, groups: &[Vec<u32>]) -> usize {
    let stars = Stars::of(mesh);
    let mut edges = Contraction::of(mesh, &stars);
    let merged = groups.iter().map(|same| merge(&mut edges, same)).sum();
    edges.finish(sources);
    merged
}

/// Merges those of some vertices that edges join, and returns their number.
fn merge(edges: &mut Contraction, same: &[u32]) -> usize {
    let mut merged = 0;
    let mut left = same.to_vec();
    let mut i = 0;
    while i < left.len() {
        let joined = (i + 1..left.len()).find(|&j| edges.contract(left[i], left[j]));
        match joined {
            Some(j) => {
                left.remove(j);
                merged += 1;
            }
            None => i += 1,
        }
    }
    merged
}

/// Makes one of vertices of one position that an edge joins, whatever meets there, and returns the number that are gone. `pairs`
/// are those of [`equal_positions`].
fn join_edges<S>(mesh: &mut TriangleMesh, sources: &mut Vec<S>, pairs: &[[u32; 2]]) -> usize {
    if pairs.is_empty() {
        return 0;
    }
    let lowest = lowest_of(pairs, mesh);
    let vertices = UnionFind::new(mesh.positions.len() as u32);
    let mut has_joined = false;
    for &[a, b, c] in &mesh.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let [position, other] = [from, to].map(|vertex| lowest[vertex as usize]);
            if from < to && position != ALONE && position == other {
                vertices.join(from, to);
                has_joined = true;
            }
        }
    }
    if has_joined { join(mesh, sources, &vertices) } else { 0 }
}

/// Returns the vertices of pairs, as [`equal_positions`] returns them, in groups of one position.
fn groups(pairs: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let group = |same: &[[u32; 2]]| [same[0][0]].into_iter().chain(same.iter().map(|pair| pair[1])).collect();
    pairs.chunk_by(|a, b| a[0] == b[0]).map(group).collect()
}

/// Moves vertices until no two have the same position, and returns the number of those that moved.
fn step_apart(mesh: &mut TriangleMesh, precision: Precision) -> usize {
    let mut moved = HashSet::new();
    let mut stars = None;
    for round in 1..=ROUNDS {
        let pairs = equal_positions(mesh, precision);
        if pairs.is_empty() {
            break;
        }
        let stars = stars.get_or_insert_with(|| Stars::of(mesh));
        for group in groups(&pairs) {
            // The first stays.
            let partings = partings(mesh, stars, &group);
            for (&vertex, (away, steps)) in group[1..].iter().zip(partings) {
                let position = &mut mesh.positions[vertex as usize];
                *position = stepped(*position, away, steps + (round - 1) / 8, precision);
                moved.insert(vertex);
            }
        }
    }
    moved.len()
}

/// Most vertices of one position of which each is compared with all others.
const FEW: usize = 16;

/// Returns for each vertex of one position but the first the direction away from the first, and the number of steps: of surfaces on
/// one side of the first, those behind others go farther.
fn partings(mesh: &TriangleMesh, stars: &Stars, group: &[u32]) -> Vec<(DVec3, i32)> {
    checkpoint();
    let cones: Vec<Cone> = group.iter().map(|&vertex| Cone::at(mesh, stars, vertex)).collect();
    let of_first: Vec<Ordering> = cones.iter().map(|cone| cones[0].side_of(cone)).collect();
    // The side of each on which the first lies.
    let to_first: Vec<Ordering> = cones.iter().map(|cone| cone.side_of(&cones[0])).collect();
    let faces_first = |place: usize, other: usize| match cones[place].side_of(&cones[other]) {
        Ordering::Equal => None,
        side => Some(side == to_first[place]),
    };
    // Those that both have the other before them, or neither, lie side by side.
    let is_before = |other: usize, place: usize| match (faces_first(place, other), faces_first(other, place)) {
        (Some(true), Some(false)) => true,
        (Some(false), Some(true)) => false,
        _ => other < place,
    };
    let parting = |place: usize| {
        let inwards = inwards(mesh, stars, group[place]);
        // Into the solid, or out of it where it lies between.
        let away = if to_first[place] == Ordering::Less { -inwards } else { inwards };
        let is_beside = |other: &usize| *other != place && of_first[*other] == of_first[place];
        let before = match group.len() <= FEW {
            true => (1..group.len()).filter(is_beside).filter(|&other| is_before(other, place)).count(),
            false => place - 1,
        };
        (away, 1 + before as i32)
    };
    (1..group.len()).map(parting).collect()
}

/// Returns a vector from a vertex into the solid.
fn inwards(mesh: &TriangleMesh, stars: &Stars, vertex: u32) -> DVec3 {
    let mut star = stars.corners_at(vertex as usize).to_vec();
    star.sort_unstable();
    let normal = |&corner: &u32| {
        let [a, b, c] = mesh.triangles[corner as usize / 3].map(|index| mesh.positions[index as usize]);
        (b - a).cross(c - a)
    };
    -star.iter().map(normal).sum::<DVec3>()
}

/// Returns a position after a number of steps of a precision along each axis in which a direction has a share.
fn stepped(position: DVec3, direction: DVec3, steps: i32, precision: Precision) -> DVec3 {
    const LEAST_SHARE: f64 = 0.25;
    let least = LEAST_SHARE * direction.abs().max_element();
    let step = |coordinate: f64, along: f64| match (precision, along > 0.0) {
        (Precision::Single, true) => f64::from((coordinate as f32).next_up()),
        (Precision::Single, false) => f64::from((coordinate as f32).next_down()),
        (Precision::Double, true) => coordinate.next_up(),
        (Precision::Double, false) => coordinate.next_down(),
    };
    let direction = if least > 0.0 { direction } else { DVec3::X };
    let mut moved = position;
    for axis in (0..3).filter(|&axis| direction[axis].abs() > least) {
        (0..steps).for_each(|_| moved[axis] = step(moved[axis], direction[axis]));
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solids::cuboid;
    use crate::surface::manifold::ManifoldReport;

    #[test]
    fn boxes_that_touch_in_a_face_are_moved_apart() {
        let mut mesh = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let other = cuboid(DVec3::X, DVec3::new(2.0, 1.0, 1.0)).unwrap();
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(other.positions);
        mesh.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|index| index + first)));
        for precision in [Precision::Single, Precision::Double] {
            let mut mesh = mesh.clone();
            assert_eq!(step_apart(&mut mesh, precision), 4);
            let report = ManifoldReport::of(&mesh, precision);
            assert!(report.passed(), "{:?}", report.failures());
            assert!(mesh.positions[first as usize..].iter().all(|position| position.x > 1.0));
        }
    }

    #[test]
    fn boxes_and_cavities_that_touch_in_a_corner_are_moved_apart() {
        let mut mesh = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let other = cuboid(DVec3::ONE, DVec3::splat(2.0)).unwrap();
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(other.positions);
        mesh.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|index| index + first)));
        for is_solid in [true, false] {
            let mut mesh = mesh.clone();
            if !is_solid {
                mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            }
            assert_eq!(step_apart(&mut mesh, Precision::Single), 1);
            assert!(
                mesh.positions[first as usize..]
                    .iter()
                    .all(|position| position.min_element() > 1.0 || position.max_element() > 1.5)
            );
            assert!(mesh.positions[..first as usize].iter().all(|position| position.max_element() <= 1.0));
        }
    }

    #[test]
    fn many_needles_with_one_tip_are_moved_apart_at_once() {
        for side in [3, 4, 12] {
            let mut mesh = TriangleMesh { positions: Vec::new(), triangles: Vec::new() };
            for needle in 0..side * side {
                let first = 4 * needle;
                let base = DVec3::new(2.0 + 0.1 * f64::from(needle % side), 2.0 + 0.1 * f64::from(needle / side), 4.0);
                let corners = [DVec3::ZERO, DVec3::new(0.05, 0.0, 0.0), DVec3::new(0.0, 0.05, 0.0)];
                mesh.positions.extend([DVec3::ONE].into_iter().chain(corners.map(|corner| base + corner)));
                let triangles = [[1, 2, 3], [0, 2, 1], [0, 3, 2], [0, 1, 3]];
                mesh.triangles.extend(triangles.map(|triangle| triangle.map(|index| index + first)));
            }
            mesh.positions.iter_mut().for_each(|position| *position = Precision::Single.round(*position));
            assert_eq!(step_apart(&mut mesh, Precision::Single), side as usize * side as usize - 1);
            let report = ManifoldReport::of(&mesh, Precision::Single);
            assert!(report.passed() && report.signed_volume > 0.0, "{:?}", report.failures());
            // Not farther than a step for each.
            let tips = mesh.positions.iter().step_by(4);
            let farthest = tips.map(|tip| (*tip - 1.0).abs().max_element()).fold(0.0, f64::max);
            assert!(farthest <= f64::from(side * side) * f64::from(f32::EPSILON), "{side}: {farthest}");
        }
    }

    #[test]
    fn faces_of_the_same_triangles_that_look_at_each_other_vanish() {
        let mut mesh = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let mut mirrored = mesh.clone();
        mirrored.positions.iter_mut().for_each(|position| position.x = 2.0 - position.x);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(mirrored.positions);
        mesh.triangles.extend(mirrored.triangles.iter().map(|&[a, b, c]| [a, c, b].map(|index| index + first)));
        let mut sources: Vec<usize> = (0..mesh.triangles.len()).collect();
        assert_eq!(take_apart(&mut mesh, &mut sources, Precision::Double), Apart::default());
        let report = ManifoldReport::of(&mesh, Precision::Double);
        assert_eq!((report.triangles, report.vertices, sources.len()), (20, 12, 20));
        assert!(report.passed() && report.signed_volume == 2.0, "{report:?}");
    }

    #[test]
    fn vertices_that_an_edge_joins_become_one() {
        let mesh = cuboid(DVec3::ZERO, DVec3::ONE).unwrap();
        let corner = 0;
        let mut cut = mesh.clone();
        let star: Vec<usize> = (0..12).filter(|&i| mesh.triangles[i].contains(&corner)).collect();
        // Split one triangle at the corner by a vertex on top of the corner.
        let first = star[0];
        let triangle = mesh.triangles[first];
        let place = triangle.iter().position(|&v| v == corner).unwrap();
        let [a, b, c] = [triangle[place], triangle[(place + 1) % 3], triangle[(place + 2) % 3]];
        let top = cut.positions.len() as u32;
        cut.positions.push(cut.positions[corner as usize]);
        cut.triangles[first] = [a, b, top];
        cut.triangles.extend([[b, c, top], [c, a, top]]);
        let mut sources = vec![(); cut.triangles.len()];
        assert_eq!(take_apart(&mut cut, &mut sources, Precision::Double), Apart { merged: 1, moved: 0 });
        assert_eq!((cut.triangles.len(), sources.len()), (12, 12));
        assert!(ManifoldReport::of(&cut, Precision::Double).passed());
    }
}
