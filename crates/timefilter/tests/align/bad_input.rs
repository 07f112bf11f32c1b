//! Stamps, values and settings that make no sense.

use proptest::prelude::*;
use teampulse_timefilter::align::{
    AlignError, Aligner, LONGEST_NANOS, MOST_SOURCES, Mode, Output, Policy, ROWS_IN_SILENCE,
    RowTimes, Run, Sample, SourceSettings,
};

fn times() -> impl Strategy<Value = i64> {
    let near = 1_700_000_000_000_000_000..1_700_000_010_000_000_000_i64;
    let edges =
        prop::sample::select(&[i64::MIN, i64::MIN + 1, -1, 0, 1, i64::MAX - 1, i64::MAX][..]);
    prop_oneof![4 => near, 1 => edges, 1 => any::<i64>()]
}

fn numbers() -> impl Strategy<Value = f64> {
    prop_oneof![3 => any::<f64>(), 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)]
}

const POLICIES: [&str; 6] =
    ["exact", "nearest:86400s", "hold:0s", "linear:86400s", "mean:1ms", "count:86400s"];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn no_stamp_and_no_value_makes_it_panic_or_grow(
        policies in [prop::sample::select(&POLICIES[..]), prop::sample::select(&POLICIES[..])],
        pushes in prop::collection::vec((0..2_usize, times(), times(), numbers(), numbers()), 1..4),
        on_pivot in any::<bool>(),
        available in any::<bool>(),
        period_nanos in prop::sample::select(&[1, 1_000, 15_625_000, LONGEST_NANOS][..]),
        idle_nanos in prop::sample::select(&[1, 20_000, 2_000_000_000, LONGEST_NANOS][..]),
    ) {
        let onto = if on_pivot { RowTimes::Pivot } else { RowTimes::Grid { period_nanos } };
        let mode = if available { Mode::Available } else { Mode::Reproducible };
        let mut aligner = Aligner::new(onto, mode).unwrap();
        let settings = |policy: &str| SourceSettings {
            capacity: 8,
            idle_nanos,
            ..SourceSettings::new(policy.parse().unwrap())
        };
        let sources = policies.map(|policy| aligner.add(settings(policy)).unwrap());
        let (mut rows, given) = (0, 4 * pushes.len() as u64);
        let mut count = |output: Output<'_>| {
            rows += u64::from(matches!(output, Output::Row(_)));
        };
        for (source, measured, arrival, value, period_nanos) in pushes {
            let values = &[value, 1.0, f64::NAN];
            aligner.push(sources[source], Sample { measured, arrival, values: &[value] }, &mut count).unwrap();
            let run = Run { measured, period_nanos, arrival, values };
            aligner.push_run(sources[source], run, &mut count).unwrap();
            aligner.tick(arrival, &mut count);
        }
        aligner.finish(&mut count);
        prop_assert!(rows <= (given + 1) * (ROWS_IN_SILENCE as u64 + 1), "{rows} {given}");
        prop_assert!(aligner.bytes_bound() < 20_000);
    }
}

/// How many rows a grid gives out of pushes `(measured, arrival)` of two sources in turn.
fn rows(period_nanos: i64, mode: Mode, idle_nanos: i64, pushes: &[(i64, i64)]) -> u64 {
    let mut aligner = Aligner::new(RowTimes::Grid { period_nanos }, mode).unwrap();
    let settings = SourceSettings { idle_nanos, ..SourceSettings::new(Policy::Exact) };
    let sources = [(); 2].map(|()| aligner.add(settings).unwrap());
    for (source, &(measured, arrival)) in sources.iter().cycle().zip(pushes) {
        aligner.push(*source, Sample { measured, arrival, values: &[1.0] }, |_| ()).unwrap();
        // A bound that is broken is broken by billions of rows: the test should fail, not hang.
        assert!(aligner.rows() < 1_000_000);
    }
    aligner.finish(|_| ());
    aligner.rows()
}

#[test]
fn a_sample_gives_no_more_rows_than_silence_has_whatever_the_period() {
    let now = 1_700_000_000_000_000_000;
    let most = ROWS_IN_SILENCE as u64 + 1;
    let day = LONGEST_NANOS;
    for pushes in [
        &[(now, now), (now - day, now)][..],
        &[(i64::MIN, now), (now, now)],
        &[(now - day, now), (now, now)],
        &[(0, now), (now, now + day)],
    ] {
        let rows = rows(1, Mode::Reproducible, day, pushes);
        assert!(rows <= most * (pushes.len() as u64 + 1), "{rows} {pushes:?}");
    }
}

#[test]
fn rows_end_with_all_time() {
    let begin = i64::MAX - 100_000_000_000;
    for mode in [Mode::Reproducible, Mode::Available] {
        for period_nanos in [1, 15_625_000] {
            let pushes = [(begin, begin), (i64::MAX, i64::MAX), (i64::MAX, i64::MAX)];
            let rows = rows(period_nanos, mode, 20_000, &pushes);
            assert!(rows <= 4 * (ROWS_IN_SILENCE as u64 + 1), "{rows}");
        }
    }
}

#[test]
fn a_million_sources_are_refused() {
    let mut aligner = Aligner::new(RowTimes::Pivot, Mode::Reproducible).unwrap();
    let settings = SourceSettings::new(Policy::Exact);
    let added = (0..1_000_000).take_while(|_| aligner.add(settings).is_ok()).count();
    assert_eq!(added, MOST_SOURCES);
    let error = aligner.add(settings).unwrap_err().to_string();
    assert_eq!(error, "expected at most 4096 sources at once, got one more");
}

#[test]
fn what_is_out_of_range_is_reported() {
    let mut aligner = Aligner::new(RowTimes::Pivot, Mode::Reproducible).unwrap();
    let fine = SourceSettings::new(Policy::Exact);
    for settings in [
        SourceSettings { channels: 0, ..fine },
        SourceSettings { channels: usize::MAX, ..fine },
        SourceSettings { capacity: 0, ..fine },
        SourceSettings { capacity: usize::MAX, ..fine },
        SourceSettings { idle_nanos: 0, ..fine },
        SourceSettings { idle_nanos: i64::MAX, ..fine },
        SourceSettings { lateness_nanos: -1, ..fine },
        SourceSettings { policy: Policy::Hold { max_age_nanos: i64::MIN }, ..fine },
    ] {
        let error = aligner.add(settings).unwrap_err().to_string();
        assert!(error.starts_with("expected ") && error.contains(", got "), "{error}");
    }
    for period_nanos in [i64::MIN, -1, 0, LONGEST_NANOS + 1] {
        assert!(Aligner::new(RowTimes::Grid { period_nanos }, Mode::Reproducible).is_err());
    }
    let two = aligner.add(SourceSettings { channels: 2, ..fine }).unwrap();
    let sample = Sample { measured: 0, arrival: 0, values: &[1.0] };
    let refused = Err(AlignError::Channels { expected: 2, got: 1 });
    assert_eq!(aligner.push(two, sample, |_| ()), refused);
    let run = Run { measured: 0, period_nanos: 1.0, arrival: 0, values: &[1.0] };
    assert_eq!(aligner.push_run(two, run, |_| ()), refused);
}
