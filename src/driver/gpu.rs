//! The GPUs of this machine, as the program sees them; `no_gpu.rs` takes this module's place in builds without them.

use super::backend::{Gpu, GpuDevice};
use crate::Error;
use crate::gpu::{self, Adapter, AdapterKind, DeviceError};
use crate::sampler::gpu::{GpuOptions, GpuSampler};

/// Why this build can use no GPU, where it cannot.
pub const ABSENT: Option<&str> = None;

/// Opens the adapter of a name, or the first one whatever it is: who asks for a GPU by name or by flag gets it or an error.
pub fn open(wanted: Option<&str>) -> Result<Gpu, Error> {
    let (name, sampler) = sampler(wanted)?;
    Ok(Gpu { name, sampler: Box::new(sampler) })
}

/// The sampler of such an adapter and what it is called in results, for those that do more on its device than sample.
pub fn sampler(wanted: Option<&str>) -> Result<(String, GpuSampler), DeviceError> {
    let adapters = gpu::adapters();
    opened(gpu::choose(&adapters, wanted)?)
}

/// The GPU that `auto` takes, not opened yet, with why it is that one; or why there is none.
pub fn automatic() -> Result<Automatic, String> {
    choose(&gpu::adapters())
}

/// All adapters, and what `auto` would take of them or why nothing.
pub fn list() -> (Vec<GpuDevice>, Result<String, String>) {
    let adapters = gpu::adapters();
    let automatic = choose(&adapters).map(|automatic| automatic.reason);
    (adapters.into_iter().map(describe).collect(), automatic)
}

/// A choice that `auto` made.
pub struct Automatic {
    adapter: Adapter,
    /// The reason for this adapter, for people.
    pub reason: String,
}

impl Automatic {
    /// Opens the adapter.
    pub fn open(&self) -> Result<Gpu, DeviceError> {
        let (name, sampler) = opened(&self.adapter)?;
        Ok(Gpu { name, sampler: Box::new(sampler) })
    }
}

/// The first adapter that is certainly hardware. A software adapter loses to the CPU's own sampler, and of what says nothing
/// of itself nothing is known.
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
            Err(format!("{name} is no hardware, but software that the CPU's own sampler outruns"))
        }
        (None, Some(Adapter { name, .. })) => Err(format!("{name} does not say that it is a GPU")),
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
