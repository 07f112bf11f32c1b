//! An ECG that comes in allocates nothing for a sample once its buffers have grown, only for events.

mod counting;

#[path = "synthetic/ecg.rs"]
mod synthetic;

use counting::allocations;
use synthetic::{beat_secs, ecg};
use teampulse_signal::ecg::BeatDetector;
use teampulse_signal::ecg::analysis::{Settings, causal};

const RATE_HZ: f64 = 130.0;

fn signal() -> Vec<f64> {
    ecg(&beat_secs(300), 240.0, RATE_HZ)
}

#[test]
fn the_detector_never_allocates_for_a_sample() {
    let signal = signal();
    let mut detector = BeatDetector::new(RATE_HZ).expect("a usual rate");
    let (first, rest) = signal.split_at(1000);
    let mut beats = first.iter().filter_map(|&sample| detector.push(sample)).count();
    let before = allocations();
    beats += rest.iter().filter_map(|&sample| detector.push(sample)).count();
    assert_eq!((allocations() - before, beats > 280), (0, true));
}

#[test]
fn the_analysis_allocates_for_events_only() {
    let mut analysis = causal(&Settings::default(), RATE_HZ).expect("a usual rate");
    let (mut events, mut before) = (0, 0);
    for (k, sample) in signal().into_iter().enumerate() {
        let at_ns = (k as f64 / RATE_HZ * 1e9) as i64;
        // Buffers that hold the longest window of 30 s, and what the variability keeps, have grown.
        if k == 160 * 130 {
            (events, before) = (0, allocations());
        }
        analysis.push(at_ns, &[sample]);
        while analysis.next_event().is_some() {
            events += 1;
        }
        if k % 130 == 0 {
            analysis.forget(at_ns - 30_000_000_000);
        }
    }
    let allocations = allocations() - before;
    assert!(events > 90 && allocations <= events, "{allocations} for {events} events");
}
