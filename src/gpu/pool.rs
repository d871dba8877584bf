//! Buffers that grow and are kept from one job to the next.

use super::{Device, DeviceError};

/// Returns the number of bytes of this many 32-bit words.
pub(crate) fn bytes_of(words: u64) -> u64 {
    4 * words
}

/// Named buffers of a device, each of the largest size requested so far.
pub(crate) struct Pool {
    prefill: Option<u32>,
    buffers: Vec<(&'static str, wgpu::Buffer)>,
}

impl Pool {
    /// Returns an empty pool. If a word is given, buffers are filled with it each time they are requested.
    pub fn new(prefill: Option<u32>) -> Pool {
        Pool { prefill, buffers: Vec::new() }
    }

    /// Returns the buffer of this name with room for at least `bytes` and arbitrary contents.
    pub fn room(&mut self, device: &Device, name: &'static str, bytes: u64) -> Result<wgpu::Buffer, DeviceError> {
        let buffer = self.grown(device, name, bytes)?;
        if let Some(word) = self.prefill {
            device.queue.write_buffer(&buffer, 0, &word.to_le_bytes().repeat(buffer.size() as usize / 4));
        }
        Ok(buffer)
    }

    /// Drops all buffers, so that the device has their memory for others.
    pub fn release(&mut self) {
        self.buffers.clear();
    }

    /// Returns the buffer, or a larger new one of the same name. A buffer returned earlier stays valid.
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
        // A quarter more, so that slight growth needs no new buffer.
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
