//! The numbers that distances are computed in: `f64`, and pairs of `f64` with about 106 bits.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Sub};

use glam::DVec3;

/// A number type for the geometry of two triangles.
pub(super) trait Real:
    Copy + Debug + PartialOrd + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    const ZERO: Self;

    /// Returns a − b.
    fn difference(a: f64, b: f64) -> Self;

    fn to_f64(self) -> f64;
}

impl Real for f64 {
    const ZERO: f64 = 0.0;

    fn difference(a: f64, b: f64) -> f64 {
        a - b
    }

    fn to_f64(self) -> f64 {
        self
    }
}

/// The unevaluated sum of two `f64`, the second at most half a unit in the last place of the first.
///
/// The operations and their error bounds, a few 2^-104, are those of Joldes, Muller and Popescu, *Tight and rigorous
/// error bounds for basic building blocks of double-word arithmetic* (2017).
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Double {
    high: f64,
    low: f64,
}

/// Returns the exact sum.
fn two_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    let of_b = high - a;
    Double { high, low: (a - (high - of_b)) + (b - of_b) }
}

/// Returns the exact sum, where |a| ≥ |b|.
fn fast_two_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    Double { high, low: b - (high - a) }
}

/// Returns the exact product, unless it underflows.
fn two_product(a: f64, b: f64) -> Double {
    let high = a * b;
    Double { high, low: a.mul_add(b, -high) }
}

impl Real for Double {
    const ZERO: Double = Double { high: 0.0, low: 0.0 };

    fn difference(a: f64, b: f64) -> Double {
        two_sum(a, -b)
    }

    fn to_f64(self) -> f64 {
        self.high
    }
}

impl Add for Double {
    type Output = Double;

    fn add(self, other: Double) -> Double {
        let (high, low) = (two_sum(self.high, other.high), two_sum(self.low, other.low));
        let sum = fast_two_sum(high.high, high.low + low.high);
        fast_two_sum(sum.high, sum.low + low.low)
    }
}

impl Sub for Double {
    type Output = Double;

    fn sub(self, other: Double) -> Double {
        self + Double { high: -other.high, low: -other.low }
    }
}

impl Mul for Double {
    type Output = Double;

    fn mul(self, other: Double) -> Double {
        let product = two_product(self.high, other.high);
        let cross = self.high.mul_add(other.low, self.low * other.high);
        fast_two_sum(product.high, product.low + cross)
    }
}

impl Div for Double {
    type Output = Double;

    fn div(self, other: Double) -> Double {
        let first = self.high / other.high;
        let rest = self - other * Double { high: first, low: 0.0 };
        fast_two_sum(first, rest.high / other.high)
    }
}

/// A vector of [`Real`] coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector<R>(pub [R; 3]);

impl<R: Real> Vector<R> {
    /// Returns the vector from one point to another.
    pub fn between(from: DVec3, to: DVec3) -> Vector<R> {
        Vector([0, 1, 2].map(|i| R::difference(to[i], from[i])))
    }

    pub fn dot(self, Vector(b): Vector<R>) -> R {
        let Vector(a) = self;
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    pub fn cross(self, Vector(b): Vector<R>) -> Vector<R> {
        let Vector(a) = self;
        Vector([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    }

    /// Returns `self` + `factor` · `other`.
    pub fn plus(self, factor: R, Vector(other): Vector<R>) -> Vector<R> {
        let Vector(own) = self;
        Vector([0, 1, 2].map(|i| own[i] + factor * other[i]))
    }

    pub fn squared(self) -> R {
        self.dot(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::random::Random;

    #[test]
    fn double_arithmetic_keeps_integers_of_a_hundred_bits() {
        let exact = |number: Double| number.high as i128 + number.low as i128;
        let mut random = Random::new(7);
        for _ in 0..10_000 {
            let [a, b] = [0; 2].map(|_| (random.bits() >> 12) as i64 - (1 << 51));
            let (x, y) = (Double::difference(a as f64, 0.0), Double::difference(b as f64, 0.0));
            let (a, b) = (i128::from(a), i128::from(b));
            assert_eq!(exact(x * y), a * b);
            assert_eq!(exact(x * y - x), a * b - a);
            if b != 0 {
                assert_eq!(exact(x * y / y), a);
            }
        }
    }
}
