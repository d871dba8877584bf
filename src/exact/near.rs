//! The faces of a body near other bodies: those that may meet them, and those that may meet these.

use crate::parallel::*;

use super::bodies::Bodies;
use crate::box_tree::Box32;
use crate::cancel::checkpoint;
use crate::face_tree::FaceTree;

/// The share of runs near other bodies from which all faces of a body are taken.
const MOST: f64 = 0.75;

/// The faces of a body that are near others.
pub(super) struct Near {
    pub tree: FaceTree,
    /// The tree holds all faces of the body that touch this box.
    complete: Box32,
}

impl Near {
    /// Returns the faces of a body that touch the box around other bodies near it, and those that touch the box around these; or
    /// all, if most do.
    pub fn of(own: usize, bodies: &Bodies) -> Option<Near> {
        checkpoint();
        let (all, body) = (&bodies.bodies, &bodies.bodies[own]);
        let others = (0..all.len()).filter(|&other| other != own && all[other].extent.touches(&body.extent));
        let around = others.map(|other| all[other].extent).reduce(Box32::union)?;
        let touching = |extent: Box32| {
            let faces = bodies.faces_in_runs(body, move |run| run.touches(&extent));
            faces.map(|face| (face, bodies.extent(face))).filter(move |(_, own)| own.touches(&extent))
        };
        let runs = bodies.runs(body);
        let near = runs.clone().filter(|(extent, _)| extent.touches(&around)).count();
        if near as f64 >= MOST * runs.len() as f64 {
            return Some(Near { tree: bodies.tree(body), complete: Box32::WHOLE });
        }
        let complete = touching(around).map(|(_, extent)| extent).reduce(|| Box32::EMPTY, Box32::union);
        let tree = || FaceTree::new(&complete, touching(complete), |face| bodies.extent(face));
        (complete != Box32::EMPTY).then(|| Near { tree: tree(), complete })
    }

    /// Returns the tree if it holds all faces of the body.
    pub fn whole(&self) -> Option<&FaceTree> {
        (self.complete == Box32::WHOLE).then_some(&self.tree)
    }

    /// Returns whether the tree holds the needed faces, of which there are this many, and all that touch one of them.
    pub fn has_all_around(&self, is_needed: &[bool], count: usize, first: u32) -> bool {
        let faces = self.tree.faces().par_iter().enumerate().with_min_len(4096);
        let is_found = |(place, face): &(usize, &u32)| {
            is_needed[(**face - first) as usize] && self.complete.contains(&self.tree.extent(*place))
        };
        faces.filter(is_found).count() == count
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::exact::bodies::{Lattice, Wholeness};
    use crate::mesh::{ClosedMesh, TriangleMesh};
    use crate::solids;
    use crate::testing::meshes::{cube, together};

    /// A row of cubes, of which another solid meets the first, and a bar from within that cube to the last.
    #[test]
    fn faces_outside_the_complete_box_lack_some_around_them() {
        let row: Vec<TriangleMesh> = (0..40).map(|i| cube(2.0 * f64::from(i) * DVec3::X, 1.0)).collect();
        let bar = solids::cuboid(DVec3::splat(0.8), DVec3::new(79.0, 0.9, 0.9)).unwrap();
        let solids = [together(&[together(&row), bar]), cube(-DVec3::ONE, 1.5)];
        let solids = solids.map(|mesh| ClosedMesh::check(mesh).unwrap());
        let lattice = Lattice::around(solids[0].bounds().union(solids[1].bounds()));
        let mut bodies = Bodies::default();
        for (index, solid) in solids.iter().enumerate() {
            bodies.add(index, solid, &lattice, Wholeness::Whole, None).unwrap();
        }
        let near = Near::of(0, &bodies).unwrap();
        assert!(near.whole().is_none());
        let has_all = |needed: &[u32]| {
            let is_needed: Vec<bool> = bodies.bodies[0].faces.clone().map(|face| needed.contains(&face)).collect();
            near.has_all_around(&is_needed, needed.len(), 0)
        };
        let found = near.tree.faces();
        let (within, beyond): (Vec<u32>, Vec<u32>) =
            found.iter().partition(|&&face| near.complete.contains(&bodies.extent(face)));
        assert!(!within.is_empty() && !beyond.is_empty() && found.len() < bodies.faces.len() / 2);
        assert!(has_all(&within));
        assert!(!has_all(&beyond[..1]) && !has_all(&[within[0], beyond[0]]));
        let missing = (0..bodies.bodies[0].faces.end).find(|face| !found.contains(face)).unwrap();
        assert!(!has_all(&[within[0], missing]));
    }
}
