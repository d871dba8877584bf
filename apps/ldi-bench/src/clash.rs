//! The whole process of `clash` on an assembly of bolts, plates and lattices, from files to a verdict.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use ldi_ops::mesh::{LengthUnit, TriangleMesh, io};
use serde_json::{Value, json};

use crate::BenchError;
use crate::clock::median;
use crate::machine::Machine;
use crate::models;
use crate::process::write_json;
use crate::table::{Table, number};

/// The description of a benchmark.
pub struct Plan {
    /// The program.
    pub ldi_ops: PathBuf,
    /// Number of parts.
    pub parts: usize,
    /// Number of runs; medians are printed.
    pub runs: usize,
}

/// Number of parts of a cell of the assembly: a plate, a lattice below it and bolts through the plate.
const PARTS_OF_CELL: usize = 25;

/// The side of a cell, in millimetres.
const CELL: f64 = 12.0;

/// Writes the files of the assembly and its list to a folder.
///
/// The cells stand in a square. Plates touch their neighbours and rest on their lattices, every second bolt, a ball,
/// overlaps its plate, and the others keep a distance.
fn write_assembly(folder: &Path, parts: usize) -> Result<PathBuf, BenchError> {
    let write = |name: &str, mesh: &TriangleMesh| {
        io::write(&folder.join(name), mesh, Some(LengthUnit::Millimetre))
            .map(drop)
            .map_err(|error| BenchError::model(name, error))
    };
    write("bolt.stl", &models::build("geodesic", &[("radius", "0.8"), ("frequency", "8")])?)?;
    write("plate.stl", &models::build("cuboid", &[("min", "0,0,0"), ("max", "12,12,1")])?)?;
    write(
        "lattice.stl",
        &models::build("bcc", &[("cells", "2"), ("cell-size", "5"), ("radius", "0.6"), ("resolution", "22")])?,
    )?;
    let across = (parts.div_ceil(PARTS_OF_CELL) as f64).sqrt().ceil() as usize;
    let mut list = String::new();
    for part in 0..parts {
        let (cell, place) = (part / PARTS_OF_CELL, part % PARTS_OF_CELL);
        let [x, y] = [cell % across, cell / across].map(|i| CELL * i as f64);
        let (file, x, y, z) = match place {
            0 => ("plate", x, y, 10.0),
            1 => ("lattice", x + 0.5 * CELL, y + 0.5 * CELL, 5.0),
            bolt => {
                let (column, row) = ((bolt - 2) % 5, (bolt - 2) / 5);
                let z = if bolt % 2 == 0 { 11.5 } else { 12.5 };
                ("bolt", x + 2.0 * (1 + column) as f64, y + 2.0 * (1 + row) as f64, z)
            }
        };
        list += &format!("[[part]]\nfile = \"{file}.stl\"\ntransform = \"translate({x},{y},{z})\"\n");
    }
    let path = folder.join("assembly.toml");
    fs::write(&path, list).map_err(BenchError::io("the list of parts"))?;
    Ok(path)
}

/// Runs the benchmark.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    let machine = Machine::ask();
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for the parts"))?;
    let list = write_assembly(folder.path(), plan.parts)?;
    let results = (0..plan.runs).map(|_| run_once(plan, &list)).collect::<Result<Vec<_>, _>>()?;
    let of = |key: &str| {
        median(results.iter().map(|(_, result)| result["seconds"][key].as_f64().unwrap_or(f64::NAN)).collect())
    };
    let last = &results[results.len() - 1].1;
    let mut table =
        Table::new(&["parts", "triangles", "near pairs", "findings", "read s", "compare s", "whole s", "peak MB"]);
    let count = |key: &str| last["counts"][key].to_string();
    table.row(vec![
        count("parts"),
        count("triangles"),
        count("near_pairs"),
        count("findings"),
        number(of("read")),
        number(of("compare")),
        number(median(results.iter().map(|(seconds, _)| *seconds).collect())),
        number(last["peak_memory_bytes"].as_f64().unwrap_or(f64::NAN) / 1e6),
    ]);
    println!("### Clashes of an assembly\n\n`ldi-bench clash --parts {} --runs {}`\n", plan.parts, plan.runs);
    println!("{}\n{}", table.markdown(), machine.describe());
    let runs: Vec<Value> = results
        .iter()
        .map(|(seconds, result)| {
            json!({ "whole_seconds": seconds, "seconds": result["seconds"], "peak_memory_bytes": result["peak_memory_bytes"] })
        })
        .collect();
    write_json(json, &json!({ "machine": machine, "counts": last["counts"], "runs": runs }))
}

/// Runs the program once; returns the time of the process and its JSON.
fn run_once(plan: &Plan, list: &Path) -> Result<(f64, Value), BenchError> {
    let start = Instant::now();
    let output = Command::new(&plan.ldi_ops)
        .args(["clash", "--clearance", "0.5", "--json", "-", "--quiet", "--assembly"])
        .arg(list)
        .output()
        .map_err(BenchError::io(plan.ldi_ops.display().to_string()))?;
    let seconds = start.elapsed().as_secs_f64();
    let said = |said: String| BenchError::Program { program: plan.ldi_ops.display().to_string(), said };
    match serde_json::from_slice::<Value>(&output.stdout) {
        Ok(result) if result["counts"].is_object() => Ok((seconds, result)),
        _ => Err(said(String::from_utf8_lossy(&output.stderr).into_owned())),
    }
}
