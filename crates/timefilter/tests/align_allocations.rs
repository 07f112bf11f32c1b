//! Alignment allocates nothing once its buffers have grown, and never more than it says.
#![expect(unsafe_code, reason = "an allocator that counts is one")]
#![expect(clippy::unwrap_used, reason = "a test fails by it")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use teampulse_timefilter::align::{
    Aligner, Mode, Output, RowTimes, Run, Sample, SourceId, SourceSettings,
};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static BYTES: Cell<i64> = const { Cell::new(0) };
    static MOST_BYTES: Cell<i64> = const { Cell::new(0) };
}

fn count(bytes: i64) {
    BYTES.set(BYTES.get() + bytes);
    MOST_BYTES.set(MOST_BYTES.get().max(BYTES.get()));
}

struct Counting;

// SAFETY: every call goes to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        count(layout.size() as i64);
        // SAFETY: the caller keeps the promises that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        count(-(layout.size() as i64));
        // SAFETY: likewise.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const MS: i64 = 1_000_000;
const POLICIES: [&str; 5] = ["linear:500ms", "hold:2s", "nearest:20ms", "mean:1s", "exact"];

fn sources(aligner: &mut Aligner, count: usize, capacity: usize) -> Vec<SourceId> {
    let settings = |number: usize| SourceSettings {
        channels: 1 + number % 3,
        capacity,
        ..SourceSettings::new(POLICIES[number % POLICIES.len()].parse().unwrap())
    };
    (0..count).map(|number| aligner.add(settings(number)).unwrap()).collect()
}

/// One sample or a run of four of each source, at mixed rates; the last falls silent at times.
fn feed(aligner: &mut Aligner, sources: &[SourceId], moments: std::ops::Range<i64>) -> u64 {
    let mut rows = 0;
    let mut see = |output: Output<'_>| rows += u64::from(matches!(output, Output::Row(_)));
    for moment in moments {
        let now = moment * 4 * MS;
        aligner.tick(now, &mut see);
        for (number, source) in sources.iter().enumerate() {
            let values = &[1.0; 12][..4 * (1 + number % 3)];
            if number + 1 == sources.len() && moment % 2_000 < 1_000 {
                continue;
            }
            if number % 2 == 0 {
                let run = Run { measured: now, period_nanos: 1e6, arrival: now, values };
                aligner.push_run(*source, run, &mut see).unwrap();
            } else if moment % (1 + number as i64) == 0 {
                let values = &values[..values.len() / 4];
                let sample = Sample { measured: now, arrival: now, values };
                aligner.push(*source, sample, &mut see).unwrap();
            }
        }
    }
    rows
}

#[test]
fn alignment_allocates_nothing_in_steady_state() {
    for (onto, mode) in [
        (RowTimes::Grid { period_nanos: 15_625_000 }, Mode::Reproducible),
        (RowTimes::Grid { period_nanos: 15_625_000 }, Mode::Available),
        (RowTimes::Pivot, Mode::Reproducible),
    ] {
        let mut aligner = Aligner::new(onto, mode).unwrap();
        let sources = sources(&mut aligner, 10, 4_096);
        feed(&mut aligner, &sources, 0..4_000);
        let before = ALLOCATIONS.get();
        let rows = feed(&mut aligner, &sources, 4_000..8_000);
        assert_eq!(ALLOCATIONS.get() - before, 0);
        assert!(rows >= 900, "{rows}");
    }
}

/// One source of 64 is silent at times, so that the others fill their buffers.
#[test]
fn memory_stays_within_its_bound_even_when_buffers_are_full() {
    let before = BYTES.get();
    let onto = RowTimes::Grid { period_nanos: 15_625_000 };
    let mut aligner = Aligner::new(onto, Mode::Reproducible).unwrap();
    let sources = sources(&mut aligner, 64, 100);
    for moments in [0..1_500, 1_500..3_000] {
        MOST_BYTES.set(0);
        feed(&mut aligner, &sources, moments);
        let taken = MOST_BYTES.get() - before;
        let bound = aligner.bytes_bound() as i64;
        assert!(taken <= bound, "{taken} of {bound}");
        assert!(2 * taken > bound, "{taken} of {bound}");
    }
}
