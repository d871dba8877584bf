//! The machine of the measurements; values that the system does not report are missing.

use std::fs;
use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use crate::clock::median;

/// The machine and its load.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Name of the processor.
    pub processor: String,
    /// Processors that this process may use.
    pub processors: usize,
    /// Load average over the last minute: processes ready to run before any timing.
    pub load_before: Option<f64>,
    /// Copying speed on one thread and on all, in bytes per second, each byte counted as read and as written.
    pub copy_bandwidth: [f64; 2],
}

impl Machine {
    /// Queries the system, and measures the speed of copying memory.
    pub fn ask() -> Machine {
        Machine::ask_after(load())
    }

    /// Queries the system after the timings, given the load before them. The query takes memory, and the peak memory of a child
    /// process includes that of its parent at its start.
    pub fn ask_after(load_before: Option<f64>) -> Machine {
        let name = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        });
        Machine {
            processor: name.unwrap_or_else(|| "unknown processor".to_owned()),
            processors: std::thread::available_parallelism().map_or(1, |n| n.get()),
            load_before,
            copy_bandwidth: [copy_bandwidth(1), copy_bandwidth(rayon::current_num_threads())],
        }
    }

    /// Returns a line of text.
    pub fn describe(&self) -> String {
        let busy = |load: Option<f64>| load.map_or("unknown".to_owned(), |load| format!("{load:.2}"));
        format!(
            "{}, {} processors; load average {} before and {} after; memory copied at {:.1} GB/s by one thread and {:.1} \
             GB/s by {}, read and write counted.",
            self.processor,
            self.processors,
            busy(self.load_before),
            busy(load()),
            self.copy_bandwidth[0] * 1e-9,
            self.copy_bandwidth[1] * 1e-9,
            rayon::current_num_threads(),
        )
    }
}

/// Returns the peak memory of this process so far, in bytes.
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.split_whitespace().next()?.parse::<u64>().ok()?)
}

/// Returns the load average over the last minute.
pub fn load() -> Option<f64> {
    fs::read_to_string("/proc/loadavg").ok()?.split_whitespace().next()?.parse().ok()
}

/// Measures the bytes read and written per second when memory far larger than any cache is copied.
fn copy_bandwidth(threads: usize) -> f64 {
    const WORDS: usize = 1 << 24;
    let from = vec![1u64; WORDS];
    let mut to = vec![2u64; WORDS];
    let piece = WORDS.div_ceil(threads);
    let seconds = (0..5).map(|_| {
        let start = Instant::now();
        to.par_chunks_mut(piece).zip(from.par_chunks(piece)).for_each(|(to, from)| to.copy_from_slice(from));
        std::hint::black_box(&mut to);
        start.elapsed().as_secs_f64()
    });
    2.0 * size_of_val(&from[..]) as f64 / median(seconds.collect())
}
