//! The shells of the operands, and what is proved about their winding numbers.

use crate::parallel::*;
use glam::DVec3;

use super::CertifiedError;
use crate::cancel::checkpoint;
use crate::mesh::{ClosedMesh, TriangleMesh, prove_simple};
use crate::union_find::UnionFind;

/// A closed part of an operand's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shell {
    pub operand: u32,
    /// 1 if its winding numbers are proved to be 0 and 1, −1 if they are proved to be 0 and −1.
    pub sign: Option<i32>,
}

/// The shells of all operands, in their order.
pub(super) struct Shells {
    shells: Vec<Shell>,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// The shell of each triangle, in ascending order.
    shell_of: Vec<u32>,
}

impl Shells {
    /// Takes oriented meshes apart; coordinates are multiplied by `scale`, a power of two.
    pub fn of(operands: &[&ClosedMesh], scale: f64) -> Result<Shells, CertifiedError> {
        let mut all = Shells { shells: Vec::new(), positions: Vec::new(), triangles: Vec::new(), shell_of: Vec::new() };
        for (operand, &mesh) in operands.iter().enumerate() {
            all.add(operand as u32, mesh, scale);
            if all.triangles.len() >= 1 << 31 || all.positions.len() >= 1 << 32 {
                return Err(CertifiedError::TooManyTriangles);
            }
        }
        Ok(all)
    }

    /// Adds an operand: as one shell, if its winding numbers are simple, else by parts that sides connect.
    fn add(&mut self, operand: u32, mesh: &ClosedMesh, scale: f64) {
        let first = self.positions.len() as u32;
        self.positions.extend(mesh.mesh().positions.iter().map(|&position| position * scale));
        let mut parts = vec![mesh.mesh().triangles.clone()];
        let mut signs = vec![sign(mesh)];
        if signs == [None] {
            parts = connected(mesh.mesh());
            signs = parts.par_iter().map(|triangles| sign_of_part(mesh.mesh(), triangles)).collect();
        }
        for (triangles, sign) in parts.into_iter().zip(signs) {
            let shell = self.shells.len() as u32;
            self.shells.push(Shell { operand, sign });
            self.shell_of.extend(std::iter::repeat_n(shell, triangles.len()));
            self.triangles.extend(triangles.into_iter().map(|triangle| triangle.map(|v| v + first)));
        }
    }

    pub fn shell(&self, shell: u32) -> Shell {
        self.shells[shell as usize]
    }

    /// Returns whether the winding numbers of the only operand are proved to be 0 and one of 1 and −1.
    pub fn are_simple(&self) -> bool {
        matches!(self.shells[..], [Shell { sign: Some(_), .. }])
    }

    pub fn triangles(&self) -> usize {
        self.triangles.len()
    }

    pub fn shell_of(&self, triangle: u32) -> u32 {
        self.shell_of[triangle as usize]
    }

    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }
}

/// Returns the sign of the winding number inside, if it is proved to have one value there and to be 0 elsewhere.
fn sign(mesh: &ClosedMesh) -> Option<i32> {
    prove_simple(mesh).ok()?;
    let sums = mesh.mass_properties();
    (sums.volume.abs() > sums.volume_rounding).then_some(if sums.volume > 0.0 { 1 } else { -1 })
}

fn sign_of_part(mesh: &TriangleMesh, triangles: &[[u32; 3]]) -> Option<i32> {
    checkpoint();
    let (part, _) = mesh.of_triangles(triangles.to_vec());
    sign(&ClosedMesh::check(part).ok()?)
}

/// Returns the sets of triangles that sides connect. All uses of a side are in one set, so that each set is closed, and its
/// winding numbers are defined if those of the mesh are.
fn connected(mesh: &TriangleMesh) -> Vec<Vec<[u32; 3]>> {
    let mut welded = mesh.clone();
    welded.weld();
    let mut sides: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * welded.triangles.len());
    for (&[a, b, c], index) in welded.triangles.iter().zip(0..) {
        sides.extend([(a, b), (b, c), (c, a)].map(|(from, to)| ([from.min(to), from.max(to)], index)));
    }
    sides.par_sort_unstable();
    let sets = UnionFind::new(welded.triangles.len() as u32);
    sides.windows(2).filter(|pair| pair[0].0 == pair[1].0).for_each(|pair| sets.join(pair[0].1, pair[1].1));
    let mut order: Vec<(u32, u32)> = sets.roots().into_iter().zip(0..).collect();
    order.sort_unstable();
    let part = |part: &[(u32, u32)]| part.iter().map(|&(_, index)| mesh.triangles[index as usize]).collect();
    order.chunk_by(|a, b| a.0 == b.0).map(part).collect()
}
