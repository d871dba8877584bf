//! Set expressions over inputs that are identified by their index.

use super::BooleanOperation;

/// An expression of Boolean operations on inputs.
///
/// It is kept in postfix notation, operands before their operation, so that nothing needs recursion: an expression may nest as
/// deep as memory allows.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Expression {
    terms: Vec<Term>,
}

/// A part of an expression in postfix notation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Term {
    /// The input with this index.
    Input(usize),
    /// An operation on this number of preceding operands, two or more, from left to right.
    Operation(BooleanOperation, usize),
}

impl Expression {
    /// Returns the expression of one input.
    pub fn input(index: usize) -> Expression {
        Expression { terms: vec![Term::Input(index)] }
    }

    /// Combines expressions by an operation, from left to right: A − B − C. A single operand is returned as it is.
    ///
    /// # Panics
    /// If there is no operand.
    pub fn combine(operation: BooleanOperation, operands: impl IntoIterator<Item = Expression>) -> Expression {
        let mut operands = operands.into_iter();
        let Expression { mut terms } = operands.next().expect("an operation has operands");
        let mut count = 1;
        for operand in operands {
            terms.extend(operand.terms);
            count += 1;
        }
        if count > 1 {
            terms.push(Term::Operation(operation, count));
        }
        Expression { terms }
    }

    /// Combines the inputs 0, 1, … by an operation, from left to right.
    ///
    /// # Panics
    /// If there is no input.
    pub fn of_inputs(operation: BooleanOperation, inputs: usize) -> Expression {
        Expression::combine(operation, (0..inputs).map(Expression::input))
    }

    /// Returns one expression for a tree of expressions. `inner` returns the expression of a node with the nodes that are its
    /// inputs, or nothing for a leaf, whose index `input` returns. Trees may nest as deep as memory allows.
    ///
    /// # Panics
    /// If a node has fewer inputs than its expression names.
    pub fn of_tree<'a, Node>(
        root: &'a Node,
        inner: impl Fn(&'a Node) -> Option<(&'a Expression, &'a [Node])>,
        mut input: impl FnMut(&'a Node) -> usize,
    ) -> Expression {
        let whole = Expression::input(0);
        let mut terms = Vec::new();
        let mut open = vec![(whole.terms.iter(), std::slice::from_ref(root))];
        while let Some((rest, inputs)) = open.last_mut() {
            match rest.next() {
                Some(&Term::Input(index)) => match inner(&inputs[index]) {
                    Some((expression, inputs)) => open.push((expression.terms.iter(), inputs)),
                    None => terms.push(Term::Input(input(&inputs[index]))),
                },
                Some(operation) => terms.push(*operation),
                None => drop(open.pop()),
            }
        }
        Expression { terms }
    }

    pub(super) fn from_terms(terms: Vec<Term>) -> Expression {
        Expression { terms }
    }

    pub(super) fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Returns one more than the greatest index of an input.
    pub fn inputs(&self) -> usize {
        let used = self.terms.iter().map(|term| match *term {
            Term::Input(index) => index + 1,
            Term::Operation(..) => 0,
        });
        used.max().expect("an expression has an input")
    }

    /// Returns the expression with other numbers of its inputs, several of which may become one.
    pub(crate) fn renumbered(&self, number: impl Fn(usize) -> usize) -> Expression {
        let renumbered = |term: &Term| match *term {
            Term::Input(index) => Term::Input(number(index)),
            operation => operation,
        };
        Expression { terms: self.terms.iter().map(renumbered).collect() }
    }

    /// Returns the two inputs if the expression is the intersection of two different inputs and nothing else.
    pub fn intersection_of_two(&self) -> Option<[usize; 2]> {
        match self.terms[..] {
            [Term::Input(a), Term::Input(b), Term::Operation(BooleanOperation::Intersection, _)] if a != b => {
                Some([a, b])
            }
            _ => None,
        }
    }

    /// Returns whether a point is in the result, given whether it is in each input.
    pub fn holds(&self, in_input: impl Fn(usize) -> bool) -> bool {
        // One operation on inputs, as most expressions are, needs no memory for values.
        if let [Term::Input(first), others @ .., Term::Operation(operation, operands)] = &self.terms[..]
            && *operands == others.len() + 1
        {
            let holds = |term: &Term| matches!(*term, Term::Input(input) if in_input(input));
            return others.iter().fold(in_input(*first), |left, right| operation.holds(left, holds(right)));
        }
        self.fold(in_input, |operation, operands| {
            let (first, others) = operands.split_first().expect("an operation has operands");
            others.iter().fold(*first, |left, &right| operation.holds(left, right))
        })
    }

    /// Returns whether a point is in the result, given whether it is in some of the inputs, and `None` for the others; `None` if
    /// these do not decide (Kleene's logic).
    pub fn decided(&self, in_input: impl Fn(usize) -> Option<bool>) -> Option<bool> {
        self.fold(in_input, |operation, operands| {
            let (first, others) = operands.split_first().expect("an operation has operands");
            others.iter().fold(*first, |left, &right| match (left, right) {
                (Some(left), Some(right)) => Some(operation.holds(left, right)),
                // One that is known decides if both values of the other give the same.
                (Some(left), None) => same([false, true].map(|right| operation.holds(left, right))),
                (None, Some(right)) => same([false, true].map(|left| operation.holds(left, right))),
                (None, None) => None,
            })
        })
    }

    /// Evaluates the expression: `input` returns the value of an input, `operation` combines the values of its operands.
    pub(crate) fn fold<T>(&self, input: impl Fn(usize) -> T, operation: impl Fn(BooleanOperation, &[T]) -> T) -> T {
        let mut values = Vec::new();
        for term in &self.terms {
            let value = match *term {
                Term::Input(index) => input(index),
                Term::Operation(kind, operands) => {
                    let first = values.len() - operands;
                    let value = operation(kind, &values[first..]);
                    values.truncate(first);
                    value
                }
            };
            values.push(value);
        }
        values.pop().expect("an expression has a value")
    }

    /// Returns for each term the operation that it is an operand of, by its index, and whether it is the first operand; `None`
    /// for the last term, which is the whole expression.
    pub(super) fn parents(&self) -> Vec<Option<Parent>> {
        let mut parents = vec![None; self.terms.len()];
        let mut open = Vec::new();
        for (i, term) in self.terms.iter().enumerate() {
            if let Term::Operation(_, operands) = *term {
                for (place, operand) in open.drain(open.len() - operands..).enumerate() {
                    parents[operand] = Some(Parent { term: i, is_first: place == 0 });
                }
            }
            open.push(i);
        }
        parents
    }
}

/// Returns the value of two, if it is the same.
fn same([a, b]: [bool; 2]) -> Option<bool> {
    (a == b).then_some(a)
}

/// The place of a term in an expression.
#[derive(Clone, Copy)]
pub(super) struct Parent {
    /// The index of the operation.
    pub term: usize,
    /// True if the term is the first operand, from which a difference subtracts the others.
    pub is_first: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_evaluate_from_left_to_right() {
        let of = |operation, inside: &[bool]| Expression::of_inputs(operation, inside.len()).holds(|i| inside[i]);
        assert!(of(BooleanOperation::Difference, &[true, false, false]));
        assert!(!of(BooleanOperation::Difference, &[true, false, true]));
        assert!(of(BooleanOperation::Xor, &[true, true, true]));
        assert!(of(BooleanOperation::Union, &[false, false, true]));
        assert!(!of(BooleanOperation::Intersection, &[true, true, false]));
        assert_eq!(Expression::of_inputs(BooleanOperation::Union, 1), Expression::input(0));
    }

    #[test]
    fn an_expression_is_decided_only_if_no_unknown_input_can_change_it() {
        let expression = Expression::parse("a & (b | c) - d ^ a", &["a", "b", "c", "d"]).unwrap();
        for code in 0..3u32.pow(4) {
            let input = |i: usize| [None, Some(false), Some(true)][(code / 3u32.pow(i as u32) % 3) as usize];
            let fits = |bits: &u32| (0..4).all(|i| input(i).is_none_or(|known| known == (bits >> i & 1 == 1)));
            let values: Vec<bool> = (0..16).filter(fits).map(|bits| expression.holds(|i| bits >> i & 1 == 1)).collect();
            if let Some(decided) = expression.decided(input) {
                assert!(values.iter().all(|&value| value == decided), "{code}");
            }
            if values.len() == 1 {
                assert_eq!(expression.decided(input), Some(values[0]), "{code}");
            }
        }
    }

    #[test]
    fn the_intersection_of_two_is_recognised() {
        assert_eq!(Expression::of_inputs(BooleanOperation::Intersection, 2).intersection_of_two(), Some([0, 1]));
        assert_eq!(Expression::of_inputs(BooleanOperation::Intersection, 3).intersection_of_two(), None);
        assert_eq!(Expression::of_inputs(BooleanOperation::Union, 2).intersection_of_two(), None);
        let twice = Expression::combine(BooleanOperation::Intersection, [Expression::input(1), Expression::input(1)]);
        assert_eq!((twice.intersection_of_two(), twice.inputs()), (None, 2));
    }
}
