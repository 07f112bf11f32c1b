//! A clock model in its steady state asks for no memory.

#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use teampulse_timefilter::clock::{
    ClockModel, Latency, OneWay, OneWaySettings, SampleIndex, Stamps,
};

struct Counting;

thread_local! {
    /// Of this thread alone: that of the test runner allocates when it likes.
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: everything is handed to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller keeps the allocator's contract, which is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

#[test]
fn a_steady_clock_allocates_nothing() {
    let latency = Latency::BLUETOOTH;
    let mut models: [Box<dyn ClockModel>; 2] = [
        Box::new(OneWay::new(OneWaySettings::new(latency))),
        Box::new(SampleIndex::new(10.0, latency)),
    ];
    let mut before = 0;
    for index in 0..30_000_u64 {
        if index == 1_000 {
            before = ALLOCATIONS.get();
        }
        let device = index as i64 * 100_000_000;
        let delay = (index * 7_919 % 40) as i64 * 1_000_000;
        let stamps = Stamps { device: Some(device), index, ..Stamps::arrived(device + delay) };
        for model in &mut models {
            model.correct(&stamps);
            model.state();
            model.next_event();
        }
    }
    assert_eq!(ALLOCATIONS.get(), before);
}
