//! The replacement of `gpu.rs` in builds without the feature `gpu`: every request for a GPU fails.

use super::device::{Gpu, GpuDevice};
use crate::Error;
use crate::gpu::DeviceError;

const REASON: &str = "this build has no GPU sampler";

/// The reason why this build has no GPU sampler.
pub const ABSENT: Option<&str> = Some(REASON);

/// Refuses to open an adapter.
pub fn open(requested: Option<&str>) -> Result<Gpu, Error> {
    Err(refused(requested))
}

/// Returns the error for a GPU that is requested by name or by flag.
pub fn refused(requested: Option<&str>) -> Error {
    let flag = requested.map_or("--backend gpu".to_owned(), |name| format!("--adapter {name}"));
    Error::machine(format!("{flag}: {REASON}"))
}

/// Fails with the reason why there is no GPU.
pub fn automatic() -> Result<Automatic, String> {
    Err(REASON.to_owned())
}

/// Returns no adapters, and the reason.
pub fn list() -> (Vec<GpuDevice>, Result<String, String>) {
    (Vec::new(), Err(REASON.to_owned()))
}

/// The type of a choice that this build never makes.
pub struct Automatic {
    /// The reason for the adapter.
    pub reason: String,
    never: std::convert::Infallible,
}

impl Automatic {
    /// Opens the adapter.
    pub fn open(&self) -> Result<Gpu, DeviceError> {
        match self.never {}
    }
}
