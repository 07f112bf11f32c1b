//! How this process gets its memory.
#![expect(unsafe_code, reason = "the C library's allocator has no safe binding")]

/// What is larger has pages of its own, which go back to the system when it is freed [bytes]. Left alone, the C
/// library raises this to the largest that was ever freed, 32 MiB at most.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE: libc::c_int = 128 << 10;

/// Lets all threads share one heap, of which large buffers are no part. The C library gives each thread a heap of
/// its own, and what one thread allocates and another frees, as every message here, leaves holes in all of them:
/// eight hours of the demo held 75 MiB and rising, and hold 44. Call it before there are threads.
pub fn share_one_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    for (setting, value) in [(libc::M_ARENA_MAX, 1), (libc::M_MMAP_THRESHOLD, LARGE)] {
        // SAFETY: sets a number of the allocator's, which may be done at any time.
        if unsafe { libc::mallopt(setting, value) } != 1 {
            tracing::debug!("the C library refuses the setting {setting} of its allocator");
        }
    }
}
