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
        side_of([t, 1.0 - (s + t), s]).map_or_else(|| Ok(self.normal.dot(w).powi(2)), Err)
    }

    /// Returns the square of the distance of a point.
    pub fn squared_distance(&self, point: DVec3) -> f64 {
        squared_distance(point, self.corners)
    }
}

/// The plane of a triangle, in which a point has a weight for each side: its distance from the side, inwards, as a share of the
/// triangle's height over it, times the square of twice the area. The first side is that from the first corner to the second.
pub(super) struct Base {
    corner: DVec3,
    along: [DVec3; 2],
    uu: f64,
    uv: f64,
    vv: f64,
}

impl Base {
    #[inline]
    pub fn new([a, b, c]: [DVec3; 3]) -> Base {
        let (u, v) = (b - a, c - a);
        Base { corner: a, along: [u, v], uu: u.dot(u), uv: u.dot(v), vv: v.dot(v) }
    }

    /// Returns how the weights of a point's foot change with the point.
    #[inline]
    pub fn rates(&self, change: DVec3) -> [f64; 3] {
        let [wu, wv] = self.along.map(|along| along.dot(change));
        let (s, t) = (self.vv * wu - self.uv * wv, self.uu * wv - self.uv * wu);
        [t, -s - t, s]
    }

    /// Returns the weights of a point's foot.
    #[inline]
    pub fn weights(&self, point: DVec3) -> [f64; 3] {
        let [first, second, third] = self.rates(point - self.corner);
        [first, self.uu * self.vv - self.uv * self.uv + second, third]
    }
}

/// Returns the number of the side of a triangle beyond which the foot of a point lies, as [`Face::height_or_side`] does, or `None`
/// where it lies in the triangle.
#[inline]
pub(super) fn side_beyond(point: DVec3, corners: [DVec3; 3]) -> Option<usize> {
    side_of(Base::new(corners).weights(point))
}

/// Returns the side beyond which a point with these weights of the sides lies the farthest, which is that of the least; `None` if no
/// weight is negative.
#[inline]
fn side_of([t, r, s]: [f64; 3]) -> Option<usize> {
    if s >= 0.0 && t >= 0.0 && r >= 0.0 {
        None
    } else if t <= s && t <= r {
        Some(0)
    } else {
        Some(if r <= s { 1 } else { 2 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn sides_without_a_face_are_those_of_the_face() {
        let mut random = Random::new(3);
        let mut sides = [0; 4];
        for _ in 0..1000 {
            let [a, b, c, point] = [(); 4].map(|()| DVec3::from_array([(); 3].map(|()| random.share())));
            let face = Face::new([a, b, c]);
            if !face.is_sliver() {
                let side = side_beyond(point, [a, b, c]);
                assert_eq!(side, face.height_or_side(point).err());
                sides[side.unwrap_or(3)] += 1;
            }
        }
        assert!(sides.iter().all(|&count| count > 50), "{sides:?}");
    }
}
