//! Whole processes: from two mesh files to the volume of their intersection, ldi-ops beside other programs.
//!
//! The programs take turns, so that a slow spell of the machine affects all of them. For ldi-ops the figure is the whole
//! process, from its start to its end. For a peer it is only its own steps, without the start of Python: reading and welding
//! the files, and, stated separately, building and intersecting its solids.

use std::ffi::OsStr;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use serde::Serialize;
use serde_json::{Value, json};

use crate::BenchError;
use crate::clock::median;
use crate::machine::{self, Machine};
use crate::models;
use crate::table::{Table, number};

/// The settings of a run.
pub struct Plan {
    /// The command line program.
    pub ldi_ops: PathBuf,
    /// A Python with the peers.
    pub python: Option<PathBuf>,
    /// The program that times the peers.
    pub peers: PathBuf,
    /// Number of rounds.
    pub runs: usize,
    /// Runs of a peer within its process.
    pub peer_runs: usize,
}

/// Names of the peers in the program that times them.
const PEERS: [&str; 2] = ["manifold3d", "trueform"];

/// A comparison.
struct Contest {
    title: &'static str,
    a: &'static str,
    b: &'static str,
}

const CONTESTS: [Contest; 2] = [
    Contest { title: "Gyroid scaffold ∩ bone", a: "gyroid", b: "bone" },
    Contest { title: "Strut lattice ∩ the same lattice, shifted", a: "lattice", b: "lattice-shifted" },
];

/// The flags of ldi-ops in every comparison; they follow the files.
const FLAGS: [&str; 7] = ["--estimate", "--axis", "z", "--resolution", "512", "--mode", "exact"];

/// The cost of a process.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// Time from its start to its end.
    pub seconds: f64,
    /// Time of all processors together.
    pub cpu_seconds: f64,
    /// Peak memory.
    pub peak_memory_bytes: u64,
}

/// Medians of one program, in seconds; for a peer by step. Peak memory is that of one run or the maximum of all.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// Its name.
    pub program: String,
    /// Reading and welding the files, if timed separately.
    pub prepare: Option<f64>,
    /// Building the solids and intersecting them, if timed separately.
    pub work: Option<f64>,
    /// Writing the result, if timed separately.
    pub write: Option<f64>,
    /// The whole time.
    pub whole: f64,
    /// Time of all processors together; for a peer that of its steps.
    pub cpu: f64,
    /// Peak memory.
    pub peak_memory_bytes: u64,
    /// The volume of the result.
    pub volume: f64,
    /// The number of triangles of the result; 0 for ldi-ops where it writes no mesh.
    pub triangles: u64,
}

/// Runs the benchmark and prints the tables.
pub fn run(plan: &Plan, json: Option<&Path>) -> Result<(), BenchError> {
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for the models"))?;
    write_models(folder.path(), "models")?;
    let load_before = machine::load();
    let mut contests = Vec::new();
    println!("### Whole processes\n\n`ldi-bench process --runs {} --peer-runs {}`\n", plan.runs, plan.peer_runs);
    for contest in &CONTESTS {
        let files = [contest.a, contest.b].map(|name| models::file(folder.path(), name));
        let (entries, _) = compete(plan, &files, (&FLAGS, None), &PEERS)?;
        print_contest(contest, &entries);
        contests.push(json!({"a": contest.a, "b": contest.b, "programs": entries}));
    }
    let large = large_images(plan, folder.path())?;
    let machine = Machine::ask_after(load_before);
    println!("{}", machine.describe());
    write_json(json, &json!({"runs": plan.runs, "machine": machine, "contests": contests, "large_images": large}))
}

/// Builds the models in another process, by this program's command of that name, so that this process stays small.
pub fn write_models(folder: &Path, models: &str) -> Result<(), BenchError> {
    let own = std::env::current_exe().map_err(BenchError::io("finding this program"))?;
    let mut command = Command::new(own);
    command.arg(models).arg(folder);
    said_by(&mut command).map(drop)
}

/// Intersects two files by ldi-ops with the given flags, and by peers, in turn; all write the mesh of the result if there is a file
/// for it. Returns the costs, those of ldi-ops first, and the JSON of ldi-ops.
pub fn compete(
    plan: &Plan,
    files: &[PathBuf; 2],
    (flags, out): (&[&str], Option<&Path>),
    peers: &[&str],
) -> Result<(Vec<Entry>, Value), BenchError> {
    let own_command = || {
        let mut command = Command::new(&plan.ldi_ops);
        command.arg("intersect").args(files).args(flags).arg("--quiet");
        command.args(out.iter().flat_map(|out| [OsStr::new("-o"), out.as_os_str()]));
        command
    };
    // This run also brings the files into the system's cache.
    let told = told_by_own_json(own_command())?;
    let mut own = Vec::new();
    let mut answers = vec![Vec::new(); peers.len()];
    for _ in 0..plan.runs {
        own.push(timed(&mut own_command())?);
        let Some(python) = &plan.python else { continue };
        for (peer, answers) in peers.iter().zip(&mut answers) {
            let mut command = Command::new(python);
            command.arg(&plan.peers).arg("--build-and-intersect").args(files);
            command.args(["--op", "intersection", "--only", peer, "--runs", &plan.peer_runs.to_string()]);
            command.args(out.iter().flat_map(|out| [OsStr::new("--write"), out.as_os_str()]));
            answers.push(parse_json(python, &said_by(&mut command)?)?);
        }
    }
    let of_own = |f: fn(&Run) -> f64| median(own.iter().map(f).collect());
    let mut entries = vec![Entry {
        program: "ldi-ops".to_owned(),
        prepare: None,
        work: None,
        write: None,
        whole: of_own(|run| run.seconds),
        cpu: of_own(|run| run.cpu_seconds),
        peak_memory_bytes: own.iter().map(|run| run.peak_memory_bytes).max().unwrap_or(0),
        volume: number_at(&told, "/volume/value"),
        triangles: number_at(&told, "/surface/triangles") as u64,
    }];
    // The time of a mesh excludes the volume.
    let last = if out.is_some() { "write" } else { "volume" };
    for (peer, answers) in peers.iter().zip(&answers).filter(|(_, answers)| !answers.is_empty()) {
        let steps = |names: &[&str]| {
            let sum = |answer: &Value| names.iter().map(|name| number_at(answer, &format!("/seconds/{name}"))).sum();
            median(answers.iter().map(sum).collect())
        };
        entries.push(Entry {
            program: (*peer).to_owned(),
            prepare: Some(steps(&["read", "weld"])),
            work: Some(steps(&["build", "boolean"])),
            write: out.map(|_| steps(&["write"])),
            whole: steps(&["read", "weld", "build", "boolean", last]),
            cpu: median(answers.iter().map(|answer| number_at(answer, "/cpu_seconds")).collect()),
            peak_memory_bytes: number_at(&answers[0], "/peak_memory_bytes") as u64,
            volume: number_at(&answers[0], "/volume"),
            triangles: number_at(&answers[0], "/triangles") as u64,
        });
    }
    Ok((entries, told))
}

/// Returns the table of the programs' costs, that of ldi-ops first, with columns of their results.
pub fn table(entries: &[Entry], names: &[&str], results: impl Fn(&Entry) -> Vec<String>) -> Table {
    let costs = ["program", "read + weld ms", "build + intersect ms", "whole ms", "CPU ms", "peak MB"];
    let ratios = ["build + intersect / ldi-ops whole", "whole / ldi-ops whole"];
    let mut table = Table::new(&[&costs[..], names, &ratios[..]].concat());
    let own = &entries[0];
    for (i, entry) in entries.iter().enumerate() {
        let ratio = |seconds: Option<f64>| match seconds {
            Some(seconds) if i > 0 => format!("{} ×", number(seconds / own.whole)),
            _ => "–".to_owned(),
        };
        let milliseconds = |seconds: Option<f64>| number(1e3 * seconds.unwrap_or(f64::NAN));
        let mut row = vec![
            entry.program.clone(),
            milliseconds(entry.prepare),
            milliseconds(entry.work),
            milliseconds(Some(entry.whole)),
            milliseconds(Some(entry.cpu)),
            number(1e-6 * entry.peak_memory_bytes as f64),
        ];
        row.extend(results(entry));
        row.extend([ratio(entry.work), ratio(Some(entry.whole))]);
        table.row(row);
    }
    table
}

fn print_contest(contest: &Contest, entries: &[Entry]) {
    let table = table(entries, &["volume mm³"], |entry| vec![format!("{:.3}", entry.volume)]);
    println!("#### {}\n\n`ldi-ops intersect {}.stl {}.stl {}`\n", contest.title, contest.a, contest.b, FLAGS.join(" "));
    println!("{}", table.markdown());
    println!(
        "ldi-ops: the whole process from its start to its end. Peers: their steps within one process, Python's own start \
         not counted.\n"
    );
}

/// Measures the peak memory of images of 2048 × 2048 rays.
fn large_images(plan: &Plan, folder: &Path) -> Result<Vec<Value>, BenchError> {
    let file = |name: &str| models::file(folder, name).display().to_string();
    let (gyroid, shifted, bone) = (file("gyroid"), file("gyroid-shifted"), file("bone"));
    let jobs: [&[&str]; 6] = [
        &["volume", &gyroid, "--mode", "exact"],
        &["volume", &gyroid, "--mode", "over"],
        &["intersect", &gyroid, &bone, "--mode", "exact"],
        &["intersect", &gyroid, &shifted, "--mode", "exact"],
        &["intersect", &gyroid, &shifted, "--mode", "over"],
        &["union", &gyroid, &shifted, "--mode", "exact"],
    ];
    let mut table = Table::new(&["command", "rays", "samples", "ms", "CPU ms", "peak MB"]);
    let mut results = Vec::new();
    for job in jobs {
        let command = || {
            let mut command = Command::new(&plan.ldi_ops);
            command.args(job).args(["--estimate", "--axis", "z", "--resolution", "2048", "--quiet"]);
            command
        };
        let told = told_by_own_json(command())?;
        let runs = (0..plan.runs).map(|_| timed(&mut command())).collect::<Result<Vec<_>, _>>()?;
        let of_runs = |f: fn(&Run) -> f64| median(runs.iter().map(f).collect());
        let (seconds, cpu) = (of_runs(|run| run.seconds), of_runs(|run| run.cpu_seconds));
        let peak = runs.iter().map(|run| run.peak_memory_bytes).max().unwrap_or(0);
        let rays = told.pointer("/grid/rays").cloned().unwrap_or_default();
        let named: Vec<String> = job
            .iter()
            .map(|word| Path::new(word).file_name().map_or(word.to_string(), |n| n.to_string_lossy().into()))
            .collect();
        let named = named.join(" ");
        table.row(vec![
            format!("`{named} --axis z --resolution 2048`"),
            rays.to_string().replace(',', " × ").trim_matches(['[', ']']).to_owned(),
            number(number_at(&told, "/samples")),
            number(1e3 * seconds),
            number(1e3 * cpu),
            number(1e-6 * peak as f64),
        ]);
        results.push(json!({"command": named, "rays": rays, "samples": told.pointer("/samples"),
            "seconds": seconds, "cpu_seconds": cpu, "peak_memory_bytes": peak}));
    }
    println!("#### Memory of large images\n\n{}", table.markdown());
    Ok(results)
}

/// Returns the JSON output of ldi-ops, from an untimed run: hashing the inputs for it costs time.
pub fn told_by_own_json(mut command: Command) -> Result<Value, BenchError> {
    command.args(["--json", "-"]);
    let said = said_by(&mut command)?;
    let told = parse_json(Path::new("ldi-ops"), &said)?;
    // A list has one entry per file.
    Ok(match told {
        Value::Array(mut list) if !list.is_empty() => list.swap_remove(0),
        told => told,
    })
}

/// Parses the JSON output of a program.
pub fn parse_json(program: &Path, text: &str) -> Result<Value, BenchError> {
    serde_json::from_str(text).map_err(|error| BenchError::Program {
        program: program.display().to_string(),
        said: format!("{error} in {text}"),
    })
}

/// Returns a number of a document; zero for a step that a program does not have.
pub fn number_at(document: &Value, pointer: &str) -> f64 {
    document.pointer(pointer).and_then(Value::as_f64).unwrap_or(0.0)
}

/// Runs a program to its end and returns its stdout.
pub fn said_by(command: &mut Command) -> Result<String, BenchError> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(BenchError::io(format!("running {program}")))?;
    if !output.status.success() {
        let said = format!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim());
        return Err(BenchError::Program { program, said });
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// Runs a program to its end, discards its output, and asks the system for its costs.
#[cfg(unix)]
pub fn timed(command: &mut Command) -> Result<Run, BenchError> {
    let program = command.get_program().to_string_lossy().into_owned();
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let start = Instant::now();
    let child = command.spawn().map_err(BenchError::io(format!("running {program}")))?;
    // SAFETY: all zero bytes are a valid value of this plain C structure.
    let mut usage: libc::rusage = unsafe { std::mem::zeroed() };
    let mut status = 0;
    // The standard library's wait would not report resource usage. Nothing else waits for the child.
    // SAFETY: the pointers are to live values of the types that the call fills, and the process is a child of this one.
    let waited = unsafe { libc::wait4(child.id() as libc::pid_t, &mut status, 0, &mut usage) };
    let seconds = start.elapsed().as_secs_f64();
    if waited < 0 {
        return Err(BenchError::io(format!("waiting for {program}"))(std::io::Error::last_os_error()));
    }
    if status != 0 {
        return Err(BenchError::Program { program, said: format!("ended with wait status {status}") });
    }
    let time = |t: libc::timeval| t.tv_sec as f64 + 1e-6 * t.tv_usec as f64;
    // The unit is kibibytes, but bytes on macOS.
    let unit = if cfg!(target_os = "macos") { 1 } else { 1024 };
    Ok(Run {
        seconds,
        cpu_seconds: time(usage.ru_utime) + time(usage.ru_stime),
        peak_memory_bytes: usage.ru_maxrss as u64 * unit,
    })
}

/// Runs a program to its end and discards its output; memory and processor time are unknown.
#[cfg(not(unix))]
pub fn timed(command: &mut Command) -> Result<Run, BenchError> {
    let program = command.get_program().to_string_lossy().into_owned();
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let start = Instant::now();
    let status = command.status().map_err(BenchError::io(format!("running {program}")))?;
    let seconds = start.elapsed().as_secs_f64();
    if !status.success() {
        return Err(BenchError::Program { program, said: status.to_string() });
    }
    Ok(Run { seconds, cpu_seconds: f64::NAN, peak_memory_bytes: 0 })
}

/// Writes a document if there is a path.
pub fn write_json(path: Option<&Path>, document: &Value) -> Result<(), BenchError> {
    let Some(path) = path else { return Ok(()) };
    let file = File::create(path).map_err(BenchError::io(path.display().to_string()))?;
    serde_json::to_writer_pretty(BufWriter::new(file), document)
        .map_err(|error| BenchError::io(path.display().to_string())(error.into()))
}
