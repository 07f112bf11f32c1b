//! The number of times that a thread has waited, as counted by the kernel.

/// The number of times that this thread has waited for something: a message, a lock, the end of a pause.
#[cfg(target_os = "linux")]
pub(super) fn of_this_thread() -> u64 {
    let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: the kernel fills the structure, which is also valid as zeros.
    let usage = unsafe {
        libc::getrusage(libc::RUSAGE_THREAD, usage.as_mut_ptr());
        usage.assume_init()
    };
    usage.ru_nvcsw.unsigned_abs()
}

/// On systems that do not count this for each thread, every call counts as a wait.
#[cfg(not(target_os = "linux"))]
pub(super) fn of_this_thread() -> u64 {
    use std::sync::atomic::{AtomicU64, Ordering};
    static CALLS: AtomicU64 = AtomicU64::new(0);
    CALLS.fetch_add(1, Ordering::Relaxed)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_pause_is_a_wait() {
        let before = of_this_thread();
        std::thread::sleep(Duration::from_millis(1));
        assert!(of_this_thread() > before);
    }
}
