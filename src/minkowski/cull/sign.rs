//! Exact signs of dot products: in floating point first, in integers where rounding leaves the sign open.

use std::cmp::Ordering;

/// The relative error bound of a normal's dot product with a direction, times their largest components: three products of
/// numbers that were rounded once, rounded once more themselves and in two sums, add up to 15 units of 2⁻⁵³.
const ROUNDING: f64 = 1.0 / (1_u64 << 49) as f64;

/// The difference of two positions.
#[derive(Clone, Copy, Debug)]
pub struct Direction {
    /// Components below 2^30 in magnitude.
    pub exact: [i32; 3],
    /// The same components in `f64`, exactly.
    pub rounded: [f64; 3],
    /// The largest magnitude of a component.
    pub size: f64,
}

/// The cross product of two differences of positions.
#[derive(Clone, Copy, Debug)]
pub struct Normal {
    /// Components below 2^61 in magnitude.
    pub exact: [i64; 3],
    /// Each component rounded to nearest.
    pub rounded: [f64; 3],
    /// The error bound of a dot product with a direction of size 1.
    pub slack: f64,
}

impl Direction {
    /// Returns the direction from one position to another.
    pub fn between(from: [i32; 3], to: [i32; 3]) -> Direction {
        let exact = [0, 1, 2].map(|i| to[i] - from[i]);
        let rounded = exact.map(f64::from);
        Direction { exact, rounded, size: largest(rounded) }
    }

    /// Returns the cross product of two directions.
    pub fn cross(&self, other: &Direction) -> Normal {
        let product = |i: usize, j: usize| i64::from(self.exact[i]) * i64::from(other.exact[j]);
        Normal::new([(1, 2), (2, 0), (0, 1)].map(|(i, j)| product(i, j) - product(j, i)))
    }
}

impl Normal {
    fn new(exact: [i64; 3]) -> Normal {
        let rounded = exact.map(|n| n as f64);
        Normal { exact, rounded, slack: ROUNDING * largest(rounded) }
    }

    /// Returns the normal of the same plane from the other side.
    pub fn reversed(&self) -> Normal {
        Normal { exact: self.exact.map(|n| -n), rounded: self.rounded.map(|n| -n), slack: self.slack }
    }

    /// Returns whether the normal is zero: the two directions are parallel.
    pub fn is_zero(&self) -> bool {
        self.exact == [0; 3]
    }

    /// Returns the exact sign of the dot product with a direction.
    #[inline]
    pub fn sign(&self, along: &Direction) -> Ordering {
        let product: f64 = (0..3).map(|i| self.rounded[i] * along.rounded[i]).sum();
        let bound = self.slack * along.size;
        if product > bound {
            Ordering::Greater
        } else if product < -bound {
            Ordering::Less
        } else {
            self.exact_sign(along)
        }
    }

    #[cold]
    fn exact_sign(&self, along: &Direction) -> Ordering {
        let product: i128 = (0..3).map(|i| i128::from(self.exact[i]) * i128::from(along.exact[i])).sum();
        product.cmp(&0)
    }

    /// Returns whether two normals enclose less than a right angle.
    pub fn faces(&self, other: &Normal) -> bool {
        let product: i128 = (0..3).map(|i| i128::from(self.exact[i]) * i128::from(other.exact[i])).sum();
        product > 0
    }
}

fn largest(components: [f64; 3]) -> f64 {
    components.into_iter().fold(0.0, |most, component| component.abs().max(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a plane of the largest possible coordinates, and one lattice step off it on either side.
    #[test]
    fn signs_are_exact_where_rounding_is_too_coarse() {
        const MOST: i32 = (1 << 30) - 2;
        let u = Direction::between([0, 0, 0], [MOST, MOST - 2, 2]);
        let v = Direction::between([0, 2, 0], [MOST - 4, MOST, MOST]);
        let normal = u.cross(&v);
        let in_plane = [0, 1, 2].map(|i| u.exact[i] - v.exact[i]);
        for (step, expected) in [(-1, Ordering::Less), (0, Ordering::Equal), (1, Ordering::Greater)] {
            for axis in 0..3 {
                let mut to = in_plane;
                to[axis] += step * normal.exact[axis].signum() as i32;
                assert_eq!(normal.sign(&Direction::between([0; 3], to)), expected, "{step} along {axis}");
                assert_eq!(normal.reversed().sign(&Direction::between([0; 3], to)), expected.reverse());
            }
        }
    }
}
