//! A part of the surface that is decimated by itself: its border stays, so that parts are independent.

use glam::DVec3;

use super::Limits;
use super::collapse::{Collapsed, Collapser};
use super::nodes::NodeGuard;
use super::original::Original;
use crate::closest::ClosestTriangle;
use crate::mesh::{Aabb, TriangleMesh};

/// A part of the surface and the part of the original assigned to it.
pub(super) struct Patch {
    /// Vertices that its triangles use, as indices of original positions, sorted.
    vertices: Vec<u32>,
    /// Its initial triangles, by places in `vertices`.
    start: Vec<[u32; 3]>,
    /// For each of `vertices`, whether it must stay.
    locked: Vec<bool>,
    /// The assigned part of the original.
    original: Share,
    result: Collapsed,
}

/// The part of the original assigned to a patch.
#[derive(Default)]
pub(super) struct Share {
    /// Original vertices that must be near the patch.
    pub points: Vec<u32>,
    /// For each of `points` the triangle of the patch that it is assigned to.
    pub homes: Vec<u32>,
    /// Original triangles that the patch must be near.
    pub triangles: Vec<u32>,
}

/// The part of a patch that is closest to a point.
pub(super) struct Near {
    /// Its distance from the point.
    pub distance: f64,
    /// Places of vertices of the triangles there.
    pub places: Vec<u32>,
}

impl Patch {
    /// Creates a patch of triangles of original vertices; those for which `is_border` holds must stay.
    pub(super) fn new(triangles: &[[u32; 3]], is_border: impl Fn(u32) -> bool, original: Share) -> Patch {
        let mut vertices = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |vertex: u32| vertices.binary_search(&vertex).expect("all vertices are listed") as u32;
        let start = triangles.iter().map(|indices| indices.map(place)).collect();
        let locked = vertices.iter().map(|&vertex| is_border(vertex)).collect();
        Patch { vertices, start, locked, original, result: Collapsed::default() }
    }

    /// Returns its current triangles, by original vertices.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.result.triangles.iter().map(|indices| indices.map(|place| self.vertices[place as usize]))
    }

    /// Returns for each of its triangles whether it is new.
    pub(super) fn is_new(&self) -> impl Iterator<Item = bool> {
        self.result.is_new.iter().copied()
    }

    /// Returns the largest distance measured, in either direction.
    pub(super) fn distance(&self) -> f64 {
        self.result.distance
    }

    /// Returns the number of its locked vertices.
    pub(super) fn locked(&self) -> usize {
        self.locked.iter().filter(|locked| **locked).count()
    }

    /// Returns the original vertices, each with the triangle of the patch that it is assigned to.
    pub(super) fn homes(&self) -> impl Iterator<Item = (u32, u32)> {
        self.original.points.iter().copied().zip(self.result.homes.iter().copied())
    }

    /// Returns its bounding box.
    pub(super) fn bounds(&self, original: &TriangleMesh) -> Aabb {
        let empty = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        self.vertices.iter().fold(empty, |bounds, &vertex| {
            let position = original.positions[vertex as usize];
            bounds.union(Aabb { min: position, max: position })
        })
    }

    /// Collapses edges as far as the limits allow.
    pub(super) fn decimate(&mut self, original: &TriangleMesh, limits: &Limits) {
        let Aabb { min, max } = self.bounds(original);
        // Near their middle, coordinates have the smallest rounding.
        let middle = 0.5 * (min + max);
        let place = |&vertex: &u32| original.positions[vertex as usize] - middle;
        let points: Vec<DVec3> = self.vertices.iter().map(place).collect();
        let samples: Vec<DVec3> = self.original.points.iter().map(place).collect();
        let corners = |&triangle: &u32| original.triangles[triangle as usize].map(|vertex| place(&vertex));
        let near = Original::new(self.original.triangles.iter().map(corners), limits.bound);
        let guard = limits.grid.map(|grid| NodeGuard::new(grid, middle));
        let assigned = (&samples[..], &self.original.homes[..]);
        let collapser = Collapser::new(&points, self.start.clone(), &self.locked, assigned, limits.bound);
        self.result = collapser.run(near, guard.as_ref());
    }

    /// Restores the patch permanently.
    pub(super) fn leave(&mut self, original: &TriangleMesh, limits: &Limits) {
        self.locked.fill(true);
        self.decimate(original, limits);
    }

    /// Locks places and all within `rings` edges of them.
    pub(super) fn lock(&mut self, places: impl IntoIterator<Item = u32>, rings: usize) {
        let mut fresh = vec![false; self.vertices.len()];
        places.into_iter().for_each(|place| fresh[place as usize] = true);
        for _ in 0..rings {
            let inner = fresh.clone();
            for indices in &self.start {
                if indices.iter().any(|&place| inner[place as usize]) {
                    indices.iter().for_each(|&place| fresh[place as usize] = true);
                }
            }
        }
        self.locked.iter_mut().zip(fresh).for_each(|(locked, fresh)| *locked |= fresh);
    }

    /// Returns for each point its distance from the initial patch, and the vertices of the triangles that are closest to it or
    /// at most `slack` farther than the closest.
    pub(super) fn near(&self, original: &TriangleMesh, points: &[DVec3], slack: f64) -> Vec<Near> {
        let corners =
            |indices: &[u32; 3]| indices.map(|place| original.positions[self.vertices[place as usize] as usize]);
        let tree = ClosestTriangle::new(&self.start.iter().map(corners).collect::<Vec<_>>());
        let near = points.iter().map(|&point| {
            let closest = tree.of(point, 0);
            let distance = closest.squared.sqrt();
            let near = tree.within(point, distance + slack);
            let vertices = near.into_iter().flat_map(|triangle| self.start[triangle as usize]);
            Near { distance, places: vertices.collect() }
        });
        near.collect()
    }
}
