//! How much memory this thread has allocated and not freed.

#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static NOW: Cell<i64> = const { Cell::new(0) };
    static MOST: Cell<i64> = const { Cell::new(0) };
}

/// The most memory in use at once during some work, beyond what was in use before [B].
pub fn most_during<T>(work: impl FnOnce() -> T) -> i64 {
    let before = NOW.get();
    MOST.set(before);
    drop(work());
    MOST.get() - before
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

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        NOW.set(NOW.get() + bytes as i64 - layout.size() as i64);
        MOST.set(MOST.get().max(NOW.get()));
        // SAFETY: likewise.
        unsafe { System.realloc(block, layout, bytes) }
    }
}
