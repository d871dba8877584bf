//! Messages and progress on stderr while a job runs.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use ldi_ops::Monitor;

use crate::resolve::Verbosity;

/// The delay of the progress bar, which keeps it away from short jobs.
const PATIENCE: Duration = Duration::from_millis(500);

/// The messages of a job on stderr: a progress bar on a terminal, warnings, and details on request.
pub struct Progress {
    verbosity: Verbosity,
    /// `None` if stderr is not a terminal or with `-q`.
    bar: Option<ProgressBar>,
}

impl Progress {
    pub fn new(verbosity: Verbosity) -> Progress {
        let wanted = verbosity != Verbosity::Quiet && io::stderr().is_terminal();
        let bar = wanted.then(|| {
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden());
            let style = ProgressStyle::with_template("{spinner} {msg} [{bar:30}] {pos}/{len} {elapsed}");
            bar.set_style(style.expect("the template is a constant and right"));
            let later = bar.downgrade();
            thread::spawn(move || {
                thread::sleep(PATIENCE);
                if let Some(bar) = later.upgrade()
                    && !bar.is_finished()
                {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(Duration::from_millis(100));
                }
            });
            bar
        });
        Progress { verbosity, bar }
    }

    /// Returns the monitor through which the library drives the bar.
    pub fn monitor(&self) -> Monitor<'_> {
        Monitor::new(Some(self))
    }

    /// Prints a warning, at every verbosity.
    pub fn warn(&self, message: impl Display) {
        self.line(format_args!("warning: {message}"));
    }

    /// Prints a note on an automatic choice, unless quiet.
    pub fn note(&self, message: impl Display) {
        if self.verbosity != Verbosity::Quiet {
            self.line(message);
        }
    }

    /// Returns whether `-v` requests details.
    pub fn is_verbose(&self) -> bool {
        self.verbosity == Verbosity::Verbose
    }

    fn line(&self, message: impl Display) {
        // A failure to write to stderr is ignored.
        let write = || drop(writeln!(io::stderr(), "ldi-ops: {message}"));
        match &self.bar {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl ldi_ops::Progress for Progress {
    fn update(&self, stage: &str, done: u64, total: u64) -> ControlFlow<()> {
        if let Some(bar) = &self.bar {
            bar.set_length(total);
            bar.set_position(done);
            bar.set_message(stage.to_owned());
        }
        ControlFlow::Continue(())
    }

    fn detail(&self, line: &str) {
        if self.is_verbose() {
            self.line(line);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}
