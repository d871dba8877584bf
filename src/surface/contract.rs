//! Contraction of edges, one after another, while the surface stays a manifold.

use std::collections::{HashMap, HashSet};

use super::fans::retain;
use super::manifold::Stars;
use crate::mesh::TriangleMesh;

/// A mesh whose edges are contracted.
pub(super) struct Contraction<'m> {
    pub mesh: &'m mut TriangleMesh,
    /// The triangles at vertices, before any edge was contracted.
    given: &'m Stars,
    /// The triangles at vertices that were changed.
    stars: HashMap<u32, Vec<u32>>,
    removed: HashSet<u32>,
}

impl<'m> Contraction<'m> {
    pub fn of(mesh: &'m mut TriangleMesh, given: &'m Stars) -> Contraction<'m> {
        Contraction { mesh, given, stars: HashMap::new(), removed: HashSet::new() }
    }

    /// Removes the triangles that have lost a side. `sources` follow the triangles.
    pub fn finish<S>(self, sources: &mut Vec<S>) {
        let Contraction { mesh, removed, .. } = self;
        let kept: Vec<bool> = (0..mesh.triangles.len() as u32).map(|triangle| !removed.contains(&triangle)).collect();
        retain(mesh, sources, &kept);
    }

    /// Returns the triangles at a vertex, in order.
    pub fn star(&mut self, vertex: u32) -> Vec<u32> {
        let given = || self.given.corners_at(vertex as usize).iter().map(|corner| corner / 3).collect();
        let star = self.stars.entry(vertex).or_insert_with(given);
        star.retain(|triangle| !self.removed.contains(triangle));
        star.sort_unstable();
        star.clone()
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
        let beside: HashSet<u32> =
            at_edge.iter().flat_map(|&triangle| self.mesh.triangles[triangle as usize]).collect();
        // Two triangles with the same corners have three in all.
        if common != 2 || beside.len() != 4 {
            return false;
        }
        let all: HashSet<u32> = kept_star.iter().chain(&gone_star).copied().collect();
        if all.len() == 4 {
            // A tetrahedron without volume, about.
            self.removed.extend(all);
            return true;
        }
        for &triangle in &gone_star {
            let corners = &mut self.mesh.triangles[triangle as usize];
            corners.iter_mut().filter(|corner| **corner == gone).for_each(|corner| *corner = kept);
        }
        self.removed.extend(at_edge);
        self.stars.insert(gone, Vec::new());
        self.stars.entry(kept).or_default().extend(gone_star);
        let star = self.stars.get_mut(&kept).expect("it was just added to");
        star.sort_unstable();
        star.dedup();
        true
    }
}
