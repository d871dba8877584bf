//! The comparison of parts for programs: the JSON object.

use glam::DVec3;
use serde::Serialize;

use crate::Warning;
use crate::driver::clash::rules::Finding;
use crate::driver::clash::{ClashSeconds, Clashes, Common, Overlap, Pair, Relation};
use crate::driver::machine;
use crate::mesh::Aabb;
use crate::unit;

/// The object of a comparison. Lengths are in the unit of the parts; non-finite numbers are null.
#[derive(Serialize)]
pub struct Record<'c> {
    schema: &'static str,
    command: &'static str,
    unit: Option<String>,
    clearance: Option<f64>,
    passed: bool,
    counts: Counts,
    parts: Vec<PartRecord<'c>>,
    pairs: Vec<PairRecord<'c>>,
    seconds: ClashSeconds,
    peak_memory_bytes: Option<u64>,
    warnings: &'c [Warning],
}

#[derive(Serialize)]
struct Counts {
    parts: usize,
    triangles: usize,
    possible_pairs: usize,
    near_pairs: usize,
    ignored_pairs: usize,
    findings: usize,
}

#[derive(Serialize)]
struct PartRecord<'c> {
    name: &'c str,
    path: String,
    triangles: usize,
    volume: f64,
    bounds: BoxRecord,
}

#[derive(Serialize)]
struct BoxRecord {
    min: [f64; 3],
    max: [f64; 3],
}

#[derive(Serialize)]
struct PairRecord<'c> {
    a: &'c str,
    b: &'c str,
    /// The numbers of the parts in `parts`.
    parts: [usize; 2],
    state: &'static str,
    finding: Option<Finding>,
    /// Null where the parts overlap.
    distance: Option<f64>,
    /// The depth of an overlap that counts as touching; null unless the parts touch.
    depth: Option<DepthRecord>,
    /// The nearest points.
    points: Option<[[f64; 3]; 2]>,
    /// Null unless the parts overlap.
    overlap: Option<OverlapRecord<'c>>,
}

#[derive(Serialize)]
struct OverlapRecord<'c> {
    volume: Overlap,
    bounds: BoxRecord,
    deepest: [f64; 3],
    depth: DepthRecord,
    /// The name of the part that lies wholly in the other.
    contained: Option<&'c str>,
    certain: bool,
}

#[derive(Serialize)]
struct DepthRecord {
    lower: f64,
    upper: f64,
}

impl From<Aabb> for BoxRecord {
    fn from(bounds: Aabb) -> BoxRecord {
        BoxRecord { min: bounds.min.to_array(), max: bounds.max.to_array() }
    }
}

/// Returns the object of a comparison.
pub fn record(clashes: &Clashes) -> Record<'_> {
    let findings = clashes.findings().count();
    let parts = clashes.parts.iter().map(|part| PartRecord {
        name: &part.name,
        path: part.path.display().to_string(),
        triangles: part.solid.mesh().triangles.len(),
        volume: part.solid.volume,
        bounds: part.solid.bounds().into(),
    });
    Record {
        schema: "ldi-ops/1",
        command: "clash",
        unit: clashes.unit.map(|unit| unit::symbol(unit, 1)),
        clearance: clashes.clearance,
        passed: findings == 0,
        counts: Counts {
            parts: clashes.parts.len(),
            triangles: clashes.parts.iter().map(|part| part.solid.mesh().triangles.len()).sum(),
            possible_pairs: clashes.possible_pairs(),
            near_pairs: clashes.pairs.len() + clashes.ignored,
            ignored_pairs: clashes.ignored,
            findings,
        },
        parts: parts.collect(),
        pairs: clashes.pairs.iter().map(|pair| pair_record(clashes, pair)).collect(),
        seconds: clashes.seconds,
        peak_memory_bytes: machine::peak_memory_bytes(),
        warnings: &clashes.warnings,
    }
}

fn pair_record<'c>(clashes: &'c Clashes, pair: &Pair) -> PairRecord<'c> {
    let names = pair.parts.map(|part| clashes.parts[part].name.as_str());
    let apart = |distance, points: [DVec3; 2]| (Some(distance), Some(points.map(|point| point.to_array())));
    let ((distance, points), depth, overlap) = match pair.relation {
        Relation::Separate { distance, points } => (apart(distance, points), None, None),
        Relation::Touching { distance, depth_bound: upper, points } => {
            (apart(distance, points), Some(DepthRecord { lower: 0.0, upper }), None)
        }

        Relation::Overlapping(common) => ((None, None), None, Some(overlap_record(common, names))),
    };
    let [a, b] = names;
    PairRecord {
        a,
        b,
        parts: pair.parts,
        state: pair.relation.name(),
        finding: pair.finding,
        distance,
        depth,
        points,
        overlap,
    }
}

fn overlap_record<'c>(common: Common, names: [&'c str; 2]) -> OverlapRecord<'c> {
    OverlapRecord {
        volume: common.volume,
        bounds: common.bounds.into(),
        deepest: common.deepest.to_array(),
        depth: DepthRecord { lower: common.depth, upper: common.depth_bound },
        contained: common.contained.map(|place| names[place]),
        certain: common.is_certain,
    }
}

/// Returns the text of the object, with line breaks.
pub fn json(clashes: &Clashes) -> String {
    let text = serde_json::to_string_pretty(&record(clashes));
    text.expect("a record has no keys but texts and no serialiser that fails") + "\n"
}
