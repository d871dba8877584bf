//! Follows a point as it moves into inputs and out of them: it tells whether the point is in the result of an expression.

use std::sync::Arc;

use super::expression::Expression;
use super::network::Network;
use super::plan::Plan;
use crate::ldi::Mode;

/// The mark of an input that the expression does not refer to.
const UNUSED: u32 = u32::MAX;

/// The inputs that a point is in, none at first, and whether it is in the result. To move it takes a step for each operation whose
/// value changes.
#[derive(Clone)]
pub(crate) struct State {
    network: Network,
    /// The leaf of each input.
    leaves: Arc<[u32]>,
}

impl State {
    /// Returns the state of a point in none of a number of inputs.
    pub fn of(expression: &Expression, inputs: usize) -> State {
        let plan = Plan::without_table(expression, Mode::Exact);
        let mut leaves = vec![UNUSED; inputs];
        // An exact plan has one leaf for each input.
        (0..).zip(plan.leaves()).for_each(|(leaf, of)| leaves[of.input] = leaf);
        State { network: plan.network, leaves: leaves.into() }
    }

    /// Moves the point into an input, or out of it.
    #[inline]
    pub fn flip(&mut self, input: usize) {
        match self.leaves[input] {
            UNUSED => {}
            leaf => _ = self.network.flip(leaf as usize),
        }
    }

    /// Returns whether the point is in the result.
    #[inline]
    pub fn holds(&self) -> bool {
        self.network.holds()
    }
}
