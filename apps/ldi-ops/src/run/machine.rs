//! What the operating system says of the machine and of this process; nothing where it does not say.

use std::fs;

use ldi_ops::grid::{Axis, Grid};

use crate::exit::Failure;

/// The most memory that this process has held, in bytes.
pub fn peak_memory_bytes() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// The memory that this process holds now, in bytes.
pub fn memory_bytes() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmRSS:")
}

/// The name of the processor.
pub fn cpu_name() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(rest.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// The memory that programs may still take, in bytes.
pub fn free_memory() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")
}

/// Meshes of fewer samples are never the reason for which memory runs out.
const FEW_SAMPLES: u64 = 1 << 24;

/// What a sample comes to in a mesh at most: a vertex and two triangles, and the stars by which they are checked.
pub const BYTES_OF_SAMPLE: u64 = 110;

/// Refuses the mesh of so many samples if it would not fit, before the system ends the process for it.
pub fn admit_mesh(samples: u64) -> Result<(), Failure> {
    let needed = samples * BYTES_OF_SAMPLE;
    match free_memory() {
        Some(free) if samples > FEW_SAMPLES && needed > free => Err(Failure::machine(format!(
            "a mesh of {samples} samples has about {} triangles and needs {needed} bytes, and {free} are free; ask for fewer rays",
            2 * samples
        ))),
        _ => Ok(()),
    }
}

/// Rasters below this many rays are never the reason for which memory runs out.
const SMALL: u64 = 1 << 26;

/// How much more than the indices of the images alive at once is needed: samples, and what sampling holds meanwhile.
const SAFETY: u64 = 2;

/// Refuses images whose indices would not fit, before the system ends the process for it; `images` is how many of them
/// are alive at once.
pub fn admit(grid: &Grid, axes: &[Axis], images: u64) -> Result<(), Failure> {
    let rays = |axis: &Axis| {
        let (columns, rows) = grid.image_size(*axis);
        u64::from(columns) * u64::from(rows)
    };
    let Some(most) = axes.iter().map(rays).max().filter(|rays| *rays > SMALL) else { return Ok(()) };
    if most >= u64::from(u32::MAX) {
        return Err(Failure::machine(format!(
            "{most} rays along one axis are more than an image can hold ({})",
            u32::MAX
        )));
    }
    let needed = 4 * most * images * SAFETY;
    match free_memory() {
        Some(free) if needed > free => Err(Failure::machine(format!(
            "{most} rays along one axis, in {images} images at once, need {needed} bytes or more, and {free} are free; ask \
             for fewer rays"
        ))),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read() {
        assert_eq!(kibibytes("VmPeak:\t 9 kB\nVmHWM:\t    12 kB\n", "VmHWM:"), Some(12 * 1024));
        assert_eq!(kibibytes("VmPeak:\t 9 kB\n", "VmHWM:"), None);
    }
}
