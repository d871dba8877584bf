//! Facts about the machine and this process from the operating system; `None` where it does not report them.

use std::fs;
use std::path::Path;

/// Returns the peak resident memory of this process, in bytes.
pub fn peak_memory_bytes() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Returns the memory that this process holds now, in bytes; 0 where the system does not report it.
pub fn held_memory() -> u64 {
    kibibytes(&fs::read_to_string("/proc/self/status").unwrap_or_default(), "VmRSS:").unwrap_or(0)
}

/// Returns the name of the processor.
pub fn cpu_name() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(rest.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

/// Returns the memory that this process may still take, in bytes: the minimum of the free memory and of what its control
/// groups and its own limits allow.
pub fn free_memory() -> Option<u64> {
    let available = kibibytes(&fs::read_to_string("/proc/meminfo").unwrap_or_default(), "MemAvailable:");
    available.into_iter().chain(left_by_limits()).chain(left_by_groups()).min()
}

/// Returns the bytes that the process limits on address space and data still allow.
fn left_by_limits() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let left = |(limit, used)| Some(soft_limit(&limits, limit)?.saturating_sub(kibibytes(&status, used)?));
    [("Max address space", "VmSize:"), ("Max data size", "VmData:")].into_iter().filter_map(left).min()
}

/// Returns a soft limit by its name in /proc/self/limits; `None` where it is unlimited.
fn soft_limit(limits: &str, name: &str) -> Option<u64> {
    limits.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.parse().ok()
}

/// Returns the bytes that the control groups of the process and their ancestors still allow.
fn left_by_groups() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    // Version 2 has one hierarchy, without a name; version 1 has one for memory.
    let of_line = |line: &str| {
        let (controllers, group) = line.split_once(':')?.1.split_once(':')?;
        let (root, limit, used) = match controllers.split(',').any(|name| name == "memory") {
            true => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes", "memory.usage_in_bytes"),
            false if controllers.is_empty() => ("/sys/fs/cgroup", "memory.max", "memory.current"),
            false => return None,
        };
        let left = |group: &Path| left_by_group(&Path::new(root).join(group), limit, used);
        Path::new(group.trim_start_matches('/')).ancestors().filter_map(left).min()
    };
    groups.lines().filter_map(of_line).min()
}

/// Returns the bytes that one control group still allows. The kernel counts cached files as used, but frees them on demand, so
/// they count as free here.
fn left_by_group(folder: &Path, limit: &str, used: &str) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    let limit = number(limit)?;
    let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let reclaimable = |key| statistics.lines().find_map(|line| line.strip_prefix(key)?.trim().parse::<u64>().ok());
    let files = reclaimable("inactive_file ").unwrap_or(0) + reclaimable("active_file ").unwrap_or(0);
    Some(limit.saturating_sub(number(used)?.saturating_sub(files)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read() {
        assert_eq!(kibibytes("VmPeak:\t 9 kB\nVmHWM:\t    12 kB\n", "VmHWM:"), Some(12 * 1024));
        assert_eq!(kibibytes("VmPeak:\t 9 kB\n", "VmHWM:"), None);
    }

    #[test]
    fn limits_are_read() {
        let text = "Limit  Soft Limit  Hard Limit  Units\nMax data size  unlimited  unlimited  bytes\n\
                    Max address space         1536000000           unlimited            bytes     \n";
        assert_eq!(soft_limit(text, "Max address space"), Some(1_536_000_000));
        assert_eq!(soft_limit(text, "Max data size"), None);
    }

    #[test]
    fn a_control_group_leaves_its_limit_less_what_is_used() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        let left = || left_by_group(folder.path(), "memory.max", "memory.current");
        assert_eq!(left(), None);
        write("memory.max", "max\n");
        write("memory.current", "700\n");
        assert_eq!(left(), None);
        write("memory.max", "1000\n");
        assert_eq!(left(), Some(300));
        write("memory.stat", "anon 400\ninactive_file 200\nactive_file 50\nslab 9\n");
        assert_eq!(left(), Some(550));
    }
}
