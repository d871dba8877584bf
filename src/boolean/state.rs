//! Follows a point as it moves into inputs and out of them: it tells whether the point is in the result of an expression.

use std::sync::Arc;

use super::expression::Expression;
use super::network::Network;
use super::plan::{Plan, table};
use crate::ldi::Mode;

/// The mark of an input that the expression does not refer to.
const UNUSED: u32 = u32::MAX;

/// Most inputs of an expression whose results are in one word.
const WORD_INPUTS: usize = 6;

/// The inputs that a point is in, none at first, and whether it is in the result. To move it takes a step for each operation whose
/// value changes, or one step if the inputs are few.
#[derive(Clone)]
pub(crate) struct State {
    truth: Truth,
    /// The leaf of each input.
    leaves: Arc<[u32]>,
}

/// The result at a point, from a table or by counters.
#[derive(Clone)]
enum Truth {
    /// Bit `s` of the word tells it where the leaves inside are the bits of `s`.
    Word {
        results: u64,
        inside: u32,
    },
    Counted(Network),
}

impl State {
    /// Returns the state of a point in none of a number of inputs.
    pub fn of(expression: &Expression, inputs: usize) -> State {
        let mut plan = Plan::without_table(expression, Mode::Exact);
        let mut leaves = vec![UNUSED; inputs];
        // An exact plan has one leaf for each input.
        (0..).zip(plan.leaves()).for_each(|(leaf, of)| leaves[of.input] = leaf);
        let count = plan.leaves.len();
        let truth = match count <= WORD_INPUTS {
            true => Truth::Word { results: table(&mut plan.network, count)[0], inside: 0 },
            false => Truth::Counted(plan.network),
        };
        State { truth, leaves: leaves.into() }
    }

    /// Moves the point into an input, or out of it.
    #[inline]
    pub fn flip(&mut self, input: usize) {
        match (self.leaves[input], &mut self.truth) {
            (UNUSED, _) => {}
            (leaf, Truth::Word { inside, .. }) => *inside ^= 1 << leaf,
            (leaf, Truth::Counted(network)) => _ = network.flip(leaf as usize),
        }
    }

    /// Returns whether the point is in the result.
    #[inline]
    pub fn holds(&self) -> bool {
        match &self.truth {
            Truth::Word { results, inside } => results >> inside & 1 != 0,
            Truth::Counted(network) => network.holds(),
        }
    }
}
