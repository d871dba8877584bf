//! In the place of `gpu.rs` in builds without the feature `gpu`: there is no GPU, and that is what it says.

use super::backend::{Gpu, GpuDevice};
use crate::Error;
use crate::gpu::DeviceError;

const WHY: &str = "this build has no GPU sampler";

/// The reason why this build can use no GPU.
pub const ABSENT: Option<&str> = Some(WHY);

/// Refuses to open an adapter.
pub fn open(wanted: Option<&str>) -> Result<Gpu, Error> {
    Err(refused(wanted))
}

/// Tells who asks for a GPU by name or by flag that there is none.
pub fn refused(wanted: Option<&str>) -> Error {
    let flag = wanted.map_or("--backend gpu".to_owned(), |name| format!("--adapter {name}"));
    Error::machine(format!("{flag}: {WHY}"))
}

/// Returns the reason why there is no GPU.
pub fn automatic() -> Result<Automatic, String> {
    Err(WHY.to_owned())
}

/// Returns no adapters, and the reason.
pub fn list() -> (Vec<GpuDevice>, Result<String, String>) {
    (Vec::new(), Err(WHY.to_owned()))
}

/// A choice that is never made.
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
