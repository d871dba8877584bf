//! Shells: the parts of a surface that bound something by themselves.

use crate::parallel::*;
use glam::DVec3;

use super::Face;
use super::edges::{Use, edges};
use super::report::MeshReport;
use crate::mesh::Aabb;
use crate::mesh::measure::{EMPTY, include};
use crate::union_find::UnionFind;

/// Finds the closed shells among sets of faces that edges of two uses join, after joining them across other edges.
pub(super) fn closed(
    vertices: &[DVec3],
    faces: &[Face],
    uses: &[Use],
    shells: &UnionFind,
    report: &mut MeshReport,
) -> Vec<Shell> {
    // Joining whole shells keeps balanced shells balanced, so that earlier runs stay balanced.
    for run in edges(uses).filter(|run| run.len() > 2) {
        join_around(vertices, faces, run, shells);
    }
    let mut closed = vec![true; faces.len()];
    for run in edges(uses) {
        match run {
            [a, b] if a.is_forward() != b.is_forward() => {}
            _ => {
                balance(run, shells).iter().filter(|b| !b.is_balanced()).for_each(|b| closed[b.shell as usize] = false)
            }
        }
    }

    if report.bad_positions.count > 0 {
        // Faces without a finite position bound nothing.
        let is_nowhere = |face: &Face| face.corners.iter().any(|&vertex| !vertices[vertex as usize].is_finite());
        for face in (0..faces.len()).filter(|&face| is_nowhere(&faces[face])) {
            closed[shells.find(face as u32) as usize] = false;
        }
    }
    let mut shell_from_root = vec![usize::MAX; faces.len()];
    let mut face_lists: Vec<Vec<usize>> = Vec::new();
    for face in 0..faces.len() {
        let root = shells.find(face as u32) as usize;
        if !closed[root] {
            continue;
        }
        if shell_from_root[root] == usize::MAX {
            shell_from_root[root] = face_lists.len();
            face_lists.push(Vec::new());
        }
        face_lists[shell_from_root[root]].push(face);
    }
    report.shells = face_lists.len();
    face_lists.into_par_iter().map(|list| Shell::new(vertices, faces, list)).collect()
}

/// A closed part of the surface; see the docs of the [check](super).
pub(super) struct Shell {
    pub(super) faces: Vec<usize>,
    pub(super) bounds: Aabb,
    pub(super) signed_volume: f64,
    /// The sum of the absolute values of all products in the volume, to tell a volume from its rounding.
    volume_scale: f64,
}

impl Shell {
    pub(super) fn new(vertices: &[DVec3], faces: &[Face], list: Vec<usize>) -> Shell {
        let corners = |face: &usize| faces[*face].corners.map(|vertex| vertices[vertex as usize]);
        let bounds = list.iter().flat_map(corners).fold(EMPTY, include);
        let centre = bounds.min * 0.5 + bounds.max * 0.5;
        let (mut signed_volume, mut volume_scale) = (0.0, 0.0);
        for face in &list {
            let [a, b, c] = corners(face).map(|corner| corner - centre);
            signed_volume += a.dot(b.cross(c)) / 6.0;
            let [a, b, c] = [a.abs(), b.abs(), c.abs()];
            let products = DVec3::new(b.y * c.z + b.z * c.y, b.z * c.x + b.x * c.z, b.x * c.y + b.y * c.x);
            volume_scale += a.dot(products) / 6.0;
        }
        Shell { faces: list, bounds, signed_volume, volume_scale }
    }

    /// Returns outwards, inwards, or neither where the volume is zero to within rounding, or NaN.
    pub(super) fn facing(&self) -> Facing {
        if self.signed_volume > 1e-12 * self.volume_scale {
            Facing::Outwards
        } else if self.signed_volume < -1e-12 * self.volume_scale {
            Facing::Inwards
        } else {
            Facing::Neither
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Facing {
    Outwards,
    Inwards,
    Neither,
}

/// The uses of an edge by a shell: their number, and the excess of forward over backward ones.
struct Balance {
    shell: u32,
    uses: usize,
    excess: isize,
}

impl Balance {
    /// Returns whether the edge would be closed and balanced if there were only this shell.
    fn is_balanced(&self) -> bool {
        self.excess == 0 && self.uses.is_multiple_of(2)
    }
}

/// Returns the balance of each shell that meets in an edge.
fn balance(run: &[Use], shells: &UnionFind) -> Vec<Balance> {
    let mut uses: Vec<(u32, bool)> = run.iter().map(|u| (shells.find(u.face() as u32), u.is_forward())).collect();
    uses.sort_unstable();
    let of_shell = |uses: &[(u32, bool)]| {
        let forward = uses.iter().filter(|(_, forward)| *forward).count();
        Balance { shell: uses[0].0, uses: uses.len(), excess: 2 * forward as isize - uses.len() as isize }
    };
    uses.chunk_by(|a, b| a.0 == b.0).map(of_shell).collect()
}

/// Joins shells across an edge of more than two uses, where the solid lies between two faces.
fn join_around(vertices: &[DVec3], faces: &[Face], run: &[Use], shells: &UnionFind) {
    let unbalanced = balance(run, shells).iter().filter(|b| !b.is_balanced()).map(|b| b.shell).collect::<Vec<_>>();
    if unbalanced.is_empty() {
        return;
    }
    let position = |vertex: u32| vertices[vertex as usize];
    let foot = position((run[0].edge >> 32) as u32);
    let along = (position(run[0].edge as u32) - foot).normalize_or_zero();
    let right = along.any_orthonormal_vector();
    let up = along.cross(right);
    // A number that grows with the angle, from 0 to 4 for a full turn. It is rounded so that coplanar faces are equal.
    let turn = |face: &Face, corner: usize| {
        let arm = position(face.corners[(corner + 2) % 3]) - foot;
        let (x, y) = (arm.dot(right), arm.dot(up));
        let quarter = if y >= 0.0 { 1.0 - x / (x.abs() + y) } else { 3.0 + x / (x.abs() - y) };
        (quarter * f64::from(1 << 28)).round() as i64 % (4 << 28)
    };
    // Going round, the solid begins behind a face that uses the edge backwards and ends at one that uses it forwards.
    // Of faces at the same angle those that end a solid come first, or touching solids would be one. Among those that
    // also face the same way, any pairing is right that is the same at all their edges, whichever way these run: the
    // order of faces where solids begin and the reverse where they end, as brackets nest.
    let mut around: Vec<(i64, bool, i64, Use)> = run
        .iter()
        .filter(|u| unbalanced.binary_search(&shells.find(u.face() as u32)).is_ok())
        .map(|u| {
            let rank = u.face() as i64;
            let rank = if u.is_forward() { -rank } else { rank };
            (turn(&faces[u.face()], u.corner() % 3), !u.is_forward(), rank, *u)
        })
        .collect();
    around.sort_unstable();
    let (mut begun, mut left): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
    for (_, begins, _, u) in around {
        if begins {
            begun.push(u.face() as u32);
        } else if let Some(other) = begun.pop() {
            shells.join(u.face() as u32, other);
        } else {
            left.push(u.face() as u32);
        }
    }
    for end in left {
        // A solid that began before the turn was over ends after its start.
        if let Some(other) = begun.pop() {
            shells.join(end, other);
        }
    }
}
