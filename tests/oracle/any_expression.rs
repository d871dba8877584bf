//! Random expressions.

use ldi_ops::boolean::{BooleanOperation, Expression};

use crate::testing::random::Random;

pub const OPERATIONS: [BooleanOperation; 4] =
    [BooleanOperation::Intersection, BooleanOperation::Union, BooleanOperation::Difference, BooleanOperation::Xor];

/// Returns a random expression that uses every input once, and some twice.
pub fn random_expression(random: &mut Random, inputs: usize) -> Expression {
    let mut parts: Vec<Expression> = (0..inputs).map(Expression::input).collect();
    for _ in 0..random.below(3) {
        parts.push(Expression::input(random.below(inputs)));
    }
    while parts.len() > 1 {
        let operands = (0..2).map(|_| parts.swap_remove(random.below(parts.len())));
        let operands: Vec<Expression> = operands.collect();
        parts.push(Expression::combine(random.choose(&OPERATIONS), operands));
    }
    parts.remove(0)
}
