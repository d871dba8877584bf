//! The rules that pairs of parts must keep.

use std::cmp::Ordering;
use std::str::FromStr;

use super::overlap::OverlapMethod;
use super::{Pair, Relation};
use crate::cubic::TypedVolume;
use crate::length::Length;
use crate::mesh::LengthUnit;
use crate::{Error, Warning};

/// What pairs of parts may do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules {
    /// True if parts may touch.
    pub allow_touching: bool,
    /// The largest volume that two parts may share; 0 without it.
    pub max_volume: Option<TypedVolume>,
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
    /// Returns the pairs of parts that are not compared, and warnings about patterns that no part has.
    ///
    /// # Errors
    /// A text with several colons that can be read as two patterns in several ways.
    pub fn ignored(&self, names: &[&str]) -> Result<(IgnoredParts, Vec<Warning>), Error> {
        let read = self.ignored.iter().map(|pair| pair.of_parts(names)).collect::<Result<Vec<_>, Error>>()?;
        let (parts, warnings): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        Ok((IgnoredParts(parts), warnings.into_iter().flatten().collect()))
    }

    /// Returns the limits that pairs are judged by, in a unit. A volume that equals the limit to its last digits is within it.
    ///
    /// # Errors
    /// A limit with a unit where that of the parts is not known.
    pub fn limits(&self, clearance: Option<Length>, unit: Option<LengthUnit>) -> Result<Limits, Error> {
        let clearance = clearance.map(|length| length.in_unit(unit, "--clearance")).transpose()?;
        let max_volume = self.max_volume.as_ref().map(|volume| volume.in_cubed(unit, "--max-volume")).transpose()?;
        Ok(Limits {
            clearance,
            max_volume: max_volume.map_or(0.0, |[_, most]| most),
            allow_touching: self.allow_touching,
        })
    }
}

/// The limits that pairs are judged by, in the unit of the parts.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// The least distance that two parts must keep, if one was given.
    pub clearance: Option<f64>,
    /// The largest volume that two parts may share.
    pub max_volume: f64,
    /// True if parts may touch.
    pub allow_touching: bool,
}

impl Limits {
    /// Returns the rule that a pair breaks.
    pub fn finding(&self, relation: &Relation) -> Option<Finding> {
        match relation {
            Relation::Overlapping(common) => {
                let is_any = self.max_volume == 0.0 && common.is_certain;
                // An estimate is 0 where no ray meets a thin overlap: what the parts may share counts.
                let most = match common.volume.method {
                    OverlapMethod::Exact => common.volume.value,
                    OverlapMethod::Estimate => common.volume.upper,
                };
                (is_any || most > self.max_volume).then_some(Finding::Overlap)
            }
            Relation::Touching { .. } => (!self.allow_touching).then_some(Finding::Touching),
            Relation::Separate { distance, .. } => {
                self.clearance.is_some_and(|least| *distance < least).then_some(Finding::Clearance)
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
///
/// Where names have colons, the patterns end at the one colon at which both have parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IgnoredPair(String);

/// The parts that two patterns have.
struct Reading<'t> {
    patterns: [&'t str; 2],
    parts: [Vec<bool>; 2],
}

impl Reading<'_> {
    fn has_parts(&self) -> [bool; 2] {
        [0, 1].map(|side| self.parts[side].contains(&true))
    }
}

impl IgnoredPair {
    /// Returns the parts of both patterns; with a warning where one of them has none.
    fn of_parts(&self, names: &[&str]) -> Result<([Vec<bool>; 2], Option<Warning>), Error> {
        let IgnoredPair(text) = self;
        let parts = |pattern| names.iter().map(|name| matches(pattern, name)).collect();
        let readings: Vec<Reading> =
            splits(text).map(|(a, b)| Reading { patterns: [a, b], parts: [a, b].map(parts) }).collect();
        let mut with_parts = readings.iter().filter(|reading| reading.has_parts() == [true; 2]);
        match (with_parts.next(), with_parts.next()) {
            (Some(one), Some(other)) => {
                let [one, other] = [one, other].map(|reading| reading.patterns.map(|p| format!("`{p}`")).join(" and "));
                Err(Error::input(format!(
                    "--ignore {text}: names {one}, or {other}; write ? for each colon within a name"
                )))
            }
            (Some(one), None) => Ok((one.parts.clone(), None)),
            (None, _) => {
                let missing = readings.iter().flat_map(|reading| {
                    reading.patterns.into_iter().zip(reading.has_parts()).filter(|(_, has)| !has).map(|(p, _)| p)
                });
                let missing: Vec<String> = missing.map(|pattern| format!("`{pattern}`")).collect();
                let message = format!(
                    "--ignore {text}: no part is named {}; the parts are {}",
                    missing.join(" or "),
                    listed(names)
                );
                Ok((Default::default(), Some(Warning::new("ignores-nothing", message))))
            }
        }
    }
}

/// Returns the texts before and behind each colon that has both.
fn splits(text: &str) -> impl Iterator<Item = (&str, &str)> {
    let colons = text.match_indices(':').map(|(at, _)| (&text[..at], &text[at + 1..]));
    colons.filter(|(a, b)| !a.is_empty() && !b.is_empty())
}

/// Most names that a message lists.
const LISTED: usize = 8;

fn listed(names: &[&str]) -> String {
    match names.len() {
        count if count > LISTED => format!("{} and {} others", names[..LISTED].join(", "), count - LISTED),
        _ => names.join(", "),
    }
}

impl FromStr for IgnoredPair {
    type Err = String;

    fn from_str(text: &str) -> Result<IgnoredPair, String> {
        match splits(text).next() {
            Some(_) => Ok(IgnoredPair(text.to_owned())),
            None => Err("expected two names of parts, as in 'bolt*:plate.stl'".to_owned()),
        }
    }
}

/// The pairs of parts that are not compared: for each rule, the parts of its two patterns.
pub struct IgnoredParts(Vec<[Vec<bool>; 2]>);

impl IgnoredParts {
    /// Returns whether a pair of parts, by their numbers, is not compared.
    pub fn contains(&self, [i, j]: [usize; 2]) -> bool {
        let is = |list: &Vec<bool>, part: usize| list.get(part) == Some(&true);
        self.0.iter().any(|[a, b]| is(a, i) && is(b, j) || is(a, j) && is(b, i))
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

    use super::super::overlap::Overlap;
    use super::super::{Aabb, Common};
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

    fn ignored(text: &str, names: &[&str]) -> Result<(IgnoredParts, Vec<Warning>), Error> {
        Rules { ignored: vec![text.parse().unwrap()], ..Rules::default() }.ignored(names)
    }

    #[test]
    fn ignored_pairs_hold_in_both_orders() {
        let (pairs, warnings) = ignored("bolt*:plate", &["bolt 1", "bolt 2", "plate"]).unwrap();
        assert!(pairs.contains([0, 2]) && pairs.contains([2, 0]) && pairs.contains([1, 2]));
        assert!(!pairs.contains([0, 1]) && !pairs.contains([2, 2]) && warnings.is_empty());
        for wrong in ["bolt", ":plate", "bolt:", ""] {
            assert!(wrong.parse::<IgnoredPair>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn patterns_end_at_the_colon_at_which_both_have_parts() {
        let names = [r"C:\a.stl", r"D:\b.stl", "M3:8", "M3"];
        for (text, pair) in
            [(r"C:\a.stl:D:\b.stl", [0, 1]), ("*b.stl:M3:8", [1, 2]), ("M3:C:*", [0, 3]), ("M3?8:M3", [2, 3])]
        {
            let (pairs, warnings) = ignored(text, &names).unwrap();
            assert!(warnings.is_empty(), "{text} {warnings:?}");
            let found: Vec<[usize; 2]> =
                (0..4).flat_map(|i| (i..4).map(move |j| [i, j])).filter(|&p| pairs.contains(p)).collect();
            assert_eq!(found, [pair], "{text}");
        }
        let error = ignored("M3:8:M3", &["M3:8", "M3", "8:M3"]).err().unwrap().to_string();
        assert_eq!(
            error,
            "--ignore M3:8:M3: names `M3` and `8:M3`, or `M3:8` and `M3`; write ? for each colon within a name"
        );
    }

    #[test]
    fn patterns_without_parts_leave_a_warning_that_names_the_parts() {
        let (pairs, warnings) = ignored("bolt:plat", &["bolt", "plate"]).unwrap();
        assert!(!pairs.contains([0, 1]));
        assert_eq!(warnings[0].message, "--ignore bolt:plat: no part is named `plat`; the parts are bolt, plate");
    }

    #[test]
    fn volumes_have_the_unit_that_they_are_typed_with() {
        let most = |text: &str, unit| {
            let rules = Rules { max_volume: Some(text.parse().unwrap()), ..Rules::default() };
            rules.limits(None, unit).map(|limits| limits.max_volume)
        };
        assert_eq!(most("0.5", None), Ok(0.5));
        assert!((most("0.5 mm3", Some(LengthUnit::Centimetre)).unwrap() - 5e-4).abs() < 1e-17);
        assert!(
            most("0.5mm3", None).unwrap_err().to_string().starts_with("--max-volume 0.5mm3: the input states no unit")
        );
    }

    #[test]
    fn overlaps_that_may_exceed_the_greatest_volume_are_findings() {
        let overlapping = |value: f64, upper: f64, method, is_certain| {
            let volume = Overlap { value, lower: 0.0, upper, method };
            let bounds = Aabb { min: DVec3::ZERO, max: DVec3::ONE };
            let deepest = DVec3::splat(0.5);
            let common = Common { volume, bounds, deepest, depth: 0.0, depth_bound: 1.0, contained: None, is_certain };
            Relation::Overlapping(common)
        };
        let found = |most: &str, relation| {
            let rules = Rules { max_volume: Some(most.parse().unwrap()), ..Rules::default() };
            rules.limits(None, None).unwrap().finding(&relation).is_some()
        };
        let (exact, estimate) = (OverlapMethod::Exact, OverlapMethod::Estimate);
        // The range of an exact volume is its rounding.
        assert!(!found("1", overlapping(1.0, 1.0 + 1e-13, exact, true)));
        assert!(found("1", overlapping(1.0 + 1e-13, 1.0 + 2e-13, exact, true)));
        assert!(found("1", overlapping(0.9, 1.1, estimate, true)));
        assert!(!found("1", overlapping(0.8, 0.9, estimate, true)));
        assert!(
            found("0", overlapping(0.0, 0.1, estimate, true)) && found("0", overlapping(0.0, 0.1, estimate, false))
        );
    }

    #[test]
    fn distances_below_the_clearance_are_findings() {
        let separate = |distance| Relation::Separate { distance, points: [DVec3::ZERO; 2] };
        let touching = Relation::Touching { distance: 0.0, depth_bound: 0.0, points: [DVec3::ZERO; 2] };
        let of = |allow_touching, clearance: Option<f64>| {
            let clearance = clearance.map(|value| Length { value, unit: None });
            Rules { allow_touching, ..Rules::default() }.limits(clearance, None).unwrap()
        };
        let strict = of(false, Some(0.4));
        assert_eq!(strict.finding(&separate(0.3)), Some(Finding::Clearance));
        assert_eq!(strict.finding(&separate(0.4)), None);
        assert_eq!(of(false, None).finding(&separate(0.3)), None);
        let both = [strict, of(true, Some(0.4))];
        assert_eq!(both.map(|limits| limits.finding(&touching)), [Some(Finding::Touching), None]);
    }
}
