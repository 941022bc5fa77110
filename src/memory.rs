//! How much memory the machine has: what needs more is refused before it is allocated.

use sysinfo::{MemoryRefreshKind, RefreshKind, System};

/// Bytes of memory of the machine, or of the control group that the program runs in; `u64::MAX` where
/// that is not known.
pub fn total() -> u64 {
    let memory = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    let system = System::new_with_specifics(memory);
    let limit = system.cgroup_limits().map(|l| l.total_memory);
    let there = limit.unwrap_or(u64::MAX).min(system.total_memory());
    if there == 0 { u64::MAX } else { there }
}
