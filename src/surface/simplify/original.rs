//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::face::Face;
use crate::closest::{Closest, ClosestTriangle};

/// The share of the bound that is left for what is farther away between the points that are measured.
const BETWEEN: f64 = 0.1;

/// Most parts into which a side of the original is divided by samples.
const MOST_PARTS: f64 = 16.0;

/// Most points at which a triangle's first side is measured.
const MOST_POINTS: f64 = 63.0;

/// Most parts into which its longest side is divided by the raster of samples inside.
const INNER_PARTS: f64 = 4.0;

/// Least cosine of the angle, 75°, between a new triangle and one of the original near it. One collapse turns a triangle by less,
/// but several together may turn it farther.
const LIKE: f64 = 0.25;

/// Triangles of the original, or within a small distance of it, from which distances are measured.
pub(super) struct Original {
    triangles: Option<ClosestTriangle>,
    /// The distance between samples.
    spacing: f64,
    /// The largest distance from these triangles, and the distance of these from the original.
    bound: f64,
    flat: f64,
}

impl Original {
    /// Creates it from triangles whose distance from the original is at most `flat`, itself less than the bound.
    pub fn new(corners: &[[DVec3; 3]], spacing: f64, [bound, flat]: [f64; 2]) -> Original {
        let triangles = (!corners.is_empty()).then(|| ClosestTriangle::new(corners));
        Original { triangles, spacing, bound: (1.0 - BETWEEN) * bound - flat, flat }
    }

    /// Returns the largest distance of a triangle along its first side, at points inside, and at its centroid. `None` if it is more
    /// than the bound, or if the original does not face as the triangle does at the centroid.
    ///
    /// Of the triangles around a new vertex, each begins with it, so that the last side is the first of the next; the side between
    /// is old.
    pub fn distance(&self, face: &Face) -> Option<f64> {
        let triangles = self.triangles.as_ref()?;
        let [a, b, c] = face.corners;
        let faces_like = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a);
            normal.dot(face.normal) >= LIKE * normal.length()
        };
        let centroid = triangles.below((a + b + c) / 3.0, self.bound * self.bound, faces_like)?;
        let mut largest = centroid.squared.max(self.squared_along(triangles, [a, b])?);
        for point in inside(face.corners, self.spacing) {
            largest = largest.max(self.squared_at(triangles, point)?.squared);
        }
        Some(largest.sqrt() + self.flat)
    }

    /// Returns the square of the largest distance along a side, or `None` if it is more than the bound.
    ///
    /// It is measured at points. Over one triangle the distance is linear, and where one point is over another triangle than the
    /// next, it has its largest value where their planes are equally far, over the edge between them.
    fn squared_along(&self, triangles: &ClosestTriangle, [a, b]: [DVec3; 2]) -> Option<f64> {
        // An odd number, so that the middle is one of them.
        let count = (a.distance(b) / self.spacing).ceil().clamp(1.0, MOST_POINTS) as u32 | 1;
        let (mut largest, mut before) = (0.0f64, None);
        for i in 0..count {
            let point = a.lerp(b, (f64::from(i) + 0.5) / f64::from(count));
            let closest = self.squared_at(triangles, point)?;
            largest = largest.max(closest.squared);
            let Some(plane) = Plane::of(triangles.corners(closest.hint)) else { continue };
            if let Some((last, start)) = before.replace((plane, point)) {
                if let Some((edge, height)) = between([&last, &plane], [start, point]) {
                    largest = match height <= self.bound {
                        true => largest.max(height * height),
                        // There may be more between than one edge.
                        false => largest.max(self.squared_at(triangles, edge)?.squared),
                    };
                }
            }
        }
        Some(largest)
    }

    /// Returns the triangle closest to a point, or `None` if it is farther than the bound.
    fn squared_at(&self, triangles: &ClosestTriangle, point: DVec3) -> Option<Closest> {
        triangles.below(point, self.bound * self.bound, |_| true)
    }
}

/// The plane of a triangle.
#[derive(Clone, Copy)]
struct Plane {
    normal: DVec3,
    through: DVec3,
}

impl Plane {
    /// Returns the plane of a triangle that has an area.
    fn of([a, b, c]: [DVec3; 3]) -> Option<Plane> {
        Some(Plane { normal: (b - a).cross(c - a).try_normalize()?, through: a })
    }

    fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.through)
    }
}

/// Returns the point between two others that is at the same height over two planes, each over its own, and this height.
fn between(planes: [&Plane; 2], [start, end]: [DVec3; 2]) -> Option<(DVec3, f64)> {
    let difference = |point: DVec3| planes[0].height(point) - planes[1].height(point);
    let (at_start, at_end) = (difference(start), difference(end));
    let share = at_start / (at_start - at_end);
    let point = start.lerp(end, share);
    (0.0 < share && share < 1.0).then(|| (point, planes[0].height(point).abs()))
}

/// Returns points between the ends of a side, about `spacing` apart, but at most 15.
pub(super) fn along([a, b]: [DVec3; 2], spacing: f64) -> impl Iterator<Item = DVec3> {
    let count = parts(a.distance(b), spacing, MOST_PARTS);
    (1..count).map(move |i| a.lerp(b, f64::from(i) / f64::from(count)))
}

/// Returns at most 3 points inside a triangle.
pub(super) fn inside([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    let count = parts(a.distance(b).max(b.distance(c)).max(c.distance(a)), spacing, INNER_PARTS);
    let weights = (1..count).flat_map(move |i| (1..count - i).map(move |j| [i, j, count - i - j]));
    weights.map(move |weights| {
        let [u, v, w] = weights.map(|weight| f64::from(weight) / f64::from(count));
        a * u + b * v + c * w
    })
}

/// Returns the even number of parts into which a length is divided.
fn parts(length: f64, spacing: f64, most: f64) -> u32 {
    2 * (length / (2.0 * spacing)).ceil().clamp(1.0, most / 2.0) as u32
}
