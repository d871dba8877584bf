//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::face::Face;
use crate::closest::ClosestTriangle;

/// Most parts into which a triangle's first side is divided by samples.
const MOST_PARTS: f64 = 16.0;

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
        Original { triangles, spacing, bound: bound - flat, flat }
    }

    /// Returns the largest distance of a triangle at its [`samples`] and its centroid. `None` if it is more than the bound, or if the
    /// original does not face as the triangle does at the centroid.
    pub fn distance(&self, face: &Face) -> Option<f64> {
        let triangles = self.triangles.as_ref()?;
        let [a, b, c] = face.corners;
        let centroid = (a + b + c) / 3.0;
        let faces_like = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a);
            normal.dot(face.normal) >= LIKE * normal.length()
        };
        let squared_bound = self.bound * self.bound;
        let mut largest = triangles.squared_below(centroid, squared_bound, faces_like)?;
        for point in samples(face.corners, self.spacing) {
            largest = largest.max(triangles.squared_below(point, squared_bound, |_| true)?);
        }
        Some(largest.sqrt() + self.flat)
    }
}

/// Returns points of a triangle: those along its first side, and those inside. Of the triangles around a new vertex, each begins with
/// it, so that the last side is the first of the next; the side between is old.
fn samples([a, b, c]: [DVec3; 3], spacing: f64) -> impl Iterator<Item = DVec3> {
    along([a, b], spacing).chain(inside([a, b, c], spacing))
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
