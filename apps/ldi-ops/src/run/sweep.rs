//! The command `sweep`.

use ldi_ops::Error;
use ldi_ops::report::sweep::row::Row;
use ldi_ops::report::sweep::{SweepJob, sweep_files};

use super::{Finished, Outcome};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::Report;

/// Runs a command.
pub fn run(job: &SweepJob, report: &Report, progress: &Progress) -> Result<Finished, Error> {
    let swept = sweep_files(job, &progress.monitor())?;
    progress.finish();
    let failed: Vec<&Row> = swept.failed().collect();
    if let Some((row, error)) = failed.first().and_then(|row| Some((row, row.error.as_ref()?))) {
        let said = format!(
            "{} of {} designs could not be measured; the first, {}: {error}",
            failed.len(),
            swept.rows.len(),
            row.name()
        );
        progress.warn(said);
    }
    let none = swept.missing == 0 && failed.len() == swept.rows.len();
    let exit = if none { Exit::Input } else { Exit::Done };
    Ok(Finished { outcome: Outcome::Swept(swept), report: report.clone(), exit })
}
