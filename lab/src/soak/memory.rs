//! Memory of this process.

/// Resident bytes of this process (RSS); `None` if the system does not report them.
pub fn resident_bytes() -> Option<u64> {
    resident_of(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// Parses what Linux reports.
fn resident_of(status: &str) -> Option<u64> {
    let kibibytes = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * kibibytes.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_reported_by_linux() {
        let status = "VmPeak:\t  300 kB\nVmRSS:\t  190988 kB\nThreads:\t1\n";
        assert_eq!(resident_of(status), Some(190_988 << 10));
        assert_eq!(resident_of("VmRSS: many"), None);
        // The code of these tests alone is larger.
        assert!(!cfg!(target_os = "linux") || resident_bytes() > Some(1 << 20));
    }
}
