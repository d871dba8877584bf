//! A triangle from which many distances are measured.

use glam::DVec3;

use crate::closest::squared_distance;

/// Least ratio of twice a triangle's area to the square of its longest side.
const SLIVER: f64 = 1e-3;

/// A triangle with its normal and gradients, for distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub corners: [DVec3; 3],
    /// The unit normal; not finite without an area.
    pub normal: DVec3,
    /// The gradients of two barycentric coordinates.
    gradients: [DVec3; 2],
}

impl Face {
    pub fn new(corners: [DVec3; 3]) -> Face {
        let [a, b, c] = corners;
        let (u, v) = (b - a, c - a);
        let cross = u.cross(v);
        let squared = cross.length_squared();
        let gradients = [v.cross(cross) / squared, cross.cross(u) / squared];
        Face { corners, normal: cross / squared.sqrt(), gradients }
    }

    /// Returns whether it is too thin for its direction to be certain.
    pub fn is_sliver(&self) -> bool {
        let [a, b, c] = self.corners;
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        let area = (b - a).cross(c - a).length();
        area <= SLIVER * longest
    }

    /// Returns the square of the distance of a point whose foot on the plane lies in the triangle.
    #[inline]
    pub fn squared_height(&self, point: DVec3) -> Option<f64> {
        self.height_or_side(point).ok()
    }

    /// Returns the square of the distance of a point whose foot on the plane lies in the triangle, or else the number of the side
    /// beyond which it lies the farthest, as a share of the triangle's height over that side: 0 from the first corner to the second.
    #[inline]
    pub fn height_or_side(&self, point: DVec3) -> Result<f64, usize> {
        let w = point - self.corners[0];
        let [s, t] = self.gradients.map(|gradient| gradient.dot(w));
        let r = 1.0 - (s + t);
        if s >= 0.0 && t >= 0.0 && r >= 0.0 {
            return Ok(self.normal.dot(w).powi(2));
        }
        // The weights of the corners, each opposite its side.
        Err(if t <= s && t <= r {
            0
        } else if r <= s {
            1
        } else {
            2
        })
    }

    /// Returns the square of the distance of a point.
    pub fn squared_distance(&self, point: DVec3) -> f64 {
        squared_distance(point, self.corners)
    }
}
