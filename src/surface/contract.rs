//! Contraction of edges, one after another, while the surface stays a manifold.

use super::fans::retain;
use super::manifold::Stars;
use crate::mesh::TriangleMesh;

/// The place of a vertex whose triangles are as given.
const AS_GIVEN: u32 = u32::MAX;

/// A mesh whose edges are contracted.
pub(super) struct Contraction<'m> {
    pub mesh: &'m mut TriangleMesh,
    /// The triangles at vertices, before any edge was contracted.
    given: &'m Stars,
    /// The triangles at vertices that were changed, and the place of each vertex's among them.
    changed: Vec<Vec<u32>>,
    places: Vec<u32>,
    is_removed: Vec<bool>,
}

impl<'m> Contraction<'m> {
    pub fn of(mesh: &'m mut TriangleMesh, given: &'m Stars) -> Contraction<'m> {
        let (places, is_removed) = (vec![AS_GIVEN; mesh.positions.len()], vec![false; mesh.triangles.len()]);
        Contraction { mesh, given, changed: Vec::new(), places, is_removed }
    }

    /// Removes the triangles that have lost a side. `sources` follow the triangles.
    pub fn finish<S>(self, sources: &mut Vec<S>) {
        let is_kept: Vec<bool> = self.is_removed.iter().map(|removed| !removed).collect();
        retain(self.mesh, sources, &is_kept);
    }

    /// Returns the triangles at a vertex, in order.
    pub fn star(&self, vertex: u32) -> Vec<u32> {
        let is_left = |triangle: &u32| !self.is_removed[*triangle as usize];
        match self.places[vertex as usize] {
            AS_GIVEN => {
                let given = self.given.corners_at(vertex as usize).iter().map(|corner| corner / 3);
                let mut star: Vec<u32> = given.filter(is_left).collect();
                star.sort_unstable();
                star
            }
            place => self.changed[place as usize].iter().copied().filter(is_left).collect(),
        }
    }

    fn set_star(&mut self, vertex: u32, mut star: Vec<u32>) {
        star.sort_unstable();
        match &mut self.places[vertex as usize] {
            place @ &mut AS_GIVEN => {
                *place = self.changed.len() as u32;
                self.changed.push(star);
            }
            place => self.changed[*place as usize] = star,
        }
    }

    /// Returns the other vertices of some triangles around a vertex, sorted.
    pub fn ring(&self, vertex: u32, star: &[u32]) -> Vec<u32> {
        let corners = star.iter().flat_map(|&triangle| self.mesh.triangles[triangle as usize]);
        let mut ring: Vec<u32> = corners.filter(|&corner| corner != vertex).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// Moves all triangles of the second vertex to the first, if an edge joins them and the surface stays a manifold: if they have
    /// no common neighbours but the two beside the edge (the link condition of Dey et al., "Topology preserving edge
    /// contraction", 1999).
    pub fn contract(&mut self, kept: u32, gone: u32) -> bool {
        let (kept_star, gone_star) = (self.star(kept), self.star(gone));
        let at_edge: Vec<u32> =
            gone_star.iter().copied().filter(|triangle| kept_star.binary_search(triangle).is_ok()).collect();
        if at_edge.len() != 2 {
            return false;
        }
        let (kept_ring, gone_ring) = (self.ring(kept, &kept_star), self.ring(gone, &gone_star));
        let common = gone_ring.iter().filter(|vertex| kept_ring.binary_search(vertex).is_ok()).count();
        let beside = at_edge.iter().flat_map(|&triangle| self.mesh.triangles[triangle as usize]);
        let third: Vec<u32> = beside.filter(|&corner| corner != kept && corner != gone).collect();
        let [one, other] = third[..] else { return false };
        // Two triangles with the same corners have one beside the edge.
        if common != 2 || one == other {
            return false;
        }
        if kept_star.len() + gone_star.len() == 6 {
            // A tetrahedron without volume, about.
            kept_star.iter().chain(&gone_star).for_each(|&triangle| self.is_removed[triangle as usize] = true);
            return true;
        }
        for &triangle in &gone_star {
            let corners = &mut self.mesh.triangles[triangle as usize];
            corners.iter_mut().filter(|corner| **corner == gone).for_each(|corner| *corner = kept);
        }
        at_edge.iter().for_each(|&triangle| self.is_removed[triangle as usize] = true);
        self.set_star(gone, Vec::new());
        self.set_star(kept, kept_star.into_iter().chain(gone_star).collect());
        true
    }
}
