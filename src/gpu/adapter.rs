//! The adapters of this machine, and the choice among them.

use super::DeviceError;

/// What an adapter is, as its driver says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum AdapterKind {
    /// A graphics card with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A GPU handed to a virtual machine.
    Virtual,
    /// Something else.
    Other,
    /// A program on the processor that behaves like a GPU; good for tests, and slower than the CPU's own sampler.
    Software,
}

impl AdapterKind {
    /// One word for people.
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

/// What an adapter allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdapterLimits {
    /// Bytes of the largest buffer.
    pub buffer: u64,
    /// Bytes of a buffer that a shader may see at once.
    pub binding: u64,
    /// Buffers that a shader may see at once.
    pub bindings: u32,
    /// Invocations of a workgroup.
    pub workgroup: u32,
    /// Bytes of a workgroup's own memory.
    pub workgroup_memory: u32,
}

/// One adapter, not opened yet.
#[derive(Clone, Debug)]
pub struct Adapter {
    pub(super) inner: wgpu::Adapter,
    /// Its name, as the driver has it.
    pub name: String,
    /// What it is.
    pub kind: AdapterKind,
    /// The interface it is reached by: vulkan, metal or dx12.
    pub api: &'static str,
    /// The driver's name and version.
    pub driver: String,
    /// What it allows.
    pub limits: AdapterLimits,
    /// Whether shaders may use 64-bit integers; where not, pairs of 32-bit ones do the same, slower.
    pub int64: bool,
    /// Whether it can time its own stages.
    pub timestamps: bool,
}

/// All adapters of this machine, the likeliest choice first; empty where there is no driver, or no loader to find one by.
pub fn adapters() -> Vec<Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
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

/// The adapter of the given name, of which case does not matter and a part is enough; without a name the first.
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
