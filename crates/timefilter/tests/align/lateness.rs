//! What becomes of samples that come too late, or too early.

use proptest::prelude::*;
use teampulse_timefilter::align::{
    AHEAD_NANOS, LeftOutReason, SourceEvent, SourceSettings, Validity,
};

use crate::story::{MS, Outcome, SECOND};

#[test]
fn a_sample_within_the_lateness_takes_its_place() {
    let mut outcome = Outcome::grid(10 * MS);
    let policy = "linear:1s".parse().unwrap();
    let settings = SourceSettings { lateness_nanos: 25 * MS, ..SourceSettings::new(policy) };
    let id = outcome.aligner.add(settings).unwrap();
    for time in [0, 20, 10, 40, 30, 50, 70, 60, 80, 100] {
        outcome.push(id, time * MS, SECOND, (time * time) as f64);
    }
    outcome.finish();
    let values: Vec<f64> = outcome.rows().iter().map(|row| row.cell(id).value()).collect();
    assert!(outcome.left_out().is_empty());
    assert_eq!(values[..9], [0.0, 100.0, 400.0, 900.0, 1600.0, 2500.0, 3600.0, 4900.0, 6400.0]);
}

#[test]
fn a_late_sample_is_reported_counted_and_still_used() {
    let mut outcome = Outcome::grid(10 * MS);
    let id = outcome.add("hold:1s");
    for (time, value) in [(0, 0.0), (10, 1.0), (20, 2.0), (15, 1.5), (22, 2.2), (40, 4.0)] {
        outcome.push(id, time * MS, SECOND, value);
    }
    assert_eq!(outcome.left_out(), [(id, 15 * MS, LeftOutReason::Late)]);
    assert_eq!(outcome.aligner.counts(id).unwrap().late, 1);
    assert_eq!(outcome.row(30 * MS).cell(id).value(), 2.2);

    let mut outcome = Outcome::grid(10 * MS);
    let id = outcome.add("count:100ms");
    for time in [0, 10, 20, 15, 30] {
        outcome.push(id, time * MS, SECOND, 1.0);
    }
    assert_eq!(outcome.row(30 * MS).cell(id).value(), 5.0);
}

#[test]
fn a_source_that_delivers_but_behind_is_late_until_it_catches_up() {
    let mut outcome = Outcome::grid(100 * MS);
    let prompt = outcome.add("hold:1s");
    let behind = outcome.add("hold:1s");
    for time in (0..60 * SECOND).step_by(100 * MS as usize) {
        outcome.at(prompt, time, 1.0);
        let delay = if (20 * SECOND..40 * SECOND).contains(&time) { 5 * SECOND } else { 0 };
        outcome.push(behind, time - delay, time, time as f64);
    }
    assert_eq!(outcome.events(), [SourceEvent::Behind(behind), SourceEvent::Back(behind)]);
    let counts = outcome.aligner.counts(behind).unwrap();
    let late_rows: Vec<i64> = (outcome.rows().iter())
        .filter(|row| row.cell(behind).validity == Validity::Late)
        .map(|row| row.at)
        .collect();
    assert!(late_rows.first().is_some_and(|at| *at >= 20 * SECOND));
    assert!(late_rows.last().is_some_and(|at| *at <= 40 * SECOND));
    assert_eq!(late_rows.len(), 201);
    // And the first that is not late, of a row that was out just before.
    assert_eq!(counts.late, 201);
    assert_eq!(outcome.times().len(), 600);
}

#[test]
fn a_stamp_from_the_future_is_set_aside_and_holds_nothing_up() {
    let mut outcome = Outcome::grid(100 * MS);
    let (sane, mad) = (outcome.add("hold:1s"), outcome.add("hold:1s"));
    for time in (0..10 * SECOND).step_by(100 * MS as usize) {
        outcome.at(sane, time, 1.0);
        outcome.at(mad, time, 1.0);
        outcome.push(mad, time + 3_600 * SECOND, time, 1.0);
        outcome.push(mad, i64::MAX, time, 1.0);
    }
    assert_eq!(outcome.times().len(), 100);
    assert_eq!(outcome.aligner.counts(mad).unwrap().ahead, 200);
    assert!(
        outcome
            .left_out()
            .iter()
            .all(|left_out| left_out.2 == LeftOutReason::Ahead && left_out.1 > AHEAD_NANOS)
    );
    assert!(outcome.rows().iter().all(|row| row.cell(mad).validity == Validity::Fresh));
}

#[test]
fn what_there_is_no_room_for_is_reported_and_counted() {
    let mut outcome = Outcome::grid(100 * MS);
    let policy = "linear:1s".parse().unwrap();
    let fast = outcome
        .aligner
        .add(SourceSettings { capacity: 50, ..SourceSettings::new(policy) })
        .unwrap();
    let slow = outcome.add("hold:5s");
    outcome.at(slow, 0, 1.0);
    for time in 0..1_000 {
        outcome.at(fast, time * MS, time as f64);
    }
    let crowded = outcome.aligner.counts(fast).unwrap().crowded;
    // The first 100 are behind the next row, and 50 are kept.
    assert_eq!(crowded, 850);
    assert_eq!(outcome.left_out().len(), 850);
    assert!(
        outcome
            .left_out()
            .iter()
            .all(|left_out| left_out.0 == fast && left_out.2 == LeftOutReason::Crowded)
    );
}

proptest! {
    /// Every sample is used, or reported and counted.
    #[test]
    fn no_sample_disappears(
        arrivals in prop::collection::vec((0..100 * MS, 0..3 * SECOND), 1..100),
        lateness in 0..500 * MS,
    ) {
        let mut outcome = Outcome::grid(10 * MS);
        let all_time = "count:86400s".parse().unwrap();
        let settings = SourceSettings { lateness_nanos: lateness, ..SourceSettings::new(all_time) };
        let id = outcome.aligner.add(settings).unwrap();
        let mut now = 10 * SECOND;
        for (later, delay) in &arrivals {
            now += later;
            outcome.push(id, now - delay, now, 1.0);
        }
        outcome.push(id, now + 10 * MS, now + 10 * MS, 1.0);
        outcome.finish();
        let counted = outcome.rows().last().map_or(0.0, |row| row.cell(id).value());
        prop_assert_eq!(counted, (arrivals.len() + 1) as f64 - f64::from((now + 10 * MS) % (10 * MS) != 0));
        let counts = outcome.aligner.skipped();
        prop_assert_eq!(counts, 0);
    }
}
