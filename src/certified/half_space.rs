//! The share of a box in a half space.

use glam::DVec3;

/// Components of the normal, times the sides of the box, below this share of their sum are bounded, as the formula divides by
/// them.
const SMALL: f64 = 1.0 / 4096.0;

/// Error bound of the formula, before the division.
const ROUNDING: f64 = 512.0 * f64::EPSILON;

/// Returns bounds of the share of the box from −`half` to `half` in which normal·δ ≤ depth.
///
/// With m the products of the components of the normal and the sides, and τ the depth beyond the first corner, the share is
/// Σ (−1)^|σ| max(0, τ − σ·m)^k / (k! Π m) over all σ in {0, 1}^k.
pub(super) fn share(normal: DVec3, depth: f64, half: DVec3) -> [f64; 2] {
    let lengths = (2.0 * normal.abs() * half).to_array();
    let sum: f64 = lengths.iter().sum();
    let from_corner = depth + 0.5 * sum;
    let (mut large, mut small) = ([0.0; 3], 0.0);
    let mut count = 0;
    for length in lengths {
        if length >= SMALL * sum && length > 0.0 {
            large[count] = length;
            count += 1;
        } else {
            small += length;
        }
    }
    let slack = ROUNDING * (sum + depth.abs());
    let [low, high] = [from_corner - small - slack, from_corner + slack].map(|depth| of(&large[..count], depth));
    [low[0], high[1]]
}

/// Returns bounds for a box with these products, none of them small.
fn of(lengths: &[f64], depth: f64) -> [f64; 2] {
    let sum: f64 = lengths.iter().sum();
    // Also for a normal of zero.
    if depth < 0.0 {
        return [0.0, 0.0];
    }
    if depth >= sum * (1.0 + ROUNDING) {
        return [1.0, 1.0];
    }
    let power = lengths.len() as i32;
    let volume = lengths.iter().product::<f64>() * [1.0, 1.0, 2.0, 6.0][lengths.len()];
    let term = |corner: u32| {
        let before: f64 =
            lengths.iter().enumerate().filter(|(i, _)| corner >> i & 1 == 1).map(|(_, length)| length).sum();
        let sign = if corner.count_ones().is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * (depth - before).max(0.0).powi(power)
    };
    let share = (0..1u32 << lengths.len()).map(term).sum::<f64>() / volume;
    let error = ROUNDING * sum.powi(power) / volume;
    [(share - error).clamp(0.0, 1.0), (share + error).clamp(0.0, 1.0)]
}
