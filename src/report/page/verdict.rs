//! The result of checking the user's limits, as a strip.

use super::plot::scale::Scale;
use super::plot::svg::Svg;
use super::words;
use crate::report::scaffold_report::{LimitOutcome, LimitVerdict, Verdict};

/// The strip on top of a page.
pub struct Strip {
    /// The CSS class: `kept`, `within`, `broken` or `none`.
    pub state: &'static str,
    pub sign: &'static str,
    pub headline: String,
    pub limits: Vec<LimitRow>,
}

/// A row of the strip: one limit.
pub struct LimitRow {
    pub state: &'static str,
    pub sign: &'static str,
    pub outcome: &'static str,
    pub name: String,
    pub asked: String,
    pub value: String,
    pub bounds: Option<String>,
    pub drawing: Option<String>,
}

impl Strip {
    pub fn of(verdict: Option<&Verdict>) -> Strip {
        let Some(verdict) = verdict.filter(|verdict| !verdict.limits.is_empty()) else {
            return Strip {
                state: "none", sign: "○", headline: "No limits were given".to_owned(), limits: Vec::new()
            };
        };
        let count =
            |outcomes: &[LimitOutcome]| verdict.limits.iter().filter(|limit| outcomes.contains(&limit.outcome)).count();
        let all = verdict.limits.len();
        let broken = count(&[LimitOutcome::Broken, LimitOutcome::NoValue]);
        let within = count(&[LimitOutcome::KeptWithinBounds]);
        let (state, sign, headline) = match (verdict.passed, broken, within) {
            (true, 0, 0) if all == 1 => ("kept", "✓", "The limit is kept".to_owned()),
            (true, 0, 0) => ("kept", "✓", format!("All {all} limits are kept")),
            (true, ..) => {
                ("within", "≈", format!("Kept by every value; of {within} of {all} limits a bound lies beyond"))
            }
            (false, ..) => {
                ("broken", "✗", format!("{broken} of {all} limits {} not kept", if broken == 1 { "is" } else { "are" }))
            }
        };
        Strip { state, sign, headline, limits: verdict.limits.iter().map(LimitRow::of).collect() }
    }
}

impl LimitRow {
    fn of(limit: &LimitVerdict) -> LimitRow {
        let (state, sign, outcome) = match limit.outcome {
            LimitOutcome::Kept => ("kept", "✓", "kept"),
            LimitOutcome::KeptWithinBounds => ("within", "≈", "kept, but a bound is not"),
            LimitOutcome::Broken if limit.is_broken_by_bounds() => ("broken", "✗", "broken by its bounds"),
            LimitOutcome::Broken => ("broken", "✗", "broken"),
            LimitOutcome::NoValue => ("broken", "–", "no value"),
        };
        let with_unit = |value: f64| words::with_unit(value, &limit.unit);
        let asked = match (limit.min, limit.max) {
            (Some(min), Some(max)) => format!("{} to {}", words::value(min, &limit.unit), with_unit(max)),
            (Some(min), None) => format!("at least {}", with_unit(min)),
            (None, Some(max)) => format!("at most {}", with_unit(max)),
            (None, None) => words::NOTHING.to_owned(),
        };
        LimitRow {
            state,
            sign,
            outcome,
            name: limit.name.clone(),
            asked,
            value: words::maybe(limit.value, &limit.unit),
            bounds: words::bounds(limit.lower, limit.upper, &limit.unit),
            drawing: drawing(limit, asked_range(limit)),
        }
    }
}

fn asked_range(limit: &LimitVerdict) -> [f64; 2] {
    [limit.min.unwrap_or(f64::NEG_INFINITY), limit.max.unwrap_or(f64::INFINITY)]
}

/// Draws the allowed range as a bar, the value as a dot on it, and its bounds as whiskers.
fn drawing(limit: &LimitVerdict, [min, max]: [f64; 2]) -> Option<String> {
    const WIDTH: f64 = 180.0;
    const HEIGHT: f64 = 22.0;
    let value = limit.value.filter(|value| value.is_finite())?;
    let known = [Some(value), limit.lower, limit.upper, limit.min, limit.max];
    let known = || known.into_iter().flatten().filter(|value| value.is_finite());
    let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(f64::NEG_INFINITY, f64::max));
    let margin = if high > low { 0.18 * (high - low) } else { 0.2 * high.abs().max(1e-12) };
    let scale = Scale::new([low - margin, high + margin], [2.0, WIDTH - 2.0]);
    let mut svg = Svg::new(WIDTH, HEIGHT);
    svg.rect("track", [2.0, 8.0], [WIDTH - 4.0, 6.0], None);
    let (from, to) = (scale.within(min), scale.within(max));
    svg.rect("allowed", [from, 8.0], [to - from, 6.0], None);
    for end in [limit.min, limit.max].into_iter().flatten() {
        svg.line("limit", [scale.at(end), 3.0], [scale.at(end), 19.0]);
    }
    if let (Some(lower), Some(upper)) = (limit.lower, limit.upper) {
        svg.line("whisker", [scale.at(lower), 11.0], [scale.at(upper), 11.0]);
        for end in [lower, upper] {
            svg.line("whisker", [scale.at(end), 7.0], [scale.at(end), 15.0]);
        }
    }
    svg.circle("dot", [scale.at(value), 11.0], 4.5, None);
    let place = if (min..=max).contains(&value) { "inside" } else { "outside" };
    Some(svg.finish(&format!("{} lies {place} of what is allowed.", words::maybe(Some(value), &limit.unit))))
}
