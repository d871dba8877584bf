//! The command `render`.

use std::time::Instant;

use ldi_ops::Error;
use ldi_ops::driver::render::{RenderJob, render};

use super::{Finished, Outcome, say_warnings};
use crate::exit::Exit;
use crate::progress::Progress;
use crate::resolve::Command;

/// Runs a command; `start` is the start of the process.
pub fn run(command: &Command<RenderJob>, start: Instant, progress: &Progress) -> Result<Finished, Error> {
    let Command { job, inputs, report, .. } = command;
    let rendered = render(job, inputs, start, &progress.monitor())?;
    progress.finish();
    say_warnings(&rendered.warnings, progress);
    Ok(Finished { outcome: Outcome::Rendered(Box::new(rendered)), report: report.clone(), exit: Exit::Done })
}
