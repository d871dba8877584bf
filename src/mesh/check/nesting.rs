//! Shells within shells: those that face the wrong way for their depth.

use crate::parallel::*;
use glam::{DVec2, DVec3};

use super::Face;
use super::exact::orientation;
use super::report::{MeshReport, ShellPlace};
use super::shells::{Facing, Shell};
use crate::closest::squared_distance;
use crate::mesh::Aabb;
use crate::mesh::measure::{EMPTY, include};
use crate::mesh::meet::widest_axis;

/// Finds shells that face the wrong way for their depth.
pub(super) fn judge(vertices: &[DVec3], faces: &[Face], shells: &[Shell], report: &mut MeshReport) {
    for (shell, depth) in shells.iter().zip(depths(vertices, faces, shells)) {
        let findings = match (shell.facing(), depth % 2) {
            (Facing::Inwards, 0) => &mut report.inside_out,
            (Facing::Outwards, 1) => &mut report.solids_in_solids,
            _ => continue,
        };
        findings.add(|| ShellPlace {
            triangle: faces[shell.faces[0]].triangle,
            faces: shell.faces.len(),
            signed_volume: shell.signed_volume,
            depth,
            bounds: shell.bounds,
        });
    }
}

/// Returns the number of shells that each shell lies in.
pub(super) fn depths(vertices: &[DVec3], faces: &[Face], shells: &[Shell]) -> Vec<usize> {
    let cells = Cells::new(shells);
    let contents: Vec<Vec<usize>> = (0..shells.len())
        .into_par_iter()
        .map(|outer| {
            let Aabb { min, max } = shells[outer].bounds;
            let nested = |&shell: &usize| {
                let inner = shells[shell].bounds;
                shell != outer && inner.min.cmpge(min).all() && inner.max.cmple(max).all()
            };
            // A shell inside another has its box inside the other's box.
            let candidates = cells.near(&shells[outer].bounds).filter(nested).collect();
            contained(vertices, faces, &shells[outer], shells, candidates)
        })
        .collect();
    let mut depths = vec![0usize; shells.len()];
    contents.iter().flatten().for_each(|&inner| depths[inner] += 1);
    depths
}

/// Shells by the lower corners of their boxes, in about as many cells as there are shells.
struct Cells {
    origin: DVec3,
    size: DVec3,
    side: usize,
    /// The offset of the shells of each cell, and the end of the last.
    starts: Vec<usize>,
    shells: Vec<usize>,
}

impl Cells {
    fn new(shells: &[Shell]) -> Cells {
        let bounds = shells.iter().fold(EMPTY, |bounds, shell| include(bounds, shell.bounds.min));
        let side = (shells.len() as f64).cbrt().ceil() as usize;
        let size = (bounds.max - bounds.min) / side as f64;
        let mut cells = Cells { origin: bounds.min, size, side, starts: Vec::new(), shells: Vec::new() };
        let mut order: Vec<(usize, usize)> = shells
            .iter()
            .enumerate()
            .map(|(shell, Shell { bounds, .. })| {
                let [x, y, z] = cells.cell(bounds.min);
                ((z * side + y) * side + x, shell)
            })
            .collect();
        order.sort_unstable();
        cells.starts = (0..=side.pow(3)).map(|cell| order.partition_point(|(c, _)| *c < cell)).collect();
        cells.shells = order.into_iter().map(|(_, shell)| shell).collect();
        cells
    }

    /// Returns the cell of a point, or the nearest one. It is monotone in every coordinate, which is sufficient.
    fn cell(&self, point: DVec3) -> [usize; 3] {
        // Where all lie in one plane the quotient is NaN, which becomes cell 0.
        let quotient = (point - self.origin) / self.size;
        quotient.to_array().map(|q| (q as usize).min(self.side.saturating_sub(1)))
    }

    /// Returns a superset of the shells whose boxes have their lower corners inside the box.
    fn near(&self, bounds: &Aabb) -> impl Iterator<Item = usize> + '_ {
        let (low, high) = (self.cell(bounds.min), self.cell(bounds.max));
        let rows =
            (low[2]..=high[2]).flat_map(move |z| (low[1]..=high[1]).map(move |y| (z * self.side + y) * self.side));
        rows.flat_map(move |row| &self.shells[self.starts[row + low[0]]..self.starts[row + high[0] + 1]]).copied()
    }
}

/// Returns the candidates that lie inside `outer`.
fn contained(
    vertices: &[DVec3],
    faces: &[Face],
    outer: &Shell,
    shells: &[Shell],
    mut candidates: Vec<usize>,
) -> Vec<usize> {
    const TRIES: usize = 8;
    let mut inside = Vec::new();
    let Aabb { min, max } = outer.bounds;
    let rounding = ROUNDING * min.abs().max(max.abs()).max_element();
    // A shell that touches the other one tells by points that rounding cannot have moved to the other side, if it has any; else the
    // same points are tried again, at the cost of twice as many casts.
    let attempts = [rounding, 0.0].into_iter().flat_map(|slack| (0..TRIES).map(move |attempt| (attempt, slack)));
    for (attempt, slack) in attempts {
        if candidates.is_empty() {
            break;
        }
        let point = |shell: usize| {
            let list = &shells[shell].faces;
            let [a, b, c] = faces[list[attempt * list.len() / TRIES]].corners.map(|vertex| vertices[vertex as usize]);
            // Where every vertex lies on the other surface, the middle of some face may not.
            if attempt % 2 == 0 { a } else { a / 3.0 + b / 3.0 + c / 3.0 }
        };
        let mut queries: Vec<Query> = candidates
            .iter()
            .map(|&shell| Query { shell, point: point(shell), crossings: 0, too_near: false })
            .collect();
        cast(vertices, faces, outer, slack, &mut queries);
        candidates = queries.iter().filter(|query| query.too_near).map(|query| query.shell).collect();
        inside.extend(queries.iter().filter(|q| !q.too_near && q.crossings % 2 == 1).map(|q| q.shell));
    }
    inside
}

/// Distance, relative to the size of a surface, within which a point counts as lying on it.
const NEAR: f64 = 1e-12;

/// Distance, relative to the largest coordinate, by which rounding to the numbers of a file may have moved a point: a few steps of
/// `f32`.
const ROUNDING: f64 = 2.4e-7;

/// A point of a shell, and the crossings of the ray upwards from it with another shell.
struct Query {
    shell: usize,
    point: DVec3,
    crossings: usize,
    too_near: bool,
}

/// Counts, for every query, the crossings of its ray with a shell. A point within `slack` of the shell is too near it.
fn cast(vertices: &[DVec3], faces: &[Face], shell: &Shell, slack: f64, queries: &mut [Query]) {
    if queries.is_empty() {
        return;
    }
    queries.sort_unstable_by(|a, b| a.point.x.total_cmp(&b.point.x).then(a.shell.cmp(&b.shell)));
    let margin = slack.max((shell.bounds.max - shell.bounds.min).max_element() * NEAR);
    for &face in &shell.faces {
        let [a, b, c] = faces[face].corners.map(|vertex| vertices[vertex as usize]);
        let (min, max) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
        let start = queries.partition_point(|query| query.point.x < min.x);
        for query in queries[start..].iter_mut().take_while(|query| query.point.x <= max.x) {
            let p = query.point;
            if p.y < min.y || p.y > max.y || p.z > max.z {
                continue;
            }
            if slack > 0.0 && p.z >= min.z && squared_distance(p, [a, b, c]) <= slack * slack {
                query.too_near = true;
                continue;
            }
            let above = above(a, b, c, p);
            let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| side(from.truncate(), to.truncate(), p.truncate()));
            let meets = sides[0] != 0 && sides[0] == sides[1] && sides[1] == sides[2];
            if above == 0 && p.z >= min.z {
                query.too_near |= meets || !is_beside([a, b, c], p);
            } else if meets && above * sides[0] >= 0 {
                query.crossings += 1;
            }
        }
    }
}

/// Returns the side of a line on which an infinitesimally displaced point lies: 1 left, −1 right, 0 only if the ends
/// are identical.
///
/// The displacement is (ε, ε²), the same for every line, so that the sides of one point never contradict one another.
fn side(from: DVec2, to: DVec2, point: DVec2) -> i32 {
    let sign_of = |x: f64| i32::from(x > 0.0) - i32::from(x < 0.0);
    // Comparisons instead of differences, which could underflow.
    let compare = |a: f64, b: f64| i32::from(a > b) - i32::from(a < b);
    [sign_of(orientation(from, to, point)), compare(from.y, to.y), compare(to.x, from.x)]
        .into_iter()
        .find(|sign| *sign != 0)
        .unwrap_or(0)
}

/// Returns whether a point in the plane of a triangle is outside it by more than a negligible part of its size.
fn is_beside(triangle: [DVec3; 3], point: DVec3) -> bool {
    let axis = widest_axis(triangle);
    let flat = |p: DVec3| DVec2::new(p[(axis + 1) % 3], p[(axis + 2) % 3]);
    let turn = |a: DVec2, b: DVec2, c: DVec2| {
        let (u, v) = (b - a, c - a);
        let (left, right) = (u.x * v.y, u.y * v.x);
        let turn = left - right;
        if turn.abs() > NEAR * (left.abs() + right.abs()) { turn } else { 0.0 }
    };
    let [a, b, c, p] = [triangle[0], triangle[1], triangle[2], point].map(flat);
    let own = turn(a, b, c);
    [(a, b), (b, c), (c, a)].iter().any(|&(from, to)| turn(from, to, p) * own < 0.0)
}

/// Compares the plane through a, b, c with a point. Returns 1 if it is above the point and they turn left seen from
/// above, −1 if it is below or they turn right, 0 if the distance is a negligible part of their size.
fn above(a: DVec3, b: DVec3, c: DVec3, point: DVec3) -> i32 {
    let [a, b, c] = [a - point, b - point, c - point];
    let (bc, ca, ab) = (b.truncate(), c.truncate(), a.truncate());
    let cross = |u: DVec2, v: DVec2| (u.x * v.y, u.y * v.x);
    let terms = [(a.z, cross(bc, ca)), (b.z, cross(ca, ab)), (c.z, cross(ab, bc))];
    let value: f64 = terms.iter().map(|(z, (p, q))| z * (p - q)).sum();
    let size: f64 = terms.iter().map(|(z, (p, q))| z.abs() * (p.abs() + q.abs())).sum();
    // Far above the rounding, which is at most (7 + 56ε)ε of the size with ε = 2⁻⁵³; the second term covers underflow.
    let bound = NEAR * size + 1e-290;
    i32::from(value > bound) - i32::from(value < -bound)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_in_the_plane_of_a_face_is_too_near_only_if_it_is_in_the_face() {
        let vertices = [[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [0.0, 4.0, 2.0], [4.0, 4.0, 9.0]].map(DVec3::from);
        let faces = [Face { triangle: 0, corners: [0, 1, 2] }, Face { triangle: 1, corners: [0, 3, 1] }];
        let shell = Shell::new(&vertices, &faces, vec![0, 1]);
        let found = |x: f64, y: f64, z: f64| {
            let mut queries = [Query { shell: 0, point: DVec3::new(x, y, z), crossings: 0, too_near: false }];
            cast(&vertices, &faces, &shell, 0.0, &mut queries);
            (queries[0].crossings, queries[0].too_near)
        };
        // In the first plane, z = x / 4 + y / 2: in the face, in its side, in its box beside it.
        assert!(found(1.0, 1.0, 0.75).1);
        assert!(found(2.0, 2.0, 1.5).1);
        assert_eq!(found(1.0, 3.5, 2.0), (0, false));
        // Above the plane there, and below the second face.
        assert_eq!(found(3.0, 2.0, 1.0), (1, false));
    }
}
