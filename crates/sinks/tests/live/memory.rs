//! How much memory this process has allocated and not freed.

#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicI64, Ordering::Relaxed};

static NOW: AtomicI64 = AtomicI64::new(0);
static MOST: AtomicI64 = AtomicI64::new(0);

/// The memory in use now [B]; the peak is counted from here on.
pub fn begin() -> i64 {
    let now = NOW.load(Relaxed);
    MOST.store(now, Relaxed);
    now
}

/// The peak memory in use since counting [began](begin) [B].
pub fn most() -> i64 {
    MOST.load(Relaxed)
}

#[global_allocator]
static COUNTING: Counting = Counting;

struct Counting;

fn count(bytes: i64) {
    let now = NOW.fetch_add(bytes, Relaxed) + bytes;
    MOST.fetch_max(now, Relaxed);
}

// SAFETY: every call goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        // SAFETY: the caller keeps the promises that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(-(layout.size() as i64));
        // SAFETY: likewise.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // While it is moved both stand there.
        count(bytes as i64);
        // SAFETY: likewise.
        let moved = unsafe { System.realloc(block, layout, bytes) };
        count(-(layout.size() as i64));
        moved
    }
}
