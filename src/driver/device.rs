//! The GPUs of this machine, as results and listings name them.

use crate::sampler::MaskIntersection;

/// An open GPU.
pub struct Gpu {
    /// The name in results.
    pub name: String,
    /// The sampler of its device, which threads may share.
    pub sampler: Box<dyn MaskIntersection + Send + Sync>,
}

/// An adapter, as its driver describes it. Sizes are in bytes.
#[derive(Clone, Debug)]
pub struct GpuDevice {
    /// The name.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// The graphics interface: `vulkan`, `metal`, `dx12`.
    pub api: &'static str,
    /// The driver, with its version.
    pub driver: String,
    /// The largest buffer.
    pub largest_buffer: u64,
    /// The largest part of a buffer that a shader can access at once.
    pub largest_binding: u64,
    /// The number of buffers that a shader can access at once.
    pub bindings: u32,
    /// The most invocations of a workgroup.
    pub workgroup: u32,
    /// The memory that a workgroup shares.
    pub workgroup_memory: u32,
    /// True if shaders have native 64-bit integers.
    pub int64: bool,
    /// True if shaders can be timed on the device.
    pub timestamps: bool,
}
