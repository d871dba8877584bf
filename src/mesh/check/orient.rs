//! Which triangles of a closed mesh to turn, so that all are consistently oriented.

use super::edges::{Use, edge_uses, edges};
use super::nesting::depths;
use super::report::MeshReport;
use super::shells::{self, Facing};
use super::{Face, weld};
use crate::cancel::checkpoint;
use crate::mesh::TriangleMesh;
use crate::union_find::UnionFind;

/// Number of faces between two checkpoints.
const BETWEEN_CHECKPOINTS: u32 = 1 << 16;

/// Returns for each triangle whether to turn it, so that triangles that share an edge of exactly two uses use it in
/// opposite directions, and shells face outwards at even depth and inwards at odd depth. `None` if that is not possible,
/// as on a one-sided surface. Where edges have more uses, the result may still not be consistently oriented.
pub(in crate::mesh) fn turns(mesh: &TriangleMesh) -> Option<Vec<bool>> {
    let (vertices, mut faces) = weld(mesh, &mut MeshReport::default());
    let uses = edge_uses(&faces);
    let mut turned = agree(&neighbours(&uses, faces.len()))?;
    for (face, _) in faces.iter_mut().zip(&turned).filter(|(_, turned)| **turned) {
        face.corners.swap(1, 2);
    }
    let uses = edge_uses(&faces);
    let joined = UnionFind::new(faces.len() as u32);
    for run in edges(&uses).filter(|run| run.len() == 2) {
        joined.join(run[0].face() as u32, run[1].face() as u32);
    }
    let shells = shells::closed(&vertices, &faces, &uses, &joined, &mut MeshReport::default());
    for (shell, depth) in shells.iter().zip(depths(&vertices, &faces, &shells)) {
        if matches!((shell.facing(), depth % 2), (Facing::Inwards, 0) | (Facing::Outwards, 1)) {
            shell.faces.iter().for_each(|&face| turned[face] = !turned[face]);
        }
    }
    let mut of_triangles = vec![false; mesh.triangles.len()];
    for (Face { triangle, .. }, turned) in faces.iter().zip(turned) {
        of_triangles[*triangle] = turned;
    }
    Some(of_triangles)
}

/// A face beyond an edge of exactly two uses, and whether one of the two must be turned.
type Neighbour = Option<(u32, bool)>;

/// Returns the neighbours of each face.
fn neighbours(uses: &[Use], faces: usize) -> Vec<[Neighbour; 3]> {
    let mut neighbours = vec![[None; 3]; faces];
    for run in edges(uses) {
        let [a, b] = run else { continue };
        let must_differ = a.is_forward() == b.is_forward();
        for (here, there) in [(a, b), (b, a)] {
            neighbours[here.face()][here.corner() % 3] = Some((there.face() as u32, must_differ));
        }
    }
    neighbours
}

/// Returns which faces to turn, so that neighbours agree; `None` where they cannot. The first face of each set of
/// neighbours stays.
fn agree(neighbours: &[[Neighbour; 3]]) -> Option<Vec<bool>> {
    let mut turned: Vec<Option<bool>> = vec![None; neighbours.len()];
    let (mut stack, mut visited) = (Vec::new(), 0u32);
    for first in 0..neighbours.len() {
        if turned[first].is_none() {
            turned[first] = Some(false);
            stack.push(first);
        }
        while let Some(face) = stack.pop() {
            visited += 1;
            if visited.is_multiple_of(BETWEEN_CHECKPOINTS) {
                checkpoint();
            }
            let own = turned[face]?;
            for (other, must_differ) in
                neighbours[face].iter().flatten().map(|&(other, differ)| (other as usize, differ))
            {
                match turned[other] {
                    None => {
                        turned[other] = Some(own != must_differ);
                        stack.push(other);
                    }
                    Some(found) if found != (own != must_differ) => return None,
                    Some(_) => {}
                }
            }
        }
    }
    turned.into_iter().collect()
}
