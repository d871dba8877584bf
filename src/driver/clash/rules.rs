//! The rules that pairs of parts must keep.

use std::cmp::Ordering;
use std::str::FromStr;

use super::{Pair, Relation};

/// What pairs of parts may do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules {
    /// True if parts may touch.
    pub allow_touching: bool,
    /// The largest volume that two parts may share.
    pub max_volume: f64,
    /// Pairs that are not compared.
    pub ignored: Vec<IgnoredPair>,
}

/// The rule that a pair breaks; the worst first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "report", derive(serde::Serialize), serde(rename_all = "kebab-case"))]
pub enum Finding {
    /// The parts share more volume than they may.
    Overlap,
    /// The parts touch.
    Touching,
    /// The parts are nearer than the clearance.
    Clearance,
}

impl Finding {
    /// Returns the name, as in the JSON.
    pub fn name(self) -> &'static str {
        match self {
            Finding::Overlap => "overlap",
            Finding::Touching => "touching",
            Finding::Clearance => "clearance",
        }
    }
}

impl Rules {
    /// Returns whether a pair of parts is not compared.
    pub fn ignores(&self, a: &str, b: &str) -> bool {
        self.ignored.iter().any(|pair| pair.matches(a, b) || pair.matches(b, a))
    }

    /// Returns the rule that a pair breaks.
    pub fn finding(&self, relation: &Relation, clearance: Option<f64>) -> Option<Finding> {
        match relation {
            Relation::Overlapping(common) => (common.volume.value > self.max_volume).then_some(Finding::Overlap),
            Relation::Touching { .. } => (!self.allow_touching).then_some(Finding::Touching),
            Relation::Separate { distance, .. } => {
                clearance.is_some_and(|least| *distance < least).then_some(Finding::Clearance)
            }
        }
    }
}

/// Orders findings before other pairs, and overlaps by their volume, largest first, before distances, smallest first.
pub fn by_severity(a: &Pair, b: &Pair) -> Ordering {
    let rank = |pair: &Pair| {
        let state = match pair.relation {
            Relation::Overlapping(_) => 0,
            Relation::Touching { .. } => 1,
            Relation::Separate { .. } => 2,
        };
        (pair.finding.is_none(), state)
    };
    let size = |pair: &Pair| match pair.relation {
        Relation::Overlapping(common) => -common.volume.value,
        Relation::Touching { distance, .. } | Relation::Separate { distance, .. } => distance,
    };
    rank(a).cmp(&rank(b)).then(size(a).total_cmp(&size(b))).then(a.parts.cmp(&b.parts))
}

/// Two patterns of names, as typed: `A:B`, in which `*` stands for any characters and `?` for one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IgnoredPair {
    a: String,
    b: String,
}

impl IgnoredPair {
    fn matches(&self, a: &str, b: &str) -> bool {
        matches(&self.a, a) && matches(&self.b, b)
    }
}

impl FromStr for IgnoredPair {
    type Err = String;

    fn from_str(text: &str) -> Result<IgnoredPair, String> {
        match text.split_once(':') {
            Some((a, b)) if !a.is_empty() && !b.is_empty() => Ok(IgnoredPair { a: a.to_owned(), b: b.to_owned() }),
            _ => Err("expected two names of parts, as in 'bolt*:plate.stl'".to_owned()),
        }
    }
}

/// Returns whether a pattern matches a whole name.
fn matches(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // The last star, and the character of the name at which what follows it is tried.
    let mut star = None;
    while n < name.len() {
        match pattern.get(p) {
            Some('*') => {
                star = Some((p, n));
                p += 1;
            }
            Some(&c) if c == '?' || c == name[n] => (p, n) = (p + 1, n + 1),
            _ => match star {
                Some((at, from)) => {
                    star = Some((at, from + 1));
                    (p, n) = (at + 1, from + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p..].iter().all(|&c| c == '*')
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn patterns_match_whole_names() {
        let yes = [("*", ""), ("bolt*", "bolt.stl"), ("*.stl", "a.stl"), ("b?lt*#?", "bolt M3#2"), ("a*b*c", "aXbXbc")];
        for (pattern, name) in yes {
            assert!(matches(pattern, name), "{pattern} {name}");
        }
        let no = [("bolt", "bolt.stl"), ("?", ""), ("a*b", "abc"), ("*.obj", "a.stl"), ("µ", "m")];
        for (pattern, name) in no {
            assert!(!matches(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn ignored_pairs_hold_in_both_orders() {
        let rules = Rules { ignored: vec!["bolt*:plate".parse().unwrap()], ..Rules::default() };
        assert!(rules.ignores("bolt 1", "plate") && rules.ignores("plate", "bolt 1"));
        assert!(!rules.ignores("bolt 1", "bolt 2") && !rules.ignores("plate", "plate"));
        for wrong in ["bolt", ":plate", "bolt:", ""] {
            assert!(wrong.parse::<IgnoredPair>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn distances_below_the_clearance_are_findings() {
        let separate = |distance| Relation::Separate { distance, points: [DVec3::ZERO; 2] };
        let touching = Relation::Touching { distance: 0.0, points: [DVec3::ZERO; 2] };
        let strict = Rules::default();
        let lax = Rules { allow_touching: true, ..Rules::default() };
        assert_eq!(strict.finding(&separate(0.3), Some(0.4)), Some(Finding::Clearance));
        assert_eq!(strict.finding(&separate(0.4), Some(0.4)), None);
        assert_eq!(strict.finding(&separate(0.3), None), None);
        assert_eq!([strict, lax].map(|rules| rules.finding(&touching, Some(0.4))), [Some(Finding::Touching), None]);
    }
}
