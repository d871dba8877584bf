//! Time to a volume of a given accuracy: ldi-ops beside programs that compute the mesh of an intersection, and programs of
//! voxels, on six pairs of solids.
//!
//! The true volumes are the exact ones of ldi-ops, which the programs of meshes confirm beside. An image or an array of voxels
//! may come near the true volume by chance. So a raster of ldi-ops counts as accurate only if the next two finer ones are too;
//! for programs of voxels the first one counts, which favours them. The programs take turns.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde::Serialize;
use serde_json::json;

use crate::BenchError;
use crate::clock::median;
use crate::machine::{self, Machine};
use crate::models;
use crate::process::{Plan, Run, number_at, parse_json, said_by, timed, told_by_own_json, write_json, write_models};
use crate::table::{Table, number};

/// The intersections, by title and files.
const PAIRS: [(&str, [&str; 2]); 6] = [
    ("Gyroid scaffold ∩ bone", ["gyroid", "bone"]),
    ("Geodesic frame ∩ organic solid", ["geodesic", "organic"]),
    ("Brush ∩ chain mail", ["brush", "chain"]),
    ("Strut lattice ∩ the same lattice, shifted", ["lattice", "lattice-shifted"]),
    ("Gyroid scaffold ∩ strut lattice", ["gyroid", "lattice"]),
    ("Strut lattice ∩ bone", ["lattice", "bone"]),
];

/// Relative errors of the volume.
const TOLERANCES: [f64; 2] = [1e-3, 1e-4];

/// Programs that compute meshes.
const OF_MESHES: [&str; 5] = ["manifold3d", "trueform", "trueform-f64", "meshlib", "cgal"];

/// Programs of voxels.
const OF_VOXELS: [&str; 3] = ["open3d", "vtk", "picopie"];

/// Rays or voxels along the longest side that are tried.
const RESOLUTIONS: [u32; 12] = [32, 45, 64, 91, 128, 181, 256, 362, 512, 724, 1024, 1448];

/// Rasters that have to be accurate for the first of them to count.
const IN_A_ROW: usize = 3;

/// Seconds after which a peer is given up.
const LIMIT: u32 = 20;

/// A program with settings that reach an accuracy.
#[derive(Serialize)]
struct Competitor {
    program: String,
    /// The flags of ldi-ops after its files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    flags: Vec<String>,
    /// The name of a peer.
    #[serde(skip_serializing_if = "Option::is_none")]
    peer: Option<&'static str>,
    /// Voxels of a peer along the longest side.
    #[serde(skip_serializing_if = "Option::is_none")]
    resolution: Option<u32>,
    /// Of the volume, relative to the exact one.
    error: f64,
    runs: Vec<Run>,
}

/// A peer that does not reach an accuracy, and why.
#[derive(Serialize)]
struct Absent {
    program: String,
    reason: String,
}

/// Runs the benchmark, on the pairs that have a file of one of the names if there are any, and prints the tables.
pub fn run(plan: &Plan, only: &[String], json: Option<&Path>) -> Result<(), BenchError> {
    let is_wanted =
        |files: &[&str; 2]| only.is_empty() || files.iter().any(|file| only.iter().any(|name| name == file));
    let wanted: Vec<_> = PAIRS.into_iter().filter(|(_, files)| is_wanted(files)).collect();
    if wanted.is_empty() {
        let names: Vec<String> = PAIRS.iter().map(|(_, files)| files.join(" and ")).collect();
        return Err(BenchError::model(&only.join(", "), format!("no such file; the pairs are {}", names.join(", "))));
    }
    let folder = tempfile::tempdir().map_err(BenchError::io("a folder for the models"))?;
    write_models(folder.path(), "exact-models")?;
    let load_before = machine::load();
    println!("### Time to a volume of a given accuracy\n\n`ldi-bench peers --runs {}`\n", plan.runs);
    let mut pairs = Vec::new();
    for (title, [a, b]) in wanted {
        let pair = Pair { plan, files: [a, b].map(|name| models::file(folder.path(), name)) };
        let (volume, competitors, absent) = pair.compete()?;
        println!("#### {title}\n\n{}", table(&competitors, &absent).markdown());
        let programs = json!({"competitors": competitors, "absent": absent});
        pairs.push(json!({"a": a, "b": b, "volume": volume, "programs": programs}));
    }
    println!(
        "ldi-ops: whole processes from files to the volume. Peers: steps within one process that has imported all it needs, \
         reading included; memory is that of the whole process. `--resolution` of ldi-ops is the coarsest of {RESOLUTIONS:?} \
         that reaches the accuracy together with the next two; of a peer the first that does, within {LIMIT} s. Peers \
         are timed without what they do before their steps, such as asking for the boxes.\n"
    );
    let machine = Machine::ask_after(load_before);
    println!("{}", machine.describe());
    write_json(json, &json!({"runs": plan.runs, "machine": machine, "pairs": pairs}))
}

/// Two files.
struct Pair<'p> {
    plan: &'p Plan,
    files: [PathBuf; 2],
}

impl Pair<'_> {
    /// Finds settings, and times all programs in turn. Returns the exact volume too.
    fn compete(&self) -> Result<(f64, Vec<Competitor>, Vec<Absent>), BenchError> {
        let exact = ["--exact".to_owned()];
        let volume = positive("ldi-ops", self.own_volume(&exact)?)?;
        let mut competitors = vec![Competitor::own("exact", &exact, 0.0)];
        let mut absent = Vec::new();
        for tolerance in TOLERANCES {
            match self.own_raster(volume, tolerance)? {
                Some(competitor) => competitors.push(competitor),
                None => absent.push(Absent {
                    program: format!("ldi-ops: {} %", 100.0 * tolerance),
                    reason: format!("not reached by {IN_A_ROW} resolutions in a row"),
                }),
            }
        }
        for peer in OF_MESHES {
            let label = peer.to_owned();
            match self.peer(peer, None)? {
                Ok((_, found)) => competitors.push(Competitor::peer(label, peer, None, (found / volume - 1.0).abs())),
                Err(reason) => absent.push(Absent { program: label, reason }),
            }
        }
        for peer in OF_VOXELS {
            self.of_voxels(peer, volume, &mut competitors, &mut absent)?;
        }
        for _ in 0..self.plan.runs {
            let mut remaining = Vec::new();
            for mut competitor in competitors {
                let run = match competitor.peer {
                    None => Ok(timed(&mut self.own(&competitor.flags))?),
                    Some(peer) => self.peer(peer, competitor.resolution)?.map(|(run, _)| run),
                };
                match run {
                    Ok(run) => {
                        competitor.runs.push(run);
                        remaining.push(competitor);
                    }
                    Err(reason) => absent.push(Absent { program: competitor.program, reason }),
                }
            }
            competitors = remaining;
        }
        Ok((volume, competitors, absent))
    }

    fn own(&self, flags: &[String]) -> Command {
        let mut command = Command::new(&self.plan.ldi_ops);
        command.arg("intersect").args(&self.files).args(flags).arg("--quiet");
        command
    }

    fn own_volume(&self, flags: &[String]) -> Result<f64, BenchError> {
        // 0 where the raster is too coarse for any ray to meet the result.
        Ok(number_at(&told_by_own_json(self.own(flags))?, "/volume/value"))
    }

    /// Returns ldi-ops with the fastest raster, along z or along all axes, that reaches a tolerance; `None` if none does.
    fn own_raster(&self, volume: f64, tolerance: f64) -> Result<Option<Competitor>, BenchError> {
        let mut fastest: Option<(f64, Competitor)> = None;
        for axis in ["z", "all"] {
            let mut accurate = Vec::new();
            for resolution in RESOLUTIONS {
                let flags = ["--estimate", "--axis", axis, "--resolution", &resolution.to_string()].map(str::to_owned);
                let error = (self.own_volume(&flags)? / volume - 1.0).abs();
                match error <= tolerance {
                    true => accurate.push((flags, error)),
                    false => accurate.clear(),
                }
                if accurate.len() == IN_A_ROW {
                    break;
                }
            }
            if accurate.len() < IN_A_ROW {
                continue;
            }
            let (flags, error) = accurate.swap_remove(0);
            let seconds = timed(&mut self.own(&flags))?.seconds.min(timed(&mut self.own(&flags))?.seconds);
            if fastest.as_ref().is_none_or(|(least, _)| seconds < *least) {
                let label = format!("{} %, {}", 100.0 * tolerance, flags[1..].join(" "));
                fastest = Some((seconds, Competitor::own(&label, &flags, error)));
            }
        }
        Ok(fastest.map(|(_, competitor)| competitor))
    }

    /// Adds a program of voxels with the first numbers that reach the tolerances.
    fn of_voxels(
        &self,
        peer: &'static str,
        volume: f64,
        competitors: &mut Vec<Competitor>,
        absent: &mut Vec<Absent>,
    ) -> Result<(), BenchError> {
        let mut wanted = TOLERANCES.iter().peekable();
        let mut least = f64::INFINITY;
        for resolution in RESOLUTIONS {
            let reason = match self.peer(peer, Some(resolution))? {
                Ok((_, found)) => {
                    let error = (found / volume - 1.0).abs();
                    least = least.min(error);
                    while let Some(tolerance) = wanted.next_if(|&&tolerance| error <= tolerance) {
                        let label = format!("{peer}: {} %, {resolution} voxels", 100.0 * tolerance);
                        competitors.push(Competitor::peer(label, peer, Some(resolution), error));
                    }
                    None
                }
                Err(reason) => Some(format!("{reason} with {resolution} voxels")),
            };
            if wanted.peek().is_none() {
                return Ok(());
            }
            if let Some(reason) = reason {
                let reason = format!("{reason}; least error {}", percent(least));
                absent.extend(wanted.map(|tolerance| Absent {
                    program: format!("{peer}: {} %", 100.0 * tolerance),
                    reason: reason.clone(),
                }));
                return Ok(());
            }
        }
        let reason = format!("not reached; least error {}", percent(least));
        absent.extend(
            wanted.map(|tolerance| Absent {
                program: format!("{peer}: {} %", 100.0 * tolerance),
                reason: reason.clone(),
            }),
        );
        Ok(())
    }

    /// Runs a peer, and returns its costs and the volume, or why there is none.
    fn peer(&self, peer: &str, resolution: Option<u32>) -> Result<Result<(Run, f64), String>, BenchError> {
        let Some(python) = &self.plan.python else { return Ok(Err("no --python".to_owned())) };
        let mut command = Command::new(python);
        command.arg(&self.plan.peers).arg("--build-and-intersect").args(&self.files);
        command.args(["--json", "-", "--peers", peer, "--runs", &self.plan.peer_runs.to_string()]);
        command.args(["--timeout", &(LIMIT * self.plan.peer_runs as u32).to_string()]);
        command.args(resolution.iter().flat_map(|n| ["--resolution".to_owned(), n.to_string()]));
        let told = parse_json(python, &said_by(&mut command)?)?;
        let answer = &told["results"][0];
        if let Some(reason) = answer["refused"].as_str() {
            return Ok(Err(reason.to_owned()));
        }
        let run = Run {
            seconds: positive(peer, number_at(answer, "/seconds/total"))?,
            cpu_seconds: number_at(answer, "/cpu_seconds"),
            peak_memory_bytes: number_at(answer, "/peak_memory_bytes") as u64,
        };
        Ok(Ok((run, number_at(answer, "/volume"))))
    }
}

impl Competitor {
    fn own(label: &str, flags: &[String], error: f64) -> Competitor {
        let program = format!("ldi-ops: {label}");
        Competitor { program, flags: flags.to_vec(), peer: None, resolution: None, error, runs: Vec::new() }
    }

    fn peer(program: String, peer: &'static str, resolution: Option<u32>, error: f64) -> Competitor {
        Competitor { program, flags: Vec::new(), peer: Some(peer), resolution, error, runs: Vec::new() }
    }

    fn median(&self, of: impl Fn(&Run) -> f64) -> f64 {
        median(self.runs.iter().map(of).collect())
    }
}

/// Returns the table of one pair.
fn table(competitors: &[Competitor], absent: &[Absent]) -> Table {
    let heads = ["program", "error", "ms", "least – most ms", "CPU ms", "peak MB"];
    let fastest = |tolerance: f64| {
        let own = competitors.iter().filter(|one| one.peer.is_none() && one.error <= tolerance);
        own.map(|one| one.median(|run| run.seconds)).fold(f64::INFINITY, f64::min)
    };
    let to_own = TOLERANCES.map(|tolerance| (tolerance, fastest(tolerance)));
    let ratios = TOLERANCES.map(|tolerance| format!("× ldi-ops at {} %", 100.0 * tolerance));
    let mut table = Table::new(&[&heads[..], &ratios.each_ref().map(String::as_str)].concat());
    for one in competitors {
        let seconds = one.median(|run| run.seconds);
        let ends = |of: fn(f64, f64) -> f64| one.runs.iter().map(|run| run.seconds).reduce(of).unwrap_or(f64::NAN);
        let mut row = vec![
            one.program.clone(),
            percent(one.error),
            number(1e3 * seconds),
            format!("{} – {}", number(1e3 * ends(f64::min)), number(1e3 * ends(f64::max))),
            number(1e3 * one.median(|run| run.cpu_seconds)),
            number(1e-6 * one.runs.iter().map(|run| run.peak_memory_bytes).max().unwrap_or(0) as f64),
        ];
        row.extend(to_own.map(|(tolerance, own)| match one.peer.is_some() && one.error <= tolerance {
            true => format!("{} ×", number(seconds / own)),
            false => "–".to_owned(),
        }));
        table.row(row);
    }
    for Absent { program, reason } in absent {
        let mut row = vec![program.clone(), reason.clone()];
        row.resize(heads.len() + TOLERANCES.len(), "–".to_owned());
        table.row(row);
    }
    table
}

/// Returns a number that a program has to state.
fn positive(program: &str, number: f64) -> Result<f64, BenchError> {
    match number > 0.0 {
        true => Ok(number),
        false => Err(BenchError::Program { program: program.to_owned(), said: format!("stated {number}") }),
    }
}

/// Returns an error as text.
fn percent(error: f64) -> String {
    match error {
        error if error < 1e-8 => "< 1e-6 %".to_owned(),
        error => format!("{} %", number(100.0 * error)),
    }
}
