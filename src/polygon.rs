//! Convex polygons, clipped by planes across the axes.

/// A convex polygon of at most `MOST` corners. A triangle has three and each plane adds one, or half as many again where rounding
/// has made the polygon non-convex: 6 after two planes, 13 after four.
#[derive(Clone, Copy)]
pub struct Polygon<const MOST: usize> {
    corners: [[f64; 3]; MOST],
    count: usize,
}

impl<const MOST: usize> Polygon<MOST> {
    /// Returns a triangle.
    pub fn of<C: Into<f64>>(triangle: [[C; 3]; 3]) -> Self {
        let mut corners = [[0.0; 3]; MOST];
        for (corner, position) in corners.iter_mut().zip(triangle) {
            *corner = position.map(C::into);
        }
        Polygon { corners, count: 3 }
    }

    /// Returns the corners in order.
    pub fn corners(&self) -> &[[f64; 3]] {
        &self.corners[..self.count]
    }

    /// Clips it to the part above a plane across an axis, or below for a `sign` of −1 (Sutherland and Hodgman 1974).
    pub fn above(&self, axis: usize, plane: f64, sign: f64) -> Self {
        let mut kept = Polygon { corners: [[0.0; 3]; MOST], count: 0 };
        let mut keep = |corner: [f64; 3]| {
            kept.corners[kept.count] = corner;
            kept.count += 1;
        };
        let height = |corner: &[f64; 3]| sign * (corner[axis] - plane);
        let corners = self.corners();
        for (at, corner) in corners.iter().enumerate() {
            let next = &corners[(at + 1) % corners.len()];
            let (here, there) = (height(corner), height(next));
            if here >= 0.0 {
                keep(*corner);
            }
            if (here >= 0.0) != (there >= 0.0) {
                let share = here / (here - there);
                keep(std::array::from_fn(|i| corner[i] + share * (next[i] - corner[i])));
            }
        }
        kept
    }
}
