//! Exit codes of the program.

use std::process;

use ldi_ops::{Error, ErrorKind};

/// The exit code of the program; the greater, the worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// What was asked for is done.
    Done = 0,
    /// A check that was asked for is false.
    CheckFalse = 1,
    /// The command line or an input is not what it has to be.
    Input = 2,
    /// The machine has too little memory or lacks a device.
    Machine = 3,
}

impl Exit {
    /// Ends the process.
    pub fn now(self) -> ! {
        process::exit(self as i32)
    }

    /// Ends the process without anything more being run.
    pub fn at_once(self) -> ! {
        #[cfg(unix)]
        // SAFETY: this needs nothing.
        unsafe {
            libc::_exit(self as i32)
        }
        #[cfg(not(unix))]
        self.now()
    }

    /// Returns what is at fault, for programs.
    pub fn kind(self) -> &'static str {
        match self {
            Exit::Done => "none",
            Exit::CheckFalse => "check",
            Exit::Input => "input",
            Exit::Machine => "machine",
        }
    }
}

impl From<&Error> for Exit {
    fn from(error: &Error) -> Exit {
        match error.kind() {
            ErrorKind::Machine => Exit::Machine,
            _ => Exit::Input,
        }
    }
}
