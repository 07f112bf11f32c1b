//! Matching allocates nothing once its queues have grown.
#![expect(unsafe_code, reason = "an allocator that counts is one")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use teampulse_timefilter::matching::{
    ApproximateSettings, ApproximateTime, ExactTime, Listener, Message, Set,
};

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

/// Counts sets, and lets their messages go.
#[derive(Default)]
struct Sets(u64);

impl Listener<Arc<u64>> for Sets {
    fn set(&mut self, _: Set<'_, Arc<u64>>) {
        self.0 += 1;
    }
}

/// Topics at 1, 2, 3… times a period; each stamp a little off, unless it is to be equal.
fn arrivals(topics: usize, off: i64) -> Vec<(usize, i64)> {
    let mut arrivals = Vec::new();
    for moment in 0..40_000_i64 {
        for topic in 0..topics {
            if moment % (topic as i64 + 1) == 0 {
                arrivals.push((topic, moment * 1_000_000 + (moment * 7 + topic as i64) % off));
            }
        }
    }
    arrivals
}

/// Allocations, and sets, in the second half of the arrivals.
fn in_steady_state(
    arrivals: &[(usize, i64)],
    mut push: impl FnMut(usize, Message<Arc<u64>>, &mut Sets),
) -> (u64, u64) {
    let payload = Arc::new(0);
    let mut begun = (0, 0);
    let mut sets = Sets::default();
    for (place, &(topic, stamp)) in arrivals.iter().enumerate() {
        if place == arrivals.len() / 2 {
            begun = (ALLOCATIONS.get(), sets.0);
        }
        push(topic, Message { stamp, payload: Arc::clone(&payload) }, &mut sets);
    }
    (ALLOCATIONS.get() - begun.0, sets.0 - begun.1)
}

#[test]
fn approximate_matching_allocates_nothing_in_steady_state() {
    for (topics, queue_size) in [(2, 10), (9, 5), (9, 100), (64, 200)] {
        let mut matching = ApproximateTime::new(&ApproximateSettings::new(topics, queue_size));
        let (allocations, sets) =
            in_steady_state(&arrivals(topics, 300_000), |topic, message, listener| {
                matching.push(topic, message, listener);
            });
        assert!(sets > 100, "{topics} topics: only {sets} sets");
        assert_eq!(allocations, 0, "{topics} topics");
    }
}

#[test]
fn exact_matching_allocates_nothing_in_steady_state() {
    for (topics, queue_size) in [(2, 10), (5, 100)] {
        let mut matching = ExactTime::new(topics, queue_size);
        let (allocations, sets) =
            in_steady_state(&arrivals(topics, 1), |topic, message, listener| {
                matching.push(topic, message, listener);
            });
        assert!(sets > 100, "{topics} topics: only {sets} sets");
        assert_eq!(allocations, 0, "{topics} topics");
    }
}
