//! Buffers that grow and are kept from one job to the next.

use super::{Device, DeviceError};

/// Bytes of so many 32-bit words.
pub(crate) fn bytes_of(words: u64) -> u64 {
    4 * words
}

/// Named buffers of a device, each as large as it ever had to be.
pub(crate) struct Pool {
    prefill: Option<u32>,
    buffers: Vec<(&'static str, wgpu::Buffer)>,
}

impl Pool {
    /// No buffer yet. Where a word is given, buffers are filled with it each time they are handed out.
    pub fn new(prefill: Option<u32>) -> Pool {
        Pool { prefill, buffers: Vec::new() }
    }

    /// The buffer of this name with room for at least `bytes`, which holds anything.
    pub fn room(&mut self, device: &Device, name: &'static str, bytes: u64) -> Result<wgpu::Buffer, DeviceError> {
        let buffer = self.grown(device, name, bytes)?;
        if let Some(word) = self.prefill {
            device.queue.write_buffer(&buffer, 0, &word.to_le_bytes().repeat(buffer.size() as usize / 4));
        }
        Ok(buffer)
    }

    /// A buffer that was handed out before stays what it was when another of its name has to be larger.
    fn grown(&mut self, device: &Device, name: &'static str, bytes: u64) -> Result<wgpu::Buffer, DeviceError> {
        let place = self.buffers.iter().position(|(other, _)| *other == name);
        if let Some(place) = place {
            if self.buffers[place].1.size() >= bytes {
                return Ok(self.buffers[place].1.clone());
            }
            self.buffers.swap_remove(place);
        }
        if bytes > device.largest_binding() {
            return Err(device.too_large(name, bytes, device.largest_binding()));
        }
        // A quarter more, so that a little growth is no new buffer.
        let size = (bytes + bytes / 4).clamp(256, device.largest_binding()).next_multiple_of(4);
        let size = if size > device.largest_binding() { bytes.next_multiple_of(4) } else { size };
        let buffer = device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::INDIRECT
                | wgpu::BufferUsages::COPY_DST
                | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        device.check()?;
        self.buffers.push((name, buffer.clone()));
        Ok(buffer)
    }
}
