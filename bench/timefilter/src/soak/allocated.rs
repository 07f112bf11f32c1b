//! How much memory this thread has asked for and not given back.

#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static NOW: Cell<i64> = const { Cell::new(0) };
    static MOST: Cell<i64> = const { Cell::new(0) };
}

/// What is in use now [B].
pub fn now() -> i64 {
    NOW.get()
}

/// The most that ever was since [`forget_most`] [B].
pub fn most() -> i64 {
    MOST.get()
}

/// Counts the most from now on.
pub fn forget_most() {
    MOST.set(now());
}

#[global_allocator]
static COUNTING: Counting = Counting;

struct Counting;

// SAFETY: every call goes to the system's allocator as it is.
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
