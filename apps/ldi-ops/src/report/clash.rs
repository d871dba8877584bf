//! Text output of `clash`.

use std::fmt::Write;

use ldi_ops::driver::clash::{Clashes, OverlapMethod, Pair, Relation};
use ldi_ops::driver::machine::peak_memory_bytes;
use ldi_ops::number::digits;
use ldi_ops::unit;
use ldi_ops::with_error;

use super::Table;
use crate::run::Compared;

/// Returns the text of `clash`: the number of findings, and a table of them.
pub fn of(result: &Compared) -> String {
    let clashes = &result.clashes;
    let findings = clashes.findings().count();
    let mut table = Table::default();
    let plural = if findings == 1 { "" } else { "s" };
    let ignored = if clashes.ignored > 0 { format!(", {} ignored", clashes.ignored) } else { String::new() };
    table.line(
        "clash",
        format_args!(
            "{findings} finding{plural} in {} near pair{} of {} parts{ignored}",
            clashes.pairs.len(),
            if clashes.pairs.len() == 1 { "" } else { "s" },
            clashes.parts.len()
        ),
    );
    table.text += &rows(clashes, clashes.pairs.iter().filter(|pair| pair.finding.is_some()));
    for (i, path) in result.written.iter().enumerate() {
        table.line(if i == 0 { "written" } else { "" }, path.display());
    }
    table.text
}

/// Returns the near pairs that break no rule, time and memory.
pub fn details(result: &Compared) -> String {
    let clashes = &result.clashes;
    let mut table = Table { text: rows(clashes, clashes.pairs.iter().filter(|pair| pair.finding.is_none())) };
    let seconds = &clashes.seconds;
    let memory = peak_memory_bytes().map(|b| format!(", {} MB at most", b / 1_000_000)).unwrap_or_default();
    table.line(
        "time",
        format_args!(
            "{:.3} s: reading {:.3}, hierarchies {:.3}, comparison {:.3}, writing {:.3}{memory}",
            seconds.total, seconds.read, seconds.prepare, seconds.compare, seconds.write
        ),
    );
    table.text
}

/// Returns a table of pairs, its columns as wide as their longest cell.
fn rows<'c>(clashes: &'c Clashes, pairs: impl Iterator<Item = &'c Pair>) -> String {
    let mut lines = vec![["finding", "parts", "amount", "place"].map(str::to_owned)];
    lines.extend(pairs.map(|pair| row(clashes, pair)));
    if lines.len() == 1 {
        return String::new();
    }
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths = [0, 1, 2].map(width);
    let mut text = String::new();
    for [finding, parts, amount, place] in lines {
        let [first, second, third] = widths;
        let _ = writeln!(text, "{finding:first$}  {parts:second$}  {amount:third$}  {place}");
    }
    text
}

fn row(clashes: &Clashes, pair: &Pair) -> [String; 4] {
    let [a, b] = clashes.names(pair);
    let length = |value: f64| format!("{}{}", digits(value, 4), unit::suffix(clashes.unit, 1));
    let finding = match pair.finding {
        Some(finding) => finding.name().to_uppercase(),
        None => "–".to_owned(),
    };
    let amount = match pair.relation {
        Relation::Separate { distance, .. } => format!("{} apart", length(distance)),
        Relation::Touching { distance: 0.0, depth_bound: 0.0, .. } => "touching".to_owned(),
        Relation::Touching { distance: 0.0, depth_bound, .. } => {
            format!("touching, at most {} deep", length(depth_bound))
        }
        Relation::Touching { distance, .. } => format!("touching, {} apart", length(distance)),
        Relation::Overlapping(common) => {
            let volume = common.volume;
            let amount = match volume.method {
                OverlapMethod::Exact => digits(volume.value, 7),
                OverlapMethod::Estimate => {
                    let (value, error) = with_error(volume.value, volume.error());
                    format!("{value} ± {error}")
                }
            };
            let how = match common.contained {
                Some(place) => format!("{} lies in {}", [a, b][place], [a, b][1 - place]),
                None => format!("{} deep", length(common.depth)),
            };
            let doubt = if common.is_certain { "" } else { ", not certain" };
            format!("{amount}{}, {how}{doubt}", unit::suffix(clashes.unit, 3))
        }
    };
    let [x, y, z] = clashes.place(pair).to_array().map(|value| digits(value, 4));
    [finding, format!("{a} : {b}"), amount, format!("({x}, {y}, {z})")]
}
