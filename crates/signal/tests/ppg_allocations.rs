//! Finding pulses allocates nothing in steady state.
#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use teampulse_signal::ppg::PulseDetector;

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

#[test]
fn pulses_are_found_without_allocations() {
    for rate_hz in [20.0, 64.0, 1000.0] {
        let mut detector = PulseDetector::new(rate_hz).unwrap();
        let sample = |k: usize| {
            let lost = k % 5000 > 4800;
            let phase = k as f64 / rate_hz % 0.9 - 0.4;
            if lost { f64::NAN } else { (-(phase / 0.1).powi(2)).exp() + 0.1 * (k * k % 13) as f64 }
        };
        let minute = (60.0 * rate_hz) as usize;
        let mut run = |begin: usize| {
            (begin..begin + minute).filter(|&k| detector.push(sample(k)).is_some()).count()
        };
        run(0);
        let before = ALLOCATIONS.get();
        let pulses = run(minute);
        assert_eq!(ALLOCATIONS.get(), before, "{rate_hz} Hz");
        assert!(pulses > 30, "{pulses} at {rate_hz} Hz");
    }
}
