//! Whether a point is in the result of an expression, as it moves into inputs and out of them.

use super::expression::Expression;
use super::network::Network;
use super::plan::Plan;
use crate::ldi::Mode;

/// The mark of an input that the expression does not refer to.
const UNUSED: u32 = u32::MAX;

/// The inputs that a point is in, none at first, and whether it is in the result. A change takes as many steps as operations change.
#[derive(Clone)]
pub(crate) struct State {
    network: Network,
    /// The leaf of each input.
    leaves: Vec<u32>,
}

impl State {
    /// Returns the state of a point in none of a number of inputs.
    pub fn of(expression: &Expression, inputs: usize) -> State {
        let plan = Plan::new(expression, Mode::Exact);
        let mut leaves = vec![UNUSED; inputs];
        (0..).zip(plan.leaves()).for_each(|(leaf, of)| leaves[of.input] = leaf);
        State { network: plan.network, leaves }
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::tests::expressions;
    use super::*;

    proptest! {
        #[test]
        fn a_state_is_that_of_the_expression(expression in expressions(), flips in prop::collection::vec(0..8usize, 0..40)) {
            let mut inside = [false; 8];
            let mut state = State::of(&expression, 8);
            for input in flips {
                inside[input] ^= true;
                state.flip(input);
                prop_assert_eq!(state.holds(), expression.holds(|input| inside[input]));
            }
        }
    }
}
