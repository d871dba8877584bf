//! Minkowski sums beside the published ones.

use serde_json::{Value, json};

use super::{Part, Plan};
use crate::BenchError;
use crate::minkowski::{Pair, run_case};
use crate::process::number_at;
use crate::table::{Table, count, number};

/// Adds pairs of solids, as `ldi-bench minkowski` does, on all threads.
pub fn sums(plan: &Plan) -> Result<Part, BenchError> {
    let mut table = Table::new(&[
        "sum",
        "primitives",
        "published",
        "samples",
        "published",
        "retrieve ms",
        "published",
        "images ms",
        "whole ms",
        "volume mm³",
    ]);
    let mut rows = Vec::new();
    for name in &plan.sums {
        let pair = Pair::named(name)?;
        let own = run_case(name, plan.resolution, plan.runs, None)?;
        let published = pair.published.as_ref();
        let or_dash = |value: Option<u64>| value.map_or("–".to_owned(), count);
        let ms = |part: &str| number(1e3 * number_at(&own, &format!("/seconds/{part}")));
        let samples: u64 = own["samples"].as_array().into_iter().flatten().filter_map(Value::as_u64).sum();
        table.row(vec![
            pair.title.to_owned(),
            count(number_at(&own, "/pairs/distinct") as u64),
            or_dash(published.map(|p| p.primitives)),
            count(samples),
            or_dash(published.and_then(|p| p.samples)),
            ms("retrieve"),
            published.map_or("–".to_owned(), |p| number(1e3 * p.retrieval)),
            ms("images"),
            ms("whole"),
            format!("{:.3}", number_at(&own, "/volume")),
        ]);
        rows.push(own);
    }
    Ok(Part {
        name: "sums",
        title: "Minkowski sums".to_owned(),
        markdown: table.markdown(),
        text: "All threads. The published time is the sampling of the flooded volume alone, without culling and flooding: to be \
               held against retrieve. `ldi-bench minkowski` has all stages, and each sum in a process of its own."
            .to_owned(),
        rows: json!(rows),
        plots: Vec::new(),
    })
}
