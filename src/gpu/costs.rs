//! The times of single operations on a device and its bandwidth: the references for the times of stages.

use std::time::Instant;

use super::recorder::{Recorder, Workgroups};
use super::{Access, Device, DeviceError, Kernel, WORKGROUP, counted, shared_struct};

/// Number of copies submitted together, so that without timestamps the submission overhead matters little.
const COPIES: usize = 8;

/// Number of rounds after the first, which warms up and has the buffers cleared.
const ROUNDS: usize = 7;

/// The times of single operations on a device, in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// A submission of one dispatch that does nothing, until the host knows that it is done.
    pub submission: f64,
    /// One more dispatch that does nothing, in the same submission.
    pub dispatch: f64,
    /// An atomic addition to any word of a buffer of 64 MiB, in the mean over all that run side by side.
    pub scattered_addition: f64,
    /// An atomic addition to the one word that all others add to.
    pub shared_addition: f64,
    /// A product modulo 2^64 by the device's own 64-bit integers, if it has them, again in the mean over all.
    pub native_product: Option<f64>,
    /// The same product by pairs of 32-bit words.
    pub paired_product: f64,
}

shared_struct! {
    /// The input of a measurement.
    pub struct CostView {
        /// Operations of each invocation.
        rounds: u32,
        /// The number of words that are added to, which is a power of two, less one.
        last_word: u32,
        unused: u32,
        unused_too: u32,
    }
}

/// Number of words that scattered additions go to.
const SCATTERED_WORDS: u32 = 1 << 24;

/// Number of workgroups that repeat an operation, and of operations of each invocation.
const GROUPS: u32 = 4096;
const OPERATIONS: u32 = 64;

/// Number of dispatches that are told from one.
const DISPATCHES: usize = 65;

macro_rules! shader {
    ($name:literal) => {
        include_str!(concat!("../../shaders/", $name, ".wgsl"))
    };
}

/// Returns the WGSL of the measurements, with products by one of the two files.
fn source(is_native: bool) -> String {
    let products: &[&str] = match is_native {
        true => &[shader!("wide_native")],
        false => &[shader!("upper_product"), shader!("wide_pair")],
    };
    let head = format!("const WORKGROUP = {WORKGROUP}u;\n{}\n", CostView::WGSL);
    products.iter().chain(&[shader!("costs")]).fold(head, |text, file| text + file + "\n")
}

const BINDINGS: [(u32, Access); 2] = [(0, Access::Uniform), (1, Access::Write)];

impl Device {
    /// Returns what single operations take: the least of many runs. Those of invocations are measured by the device's own clock
    /// where it times stages, else by the host's.
    pub fn costs(&self) -> Result<Costs, DeviceError> {
        let kernel = |name, is_native, entry| Kernel::new(self, name, &source(is_native), entry, &BINDINGS);
        let words = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("added to"),
            size: 4 * u64::from(SCATTERED_WORDS),
            usage: wgpu::BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        self.check()?;
        let add = kernel("additions", false, "add")?;
        let nothing = CostView::default();
        let alone = self.least_seconds(&add, nothing, &words, counted(1), 1, false)?;
        let many = self.least_seconds(&add, nothing, &words, counted(1), DISPATCHES, false)?;
        let is_timed = self.adapter().timestamps;
        let operation = |kernel: &Kernel, last_word| {
            let idle =
                self.least_seconds(kernel, CostView { last_word, ..nothing }, &words, counted(GROUPS), 1, is_timed)?;
            let view = CostView { rounds: OPERATIONS, last_word, ..nothing };
            let busy = self.least_seconds(kernel, view, &words, counted(GROUPS), 1, is_timed)?;
            Ok((busy - idle).max(0.0) / (f64::from(GROUPS * WORKGROUP) * f64::from(OPERATIONS)))
        };
        let native = match self.adapter().int64 {
            true => Some(operation(&kernel("native products", true, "multiply")?, 0)?),
            false => None,
        };
        Ok(Costs {
            submission: alone,
            dispatch: (many - alone).max(0.0) / (DISPATCHES - 1) as f64,
            scattered_addition: operation(&add, SCATTERED_WORDS - 1)?,
            shared_addition: operation(&add, 0)?,
            native_product: native,
            paired_product: operation(&kernel("paired products", false, "multiply")?, 0)?,
        })
    }

    /// Returns the least seconds of a number of equal dispatches in one submission: on the device if `is_timed`, else until the
    /// host knows that they are done.
    fn least_seconds(
        &self,
        kernel: &Kernel,
        view: CostView,
        words: &wgpu::Buffer,
        workgroups: Workgroups,
        dispatches: usize,
        is_timed: bool,
    ) -> Result<f64, DeviceError> {
        let mut least = f64::INFINITY;
        for _ in 0..=ROUNDS {
            let start = Instant::now();
            let mut recorder = Recorder::timed(self, is_timed);
            let view = recorder.uniform(bytemuck::bytes_of(&view));
            (0..dispatches).for_each(|_| recorder.dispatch(kernel, view, &[(1, words)], workgroups));
            let (_, times) = recorder.run(|_| ())?;
            let wall = start.elapsed().as_secs_f64();
            let on_device = times.iter().map(|time| time.seconds).sum();
            least = least.min(if is_timed { on_device } else { wall });
        }
        Ok(least)
    }

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::validation::{bindings, members, validated};

    #[test]
    fn the_shaders_are_valid_and_match_the_host() {
        for is_native in [false, true] {
            let module = validated("costs", &source(is_native), is_native);
            assert_eq!(bindings("costs", &module), BINDINGS);
            assert_eq!(members(&module, "CostView").unwrap(), CostView::OFFSETS);
            assert!(
                ["add", "multiply"].iter().all(|entry| module.entry_points.iter().any(|point| point.name == *entry))
            );
        }
    }
}
