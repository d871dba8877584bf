//! A part of the surface that is decimated by itself: its border stays, so that parts are independent.

use glam::DVec3;

use super::collapse::{Age, Collapsed, Collapser, Standing};
use super::nodes::NodeGuard;
use super::original::Original;
use super::{Target, spread};
use crate::closest::ClosestTriangle;
use crate::mesh::Aabb;

/// A part of the surface and the part of the original assigned to it.
pub(super) struct Patch {
    /// Vertices that its triangles use, as indices of original positions, sorted.
    vertices: Vec<u32>,
    /// Its initial triangles, by places in `vertices`.
    start: Vec<[u32; 3]>,
    /// Their ages and errors.
    ages: Vec<Age>,
    errors: Vec<f64>,
    /// For each of `vertices`, whether it may be removed.
    standings: Vec<Standing>,
    /// The assigned part of the original.
    original: Share,
    result: Collapsed,
}

/// The part of the original assigned to a patch.
#[derive(Default)]
pub(super) struct Share {
    /// Points of the original that must be near the patch.
    pub points: Vec<u32>,
    /// For each of `points` the triangle of the patch that it is assigned to.
    pub homes: Vec<u32>,
    /// Triangles of the original that the patch must be near, by original vertices, besides those of its own that are nearly on the
    /// original.
    pub triangles: Vec<[u32; 3]>,
}

/// The part of a patch that is closest to a point.
pub(super) struct Near {
    /// Its distance from the point.
    pub distance: f64,
    /// Places of vertices of the triangles there.
    pub places: Vec<u32>,
}

impl Patch {
    /// Creates a patch of triangles of original vertices, with their ages and errors, and with the standing of each vertex.
    pub(super) fn new(
        triangles: &[[u32; 3]],
        (ages, errors): (Vec<Age>, Vec<f64>),
        standing: impl Fn(u32) -> Standing,
        original: Share,
    ) -> Patch {
        let mut vertices = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |vertex: u32| vertices.binary_search(&vertex).expect("all vertices are listed") as u32;
        let start = triangles.iter().map(|indices| indices.map(place)).collect();
        let standings = vertices.iter().map(|&vertex| standing(vertex)).collect();
        Patch { vertices, start, ages, errors, standings, original, result: Collapsed::default() }
    }

    /// Returns its current triangles, by original vertices.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.result.triangles.iter().map(|indices| indices.map(|place| self.vertices[place as usize]))
    }

    /// Returns the original vertices of triangles with a vertex that had to stay, and whether the triangle is new.
    pub(super) fn beside_locked(&self) -> impl Iterator<Item = (u32, bool)> {
        let is_locked = |&place: &u32| self.standings[place as usize] == Standing::Locked;
        let beside =
            self.result.triangles.iter().zip(self.ages()).filter(move |(indices, _)| indices.iter().any(is_locked));
        beside.flat_map(|(indices, age)| indices.map(|place| (self.vertices[place as usize], *age == Age::New)))
    }

    /// Returns the ages of its triangles.
    pub(super) fn ages(&self) -> &[Age] {
        &self.result.ages
    }

    /// Returns for each of its triangles a bound of its distance from the original, in either direction.
    pub(super) fn errors(&self) -> &[f64] {
        &self.result.errors
    }

    /// Returns the largest of these, or distance measured.
    pub(super) fn distance(&self) -> f64 {
        self.result.distance
    }

    /// Returns the number of its locked vertices.
    pub(super) fn locked(&self) -> usize {
        self.standings.iter().filter(|standing| **standing == Standing::Locked).count()
    }

    /// Returns the points of the original, each with the triangle of the patch that it is assigned to.
    pub(super) fn homes(&self) -> impl Iterator<Item = (u32, u32)> {
        self.original.points.iter().copied().zip(self.result.homes.iter().copied())
    }

    /// Returns its bounding box.
    pub(super) fn bounds(&self, target: &Target) -> Aabb {
        let empty = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        self.vertices.iter().fold(empty, |bounds, &vertex| {
            let position = target.original.positions[vertex as usize];
            bounds.union(Aabb { min: position, max: position })
        })
    }

    /// Collapses edges as far as the limits allow.
    pub(super) fn decimate(&mut self, target: &Target) {
        let Aabb { min, max } = self.bounds(target);
        let bounds = [target.limits.bound - target.slack, target.flat()];
        // Near their middle, coordinates have the smallest rounding.
        let middle = 0.5 * (min + max);
        let place = |vertex: u32| target.original.positions[vertex as usize] - middle;
        let points: Vec<DVec3> = self.vertices.iter().map(|&vertex| place(vertex)).collect();
        let samples: Vec<DVec3> = self.original.points.iter().map(|&point| target.point(point) - middle).collect();
        let guard = target.limits.grid.map(|grid| NodeGuard::new(grid, middle));
        let (start, known) = (self.start.clone(), (self.ages.clone(), self.errors.clone()));
        let assigned = (&samples[..], &self.original.homes[..]);
        let collapser = Collapser::new(&points, start, known, &self.standings, assigned, bounds);
        let original = target.measures.then_some(|| {
            let flat = self.start.iter().zip(&self.errors).filter(|(_, error)| **error <= target.flat());
            let own: Vec<[u32; 3]> = flat.map(|(indices, _)| *indices).collect();
            Original::new([&own, &self.original.triangles], &self.vertices, place, target.spacing, bounds)
        });
        self.result = collapser.run(original, guard.as_ref());
    }

    /// Restores the patch permanently.
    pub(super) fn leave(&mut self, target: &Target) {
        self.standings.fill(Standing::Locked);
        self.decimate(target);
    }

    /// Locks places and all within `rings` edges of them.
    pub(super) fn lock(&mut self, places: impl IntoIterator<Item = u32>, rings: usize) {
        let mut fresh = vec![false; self.vertices.len()];
        places.into_iter().for_each(|place| fresh[place as usize] = true);
        (0..rings).for_each(|_| spread(&mut fresh, &self.start));
        let fresh = self.standings.iter_mut().zip(fresh).filter(|(_, fresh)| *fresh);
        fresh.for_each(|(standing, _)| *standing = Standing::Locked);
    }

    /// Returns for each point its distance from the initial patch, and the vertices of the triangles that are closest to it or
    /// at most `slack` farther than the closest.
    pub(super) fn near(&self, target: &Target, points: &[DVec3], slack: f64) -> Vec<Near> {
        let position = |place: u32| target.original.positions[self.vertices[place as usize] as usize];
        let corners = |indices: &[u32; 3]| indices.map(position);
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
