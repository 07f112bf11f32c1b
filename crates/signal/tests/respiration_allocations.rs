//! The search for breaths allocates nothing once its buffers have grown, and an analysis nothing but
//! what an event is made of.

mod counting;

use counting::allocations;
use std::f64::consts::TAU;

use teampulse_signal::respiration::BreathDetector;
use teampulse_signal::respiration::analysis::{Settings, causal};

fn sample(k: i64) -> f64 {
    let secs = k as f64 / 50.0;
    if k % 5000 < 100 {
        f64::NAN
    } else {
        (TAU * 0.25 * secs).sin() + 0.1 * (TAU * secs / 60.0).sin()
    }
}

#[test]
fn no_sample_allocates_while_breaths_are_looked_for() {
    let mut detector = BreathDetector::new(50.0).expect("a usual rate");
    // The longest window, what is usual, is filled after five minutes.
    let warm = (0..20_000).filter(|&k| detector.push(sample(k)).is_some()).count();
    let before = allocations();
    let found = (20_000..60_000).filter(|&k| detector.push(sample(k)).is_some()).count();
    assert_eq!(allocations(), before);
    assert!(warm > 50 && found > 100);
}

#[test]
fn an_analysis_allocates_for_its_events_alone() {
    let mut analysis = causal(&Settings::default(), 50.0).expect("a usual rate");
    let mut events = 0;
    let mut run = |from: i64, to: i64| {
        for k in from..to {
            analysis.push(k * 20_000_000, &[sample(k)]);
            events += u64::from(analysis.next_event().is_some());
            if k % 50 == 0 {
                analysis.forget(k * 20_000_000 - 60_000_000_000);
            }
        }
        std::mem::take(&mut events)
    };
    run(0, 20_000);
    let before = allocations();
    let events = run(20_000, 60_000);
    assert!(events > 100);
    assert!(allocations() - before <= events, "{} of {events}", allocations() - before);
}
