//! Winding numbers of the solids at a point. Where there are many solids, a point is in few of them: the numbers of these are listed.

use super::Rule;
use crate::boolean::State;
use crate::ldi::FillRule;

/// The winding numbers at a point that are not 0, by ascending solids.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Listed(Vec<(u32, i32)>);

impl Listed {
    /// Replaces the numbers.
    pub fn set(&mut self, numbers: &[(u32, i32)]) {
        self.0.clear();
        self.0.extend_from_slice(numbers);
    }

    /// Changes the number of a solid.
    pub fn add(&mut self, solid: usize, change: i32) {
        match self.0.binary_search_by_key(&(solid as u32), |&(solid, _)| solid) {
            Ok(place) if self.0[place].1 + change == 0 => _ = self.0.remove(place),
            Ok(place) => self.0[place].1 += change,
            Err(_) if change == 0 => {}
            Err(place) => self.0.insert(place, (solid as u32, change)),
        }
    }

    /// Returns the solids with their numbers.
    pub fn list(&self) -> &[(u32, i32)] {
        &self.0
    }
}

/// The winding numbers of all solids at a point that moves, and whether it is in the result.
#[derive(Clone)]
pub(super) struct Numbers {
    fill: FillRule,
    state: State,
    numbers: Vec<i32>,
    /// All solids whose numbers are not 0, and others; some several times.
    changed: Vec<u32>,
}

impl Numbers {
    /// Returns the numbers of a point in none of the solids.
    pub fn of(rule: &Rule, solids: usize) -> Numbers {
        let state = State::of(rule.expression, solids);
        Numbers { fill: rule.fill, state, numbers: vec![0; solids], changed: Vec::new() }
    }

    /// Moves to a point with these numbers.
    pub fn set(&mut self, numbers: &[(u32, i32)]) {
        while let Some(solid) = self.changed.pop() {
            self.add(solid as usize, -self.numbers[solid as usize]);
        }
        numbers.iter().for_each(|&(solid, number)| self.add(solid as usize, number));
    }

    /// Changes the number of a solid.
    #[inline]
    pub fn add(&mut self, solid: usize, change: i32) {
        let (before, after) = (self.numbers[solid], self.numbers[solid] + change);
        if before == 0 && after != 0 {
            self.changed.push(solid as u32);
        }
        self.numbers[solid] = after;
        if self.fill.is_inside(before) != self.fill.is_inside(after) {
            self.state.flip(solid);
        }
    }

    /// Returns whether the point is in the result.
    #[inline]
    pub fn holds(&self) -> bool {
        self.state.holds()
    }

    /// Returns whether the point is in the result, once a number has changed.
    #[inline]
    pub fn holds_with(&mut self, solid: usize, change: i32) -> bool {
        self.add(solid, change);
        let holds = self.holds();
        self.add(solid, -change);
        holds
    }

    /// Returns whether it depends on one solid if the point is in the result, given the numbers of the others.
    pub fn depends_on(&mut self, solid: usize) -> bool {
        let before = self.holds();
        self.state.flip(solid);
        let after = self.holds();
        self.state.flip(solid);
        before != after
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boolean::{BooleanOperation, Expression};

    #[test]
    fn numbers_are_listed_in_order_and_zeros_are_not() {
        let mut listed = Listed::default();
        [(5, 1), (2, -1), (9, 0), (5, 1), (2, 1), (7, 3)]
            .into_iter()
            .for_each(|(solid, change)| listed.add(solid, change));
        assert_eq!(listed.list(), [(5, 2), (7, 3)]);
        listed.set(&[(1, 1)]);
        assert_eq!(listed.list(), [(1, 1)]);
    }

    #[test]
    fn a_point_is_in_the_result_by_its_numbers_and_the_rule() {
        let expression = Expression::of_inputs(BooleanOperation::Difference, 3);
        for (fill, holds) in [(FillRule::NonZero, false), (FillRule::EvenOdd, true)] {
            let mut numbers = Numbers::of(&Rule { expression: &expression, fill }, 3);
            assert!(!numbers.holds() && numbers.depends_on(0) && !numbers.depends_on(1));
            numbers.set(&[(0, 1), (1, 2)]);
            assert_eq!(numbers.holds(), holds);
            assert!(numbers.holds_with(1, -2) && !numbers.holds_with(1, -1));
            assert_eq!(numbers.holds(), holds);
            numbers.add(2, -1);
            assert!(!numbers.holds());
            numbers.set(&[(0, -1)]);
            assert!(numbers.holds() && numbers.depends_on(1));
            // From 0 and back, so that it is listed twice, and then to another number.
            assert!(!numbers.holds_with(2, 3) && !numbers.holds_with(2, -1));
            numbers.add(2, 2);
            assert_eq!((numbers.holds(), numbers.depends_on(0)), (holds, holds));
            numbers.set(&[]);
            assert!(!numbers.holds());
        }
    }
}
