//! A part of the surface that is decimated by itself: its border stays, so that parts need not know of each other.

use glam::DVec3;
use meshopt::{SimplifyOptions, VertexDataAdapter, simplify_with_locks, typed_to_bytes};

use super::closest::{ClosestTriangle, longest};
use crate::mesh::{Aabb, TriangleMesh};
use crate::surface::gates::Faults;

/// How often a patch is decimated anew, with more vertices locked, before it is left as it was.
const ATTEMPTS: usize = 8;

/// The error that meshoptimizer is allowed, in bounds. It is the root of a weighted mean of squared distances from planes,
/// so that the largest distance comes out as more.
const TARGET: f64 = 0.5;

/// Sides of a triangle are divided into so many parts at most, where its distance is sampled.
const MOST_PARTS: f64 = 16.0;

/// A part of the surface and the part of the original that it answers for.
pub(super) struct Patch {
    /// Vertices that its triangles use, as indices of original positions, sorted.
    vertices: Vec<u32>,
    /// Its triangles as they were before, by places in `vertices`.
    start: Vec<[u32; 3]>,
    /// Which of `vertices` must stay.
    locked: Vec<bool>,
    /// What it answers for.
    original: Share,
    result: Decimated,
}

/// The part of the original that a patch answers for.
#[derive(Default)]
pub(super) struct Share {
    /// Original vertices that must be near the patch.
    pub points: Vec<u32>,
    /// Original triangles whose centroids must be near the patch.
    pub centroids: Vec<u32>,
    /// Original triangles that the patch must be near of.
    pub triangles: Vec<u32>,
}

/// What became of a patch.
#[derive(Default)]
struct Decimated {
    /// Triangles by places in the vertices of the patch.
    triangles: Vec<[u32; 3]>,
    /// For the points of the share, then for its centroids: the triangle that is closest.
    homes: Vec<u32>,
    /// The largest distance that was measured, either way.
    distance: f64,
}

impl Patch {
    /// A patch of triangles of original vertices, of which those for which `is_border` holds must stay.
    pub(super) fn new(triangles: &[[u32; 3]], is_border: impl Fn(u32) -> bool, original: Share) -> Patch {
        let mut vertices = triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |vertex: u32| vertices.binary_search(&vertex).expect("all vertices are listed") as u32;
        let start = triangles.iter().map(|indices| indices.map(place)).collect();
        let locked = vertices.iter().map(|&vertex| is_border(vertex)).collect();
        Patch { vertices, start, locked, original, result: Decimated::default() }
    }

    /// Its triangles as they are now, by original vertices.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        self.result.triangles.iter().map(|indices| indices.map(|place| self.vertices[place as usize]))
    }

    /// The largest distance that was measured, in either direction.
    pub(super) fn distance(&self) -> f64 {
        self.result.distance
    }

    /// How many of its vertices must stay.
    pub(super) fn locked(&self) -> usize {
        self.locked.iter().filter(|locked| **locked).count()
    }

    /// Original vertices, each with the triangle of the patch that is closest.
    pub(super) fn homes_of_points(&self) -> impl Iterator<Item = (u32, u32)> {
        self.original.points.iter().copied().zip(self.result.homes.iter().copied())
    }

    /// Original triangles, each with the triangle of the patch that is closest to its centroid.
    pub(super) fn homes_of_centroids(&self) -> impl Iterator<Item = (u32, u32)> {
        let homes = &self.result.homes[self.original.points.len()..];
        self.original.centroids.iter().copied().zip(homes.iter().copied())
    }

    /// The box around it.
    pub(super) fn bounds(&self, original: &TriangleMesh) -> Aabb {
        let empty = Aabb { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        self.vertices.iter().fold(empty, |bounds, &vertex| {
            let position = original.positions[vertex as usize];
            bounds.union(Aabb { min: position, max: position })
        })
    }

    /// Decimates it as far as the distances from the original allow; in the worst case it stays as it was.
    pub(super) fn decimate(&mut self, original: &TriangleMesh, bound: f64) {
        for rings in 0..ATTEMPTS {
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
                Err(places) => {
                    let near = self.near(original, &places, 0.0);
                    self.lock(near.into_iter().flat_map(|(_, vertices)| vertices), rings);
                }
            }
        }
        self.leave(original);
    }

    /// Leaves the patch as it was, for good.
    pub(super) fn leave(&mut self, original: &TriangleMesh) {
        self.locked.fill(true);
        let corners: Vec<_> = self.start.iter().map(|&indices| self.corners(original, indices)).collect();
        let (homes, squared) = self.homes(original, &ClosestTriangle::new(&corners));
        let distance = squared.into_iter().fold(0.0, f64::max).sqrt();
        self.result = Decimated { triangles: self.start.clone(), homes, distance };
    }

    /// Locks these original vertices, where the patch has them, and all within so many edges of them.
    pub(super) fn lock_around(&mut self, vertices: &[u32], rings: usize) {
        let places = vertices.iter().filter_map(|vertex| self.vertices.binary_search(vertex).ok());
        self.lock(places.map(|place| place as u32).collect::<Vec<_>>(), rings);
    }

    /// Whether one of its vertices is this.
    pub(super) fn has(&self, vertex: u32) -> bool {
        self.vertices.binary_search(&vertex).is_ok()
    }

    /// Locks places and all within so many edges of them.
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

    /// For each point its distance from the patch as it was, and the vertices of the triangles there that are closest to
    /// it or no more than `slack` farther than the closest.
    pub(super) fn near(&self, original: &TriangleMesh, points: &[DVec3], slack: f64) -> Vec<(f64, Vec<u32>)> {
        let corners: Vec<_> = self.start.iter().map(|&indices| self.corners(original, indices)).collect();
        let tree = ClosestTriangle::new(&corners);
        let near = points.iter().map(|&point| {
            let closest = tree.of(point, 0);
            let mut near = vec![closest.triangle];
            if slack > 0.0 {
                near.extend(tree.within(point, closest.squared.sqrt() + slack));
            }
            let vertices = near.into_iter().flat_map(|triangle| self.start[triangle as usize]);
            (closest.squared.sqrt(), vertices.collect())
        });
        near.collect()
    }

    fn corners(&self, original: &TriangleMesh, indices: [u32; 3]) -> [DVec3; 3] {
        indices.map(|place| original.positions[self.vertices[place as usize] as usize])
    }

    /// What meshoptimizer makes of the patch.
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
        let error = (TARGET * bound * scale) as f32;
        // No `Prune`, which removes components; no `Regularize`, which gives up triangles for their shape.
        let options = SimplifyOptions::LockBorder | SimplifyOptions::ErrorAbsolute;
        let indices = simplify_with_locks(self.start.as_flattened(), &vertices, &self.locked, 0, error, options, None);
        indices.as_chunks().0.to_vec()
    }

    /// Vertices at which decimation broke the surface, or that belong to a part whose shape it changed.
    fn spoiled(&self, triangles: &[[u32; 3]]) -> Vec<u32> {
        let faults = |triangles: &[[u32; 3]]| {
            let positions = vec![DVec3::ZERO; self.vertices.len()];
            Faults::of(&TriangleMesh { positions, triangles: triangles.to_vec() })
        };
        let now = faults(triangles);
        // An edge with one use is one of the border. Fans of the border may meet in a vertex there.
        let edges = now.edges.iter().filter(|edge| edge.forward + edge.backward != 1).flat_map(|edge| edge.ends);
        let doubles = now.duplicates.iter().flat_map(|pair| triangles[pair[1] as usize]);
        let mut broken: Vec<u32> = edges.chain(doubles).collect();
        if !now.vertices.is_empty() {
            let before = faults(&self.start).vertices;
            broken.extend(now.vertices.iter().filter(|fault| !before.contains(fault)).map(|&(vertex, _)| vertex));
        }
        // A part may be large, so that where it is broken is the better answer, if there is one.
        if broken.is_empty() {
            let [before, after] = [&self.start, triangles].map(|t| shapes(t, self.vertices.len(), &self.start));
            broken.extend((0..self.vertices.len() as u32).filter(|&place| before.of(place) != after.of(place)));
        }
        broken
    }

    /// The triangle that is closest to each point and centroid of the share, and the square of its distance.
    fn homes(&self, original: &TriangleMesh, tree: &ClosestTriangle) -> (Vec<u32>, Vec<f64>) {
        let mut hint = 0;
        let points = self.share_points(original);
        let closest = points.map(|point| {
            let closest = tree.of(point, hint);
            hint = closest.hint;
            (closest.triangle, closest.squared)
        });
        closest.unzip()
    }

    /// Points and then centroids of the share.
    fn share_points(&self, original: &TriangleMesh) -> impl Iterator<Item = DVec3> {
        let points = self.original.points.iter().map(|&vertex| original.positions[vertex as usize]);
        let centroids = self.original.centroids.iter().map(|&triangle| {
            let [a, b, c] = original.triangles[triangle as usize].map(|vertex| original.positions[vertex as usize]);
            (a + b + c) / 3.0
        });
        points.chain(centroids)
    }

    /// The triangles with their distances from the original, or the places where these are beyond the bound.
    fn measured(&self, original: &TriangleMesh, triangles: Vec<[u32; 3]>, bound: f64) -> Result<Decimated, Vec<DVec3>> {
        let corners: Vec<_> = triangles.iter().map(|&indices| self.corners(original, indices)).collect();
        let (homes, mut squared) = self.homes(original, &ClosestTriangle::new(&corners));
        let is_far = |squared: f64| squared > bound * bound;
        let far = self.share_points(original).zip(&squared).filter(|(_, squared)| is_far(**squared));
        let mut places: Vec<DVec3> = far.map(|(point, _)| point).collect();

        let mut before = self.start.clone();
        before.sort_unstable();
        let new: Vec<_> =
            triangles.iter().zip(corners).filter(|(indices, _)| before.binary_search(indices).is_err()).collect();
        let around = |&triangle: &u32| original.triangles[triangle as usize].map(|v| original.positions[v as usize]);
        let around: Vec<[DVec3; 3]> = self.original.triangles.iter().map(around).collect();
        if !new.is_empty() && !around.is_empty() {
            let lengths = around.iter().map(|[a, b, c]| a.distance(*b) + b.distance(*c) + c.distance(*a));
            let spacing = lengths.sum::<f64>() / (3 * around.len()) as f64;
            let (tree, mut hint) = (ClosestTriangle::new(&around), 0);
            for (_, corners) in new {
                for point in samples(corners, spacing) {
                    let closest = tree.of(point, hint);
                    hint = closest.hint;
                    squared.push(closest.squared);
                    if is_far(closest.squared) {
                        places.push(point);
                    }
                }
            }
        }
        if !places.is_empty() {
            return Err(places);
        }
        Ok(Decimated { triangles, homes, distance: squared.into_iter().fold(0.0, f64::max).sqrt() })
    }
}

/// Points of a triangle, about `spacing` apart, midpoints of its sides among them at least: all but its corners, which
/// are on the original. The centroid makes up for a triangle that has no other inner point.
fn samples([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let parts = (longest / spacing).ceil().clamp(2.0, MOST_PARTS) as u32;
    let raster = (0..=parts).flat_map(move |i| (0..=parts - i).map(move |j| (i, j, parts - i - j)));
    let raster = raster.filter(move |&(i, j, k)| i.max(j).max(k) < parts);
    let on =
        move |(i, j, k): (u32, u32, u32)| (a * f64::from(i) + b * f64::from(j) + c * f64::from(k)) / f64::from(parts);
    raster.map(on).chain((parts == 2).then(|| (a + b + c) / 3.0))
}

/// What collapses must not change of the connected parts of a patch.
struct Shapes {
    /// For each place the part it belonged to in the beginning.
    labels: Vec<u32>,
    /// For each part twice its vertices less its triangles, which with the border fixed is its Euler characteristic.
    characters: Vec<i64>,
    /// For each part into how many it fell.
    pieces: Vec<usize>,
}

impl Shapes {
    fn of(&self, place: u32) -> (i64, usize) {
        let part = self.labels[place as usize] as usize;
        (self.characters[part], self.pieces[part])
    }
}

/// The shapes of what the parts of `start` have become in `triangles`.
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

/// For each place the lowest place that triangles connect it with.
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
