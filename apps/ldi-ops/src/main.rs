//! The command line of ldi-ops: arguments as typed ([`args`]) → jobs ([`resolve`]) → results ([`run`]) → text and JSON
//! ([`report`], [`json`]).
//!
//! stdout carries the result and nothing else; progress, warnings and errors go to stderr.

mod allocator;
mod args;
mod bound;
mod excerpt;
mod exit;
mod json;
mod length;
mod number;
mod output;
mod progress;
mod report;
mod resolve;
mod run;
mod scaffold;
mod transform;
mod unit;
mod warning;

use std::io::{self, Write};
use std::time::Instant;

use clap::Parser;
use clap::error::ErrorKind;

use crate::args::Arguments;
use crate::exit::{Exit, Failure};
use crate::resolve::resolve;

#[global_allocator]
static ALLOCATOR: allocator::LargePages = allocator::LargePages;

/// What shells report of a program that was interrupted.
const INTERRUPTED: i32 = 130;

fn main() {
    let start = Instant::now();
    choose_adapters_ourselves();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // The help text is the answer to a command line that says nothing.
            let _ = error.print();
            Exit::Input.now()
        }
        Err(error) if error.use_stderr() => {
            complain(error.render().to_string().trim_start_matches("error: ").trim_end());
            Exit::Input.now()
        }
        Err(help) => {
            // A reader that has seen enough of a help text is no failure.
            let _ = help.print();
            Exit::Done.now()
        }
    };
    // Whoever interrupts a long job should not have to tidy up after it. Without a handler the job is only less tidy.
    let _ = ctrlc::set_handler(|| {
        ldi_ops::output::abandon();
        std::process::exit(INTERRUPTED);
    });
    let result = resolve(arguments.command).and_then(|invocation| run::run(invocation, start)).and_then(|finished| {
        say(&json::deliver(&finished.report, &finished.outcome)?)?;
        Ok(finished.exit)
    });
    let exit = match result {
        Ok(exit) => exit,
        Err(failure) => {
            complain(&failure.message);
            failure.exit
        }
    };
    exit.now()
}

/// Keeps Mesa's device-select layer out, which reorders adapters for desktops, and on machines without one complains on
/// stderr: adapters are chosen here.
fn choose_adapters_ourselves() {
    const SWITCH: &str = "NODEVICE_SELECT";
    if std::env::var_os(SWITCH).is_none() {
        // SAFETY: nothing has started a thread yet that could read the environment meanwhile.
        unsafe { std::env::set_var(SWITCH, "1") };
    }
}

/// Writes the result. A reader that has gone away is no failure.
fn say(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::output("stdout".as_ref(), &error)),
        _ => Ok(()),
    }
}

/// Writes an error. Where stderr is gone too there is nobody left to tell.
fn complain(message: &str) {
    let _ = writeln!(io::stderr(), "ldi-ops: error: {message}");
}
