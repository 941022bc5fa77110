//! What the machine has: memory, of which more than there is is refused before it is allocated, and a processor.

use sysinfo::{CpuRefreshKind, MemoryRefreshKind, RefreshKind, System};

/// Bytes of memory of the machine, or of the control group that the program runs in; `u64::MAX` where
/// that is not known.
pub fn memory() -> u64 {
    let memory = RefreshKind::nothing().with_memory(MemoryRefreshKind::nothing().with_ram());
    let system = System::new_with_specifics(memory);
    let limit = system.cgroup_limits().map(|l| l.total_memory);
    let there = limit.unwrap_or(u64::MAX).min(system.total_memory());
    if there == 0 { u64::MAX } else { there }
}

/// The processor's name; empty where it is not known.
pub fn processor() -> String {
    let processors = RefreshKind::nothing().with_cpu(CpuRefreshKind::nothing());
    let system = System::new_with_specifics(processors);
    let first = system.cpus().first();
    first.map_or_else(String::new, |p| p.brand().trim().to_owned())
}
