//! Commands, one module per kind: each calls the library and reports the result.

mod check;
mod clash;
mod convert;
mod devices;
mod files;
mod from_images;
mod generate;
mod manual;
mod measure;
mod render;
mod report;
mod sum;
mod sweep;

use std::path::{Path, PathBuf};
use std::time::Instant;

use ldi_ops::driver::measured::Measured;
use ldi_ops::driver::render::Rendered;
use ldi_ops::driver::surface::SurfaceReport;
use ldi_ops::report::files::Reported;
use ldi_ops::report::sweep::Swept;
use ldi_ops::{Error, Warning};

use crate::exit::Exit;
use crate::progress::{Progress, Steps};
use crate::resolve::{Invocation, Job, Report};

pub use check::Checked;
pub use clash::Compared;
pub use convert::Converted;
pub use devices::Devices;
pub use from_images::Surfaced;
pub use generate::Generated;
pub use measure::is_pinned;

/// A finished job.
pub struct Finished {
    pub outcome: Outcome,
    /// The requested destination of the result.
    pub report: Report,
    pub exit: Exit,
}

/// The result of a job.
pub enum Outcome {
    Measured(Vec<Each<Measured>>),
    Surfaced(Box<Surfaced>),
    Checked(Vec<Each<Checked>>),
    Converted(Converted),
    Generated(Generated),
    Devices(Devices),
    Rendered(Box<Rendered>),
    Reported(Reported),
    Swept(Swept),
    Compared(Box<Compared>),
    /// Text that is the result itself.
    Text(String),
}

impl Outcome {
    /// Returns the errors of inputs that failed while others gave results.
    pub fn failures(&self) -> Vec<&Error> {
        fn of<T>(results: &[Each<T>]) -> Vec<&Error> {
            results.iter().filter_map(|result| Some(&result.as_ref().err()?.failure)).collect()
        }
        match self {
            Outcome::Measured(results) => of(results),
            Outcome::Checked(results) => of(results),
            _ => Vec::new(),
        }
    }
}

/// The result of one of several independent inputs.
pub type Each<T> = Result<T, Refused>;

/// An input that gave no result.
pub struct Refused {
    pub path: PathBuf,
    /// The error; its message names the path.
    pub failure: Error,
}

impl Refused {
    fn new(path: &Path, failure: Error) -> Refused {
        let (name, message) = (path.display().to_string(), failure.to_string());
        let failure = match (message.contains(&name), &failure) {
            (true, _) => failure,
            (false, Error::Machine(_)) => Error::machine(format!("{name}: {message}")),
            (false, _) => Error::input(format!("{name}: {message}")),
        };
        Refused { path: path.to_path_buf(), failure }
    }
}

/// Returns the worst exit of several inputs; `of` gives that of a result.
fn worst<T>(results: &[Each<T>], of: impl Fn(&T) -> Exit) -> Exit {
    let each = results.iter().map(|result| result.as_ref().map_or_else(|refused| Exit::from(&refused.failure), &of));
    each.max().unwrap_or(Exit::Done)
}

/// Runs a job; `start` is the start of the process.
pub fn run(invocation: Invocation, start: Instant) -> Result<Finished, Error> {
    files::keep_apart(&invocation.job)?;
    let steps = if let Job::Report(..) = invocation.job { Steps::Stages } else { Steps::Parts };
    let progress = Progress::new(invocation.verbosity, steps);
    match invocation.job {
        Job::Measure(job) => measure::run(&job, start, &progress),
        Job::Surface(job) => from_images::run(&job, start, &progress),
        Job::Check(job) => check::run(&job, &progress),
        Job::Convert(job) => convert::run(&job, &progress),
        Job::Generate(job) => generate::run(&job, &progress),
        Job::Devices(job) => devices::run(&job),
        Job::Render(job) => render::run(&job, start, &progress),
        Job::Sum(job) => sum::run(&job, start, &progress),
        Job::Clash(job) => clash::run(&job, start, &progress),
        Job::Report(job, report) => report::run(&job, &report, &progress),
        Job::Sweep(job, report) => sweep::run(&job, &report, &progress),
        Job::Completions(shell) => Ok(manual::completions(shell)),
        Job::Man(folder) => manual::man(folder.as_deref()),
    }
}

/// Prints all warnings to stderr.
fn say_warnings<'w>(warnings: impl IntoIterator<Item = &'w Warning>, progress: &Progress) {
    for warning in warnings {
        progress.warn(&warning.message);
    }
}

/// Returns the exit of a job; a check is false if a mesh was requested but not written.
fn surface_exit(report: Option<&SurfaceReport>) -> Exit {
    match report {
        Some(SurfaceReport { path: None, .. }) => Exit::CheckFalse,
        _ => Exit::Done,
    }
}
