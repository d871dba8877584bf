//! How the program ends: exit codes, and the failures that carry them.

use std::fmt::Display;
use std::io;
use std::process;

use ldi_ops::boolean::BooleanError;
use ldi_ops::gpu::DeviceError;
use ldi_ops::sampler::SampleError;

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

/// Why a command gave no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// How the program ends.
    pub exit: Exit,
    /// What to say on stderr, without the program's name.
    pub message: String,
}

impl Failure {
    /// The command line or an input is at fault.
    pub fn input(message: impl Display) -> Failure {
        Failure { exit: Exit::Input, message: message.to_string() }
    }

    /// The machine is at fault.
    pub fn machine(message: impl Display) -> Failure {
        Failure { exit: Exit::Machine, message: message.to_string() }
    }

    /// A file could not be written: a full disk is the machine's fault, a wrong path is the command line's.
    pub fn output(path: &std::path::Path, error: &io::Error) -> Failure {
        let exit = match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::OutOfMemory => Exit::Machine,
            _ => Exit::Input,
        };
        Failure { exit, message: format!("{}: {error}", path.display()) }
    }
}

impl From<DeviceError> for Failure {
    fn from(error: DeviceError) -> Failure {
        Failure::machine(error)
    }
}

impl From<SampleError> for Failure {
    fn from(error: SampleError) -> Failure {
        match error {
            SampleError::TooManySamples(_) | SampleError::Device(_) => Failure::machine(error),
            SampleError::NotOriented | SampleError::GridsDiffer { .. } => Failure::input(error),
        }
    }
}

impl From<BooleanError> for Failure {
    fn from(error: BooleanError) -> Failure {
        match error {
            BooleanError::TooManySamples(_) => Failure::machine(error),
            BooleanError::RaysDiffer { .. } | BooleanError::TooManyTriangles { .. } => Failure::input(error),
        }
    }
}
