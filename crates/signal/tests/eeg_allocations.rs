//! An EEG costs no allocation per sample, and its memory stays within what its windows need.
#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use teampulse_signal::analysis::Causal;
use teampulse_signal::eeg::analysis::{Settings, causal};

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

const SECOND_NS: i64 = 1_000_000_000;

/// Four channels at 256 Hz without blinks, with a window of ten seconds.
fn feed(analysis: &mut dyn Causal, secs: std::ops::Range<i64>) {
    for sec in secs {
        for k in 0..256 {
            let phase = (sec * 256 + k) as f64;
            let waves = [0.247, 0.151, 0.093, 0.311].map(|step| 20.0 * (step * phase).sin());
            analysis.push(sec * SECOND_NS + k * SECOND_NS / 256, &waves);
        }
        analysis.forget((sec - 10) * SECOND_NS);
    }
}

#[test]
fn samples_allocate_nothing_in_steady_state() {
    let channels = ["TP9", "AF7", "AF8", "TP10"].map(ToString::to_string).to_vec();
    let mut analysis = causal(&Settings { channels, ..Settings::default() }, 256.0).unwrap();
    feed(&mut *analysis, 0..80);
    let before = ALLOCATIONS.get();
    feed(&mut *analysis, 80..120);
    assert_eq!(ALLOCATIONS.get() - before, 0);
}
