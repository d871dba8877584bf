//! Wall time and processor time of repeated work.

use std::time::Instant;

use serde::Serialize;

/// The duration of work, in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Times {
    /// Wall-clock time.
    pub wall: f64,
    /// Time of all processors together spent on this process: other programs slow only the wall clock.
    pub cpu: f64,
}

/// Untimed warm-up rounds.
const WARM_UP: usize = 2;

/// Returns the median times of `runs` rounds of `work`, wall and processor separately, after a warm-up.
pub fn median_times<T>(runs: usize, mut work: impl FnMut() -> T) -> Times {
    for _ in 0..WARM_UP {
        drop(work());
    }
    let (mut walls, mut cpus) = (Vec::with_capacity(runs), Vec::with_capacity(runs));
    for _ in 0..runs {
        let (cpu, wall) = (processor_seconds(), Instant::now());
        let result = work();
        walls.push(wall.elapsed().as_secs_f64());
        cpus.push(processor_seconds() - cpu);
        drop(result);
    }
    Times { wall: median(walls), cpu: median(cpus) }
}

/// Returns the median; of an even number of values, the mean of the middle two.
///
/// # Panics
/// If there is no value.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len().is_multiple_of(2) { 0.5 * (values[middle - 1] + values[middle]) } else { values[middle] }
}

/// Returns the processor time of this process so far; NaN if the system does not report it.
#[cfg(unix)]
fn processor_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live value of the type that the call fills.
    match unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) } {
        0 => time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64,
        _ => f64::NAN,
    }
}

#[cfg(not(unix))]
fn processor_seconds() -> f64 {
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert_eq!(median(vec![7.0]), 7.0);
    }
}
