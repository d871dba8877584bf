//! The bandwidth of a device's copies in its own memory: the reference for memory-bound stages.

use std::time::Instant;

use super::recorder::Recorder;
use super::{Device, DeviceError};

/// Number of copies submitted together, so that without timestamps the submission overhead matters little.
const COPIES: usize = 8;

/// Number of rounds after the first, which warms up and has the buffers cleared.
const ROUNDS: usize = 7;

impl Device {
    /// Returns the bandwidth of copies of `bytes` from one buffer to another in bytes per second, each byte counted as
    /// read and as written: the median of many. The size is limited to the largest buffer of the adapter. Measured by
    /// the device's own clock where it [times transfers](Self::times_transfers), else by the host's.
    pub fn copy_bandwidth(&self, bytes: u64) -> Result<f64, DeviceError> {
        let bytes = bytes.clamp(4, self.adapter().limits.buffer) / 4 * 4;
        let [a, b] = ["copied", "copied too"].map(|label| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        self.check()?;
        let mut seconds = Vec::new();
        for round in 0..=ROUNDS {
            let mut recorder = Recorder::timed(self, self.times_transfers());
            // Alternating directions, so that every copy waits for the one before.
            for copy in 0..COPIES {
                let (from, to) = if copy % 2 == 0 { (&a, &b) } else { (&b, &a) };
                recorder.copy(from, to, bytes);
            }
            let start = Instant::now();
            let (_, times) = recorder.run(|_| ())?;
            let wall = start.elapsed().as_secs_f64();
            match round {
                0 => {}
                _ if times.is_empty() => seconds.push(wall / COPIES as f64),
                _ => seconds.extend(times.iter().map(|time| time.seconds)),
            }
        }
        seconds.sort_unstable_by(f64::total_cmp);
        Ok(2.0 * bytes as f64 / seconds[seconds.len() / 2])
    }
}
