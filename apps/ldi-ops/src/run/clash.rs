//! The command `clash`.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use ldi_ops::Error;
use ldi_ops::driver::clash::{Clashes, clash_files};
use ldi_ops::report::clash;

use super::{Finished, Outcome, say_warnings};
use crate::exit::Exit;
use crate::output;
use crate::progress::Progress;
use crate::resolve::ClashCommand;

/// The result of a comparison, and the files that were written.
pub struct Compared {
    pub clashes: Clashes,
    pub written: Vec<PathBuf>,
}

/// Runs a command; `start` is the start of the process.
pub fn run(command: &ClashCommand, start: Instant, progress: &Progress) -> Result<Finished, Error> {
    let ClashCommand { job, folder, csv, report } = command;
    let monitor = progress.monitor();
    let mut clashes = clash_files(job, start, &monitor)?;
    let mut written = Vec::new();
    if let Some(folder) = folder {
        written.push(clash::write(&mut clashes, (job.settings.fill, job.settings.memory), folder, &monitor)?);
    }
    if let Some(path) = csv {
        let table = clash::csv(&clashes);
        output::replace(path, |file| file.write_all(table.as_bytes()))?;
        written.push(path.clone());
    }
    progress.finish();
    say_warnings(&clashes.warnings, progress);
    let exit = if clashes.findings().next().is_some() { Exit::CheckFalse } else { Exit::Done };
    let outcome = Outcome::Compared(Box::new(Compared { clashes, written }));
    Ok(Finished { outcome, report: report.clone(), exit })
}
