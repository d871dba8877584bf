//! An open device: its limits, its errors, and read-back to host memory.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard};

use super::{Adapter, AdapterKind, DeviceError};

/// A device ready for work. Cheap to share by reference; work from several threads is serialised.
pub struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    adapter: Adapter,
    faults: Arc<Mutex<Faults>>,
    pub(super) times: Mutex<Option<Vec<StageTime>>>,
}

/// The errors since the last check.
#[derive(Default)]
struct Faults {
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
    /// Seconds by the device's own clock.
    pub seconds: f64,
}

/// Largest number of loop rounds on a software adapter. Mesa's llvmpipe silently ends all loops of an invocation after
/// 65 535 rounds in total, and counts the rounds of eight invocations at once. Shaders have at most eight loops over
/// the same items, and eight invocations that diverge may take four times as many rounds as one; 8000 crossings on a
/// ray were observed to be too many.
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
        Ok(Device { device, queue, adapter: adapter.clone(), faults, times: Mutex::new(None) })
    }

    /// Returns the adapter that was opened.
    pub fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    /// Returns the first error since the last check; later errors that follow from it are discarded. A lost device
    /// stays lost.
    pub(crate) fn check(&self) -> Result<(), DeviceError> {
        let mut faults = held(&self.faults);
        let first = faults.first.take();
        faults.loss.clone().or(first).map_or(Ok(()), Err)
    }

    /// Starts to record the times of all stages for [`take_stage_times`](Self::take_stage_times), where the adapter can
    /// measure them. Clears (stage `clear`) and copies to the host (`read back`) are included where
    /// [`times_transfers`](Self::times_transfers) is true.
    pub fn keep_stage_times(&self) {
        if self.adapter.timestamps {
            *held(&self.times) = Some(Vec::new());
        }
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
        Ok(buffer)
    }

    /// Waits for all work submitted so far.
    pub(super) fn wait(&self) -> Result<(), DeviceError> {
        // When a device is lost meanwhile, wgpu 30 calls the callback, and then panics.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(wgpu::PollType::wait_indefinitely())));
        self.check()?;
        match polled {
            Ok(polled) => polled.map(|_| ()).map_err(|error| self.lost(error.to_string())),
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
