//! The multigrid cycle used as preconditioner.

use super::aggregate::{Aggregates, Cells};
use super::operator::{Coarse, Operator};
use super::sums::{each, each_summing};

/// Upper bound of the eigenvalues of D⁻¹A, from its rows of conductances (Gershgorin).
const LARGEST: f32 = 2.0;

/// Lower end of the spectrum that smoothing must damp: with one of its three waves within a block, an error's eigenvalue is at
/// least 1/3 on a regular lattice.
const SMALLEST: f32 = 1.0 / 3.0;

/// A second step on a coarser level is only taken if the first left more than this share of the residual.
const ENOUGH: f64 = 0.25;

/// A coarser level: its aggregates, its matrix, and buffers for its vectors.
struct Level {
    from: Aggregates,
    operator: Coarse,
    smoothing: Smoothing,
    right: Vec<f32>,
    first: Vec<f32>,
    second: Vec<f32>,
    image: Vec<f32>,
    next_image: Vec<f32>,
}

/// All levels below the finest, the next coarser first.
pub(super) struct Hierarchy {
    levels: Vec<Level>,
    smoothing: Smoothing,
}

impl Hierarchy {
    /// Coarsens until each connected piece is one unknown. `operator` must have links to an end in each of its pieces.
    pub fn new(operator: &impl Operator, cells: Cells) -> Hierarchy {
        let mut levels: Vec<Level> = Vec::new();
        let mut cells = cells;
        while !cells.is_one() {
            let (level, coarser) = match levels.last() {
                None => Level::below(operator, &cells),
                Some(last) => Level::below(&last.operator, &cells),
            };
            levels.push(level);
            cells = coarser;
        }
        Hierarchy { levels, smoothing: Smoothing::new(operator.count()) }
    }

    /// Approximately solves A x = `right`.
    pub fn precondition(&mut self, operator: &impl Operator, right: &[f32], x: &mut [f32]) {
        cycle(operator, &mut self.smoothing, &mut self.levels, right, x);
    }
}

impl Level {
    fn below(operator: &impl Operator, cells: &Cells) -> (Level, Cells) {
        let (from, coarser) = Aggregates::new(operator, cells);
        let operator = from.coarse(operator);
        let count = operator.count();
        let room = || vec![0.0; count];
        let level = Level {
            from,
            operator,
            smoothing: Smoothing::new(count),
            right: room(),
            first: room(),
            second: room(),
            image: room(),
            next_image: room(),
        };
        (level, coarser)
    }

    /// Solves for `right`, whose square is `before`, by one or two steps of conjugate gradients, each preconditioned by a cycle;
    /// the result is in `first`.
    fn solve(&mut self, before: f64, below: &mut [Level]) {
        let Level { operator, smoothing, right, first, second, image, next_image, .. } = self;
        if below.is_empty() {
            each(first, |i, x| *x = operator.inverse(i) * right[i]);
            return;
        }
        cycle(operator, smoothing, below, right, first);
        let product = |a: f32, b: f32| f64::from(a) * f64::from(b);
        let [energy, work] = each_summing(image, |i, y| {
            *y = operator.row(i, first);
            [product(first[i], *y), product(first[i], right[i])]
        });
        if energy <= 0.0 {
            return;
        }
        let step = work / energy;
        let [left] = each_summing(right, |i, r| {
            *r -= step as f32 * image[i];
            [product(*r, *r)]
        });
        if left <= ENOUGH * ENOUGH * before {
            each(first, |_, x| *x *= step as f32);
            return;
        }
        cycle(operator, smoothing, below, right, second);
        let [mixed, next_energy, next_work] = each_summing(next_image, |i, y| {
            *y = operator.row(i, second);
            [product(second[i], image[i]), product(second[i], *y), product(second[i], right[i])]
        });
        let conjugate = next_energy - mixed * mixed / energy;
        if conjugate <= 0.0 {
            each(first, |_, x| *x *= step as f32);
            return;
        }
        let next_step = next_work / conjugate;
        let step = step - mixed * next_work / (energy * conjugate);
        each(first, |i, x| *x = step as f32 * *x + next_step as f32 * second[i]);
    }
}

/// Smooths, corrects by the next level, and smooths again.
fn cycle(operator: &impl Operator, smoothing: &mut Smoothing, below: &mut [Level], right: &[f32], x: &mut [f32]) {
    let Some((level, below)) = below.split_first_mut() else {
        each(x, |i, x| *x = operator.inverse(i) * right[i]);
        return;
    };
    smoothing.begin(operator, right, x);
    let Level { from, right: coarse, .. } = &mut *level;
    let residual = |member: &u32| right[*member as usize] - operator.row(*member as usize, x);
    let [square] = each_summing(coarse, |i, sum| {
        *sum = from.members(i).iter().map(residual).sum();
        [f64::from(*sum) * f64::from(*sum)]
    });
    level.solve(square, below);
    each(x, |i, x| *x += level.first[level.from.of[i] as usize]);
    smoothing.go_on(operator, right, x);
}

/// Two steps of Chebyshev iteration on D⁻¹A, the same polynomial before the correction and after it.
struct Smoothing {
    scratch: Vec<f32>,
}

/// The middle of the interval and half its width.
const MIDDLE: f32 = 0.5 * (LARGEST + SMALLEST);
const HALF: f32 = 0.5 * (LARGEST - SMALLEST);
/// The share of the first step that the second repeats, and the factor of the residual that it adds.
const RATIO: f32 = 1.0 / (2.0 * MIDDLE / HALF - HALF / MIDDLE);
const REPEATED: f32 = RATIO * HALF / MIDDLE;
const ADDED: f32 = 2.0 * RATIO / HALF;

impl Smoothing {
    fn new(count: usize) -> Smoothing {
        Smoothing { scratch: vec![0.0; count] }
    }

    /// Starts from 0.
    fn begin(&mut self, operator: &impl Operator, right: &[f32], x: &mut [f32]) {
        let first = &mut self.scratch;
        each(first, |i, x| *x = operator.inverse(i) * right[i] / MIDDLE);
        each(x, |i, x| {
            let residual = operator.inverse(i) * (right[i] - operator.row(i, first));
            *x = (1.0 + REPEATED) * first[i] + ADDED * residual;
        });
    }

    /// Starts from the value of `x`.
    fn go_on(&mut self, operator: &impl Operator, right: &[f32], x: &mut [f32]) {
        let first = &mut self.scratch;
        let residual = |i: usize, x: &[f32]| operator.inverse(i) * (right[i] - operator.row(i, x));
        each(first, |i, next| *next = x[i] + residual(i, x) / MIDDLE);
        each(x, |i, x| *x = first[i] + REPEATED * (first[i] - *x) + ADDED * residual(i, first));
    }
}
