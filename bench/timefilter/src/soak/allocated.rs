//! The memory that this thread has allocated and not freed.

#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static NOW: Cell<i64> = const { Cell::new(0) };
    static MOST: Cell<i64> = const { Cell::new(0) };
}

/// Returns the memory in use now [B].
pub fn now() -> i64 {
    NOW.get()
}

/// Returns the largest memory in use since [`forget_most`] [B].
pub fn most() -> i64 {
    MOST.get()
}

/// Restarts the measurement of the largest memory in use.
pub fn forget_most() {
    MOST.set(now());
}

#[global_allocator]
static COUNTING: Counting = Counting;

struct Counting;

// SAFETY: every call is passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        NOW.set(NOW.get() + layout.size() as i64);
        MOST.set(MOST.get().max(NOW.get()));
        // SAFETY: the caller keeps the promises that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        NOW.set(NOW.get() - layout.size() as i64);
        // SAFETY: likewise.
        unsafe { System.dealloc(block, layout) }
    }
}
