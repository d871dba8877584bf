//! The error of the library's operations.

use std::fmt::Display;
use std::io;
use std::path::Path;

use crate::boolean::BooleanError;
use crate::gpu::DeviceError;
use crate::mesh::check::MeshReport;
use crate::sampler::SampleError;
use crate::surface::SurfaceError;

/// The party at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// An input is invalid.
    Input,
    /// The arguments of a call contradict one another or are out of range.
    Usage,
    /// The machine has too little memory or disk, or lacks a device.
    Machine,
    /// The caller stopped the operation.
    Cancelled,
}

/// Why an operation gave no result. `Display` is the message, one sentence or more, which names the file where there is one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A mesh is not closed; all its defects, with places.
    #[error(transparent)]
    NotClosed(Box<OpenMesh>),
    /// An input is invalid.
    #[error("{0}")]
    Input(String),
    /// The arguments of a call contradict one another or are out of range.
    #[error("{0}")]
    Usage(String),
    /// The machine has too little memory or disk, or lacks a device.
    #[error("{0}")]
    Machine(String),
    /// The caller stopped the operation, through its [`Progress`](crate::Progress).
    #[error("cancelled")]
    Cancelled,
}

/// A mesh that is not closed, by its name.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{message}")]
pub struct OpenMesh {
    /// The name of the solid: its file as a rule.
    pub name: String,
    /// All defects of the mesh.
    pub report: MeshReport,
    /// The name, the defects and the way out, for people.
    pub(crate) message: String,
}

impl PartialEq for OpenMesh {
    fn eq(&self, other: &OpenMesh) -> bool {
        self.message == other.message
    }
}

impl Eq for OpenMesh {}

impl Error {
    /// Returns an error whose cause is an input.
    pub fn input(message: impl Display) -> Error {
        Error::Input(message.to_string())
    }

    /// Returns an error whose cause is the machine.
    pub fn machine(message: impl Display) -> Error {
        Error::Machine(message.to_string())
    }

    /// Returns the error of a file that could not be written: a full disk is the machine's fault, a wrong path the caller's.
    pub fn output(path: &Path, error: &io::Error) -> Error {
        let message = format!("{}: {error}", path.display());
        match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::OutOfMemory => {
                Error::Machine(message)
            }
            _ => Error::Input(message),
        }
    }

    /// Returns the party at fault.
    pub fn kind(&self) -> ErrorKind {
        match self {
            Error::NotClosed(_) | Error::Input(_) => ErrorKind::Input,
            Error::Usage(_) => ErrorKind::Usage,
            Error::Machine(_) => ErrorKind::Machine,
            Error::Cancelled => ErrorKind::Cancelled,
        }
    }
}

impl From<DeviceError> for Error {
    fn from(error: DeviceError) -> Error {
        Error::machine(error)
    }
}

impl From<SampleError> for Error {
    fn from(error: SampleError) -> Error {
        match error {
            SampleError::TooManySamples(_) | SampleError::Device(_) => Error::machine(error),
            SampleError::NotOriented | SampleError::GridsDiffer { .. } => Error::input(error),
        }
    }
}

impl From<SurfaceError> for Error {
    fn from(error: SurfaceError) -> Error {
        Error::input(error)
    }
}

impl From<BooleanError> for Error {
    fn from(error: BooleanError) -> Error {
        match error {
            BooleanError::TooManySamples(_) => Error::machine(error),
            BooleanError::RaysDiffer { .. } | BooleanError::TooManyTriangles { .. } => Error::input(error),
        }
    }
}
