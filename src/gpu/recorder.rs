//! Recordings: dispatches, clears and copies, submitted together and waited for once.

use super::{Device, DeviceError, Kernel, StageTime, held};

/// The number of workgroups of a dispatch.
#[derive(Clone, Copy)]
pub(crate) enum Workgroups<'b> {
    /// Along two dimensions.
    Counted(u32, u32),
    /// Three words of a buffer, from an offset in bytes.
    Indirect(&'b wgpu::Buffer, u64),
}

/// Number of invocations of a workgroup of most kernels.
pub(crate) const WORKGROUP: u32 = 64;

/// Number of workgroups along the first dimension of a dispatch; more go along the second. Every adapter allows 65 535.
const MOST_WORKGROUPS: u32 = 32_768;

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

/// The constants of a dispatch in a recording.
#[derive(Clone, Copy)]
pub(crate) struct Uniform {
    buffer: usize,
    offset: u32,
    bytes: u64,
}

/// A list of commands for the device: dispatches, clears and copies, in order. Consecutive dispatches share one pass, unless
/// each is timed.
pub(crate) struct Recorder<'d> {
    device: &'d Device,
    encoder: wgpu::CommandEncoder,
    pass: Option<wgpu::ComputePass<'static>>,
    timed: Vec<&'static str>,
    queries: Option<wgpu::QuerySet>,
    uniforms: Vec<(wgpu::Buffer, Vec<u8>)>,
    brought: Vec<Brought>,
    dispatches: u64,
}

/// Part of a buffer that is to be read back.
struct Brought {
    buffer: wgpu::Buffer,
    first: u64,
    bytes: u64,
}

/// Largest number of stages that one recording can time.
const MOST_TIMED: u32 = 256;

/// Bytes of a buffer of uniforms, and the alignment of each uniform, which every adapter allows.
const UNIFORM_BYTES: u64 = 16 << 10;
const UNIFORM_ALIGNMENT: usize = 256;

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
        Recorder {
            device,
            encoder: device.device.create_command_encoder(&Default::default()),
            pass: None,
            timed: Vec::new(),
            queries,
            uniforms: Vec::new(),
            brought: Vec::new(),
            dispatches: 0,
        }
    }

    /// Adds constants for the dispatches of this recording.
    pub fn uniform(&mut self, contents: &[u8]) -> Uniform {
        let bytes = contents.len() as u64;
        let has_room = |(_, written): &(_, Vec<u8>)| written.len() as u64 + bytes <= UNIFORM_BYTES;
        if !self.uniforms.last().is_some_and(has_room) {
            let buffer = self.device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("uniforms"),
                size: UNIFORM_BYTES,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            self.uniforms.push((buffer, Vec::new()));
        }
        let buffer = self.uniforms.len() - 1;
        let (_, written) = &mut self.uniforms[buffer];
        let offset = written.len() as u32;
        written.extend_from_slice(contents);
        written.resize(written.len().next_multiple_of(UNIFORM_ALIGNMENT), 0);
        Uniform { buffer, offset, bytes }
    }

    /// Runs a kernel over its buffers, each at its binding, with its constants at binding 0.
    pub fn dispatch(
        &mut self,
        kernel: &Kernel,
        uniform: Uniform,
        buffers: &[(u32, &wgpu::Buffer)],
        workgroups: Workgroups,
    ) {
        let (constants, _) = &self.uniforms[uniform.buffer];
        let constants =
            wgpu::BufferBinding { buffer: constants, offset: 0, size: wgpu::BufferSize::new(uniform.bytes) };
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(constants) }];
        entries.extend(
            buffers
                .iter()
                .map(|&(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() }),
        );
        let group = self.device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &kernel.layout,
            entries: &entries,
        });
        if self.queries.is_some() {
            self.pass = None;
        }
        if self.pass.is_none() {
            self.pass = Some(self.begin_pass(kernel.name));
        }
        let pass = self.pass.as_mut().expect("a pass was begun");
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &group, &[uniform.offset]);
        match workgroups {
            Workgroups::Counted(across, down) => pass.dispatch_workgroups(across, down, 1),
            Workgroups::Indirect(buffer, offset) => pass.dispatch_workgroups_indirect(buffer, offset),
        }
        self.dispatches += 1;
    }

    fn begin_pass(&mut self, name: &'static str) -> wgpu::ComputePass<'static> {
        let index = self.timed.len() as u32;
        let timestamp_writes =
            self.queries.as_ref().filter(|_| index < MOST_TIMED).map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(2 * index),
                end_of_pass_write_index: Some(2 * index + 1),
            });
        if timestamp_writes.is_some() {
            self.timed.push(name);
        }
        let label = self.queries.is_some().then_some(name);
        self.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes }).forget_lifetime()
    }

    /// Records a command that is not a dispatch, as a stage of its own where the adapter has timestamps outside of
    /// passes.
    fn transfer(&mut self, name: &'static str, record: impl FnOnce(&mut wgpu::CommandEncoder)) {
        self.pass = None;
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

    /// Schedules part of a buffer, in whole words, to be read back by [`finish`](Self::finish), in the order of the calls.
    pub fn read_back(&mut self, buffer: &wgpu::Buffer, first: u64, bytes: u64) {
        self.brought.push(Brought { buffer: buffer.clone(), first, bytes });
    }

    /// Submits all commands, waits until they are done, and passes the data read back, as 32-bit words, to `take`.
    pub fn finish<T>(self, take: impl FnOnce(&[&[u32]]) -> T) -> Result<T, DeviceError> {
        let device = self.device;
        let (taken, stage_times) = self.run(take)?;
        if let Some(times) = &mut *held(&device.times) {
            times.extend(stage_times);
        }
        Ok(taken)
    }

    /// Does the same as [`finish`](Self::finish), and returns the times of the stages where they were measured.
    pub(super) fn run<T>(mut self, take: impl FnOnce(&[&[u32]]) -> T) -> Result<(T, Vec<StageTime>), DeviceError> {
        let device = self.device;
        let bytes: u64 = self.brought.iter().map(|brought| brought.bytes).sum();
        let timed_bytes = 16 * self.timed_at_the_end() as u64;
        let staging = device.staging(bytes + timed_bytes)?;
        let mut at = 0;
        let brought = std::mem::take(&mut self.brought);
        if bytes > 0 {
            self.transfer("read back", |encoder| {
                for Brought { buffer, first, bytes } in brought.iter().filter(|brought| brought.bytes > 0) {
                    encoder.copy_buffer_to_buffer(buffer, *first, &staging, at, *bytes);
                    at += bytes;
                }
            });
        }
        self.pass = None;
        let timed = std::mem::take(&mut self.timed);
        if let Some(queries) = self.queries.take().filter(|_| !timed.is_empty()) {
            let resolved = device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("stage times"),
                size: timed_bytes,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            self.encoder.resolve_query_set(&queries, 0..2 * timed.len() as u32, &resolved, 0);
            self.encoder.copy_buffer_to_buffer(&resolved, 0, &staging, bytes, 16 * timed.len() as u64);
        }
        for (buffer, contents) in &self.uniforms {
            device.queue.write_buffer(buffer, 0, contents);
        }
        let submission = device.queue.submit([self.encoder.finish()]);
        let (sender, receiver) = std::sync::mpsc::channel();
        // The receiver outlives the callback of everything that is waited for.
        let mapped = bytes + 16 * timed.len() as u64;
        if mapped > 0 {
            staging.map_async(wgpu::MapMode::Read, ..mapped, move |mapped| drop(sender.send(mapped)));
        }
        device.count(self.dispatches, bytes);
        device.wait(submission)?;
        for mapped in receiver.try_iter() {
            mapped.map_err(|error| device.lost(error.to_string()))?;
        }
        let result = {
            let view = match mapped {
                0 => None,
                _ => Some(staging.get_mapped_range(..mapped).map_err(|error| device.lost(error.to_string()))?),
            };
            let words: &[u32] = view.as_deref().map_or(&[], bytemuck::cast_slice);
            let (mut parts, mut rest) = (Vec::with_capacity(brought.len()), words);
            for part in &brought {
                let (first, others) = rest.split_at(part.bytes as usize / 4);
                parts.push(first);
                rest = others;
            }
            (take(&parts), times_of(device, &timed, rest))
        };
        if mapped > 0 {
            staging.unmap();
        }
        device.keep_staging(staging);
        Ok(result)
    }

    /// Returns the number of stages that will be timed once the copies to the host are recorded.
    fn timed_at_the_end(&self) -> usize {
        match self.queries.is_some() {
            true => (self.timed.len() + 1).min(MOST_TIMED as usize),
            false => 0,
        }
    }
}

fn times_of(device: &Device, stages: &[&'static str], words: &[u32]) -> Vec<StageTime> {
    let period = f64::from(device.queue.get_timestamp_period()) * 1e-9;
    let ticks = |i: usize| u64::from(words[2 * i]) | u64::from(words[2 * i + 1]) << 32;
    let time = |(i, &stage): (usize, &&'static str)| StageTime {
        stage,
        begin: ticks(2 * i) as f64 * period,
        seconds: ticks(2 * i + 1).saturating_sub(ticks(2 * i)) as f64 * period,
    };
    stages.iter().enumerate().map(time).collect()
}
