//! The command line of ldi-ops as a function, [`run`]: arguments as typed (`args`) → jobs (`resolve`) → results (`run`) → text and JSON
//! (`report`, `json`).
//!
//! stdout carries only the result, the same at every verbosity; progress, details, warnings and errors go to stderr.

mod allocator;
mod args;
mod exit;
mod interrupt;
mod json;
mod output;
mod progress;
mod report;
mod resolve;
mod run;
mod words;

use std::ffi::OsString;
use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::time::Instant;

use clap::Parser;
use clap::error::ErrorKind;
use ldi_ops::Error;
use rayon::ThreadPool;

use crate::args::Arguments;
use crate::exit::Exit;
use crate::resolve::{Verbosity, resolve};
use crate::run::Outcome;
use crate::words::Words;

pub use crate::allocator::LargePages;

/// Runs a command line, the name of the program first, and returns the exit code: 0 done, 1 a check that is false, 2 a wrong
/// command line or input, 3 a machine that lacks memory or a device. Ctrl-C and SIGTERM end the process. Each call has threads of
/// its own, as many as its `--threads` says, and a call reads no arguments of the process.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let all: Vec<OsString> = arguments.into_iter().collect();
    exit(&all) as u8
}

fn exit(all: &[OsString]) -> Exit {
    let start = Instant::now();
    let words = Words::new(all.iter().skip(1).cloned());
    let arguments = match Arguments::try_parse_from(all) {
        Ok(arguments) => arguments,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // A command line without arguments prints the help text.
            let _ = error.print();
            return Exit::Input;
        }
        Err(error) if error.use_stderr() => {
            let message = error.render().to_string();
            return fail(&words, USAGE, &Error::input(message.trim_start_matches("error: ").trim_end()));
        }
        Err(help) => {
            // A reader that closes the pipe during a help text causes no failure.
            let _ = help.print();
            return Exit::Done;
        }
    };
    interrupt::handle();
    let invocation = match resolve(arguments.command, all.get(1..).unwrap_or_default()) {
        Ok(invocation) => invocation,
        Err(failure) => return fail(&words, USAGE, &failure),
    };
    let verbosity = invocation.verbosity;
    let result = pool(invocation.threads).and_then(|pool| {
        pool.install(|| {
            let finished = run::run(invocation, start)?;
            say(&json::deliver(&finished.report, &finished.outcome)?)?;
            if verbosity == Verbosity::Verbose {
                report::details(&finished.outcome).lines().filter(|line| !line.is_empty()).for_each(comment);
            }
            Ok(finished)
        })
    });
    match result {
        Ok(finished) => {
            complain_of_each(&finished.outcome);
            finished.exit
        }
        Err(failure) => fail(&words, Exit::from(&failure).kind(), &failure),
    }
}

/// The kind of an error in the command line, found before any input is read.
const USAGE: &str = "usage";

/// Reports an error: a message on stderr, and an object if JSON was requested.
fn fail(words: &Words, kind: &str, failure: &Error) -> Exit {
    complain(&failure.to_string());
    if let Some(path) = words.json() {
        // If the object cannot be written, the message remains.
        let _ = json::deliver_failure(&path, words.command().as_deref(), kind, failure).and_then(|text| say(&text));
    }
    Exit::from(failure)
}

/// Lists the inputs that gave no result.
fn complain_of_each(outcome: &Outcome) {
    let failures = outcome.failures();
    if failures.len() > 1 {
        complain(&format!("{} inputs gave no result:", failures.len()));
    }
    for failure in failures {
        complain(&failure.to_string());
    }
}

/// The stack of each thread, in bytes: that of the main thread of most systems, as a job runs on a thread of its pool.
const STACK: usize = 8 << 20;

/// Starts the threads of a job: as many as requested, or one for each processor.
fn pool(threads: Option<NonZeroUsize>) -> Result<ThreadPool, Error> {
    // Zero means one thread per processor.
    let threads = threads.map_or(0, NonZeroUsize::get);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK).build();
    pool.map_err(|error| Error::machine(format!("no threads could be started ({error}); try fewer --threads")))
}

/// Writes the result to stdout. A closed pipe is no failure.
fn say(text: &str) -> Result<(), Error> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Error::output("stdout".as_ref(), &error)),
        _ => Ok(()),
    }
}

/// Writes an error to stderr.
fn complain(message: &str) {
    comment(&format!("error: {message}"));
}

/// Writes a line to stderr; a failure to write is ignored.
fn comment(line: &str) {
    let _ = writeln!(io::stderr(), "ldi-ops: {line}");
}
