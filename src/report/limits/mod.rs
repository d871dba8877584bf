//! The user's requirements of a solid: a TOML file with the least and greatest values of metrics, checked against a report.
//!
//! ```toml
//! porosity = { min = 0.6, max = "80 %" }
//! percolation.min = "300 um"
//!
//! [solid.thickness]
//! mean = { min = "0.2 mm" }
//! ```
//! A key is the id of a metric or one of [`ALIASES`]; dots lead into tables, as in TOML. Plain numbers are in the unit of the
//! solid, shares from 0 to 1; strings carry their unit and are converted.

mod amount;

use std::path::{Path, PathBuf};

use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::mesh::LengthUnit;

pub use amount::{Amount, AmountError};

use super::id::{self, MetricId, Statistic};
use super::scaffold_report::{LimitOutcome, LimitVerdict, Metric, Verdict};

/// Readable aliases of metrics.
pub const ALIASES: [(&str, MetricId); 20] = [
    ("open-porosity", id::POROSITY_OPEN),
    ("closed-porosity", id::POROSITY_CLOSED),
    ("percolation-diameter", id::PERCOLATION),
    ("largest-pore", id::PORE_LARGEST),
    ("wall", id::WALL_THINNEST),
    ("thinnest-wall", id::WALL_THINNEST),
    ("thickness", id::SOLID_THICKNESS.of(Statistic::Mean)),
    ("Tb.Th", id::SOLID_THICKNESS.of(Statistic::Mean)),
    ("separation", id::PORE_THICKNESS.of(Statistic::Mean)),
    ("pore-size", id::PORE_THICKNESS.of(Statistic::Mean)),
    ("Tb.Sp", id::PORE_THICKNESS.of(Statistic::Mean)),
    ("Tb.N", id::NUMBER),
    ("volume", id::VOLUME_SOLID),
    ("BV", id::VOLUME_SOLID),
    ("TV", id::VOLUME_TOTAL),
    ("BS", id::SURFACE_AREA),
    ("BS/BV", id::SURFACE_SPECIFIC),
    ("BS/TV", id::SURFACE_DENSITY),
    ("DA", id::ANISOTROPY),
    ("Conn.D", id::CONNECTIVITY),
];

/// Metrics with certified bounds, which decide about a limit that no value between them keeps.
const CERTIFIED: [MetricId; 3] = [id::VOLUME_SOLID, id::VOLUME_FRACTION, id::POROSITY];

/// Rounding of bounds to lattices, as a share.
const ROUNDED: f64 = 1e-6;

/// Number of known ids that an error lists, the nearest first.
const NAMED: usize = 12;

/// The limits of a file, in its order.
#[derive(Clone, Debug)]
pub struct Limits {
    file: PathBuf,
    limits: Vec<Limit>,
}

/// The limit of one metric.
#[derive(Clone, Debug)]
struct Limit {
    /// The key as written.
    key: String,
    line: usize,
    min: Option<Amount>,
    max: Option<Amount>,
}

/// A fault in a file of limits, or a limit that does not fit the solid.
#[derive(Debug, Error)]
#[error("{}{}: {problem}", file.display(), line.map_or(String::new(), |line| format!(":{line}")))]
pub struct LimitsError {
    pub file: PathBuf,
    /// The line, counted from 1.
    pub line: Option<usize>,
    pub problem: Box<Problem>,
}

#[derive(Debug, Error)]
pub enum Problem {
    #[error("{0}")]
    Syntax(String),
    #[error("the file contains no limits; write for example porosity = {{ min = 0.6, max = 0.8 }}")]
    Empty,
    #[error("{key}: {found} is not a limit; write {key} = {{ min = …, max = … }}, with min, max or both")]
    NoLimit { key: String, found: &'static str },
    #[error("{key}: {source}")]
    Amount { key: String, source: AmountError },
    #[error("{key}: min {min} is above max {max}")]
    Crossed { key: String, min: f64, max: f64 },
    #[error("{key}: line {before} already limits {id}; remove one of the two")]
    Twice { key: String, id: &'static str, before: usize },
    #[error("{key}: unknown metric; the nearest names are {}{}", known.join(", "), more(*others))]
    Unknown { key: String, known: Vec<String>, others: usize },
}

fn more(others: usize) -> String {
    if others == 0 { String::new() } else { format!("; metrics.json lists {others} more") }
}

impl Limits {
    /// Reads the text of a file.
    pub fn parse(file: &Path, text: &str) -> Result<Limits, LimitsError> {
        let line_of =
            |at: usize| 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|&&byte| byte == b'\n').count();
        let fault = |line, problem| LimitsError { file: file.to_owned(), line, problem: Box::new(problem) };
        let table = DeTable::parse(text).map_err(|error| {
            fault(error.span().map(|span| line_of(span.start)), Problem::Syntax(error.message().to_owned()))
        })?;
        let mut limits = Vec::new();
        collect("", table.get_ref(), &mut limits).map_err(|(at, problem)| fault(Some(line_of(at)), problem))?;
        if limits.is_empty() {
            return Err(fault(None, Problem::Empty));
        }
        limits.sort_by_key(|&(at, _)| at);
        let limits = limits.into_iter().map(|(at, limit)| Limit { line: line_of(at), ..limit }).collect();
        Ok(Limits { file: file.to_owned(), limits })
    }

    /// Checks the metrics of a solid with lengths in `unit` against the limits.
    ///
    /// # Errors
    /// If a key names no metric, or an amount does not fit its metric.
    pub fn judge(&self, metrics: &[Metric], unit: Option<LengthUnit>) -> Result<Verdict, LimitsError> {
        let fault =
            |line, problem| LimitsError { file: self.file.clone(), line: Some(line), problem: Box::new(problem) };
        let mut limits: Vec<LimitVerdict> = Vec::new();
        let mut seen: Vec<(&str, usize)> = Vec::new();
        for limit in &self.limits {
            let metric = metric_named(&limit.key, metrics).map_err(|problem| fault(limit.line, problem))?;
            if let Some(&(_, before)) = seen.iter().find(|(id, _)| *id == metric.id) {
                let key = limit.key.clone();
                return Err(fault(limit.line, Problem::Twice { key, id: metric.id, before }));
            }
            seen.push((metric.id, limit.line));
            limits.push(judged(limit, metric, unit).map_err(|problem| fault(limit.line, problem))?);
        }
        let kept = |limit: &LimitVerdict| matches!(limit.outcome, LimitOutcome::Kept | LimitOutcome::KeptWithinBounds);
        Ok(Verdict { passed: limits.iter().all(kept), limits })
    }
}

/// Collects the limits of a table and of the tables in it, each with its offset in the text.
fn collect(path: &str, table: &DeTable, limits: &mut Vec<(usize, Limit)>) -> Result<(), (usize, Problem)> {
    let (mut min, mut max, mut first) = (None, None, usize::MAX);
    for (name, value) in table {
        let at = name.span().start;
        let key = if path.is_empty() { name.get_ref().to_string() } else { format!("{path}.{}", name.get_ref()) };
        match (value.get_ref(), name.get_ref().as_ref()) {
            // `min` and `max` are also names of metrics: solid.thickness.min = { min = 0.2 }.
            (DeValue::Table(inner), _) => {
                let before = limits.len();
                collect(&key, inner, limits)?;
                if limits.len() == before {
                    return Err((at, Problem::NoLimit { key, found: "an empty table" }));
                }
            }
            (_, end @ ("min" | "max")) if !path.is_empty() => {
                let amount = amount_of(value).map_err(|source| (at, Problem::Amount { key: key.clone(), source }))?;
                *(if end == "min" { &mut min } else { &mut max }) = Some(amount);
                first = first.min(at);
            }
            (other, _) => return Err((at, Problem::NoLimit { key, found: named(other) })),
        }
    }
    if min.is_some() || max.is_some() {
        limits.push((first, Limit { key: path.to_owned(), line: 0, min, max }));
    }
    Ok(())
}

fn named(value: &DeValue) -> &'static str {
    match value {
        DeValue::Array(_) => "a list",
        DeValue::String(_) => "a text",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        _ => "a number",
    }
}

fn amount_of(value: &Spanned<DeValue>) -> Result<Amount, AmountError> {
    match value.get_ref() {
        DeValue::String(text) => Amount::parse(text),
        DeValue::Integer(integer) => {
            let value = i64::from_str_radix(integer.as_str(), integer.radix());
            value
                .map(|value| Amount::plain(value as f64))
                .map_err(|_| AmountError::NoNumber(integer.as_str().to_owned()))
        }
        DeValue::Float(float) => Amount::parse(float.as_str()),
        other => Err(AmountError::NoNumber(named(other).to_owned())),
    }
}

/// Returns the metric that a key names.
///
/// # Errors
/// A key that names none; the error has the nearest names.
pub fn metric_named<'s>(key: &str, metrics: &'s [Metric]) -> Result<&'s Metric, Problem> {
    let called = |id: &str| metrics.iter().find(|metric| metric.id == id);
    let id = ALIASES.iter().find(|(alias, _)| alias.eq_ignore_ascii_case(key)).map_or(key, |(_, id)| id.id);
    called(id).ok_or_else(|| {
        let aliases = ALIASES.iter().filter(|(_, id)| called(id.id).is_some()).map(|(alias, _)| *alias);
        let mut known: Vec<&str> = metrics.iter().map(|metric| metric.id).chain(aliases).collect();
        let near = |name: &str| strsim::jaro_winkler(&key.to_lowercase(), &name.to_lowercase());
        known.sort_by(|a, b| near(b).total_cmp(&near(a)));
        let others = known.len().saturating_sub(NAMED);
        Problem::Unknown {
            key: key.to_owned(),
            known: known.into_iter().take(NAMED).map(str::to_owned).collect(),
            others,
        }
    })
}

fn judged(limit: &Limit, metric: &Metric, unit: Option<LengthUnit>) -> Result<LimitVerdict, Problem> {
    let convert = |amount: &Option<Amount>, end: &str| {
        let converted = amount.as_ref().map(|amount| amount.in_unit(metric.unit.quantity, unit)).transpose();
        converted.map_err(|source| Problem::Amount { key: format!("{}.{end}", limit.key), source })
    };
    let (min, max) = (convert(&limit.min, "min")?, convert(&limit.max, "max")?);
    if let (Some(min), Some(max)) = (min, max)
        && min > max
    {
        return Err(Problem::Crossed { key: limit.key.clone(), min, max });
    }
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    let [value, lower, upper] = [metric.value, metric.lower, metric.upper].map(finite);
    let keeps = |value: f64| min.is_none_or(|min| value >= min) && max.is_none_or(|max| value <= max);
    // No value between certified bounds keeps it, whatever the raster says.
    let is_certified = CERTIFIED.iter().any(|certified| certified.id == metric.id);
    let is_beyond = |least: Option<f64>, most: Option<f64>| {
        let beyond = |(least, most): (f64, f64)| least - most > ROUNDED * least.abs();
        is_certified && least.zip(most).is_some_and(beyond)
    };
    let outcome = match value {
        None => LimitOutcome::NoValue,
        Some(value) if !keeps(value) || is_beyond(lower, max) || is_beyond(min, upper) => LimitOutcome::Broken,
        Some(_) if [lower, upper].into_iter().flatten().all(keeps) => LimitOutcome::Kept,
        Some(_) => LimitOutcome::KeptWithinBounds,
    };
    Ok(LimitVerdict {
        metric: metric.id.to_owned(),
        name: metric.name.to_owned(),
        min,
        max,
        value,
        lower,
        upper,
        unit: metric.unit,
        outcome,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fixture;

    fn judge(text: &str) -> Result<Verdict, LimitsError> {
        Limits::parse(Path::new("limits.toml"), text)?.judge(&fixture::rich().metrics, fixture::rich().unit)
    }

    fn refusal(text: &str) -> String {
        judge(text).unwrap_err().to_string()
    }

    #[test]
    fn every_way_to_write_a_limit_is_read() {
        let verdict = judge(
            "# What we ask\nporosity = { min = 0.6, max = \"80 %\" }\n\n[percolation]\nmin = \"410 um\"\n\
             [solid]\nthickness.mean = { min = \"0.2 mm\" }\n\"BS/BV\".min = \"10 1/mm\"\n",
        );
        // `"BS/BV"` is in the table `solid`.
        assert!(verdict.unwrap_err().to_string().starts_with("limits.toml:8: solid.BS/BV: unknown metric"));
        let verdict = judge(
            "porosity = { min = 0.6, max = \"80 %\" }\npercolation.min = \"410 µm\"\n\"wall.thinnest\" = { min = \"0.2 mm\" }\n\
             \"BS/BV\".min = \"10 1/mm\"\nTb.Th = { max = 0.3 }\neuler = { max = -1 }\n[tortuosity.pore.diffusive.z]\nmax = 2",
        )
        .unwrap();
        let outcomes: Vec<_> = verdict.limits.iter().map(|limit| (limit.metric.as_str(), limit.outcome)).collect();
        use LimitOutcome::*;
        assert_eq!(
            outcomes,
            [
                (id::POROSITY.id, Kept),
                (id::PERCOLATION.id, KeptWithinBounds),
                (id::WALL_THINNEST.id, Broken),
                (id::SURFACE_SPECIFIC.id, Kept),
                (id::SOLID_THICKNESS.of(Statistic::Mean).id, Kept),
                (id::EULER.id, Kept),
                ("tortuosity.pore.diffusive.z", NoValue),
            ]
        );
        assert!(!verdict.passed);
        assert_eq!((verdict.limits[0].max, verdict.limits[1].min), (Some(0.8), Some(0.41)));
        assert!(judge("porosity.min = 0.6").unwrap().passed);
    }

    #[test]
    fn bounds_beyond_a_limit_break_it_whatever_the_value() {
        let mut metrics = fixture::rich().metrics;
        let porosity = metrics.iter_mut().find(|metric| metric.id == id::POROSITY.id).unwrap();
        (porosity.value, porosity.lower, porosity.upper) = (Some(0.70), Some(0.72), Some(0.75));
        use LimitOutcome::*;
        for (text, outcome) in [
            ("porosity.max = 0.71", Broken),
            ("porosity.max = 0.73", KeptWithinBounds),
            ("porosity.min = 0.73", Broken),
            ("porosity.min = 0.6", Kept),
        ] {
            let verdict = Limits::parse(Path::new("limits.toml"), text).unwrap().judge(&metrics, None).unwrap();
            assert_eq!((verdict.limits[0].outcome, verdict.passed), (outcome, outcome != Broken), "{text}");
        }
    }

    #[test]
    fn aliases_lead_to_metrics_and_hide_none() {
        let report = fixture::rich();
        for (alias, id) in ALIASES {
            assert!(report.metric(id.id).is_some() && report.metric(alias).is_none(), "{alias}: {}", id.id);
        }
    }

    #[test]
    fn faults_name_file_line_and_key() {
        let text = refusal("\nporosty = { min = 0.6 }");
        assert!(text.starts_with("limits.toml:2: porosty: unknown metric; the nearest names are porosity, "), "{text}");
        assert!(text.contains("; metrics.json lists "), "{text}");
        for (text, said) in [
            ("porosity = 0.6", "limits.toml:1: porosity: a number is not a limit; write porosity = { min"),
            ("porosity = { minimum = 0.6 }", "limits.toml:1: porosity.minimum: a number is not a limit"),
            ("min = 0.6", "limits.toml:1: min: a number is not a limit"),
            ("[porosity]", "limits.toml:1: porosity: an empty table is not a limit"),
            ("", "limits.toml: the file contains no limits"),
            ("porosity = {", "limits.toml:1: "),
            ("porosity = { min = 0.8, max = 0.6 }", "limits.toml:1: porosity: min 0.8 is above max 0.6"),
            (
                "wall.min = 0.2\nthinnest-wall.min = 0.2",
                "limits.toml:2: thinnest-wall: line 1 already limits wall.thinnest",
            ),
            (
                "porosity.min = 60",
                "limits.toml:1: porosity.min: 60 is not a share from 0 to 1; write percent as \"60 %\"",
            ),
            ("percolation.min = \"3 parsecs\"", "limits.toml:1: percolation.min: \"3 parsecs\""),
            ("percolation.min = \"3 mm^2\"", "limits.toml:1: percolation.min: \"3 mm^2\" is not a length"),
            ("percolation.min = true", "limits.toml:1: percolation.min: \"true or false\" is not a number"),
            ("percolation.min = nan", "limits.toml:1: percolation.min: \"nan\""),
        ] {
            assert!(refusal(text).starts_with(said), "{text}: {}", refusal(text));
        }
    }

    #[test]
    fn a_unit_needs_a_solid_with_one() {
        let limits = Limits::parse(Path::new("limits.toml"), "volume.total.min = \"3 mm³\"").unwrap();
        let text = limits.judge(&fixture::poor().metrics, fixture::poor().unit).unwrap_err().to_string();
        assert!(text.contains("--unit"), "{text}");
        let plain = Limits::parse(Path::new("limits.toml"), "volume.solid.min = 3").unwrap();
        assert!(plain.judge(&fixture::poor().metrics, fixture::poor().unit).unwrap().passed);
    }
}
