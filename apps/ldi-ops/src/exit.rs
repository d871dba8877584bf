//! Exit codes of the program.

use ldi_ops::{Error, ErrorKind};

/// The exit code of the program; the greater, the worse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// The job is done.
    Done = 0,
    /// A requested check is false.
    CheckFalse = 1,
    /// The command line or an input is invalid.
    Input = 2,
    /// The machine lacks memory or a device.
    Machine = 3,
}

impl Exit {
    /// Ends the process immediately, without exit handlers.
    pub fn at_once(self) -> ! {
        #[cfg(unix)]
        // SAFETY: the call has no preconditions.
        unsafe {
            libc::_exit(self as i32)
        }
        #[cfg(not(unix))]
        std::process::exit(self as i32)
    }

    /// Returns the cause of a failure, as a word for programs.
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
