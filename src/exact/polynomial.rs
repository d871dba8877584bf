//! Integers, and polynomials of them in an infinitesimal.

use bnum::cast::As;
use bnum::types::I512;

/// What signs are made of.
pub(super) trait Number: Sized {
    /// Returns a number from its terms by ascending powers; of none it is zero.
    fn of(terms: &[i128]) -> Self;
    /// Adds a product of two numbers, or subtracts it.
    fn add_product(&mut self, a: &Self, b: &Self, is_negative: bool);
    /// Returns whether the number is positive; `None` if it is zero.
    fn sign(&self) -> Option<bool>;
    /// Returns the quotient by another number, which is not zero, to which that for positive infinitesimals tends.
    fn quotient(&self, divisor: &Self) -> f64;
}

/// Returns a sum of products, of which some are subtracted.
pub(super) fn sum_of_products<T: Number, const N: usize>(products: [(&T, &T, bool); N]) -> T {
    let mut sum = T::of(&[]);
    products.into_iter().for_each(|(a, b, is_negative)| sum.add_product(a, b, is_negative));
    sum
}

impl Number for I512 {
    fn of(terms: &[i128]) -> I512 {
        terms.first().map_or(I512::default(), |&term| term.as_())
    }

    fn add_product(&mut self, a: &I512, b: &I512, is_negative: bool) {
        // Where faces are parallel to axes, most factors are zero.
        if a.is_zero() || b.is_zero() {
            return;
        }
        let product = *a * *b;
        *self = if is_negative { *self - product } else { *self + product };
    }

    fn sign(&self) -> Option<bool> {
        (!self.is_zero()).then(|| self.is_positive())
    }

    fn quotient(&self, divisor: &I512) -> f64 {
        let (numerator, divisor): (f64, f64) = ((*self).as_(), (*divisor).as_());
        numerator / divisor
    }
}

/// A polynomial, by ascending powers. Most have one term, or none.
pub(super) struct Polynomial(Vec<I512>);

impl Polynomial {
    fn first(&self) -> Option<usize> {
        self.0.iter().position(|term| !term.is_zero())
    }
}

impl Number for Polynomial {
    fn of(terms: &[i128]) -> Polynomial {
        let count = terms.iter().rposition(|&term| term != 0).map_or(0, |last| last + 1);
        Polynomial(terms[..count].iter().map(|&term| term.as_()).collect())
    }

    fn add_product(&mut self, a: &Polynomial, b: &Polynomial, is_negative: bool) {
        if a.0.is_empty() || b.0.is_empty() {
            return;
        }
        let count = self.0.len().max(a.0.len() + b.0.len() - 1);
        self.0.resize(count, I512::default());
        for (i, of_a) in a.0.iter().enumerate() {
            for (j, of_b) in b.0.iter().enumerate() {
                self.0[i + j].add_product(of_a, of_b, is_negative);
            }
        }
    }

    fn sign(&self) -> Option<bool> {
        self.first().and_then(|first| self.0[first].sign())
    }

    fn quotient(&self, divisor: &Polynomial) -> f64 {
        let least = divisor.first().expect("the divisor is not zero");
        match self.first() {
            Some(first) if first < least => f64::INFINITY.copysign(self.0[first].quotient(&divisor.0[least])),
            Some(first) if first == least => self.0[first].quotient(&divisor.0[least]),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_power_decides() {
        let of = Polynomial::of;
        assert_eq!((of(&[]).sign(), of(&[0, 0]).sign()), (None, None));
        assert_eq!(of(&[0, -1, 5]).sign(), Some(false));
        // (1 + x) (1 − x) − 1 = −x².
        let product = sum_of_products([(&of(&[1, 1]), &of(&[1, -1]), false), (&of(&[1]), &of(&[1]), true)]);
        assert_eq!((product.sign(), product.first()), (Some(false), Some(2)));
        // (2x + x²) / (4x) tends to a half.
        assert_eq!(of(&[0, 2, 1]).quotient(&of(&[0, 4])), 0.5);
        assert_eq!((of(&[0, 0, 7]).quotient(&of(&[0, 4])), of(&[]).quotient(&of(&[1]))), (0.0, 0.0));
        assert_eq!(of(&[3, 2]).quotient(&of(&[0, -4])), f64::NEG_INFINITY);
        assert_eq!(of(&[0, -3]).quotient(&of(&[0, 0, -1])), f64::INFINITY);
    }
}
