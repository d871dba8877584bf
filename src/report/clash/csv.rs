//! clash.csv: a line for each near pair, following RFC 4180.

use ::csv::WriterBuilder;
use serde::Serialize;

use crate::driver::clash::{Clashes, Pair, Relation};
use crate::report::write::table;
use crate::unit;

/// A line; its fields name the columns.
#[derive(Serialize)]
struct Line<'c> {
    finding: &'static str,
    state: &'static str,
    a: &'c str,
    b: &'c str,
    distance: Option<f64>,
    volume: Option<f64>,
    volume_lower: Option<f64>,
    volume_upper: Option<f64>,
    depth: Option<f64>,
    x: f64,
    y: f64,
    z: f64,
    unit: String,
}

/// Returns the table of the near pairs, the worst first. Volumes are in cubic units of the lengths; x, y and z are the place of
/// the finding, the middle of the nearest points where the parts are separate.
pub fn csv(clashes: &Clashes) -> String {
    table(WriterBuilder::new().has_headers(false), |writer| {
        writer.write_record(COLUMNS)?;
        clashes.pairs.iter().try_for_each(|pair| writer.serialize(line(clashes, pair)))
    })
}

/// The header, which stands in tables without lines too.
const COLUMNS: [&str; 13] = [
    "finding",
    "state",
    "a",
    "b",
    "distance",
    "volume",
    "volume_lower",
    "volume_upper",
    "depth",
    "x",
    "y",
    "z",
    "unit",
];

fn line<'c>(clashes: &'c Clashes, pair: &Pair) -> Line<'c> {
    let [a, b] = pair.parts.map(|part| clashes.parts[part].name.as_str());
    let place = pair.relation.place();
    let (distance, common) = match pair.relation {
        Relation::Separate { distance, .. } | Relation::Touching { distance, .. } => (Some(distance), None),
        Relation::Overlapping(common) => (None, Some(common)),
    };
    Line {
        finding: pair.finding.map_or("", |finding| finding.name()),
        state: pair.relation.name(),
        a,
        b,
        distance,
        volume: common.map(|common| common.volume.value),
        volume_lower: common.map(|common| common.volume.lower),
        volume_upper: common.map(|common| common.volume.upper),
        depth: common.map(|common| common.depth),
        x: place.x,
        y: place.y,
        z: place.z,
        unit: clashes.unit.map(|unit| unit::symbol(unit, 1)).unwrap_or_default(),
    }
}
