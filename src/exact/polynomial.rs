//! Integers, and polynomials of them in an infinitesimal.

use std::array;

use bnum::cast::As;
use bnum::types::I512;

/// More than the degree of any polynomial: that of the height of a point common to three planes above a fourth is nine.
const TERMS: usize = 10;

/// What signs are made of.
pub(super) trait Number: Copy {
    fn of(terms: &[i128]) -> Self;
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;
    /// Returns whether the number is positive; `None` if it is zero.
    fn sign(self) -> Option<bool>;
    /// Returns the quotient by another number, which is not zero, to which that for positive infinitesimals tends.
    fn quotient(self, divisor: Self) -> f64;
}

impl Number for I512 {
    fn of(terms: &[i128]) -> I512 {
        terms[0].as_()
    }

    fn plus(self, other: I512) -> I512 {
        self + other
    }

    fn minus(self, other: I512) -> I512 {
        self - other
    }

    fn times(self, other: I512) -> I512 {
        self * other
    }

    fn sign(self) -> Option<bool> {
        (!self.is_zero()).then(|| self.is_positive())
    }

    fn quotient(self, divisor: I512) -> f64 {
        let (numerator, divisor): (f64, f64) = (self.as_(), divisor.as_());
        numerator / divisor
    }
}

/// A polynomial, by ascending powers.
#[derive(Clone, Copy)]
pub(super) struct Polynomial {
    terms: [I512; TERMS],
    /// Terms from here on are zero.
    count: usize,
}

impl Polynomial {
    fn first(&self) -> Option<usize> {
        self.terms[..self.count].iter().position(|term| !term.is_zero())
    }

    fn each(self, other: Polynomial, combine: impl Fn(I512, I512) -> I512) -> Polynomial {
        let count = self.count.max(other.count);
        Polynomial {
            terms: array::from_fn(|i| if i < count { combine(self.terms[i], other.terms[i]) } else { I512::default() }),
            count,
        }
    }
}

impl Number for Polynomial {
    fn of(terms: &[i128]) -> Polynomial {
        let count = terms.iter().rposition(|&term| term != 0).map_or(0, |last| last + 1);
        Polynomial { terms: array::from_fn(|i| terms.get(i).map_or(I512::default(), |&term| term.as_())), count }
    }

    fn plus(self, other: Polynomial) -> Polynomial {
        self.each(other, |a, b| a + b)
    }

    fn minus(self, other: Polynomial) -> Polynomial {
        self.each(other, |a, b| a - b)
    }

    fn times(self, other: Polynomial) -> Polynomial {
        let mut product =
            Polynomial { terms: [I512::default(); TERMS], count: (self.count + other.count).saturating_sub(1) };
        if self.count == 0 || other.count == 0 {
            product.count = 0;
            return product;
        }
        for (i, &a) in self.terms[..self.count].iter().enumerate().filter(|(_, a)| !a.is_zero()) {
            for (j, &b) in other.terms[..other.count].iter().enumerate() {
                product.terms[i + j] += a * b;
            }
        }
        product
    }

    fn sign(self) -> Option<bool> {
        self.first().map(|first| self.terms[first].is_positive())
    }

    fn quotient(self, divisor: Polynomial) -> f64 {
        let first = divisor.first().expect("the divisor is not zero");
        self.terms[first].quotient(divisor.terms[first])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_power_decides() {
        let of = Polynomial::of;
        assert_eq!(of(&[0, 0]).sign(), None);
        assert_eq!(of(&[0, -1, 5]).sign(), Some(false));
        // (1 + x) (1 − x) − 1 = −x².
        let product = of(&[1, 1]).times(of(&[1, -1])).minus(of(&[1]));
        assert_eq!((product.sign(), product.first()), (Some(false), Some(2)));
        // (2x + x²) / (4x) tends to a half.
        assert_eq!(of(&[0, 2, 1]).quotient(of(&[0, 4])), 0.5);
    }
}
