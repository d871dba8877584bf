//! An open device: its limits, its errors, and the memory through which results come back.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use super::{Adapter, AdapterKind, DeviceError};

/// A device ready for work. Cheap to share by reference; work from several threads is serialised.
pub struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: Adapter,
    faults: Arc<Mutex<Faults>>,
    pub(super) times: Mutex<Option<Vec<StageTime>>>,
    /// The memory through which the last result came back, for the next one.
    staging: Mutex<Option<wgpu::Buffer>>,
    counters: Mutex<Counters>,
}

/// The work that a device was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Number of dispatches of shaders.
    pub dispatches: u64,
    /// Number of submissions, each of which the host waited for.
    pub submissions: u64,
    /// Bytes of meshes and lists that were copied to the device; constants are left out.
    pub uploaded: u64,
    /// Bytes of results that were copied from the device.
    pub read_back: u64,
}

/// Longest time to wait for one submission. Bands are small enough for a hundredth of it on a slow GPU; a software adapter
/// takes minutes for the largest.
const PATIENCE: Duration = Duration::from_secs(600);

/// The errors since the last check.
#[derive(Default)]
struct Faults {
    /// An error that a test wants, and the number of checks before it.
    wanted: Option<(u32, DeviceError)>,
    /// The first error; later ones that follow from it are discarded.
    first: Option<DeviceError>,
    /// The loss of the device, which is permanent.
    loss: Option<DeviceError>,
}

/// The time that one stage took on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct StageTime {
    /// The stage's name.
    pub stage: &'static str,
    /// The device's own clock, in seconds, when the stage began.
    pub begin: f64,
    /// Seconds by that clock.
    pub seconds: f64,
}

/// Largest number of loop rounds on a software adapter. Mesa's llvmpipe silently ends all loops of an invocation after
/// 65 535 rounds in total, and counts the rounds of eight invocations at once. Most shaders take at most eight rounds for
/// each item, and eight invocations that diverge may take four times as many as one; stages that take more of either count
/// their items accordingly. 8000 crossings on a ray were observed to be too many.
const SOFTWARE_ROUNDS: u32 = 65_535 / 32;

/// The requirements of the shaders for a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Number of storage buffers of the shader with most of them.
    pub bindings: u32,
    /// Number of invocations of the largest workgroup.
    pub workgroup: u32,
}

impl Device {
    /// Opens an adapter with all its limits, which must be sufficient.
    pub fn open(adapter: &Adapter, needs: Needs) -> Result<Device, DeviceError> {
        let needs = [
            ("storage buffers a shader", adapter.limits.bindings, needs.bindings),
            ("invocations a workgroup", adapter.limits.workgroup, needs.workgroup),
        ];
        if let Some(&(what, found, needed)) = needs.iter().find(|(_, found, needed)| found < needed) {
            let (found, needed) = (u64::from(found), u64::from(needed));
            return Err(DeviceError::Inadequate { adapter: adapter.name.clone(), what, found, needed });
        }
        let wanted = wgpu::Features::SHADER_INT64
            | wgpu::Features::TIMESTAMP_QUERY
            | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let request = adapter.inner.request_device(&wgpu::DeviceDescriptor {
            label: Some("ldi-ops"),
            required_features: adapter.inner.features() & wanted,
            required_limits: adapter.inner.limits(),
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(request)
            .map_err(|error| DeviceError::NotOpened { adapter: adapter.name.clone(), reason: error.to_string() })?;
        let faults = Arc::new(Mutex::new(Faults::default()));
        let (name, kept) = (adapter.name.clone(), Arc::clone(&faults));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            held(&kept).first.get_or_insert_with(|| fault_of(&name, &error));
        }));
        let (name, kept) = (adapter.name.clone(), Arc::clone(&faults));
        device.set_device_lost_callback(move |reason, said| {
            // A dropped device is lost on purpose.
            if reason != wgpu::DeviceLostReason::Destroyed {
                held(&kept).loss.get_or_insert(DeviceError::Lost { adapter: name.clone(), reason: said });
            }
        });
        Ok(Device {
            device,
            queue,
            adapter: adapter.clone(),
            faults,
            times: Mutex::new(None),
            staging: Mutex::new(None),
            counters: Mutex::default(),
        })
    }

    /// Returns the adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Returns the first error since the last check; later errors that follow from it are discarded. A lost device
    /// stays lost.
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        let mut faults = held(&self.faults);
        match faults.wanted.take() {
            Some((0, error @ DeviceError::Lost { .. })) => faults.loss = Some(error),
            Some((0, error)) => faults.first = Some(error),
            Some((checks, error)) => faults.wanted = Some((checks - 1, error)),
            None => {}
        }
        let first = faults.first.take();
        faults.loss.clone().or(first).map_or(Ok(()), Err)
    }

    /// Has the device fail after this many checks for errors: once, but a loss is permanent. For tests.
    #[doc(hidden)]
    pub fn fail_after(&self, checks: u32, error: DeviceError) {
        held(&self.faults).wanted = Some((checks, error));
    }

    /// Starts or stops recording the times of all stages for [`take_stage_times`](Self::take_stage_times), where the adapter
    /// can measure them. Clears (stage `clear`) and copies to the host (`read back`) are included where
    /// [`times_transfers`](Self::times_transfers) is true. Timed stages do not overlap, and take longer together.
    pub fn keep_stage_times(&self, keep: bool) {
        *held(&self.times) = (keep && self.adapter.timestamps).then(Vec::new);
    }

    /// Returns whether the adapter can time clears and copies, besides dispatches.
    pub fn times_transfers(&self) -> bool {
        let needed = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        self.device.features().contains(needed)
    }

    /// Returns the times of all stages since the last call, in the order of execution; none where they are not
    /// recorded.
    pub fn take_stage_times(&self) -> Vec<StageTime> {
        let mut times = held(&self.times);
        times.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Refuses loops of this many rounds where the adapter would silently end them.
    pub(crate) fn admit_rounds(&self, rounds: u32) -> Result<(), DeviceError> {
        if self.adapter.kind != AdapterKind::Software || rounds <= SOFTWARE_ROUNDS {
            return Ok(());
        }
        Err(DeviceError::Inadequate {
            adapter: self.adapter.name.clone(),
            what: "guaranteed rounds of a loop",
            found: SOFTWARE_ROUNDS.into(),
            needed: rounds.into(),
        })
    }

    /// Returns the error for a buffer that would need more bytes than `limit` allows.
    pub(crate) fn too_large(&self, what: &'static str, needed: u64, limit: u64) -> DeviceError {
        DeviceError::TooLarge { adapter: self.adapter.name.clone(), what, needed, limit }
    }

    /// Returns the size in bytes of the largest buffer that a shader can bind as a whole.
    pub(crate) fn largest_binding(&self) -> u64 {
        self.adapter.limits.binding.min(self.adapter.limits.buffer)
    }

    /// Returns a new buffer with these contents, for shaders to read.
    pub(crate) fn upload(&self, label: &'static str, contents: &[u8]) -> Result<wgpu::Buffer, DeviceError> {
        let contents = if contents.is_empty() { &[0; 4] } else { contents };
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: true,
        });
        // `create_buffer_init` panics where no buffer could be created.
        self.check()?;
        buffer.get_mapped_range_mut(..).map_err(|error| self.lost(error.to_string()))?.copy_from_slice(contents);
        buffer.unmap();
        self.check()?;
        held(&self.counters).uploaded += contents.len() as u64;
        Ok(buffer)
    }

    /// Compiles a shader without the checks that wgpu adds to every access of a buffer, every loop and every division.
    pub(super) fn shader(&self, name: &'static str, source: &str) -> wgpu::ShaderModule {
        let source = wgpu::ShaderSource::Wgsl(source.into());
        let descriptor = wgpu::ShaderModuleDescriptor { label: Some(name), source };
        // SAFETY: all shaders are part of this library. Their indices are either those of an invocation, compared with
        // the number of items before use, or read from buffers that the host or other stages filled: vertices of
        // triangles, each of which the host has looked up before it copies them; rays within the clipped window of a
        // band, and nodes within the grid of spans that it was asked for; sets of few leaves, with one bit each in a table,
        // and nodes of a diagram, which lead to earlier ones and ask for leaves that `Combination::new` has counted; tallies
        // and totals, which the host makes for every band and leaf; offsets that are sums of counts, compared with the
        // capacity of the lists before anything is written. Loops count up to such numbers, and divisors are numbers of
        // columns, which are not zero. The twins compare every stage with the CPU in buffers that are filled with a word
        // before use.
        unsafe { self.device.create_shader_module_trusted(descriptor, wgpu::ShaderRuntimeChecks::unchecked()) }
    }

    /// Returns memory that a submission can copy this many bytes to, for the host to read.
    pub(super) fn staging(&self, bytes: u64) -> Result<wgpu::Buffer, DeviceError> {
        let kept = held(&self.staging).take().filter(|kept| kept.size() >= bytes);
        if let Some(kept) = kept {
            return Ok(kept);
        }
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("to the host"),
            size: bytes.max(256).next_multiple_of(4),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.check()?;
        Ok(staging)
    }

    /// Keeps memory for the next result.
    pub(super) fn keep_staging(&self, staging: wgpu::Buffer) {
        *held(&self.staging) = Some(staging);
    }

    /// Drops the memory that is kept for results.
    pub(crate) fn release_staging(&self) {
        *held(&self.staging) = None;
    }

    /// Counts a submission.
    pub(super) fn count(&self, dispatches: u64, read_back: u64) {
        let mut counters = held(&self.counters);
        counters.dispatches += dispatches;
        counters.submissions += 1;
        counters.read_back += read_back;
    }

    /// Returns the work since the last call.
    pub fn take_counters(&self) -> Counters {
        std::mem::take(&mut *held(&self.counters))
    }

    /// Waits for a submission.
    pub(super) fn wait(&self, submission: wgpu::SubmissionIndex) -> Result<(), DeviceError> {
        let wait = wgpu::PollType::Wait { submission_index: Some(submission), timeout: Some(PATIENCE) };
        // When a device is lost meanwhile, wgpu 30 calls the callback, and then panics.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(wait)));
        self.check()?;
        match polled {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(wgpu::PollError::Timeout)) => {
                Err(DeviceError::TimedOut { adapter: self.adapter.name.clone(), seconds: PATIENCE.as_secs() })
            }
            Ok(Err(error)) => Err(self.lost(error.to_string())),
            Err(_) => Err(self.lost("the driver stopped while the program waited for it".to_owned())),
        }
    }

    pub(super) fn lost(&self, reason: String) -> DeviceError {
        DeviceError::Lost { adapter: self.adapter.name.clone(), reason }
    }
}

/// Locks a mutex, even if another thread panicked while holding it.
pub(crate) fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn fault_of(adapter: &str, error: &wgpu::Error) -> DeviceError {
    let (adapter, reason) = (adapter.to_owned(), error.to_string());
    match error {
        wgpu::Error::OutOfMemory { .. } => DeviceError::OutOfMemory { adapter, reason },
        wgpu::Error::Validation { .. } | wgpu::Error::Internal { .. } => DeviceError::Rejected { adapter, reason },
    }
}
