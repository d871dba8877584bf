//! Whole processes: from two mesh files to the mesh of their intersection in a third, ldi-ops beside other programs.
//!
//! The programs take turns, as in [`process`](crate::process). For ldi-ops the figure is the whole process, reading included.
//! For a peer there are two figures: from arrays in memory to the file, and from files to the file; both exclude the start of
//! Python and the import of modules, but its peak memory includes them.

use std::path::Path;
use std::process::Command;

use serde::Serialize;
use serde_json::json;

use crate::BenchError;
use crate::clock::median;
use crate::machine::Machine;
use crate::models;
use crate::process::{
    PEERS, Plan, Run, number_at, parse_json, said_by, timed, told_by_own_json, write_json, write_models,
};
use crate::table::{Table, count, number};

/// The intersections, by title and files.
const CONTESTS: [(&str, [&str; 2]); 2] =
    [("Gyroid scaffold ∩ bone", ["gyroid", "bone"]), ("Gyroid scaffold ∩ sphere", ["gyroid", "sphere"])];

/// Rays along the longest side.
const RESOLUTIONS: [u32; 2] = [256, 512];

/// Medians of one program, in seconds; its peak memory is the maximum.
#[derive(Clone, Debug, Serialize)]
struct Entry {
    program: String,
    /// Reading and welding the files, building the solids and intersecting them, and writing, if timed separately.
    steps: Option<[f64; 3]>,
    /// Time from files to file.
    whole: f64,
    cpu: f64,
    peak_memory_bytes: u64,
    triangles: u64,
    volume: f64,
}

impl Entry {
    /// Returns the time from arrays in memory to the file; for ldi-ops the whole time.
    fn memory_to_file(&self) -> f64 {
        self.steps.map_or(self.whole, |[_, work, write]| work + write)
    }
}

/// Runs the benchmark and prints the tables.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for the models"))?;
    write_models(folder.path(), "mesh-models")?;
    println!("### Meshes of results\n\n`ldi-bench meshes --runs {} --peer-runs {}`\n", plan.runs, plan.peer_runs);
    let mut contests = Vec::new();
    for (title, [a, b]) in CONTESTS {
        let entries = compete(plan, [a, b], folder.path())?;
        println!("#### {title}\n\n`ldi-ops intersect {a}.stl {b}.stl --mode exact --resolution N -o out.stl`\n");
        println!("{}", table(&entries).markdown());
        contests.push(json!({"a": a, "b": b, "programs": entries}));
    }
    println!(
        "ldi-ops: the whole process from its start to its end, reading included. Peers: steps within one process that has \
         imported all it needs; manifold3d's result is written by trimesh. Memory is that of the whole process.\n"
    );
    let machine = Machine::ask();
    println!("{}", machine.describe());
    write_json(json, &json!({"runs": plan.runs, "machine": machine, "contests": contests}))
}

fn compete(plan: &Plan, names: [&str; 2], folder: &Path) -> Result<Vec<Entry>, BenchError> {
    let files = names.map(|name| models::file(folder, name));
    let out = folder.join("out.stl");
    let own_command = |resolution: u32| {
        let mut command = Command::new(&plan.ldi_ops);
        command.arg("intersect").args(&files).args(["--mode", "exact", "--resolution", &resolution.to_string()]);
        command.arg("-o").arg(&out).arg("--quiet");
        command
    };
    let mut told = Vec::new();
    for resolution in RESOLUTIONS {
        told.push(told_by_own_json(own_command(resolution))?);
    }
    let mut own = RESOLUTIONS.map(|_| Vec::new());
    let mut peers = PEERS.map(|_| Vec::new());
    for _ in 0..plan.runs {
        for (resolution, runs) in RESOLUTIONS.into_iter().zip(&mut own) {
            runs.push(timed(&mut own_command(resolution))?);
        }
        let Some(python) = &plan.python else { continue };
        for (peer, answers) in PEERS.iter().zip(&mut peers) {
            let mut command = Command::new(python);
            command.arg(&plan.peers).arg("--build-and-intersect").args(&files).arg("--write").arg(&out);
            command.args(["--op", "intersection", "--only", peer, "--runs", &plan.peer_runs.to_string()]);
            answers.push(parse_json(python, &said_by(&mut command)?)?);
        }
    }
    let mut entries = Vec::new();
    for ((resolution, runs), told) in RESOLUTIONS.into_iter().zip(&own).zip(&told) {
        let of_runs = |f: fn(&Run) -> f64| median(runs.iter().map(f).collect());
        entries.push(Entry {
            program: format!("ldi-ops, {resolution}"),
            steps: None,
            whole: of_runs(|run| run.seconds),
            cpu: of_runs(|run| run.cpu_seconds),
            peak_memory_bytes: runs.iter().map(|run| run.peak_memory_bytes).max().unwrap_or(0),
            triangles: number_at(told, "/surface/triangles") as u64,
            volume: number_at(told, "/surface/volume"),
        });
    }
    for (peer, answers) in PEERS.iter().zip(&peers).filter(|(_, answers)| !answers.is_empty()) {
        let median_of = |pointers: &[&str]| {
            let sum = |answer| pointers.iter().map(|pointer| number_at(answer, pointer)).sum();
            median(answers.iter().map(sum).collect())
        };
        let read = ["/seconds/read", "/seconds/weld"];
        let work = ["/seconds/build", "/seconds/boolean"];
        let peak = |answer| number_at(answer, "/peak_memory_bytes") as u64;
        entries.push(Entry {
            program: (*peer).to_owned(),
            steps: Some([median_of(&read), median_of(&work), median_of(&["/seconds/write"])]),
            whole: median_of(&[&read[..], &work, &["/seconds/write"]].concat()),
            cpu: f64::NAN,
            peak_memory_bytes: answers.iter().map(peak).max().unwrap_or(0),
            triangles: number_at(&answers[0], "/triangles") as u64,
            volume: number_at(&answers[0], "/volume"),
        });
    }
    Ok(entries)
}

fn table(entries: &[Entry]) -> Table {
    let mut table = Table::new(&[
        "program",
        "read + weld ms",
        "build + intersect ms",
        "write ms",
        "memory to file ms",
        "files to file ms",
        "CPU ms",
        "peak MB",
        "triangles",
        "volume mm³",
        "memory to file / ldi-ops 256",
        "/ ldi-ops 512",
    ]);
    let milliseconds = |seconds: f64| number(1e3 * seconds);
    for (i, entry) in entries.iter().enumerate() {
        let [read, work, write] = entry.steps.unwrap_or([f64::NAN; 3]).map(milliseconds);
        let ratio = |own: &Entry| match i >= RESOLUTIONS.len() {
            true => format!("{} ×", number(entry.memory_to_file() / own.whole)),
            false => "–".to_owned(),
        };
        table.row(vec![
            entry.program.clone(),
            read,
            work,
            write,
            if entry.steps.is_some() { milliseconds(entry.memory_to_file()) } else { "–".to_owned() },
            milliseconds(entry.whole),
            milliseconds(entry.cpu),
            number(1e-6 * entry.peak_memory_bytes as f64),
            count(entry.triangles),
            format!("{:.3}", entry.volume),
            ratio(&entries[0]),
            ratio(&entries[1]),
        ]);
    }
    table
}
