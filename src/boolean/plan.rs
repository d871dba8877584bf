//! Compilation of an expression for the sweep.

use super::BooleanOperation;
use super::expression::{Expression, Term};
use super::network::{Link, Network, Rule};
use crate::diagram::{Builder, Diagram};
use crate::ldi::Mode;

/// An image that a plan needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Leaf {
    /// The index of the input.
    pub input: usize,
    /// The mode of the image: that of the result, or the opposite one, as for a subtracted input.
    pub mode: Mode,
}

/// The direction in which the result can change with a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Polarity {
    /// With the leaf.
    Along,
    /// Against the leaf.
    Against,
    /// In either direction.
    Both,
}

/// An expression compiled for the sweep.
#[derive(Clone, Debug)]
pub struct Plan {
    pub(super) leaves: Vec<Leaf>,
    pub(super) polarities: Vec<Polarity>,
    pub(super) network: Network,
    /// Bit `s` is the result where the leaves inside are the bits of `s`; `None` where that takes too many words.
    pub(super) table: Option<Vec<u64>>,
    gates: Gates,
}

/// Most leaves whose states are tabulated; the table then stays in the first-level cache.
const TABLE_LEAVES: usize = 12;

/// Most steps to fill a table: states times the steps of each.
const TABLE_STEPS: usize = 1 << 24;

impl Plan {
    /// Compiles an expression for a result of a mode. Takes time and memory linear in the expression.
    ///
    /// An estimate is valid where the under-estimate of each input lies within its over-estimate.
    pub fn new(expression: &Expression, mode: Mode) -> Plan {
        let plan = Plan::without_table(expression, mode);
        let leaves = plan.leaves.len();
        let steps = expression.terms().len() << leaves.min(TABLE_LEAVES);
        let is_small = leaves <= TABLE_LEAVES && steps <= TABLE_STEPS;
        let table = is_small.then(|| table(&mut plan.network.clone(), leaves));
        Plan { table, ..plan }
    }

    /// Compiles an expression without the table of its results.
    pub(super) fn without_table(expression: &Expression, mode: Mode) -> Plan {
        let gates = Gates::of(expression, mode);
        let Counters { rules, parents, places } = gates.counters();
        let mut leaves: Vec<(usize, Role)> = places.iter().map(|place| place.leaf).collect();
        leaves.sort_unstable();
        leaves.dedup();
        let mut links = vec![Vec::new(); leaves.len()];
        let mut polarities: Vec<Option<Polarity>> = vec![None; leaves.len()];
        for place in places {
            let leaf = leaves.binary_search(&place.leaf).expect("the leaves are those of the places");
            links[leaf].push(place.link);
            let polarity = &mut polarities[leaf];
            *polarity =
                Some(polarity.map_or(place.polarity, |one| if one == place.polarity { one } else { Polarity::Both }));
        }
        let counters: Vec<_> = rules.into_iter().zip(parents).collect();
        let network = Network::new(&counters, &links);
        let polarities = polarities.into_iter().map(|polarity| polarity.expect("every leaf has a place")).collect();
        let of_role = |(input, role)| match role {
            Role::Same => Leaf { input, mode },
            Role::Opposite => Leaf { input, mode: mode.opposite() },
        };
        Plan { leaves: leaves.into_iter().map(of_role).collect(), polarities, network, table: None, gates }
    }

    /// Returns the images that are needed, by input and then that of the mode of the result first.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// Returns the result by the leaves that a point is in, for estimates of which the smaller lies within the larger. `None` where
    /// there are more leaves than [`Diagram::MOST_LEAVES`], or where the diagram would be large.
    pub fn diagram(&self) -> Option<Diagram> {
        if self.leaves.len() > Diagram::MOST_LEAVES {
            return None;
        }
        let number = |input: usize, role: Role| {
            let place = |leaf: &Leaf| (leaf.input, leaf.mode != self.gates.mode);
            let found = self.leaves.binary_search_by_key(&(input, role == Role::Opposite), place);
            found.expect("the leaves are those of the gates")
        };
        self.gates.diagram(number)
    }
}

/// Tabulates the result in every state of the leaves.
pub(super) fn table(network: &mut Network, leaves: usize) -> Vec<u64> {
    let mut words = vec![0; (1usize << leaves).div_ceil(64)];
    for state in 0..1usize << leaves {
        words[state / 64] |= u64::from(network.set(|leaf| state >> leaf & 1 == 1)) << (state % 64);
    }
    words
}

/// The operations of an expression after complements are pushed down to the leaves (De Morgan) and nested operations of one
/// kind are merged: A − B − C is A ∩ ¬B ∩ ¬C.
#[derive(Clone, Debug)]
struct Gates {
    mode: Mode,
    gates: Vec<Gate>,
    /// The occurrences of inputs.
    leaves: Vec<(usize, Above)>,
}

/// The counters of gates. For a counter of one of two truth values, bit 0 of the index tells which.
struct Counters {
    rules: Vec<Rule>,
    parents: Vec<Option<Link>>,
    places: Vec<Place>,
}

/// The estimate of an input that a leaf is, relative to that of the result.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Same,
    Opposite,
}

/// An occurrence of a leaf.
struct Place {
    leaf: (usize, Role),
    link: Link,
    polarity: Polarity,
}

/// The kind of gate that an operation became.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Any,
    All,
    Odd,
}

/// An operation of the expression, during the walk down.
#[derive(Clone, Copy, Debug)]
struct Above {
    /// The gate that the operation became.
    gate: usize,
    /// True if its complement is meant.
    complemented: bool,
    /// The truth values that are needed: that of the same role, that of the opposite role.
    asked: [bool; 2],
    polarity: Polarity,
}

#[derive(Clone, Copy, Debug)]
struct Gate {
    kind: Kind,
    operands: u32,
    /// The parent gate, and whether it takes the complement.
    parent: Option<(usize, bool)>,
    asked: [bool; 2],
}

impl Gates {
    fn of(expression: &Expression, mode: Mode) -> Gates {
        let (terms, parents) = (expression.terms(), expression.parents());
        let mut above: Vec<Option<Above>> = vec![None; terms.len()];
        let mut gates: Vec<Gate> = Vec::new();
        let mut leaves: Vec<(usize, Above)> = Vec::new();
        // Operations come after their operands, so the reverse order meets each before them.
        for i in (0..terms.len()).rev() {
            let asked = match mode {
                Mode::Exact => [true, false],
                Mode::Estimate(_) => [true, true],
            };
            let (mut here, parent) = match parents[i] {
                None => {
                    let root = Above { gate: 0, complemented: false, asked: [true, false], polarity: Polarity::Along };
                    (root, None)
                }
                Some(parent) => {
                    let over = above[parent.term].expect("an operation is met before its operands");
                    let Term::Operation(operation, _) = terms[parent.term] else {
                        unreachable!("inputs have no operands")
                    };
                    let taken_away = operation == BooleanOperation::Difference && !parent.is_first;
                    let here = match operation {
                        BooleanOperation::Xor => Above { complemented: false, asked, polarity: Polarity::Both, ..over },
                        _ => Above { complemented: over.complemented ^ taken_away, ..over },
                    };
                    (here, Some(over.gate))
                }
            };
            if let Term::Input(input) = terms[i] {
                if parent.is_none() {
                    gates.push(Gate { kind: Kind::Any, operands: 0, parent: None, asked: here.asked });
                }
                gates[here.gate].operands += 1;
                leaves.push((input, here));
                continue;
            }
            let kind = match terms[i] {
                Term::Operation(BooleanOperation::Xor, _) => Kind::Odd,
                Term::Operation(BooleanOperation::Union, _) if here.complemented => Kind::All,
                Term::Operation(BooleanOperation::Union, _) => Kind::Any,
                _ if here.complemented => Kind::Any,
                _ => Kind::All,
            };
            if parent.is_none_or(|parent| gates[parent].kind != kind) {
                let inverted = kind == Kind::Odd && here.complemented;
                if let Some(parent) = parent {
                    gates[parent].operands += 1;
                }
                // Both truth values of a symmetric difference depend on both of each operand.
                let asked = if kind == Kind::Odd { asked } else { here.asked };
                here.gate = gates.len();
                gates.push(Gate { kind, operands: 0, parent: parent.map(|parent| (parent, inverted)), asked });
            }
            above[i] = Some(here);
        }
        Gates { mode, gates, leaves }
    }

    /// Returns the number of truth values of a gate.
    fn width(&self) -> usize {
        match self.mode {
            Mode::Exact => 1,
            Mode::Estimate(_) => 2,
        }
    }

    /// Builds the counters of the gates: two of each for estimates, some of which may count nothing.
    fn counters(&self) -> Counters {
        let Gates { mode, gates, leaves } = self;
        let width = self.width();
        let (mut rules, mut parents, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for gate in gates {
            for truth in 0..width {
                rules.push(match (gate.kind, *mode) {
                    (Kind::Any, _) => Rule::AtLeast(1),
                    (Kind::All, _) => Rule::AtLeast(gate.operands),
                    (Kind::Odd, Mode::Exact) => Rule::Odd,
                    (Kind::Odd, Mode::Estimate(_)) => Rule::OddOrUnknown,
                });
                parents.push(gate.parent.and_then(|(parent, inverted)| {
                    // The complement of one estimate is the other estimate of the complement.
                    let counted_as = if inverted { width - 1 - truth } else { truth };
                    gates[parent].asked[counted_as]
                        .then(|| Link { counter: (parent * width + counted_as) as u32, inverted })
                }));
            }
        }
        for &(input, Above { gate, complemented, polarity, .. }) in leaves {
            for truth in (0..width).filter(|&truth| gates[gate].asked[truth]) {
                let polarity = match (polarity, complemented) {
                    (Polarity::Along, true) => Polarity::Against,
                    (polarity, _) => polarity,
                };
                places.push(Place {
                    leaf: (input, self.role(truth, complemented)),
                    link: Link { counter: (gate * width + truth) as u32, inverted: complemented },
                    polarity,
                });
            }
        }
        Counters { rules, parents, places }
    }

    /// Returns the estimate of an input that a truth value of a gate depends on.
    fn role(&self, truth: usize, complemented: bool) -> Role {
        if (truth == 1) != (complemented && self.width() == 2) { Role::Opposite } else { Role::Same }
    }

    /// Builds the diagram of the result, with the given number of each input's leaf.
    fn diagram(&self, number: impl Fn(usize, Role) -> usize) -> Option<Diagram> {
        let mut build = Builder::default();
        let mut values: Vec<Value> = self.gates.iter().map(|gate| Value::new(gate.kind)).collect();
        for &(input, Above { gate, complemented, .. }) in &self.leaves {
            let mut operand = [Builder::never(); 2];
            for truth in (0..self.width()).filter(|&truth| self.gates[gate].asked[truth]) {
                let leaf = build.leaf(number(input, self.role(truth, complemented)))?;
                operand[truth] = if complemented { build.not(leaf)? } else { leaf };
            }
            if self.mode == Mode::Exact {
                operand[1] = operand[0];
            }
            values[gate].add(&mut build, operand)?;
        }
        // Parents come before their operands.
        for i in (1..self.gates.len()).rev() {
            let [same, opposite] = values[i].finish(&mut build)?;
            let (parent, inverted) = self.gates[i].parent.expect("the root is the first gate");
            // The complement of one estimate is the other estimate of the complement.
            let operand = if inverted { [build.not(opposite)?, build.not(same)?] } else { [same, opposite] };
            values[parent].add(&mut build, operand)?;
        }
        let [root, _] = values[0].finish(&mut build)?;
        build.finish(root)
    }
}

/// The truth values of a gate while its operands are added.
struct Value {
    kind: Kind,
    /// Of a symmetric difference: where an operand is between its estimates, one way or the other.
    results: [u32; 2],
    is_odd: u32,
}

impl Value {
    fn new(kind: Kind) -> Value {
        let first = if kind == Kind::All { Builder::always() } else { Builder::never() };
        Value { kind, results: [first; 2], is_odd: Builder::never() }
    }

    fn add(&mut self, build: &mut Builder, [same, opposite]: [u32; 2]) -> Option<()> {
        let [one, other] = &mut self.results;
        match self.kind {
            Kind::Any => (*one, *other) = (build.any(*one, same)?, build.any(*other, opposite)?),
            Kind::All => (*one, *other) = (build.both(*one, same)?, build.both(*other, opposite)?),
            Kind::Odd => {
                let [without, not_same] = [build.not(opposite)?, build.not(same)?];
                let between = [build.both(same, without)?, build.both(opposite, not_same)?];
                (*one, *other) = (build.any(*one, between[0])?, build.any(*other, between[1])?);
                self.is_odd = build.xor(self.is_odd, same)?;
            }
        }
        Some(())
    }

    /// Returns both truth values; see [`Rule::OddOrUnknown`].
    fn finish(&self, build: &mut Builder) -> Option<[u32; 2]> {
        let [one, other] = self.results;
        if self.kind != Kind::Odd {
            return Some([one, other]);
        }
        let [not_one, not_other] = [build.not(one)?, build.not(other)?];
        let known = [build.both(not_other, self.is_odd)?, build.both(not_one, self.is_odd)?];
        Some([build.any(one, known[0])?, build.any(other, known[1])?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(text: &str, mode: Mode) -> Plan {
        let names: Vec<&str> = ["a", "b", "c", "d", "e", "f", "g"].into_iter().filter(|&n| text.contains(n)).collect();
        Plan::new(&Expression::parse(text, &names).unwrap(), mode)
    }

    /// Returns the leaves as letters, lower case for the same estimate and upper case for the opposite one.
    fn leaves(text: &str, mode: Mode) -> String {
        let letter = |leaf: &Leaf| match leaf.mode == mode {
            true => (b'a' + leaf.input as u8) as char,
            false => (b'A' + leaf.input as u8) as char,
        };
        plan(text, mode).leaves().iter().map(letter).collect()
    }

    #[test]
    fn estimates_subtract_opposite_estimates() {
        for (text, expected) in [
            ("a", "a"),
            ("a & (b | c)", "abc"),
            ("a - b", "aB"),
            ("a - (b - c)", "aBc"),
            ("a - (b | (c - d))", "aBCd"),
            ("a ^ b", "aAbB"),
            ("a - (b ^ c) | d", "abBcCd"),
            ("(a - b) | (b - a)", "aAbB"),
            ("a & a", "a"),
        ] {
            assert_eq!(leaves(text, Mode::OVER), expected, "{text}");
        }
        assert_eq!(leaves("a - (b ^ c) | d", Mode::Exact), "abcd");
    }

    #[test]
    fn differences_reverse_the_polarity() {
        let of = |text| plan(text, Mode::Exact).polarities;
        use Polarity::{Against, Along, Both};
        assert_eq!(of("a - (b - c)"), [Along, Against, Along]);
        assert_eq!(of("a & b - (c ^ d)"), [Along, Along, Both, Both]);
        assert_eq!(of("(a - b) | (b & a)"), [Along, Both]);
    }

    #[test]
    fn chains_of_any_length_need_one_counter() {
        for sign in ["-", "|", "&", "^"] {
            let chain = vec!["a"; 100_000].join(sign);
            let plan = plan(&chain, Mode::Exact);
            assert_eq!(plan.leaves().len(), 1);
            assert_eq!(plan.table, Some(vec![if "|&".contains(sign) { 0b10 } else { 0b00 }]), "{sign}");
        }
    }

    #[test]
    fn deep_expressions_take_linear_memory() {
        for mode in [Mode::Exact, Mode::OVER] {
            let deep = format!("{}a{}", "a ^ (b | ".repeat(50_000), ")".repeat(50_000));
            let plan = plan(&deep, mode);
            assert_eq!(plan.leaves().len(), if mode == Mode::Exact { 2 } else { 4 });
        }
    }
}
