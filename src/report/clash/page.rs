//! The page on the clashes of parts: matrix, list, pictures.

use askama::Template;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::Pictured;
use crate::driver::clash::rules::Finding;
use crate::driver::clash::{Clashes, OverlapMethod, Pair, Relation};
use crate::report::page::{FOOT, SORT, STYLE, rendered, words};
use crate::report::quantity::{Quantity, Unit};

/// Largest number of parts in the matrix, and of pairs in the list; clash.csv has all.
const MATRIX: usize = 24;
const LIST: usize = 100;

#[derive(Template)]
#[template(path = "clash.html", config = "src/report/askama.toml")]
struct Page<'c> {
    style: &'static str,
    sort: &'static str,
    foot: &'static str,
    title: String,
    state: &'static str,
    sign: &'static str,
    headline: String,
    facts: String,
    numbers: Vec<usize>,
    matrix: Vec<MatrixRow<'c>>,
    matrix_left_out: usize,
    rows: Vec<Row<'c>>,
    rows_left_out: usize,
    length: String,
    volume: String,
    pictures: Vec<Picture<'c>>,
    pictures_left_out: usize,
    warnings: &'c [crate::Warning],
}

struct MatrixRow<'c> {
    number: usize,
    name: &'c str,
    cells: Vec<Cell>,
}

struct Cell {
    class: &'static str,
    sign: &'static str,
    /// The state in words.
    word: &'static str,
}

struct Row<'c> {
    rank: usize,
    class: &'static str,
    state: &'static str,
    names: [&'c str; 2],
    distance: Value,
    depth: Value,
    volume: Value,
    place: String,
}

/// A number as text, and as the key that its column is sorted by.
struct Value {
    text: String,
    key: String,
}

struct Picture<'c> {
    names: [&'c str; 2],
    finding: String,
    view: String,
    section: String,
    axis: &'static str,
    /// The coordinate of the section.
    at: String,
}

/// Returns the page.
pub fn html(clashes: &Clashes, pictured: &[Pictured]) -> String {
    let findings: Vec<&Pair> = clashes.findings().collect();
    let count = |kind: Finding| findings.iter().filter(|pair| pair.finding == Some(kind)).count();
    let said = [(Finding::Overlap, "overlapping"), (Finding::Touching, "touching"), (Finding::Clearance, "too near")]
        .map(|(kind, word)| (count(kind), word));
    let said: Vec<String> =
        said.iter().filter(|(count, _)| *count > 0).map(|(count, word)| format!("{count} {word}")).collect();
    let (state, sign, headline) = match findings.len() {
        0 => ("kept", "✓", "No pair of parts breaks a rule".to_owned()),
        1 => ("broken", "✗", format!("1 finding: {}", said.join(", "))),
        count => ("broken", "✗", format!("{count} findings: {}", said.join(", "))),
    };
    let length = Quantity::Length(1).of(clashes.unit);
    let volume = Quantity::Length(3).of(clashes.unit);
    let shown = parts_of_matrix(clashes);
    let page = Page {
        style: STYLE,
        sort: SORT,
        foot: FOOT,
        title: format!("{} parts", clashes.parts.len()),
        state,
        sign,
        headline,
        facts: facts(clashes, &length),
        numbers: shown.iter().map(|&part| part + 1).collect(),
        matrix: shown.iter().map(|&part| matrix_row(clashes, part, &shown)).collect(),
        matrix_left_out: clashes.parts.len() - shown.len(),
        rows: clashes.pairs.iter().take(LIST).enumerate().map(|(i, pair)| row(clashes, i, pair)).collect(),
        rows_left_out: clashes.pairs.len().saturating_sub(LIST),
        length: length.for_people(),
        volume: volume.for_people(),
        pictures: pictured.iter().map(|pictured| picture(clashes, pictured, &length, &volume)).collect(),
        pictures_left_out: findings.len() - pictured.len(),
        warnings: &clashes.warnings,
    };
    rendered(&page)
}

fn facts(clashes: &Clashes, length: &Unit) -> String {
    let triangles: usize = clashes.parts.iter().map(|part| part.solid.mesh().triangles.len()).sum();
    let clearance = clashes.clearance.map(|least| format!("; least clearance {}", words::with_unit(least, length)));
    format!(
        "{} parts of {} triangles; the boxes of {} of {} pairs come near one another, {} of them ignored{}. Compared in {}.",
        words::count(clashes.parts.len() as u64),
        words::count(triangles as u64),
        words::count((clashes.pairs.len() + clashes.ignored) as u64),
        words::count(clashes.possible_pairs() as u64),
        words::count(clashes.ignored as u64),
        clearance.unwrap_or_default(),
        words::seconds(clashes.seconds.total),
    )
}

/// Returns the parts of the matrix: those of the worst pairs, in order.
fn parts_of_matrix(clashes: &Clashes) -> Vec<usize> {
    let mut shown: Vec<usize> = Vec::new();
    for part in clashes.pairs.iter().flat_map(|pair| pair.parts).chain(0..clashes.parts.len()) {
        if shown.len() < MATRIX && !shown.contains(&part) {
            shown.push(part);
        }
    }
    shown.sort_unstable();
    shown
}

fn matrix_row<'c>(clashes: &'c Clashes, part: usize, shown: &[usize]) -> MatrixRow<'c> {
    let cell = |&other: &usize| {
        let parts = [part.min(other), part.max(other)];
        match clashes.pairs.iter().find(|pair| pair.parts == parts) {
            None => Cell { class: "none", sign: "", word: if part == other { "the same part" } else { "not near" } },
            Some(pair) => {
                let (class, word) = state_of(pair);
                let sign = match pair.relation {
                    Relation::Overlapping(_) => "✗",
                    Relation::Touching { .. } => "=",
                    Relation::Separate { .. } if pair.finding.is_some() => "<",
                    Relation::Separate { .. } => "·",
                };
                Cell { class, sign, word }
            }
        }
    };
    MatrixRow { number: part + 1, name: &clashes.parts[part].name, cells: shown.iter().map(cell).collect() }
}

/// Returns the class of a pair and its state in words.
fn state_of(pair: &Pair) -> (&'static str, &'static str) {
    match (&pair.relation, pair.finding) {
        (Relation::Overlapping(_), Some(_)) => ("broken", "overlapping"),
        (Relation::Overlapping(_), None) => ("kept", "overlapping, allowed"),
        (Relation::Touching { .. }, Some(_)) => ("within", "touching"),
        (Relation::Touching { .. }, None) => ("kept", "touching, allowed"),
        (Relation::Separate { .. }, Some(_)) => ("within", "too near"),
        (Relation::Separate { .. }, None) => ("kept", "separate"),
    }
}

fn row<'c>(clashes: &'c Clashes, rank: usize, pair: &Pair) -> Row<'c> {
    let (class, state) = state_of(pair);
    let value = |value: Option<f64>| match value {
        Some(value) => Value { text: words::significant(value, 4), key: format!("{value:e}") },
        None => Value { text: words::NOTHING.to_owned(), key: String::new() },
    };
    let (distance, common) = match pair.relation {
        Relation::Separate { distance, .. } | Relation::Touching { distance, .. } => (Some(distance), None),
        Relation::Overlapping(common) => (None, Some(common)),
    };
    let volume = match common {
        Some(common) => {
            let volume = common.volume;
            let error = (volume.method == OverlapMethod::Estimate).then(|| volume.error());
            let unit = Quantity::Length(3).of(clashes.unit);
            let text = words::with_error(volume.value, error, &unit);
            Value { text, key: format!("{:e}", volume.value) }
        }
        None => value(None),
    };
    Row {
        rank,
        class,
        state,
        names: pair.parts.map(|part| clashes.parts[part].name.as_str()),
        distance: value(distance),
        depth: value(common.map(|common| common.depth)),
        volume,
        place: place(clashes, pair),
    }
}

/// Returns the coordinates of a finding.
fn place(clashes: &Clashes, pair: &Pair) -> String {
    let [x, y, z] = clashes.place(pair).to_array().map(|value| words::significant(value, 4));
    format!("{x}, {y}, {z}")
}

fn picture<'c>(clashes: &'c Clashes, pictured: &Pictured, length: &Unit, volume: &Unit) -> Picture<'c> {
    let Pictured { pair, pictures } = pictured;
    let names = clashes.names(pair);
    let at = format!("({}) {}", place(clashes, pair), length.for_people());
    let at = at.trim_end();
    let finding = match pair.relation {
        Relation::Overlapping(common) => {
            let within = common.contained.map(|place| format!("{} lies in {}. ", names[place], names[1 - place]));
            format!(
                "{}They share {}; the largest ball that was found in it, {} wide, lies at {at}.",
                within.unwrap_or_default(),
                words::with_unit(common.volume.value, volume),
                words::with_unit(common.depth, length),
            )
        }
        Relation::Touching { .. } => format!("They touch at {at}."),
        Relation::Separate { distance, .. } => {
            format!("They are {} apart at {at}.", words::with_unit(distance, length))
        }
    };
    let address = |png: &[u8]| format!("data:image/png;base64,{}", STANDARD.encode(png));
    Picture {
        names,
        finding,
        view: address(&pictures.view),
        section: address(&pictures.section),
        axis: pictures.axis.name(),
        at: words::with_unit(pictures.at, length),
    }
}
