//! Messages and progress on stderr while a job runs.

use std::fmt::{self, Display};
use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use ldi_ops::Monitor;

use crate::resolve::Verbosity;

/// The delay of the progress bar, which keeps it away from short jobs.
const PATIENCE: Duration = Duration::from_millis(500);

/// The meaning of the steps that a job counts.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Steps {
    /// Each stage is one step: the bar shows its number and its time, and `-v` prints the time of each.
    Stages,
    /// A stage has any number of steps.
    Parts,
}

/// The stage that runs, of a job that counts stages.
struct Stage {
    name: String,
    /// From 1.
    number: u64,
    /// The number of all stages.
    total: u64,
    start: Instant,
}

impl Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "stage {} of {}, {}", self.number, self.total, self.name)
    }
}

/// A stage that the thread which draws the bar reads.
type SharedStage = Arc<Mutex<Option<Stage>>>;

fn locked(stage: &SharedStage) -> MutexGuard<'_, Option<Stage>> {
    stage.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The messages of a job on stderr: a progress bar on a terminal, warnings, and details on request.
pub struct Progress {
    verbosity: Verbosity,
    steps: Steps,
    stage: SharedStage,
    /// `None` if stderr is not a terminal or with `-q`.
    bar: Option<ProgressBar>,
}

impl Progress {
    pub fn new(verbosity: Verbosity, steps: Steps) -> Progress {
        let wanted = verbosity != Verbosity::Quiet && io::stderr().is_terminal();
        let stage = SharedStage::default();
        let bar = wanted.then(|| {
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::hidden());
            let style = ProgressStyle::with_template(match steps {
                Steps::Stages => "{spinner} [{bar:30}] {elapsed} {stage}",
                Steps::Parts => "{spinner} {msg} {steps}{elapsed}",
            });
            let drawn = Arc::clone(&stage);
            let draw = move |_: &ProgressState, line: &mut dyn fmt::Write| {
                if let Some(stage) = &*locked(&drawn) {
                    // A failure to write is the terminal's.
                    let _ = write!(line, "{stage}: {:#}", HumanDuration(stage.start.elapsed()));
                }
            };
            let style = style.expect("the template is a constant and right");
            bar.set_style(style.with_key("stage", draw).with_key("steps", draw_steps));
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
        Progress { verbosity, steps, stage, bar }
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
        self.change_stage(None);
    }

    /// Begins a stage, or none, and prints the time of the one before.
    fn change_stage(&self, next: Option<Stage>) {
        // The bar, which reads the stage, may be drawn with the line.
        let ended = std::mem::replace(&mut *locked(&self.stage), next);
        if let Some(ended) = ended {
            ldi_ops::Progress::detail(self, &format!("{ended}: {:.3} s", ended.start.elapsed().as_secs_f64()));
        }
    }
}

/// Draws the steps that are done, and nothing while their number is unknown.
fn draw_steps(state: &ProgressState, line: &mut dyn fmt::Write) {
    const WIDTH: usize = 30;
    if let Some(total) = state.len().filter(|&total| total > 0) {
        let done = (WIDTH as f32 * state.fraction()) as usize;
        // A failure to write is the terminal's.
        let _ = write!(line, "[{}{}] {}/{total} ", "█".repeat(done), "░".repeat(WIDTH - done), state.pos());
    }
}

impl ldi_ops::Progress for Progress {
    fn update(&self, stage: &str, done: u64, total: u64) -> ControlFlow<()> {
        let is_new = || locked(&self.stage).as_ref().is_none_or(|current| current.name != stage);
        // Before the first stage its name is empty.
        if self.steps == Steps::Stages && !stage.is_empty() && is_new() {
            self.change_stage(Some(Stage { name: stage.to_owned(), number: done + 1, total, start: Instant::now() }));
        }
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
