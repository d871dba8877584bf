//! Conjugate gradients with a preconditioner that may change from step to step.

use super::cycle::Hierarchy;
use super::operator::{Fine, Operator};
use super::sums::{dot, each};
use crate::cancel::checkpoint;

/// The convergence data of a solution.
pub(super) struct Solved {
    pub iterations: usize,
    /// The norm of the residual over that of the right-hand side.
    pub residual: f64,
}

/// Solves A x = `right` from the initial `x`, until the residual is `tolerance` of the right-hand side or `limit` iterations
/// are done. Each direction is made conjugate to the one before (flexible conjugate gradients: Y. Notay, SIAM J. Sci. Comput.
/// 22 (2000) 1444–1460). `progress` is called with the completed share, assuming geometric convergence.
pub(super) fn solve(
    operator: &Fine,
    hierarchy: &mut Hierarchy,
    right: &[f64],
    x: &mut [f64],
    tolerance: f64,
    limit: usize,
    progress: &(dyn Fn(f64) + Sync),
) -> Solved {
    let count = operator.count();
    let mut residual = vec![0.0; count];
    each(&mut residual, |i, r| *r = right[i] - operator.row(i, x));
    let scale = dot(right, right).sqrt();
    let size = |residual: &[f64]| if scale > 0.0 { dot(residual, residual).sqrt() / scale } else { 0.0 };
    let begin = size(&residual);
    let mut now = begin;
    let (mut rounded, mut better) = (vec![0.0f32; count], vec![0.0f32; count]);
    let (mut direction, mut image) = (vec![0.0; count], vec![0.0; count]);
    let mut energy = 0.0;
    for iteration in 0..limit {
        checkpoint();
        if now <= tolerance {
            return Solved { iterations: iteration, residual: now };
        }
        progress(((begin / now).ln() / (begin / tolerance).ln()).clamp(0.0, 1.0));
        each(&mut rounded, |i, r| *r = residual[i] as f32);
        hierarchy.precondition(operator, &rounded, &mut better);
        let repeated = if iteration > 0 { dot(&better, &image) / energy } else { 0.0 };
        each(&mut direction, |i, p| *p = f64::from(better[i]) - repeated * *p);
        each(&mut image, |i, q| *q = operator.row(i, &direction));
        energy = dot(&direction, &image);
        if energy <= 0.0 {
            return Solved { iterations: iteration, residual: now };
        }
        let step = dot(&direction, &residual) / energy;
        each(x, |i, x| *x += step * direction[i]);
        each(&mut residual, |i, r| *r -= step * image[i]);
        now = size(&residual);
    }
    Solved { iterations: limit, residual: now }
}
