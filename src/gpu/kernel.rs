//! Compiled entry points, and the recording of their dispatches.

use super::{Device, DeviceError, StageTime, held};

/// The access of a shader to one of its buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Uniform,
    Read,
    Write,
}

/// One compiled entry point of a shader, with its buffers in bind group 0 at their declared bindings.
pub(crate) struct Kernel {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    name: &'static str,
}

impl Kernel {
    /// Compiles `entry` of a shader, with the listed access to each binding.
    pub fn new(
        device: &Device,
        name: &'static str,
        source: &str,
        entry: &str,
        bindings: &[(u32, Access)],
    ) -> Result<Kernel, DeviceError> {
        let module = device.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let entries: Vec<wgpu::BindGroupLayoutEntry> = bindings
            .iter()
            .map(|&(binding, access)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: match access {
                        Access::Uniform => wgpu::BufferBindingType::Uniform,
                        Access::Read => wgpu::BufferBindingType::Storage { read_only: true },
                        Access::Write => wgpu::BufferBindingType::Storage { read_only: false },
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let layout = device
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries });
        let pipeline_layout = device.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        });
        device.check()?;
        Ok(Kernel { pipeline, layout, name })
    }
}

/// The number of workgroups of a dispatch.
pub(crate) enum Workgroups<'b> {
    Counted(u32, u32),
    Indirect(&'b wgpu::Buffer),
}

/// Number of invocations of a workgroup of most kernels.
pub(crate) const WORKGROUP: u32 = 64;

/// Number of workgroups along the first dimension of a dispatch; more go along the second. Every adapter allows 65 535.
pub(crate) const MOST_WORKGROUPS: u32 = 32_768;

/// Returns the workgroups for one invocation per item.
pub(crate) fn workgroups(items: u32) -> Workgroups<'static> {
    counted(items.div_ceil(WORKGROUP))
}

/// Returns this many workgroups, or a few more.
pub(crate) fn counted(count: u32) -> Workgroups<'static> {
    let count = count.max(1);
    let across = count.min(MOST_WORKGROUPS);
    Workgroups::Counted(across, count.div_ceil(across))
}

/// A list of commands for the device: dispatches, clears and copies, in order.
pub(crate) struct Recorder<'d> {
    device: &'d Device,
    encoder: wgpu::CommandEncoder,
    timed: Vec<&'static str>,
    queries: Option<wgpu::QuerySet>,
    staged: Vec<wgpu::Buffer>,
}

/// Largest number of stages that one recording can time.
const MOST_TIMED: u32 = 256;

impl<'d> Recorder<'d> {
    /// Returns an empty recording, timed where the device records times.
    pub fn new(device: &'d Device) -> Recorder<'d> {
        Recorder::timed(device, held(&device.times).is_some())
    }

    /// Returns an empty recording, timed if `is_timed`, which the adapter must support.
    pub(super) fn timed(device: &'d Device, is_timed: bool) -> Recorder<'d> {
        let queries = is_timed.then(|| {
            device.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stage times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST_TIMED,
            })
        });
        let encoder = device.device.create_command_encoder(&Default::default());
        Recorder { device, encoder, timed: Vec::new(), queries, staged: Vec::new() }
    }

    /// Returns a small buffer of constants for the dispatches of this recording.
    pub fn uniform(&self, contents: &[u8]) -> wgpu::Buffer {
        let buffer = self.device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("uniform"),
            size: contents.len() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        // If the buffer could not be created, this adds an error for `finish` to find; mapping the buffer would panic.
        self.device.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// Runs a kernel over its buffers, each at its binding.
    pub fn dispatch(&mut self, kernel: &Kernel, buffers: &[(u32, &wgpu::Buffer)], workgroups: Workgroups) {
        let entries: Vec<wgpu::BindGroupEntry> = buffers
            .iter()
            .map(|&(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let group = self.device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &kernel.layout,
            entries: &entries,
        });
        let index = self.timed.len() as u32;
        let timestamp_writes =
            self.queries.as_ref().filter(|_| index < MOST_TIMED).map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(2 * index),
                end_of_pass_write_index: Some(2 * index + 1),
            });
        if timestamp_writes.is_some() {
            self.timed.push(kernel.name);
        }
        let descriptor = wgpu::ComputePassDescriptor { label: Some(kernel.name), timestamp_writes };
        let mut pass = self.encoder.begin_compute_pass(&descriptor);
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &group, &[]);
        match workgroups {
            Workgroups::Counted(across, down) => pass.dispatch_workgroups(across, down, 1),
            Workgroups::Indirect(buffer) => pass.dispatch_workgroups_indirect(buffer, 0),
        }
    }

    /// Records a command that is not a dispatch, as a stage of its own where the adapter has timestamps outside of
    /// passes.
    fn transfer(&mut self, name: &'static str, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        let index = self.timed.len() as u32;
        let queries = self.queries.as_ref().filter(|_| index < MOST_TIMED && self.device.times_transfers());
        if let Some(queries) = queries {
            self.encoder.write_timestamp(queries, 2 * index);
        }
        record(&mut self.encoder);
        if let Some(queries) = queries {
            self.encoder.write_timestamp(queries, 2 * index + 1);
            self.timed.push(name);
        }
    }

    /// Sets the first `bytes` of a buffer to zero.
    pub fn clear(&mut self, buffer: &wgpu::Buffer, bytes: u64) {
        self.transfer("clear", |encoder| encoder.clear_buffer(buffer, 0, Some(bytes)));
    }

    /// Copies the first `bytes` of a buffer to another.
    pub(super) fn copy(&mut self, from: &wgpu::Buffer, to: &wgpu::Buffer, bytes: u64) {
        self.transfer("copy", |encoder| encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes));
    }

    /// Schedules part of a buffer to be read back by [`finish`](Self::finish), in the order of the calls.
    pub fn read_back(&mut self, buffer: &wgpu::Buffer, first: u64, bytes: u64) {
        let staging = self.device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("to the host"),
            size: bytes.max(4),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if bytes > 0 {
            self.transfer("read back", |encoder| encoder.copy_buffer_to_buffer(buffer, first, &staging, 0, bytes));
        }
        self.staged.push(staging);
    }

    /// Submits all commands, waits until they are done, and returns the data to be read back, as 32-bit words.
    pub fn finish(self) -> Result<Vec<Vec<u32>>, DeviceError> {
        let device = self.device;
        let (brought, stage_times) = self.run()?;
        if let Some(times) = &mut *held(&device.times) {
            times.extend(stage_times);
        }
        Ok(brought)
    }

    /// Does the same as [`finish`](Self::finish), and returns the times of the stages where they were measured.
    pub(super) fn run(mut self) -> Result<(Vec<Vec<u32>>, Vec<StageTime>), DeviceError> {
        let device = self.device;
        let times = self.queries.take().filter(|_| !self.timed.is_empty()).map(|queries| {
            let bytes = 16 * self.timed.len() as u64;
            let resolved = device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("stage times"),
                size: bytes,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            self.encoder.resolve_query_set(&queries, 0..2 * self.timed.len() as u32, &resolved, 0);
            self.read_back(&resolved, 0, bytes);
        });
        device.queue.submit([self.encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        for staging in &self.staged {
            let sender = sender.clone();
            // The receiver outlives the callbacks of everything that is waited for.
            staging.map_async(wgpu::MapMode::Read, .., move |mapped| drop(sender.send(mapped)));
        }
        drop(sender);
        device.wait()?;
        for mapped in receiver.try_iter() {
            mapped.map_err(|error| device.lost(error.to_string()))?;
        }
        let mut brought = Vec::with_capacity(self.staged.len());
        for staging in &self.staged {
            let view = staging.get_mapped_range(..).map_err(|error| device.lost(error.to_string()))?;
            brought.push(bytemuck::pod_collect_to_vec::<u8, u32>(&view));
        }
        let mut stage_times = Vec::new();
        if times.is_some() {
            let words = brought.pop().unwrap_or_default();
            stage_times = times_of(device, &self.timed, &words);
        }
        Ok((brought, stage_times))
    }
}

fn times_of(device: &Device, stages: &[&'static str], words: &[u32]) -> Vec<StageTime> {
    let period = f64::from(device.queue.get_timestamp_period()) * 1e-9;
    let ticks = |i: usize| u64::from(words[2 * i]) | u64::from(words[2 * i + 1]) << 32;
    let seconds = |i: usize| ticks(2 * i + 1).saturating_sub(ticks(2 * i)) as f64 * period;
    stages.iter().enumerate().map(|(i, &stage)| StageTime { stage, seconds: seconds(i) }).collect()
}
