//! The part of the original that new triangles must be near.

use glam::DVec3;

use super::face::Face;
use crate::closest::{Closest, ClosestTriangle};

/// The share of the bound that is left for what is farther away between the points inside a triangle.
const BETWEEN: f64 = 0.1;

/// Most parts into which a side of the original is divided by samples.
const MOST_PARTS: f64 = 16.0;

/// Most parts into which a triangle's first side is divided at first, and how often each of them may be halved.
const MOST_STEPS: f64 = 64.0;
const HALVINGS: u32 = 6;

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

    /// Returns a bound of the distance of a triangle along its first side, and from points inside. `None` if it is more than the
    /// bound, or if the original does not face as the triangle does at the centroid.
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
        let inner = ((1.0 - BETWEEN) * self.bound).powi(2);
        let centroid = triangles.below((a + b + c) / 3.0, inner, faces_like)?;
        let mut largest = centroid.squared.max(self.squared_along(triangles, [a, b])?);
        for point in inside(face.corners, self.spacing) {
            largest = largest.max(triangles.below(point, inner, |_| true)?.squared);
        }
        Some(largest.sqrt() + self.flat)
    }

    /// Returns a bound of the square of the distance along a side, or `None` if it is more than the bound.
    ///
    /// It holds at every point: the distance from one triangle, which is convex, is largest at an end of a part of the side, so
    /// that two ends within the bound of the same triangle are enough for all between.
    fn squared_along(&self, triangles: &ClosestTriangle, [a, b]: [DVec3; 2]) -> Option<f64> {
        let count = (a.distance(b) / self.spacing).ceil().clamp(1.0, MOST_STEPS);
        let mut start = self.close(triangles, a)?;
        let mut largest = start.squared;
        for i in 1..=count as u32 {
            let point = a.lerp(b, f64::from(i) / count);
            let mut end = Close { point, squared: triangles.squared_from(point, start.hint), ..start };
            if end.squared > self.bound * self.bound {
                end = self.close(triangles, point)?;
                largest = largest.max(self.squared_between(triangles, [start, end], HALVINGS)?);
            }
            largest = largest.max(end.squared);
            start = end;
        }
        Some(largest)
    }

    /// Returns a bound of the square of the distance between two points that are within the bound of different triangles.
    fn squared_between(&self, triangles: &ClosestTriangle, [start, end]: [Close; 2], halvings: u32) -> Option<f64> {
        let of_first = triangles.squared_from(end.point, start.hint);
        let of_last = triangles.squared_from(start.point, end.hint);
        let least = of_first.min(of_last);
        if least <= self.bound * self.bound {
            return Some(least);
        }
        let halvings = halvings.checked_sub(1)?;
        let middle = self.close(triangles, 0.5 * (start.point + end.point))?;
        let halves = [[start, middle], [middle, end]].map(|half| self.squared_between(triangles, half, halvings));
        Some(halves[0]?.max(halves[1]?))
    }

    /// Returns a point with the triangle closest to it, or `None` if it is farther than the bound.
    fn close(&self, triangles: &ClosestTriangle, point: DVec3) -> Option<Close> {
        let Closest { squared, hint } = triangles.below(point, self.bound * self.bound, |_| true)?;
        Some(Close { point, squared, hint })
    }
}

/// A point of a side, and a triangle of the original that is within the bound of it.
#[derive(Clone, Copy)]
struct Close {
    point: DVec3,
    /// The square of the distance.
    squared: f64,
    /// The triangle's number for [`ClosestTriangle::squared_from`].
    hint: u32,
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
