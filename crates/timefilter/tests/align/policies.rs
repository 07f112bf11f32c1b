//! Each policy against its definition, spelled out without any cleverness.

use proptest::prelude::*;
use teampulse_timefilter::align::{
    Aggregate, AlignError, Mode, Output, Policy, RowTimes, Sample, SourceSettings, Validity,
};

use crate::story::{KeptCell, MS, Outcome, SECOND};

/// A stream whose samples are all known, and its cell at `row` by the definition of its policy.
fn defined(policy: Policy, samples: &[(i64, f64)], row: i64) -> (f64, i64, Validity) {
    let before = samples.iter().rfind(|sample| sample.0 <= row);
    let after = samples.iter().find(|sample| sample.0 > row);
    let age = before.map_or(i64::MAX, |before| row - before.0);
    let missing = (f64::NAN, age, Validity::Missing);
    match policy {
        Policy::Exact => match before {
            Some(&(time, value)) if time == row => (value, 0, Validity::Fresh),
            _ => missing,
        },
        Policy::Nearest { tolerance_nanos } => {
            let both = before.iter().chain(&after).min_by_key(|sample| (sample.0 - row).abs());
            match both {
                Some(&&(time, value)) if (time - row).abs() <= tolerance_nanos => {
                    (value, row - time, Validity::Fresh)
                }
                _ => missing,
            }
        }
        Policy::Hold { max_age_nanos } => match before {
            None => missing,
            Some(&(_, value)) if age == 0 => (value, 0, Validity::Fresh),
            Some(&(_, value)) if age <= max_age_nanos => (value, age, Validity::Held),
            Some(&(_, value)) => (value, age, Validity::Stale),
        },
        Policy::Linear { max_gap_nanos } => match (before, after) {
            (None, _) => missing,
            (Some(&(_, value)), _) if age == 0 => (value, 0, Validity::Fresh),
            (Some(l), Some(r)) if r.0 - l.0 <= max_gap_nanos => {
                let share = (row - l.0) as f64 / (r.0 - l.0) as f64;
                (l.1 + share * (r.1 - l.1), row - r.0, Validity::Fresh)
            }
            _ => (f64::NAN, age, Validity::Gap),
        },
        Policy::Window { length_nanos, aggregate } => {
            let inside = |sample: &&(i64, f64)| sample.0 > row - length_nanos && sample.0 <= row;
            let inside: Vec<f64> = samples.iter().filter(inside).map(|sample| sample.1).collect();
            let value = match aggregate {
                Aggregate::Count => inside.len() as f64,
                _ if inside.is_empty() => return missing,
                Aggregate::Mean => inside.iter().sum::<f64>() / inside.len() as f64,
                Aggregate::Min => inside.iter().copied().fold(f64::INFINITY, f64::min),
                Aggregate::Max => inside.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                Aggregate::Last => inside[inside.len() - 1],
            };
            (value, age, Validity::Fresh)
        }
    }
}

fn same(cell: &KeptCell, (value, age_nanos, validity): (f64, i64, Validity)) -> bool {
    let same_value = cell.value() == value || (cell.value().is_nan() && value.is_nan());
    same_value && cell.age_nanos == age_nanos && cell.validity == validity
}

fn policies() -> impl Strategy<Value = Policy> {
    let aggregates = prop::sample::select(
        &[Aggregate::Mean, Aggregate::Min, Aggregate::Max, Aggregate::Last, Aggregate::Count][..],
    );
    prop_oneof![
        Just(Policy::Exact),
        (0..60_i64).prop_map(|ms| Policy::Nearest { tolerance_nanos: ms * MS }),
        (0..90_i64).prop_map(|ms| Policy::Hold { max_age_nanos: ms * MS }),
        (0..90_i64).prop_map(|ms| Policy::Linear { max_gap_nanos: ms * MS }),
        (1..90_i64, aggregates)
            .prop_map(|(ms, aggregate)| Policy::Window { length_nanos: ms * MS, aggregate }),
    ]
}

/// Times in order with random steps, some of them none, and a value each.
fn streams() -> impl Strategy<Value = Vec<(i64, f64)>> {
    prop::collection::vec((0..50_i64, -100_i32..100), 1..60).prop_map(|steps| {
        let step = |time: &mut i64, (ms, value): (i64, i32)| {
            *time += ms * MS;
            Some((*time, f64::from(value)))
        };
        steps.into_iter().scan(SECOND, step).collect()
    })
}

/// The minimum lateness for which the second of two equal stamps is not late.
fn with_equal_stamps(policy: Policy) -> SourceSettings {
    SourceSettings { lateness_nanos: 1, ..SourceSettings::new(policy) }
}

proptest! {
    /// Nothing is late, so each cell is as its policy says, whatever the others' rates and policies.
    #[test]
    fn a_cell_is_what_its_policy_says(
        streams in prop::collection::vec((policies(), streams()), 1..5),
        period in 1..40_i64,
    ) {
        let mut outcome = Outcome::grid(period * MS);
        let ids: Vec<_> = streams
            .iter()
            .map(|(policy, _)| outcome.aligner.add(with_equal_stamps(*policy)).unwrap())
            .collect();
        let mut samples: Vec<_> = ids
            .iter()
            .zip(&streams)
            .flat_map(|(id, (_, samples))| samples.iter().map(move |sample| (sample.0, *id, sample.1)))
            .collect();
        samples.sort_by_key(|sample| sample.0);
        let (first, last) = (samples[0].0, samples[samples.len() - 1].0);
        for (time, id, value) in samples {
            // Two seconds, the idle time-out, are longer than any gap here is.
            outcome.at(id, time, value);
        }
        outcome.finish();
        let step = period * MS;
        let expected: Vec<i64> = ((first + step - 1) / step..=last / step).map(|row| row * step).collect();
        prop_assert_eq!(outcome.times(), expected);
        for row in outcome.rows() {
            for (id, (policy, samples)) in ids.iter().zip(&streams) {
                let cell = row.cell(*id);
                let defined = defined(*policy, samples, row.at);
                prop_assert!(same(cell, defined), "{policy} at {}: {cell:?} {defined:?}", row.at);
            }
        }
    }

    #[test]
    fn rows_onto_a_pivot_are_at_its_samples(pivot in streams(), other in streams(), policy in policies()) {
        let mut outcome = Outcome::new(RowTimes::Pivot, Mode::Reproducible);
        let pivot_id = outcome.aligner.add(with_equal_stamps(Policy::Exact)).unwrap();
        let other_id = outcome.aligner.add(with_equal_stamps(policy)).unwrap();
        let mut samples: Vec<_> = pivot.iter().map(|sample| (sample.0, pivot_id, sample.1)).collect();
        samples.extend(other.iter().map(|sample| (sample.0, other_id, sample.1)));
        samples.sort_by_key(|sample| sample.0);
        for (time, id, value) in samples {
            outcome.at(id, time, value);
        }
        outcome.finish();
        let mut times: Vec<i64> = pivot.iter().map(|sample| sample.0).collect();
        times.dedup();
        prop_assert_eq!(outcome.times(), times);
        for row in outcome.rows() {
            prop_assert!(same(row.cell(other_id), defined(policy, &other, row.at)));
        }
    }

    #[test]
    fn a_line_is_met_exactly(times in streams(), slope in -5_i32..5, period in 1..20_i64) {
        let line = |time: i64| f64::from(slope) * (time - SECOND) as f64 / MS as f64;
        let mut outcome = Outcome::grid(period * MS);
        let id = outcome.add("linear:1s");
        for (time, _) in &times {
            outcome.at(id, *time, line(*time));
        }
        outcome.finish();
        for row in outcome.rows() {
            let error = (row.cell(id).value() - line(row.at)).abs();
            prop_assert!(error <= 1e-9 * line(row.at).abs().max(1.0), "{error}");
        }
    }
}

#[test]
fn a_row_of_a_grid_is_at_a_multiple_of_the_period() {
    let mut outcome = Outcome::grid(15 * MS);
    let id = outcome.add("hold:1s");
    for time in [-100, -90, -20, 0, 44, 45] {
        outcome.at(id, time * MS, 1.0);
    }
    assert_eq!(outcome.times(), [-90, -75, -60, -45, -30, -15, 0, 15, 30, 45].map(|ms| ms * MS));
}

#[test]
fn a_sample_without_a_number_is_no_value_but_shows_that_its_source_is_there() {
    let mut outcome = Outcome::grid(10 * MS);
    let id = outcome.add("linear:30ms");
    for (time, value) in [(0, 0.0), (20, 2.0), (40, f64::NAN), (60, 6.0), (80, 8.0)] {
        outcome.at(id, time * MS, value);
    }
    outcome.finish();
    let validities: Vec<Validity> =
        outcome.rows().iter().map(|row| row.cell(id).validity).collect();
    let mut expected = [Validity::Fresh; 9];
    expected[3..6].fill(Validity::Gap);
    assert_eq!(validities, expected);
}

#[test]
fn a_held_channel_has_no_values_in_between() {
    let mut outcome = Outcome::grid(10 * MS);
    let policy = "linear:1s".parse().unwrap();
    let id =
        outcome.aligner.add(SourceSettings { channels: 2, ..SourceSettings::new(policy) }).unwrap();
    outcome.aligner.hold(id, &[false, true]).unwrap();
    let mut rows = Vec::new();
    for (time, values) in [(0, [0.0, 0.0]), (20, [2.0, 1.0]), (40, [4.0, 0.0])] {
        let sample = Sample { measured: time * MS, arrival: time * MS, values: &values };
        let take = |output: Output<'_>| {
            if let Output::Row(row) = output {
                rows.push(row.cell(id).unwrap().values.to_vec());
            }
        };
        outcome.aligner.push(id, sample, take).unwrap();
    }
    assert_eq!(rows, [[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 1.0], [4.0, 0.0]]);
    let expected = Err(AlignError::Channels { expected: 2, got: 1 });
    assert_eq!(outcome.aligner.hold(id, &[true]), expected);
}

#[test]
fn a_channel_without_a_number_stays_without_one() {
    let mut outcome = Outcome::grid(10 * MS);
    let policy = "linear:1s".parse().unwrap();
    let id =
        outcome.aligner.add(SourceSettings { channels: 2, ..SourceSettings::new(policy) }).unwrap();
    let mut rows = Vec::new();
    for (time, values) in [(0, [0.0, 0.0]), (20, [2.0, f64::NAN]), (40, [4.0, 4.0])] {
        let sample = Sample { measured: time * MS, arrival: time * MS, values: &values };
        outcome
            .aligner
            .push(id, sample, |output| {
                if let Output::Row(row) = output {
                    let values = row.cell(id).unwrap().values;
                    rows.push((values[0], values[1].is_nan()));
                }
            })
            .unwrap();
    }
    assert_eq!(rows, [(0.0, false), (1.0, true), (2.0, true), (3.0, true), (4.0, false)]);
}
