//! Beats that come in allocate nothing once a window's worth of them is held.
#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use teampulse_signal::hrv::HeartWindows;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the promises that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: likewise.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const SEC: i64 = 1_000_000_000;

/// Beats of an hour from here, a hole each minute; the newest five minutes are kept.
fn feed(heart: &mut HeartWindows, begin_secs: i64) {
    for beat in 0..4_000 {
        let at_ns = begin_secs * SEC + beat * 900_000_000;
        heart.push(at_ns);
        if beat % 67 == 0 {
            heart.mark_gap(at_ns - SEC / 2, at_ns - SEC / 4);
        }
        heart.forget(at_ns - 300 * SEC);
    }
}

#[test]
fn beats_and_holes_allocate_nothing_in_steady_state() {
    let mut heart = HeartWindows::causal();
    feed(&mut heart, 0);
    let before = ALLOCATIONS.get();
    feed(&mut heart, 3_600);
    assert_eq!(ALLOCATIONS.get() - before, 0);
}
