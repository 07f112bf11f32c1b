//! Sources that join and leave while rows go on.

use teampulse_timefilter::align::{AlignError, Policy, Sample, SourceSettings, Validity};

use crate::story::{MS, Outcome, SECOND};

#[test]
fn a_source_that_joins_has_cells_from_then_on_and_disturbs_no_other() {
    let mut outcome = Outcome::grid(100 * MS);
    let old = outcome.add("linear:1s");
    for time in (0..5 * SECOND).step_by(50 * MS as usize) {
        outcome.at(old, time, time as f64);
    }
    assert_eq!(outcome.aligner.add(SourceSettings::new(Policy::Exact)), Err(AlignError::Begun));
    let new = outcome.join("linear:1s", 5 * SECOND);
    for time in (5 * SECOND..10 * SECOND).step_by(50 * MS as usize) {
        outcome.at(old, time, time as f64);
        outcome.at(new, time, -1.0);
    }
    outcome.finish();
    assert_eq!(outcome.times().len(), 100);
    for row in outcome.rows() {
        assert_eq!(row.cell(old).value(), row.at as f64);
        let joined = row.find(new).map(|cell| cell.validity);
        assert_eq!(joined, (row.at > 4_900 * MS).then_some(Validity::Fresh), "{}", row.at);
    }
}

#[test]
fn a_source_that_leaves_is_used_to_its_last_sample() {
    let mut outcome = Outcome::grid(100 * MS);
    let (stays, leaves, slow) =
        (outcome.add("hold:1s"), outcome.add("hold:1s"), outcome.add("hold:1s"));
    for time in (0..10 * SECOND).step_by(100 * MS as usize) {
        outcome.at(stays, time, 1.0);
        if time < 5 * SECOND {
            outcome.at(leaves, time, 1.0);
        }
        if time == 5 * SECOND {
            outcome.leave(leaves);
            let sample = Sample { measured: time, arrival: time, values: &[1.0] };
            let refused = outcome.aligner.push(leaves, sample, |_| ());
            assert_eq!(refused, Err(AlignError::Unknown));
        }
        outcome.push(slow, time - 500 * MS, time, 1.0);
    }
    outcome.finish();
    assert_eq!(outcome.times().len(), 105);
    for row in outcome.rows() {
        assert_eq!(row.find(leaves).is_some(), row.at < 5 * SECOND, "{}", row.at);
        assert!(row.find(leaves).is_none_or(|cell| cell.validity != Validity::Late));
    }
}

#[test]
fn a_place_that_was_left_is_taken_again_by_a_source_of_its_own() {
    let mut outcome = Outcome::grid(100 * MS);
    let (first, stays) = (outcome.add("hold:1s"), outcome.add("hold:1s"));
    for round in 0..10_000 {
        let passing = outcome.join("hold:1s", round * 100 * MS);
        outcome.leave(passing);
        assert!(passing != first && passing != stays);
        outcome.at(first, round * 100 * MS, 1.0);
        outcome.at(stays, round * 100 * MS, 1.0);
    }
    assert_eq!(outcome.times().len(), 10_000);
    assert!(outcome.aligner.bytes_bound() < 300_000, "{}", outcome.aligner.bytes_bound());
}

#[test]
fn the_end_of_a_recording_gives_all_rows_to_its_newest_sample() {
    let mut outcome = Outcome::grid(100 * MS);
    let (ecg, battery) = (outcome.add("linear:1s"), outcome.add("hold:5s"));
    outcome.at(battery, 0, 0.5);
    for time in (0..=1_050).step_by(50) {
        outcome.at(ecg, time * MS, time as f64);
    }
    assert_eq!(outcome.times(), [0]); // the battery may still report something
    outcome.finish();
    assert_eq!(outcome.times(), (0..=10).map(|row| row * 100 * MS).collect::<Vec<_>>());
    let last = outcome.row(SECOND);
    assert_eq!((last.cell(ecg).value(), last.cell(ecg).validity), (1_000.0, Validity::Fresh));
    assert_eq!((last.cell(battery).value(), last.cell(battery).validity), (0.5, Validity::Held));
    assert_eq!(outcome.aligner.counts(ecg).unwrap().received, 22);
}
