//! The error of a vertex by the planes that it stands for.

use glam::DVec3;

/// The weighted sum of squared distances from planes, as a polynomial.
#[derive(Clone, Copy, Default)]
pub(super) struct Quadric {
    /// The second-order coefficients: of xx, yy, zz, and of yz, zx, xy.
    squares: DVec3,
    products: DVec3,
    /// Half of the first-order coefficients.
    linear: DVec3,
    constant: f64,
    pub weight: f64,
}

impl Quadric {
    /// Returns the error from the plane through a point with a unit normal.
    pub fn plane(normal: DVec3, through: DVec3, weight: f64) -> Quadric {
        let offset = -normal.dot(through);
        let n = normal;
        Quadric {
            squares: n * n * weight,
            products: DVec3::new(n.y * n.z, n.z * n.x, n.x * n.y) * weight,
            linear: n * (offset * weight),
            constant: offset * offset * weight,
            weight,
        }
    }

    pub fn add(&mut self, other: &Quadric) {
        self.squares += other.squares;
        self.products += other.products;
        self.linear += other.linear;
        self.constant += other.constant;
        self.weight += other.weight;
    }

    pub fn at(&self, p: DVec3) -> f64 {
        let mixed = DVec3::new(p.y * p.z, p.z * p.x, p.x * p.y);
        self.squares.dot(p * p) + 2.0 * (self.products.dot(mixed) + self.linear.dot(p)) + self.constant
    }
}
