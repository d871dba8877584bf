//! An open device: its limits, its errors, and the way back to host memory.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard};

use super::{Adapter, AdapterKind, DeviceError};

/// A device ready for work. Cheap to share by reference; work from several threads is taken one job after another.
pub struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: Adapter,
    faults: Arc<Mutex<Faults>>,
    pub(super) times: Mutex<Option<Vec<StageTime>>>,
}

/// What went wrong since the last look.
#[derive(Default)]
struct Faults {
    /// The first error; those that follow from it are forgotten with it.
    first: Option<DeviceError>,
    /// The loss of the device, which nothing mends.
    loss: Option<DeviceError>,
}

/// How long one stage ran on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct StageTime {
    /// The stage's name.
    pub stage: &'static str,
    /// Seconds by the device's own clock.
    pub seconds: f64,
}

/// Mesa's llvmpipe ends all loops of an invocation, and says nothing, when together they have gone round 65 535 times, and
/// counts the rounds of eight invocations at once. Shaders have at most eight loops over the same items, and eight invocations
/// that are not in step may go round four times as often as one; 8000 crossings on a ray were seen to be too many.
const SOFTWARE_ROUNDS: u32 = 65_535 / 32;

/// What the shaders that a device is opened for ask of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Storage buffers that the widest shader sees.
    pub bindings: u32,
    /// Invocations of the largest workgroup.
    pub workgroup: u32,
}

impl Device {
    /// Opens an adapter with all that it allows, which has to be enough.
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
            // A device that is dropped is lost on purpose.
            if reason != wgpu::DeviceLostReason::Destroyed {
                held(&kept).loss.get_or_insert(DeviceError::Lost { adapter: name.clone(), reason: said });
            }
        });
        Ok(Device { device, queue, adapter: adapter.clone(), faults, times: Mutex::new(None) })
    }

    /// The adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// The first error since the last look; errors that follow from it are forgotten with it. A device that is lost stays
    /// lost.
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        let mut faults = held(&self.faults);
        let first = faults.first.take();
        faults.loss.clone().or(first).map_or(Ok(()), Err)
    }

    /// From now on the times of all stages are kept for [`take_stage_times`](Self::take_stage_times), where the adapter can
    /// tell them. Those of clears (stage `clear`) and of copies to the host (`read back`) are among them where
    /// [`times_transfers`](Self::times_transfers) says so.
    pub fn keep_stage_times(&self) {
        if self.adapter.timestamps {
            *held(&self.times) = Some(Vec::new());
        }
    }

    /// Whether the adapter can time clears and copies, besides dispatches.
    pub fn times_transfers(&self) -> bool {
        let needed = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        self.device.features().contains(needed)
    }

    /// The times of all stages since the last call, in the order they ran; none where they are not kept.
    pub fn take_stage_times(&self) -> Vec<StageTime> {
        let mut times = held(&self.times);
        times.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Refuses loops of so many rounds where the adapter would end them in silence.
    pub(crate) fn admit_rounds(&self, rounds: u32) -> Result<(), DeviceError> {
        if self.adapter.kind != AdapterKind::Software || rounds <= SOFTWARE_ROUNDS {
            return Ok(());
        }
        Err(DeviceError::Inadequate {
            adapter: self.adapter.name.clone(),
            what: "rounds of a loop that it goes through for certain",
            found: SOFTWARE_ROUNDS.into(),
            needed: rounds.into(),
        })
    }

    /// The error of a buffer that would need more bytes than `limit` allows.
    pub(crate) fn too_large(&self, what: &'static str, needed: u64, limit: u64) -> DeviceError {
        DeviceError::TooLarge { adapter: self.adapter.name.clone(), what, needed, limit }
    }

    /// Bytes of the largest buffer that a shader may see as a whole.
    pub(crate) fn largest_binding(&self) -> u64 {
        self.adapter.limits.binding.min(self.adapter.limits.buffer)
    }

    /// A new buffer with these contents, for shaders to read.
    pub(crate) fn upload(&self, label: &'static str, contents: &[u8]) -> Result<wgpu::Buffer, DeviceError> {
        let contents = if contents.is_empty() { &[0; 4] } else { contents };
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: contents.len() as u64,
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: true,
        });
        // `create_buffer_init` panics where there was no buffer to be had.
        self.check()?;
        buffer.get_mapped_range_mut(..).map_err(|error| self.lost(error.to_string()))?.copy_from_slice(contents);
        buffer.unmap();
        self.check()?;
        Ok(buffer)
    }

    /// Waits for all work handed over so far.
    pub(super) fn wait(&self) -> Result<(), DeviceError> {
        // Of a device that is lost in the meantime wgpu 30 tells the callback, and then panics.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::wait_indefinitely())));
        self.check()?;
        match polled {
            Ok(polled) => polled.map(|_| ()).map_err(|error| self.lost(error.to_string())),
            Err(_) => Err(self.lost("the driver gave up while it was waited for".to_owned())),
        }
    }

    pub(super) fn lost(&self, reason: String) -> DeviceError {
        DeviceError::Lost { adapter: self.adapter.name.clone(), reason }
    }
}

/// What a mutex guards, whoever panicked while holding it.
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
