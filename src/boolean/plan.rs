//! Compilation of an expression for the sweep.

use super::BooleanOperation;
use super::expression::{Expression, Term};
use super::network::{Link, Network, Rule};
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
        let Gates { rules, parents, places } = Gates::of(expression, mode);
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
        let steps = expression.terms().len() << leaves.len().min(TABLE_LEAVES);
        let is_small = leaves.len() <= TABLE_LEAVES && steps <= TABLE_STEPS;
        let table = is_small.then(|| table(&mut network.clone(), leaves.len()));
        let polarities = polarities.into_iter().map(|polarity| polarity.expect("every leaf has a place")).collect();
        let of_role = |(input, role)| match role {
            Role::Same => Leaf { input, mode },
            Role::Opposite => Leaf { input, mode: mode.opposite() },
        };
        Plan { leaves: leaves.into_iter().map(of_role).collect(), polarities, network, table }
    }

    /// Returns the images that are needed, by input and then that of the mode of the result first.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// Returns the result in every state of the leaves, bit by bit: bit `s` where the leaves inside are the bits of `s`. `None`
    /// where there are more than twelve leaves, or the expression is very long.
    pub fn table(&self) -> Option<&[u64]> {
        self.table.as_deref()
    }
}

/// Tabulates the result in every state of the leaves.
fn table(network: &mut Network, leaves: usize) -> Vec<u64> {
    let mut words = vec![0; (1usize << leaves).div_ceil(64)];
    for state in 0..1usize << leaves {
        words[state / 64] |= u64::from(network.set(|leaf| state >> leaf & 1 == 1)) << (state % 64);
    }
    words
}

/// The operations of an expression after complements are pushed down to the leaves (De Morgan) and nested operations of one
/// kind are merged: A − B − C is A ∩ ¬B ∩ ¬C. For a counter of one of two truth values, bit 0 of the index tells which.
struct Gates {
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
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Any,
    All,
    Odd,
}

/// An operation of the expression, during the walk down.
#[derive(Clone, Copy)]
struct Above {
    /// The gate that the operation became.
    gate: usize,
    /// True if its complement is meant.
    complemented: bool,
    /// The truth values that are needed: that of the same role, that of the opposite role.
    asked: [bool; 2],
    polarity: Polarity,
}

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
        Gates::counters(&gates, &leaves, mode)
    }

    /// Builds the counters of the gates: two of each for estimates, some of which may count nothing.
    fn counters(gates: &[Gate], leaves: &[(usize, Above)], mode: Mode) -> Gates {
        let width = match mode {
            Mode::Exact => 1,
            Mode::Estimate(_) => 2,
        };
        let (mut rules, mut parents, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for gate in gates {
            for truth in 0..width {
                rules.push(match (gate.kind, mode) {
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
                let role = if complemented && width == 2 { 1 - truth } else { truth };
                let polarity = match (polarity, complemented) {
                    (Polarity::Along, true) => Polarity::Against,
                    (polarity, _) => polarity,
                };
                places.push(Place {
                    leaf: (input, if role == 0 { Role::Same } else { Role::Opposite }),
                    link: Link { counter: (gate * width + truth) as u32, inverted: complemented },
                    polarity,
                });
            }
        }
        Gates { rules, parents, places }
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
