//! Jobs, one module a kind, and what they share: reading inputs ([`input`]) and measuring images ([`image`]).

mod backend;
mod bytes;
mod check;
mod convert;
mod devices;
mod files;
mod fill;
mod from_images;
mod generate;
#[cfg_attr(not(feature = "gpu"), path = "no_gpu.rs")]
mod gpu;
mod image;
mod input;
pub mod machine;
mod measure;
mod memory;
mod render;
mod report;
mod size;
mod sum;
mod surface;
mod work;
mod write;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use ldi_ops::mesh::io::WriteError;

use crate::exit::{Exit, Failure};
use crate::progress::Progress;
use crate::resolve::{Invocation, Job, Report};
use crate::warning::Warning;

pub use backend::Ran;
pub use check::Checked;
pub use convert::Converted;
pub use devices::{Devices, GpuDevice};
pub use from_images::Surfaced;
pub use generate::Generated;
pub use input::Solid;
pub use machine::{cpu_name, peak_memory_bytes};
pub use measure::{Measured, Method, Volume};
pub use render::Rendered;
pub use report::Reported;
pub use sum::StepReport;
pub use surface::{SimplifiedReport, SurfaceReport};

/// A job that ran to its end.
pub struct Finished {
    pub outcome: Outcome,
    /// Where the result was asked to go.
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
}

impl Outcome {
    /// Why inputs gave no result while others did.
    pub fn failures(&self) -> Vec<&Failure> {
        fn of<T>(results: &[Each<T>]) -> Vec<&Failure> {
            results.iter().filter_map(|result| Some(&result.as_ref().err()?.failure)).collect()
        }
        match self {
            Outcome::Measured(results) => of(results),
            Outcome::Checked(results) => of(results),
            _ => Vec::new(),
        }
    }
}

/// What one of several independent inputs gave.
pub type Each<T> = Result<T, Refused>;

/// An input that gave no result.
pub struct Refused {
    pub path: PathBuf,
    /// Its message names the path.
    pub failure: Failure,
}

impl Refused {
    fn new(path: &Path, failure: Failure) -> Refused {
        let name = path.display().to_string();
        let message = match failure.message.contains(&name) {
            true => failure.message,
            false => format!("{name}: {}", failure.message),
        };
        Refused { path: path.to_path_buf(), failure: Failure { message, ..failure } }
    }
}

/// The worst of the exits of several inputs; `of` is that of a result.
fn worst<T>(results: &[Each<T>], of: impl Fn(&T) -> Exit) -> Exit {
    let each = results.iter().map(|result| result.as_ref().map_or_else(|refused| refused.failure.exit, &of));
    each.max().unwrap_or(Exit::Done)
}

/// Runs a job; `start` is when the process began.
pub fn run(invocation: Invocation, start: Instant) -> Result<Finished, Failure> {
    files::keep_apart(&invocation.job)?;
    // Zero stands for one thread for each processor.
    let threads = invocation.threads.map_or(0, NonZeroUsize::get);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|error| Failure::machine(format!("no threads could be started ({error}); try fewer --threads")))?;
    let progress = Progress::new(invocation.verbosity);
    match invocation.job {
        Job::Measure(job) => measure::run(&job, start, &progress),
        Job::Surface(job) => from_images::run(&job, start, &progress),
        Job::Check(job) => check::run(&job, &progress),
        Job::Convert(job) => convert::run(&job, &progress),
        Job::Generate(job) => generate::run(&job, &progress),
        Job::Devices(job) => devices::run(&job),
        Job::Render(job) => render::run(&job, start, &progress),
        Job::Sum(job) => sum::run(&job, start, &progress),
        Job::Report(job) => report::run(&job, &progress),
    }
}

/// Says all warnings on stderr.
fn say_warnings(warnings: &[Warning], progress: &Progress) {
    for warning in warnings {
        progress.warn(&warning.message);
    }
}

/// A mesh could not be written.
fn write_failure(error: WriteError) -> Failure {
    match &error {
        WriteError::Io { path, source } => Failure::output(path, source),
        _ => Failure::input(error),
    }
}
