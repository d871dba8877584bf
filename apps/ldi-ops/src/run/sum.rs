//! The commands `minkowski`, `offset`, `open` and `close`.

use std::time::Instant;

use ldi_ops::Error;
use ldi_ops::driver::job::SumJob;
use ldi_ops::driver::sum::sum_files;

use super::{Finished, measure};
use crate::progress::Progress;
use crate::resolve::Command;

/// Runs a command; `start` is the start of the process.
pub fn run(command: &Command<SumJob>, start: Instant, progress: &Progress) -> Result<Finished, Error> {
    let Command { job, inputs, target, report } = command;
    let measured = sum_files(job, inputs, target.as_ref(), start, &progress.monitor())?;
    progress.finish();
    Ok(measure::finished(vec![Ok(measured)], report, progress))
}
