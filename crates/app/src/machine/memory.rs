//! How this process gets its memory.
#![expect(unsafe_code, reason = "the C library's allocator has no safe binding")]

/// Lets all threads share one heap, which hours of recording don't enlarge. The C library gives each thread a
/// heap of its own, and what one thread allocates and another frees, as every message here, leaves holes in all of
/// them: eight hours of the demo held 75 MiB and rising, and hold 56. Call it before there are threads.
pub fn share_one_heap() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: sets a number of the allocator's, which may be done at any time.
    let is_set = unsafe { libc::mallopt(libc::M_ARENA_MAX, 1) } == 1;
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if !is_set {
        tracing::debug!("each thread has a heap of its own");
    }
}
