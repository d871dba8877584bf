//! Conjugate gradients with a preconditioner that may change from step to step.

use super::cycle::Hierarchy;
use super::operator::{Fine, Operator};
use super::sums::{each, each_summing, sum};
use crate::cancel::checkpoint;

/// Most iterations, far more than needed: 30 suffice in practice.
const ITERATIONS: usize = 1000;

/// Bounds of the factor by which a step is taken to lower the error of the flux, however much the one before did.
const RATES: [f64; 2] = [0.1, 0.9];

/// The convergence data of a solution.
pub(super) struct Solved {
    pub iterations: usize,
    /// The estimated error of the flux, over the flux.
    pub error: f64,
}

/// Solves A x = `right` from the initial `x`, until the estimated error of the flux, `whole` − `right` · A⁻¹ `right`, is `tolerance`
/// of it or a limit of iterations is reached. Each direction is made conjugate to the one before (flexible conjugate gradients:
/// Y. Notay, SIAM J. Sci. Comput. 22 (2000) 1444–1460). `progress` is called with the completed share, assuming geometric
/// convergence.
///
/// A step lowers the flux by its work, so that the error is the work of all further steps (Z. Strakoš, P. Tichý, On error estimation
/// in the conjugate gradient method, Electron. Trans. Numer. Anal. 13 (2002) 56–80); they are taken to fall at the larger rate of the
/// last two.
pub(super) fn solve(
    operator: &Fine,
    hierarchy: &mut Hierarchy,
    (right, whole): (&[f64], f64),
    x: &mut [f64],
    tolerance: f64,
    progress: &(dyn Fn(f64) + Sync),
) -> Solved {
    let count = operator.count();
    let mut residuals = vec![0.0; count];
    each(&mut residuals, |i, r| *r = right[i] - operator.row(i, x));
    let mut flux = whole - sum(count, |i| (right[i] + residuals[i]) * x[i]);
    let (mut rounded, mut better) = (vec![0.0f32; count], vec![0.0f32; count]);
    let (mut direction, mut image) = (vec![0.0; count], vec![0.0; count]);
    let (mut energy, mut last, mut last_rate) = (0.0, 0.0, RATES[1]);
    let (mut error, mut first_error, mut share) = (f64::INFINITY, None, 0.0f64);
    for iteration in 0..ITERATIONS {
        checkpoint();
        each(&mut rounded, |i, r| *r = residuals[i] as f32);
        hierarchy.precondition(operator, &rounded, &mut better);
        let repeated = if iteration > 0 { sum(count, |i| f64::from(better[i]) * image[i]) / energy } else { 0.0 };
        let [work] = each_summing(&mut direction, |i, p| {
            *p = f64::from(better[i]) - repeated * *p;
            [*p * residuals[i]]
        });
        [energy] = each_summing(&mut image, |i, q| {
            *q = operator.row(i, &direction);
            [*q * direction[i]]
        });
        if energy.is_nan() || energy <= 0.0 {
            // Nothing is left to do, or rounding leaves no direction to go.
            let error = if work == 0.0 { 0.0 } else { error };
            return Solved { iterations: iteration, error };
        }
        let step = work / energy;
        each(x, |i, x| *x += step * direction[i]);
        each(&mut residuals, |i, r| *r -= step * image[i]);
        let fall = step * work;
        flux -= fall;
        let rate = (fall / last).clamp(RATES[0], RATES[1]);
        let expected = rate.max(last_rate);
        error = fall / flux * expected / (1.0 - expected);
        (last, last_rate) = (fall, rate);
        if error <= tolerance {
            return Solved { iterations: iteration + 1, error };
        }
        let first_error = *first_error.get_or_insert(error);
        share = share.max((first_error / error).ln() / (first_error / tolerance).ln()).min(1.0);
        progress(share);
    }
    Solved { iterations: ITERATIONS, error }
}
