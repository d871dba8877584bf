//! Lists, chooses and opens the GPUs of this machine. Builds without the feature `gpu` use `no_gpu.rs` instead.

use super::device::{Gpu, GpuDevice};
use crate::Error;
use crate::gpu::{self, Adapter, AdapterKind, DeviceError};
use crate::sampler::gpu::{GpuOptions, GpuSampler};

/// The reason why this build has no GPU sampler, if it has none.
pub const ABSENT: Option<&str> = None;

/// Opens the adapter of a name, or the first adapter of any kind. A request by name or by flag never falls back to the CPU.
pub fn open(requested: Option<&str>) -> Result<Gpu, Error> {
    let (name, sampler) = sampler(requested)?;
    Ok(Gpu { name, sampler: Box::new(sampler) })
}

/// Returns the name of such an adapter for results, and its sampler, whose device sums use for more than sampling.
pub fn sampler(requested: Option<&str>) -> Result<(String, GpuSampler), DeviceError> {
    let adapters = gpu::adapters();
    opened(gpu::choose(&adapters, requested)?)
}

/// Returns the GPU that `auto` takes, not opened yet.
///
/// # Errors
/// The reason why there is none.
pub fn automatic() -> Result<Automatic, String> {
    choose(&gpu::adapters())
}

/// Returns all adapters, and the reason why `auto` takes one of them or none.
pub fn list() -> (Vec<GpuDevice>, Result<String, String>) {
    let adapters = gpu::adapters();
    let automatic = choose(&adapters).map(|automatic| automatic.reason);
    (adapters.into_iter().map(describe).collect(), automatic)
}

/// The adapter that `auto` takes.
pub struct Automatic {
    adapter: Adapter,
    /// The reason for this adapter, as text.
    pub reason: String,
}

impl Automatic {
    /// Opens the adapter.
    pub fn open(&self) -> Result<Gpu, DeviceError> {
        let (name, sampler) = opened(&self.adapter)?;
        Ok(Gpu { name, sampler: Box::new(sampler) })
    }
}

/// Returns the first adapter that is certainly hardware. The CPU sampler is faster than a software adapter, and an adapter of
/// unknown kind may be one.
fn choose(adapters: &[Adapter]) -> Result<Automatic, String> {
    let hardware = |adapter: &&Adapter| match adapter.kind {
        AdapterKind::Discrete | AdapterKind::Integrated | AdapterKind::Virtual => true,
        AdapterKind::Other | AdapterKind::Software => false,
    };
    match (adapters.iter().find(hardware), adapters.first()) {
        (Some(adapter), _) => {
            let reason = format!("{} is the first GPU, {}", adapter.name, adapter.kind.name());
            Ok(Automatic { adapter: adapter.clone(), reason })
        }
        (None, Some(Adapter { name, kind: AdapterKind::Software, .. })) => {
            Err(format!("{name} is a software adapter, which is slower than the CPU sampler"))
        }
        (None, Some(Adapter { name, .. })) => Err(format!("{name} does not report that it is a GPU")),
        (None, None) => Err("no GPU was found".to_owned()),
    }
}

fn opened(adapter: &Adapter) -> Result<(String, GpuSampler), DeviceError> {
    let sampler = GpuSampler::open(adapter, GpuOptions::default())?;
    Ok((format!("{}, {}, {}", adapter.name, adapter.api, adapter.driver), sampler))
}

fn describe(adapter: Adapter) -> GpuDevice {
    GpuDevice {
        kind: adapter.kind.name(),
        api: adapter.api,
        driver: adapter.driver,
        largest_buffer: adapter.limits.buffer,
        largest_binding: adapter.limits.binding,
        bindings: adapter.limits.bindings,
        workgroup: adapter.limits.workgroup,
        workgroup_memory: adapter.limits.workgroup_memory,
        int64: adapter.int64,
        timestamps: adapter.timestamps,
        name: adapter.name,
    }
}
