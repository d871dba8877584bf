//! The files of a comparison of parts: clash.html, clash.json and clash.csv.

mod csv;
mod page;
mod picture;
mod record;

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::driver::clash::{Clashes, Pair};
use crate::driver::output;
use crate::progress::Monitor;
use crate::sampler::FillRule;
use crate::{Error, Warning};

pub use csv::csv;
use picture::Pictures;
pub use record::{Record, record};

/// Largest number of findings with pictures on a page.
const PICTURES: usize = 12;

/// The names of the files.
const FILES: [&str; 3] = ["clash.html", "clash.json", "clash.csv"];

/// Returns the files that [`write()`] writes.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    FILES.map(|name| folder.join(name)).to_vec()
}

/// A finding and its pictures.
struct Pictured<'c> {
    pair: &'c Pair,
    pictures: Pictures,
}

/// Writes the page, with pictures of the worst findings, and the tables of a comparison; returns the page. Pictures that cannot
/// be made leave a warning, as do those that do not fit into `memory`: the most bytes that the process may hold; a share of the free
/// memory without it. The time is added to that of the comparison.
///
/// # Errors
/// Files that cannot be written.
pub fn write(
    clashes: &mut Clashes,
    (fill, memory): (FillRule, Option<u64>),
    folder: &Path,
    progress: &Monitor,
) -> Result<PathBuf, Error> {
    let writing = Instant::now();
    progress.stage("pictures")?;
    let findings: Vec<Pair> = clashes.findings().take(PICTURES).cloned().collect();
    progress.expect(findings.len())?;
    let (mut pictured, mut warnings) = (Vec::new(), Vec::new());
    for pair in &findings {
        match picture::pictures(clashes, pair, (fill, memory)) {
            Ok(pictures) => pictured.push(Pictured { pair, pictures }),
            Err(error) => {
                let [a, b] = clashes.names(pair);
                warnings.push(Warning::new("no-picture", format!("{a} and {b} have no picture: {error}")));
            }
        }
        progress.step()?;
    }
    progress.stage("writing")?;
    clashes.warnings.extend(warnings);
    let took = writing.elapsed().as_secs_f64();
    clashes.seconds.write += took;
    clashes.seconds.total += took;
    fs::create_dir_all(folder).map_err(|error| Error::output(folder, &error))?;
    let texts = [page::html(clashes, &pictured), record::json(clashes), csv(clashes)];
    for (name, text) in FILES.into_iter().zip(texts) {
        output::replace(&folder.join(name), |file| file.write_all(text.as_bytes()))?;
    }
    Ok(folder.join(FILES[0]))
}
