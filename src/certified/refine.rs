//! Refinement: which cells are halved, and the sum over those that are not.

use std::ops::Add;
use std::sync::atomic::{AtomicU64, Ordering};

use super::node::Node;
use super::state::{Scene, State};
use crate::cancel::checkpoint;
use crate::parallel::join;

/// The cells that are halved.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    /// The longest side of a cell from which it is not halved.
    pub finest: f64,
    /// The uncertainty of a cell, in cubic units, up to which it is not halved.
    pub negligible: f64,
}

/// Exact sums of bounds, in units of 2⁻⁸⁰: so they depend on no order, and not on threads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Totals {
    lower: i128,
    upper: i128,
}

/// 2⁸⁰; volumes are below 2⁴⁰.
const UNITS: f64 = (1u128 << 80) as f64;

impl Totals {
    pub fn of([lower, upper]: [f64; 2]) -> Totals {
        // Products with a power of two are exact, and the conversion drops the fraction.
        Totals { lower: (lower * UNITS) as i128, upper: (upper * UNITS) as i128 + i128::from(upper > 0.0) }
    }

    /// Returns the sums, rounded outwards.
    pub fn bounds(&self) -> [f64; 2] {
        let [lower, upper] = [self.lower, self.upper].map(|sum| sum as f64 / UNITS);
        [lower.next_down().max(0.0), if self.upper > 0 { upper.next_up() } else { 0.0 }]
    }
}

impl Add for Totals {
    type Output = Totals;

    fn add(self, other: Totals) -> Totals {
        Totals { lower: self.lower + other.lower, upper: self.upper + other.upper }
    }
}

/// Most cells of a pass.
pub(super) const BUDGET: u64 = 1 << 22;

/// Longest side of a cell whose halves are one task, where that of the whole is between 1 and 2.
pub(super) const TOGETHER: f64 = 1.0 / 64.0;

/// One pass over the tree of cells.
pub(super) struct Pass<'s> {
    scene: &'s Scene<'s>,
    rule: Rule,
    visited: AtomicU64,
}

impl<'s> Pass<'s> {
    pub fn new(scene: &'s Scene<'s>, rule: Rule) -> Pass<'s> {
        Pass { scene, rule, visited: AtomicU64::new(0) }
    }

    /// Returns the sums over all cells within a node; nothing if there are more than the budget.
    pub fn sum(&self, node: &Node) -> Option<Totals> {
        checkpoint();
        // Every cell of the pass is counted, in whatever order, unless the count ends it.
        if self.visited.fetch_add(1, Ordering::Relaxed) >= BUDGET {
            return None;
        }
        let state = State::of(self.scene, node);
        let mut bounds = None;
        if !state.is_exact() && node.cell.longest_side() > self.rule.finest {
            let is_negligible = self.rule.negligible > 0.0 && {
                let [lower, upper] = *bounds.insert(state.bounds());
                upper - lower <= self.rule.negligible
            };
            if !is_negligible && let Some(halves) = node.cell.halves() {
                drop(state);
                let [a, b] = halves;
                let half = |cell| self.sum(&node.part(&self.scene.shells, cell));
                let (a, b) = match node.cell.longest_side() > TOGETHER {
                    true => join(|| half(a), || half(b)),
                    false => (half(a), half(b)),
                };
                return Some(a? + b?);
            }
        }
        Some(Totals::of(bounds.unwrap_or_else(|| state.bounds())))
    }

    /// Returns the number of cells.
    pub fn visited(&self) -> u64 {
        self.visited.load(Ordering::Relaxed)
    }
}
