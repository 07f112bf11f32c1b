//! Memory over a long session. What is allocated in truth: see `align_allocations.rs`.

use teampulse_timefilter::align::{Aligner, Mode, Output, RowTimes, Sample, SourceSettings};

use crate::story::SECOND;

const HOURS: i64 = 3_600 * SECOND;

/// Eight hours of 64 sources at mixed rates from 1 Hz to one a minute; some of them silent at times.
#[test]
fn eight_hours_of_many_sources_stay_within_the_bound() {
    let mut aligner =
        Aligner::new(RowTimes::Grid { period_nanos: 10 * SECOND }, Mode::Reproducible).unwrap();
    let policies = ["linear:5s", "hold:60s", "mean:10s", "nearest:1s"];
    let sources: Vec<_> = (0..64)
        .map(|number| {
            let policy = policies[number % 4].parse().unwrap();
            aligner.add(SourceSettings { capacity: 64, ..SourceSettings::new(policy) }).unwrap()
        })
        .collect();
    let bound = aligner.bytes_bound();
    assert!(bound < 64 * 2_000, "{bound}");
    let mut rows = 0;
    for now in (0..8 * HOURS).step_by(SECOND as usize) {
        for (number, source) in sources.iter().enumerate() {
            let period = [1, 2, 4, 60][number / 4 % 4] * SECOND;
            let is_silent = number % 8 == 1 && now % HOURS < HOURS / 10;
            if now % period == 0 && !is_silent {
                let sample = Sample { measured: now, arrival: now, values: &[1.0] };
                let count =
                    |output: Output<'_>| rows += i32::from(matches!(output, Output::Row(_)));
                aligner.push(*source, sample, count).unwrap();
            }
        }
    }
    assert!(rows >= 8 * 360 - 1, "{rows}");
    assert_eq!(aligner.bytes_bound(), bound);
    let crowded: u64 = sources.iter().map(|source| aligner.counts(*source).unwrap().crowded).sum();
    assert_eq!(crowded, 0);
}
