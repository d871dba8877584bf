//! Sweeps: the metrics of many designs of a model solid, in one table and on one page.
//!
//! `plan` (a TOML file → designs, each with a key) → [`row`] (the metrics of a design, or why it has none; a file each) →
//! `table` (sweep.csv), `front` and `page` (index.html). Rows that exist are not measured again, so that a sweep goes on where it
//! was stopped, and several processes share one by [`Shard`].

mod front;
mod page;
mod plan;
pub mod row;
mod table;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;

pub use front::{Direction, Objective, front};
pub use page::html;

use crate::driver::backend::Backends;
use crate::driver::job::Backend;
use crate::driver::output;
use crate::{Error, ErrorKind, Monitor};
use plan::{Design, Plan};
use row::Row;

/// A sweep to be run, or a part of one.
#[derive(Clone, Debug)]
pub struct SweepJob {
    /// The plan, `.toml`.
    pub plan: PathBuf,
    /// The folder of the rows, the table and the page.
    pub folder: PathBuf,
    /// The designs to measure; all without it.
    pub shard: Option<Shard>,
    /// The device that samples.
    pub backend: Backend,
    /// The most bytes that the process may hold; a share of the free memory without it.
    pub memory: Option<u64>,
}

/// One of several equal parts of a sweep, as typed: `3/200`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    number: usize,
    of: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Shard, String> {
        let parts = text.split_once('/').map(|(number, of)| (number.trim().parse(), of.trim().parse()));
        match parts {
            Some((Ok(number), Ok(of))) if (1..=of).contains(&number) => Ok(Shard { number, of }),
            _ => Err(format!("{text} is not a part such as 3/200, from 1/200 to 200/200")),
        }
    }
}

/// The state of a sweep after a run.
pub struct Swept {
    /// The model and the number of designs in words.
    pub title: String,
    /// The number of designs of this run's part.
    pub chosen: usize,
    /// How many of them this run measured.
    pub measured: usize,
    /// Whether the folder holds table and page of an earlier run, while designs are missing.
    pub is_older: bool,
    /// The rows of all designs, or of this part while others have none, in the order of the plan.
    pub rows: Vec<Row>,
    /// The number of designs without a row that can be read, of other parts.
    pub missing: usize,
    /// The designs that no other dominates in all objectives: places in `rows`.
    pub front: Vec<usize>,
    /// The number of designs that take no part in the front because the raster does not resolve an objective.
    pub unresolved: usize,
    /// The page and the table, once all designs have rows.
    pub written: Vec<PathBuf>,
}

impl Swept {
    /// Returns the number of designs that keep their limits; `None` if there are none.
    pub fn kept(&self) -> Option<usize> {
        let judged = self.rows.iter().any(|row| row.passed.is_some());
        judged.then(|| self.rows.iter().filter(|row| row.passed == Some(true)).count())
    }

    /// Returns the codes of warnings, each with the number of designs that have it, in the order of the rows.
    pub fn warnings(&self) -> Vec<(&str, usize)> {
        let mut counts: Vec<(&str, usize)> = Vec::new();
        for code in self.rows.iter().flat_map(Row::warning_codes) {
            match counts.iter_mut().find(|(known, _)| *known == code) {
                Some((_, count)) => *count += 1,
                None => counts.push((code, 1)),
            }
        }
        counts
    }

    /// Returns the rows of designs that could not be measured.
    pub fn failed(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| row.is_failed())
    }
}

/// Returns all files that a job may write, but for the rows.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    [PAGE, TABLE].map(|name| folder.join(name)).to_vec()
}

const PAGE: &str = "index.html";
const TABLE: &str = "sweep.csv";
/// The folder of the rows.
const ROWS: &str = "rows";

/// Measures the designs of a plan that have no row yet, and writes table and page once all have one. A design that fails is a
/// row, and is tried again by the next run.
///
/// # Errors
/// A plan that cannot be read or makes no designs, files that cannot be written, a device that does not exist. Designs for which
/// the machine lacks memory have no row; the error says so after all others are measured.
pub fn sweep_files(job: &SweepJob, progress: &Monitor) -> Result<Swept, Error> {
    let plan = Plan::open(&job.plan)?;
    let folder = job.folder.join(ROWS);
    fs::create_dir_all(&folder).map_err(|error| Error::output(&folder, &error))?;
    let chosen = chosen(plan.designs(), job.shard);
    let is_measured = |design: &Design| row::read(&folder, design).is_some_and(|row| !row.is_failed());
    let missing: Vec<&Design> = chosen.iter().copied().filter(|design| !is_measured(design)).collect();
    if !missing.is_empty() {
        // A device that does not exist is found before the first design.
        Backends::open(&job.backend)?;
    }
    progress.expect(missing.len())?;
    let mut faults: Vec<(&Design, Error)> = Vec::new();
    let mut measured = 0;
    for (i, design) in missing.iter().enumerate() {
        progress.stage(format!("design {} of {}: {design}", i + 1, missing.len()))?;
        match plan.measure(design, &job.backend, job.memory) {
            // Another machine may have more memory: there is no row.
            Err(error) if error.kind() == ErrorKind::Machine => faults.push((design, error)),
            // Another process may have measured it meanwhile.
            Err(_) if is_measured(design) => {}
            report => {
                measured += usize::from(report.is_ok());
                row::write(&folder, &Row::of(&plan, design, report))?;
            }
        }
        progress.step()?;
    }
    if let Some((design, error)) = faults.first() {
        let count = format!("{} of {} designs", faults.len(), missing.len());
        return Err(Error::machine(format!(
            "{count} could not be measured on this machine; the first, {design}: {error}"
        )));
    }
    let unwritten = plan.designs().iter().filter(|design| !row::exists(&folder, design)).count();
    // All rows are read from their files, as other processes may have written some.
    let known: Vec<&Design> = if unwritten == 0 { plan.designs().iter().collect() } else { chosen.clone() };
    let rows: Vec<Row> = known.iter().filter_map(|design| row::read(&folder, design)).collect();
    // A file that holds no row any more counts as missing.
    let left = unwritten + known.len() - rows.len();
    let (mut front, mut written) = (Vec::new(), Vec::new());
    if left == 0 {
        front = front::front(&rows, plan.objectives());
        let page = page::html(plan.title(), &rows, plan.objectives(), &front);
        for (name, text) in [(PAGE, page), (TABLE, table::csv(&rows, &front))] {
            let path = job.folder.join(name);
            output::replace(&path, |file| file.write_all(text.as_bytes()))?;
            written.push(path);
        }
    }
    Ok(Swept {
        title: plan.title().to_owned(),
        chosen: chosen.len(),
        measured,
        is_older: left > 0 && job.folder.join(TABLE).exists(),
        missing: left,
        front,
        unresolved: if left == 0 { front::unresolved(&rows, plan.objectives()) } else { 0 },
        rows,
        written,
    })
}

/// Returns the designs of a part, in the order of the plan.
fn chosen(designs: &[Design], shard: Option<Shard>) -> Vec<&Design> {
    let Some(shard) = shard else { return designs.iter().collect() };
    // In the order of the keys neighbours of a plan, of which some take longer than others, are in different parts.
    let mut order: Vec<usize> = (0..designs.len()).collect();
    order.sort_by_key(|&i| &designs[i].key);
    let mut places: Vec<usize> = order.into_iter().skip(shard.number - 1).step_by(shard.of).collect();
    places.sort_unstable();
    places.into_iter().map(|i| &designs[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_all_designs() {
        let design = |i: usize| Design { key: format!("{}", i * 7919 % 97), parameters: serde_json::Map::new() };
        let designs: Vec<Design> = (0..10).map(design).collect();
        let parts: Vec<Vec<&Design>> =
            (1..=3).map(|i| chosen(&designs, Some(format!("{i}/3").parse().unwrap()))).collect();
        assert_eq!([4, 3, 3], [parts[0].len(), parts[1].len(), parts[2].len()]);
        assert!(designs.iter().all(|design| parts.concat().contains(&design)));
        for wrong in ["0/3", "4/3", "3", "a/b", "1/0", "-1/3"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_stopped_sweep_goes_on_and_parts_give_the_same_files() {
        let folder = tempfile::tempdir().unwrap();
        let plan = folder.path().join("plan.toml");
        let text = "model = \"hollow-box\"\n[parameters]\nsize = [[3, 3, 3], [4, 4, 4]]\nhollow = [\"1,1,1\", \"2,2,2\", \"9,9,9\"]\n[settings]\nresolution = 12\n";
        fs::write(&plan, text).unwrap();
        let job = |name: &str, shard: Option<&str>| SweepJob {
            plan: plan.clone(),
            folder: folder.path().join(name),
            shard: shard.map(|shard| shard.parse().unwrap()),
            backend: Backend::Cpu,
            memory: None,
        };
        let run = |job: &SweepJob| sweep_files(job, &Monitor::new(None)).unwrap();
        let whole = run(&job("whole", None));
        assert_eq!((whole.chosen, whole.measured, whole.missing, whole.written.len()), (6, 4, 0, 2));
        // A hollow of 9 does not fit into the boxes.
        assert_eq!(whole.failed().count(), 2);
        let porosity = whole.rows[0].metrics["porosity"].value.unwrap();
        assert!((porosity - 1.0 / 27.0).abs() < 1e-6, "{porosity}");

        let first = run(&job("parts", Some("1/2")));
        assert_eq!((first.chosen, first.missing, first.written.len()), (3, 3, 0));
        let second = run(&job("parts", Some("2/2")));
        assert_eq!((second.missing, second.written.len()), (0, 2));
        for name in [PAGE, TABLE] {
            let [a, b] = ["whole", "parts"].map(|of| fs::read(folder.path().join(of).join(name)).unwrap());
            assert!(a == b, "{name}");
        }

        // A row that a killed process left unfinished does not exist; a broken one is measured anew, and so are failed ones.
        let row = |row: &Row| folder.path().join("parts").join(ROWS).join(format!("{}.json", row.design));
        fs::write(row(&whole.rows[0]), "{\"design\": ").unwrap();
        let again = run(&job("parts", None));
        assert_eq!((again.measured, again.rows == whole.rows), (1, true));

        // One of another part is missing until that part runs again.
        fs::write(row(&first.rows[0]), "").unwrap();
        let parts = ["2/2", "1/2"].map(|part| run(&job("parts", Some(part))));
        assert_eq!(parts.map(|part| (part.missing, part.written.len())), [(1, 0), (0, 2)]);
    }
}
