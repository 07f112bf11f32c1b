use proptest::prelude::*;

use super::*;

const SECOND_NS: i64 = 1_000_000_000;

/// A sample: its time [ns] and its numbers.
type Sample = (i64, Vec<f64>);

/// Windows that end every hop.
fn each_hop(lengths_ns: &[i64]) -> Vec<Pace> {
    lengths_ns.iter().map(|&length_ns| Pace { length_ns, hops: 1 }).collect()
}

/// The values of each window as it ends, hop by hop.
fn reported(samples: &[Sample], rate_hz: f64, lengths_ns: &[i64]) -> Vec<Vec<View>> {
    views_at_paces(samples, rate_hz, &each_hop(lengths_ns))
}

fn views_at_paces(samples: &[Sample], rate_hz: f64, paces: &[Pace]) -> Vec<Vec<View>> {
    let width = samples.first().map_or(1, |sample| sample.1.len());
    let mut rolling = Rolling::new(rate_hz, width, paces, SECOND_NS);
    let mut windows = Vec::new();
    for (at_ns, numbers) in samples {
        while let Some(end_ns) = rolling.advance(*at_ns) {
            let places = 0..paces.len();
            let ends: Vec<usize> = places.filter(|place| rolling.ends(*place, end_ns)).collect();
            windows.push(ends.into_iter().map(|place| rolling.window(place)).collect());
        }
        rolling.push(*at_ns, numbers);
    }
    windows
}

/// The expected window, from the samples that came before the first one after its end.
fn expected(samples: &[Sample], channel: usize, span: Span) -> Option<Summary> {
    let ended =
        samples.iter().position(|(at_ns, _)| *at_ns >= span.end_ns).unwrap_or(samples.len());
    let mut inside: Vec<&Sample> =
        samples[..ended].iter().filter(|(at_ns, _)| span.holds(*at_ns)).collect();
    inside.sort_by_key(|sample| sample.0);
    let secs: Vec<f64> =
        inside.iter().map(|sample| (sample.0 - span.begin_ns) as f64 / 1e9).collect();
    let values: Vec<f64> = inside.iter().map(|sample| sample.1[channel]).collect();
    describe(&secs, &values)
}

fn is_near(found: Option<f64>, exact: Option<f64>, tolerance: f64) -> bool {
    match (found, exact) {
        (Some(found), Some(exact)) => (found - exact).abs() <= tolerance,
        (found, exact) => found == exact,
    }
}

/// Compares median, extremes and counts exactly; the rest within a share of the range of the values.
fn assert_same(found: Option<Summary>, exact: Option<Summary>, share: f64) {
    let (Some(found), Some(exact)) = (found, exact) else {
        assert_eq!(found, exact);
        return;
    };
    let bare = |summary: Summary| Summary { mean: 0.0, sd: None, slope_per_sec: None, ..summary };
    assert_eq!(bare(found), bare(exact));
    let (reach, size) = (exact.greatest - exact.least, exact.least.abs().max(exact.greatest.abs()));
    assert!((found.mean - exact.mean).abs() <= 1e-9 * size, "{found:?} {exact:?}");
    assert!(is_near(found.sd, exact.sd, share * reach), "{found:?} {exact:?}");
    let (rise, exact_rise) = (found.slope_per_sec, exact.slope_per_sec);
    // For values close in time, small errors make steep lines.
    let steepness = exact_rise.map_or(0.0, f64::abs) + reach;
    assert!(is_near(rise, exact_rise, share * steepness), "{found:?} {exact:?}");
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -5.0..5.0f64,
        2 => (-3i32..3).prop_map(f64::from),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
    ]
}

/// Samples every 50 to 150 ms, with gaps, some of them late by up to three seconds.
fn samples() -> impl Strategy<Value = Vec<Sample>> {
    let step_ms = prop_oneof![40 => 50i64..150, 1 => 1000i64..5000, 1 => 20_000i64..30_000];
    let late_ms = prop_oneof![9 => Just(0i64), 1 => 0i64..3000];
    let one = (step_ms, late_ms, prop::collection::vec(number(), 2));
    prop::collection::vec(one, 1..300).prop_map(|steps| {
        let mut now_ms = 1_700_000_000_000;
        let mut sample = |(step_ms, late_ms, numbers)| {
            now_ms += step_ms;
            ((now_ms - late_ms) * 1_000_000, numbers)
        };
        steps.into_iter().map(&mut sample).collect()
    })
}

#[test]
fn a_constant_has_neither_spread_nor_slope() {
    let samples: Vec<Sample> = (0..200).map(|k| (k * SECOND_NS / 20, vec![0.1])).collect();
    for views in reported(&samples, 20.0, &[3 * SECOND_NS]) {
        let summary = views[0].channels[0].summary.unwrap();
        assert_eq!((summary.mean, summary.median, summary.mad), (0.1, 0.1, 0.0));
        assert_eq!((summary.sd, summary.slope_per_sec), (Some(0.0), Some(0.0)));
    }
}

#[test]
fn small_noise_on_a_huge_offset_keeps_its_spread() {
    let noise = |k: i64| (k * 7919 % 1000) as f64 / 1000.0;
    let samples: Vec<Sample> =
        (0..6000).map(|k| (k * SECOND_NS / 100, vec![1e9 + noise(k)])).collect();
    let all = reported(&samples, 100.0, &[30 * SECOND_NS]);
    assert_eq!(all.len(), 59);
    for view in all.iter().map(|views| &views[0]) {
        let small = samples.iter().filter(|sample| view.span.holds(sample.0));
        let small: Vec<f64> = small.map(|sample| sample.1[0] - 1e9).collect();
        let exact = describe(&vec![0.0; small.len()], &small).unwrap().sd.unwrap();
        let sd = view.channels[0].summary.unwrap().sd.unwrap();
        assert!((sd / exact - 1.0).abs() < 1e-6, "{sd} {exact}");
    }
}

#[test]
fn a_window_is_young_until_it_lies_after_the_first_sample() {
    let samples: Vec<Sample> = (0..100).map(|k| (k * SECOND_NS / 10, vec![0.0])).collect();
    let all = reported(&samples, 10.0, &[4 * SECOND_NS]);
    let of = |views: &Vec<View>| (views[0].is_young, views[0].channels[0].coverage);
    let expected = [(true, 0.25), (true, 0.5), (true, 0.75), (false, 1.0), (false, 1.0)];
    assert_eq!(all.iter().take(5).map(of).collect::<Vec<_>>(), expected);
}

#[test]
fn a_gap_longer_than_the_longest_window_is_passed_over() {
    let hour_ns = 3600 * SECOND_NS;
    let early = (0..50).map(|k| k * SECOND_NS / 10);
    let samples: Vec<Sample> =
        early.clone().chain(early.map(|at_ns| hour_ns + at_ns)).map(|at| (at, vec![1.0])).collect();
    let all = reported(&samples, 10.0, &[3 * SECOND_NS]);
    assert_eq!(all.len(), 8);
    let after = &all[4][0];
    assert_eq!((after.span.end_ns, after.is_young), (hour_ns + SECOND_NS, false));
    assert_eq!(after.channels[0].summary.unwrap().n, 10);
}

#[test]
fn what_is_to_be_kept_can_be_described_and_the_rest_is_let_go() {
    let mut rolling = Rolling::new(10.0, 1, &each_hop(&[2 * SECOND_NS]), SECOND_NS);
    for k in 0..1000 {
        let at_ns = k * SECOND_NS / 10;
        while rolling.advance(at_ns).is_some() {}
        rolling.push(at_ns, &[k as f64]);
        if k == 900 {
            rolling.keep_from(90 * SECOND_NS);
        }
    }
    let view = rolling.describe(Span { begin_ns: 90 * SECOND_NS, end_ns: 100 * SECOND_NS });
    let summary = view.channels[0].summary.unwrap();
    assert_eq!((summary.n, summary.mean, summary.least), (100, 949.5, 900.0));
    let early = rolling.describe(Span { begin_ns: 0, end_ns: 80 * SECOND_NS });
    assert_eq!(early.channels[0], Described { coverage: 0.0, summary: None });
    rolling.keep_from(i64::MAX);
    rolling.advance(100 * SECOND_NS);
    assert!(rolling.kept.places(Span { begin_ns: 0, end_ns: i64::MAX }).len() <= 20);
}

#[test]
fn a_window_of_which_not_all_is_held_does_not_end_until_it_is_again() {
    let lengths_ns = [2 * SECOND_NS, 8 * SECOND_NS];
    let samples: Vec<Sample> =
        (0..400).map(|k| (k * SECOND_NS / 10, vec![(k % 13) as f64])).collect();
    let mut rolling = Rolling::new(10.0, 1, &each_hop(&lengths_ns), SECOND_NS);
    let mut ends = [Vec::new(), Vec::new()];
    for (at_ns, numbers) in &samples {
        while let Some(end_ns) = rolling.advance(*at_ns) {
            for (place, ends) in ends.iter_mut().enumerate() {
                if rolling.ends(place, end_ns) {
                    let view = rolling.window(place);
                    assert_same(view.channels[0].summary, expected(&samples, 0, view.span), 1e-12);
                    ends.push(end_ns / SECOND_NS);
                }
            }
        }
        rolling.push(*at_ns, numbers);
        // Between the 15th and the 20th second no more than five are held.
        if (15..20).contains(&(at_ns / SECOND_NS)) {
            rolling.hold_since(at_ns - 5 * SECOND_NS);
        }
        if (16..20).contains(&(at_ns / SECOND_NS)) {
            assert!(rolling.kept.places(Span { begin_ns: 0, end_ns: i64::MAX }).len() <= 80);
        }
    }
    assert_eq!(ends[0], (1..40).collect::<Vec<i64>>());
    let expected: Vec<i64> = (1..=15).chain(23..40).collect();
    assert_eq!(ends[1], expected);
}

/// Would take hours if a second were scanned again for each of its late samples.
#[test]
fn samples_that_overlap_by_the_thousands_are_taken_in_at_once() {
    let mut rolling = Rolling::new(1000.0, 1, &each_hop(&[2 * SECOND_NS]), SECOND_NS);
    // Waves of 625 samples at 1000 Hz, each 10 ms: the end of one lies behind the next sixty.
    for wave in 0..400 {
        for sample in 0..625 {
            let at_ns = wave * SECOND_NS / 100 + sample * SECOND_NS / 1000;
            while rolling.advance(at_ns).is_some() {}
            rolling.push(at_ns, &[(wave % 7) as f64]);
        }
    }
    let view = rolling.window(0);
    let described = rolling.describe(view.span);
    assert_eq!(view.channels[0].summary.unwrap().n, 2 * 62_500);
    assert_eq!(
        view.channels[0].summary.unwrap().median,
        described.channels[0].summary.unwrap().median
    );
}

#[test]
fn times_at_both_ends_of_all_time_do_no_harm() {
    let times_ns = [i64::MAX, i64::MIN, 0, i64::MAX - 1, i64::MIN + 1, 5, i64::MAX];
    for rotation in 0..times_ns.len() {
        let mut times_ns = times_ns;
        times_ns.rotate_left(rotation);
        let samples: Vec<Sample> = times_ns.iter().map(|at_ns| (*at_ns, vec![1.0])).collect();
        let paces = [(1, 1), (86_400, i64::MAX), (30, 7)]
            .map(|(secs, hops)| Pace { length_ns: secs * SECOND_NS, hops });
        views_at_paces(&samples, 0.0, &paces);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_window_is_what_its_samples_come_to(samples in samples(), is_even in any::<bool>()) {
        let rate_hz = if is_even { 10.0 } else { 0.0 };
        let lengths_ns = [SECOND_NS, 2 * SECOND_NS + SECOND_NS / 2, 10 * SECOND_NS];
        for view in reported(&samples, rate_hz, &lengths_ns).iter().flatten() {
            for (channel, described) in view.channels.iter().enumerate() {
                let exact = expected(&samples, channel, view.span);
                assert_same(described.summary, exact, 1e-9);
                if is_even {
                    let share = exact.map_or(0, |exact| exact.n) as f64 / (view.span.secs() * 10.0);
                    prop_assert!((described.coverage - share.min(1.0)).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_window_that_ends_more_seldom_is_the_same_when_it_ends(
        samples in samples(), lengths_secs in prop::collection::vec((1i64..12, 1i64..15), 1..4),
    ) {
        let paces: Vec<Pace> = lengths_secs
            .iter()
            .map(|&(secs, hops)| Pace { length_ns: secs * SECOND_NS, hops })
            .collect();
        let begin_ns = samples[0].0;
        for view in views_at_paces(&samples, 0.0, &paces).iter().flatten() {
            let Span { begin_ns: from_ns, end_ns } = view.span;
            let ends = |pace: &Pace| {
                pace.length_ns == end_ns - from_ns && (end_ns - begin_ns) % (pace.hops * SECOND_NS) == 0
            };
            prop_assert!(paces.iter().any(ends));
            for (channel, described) in view.channels.iter().enumerate() {
                assert_same(described.summary, expected(&samples, channel, view.span), 1e-9);
            }
        }
    }

    #[test]
    fn a_window_stays_as_it_ended_until_it_ends_again(samples in samples()) {
        let pace = Pace { length_ns: 4 * SECOND_NS, hops: 5 };
        let mut rolling = Rolling::new(0.0, 2, &[pace], SECOND_NS);
        let mut held: Option<View> = None;
        for (at_ns, numbers) in samples.iter().filter(|sample| sample.0 >= samples[0].0) {
            let is_late = rolling.newest_ns().is_some_and(|newest_ns| *at_ns < newest_ns);
            while rolling.advance(*at_ns).is_some() {
                let view = rolling.window(0);
                if let Some(held) = held.filter(|held| held.span == view.span) {
                    prop_assert_eq!(&held, &view);
                }
                held = Some(view);
            }
            rolling.push(*at_ns, numbers);
            held = held.filter(|_| !is_late);
        }
    }

    #[test]
    fn a_window_is_described_as_any_span_is(samples in samples()) {
        let mut rolling = Rolling::new(0.0, 2, &each_hop(&[4 * SECOND_NS]), SECOND_NS);
        for (at_ns, numbers) in &samples {
            while rolling.advance(*at_ns).is_some() {
                let view = rolling.window(0);
                let same = rolling.describe(view.span);
                prop_assert_eq!((view.span, view.is_young), (same.span, same.is_young));
                for (one, other) in view.channels.iter().zip(&same.channels) {
                    prop_assert_eq!(one.coverage, other.coverage);
                    assert_same(one.summary, other.summary, 1e-9);
                }
            }
            rolling.push(*at_ns, numbers);
        }
    }
}
