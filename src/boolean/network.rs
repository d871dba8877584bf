//! The state of an expression while a ray is swept: counters of true operands, from the leaves to the root.

use std::sync::Arc;

/// The index that denotes no counter.
const NONE: u32 = u32::MAX;

/// The condition under which a counter is true.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rule {
    /// At least this number of operands is true: 1 for a union, all for an intersection.
    AtLeast(u32),
    /// An odd number of operands is true.
    Odd,
    /// One of the two truth values of a symmetric difference of estimates; the other one is the counter whose index differs in
    /// the last bit. Where both counts are equal, no operand is between its estimates and the parity decides; where one count
    /// is larger, there is such an operand, so that the result may be either, and the counter with the larger count is true.
    OddOrUnknown,
}

/// The counter of an operation, or of one of its two truth values where both estimates are carried.
#[derive(Clone, Copy, Debug)]
struct Counter {
    rule: Rule,
    /// The number of true operands.
    count: u32,
    /// The counter of which this one is an operand.
    parent: u32,
    /// True if the parent counts the complement.
    inverted: bool,
}

/// An occurrence of a leaf in the expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Link {
    /// The counter that counts it.
    pub counter: u32,
    /// True if it counts where the leaf is false.
    pub inverted: bool,
}

/// A tree of counters. An event costs the path from its leaf to the first counter that does not toggle with it.
#[derive(Clone, Debug)]
pub(super) struct Network {
    counters: Vec<Counter>,
    /// The first link of each leaf in `links`; one entry more than leaves.
    starts: Arc<[u32]>,
    links: Arc<[Link]>,
    inside: Vec<bool>,
    holds: bool,
}

impl Network {
    /// Builds a network from the rule of each counter with the link to its parent (`None` for the root and for counters that
    /// are not needed) and from the links of each leaf. The root is counter 0, and parents come before their operands. All
    /// leaves are initially false.
    pub fn new(counters: &[(Rule, Option<Link>)], leaves: &[Vec<Link>]) -> Network {
        let counters: Vec<Counter> = counters
            .iter()
            .map(|&(rule, parent)| {
                let Link { counter, inverted } = parent.unwrap_or(Link { counter: NONE, inverted: false });
                Counter { rule, count: 0, parent: counter, inverted }
            })
            .collect();
        let mut starts = vec![0];
        starts.extend(leaves.iter().scan(0, |end, links| {
            *end += links.len() as u32;
            Some(*end)
        }));
        let (starts, links) = (starts.into(), leaves.concat().into());
        let mut network = Network { counters, starts, links, inside: vec![false; leaves.len()], holds: false };
        network.set(|_| false);
        debug_assert!(!network.holds, "where no input is, there is no result");
        network
    }

    /// Sets the truth value of every leaf; returns whether the root is true.
    pub fn set(&mut self, inside: impl Fn(usize) -> bool) -> bool {
        self.counters.iter_mut().for_each(|counter| counter.count = 0);
        for leaf in 0..self.inside.len() {
            self.inside[leaf] = inside(leaf);
            for i in self.starts[leaf]..self.starts[leaf + 1] {
                let Link { counter, inverted } = self.links[i as usize];
                self.counters[counter as usize].count += u32::from(self.inside[leaf] ^ inverted);
            }
        }
        // Parents come before their operands.
        for i in (0..self.counters.len()).rev() {
            let Counter { rule, count, parent, inverted } = self.counters[i];
            let holds = match rule {
                Rule::AtLeast(least) => count >= least,
                Rule::Odd => count % 2 == 1,
                Rule::OddOrUnknown => odd_or_unknown(count, self.counters[i ^ 1].count).0,
            };
            match parent {
                NONE if i == 0 => self.holds = holds,
                NONE => {}
                parent => self.counters[parent as usize].count += u32::from(holds ^ inverted),
            }
        }
        self.holds
    }

    /// Returns whether the root is true.
    #[inline]
    pub fn holds(&self) -> bool {
        self.holds
    }

    /// Returns whether a leaf is true.
    #[inline]
    pub fn is_inside(&self, leaf: usize) -> bool {
        self.inside[leaf]
    }

    /// Toggles a leaf; returns whether the root is true.
    #[inline]
    pub fn flip(&mut self, leaf: usize) -> bool {
        let inside = !self.inside[leaf];
        self.inside[leaf] = inside;
        for i in self.starts[leaf]..self.starts[leaf + 1] {
            let Link { counter, inverted } = self.links[i as usize];
            self.count(counter, inside ^ inverted);
        }
        self.holds
    }

    /// Records that one operand of a counter has become true or false, and updates its ancestors.
    #[inline]
    fn count(&mut self, counter: u32, becomes: bool) {
        let (mut at, mut becomes) = (counter as usize, becomes);
        loop {
            let before = self.counters[at].count;
            let now = if becomes { before + 1 } else { before - 1 };
            self.counters[at].count = now;
            match self.counters[at].rule {
                Rule::AtLeast(least) => {
                    if (before >= least) == (now >= least) {
                        return;
                    }
                }
                Rule::Odd => becomes = now % 2 == 1,
                Rule::OddOrUnknown => {
                    let other = self.counters[at ^ 1].count;
                    // One truth value toggles, or the other, or neither.
                    let (was, is) = (odd_or_unknown(before, other), odd_or_unknown(now, other));
                    match (was.0 != is.0, was.1 != is.1) {
                        (true, _) => becomes = is.0,
                        (_, true) => {
                            at ^= 1;
                            becomes = is.1;
                        }
                        (false, false) => return,
                    }
                }
            }
            let Counter { parent, inverted, .. } = self.counters[at];
            if parent == NONE {
                if at == 0 {
                    self.holds = becomes;
                }
                return;
            }
            (at, becomes) = (parent as usize, becomes ^ inverted);
        }
    }
}

/// Returns both truth values of a symmetric difference from the two counts of operands.
fn odd_or_unknown(one: u32, other: u32) -> (bool, bool) {
    match one.cmp(&other) {
        std::cmp::Ordering::Equal => (one % 2 == 1, one % 2 == 1),
        std::cmp::Ordering::Less => (false, true),
        std::cmp::Ordering::Greater => (true, false),
    }
}
