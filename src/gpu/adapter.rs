//! The adapters of this machine, and the choice among them.

use super::DeviceError;

/// The kind of an adapter, as reported by its driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU passed through to a virtual machine.
    Virtual,
    /// Something else.
    Other,
    /// A software implementation of a GPU; useful for tests, and slower than the CPU's own sampler.
    Software,
}

impl AdapterKind {
    /// Returns the name, one word.
    pub fn name(self) -> &'static str {
        match self {
            AdapterKind::Discrete => "discrete",
            AdapterKind::Integrated => "integrated",
            AdapterKind::Virtual => "virtual",
            AdapterKind::Other => "other",
            AdapterKind::Software => "software",
        }
    }
}

/// The limits of an adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdapterLimits {
    /// Size of the largest buffer in bytes.
    pub buffer: u64,
    /// Size in bytes of the largest part of a buffer that a shader can bind.
    pub binding: u64,
    /// Number of buffers that a shader can bind at once.
    pub bindings: u32,
    /// Number of invocations of a workgroup.
    pub workgroup: u32,
    /// Size of workgroup memory in bytes.
    pub workgroup_memory: u32,
}

/// One adapter, not yet opened.
#[derive(Clone, Debug)]
pub struct Adapter {
    pub(super) inner: wgpu::Adapter,
    /// Its name, as reported by the driver.
    pub name: String,
    /// Its kind.
    pub kind: AdapterKind,
    /// The graphics API: vulkan, metal or dx12.
    pub api: &'static str,
    /// The driver's name and version.
    pub driver: String,
    /// Its limits.
    pub limits: AdapterLimits,
    /// True if shaders may use 64-bit integers; otherwise pairs of 32-bit ones give the same results more slowly.
    pub int64: bool,
    /// True if it can time its own stages.
    pub timestamps: bool,
}

/// Returns all adapters of this machine, the preferred one first; empty where there is no driver or no loader.
pub fn adapters() -> Vec<Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    // The only number of workgroups in a buffer is bounded by the shader that writes it, and no shader reads it back.
    descriptor.flags.remove(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    // In tests, the layers of the driver watch where they are installed.
    descriptor.flags.set(wgpu::InstanceFlags::VALIDATION, cfg!(debug_assertions));
    let instance = wgpu::Instance::new(descriptor);
    let found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let mut adapters: Vec<Adapter> = found.into_iter().map(describe).collect();
    adapters.sort_by_key(|adapter| adapter.kind);
    adapters
}

fn describe(inner: wgpu::Adapter) -> Adapter {
    let (info, limits, features) = (inner.get_info(), inner.limits(), inner.features());
    Adapter {
        name: info.name,
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
            wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
            wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
            wgpu::DeviceType::Cpu => AdapterKind::Software,
            wgpu::DeviceType::Other => AdapterKind::Other,
        },
        api: info.backend.to_str(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        limits: AdapterLimits {
            buffer: limits.max_buffer_size,
            binding: limits.max_storage_buffer_binding_size,
            bindings: limits.max_storage_buffers_per_shader_stage,
            workgroup: limits.max_compute_invocations_per_workgroup,
            workgroup_memory: limits.max_compute_workgroup_storage_size,
        },
        int64: features.contains(wgpu::Features::SHADER_INT64),
        timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
        inner,
    }
}

/// Returns the adapter of the given name, case-insensitive, of which a part is enough; without a name the first.
pub fn choose<'a>(adapters: &'a [Adapter], wanted: Option<&str>) -> Result<&'a Adapter, DeviceError> {
    let first = adapters.first().ok_or(DeviceError::NoAdapter)?;
    let Some(wanted) = wanted else { return Ok(first) };
    let lower = wanted.to_lowercase();
    if lower.trim().is_empty() {
        return Err(unknown(adapters, wanted));
    }
    let exact = adapters.iter().find(|adapter| adapter.name.to_lowercase() == lower);
    let mut partly = adapters.iter().filter(|adapter| adapter.name.to_lowercase().contains(&lower));
    match (exact, partly.next(), partly.next()) {
        (Some(adapter), _, _) | (None, Some(adapter), None) => Ok(adapter),
        _ => Err(unknown(adapters, wanted)),
    }
}

fn unknown(adapters: &[Adapter], wanted: &str) -> DeviceError {
    let names: Vec<String> = adapters.iter().map(|adapter| format!("`{}`", adapter.name)).collect();
    DeviceError::UnknownAdapter { wanted: wanted.to_owned(), known: names.join(", ") }
}
