//! Memory of the machine and of this process. Linux reports it; elsewhere the answers are `None`.

use std::fs;

/// Returns the bytes of memory this process may use: the machine's, or its container's if less.
pub fn memory_bytes() -> Option<u64> {
    let machine = kibibytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemTotal:")?;
    let container = [
        "/sys/fs/cgroup/memory.max",
        "/sys/fs/cgroup/memory/memory.limit_in_bytes",
    ]
    .iter()
    .find_map(|path| fs::read_to_string(path).ok()?.trim().parse().ok());
    Some(container.map_or(machine, |limit: u64| machine.min(limit)))
}

/// Returns the most memory this process ever had in use, in bytes.
pub fn peak_bytes() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Finds `key  number kB` in a table of the kernel.
fn kibibytes(table: &str, key: &str) -> Option<u64> {
    let rest = table.lines().find_map(|line| line.strip_prefix(key))?;
    let number: u64 = rest.trim().strip_suffix("kB")?.trim().parse().ok()?;
    number.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_the_kernel_are_read() {
        let table = "MemFree:  1 kB\nMemTotal:       24117248 kB\n";
        assert_eq!(kibibytes(table, "MemTotal:"), Some(24_117_248 * 1024));
        assert_eq!(kibibytes(table, "VmHWM:"), None);
        assert_eq!(kibibytes("VmHWM: many kB", "VmHWM:"), None);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn linux_tells() {
        assert!(memory_bytes().unwrap() > peak_bytes().unwrap());
    }
}
