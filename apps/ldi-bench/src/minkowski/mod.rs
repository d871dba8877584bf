//! Minkowski sums by stages, on pairs like those of Table IV of Leung and Wang, beside manifold3d.
//!
//! Each sum runs in its own process, by the very call of the command line. Its solids are built and checked before the clock
//! starts. The stages end with three exact images; the whole also checks the orientation of the solids and makes the coarser
//! rasters of the error estimate. manifold3d begins with arrays in memory and ends with a mesh; its
//! sum is wrong if the second solid is not convex, and is still timed if it ends in time.

mod case;
mod pairs;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

use case::STAGES;
pub use case::run as run_case;
use pairs::PAIRS;
pub use pairs::Pair;

use crate::BenchError;
use crate::machine::Machine;
use crate::models;
use crate::process::{number_at, parse_json, said_by, write_json};
use crate::table::{Table, count, number};

/// The settings of a run.
pub struct Plan {
    /// Names of pairs; all pairs if empty.
    pub pairs: Vec<String>,
    /// Rays along the longest side of the sum.
    pub resolution: u32,
    /// Timed rounds of each sum.
    pub runs: usize,
    /// The adapter that samples and resolves gaps; the CPU if `None`.
    pub adapter: Option<String>,
    /// A Python with manifold3d; without it ldi-ops runs alone.
    pub python: Option<PathBuf>,
    /// The program that times manifold3d.
    pub peers: PathBuf,
    /// Seconds after which a peer is aborted.
    pub peer_timeout: u32,
}

/// A pair with its measurements.
struct Row {
    pair: &'static Pair,
    own: Value,
    /// The measurements of manifold3d, or the reason why there are none.
    peer: Value,
}

/// Runs the benchmark and prints the tables.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    let chosen: Vec<&Pair> = match plan.pairs.is_empty() {
        true => PAIRS.iter().collect(),
        false => plan.pairs.iter().map(|name| Pair::named(name)).collect::<Result<_, _>>()?,
    };
    let machine = Machine::ask();
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for the models"))?;
    let mut rows = Vec::new();
    for pair in chosen {
        let own = own(plan, pair)?;
        let peer = match &plan.python {
            Some(python) => peer(plan, python, pair, folder.path())?,
            None => Value::Null,
        };
        rows.push(Row { pair, own, peer });
    }
    let adapter = plan.adapter.as_ref().map_or(String::new(), |adapter| format!(" --adapter '{adapter}'"));
    println!(
        "### Minkowski sums\n\n`ldi-bench minkowski --resolution {} --runs {}{adapter}`\n",
        plan.resolution, plan.runs
    );
    println!("{}", primitives(&rows).markdown());
    println!("{}", stages(&rows).markdown());
    println!("{}", contest(&rows).markdown());
    println!(
        "Published: Leung and Wang on a GeForce GTX 580, the sampling of the flooded volume alone; to be held against \
         retrieve. Samples are those of three images.\n"
    );
    println!("{}", machine.describe());
    let results: Vec<Value> = rows.iter().map(|row| json!({"own": row.own, "manifold3d": row.peer})).collect();
    write_json(json, &json!({"resolution": plan.resolution, "runs": plan.runs, "machine": machine, "sums": results}))
}

/// Runs the sum of a pair in another process of this program.
fn own(plan: &Plan, pair: &Pair) -> Result<Value, BenchError> {
    let program = std::env::current_exe().map_err(BenchError::io("finding this program"))?;
    let mut command = Command::new(&program);
    command.args(["minkowski-case", pair.name]);
    command.args(["--resolution", &plan.resolution.to_string(), "--runs", &plan.runs.to_string()]);
    command.args(plan.adapter.iter().flat_map(|adapter| ["--adapter", adapter.as_str()]));
    parse_json(&program, &said_by(&mut command)?)
}

/// Runs manifold3d on a pair; returns its entry among the results of the program that times it.
fn peer(plan: &Plan, python: &Path, pair: &Pair, folder: &Path) -> Result<Value, BenchError> {
    pair.write(folder)?;
    let mut command = Command::new(python);
    command.arg(&plan.peers).arg("--build-and-intersect");
    command.args(["a", "b"].map(|side| models::file(folder, &format!("{}-{side}", pair.name))));
    command.args(["--op", "minkowski_sum", "--peers", "manifold3d", "--runs", "1", "--json", "-"]);
    command.args(["--timeout", &plan.peer_timeout.to_string()]);
    let told = parse_json(python, &said_by(&mut command)?)?;
    let entry = told.pointer("/results/0").cloned();
    entry.ok_or_else(|| BenchError::Program { program: plan.peers.display().to_string(), said: told.to_string() })
}

fn count_at(row: &Row, pointer: &str) -> String {
    count(number_at(&row.own, pointer) as u64)
}

fn total(row: &Row, pointer: &str) -> u64 {
    (0..3).map(|axis| number_at(&row.own, &format!("{pointer}/{axis}")) as u64).sum()
}

fn primitives(rows: &[Row]) -> Table {
    let mut table = Table::new(&[
        "sum",
        "triangles of A",
        "of B",
        "candidate pairs",
        "visited",
        "kept",
        "primitives",
        "published",
        "triangles sampled",
        "crossings",
        "gaps",
        "tested",
        "samples",
        "published",
    ]);
    for row in rows {
        let published = |of: fn(&pairs::Published) -> Option<u64>| {
            row.pair.published.as_ref().and_then(of).map_or("–".to_owned(), count)
        };
        table.row(vec![
            row.pair.title.to_owned(),
            count_at(row, "/triangles/0"),
            count_at(row, "/triangles/1"),
            count_at(row, "/pairs/candidates"),
            count_at(row, "/pairs/visited"),
            count_at(row, "/pairs/kept"),
            count_at(row, "/pairs/distinct"),
            published(|p| Some(p.primitives)),
            count_at(row, "/triangles_sampled"),
            count(total(row, "/crossings")),
            count_at(row, "/gaps"),
            count_at(row, "/gaps_tested"),
            count(total(row, "/samples")),
            published(|p| p.samples),
        ]);
    }
    table
}

fn stages(rows: &[Row]) -> Table {
    let names: Vec<String> = STAGES.iter().map(|stage| format!("{} ms", stage.replace('_', " "))).collect();
    let mut heads = vec!["sum"];
    heads.extend(names.iter().map(String::as_str));
    heads.extend(["published", "images ms", "whole ms", "peak MB"]);
    let mut table = Table::new(&heads);
    for row in rows {
        let mut cells = vec![row.pair.title.to_owned()];
        cells.extend(STAGES.iter().map(|stage| number(1e3 * number_at(&row.own, &format!("/seconds/{stage}")))));
        cells.push(row.pair.published.as_ref().map_or("–".to_owned(), |p| number(1e3 * p.retrieval)));
        cells.extend(["images", "whole"].map(|part| number(1e3 * number_at(&row.own, &format!("/seconds/{part}")))));
        cells.push(number(1e-6 * number_at(&row.own, "/peak_memory_bytes")));
        table.row(cells);
    }
    table
}

fn contest(rows: &[Row]) -> Table {
    let mut table = Table::new(&["sum", "volume mm³", "manifold3d", "is right", "s", "peak MB", "/ ldi-ops whole"]);
    for row in rows {
        let has_figures = row.peer.pointer("/seconds").is_some();
        let cell = |text: String| if has_figures { text } else { "–".to_owned() };
        let seconds = number_at(&row.peer, "/seconds/build") + number_at(&row.peer, "/seconds/boolean");
        let is_right = row.peer.pointer("/b_convex").and_then(Value::as_bool).unwrap_or(false);
        let refused = row.peer.pointer("/refused").and_then(Value::as_str).unwrap_or("not run");
        table.row(vec![
            row.pair.title.to_owned(),
            format!("{:.3}", number_at(&row.own, "/volume")),
            if has_figures { format!("{:.3}", number_at(&row.peer, "/volume")) } else { refused.to_owned() },
            cell(if is_right { "yes" } else { "no: B is not convex" }.to_owned()),
            cell(number(seconds)),
            cell(number(1e-6 * number_at(&row.peer, "/peak_memory_bytes"))),
            cell(format!("{} ×", number(seconds / number_at(&row.own, "/seconds/whole")))),
        ]);
    }
    table
}
