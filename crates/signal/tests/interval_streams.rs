//! Intervals that a device reports, as they come in and in whole recordings.

#[path = "synthetic/intervals.rs"]
mod synthetic;

use proptest::prelude::*;
use synthetic::intervals_ms;
use teampulse_signal::analysis::{Causal, Event, Reason, Recording, Span, Windows};
use teampulse_signal::hrv::analysis::{Settings, causal, whole};
use teampulse_signal::hrv::time_domain;
use teampulse_signal::intervals::Edit;

const SEC: i64 = 1_000_000_000;
const MIN_SPAN: Span = Span { begin_ns: 10 * SEC, end_ns: 70 * SEC };

fn of(windows: &dyn Windows, span: Span, name: &str) -> Result<f64, Reason> {
    let place = windows.values().iter().position(|each| each.name == name).expect(name);
    windows.measure(span).values[place]
}

/// As reported by a strap: at the first full second after each interval's end.
fn reported(intervals_ms: &[f64]) -> Vec<(i64, f64)> {
    let mut end_ns = 0;
    let report = |&interval_ms: &f64| {
        end_ns += (interval_ms * 1e6) as i64;
        ((end_ns / SEC + 1) * SEC, interval_ms)
    };
    intervals_ms.iter().map(report).collect()
}

fn analysed(intervals: &[(i64, f64)]) -> (Box<dyn Causal + Send>, Vec<Event>) {
    let mut analysis = causal(&Settings::default(), 0.0).expect("any rate will do");
    for &(at_ns, interval_ms) in intervals {
        analysis.push(at_ns, &[interval_ms]);
    }
    let events = std::iter::from_fn(|| analysis.next_event()).collect();
    (analysis, events)
}

#[test]
fn of_intervals_that_a_device_repeats_the_rate_is_known_and_variability_is_not() {
    let (analysis, _) = analysed(&reported(&[800.0; 120]));
    let windows: &dyn Windows = analysis.as_ref();
    assert!(windows.measure(MIN_SPAN).quality < 0.01);
    assert_eq!(of(windows, MIN_SPAN, "HRV_RMSSD"), Err(Reason::Quality));
    let mean_ms = of(windows, MIN_SPAN, "HRV_MeanNN").expect("a mean bears it");
    assert!((mean_ms - 800.0).abs() < 1e-6, "{mean_ms}");
}

#[test]
fn variability_is_that_of_the_intervals_and_not_of_the_times_of_the_host() {
    let nn = intervals_ms(200);
    let (analysis, events) = analysed(&reported(&nn));
    assert_eq!(events.len(), 200);
    assert_eq!(events[3].details, [("interval_ms", nn[3])]);
    let apart = (events[3].at_ns - events[2].at_ns) as f64 / 1e6;
    assert!((apart - nn[3]).abs() < 1e-6);
    let span = Span { begin_ns: -SEC, end_ns: 200 * SEC };
    let recording = Recording { rate_hz: 0.0, begin_ns: 0, channels: std::slice::from_ref(&nn) };
    let whole = whole(&Settings::default(), &recording).expect("it is a recording");
    assert_eq!(whole.events.len(), 200);
    assert_eq!(whole.events[0].at_ns, (nn[0] * 1e6) as i64);
    let rmssd_ms = time_domain(&nn).expect("there are intervals").rmssd_ms;
    for windows in [analysis.as_ref() as &dyn Windows, whole.windows.as_ref()] {
        let ours = of(windows, span, "HRV_RMSSD").expect("there are intervals");
        assert_eq!(of(windows, span, "HRV_N"), Ok(200.0));
        assert!((ours / rmssd_ms - 1.0).abs() < 0.02, "{ours} {rmssd_ms}");
    }
}

#[test]
fn lost_intervals_are_a_hole() {
    let nn = intervals_ms(200);
    let all = reported(&nn);
    let (complete, _) = analysed(&all);
    let before = of(complete.as_ref(), MIN_SPAN, "HRV_N").expect("a count");
    // Five were lost and nobody says so; then one of which the strap says that it is none.
    let mut some = all.clone();
    some.drain(40..45);
    some[60].1 = 0.0;
    let (analysis, events) = analysed(&some);
    assert_eq!(events.len(), 194);
    let after = of(analysis.as_ref(), MIN_SPAN, "HRV_N").expect("a count");
    assert!((before - after - 6.0).abs() <= 2.0, "{before} {after}");
    assert!(of(analysis.as_ref(), MIN_SPAN, "HRV_MaxNN").expect("a time") < 1000.0);
    let off = events.iter().zip(&nn[..40]).map(|(event, _)| event.at_ns).max();
    let late = events.last().map(|event| event.at_ns - some.last().expect("some").0);
    assert!(off.is_some() && late.is_some_and(|late| late.abs() < 1_500_000_000));
}

#[test]
fn times_that_are_earlier_from_some_interval_on_cost_one_difference() {
    let nn = intervals_ms(200);
    let rmssd_ms = time_domain(&nn).expect("there are intervals").rmssd_ms;
    // The first are reported late, or the host's clock is slow.
    for (early_secs, slow) in [(0.15, 0.0), (0.4, 0.0), (2.0, 0.0), (0.0, 0.002)] {
        let mut sum_secs = 0.0;
        let ends = nn.iter().enumerate().map(|(place, interval_ms)| {
            sum_secs += interval_ms / 1000.0;
            let early_secs = if place < 3 { 0.0 } else { early_secs };
            sum_secs * (1.0 - slow) - early_secs
        });
        let channels = [nn.clone(), ends.collect()];
        let recording = Recording { rate_hz: 0.0, begin_ns: 0, channels: &channels };
        let settings = Settings { most_astray_secs: 0.1, ..Settings::default() };
        let whole = whole(&settings, &recording).expect("it is a recording");
        let span = Span { begin_ns: -SEC, end_ns: 200 * SEC };
        let found = of(whole.windows.as_ref(), span, "HRV_RMSSD").expect("there are intervals");
        let count = of(whole.windows.as_ref(), span, "HRV_N").expect("a count");
        eprintln!(
            "{early_secs} s early, {slow} slow: RMSSD {found:.1} of {rmssd_ms:.1} ms, {count} intervals"
        );
        assert!((found / rmssd_ms - 1.0).abs() < 0.1, "{early_secs} {slow}: {found} of {rmssd_ms}");
        assert!(count >= 190.0);
    }
}

#[test]
fn a_lost_interval_of_a_recording_takes_the_time_of_the_one_before() {
    let channels = [vec![f64::NAN, 800.0, 900.0, f64::INFINITY, 700.0]];
    let recording = Recording { rate_hz: 1.0, begin_ns: 5 * SEC, channels: &channels };
    let whole = whole(&Settings::default(), &recording).expect("it is a recording");
    let at: Vec<_> =
        whole.events.iter().map(|each| (each.sample, each.at_ns / 1_000_000)).collect();
    assert_eq!(at, [(1.0, 6_800), (2.0, 7_700), (4.0, 9_300)]);
    assert_eq!(
        of(whole.windows.as_ref(), Span { begin_ns: 0, end_ns: 10 * SEC }, "HRV_N"),
        Err(Reason::Gap)
    );
    let span = Span { begin_ns: 6 * SEC - 1, end_ns: 9_400_000_000 };
    assert_eq!(of(whole.windows.as_ref(), span, "HRV_N"), Ok(3.0));
}

#[test]
fn a_persons_edits_lie_over_the_beats() {
    let mut nn = intervals_ms(100);
    let sum_secs = nn[..50].iter().sum::<f64>() / 1000.0;
    nn[50] += nn.remove(51);
    let channels = [nn];
    let recording = Recording { rate_hz: 1.0, begin_ns: 0, channels: &channels };
    let edits = vec![Edit::Add { at_secs: sum_secs + 0.85 }];
    let settings = Settings { edits, ..Settings::default() };
    let missed = |settings: &Settings| {
        let whole = whole(settings, &recording).expect("it is a recording");
        of(whole.windows.as_ref(), MIN_SPAN, "HRV_Missed")
    };
    assert_eq!((missed(&Settings::default()), missed(&settings)), (Ok(1.0), Ok(0.0)));
}

proptest! {
    #[test]
    fn nothing_panics(
        intervals in prop::collection::vec(
            (any::<i64>(), prop_oneof![prop::num::f64::ANY, 300.0..2000.0, 1e-9..1e9]), 0..60),
        begin_ns in any::<i64>(),
        rate_hz in prop::num::f64::ANY,
    ) {
        let (mut analysis, events) = analysed(&intervals);
        prop_assert!(events.len() <= intervals.len());
        let channels = [intervals.iter().map(|each| each.1).collect()];
        let whole = whole(&Settings::default(), &Recording { rate_hz, begin_ns, channels: &channels });
        let windows = whole.expect("any rate will do").windows;
        for span in [MIN_SPAN, Span { begin_ns: i64::MIN, end_ns: i64::MAX }] {
            let measured = [analysis.measure(span), windows.measure(span)];
            for value in measured.iter().flat_map(|each| each.values.iter().flatten()) {
                prop_assert!(value.is_finite());
            }
        }
        analysis.forget(begin_ns);
        analysis.push(0, &[]);
    }
}
