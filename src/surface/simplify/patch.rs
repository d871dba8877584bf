//! A part of the surface that is decimated by itself: its border stays, so that parts are independent.

use glam::DVec3;
use meshopt::{SimplifyOptions, VertexDataAdapter, simplify_with_locks, typed_to_bytes};

use crate::closest::{ClosestTriangle, longest};
use crate::mesh::{Aabb, TriangleMesh};
use crate::surface::manifold::Faults;

/// Most decimations of a patch, each with more vertices locked, before it is restored.
const ATTEMPTS: usize = 8;

/// The initial error target of meshoptimizer, in bounds. It is the root of a weighted mean of squared distances from planes, so
/// that the largest distance comes out larger. On a gyroid of a million triangles and 0.09 % of its side, 0.5 leaves 44 % of
/// the triangles, 0.6 leaves 35 % for a sixth more time, 0.8 leaves 27 % for twice and a half that time.
const TARGET: f64 = 0.6;

/// Where more than one in this number of points is too far, the error target is reduced by this factor instead of locking.
const MANY: usize = 64;
const LESS: f64 = 0.75;

/// A triangle within this share of the bound is near enough to stop the search for the closest, which most points then find at
/// once; the measured distance is at most that larger.
const ENOUGH: f64 = 0.25;

/// Most subdivisions of a triangle's sides where its distance is sampled.
const MOST_PARTS: f64 = 16.0;

/// A part of the surface and the part of the original assigned to it.
pub(super) struct Patch {
    /// Vertices that its triangles use, as indices of original positions, sorted.
    vertices: Vec<u32>,
    /// Its initial triangles, by places in `vertices`.
    start: Vec<[u32; 3]>,
    /// For each of `vertices`, whether it must stay.
    locked: Vec<bool>,
    /// The current error target of meshoptimizer, in bounds.
    allowed: f64,
    /// The assigned part of the original.
    original: Share,
    result: Decimated,
}

/// The part of the original assigned to a patch.
#[derive(Default)]
pub(super) struct Share {
    /// Original vertices that must be near the patch.
    pub points: Vec<u32>,
    /// Original triangles whose centroids must be near the patch.
    pub centroids: Vec<u32>,
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

/// The reason why a decimated patch is not near enough to the original.
enum TooFar {
    /// It is too far at these places.
    At(Vec<DVec3>),
    /// It is too far at so many places that a smaller error target is better.
    Throughout,
}

/// The result of the decimation of a patch.
#[derive(Default)]
struct Decimated {
    /// Triangles by places in the vertices of the patch.
    triangles: Vec<[u32; 3]>,
    /// A near triangle for the points of the share, then for its centroids.
    homes: Vec<u32>,
    /// The largest distance measured, in either direction.
    distance: f64,
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
        Patch { vertices, start, locked, allowed: TARGET, original, result: Decimated::default() }
    }

    /// Returns its current triangles, by original vertices.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.result.triangles.iter().map(|indices| indices.map(|place| self.vertices[place as usize]))
    }

    /// Returns the largest distance measured, in either direction.
    pub(super) fn distance(&self) -> f64 {
        self.result.distance
    }

    /// Returns the number of its locked vertices.
    pub(super) fn locked(&self) -> usize {
        self.locked.iter().filter(|locked| **locked).count()
    }

    /// Returns the original vertices, each with a near triangle of the patch.
    pub(super) fn homes_of_points(&self) -> impl Iterator<Item = (u32, u32)> {
        self.original.points.iter().copied().zip(self.result.homes.iter().copied())
    }

    /// Returns the original triangles, each with a triangle of the patch that is near its centroid.
    pub(super) fn homes_of_centroids(&self) -> impl Iterator<Item = (u32, u32)> {
        let homes = &self.result.homes[self.original.points.len()..];
        self.original.centroids.iter().copied().zip(homes.iter().copied())
    }

    /// Returns its bounding box.
    pub(super) fn bounds(&self, original: &TriangleMesh) -> Aabb {
        let empty = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        self.vertices.iter().fold(empty, |bounds, &vertex| {
            let position = original.positions[vertex as usize];
            bounds.union(Aabb { min: position, max: position })
        })
    }

    /// Decimates the patch as far as the distances from the original allow; restores it in the worst case.
    pub(super) fn decimate(&mut self, original: &TriangleMesh, bound: f64) {
        // Without a part of the original there is nothing to measure from.
        let attempts = if self.original.triangles.is_empty() { 0 } else { ATTEMPTS };
        for rings in 0..attempts {
            let triangles = self.decimated(original, bound);
            if triangles.len() == self.start.len() {
                break;
            }
            let spoiled = self.spoiled(&triangles);
            if !spoiled.is_empty() {
                self.lock(spoiled, rings + 1);
                continue;
            }
            match self.measured(original, triangles, bound) {
                Ok(result) => {
                    self.result = result;
                    return;
                }
                Err(TooFar::At(places)) => {
                    let near = self.near(original, &places, 0.0);
                    self.lock(near.into_iter().flat_map(|near| near.places), rings);
                }
                Err(TooFar::Throughout) => self.allowed *= LESS,
            }
        }
        self.leave(original);
    }

    /// Restores the patch permanently.
    pub(super) fn leave(&mut self, original: &TriangleMesh) {
        self.locked.fill(true);
        let corners: Vec<_> = self.start.iter().map(|&indices| self.corners(original, indices)).collect();
        let tree = ClosestTriangle::new(&corners);
        let (homes, squared): (Vec<u32>, Vec<f64>) = self.homes(original, &tree, 0.0).unzip();
        let distance = squared.into_iter().fold(0.0, f64::max).sqrt();
        self.result = Decimated { triangles: self.start.clone(), homes, distance };
    }

    /// Locks these original vertices, where the patch has them, and all within `rings` edges of them.
    pub(super) fn lock_around(&mut self, vertices: &[u32], rings: usize) {
        let places = vertices.iter().filter_map(|vertex| self.vertices.binary_search(vertex).ok());
        self.lock(places.map(|place| place as u32).collect::<Vec<_>>(), rings);
    }

    /// Returns whether the patch uses a vertex.
    pub(super) fn has(&self, vertex: u32) -> bool {
        self.vertices.binary_search(&vertex).is_ok()
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
        let corners: Vec<_> = self.start.iter().map(|&indices| self.corners(original, indices)).collect();
        let tree = ClosestTriangle::new(&corners);
        let near = points.iter().map(|&point| {
            let closest = tree.of(point, 0);
            let mut near = vec![closest.triangle];
            if slack > 0.0 {
                near.extend(tree.within(point, closest.squared.sqrt() + slack));
            }
            let vertices = near.into_iter().flat_map(|triangle| self.start[triangle as usize]);
            Near { distance: closest.squared.sqrt(), places: vertices.collect() }
        });
        near.collect()
    }

    fn corners(&self, original: &TriangleMesh, indices: [u32; 3]) -> [DVec3; 3] {
        indices.map(|place| original.positions[self.vertices[place as usize] as usize])
    }

    /// Runs meshoptimizer on the patch.
    fn decimated(&self, original: &TriangleMesh, bound: f64) -> Vec<[u32; 3]> {
        let positions = || self.vertices.iter().map(|&vertex| original.positions[vertex as usize]);
        let min = positions().fold(DVec3::INFINITY, DVec3::min);
        let extent = positions().fold(DVec3::NEG_INFINITY, DVec3::max) - min;
        let scale = 1.0 / extent[longest(extent)];
        if !scale.is_normal() || self.locked.iter().all(|locked| *locked) {
            return self.start.clone();
        }
        let local: Vec<[f32; 3]> =
            positions().map(|position| ((position - min - extent * 0.5) * scale).as_vec3().to_array()).collect();
        let stride = size_of::<[f32; 3]>();
        let vertices =
            VertexDataAdapter::new(typed_to_bytes(&local), stride, 0).expect("whole vertices of three floats");
        let error = (self.allowed * bound * scale) as f32;
        // No `Prune`, which removes components; no `Regularize`, which gives up triangles for their shape.
        let options = SimplifyOptions::LockBorder | SimplifyOptions::ErrorAbsolute;
        let indices = simplify_with_locks(self.start.as_flattened(), &vertices, &self.locked, 0, error, options, None);
        indices.as_chunks().0.to_vec()
    }

    /// Returns the vertices at which decimation broke the surface, or that belong to a part whose topology it changed.
    fn spoiled(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let faults = |triangles: &[[u32; 3]]| {
            let positions = vec![DVec3::ZERO; self.vertices.len()];
            Faults::of(&TriangleMesh { positions, triangles: triangles.to_vec() })
        };
        let now = faults(triangles);
        // An edge with one use is a border edge. Fans of the border may meet in a vertex there.
        let edges = now.edges.iter().filter(|edge| edge.forward + edge.backward != 1).flat_map(|edge| edge.ends);
        let doubles = now.duplicates.iter().flat_map(|pair| triangles[pair[1] as usize]);
        let mut broken: Vec<u32> = edges.chain(doubles).collect();
        if !now.vertices.is_empty() {
            let before = faults(&self.start).vertices;
            broken.extend(now.vertices.iter().filter(|fault| !before.contains(fault)).map(|&(vertex, _)| vertex));
        }
        // A part may be large, so locking only broken places is preferred, if there are any.
        if broken.is_empty() {
            let [before, after] = [&self.start, triangles].map(|t| shapes(t, self.vertices.len(), &self.start));
            broken.extend((0..self.vertices.len() as u32).filter(|&place| before.of(place) != after.of(place)));
        }
        broken
    }

    /// Returns for each point and centroid of the share the triangle that is closest to it, or one within a distance of
    /// `enough`, and the square of its distance.
    fn homes(&self, original: &TriangleMesh, tree: &ClosestTriangle, enough: f64) -> impl Iterator<Item = (u32, f64)> {
        let mut hint = 0;
        self.share_points(original).map(move |point| {
            let closest = tree.near_enough(point, hint, enough);
            hint = closest.hint;
            (closest.triangle, closest.squared)
        })
    }

    /// Returns the points and then the centroids of the share.
    fn share_points(&self, original: &TriangleMesh) -> impl Iterator<Item = DVec3> {
        let points = self.original.points.iter().map(|&vertex| original.positions[vertex as usize]);
        let centroids = self.original.centroids.iter().map(|&triangle| {
            let [a, b, c] = original.triangles[triangle as usize].map(|vertex| original.positions[vertex as usize]);
            (a + b + c) / 3.0
        });
        points.chain(centroids)
    }

    /// Returns the triangles with their distances from the original, or the places where these exceed the bound or a triangle
    /// is flipped.
    fn measured(&self, original: &TriangleMesh, triangles: Vec<[u32; 3]>, bound: f64) -> Result<Decimated, TooFar> {
        let corners: Vec<_> = triangles.iter().map(|&indices| self.corners(original, indices)).collect();
        let tree = ClosestTriangle::new(&corners);
        let (mut places, mut largest) = (Vec::new(), 0.0f64);
        let mut homes = Vec::with_capacity(self.original.points.len() + self.original.centroids.len());
        let most = homes.capacity() / MANY;
        for (point, (home, squared)) in self.share_points(original).zip(self.homes(original, &tree, ENOUGH * bound)) {
            homes.push(home);
            largest = largest.max(squared);
            if squared > bound * bound {
                places.push(point);
                if places.len() > most {
                    return Err(TooFar::Throughout);
                }
            }
        }

        let mut before = self.start.clone();
        before.sort_unstable();
        let is_new = |indices: &[u32; 3]| before.binary_search(indices).is_err();
        let new = triangles.iter().zip(&corners).filter(|(indices, _)| is_new(indices)).map(|(_, corners)| *corners);
        let reverse = self.reverse_distance(original, new, bound, &mut places);
        if !places.is_empty() {
            return Err(TooFar::At(places));
        }
        Ok(Decimated { triangles, homes, distance: largest.max(reverse).sqrt() })
    }

    /// Returns the square of the largest distance of new triangles from the original; adds the places where it exceeds the
    /// bound or a triangle is flipped.
    fn reverse_distance(
        &self,
        original: &TriangleMesh,
        new: impl Iterator<Item = [DVec3; 3]>,
        bound: f64,
        places: &mut Vec<DVec3>,
    ) -> f64 {
        let position = |vertex: u32| original.positions[vertex as usize];
        let around: Vec<[DVec3; 3]> =
            self.original.triangles.iter().map(|&t| original.triangles[t as usize].map(position)).collect();
        let lengths = around.iter().map(|[a, b, c]| a.distance(*b) + b.distance(*c) + c.distance(*a));
        let spacing = lengths.sum::<f64>() / (3 * around.len()) as f64;
        let (tree, mut hint, mut largest) = (ClosestTriangle::new(&around), 0, 0.0f64);
        for corners in new {
            for point in samples(corners, spacing) {
                let closest = tree.near_enough(point, hint, ENOUGH * bound);
                hint = closest.hint;
                largest = largest.max(closest.squared);
                if closest.squared > bound * bound {
                    places.push(point);
                }
            }
            let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
            let closest = tree.of(centroid, hint);
            // Near a sharp edge the closest triangle may be on the other side of it.
            let faces = |triangle: &u32| faces_like(corners, around[*triangle as usize]);
            if !faces(&closest.triangle) && !tree.within(centroid, closest.squared.sqrt() + bound).iter().any(faces) {
                places.push(centroid);
            }
        }
        largest
    }
}

/// Returns whether a triangle has an area and is turned from another by less than 75 degrees.
///
/// That is the turn at which meshoptimizer refuses a collapse, but several collapses together may turn a triangle farther.
fn faces_like(corners: [DVec3; 3], original: [DVec3; 3]) -> bool {
    let [new, old] = [corners, original].map(|[a, b, c]| (b - a).cross(c - a));
    new.dot(old) > 0.25 * new.length() * old.length()
}

/// Returns points of a triangle, no more than about `spacing` apart, including midpoints of its sides and its centroid but not
/// its corners, which are on the original.
fn samples([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let parts = 2 * (longest / (2.0 * spacing)).ceil().clamp(1.0, MOST_PARTS / 2.0) as u32;
    let raster = (0..=parts).flat_map(move |i| (0..=parts - i).map(move |j| (i, j, parts - i - j)));
    let raster = raster.filter(move |&(i, j, k)| i.max(j).max(k) < parts);
    let on =
        move |(i, j, k): (u32, u32, u32)| (a * f64::from(i) + b * f64::from(j) + c * f64::from(k)) / f64::from(parts);
    raster.map(on).chain([(a + b + c) / 3.0])
}

/// The topology of the connected parts of a patch, which collapses must preserve.
struct Shapes {
    /// For each place the initial part that it belonged to.
    labels: Vec<u32>,
    /// For each part twice its vertices minus its triangles, which with the border fixed determines its Euler characteristic.
    characters: Vec<i64>,
    /// For each part the number of pieces that it fell into.
    pieces: Vec<usize>,
}

impl Shapes {
    fn of(&self, place: u32) -> (i64, usize) {
        let part = self.labels[place as usize] as usize;
        (self.characters[part], self.pieces[part])
    }
}

/// Computes the shapes of the parts of `start` after decimation to `triangles`.
fn shapes(triangles: &[[u32; 3]], places: usize, start: &[[u32; 3]]) -> Shapes {
    let labels = parts(start, places);
    let now = parts(triangles, places);
    let (mut characters, mut pieces, mut used) = (vec![0; places], vec![0; places], vec![false; places]);
    for indices in triangles {
        characters[labels[indices[0] as usize] as usize] -= 1;
        indices.iter().for_each(|&place| used[place as usize] = true);
    }
    for place in (0..places).filter(|&place| used[place]) {
        characters[labels[place] as usize] += 2;
        pieces[labels[place] as usize] += usize::from(now[place] as usize == place);
    }
    Shapes { labels, characters, pieces }
}

/// Returns for each place the lowest place that triangles connect it with.
fn parts(triangles: &[[u32; 3]], places: usize) -> Vec<u32> {
    fn root(parents: &mut [u32], mut place: u32) -> u32 {
        while parents[place as usize] != place {
            parents[place as usize] = parents[parents[place as usize] as usize];
            place = parents[place as usize];
        }
        place
    }
    let mut parents: Vec<u32> = (0..places as u32).collect();
    for &[a, b, c] in triangles {
        for (x, y) in [(a, b), (b, c)] {
            let (x, y) = (root(&mut parents, x), root(&mut parents, y));
            parents[x.max(y) as usize] = x.min(y);
        }
    }
    (0..places as u32).map(|place| root(&mut parents, place)).collect()
}
