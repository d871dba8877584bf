//! The region in which an input can change the result of an expression, from boxes alone.

use super::BooleanOperation;
use super::expression::{Expression, Term};
use crate::grid::LatticeBox;

impl Expression {
    /// Returns for each input the box outside of which it cannot change the result, given the bounding box of each input. The
    /// box may be empty.
    ///
    /// An intersection is empty outside any of its operands and a difference is empty outside its first, so that no other
    /// operand matters there; an input that occurs several times matters wherever any of its occurrences does.
    ///
    /// # Panics
    /// If there are fewer boxes than inputs.
    pub fn regions(&self, bounds: &[LatticeBox]) -> Vec<LatticeBox> {
        let (terms, parents) = (self.terms(), self.parents());
        let own = self.bounds_of_terms(bounds);
        let mut within = own.clone();
        let mut regions = vec![LatticeBox::EMPTY; bounds.len()];
        // Operations come after their operands, so the reverse order knows each before them.
        for i in (0..terms.len()).rev() {
            if let Some(parent) = parents[i] {
                within[i] = within[parent.term].intersection(&own[i]);
                if !matches!(terms[parent.term], Term::Operation(BooleanOperation::Union | BooleanOperation::Xor, _)) {
                    within[i] = within[i].intersection(&own[parent.term]);
                }
            }
            if let Term::Input(index) = terms[i] {
                regions[index] = regions[index].hull(&within[i]);
            }
        }
        regions
    }

    /// Returns the box of each term.
    fn bounds_of_terms(&self, bounds: &[LatticeBox]) -> Vec<LatticeBox> {
        let mut own: Vec<LatticeBox> = Vec::with_capacity(self.terms().len());
        let mut open: Vec<LatticeBox> = Vec::new();
        for term in self.terms() {
            let bounds = match *term {
                Term::Input(index) => bounds[index],
                Term::Operation(operation, operands) => {
                    let operands = open.split_off(open.len() - operands).into_iter();
                    let combined = match operation {
                        BooleanOperation::Intersection => operands.reduce(|a, b| a.intersection(&b)),
                        BooleanOperation::Difference => operands.take(1).next(),
                        BooleanOperation::Union | BooleanOperation::Xor => operands.reduce(|a, b| a.hull(&b)),
                    };
                    combined.expect("an operation has operands")
                }
            };
            own.push(bounds);
            open.push(bounds);
        }
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along_x(min: i32, max: i32) -> LatticeBox {
        LatticeBox { min: [min, 0, 0], max: [max, 8, 8] }
    }

    fn regions(text: &str) -> Vec<(i32, i32)> {
        let bounds = [along_x(0, 8), along_x(4, 20), along_x(16, 30), along_x(6, 9)];
        let expression = Expression::parse(text, &["a", "b", "c", "d"]).unwrap();
        let regions = expression.regions(&bounds);
        regions.iter().map(|b| if b.is_empty() { (0, 0) } else { (b.min[0], b.max[0]) }).collect()
    }

    #[test]
    fn regions_hold_only_rays_that_affect_the_result() {
        assert_eq!(regions("a | b | c | d"), [(0, 8), (4, 20), (16, 30), (6, 9)]);
        assert_eq!(regions("(a - b) - (c | d)"), [(0, 8), (4, 8), (0, 0), (6, 8)]);
        assert_eq!(regions("(a ^ b) & (c | d)"), [(6, 8), (6, 20), (16, 20), (6, 9)]);
        assert_eq!(regions("(a & b) | (c & d)"), [(4, 8), (4, 8), (0, 0), (0, 0)]);
        assert_eq!(regions("(b & c) | (a & b) | (b & d)"), [(4, 8), (4, 20), (16, 20), (6, 9)]);
    }
}
