//! Settings of this process's memory allocator.
#![expect(unsafe_code, reason = "the C library's allocator has no safe binding")]

/// The size above which allocations get separate pages, which return to the system when freed [bytes]. By default the C
/// library raises this limit to the largest freed allocation, up to 32 MiB.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: libc::c_int = 128 << 10;

/// Makes all threads share one heap, without large buffers. By default the C library gives each thread its own heap;
/// memory that one thread allocates and another frees, as for every message here, then fragments all heaps. Over eight
/// hours, the demo grew to 75 MiB and kept growing; with this call it takes 44 MiB. Call it before threads are started.
pub fn share_one_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    for (setting, value) in [(libc::M_ARENA_MAX, 1), (libc::M_MMAP_THRESHOLD, LARGE)] {
        // SAFETY: only sets a number in the allocator, which may be done at any time.
        if unsafe { libc::mallopt(setting, value) } != 1 {
            tracing::debug!("the C library's allocator rejected the setting {setting} (mallopt)");
        }
    }
}
