//! Skin conductance against NeuroKit2, made-up truth, and whatever else comes in.

#![expect(clippy::unwrap_used, reason = "a test")]

use proptest::prelude::*;
use teampulse_signal::analysis::{Causal, Event, Measured, Reason, Recording, Span, Whole};
use teampulse_signal::eda::analysis::{Phasic, Settings, causal, whole};
use teampulse_signal::eda::{
    ResponseDetector, Threshold, clean, cvx_eda, find_responses, high_pass_split, quality,
    sympathetic, thinned, valid_samples,
};

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/eda.rs"]
mod golden;

/// The signal of golden/eda.py.
fn signal(rate_hz: f64, secs: f64) -> Vec<f64> {
    let onset = |n: u32| 5.0 + 11.0 * f64::from(n) + 3.0 * (2.0 * f64::from(n)).sin();
    let sample = |k: u64| {
        let t = k as f64 / rate_hz;
        let responses = (0..(secs / 11.0) as u32).map(|n| {
            let amplitude = 0.1 + 0.07 * f64::from(n * 5 % 7);
            amplitude * bateman(t - onset(n))
        });
        let noise = 0.004 * ((k * 7919 % 1009) as f64 / 1009.0 - 0.5);
        4.0 + 0.5 * (t / 40.0).sin() + 0.002 * t + responses.sum::<f64>() + noise
    };
    (0..(rate_hz * secs) as u64).map(sample).collect()
}

/// A response of height 1.
fn bateman(secs: f64) -> f64 {
    if secs > 0.0 { ((-secs / 2.0).exp() - (-secs / 0.7).exp()) / 0.3689 } else { 0.0 }
}

fn assert_near(ours: impl Iterator<Item = f64>, theirs: &[f64], tolerance: f64) {
    let ours: Vec<f64> = ours.collect();
    assert_eq!(ours.len(), theirs.len());
    for (place, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
        assert!((ours - theirs).abs() <= tolerance, "{place}: {ours} instead of {theirs}");
    }
}

#[test]
fn cvx_eda_is_that_of_neurokit2() {
    let split = cvx_eda(&signal(4.0, 120.0), 4.0).unwrap();
    // cvxopt's own tolerance; a thousandth of the range is 8e-4.
    assert_near(split.phasic.iter().copied().step_by(8), golden::CVX_PHASIC, 2e-4);
    assert_near(split.tonic.iter().copied().step_by(8), golden::CVX_TONIC, 2e-4);
}

#[test]
fn cleaning_and_the_high_pass_are_those_of_neurokit2() {
    let clean = clean(&signal(32.0, 120.0), 32.0).unwrap();
    let split = high_pass_split(&clean, 32.0).unwrap();
    assert_near(clean.iter().copied().step_by(64), golden::CLEAN, 1e-9);
    assert_near(split.phasic.iter().copied().step_by(64), golden::PHASIC, 1e-9);
    assert_near(split.tonic.iter().copied().step_by(64), golden::TONIC, 1e-9);
}

#[test]
fn responses_with_a_relative_threshold_are_those_of_neurokit2() {
    let clean = clean(&signal(32.0, 120.0), 32.0).unwrap();
    let split = high_pass_split(&clean, 32.0).unwrap();
    let found = find_responses(&split.phasic, 32.0, Threshold::Relative(0.1)).unwrap();
    assert_eq!(found.len(), golden::RESPONSES.len());
    for (ours, theirs) in found.iter().zip(golden::RESPONSES) {
        let places = [ours.onset, ours.peak, ours.rise_secs].map(f64::to_bits);
        assert_eq!(places, [theirs[0], theirs[1], theirs[3]].map(f64::to_bits));
        assert!((ours.amplitude_us - theirs[2]).abs() < 1e-9);
        assert_eq!(ours.half_recovery_secs, Some(theirs[4]).filter(|secs| !secs.is_nan()));
    }
}

/// Six minutes: an amplitude and an onset [s] each.
fn truth() -> Vec<(f64, f64)> {
    let onset = |n: u32| 20.0 + 15.0 * f64::from(n) + 2.0 * (3.0 * f64::from(n)).sin();
    (0..22).map(|n| (0.12 + 0.05 * f64::from(n * 5 % 13), onset(n))).collect()
}

fn with_truth(rate_hz: f64) -> Vec<f64> {
    let sample = |k: u64| {
        let t = k as f64 / rate_hz;
        let responses = truth().into_iter().map(|(height, onset)| height * bateman(t - onset));
        let noise = 0.008 * ((k * 7919 % 1009) as f64 / 1009.0 - 0.5);
        5.0 + 0.4 * (t / 50.0).sin() + 0.001 * t + responses.sum::<f64>() + noise
    };
    (0..(360.0 * rate_hz) as u64).map(sample).collect()
}

fn recorded(signal: &[f64], rate_hz: f64, settings: &Settings) -> Whole {
    let channels = [signal.to_vec()];
    whole(settings, &Recording { rate_hz, begin_ns: 0, channels: &channels }).unwrap()
}

/// The results after a number of samples, when they came in chunks of this many.
fn live(
    signal: &[f64],
    rate_hz: f64,
    chunk: usize,
) -> (Vec<(Event, usize)>, Box<dyn Causal + Send>) {
    let mut analysis = causal(&Settings::default(), rate_hz).unwrap();
    let mut events = Vec::new();
    for (number, samples) in signal.chunks(chunk).enumerate() {
        for (place, &sample) in samples.iter().enumerate() {
            let place = number * chunk + place;
            analysis.push((place as f64 / rate_hz * 1e9).round() as i64, &[sample]);
        }
        let known = number * chunk + samples.len() - 1;
        while let Some(event) = analysis.next_event() {
            events.push((event, known));
        }
    }
    (events, analysis)
}

fn detail(event: &Event, name: &str) -> f64 {
    event.details.iter().find(|(each, _)| *each == name).unwrap().1
}

fn assert_truth(events: &[Event], rate_hz: f64) {
    let truth = truth();
    assert_eq!(events.len(), truth.len(), "at {rate_hz} Hz");
    for (event, (amplitude_us, onset_secs)) in events.iter().zip(truth) {
        let found_us = detail(event, "amplitude_us");
        assert!((found_us / amplitude_us - 1.0).abs() < 0.1, "{found_us} of {amplitude_us}");
        let off_secs = detail(event, "onset_sample") / rate_hz - onset_secs;
        assert!(off_secs.abs() < 0.5, "at {rate_hz} Hz: {off_secs} s");
        assert!((event.sample / rate_hz - onset_secs - 1.13).abs() < 0.4);
        assert_eq!(event.at_ns, (event.sample / rate_hz * 1e9).round() as i64);
    }
}

#[test]
fn each_response_is_found_with_its_amplitude() {
    for rate_hz in [4.0, 8.0, 32.0, 128.0] {
        let signal = with_truth(rate_hz);
        assert_truth(&recorded(&signal, rate_hz, &Settings::default()).events, rate_hz);
        let settings = Settings { phasic: Phasic::CvxEda, ..Settings::default() };
        let events = recorded(&signal, rate_hz, &settings).events;
        assert_eq!(events.len(), truth().len());
    }
}

#[test]
fn a_response_is_reported_a_second_after_its_peak() {
    for rate_hz in [4.0, 32.0, 128.0, 1000.0] {
        let (events, _) = live(&with_truth(rate_hz), rate_hz, 1);
        for (event, known) in &events {
            let late_secs = (*known as f64 - event.sample) / rate_hz;
            assert!((1.0..1.2).contains(&late_secs), "at {rate_hz} Hz: {late_secs} s");
        }
        let events: Vec<Event> = events
            .into_iter()
            .map(|(event, _)| Event {
                at_ns: (event.sample / rate_hz * 1e9).round() as i64,
                ..event
            })
            .collect();
        assert_truth(&events, rate_hz);
    }
}

/// Responses as near as eight a minute can be: a small one begins 3 s after each large one.
#[test]
fn a_response_that_rides_on_the_fall_of_another_is_found() {
    let large = |n: u32| 10.0 + 15.0 * f64::from(n);
    let truth: Vec<(f64, f64)> =
        (0..10).flat_map(|n| [(large(n), 0.8), (large(n) + 3.0, 0.2)]).collect();
    for rate_hz in [4.0, 32.0, 128.0] {
        let sample = |k: u64| {
            let t = k as f64 / rate_hz;
            let responses = truth.iter().map(|(onset, height)| height * bateman(t - onset));
            5.0 + responses.sum::<f64>() + 0.004 * ((k * 7919 % 1009) as f64 / 1009.0 - 0.5)
        };
        let signal: Vec<f64> = (0..(165.0 * rate_hz) as u64).map(sample).collect();
        let whole = recorded(&signal, rate_hz, &Settings::default()).events;
        let live: Vec<Event> = live(&signal, rate_hz, 1).0.into_iter().map(|each| each.0).collect();
        for events in [whole, live] {
            assert_eq!(events.len(), truth.len(), "at {rate_hz} Hz");
            for (event, (onset, height)) in events.iter().zip(&truth) {
                let off_secs = event.sample / rate_hz - onset - 1.13;
                let amplitude_us = detail(event, "amplitude_us");
                assert!(off_secs.abs() < 1.0, "at {rate_hz} Hz: {off_secs} s");
                assert!(
                    (0.6..1.1).contains(&(amplitude_us / height)),
                    "{amplitude_us} of {height}"
                );
            }
        }
    }
}

#[test]
fn half_a_second_of_other_contact_is_no_response() {
    for rate_hz in [4.0, 32.0, 128.0] {
        let sample = |k: u64| 5.0 + 0.004 * ((k * 7919 % 1009) as f64 / 1009.0 - 0.5);
        for change_us in [-4.0, -0.3, 0.3, 1.5] {
            let mut signal: Vec<f64> = (0..(120.0 * rate_hz) as u64).map(sample).collect();
            for at_secs in [20.0, 50.0, 80.0] {
                let begin = (at_secs * rate_hz) as usize;
                for value in &mut signal[begin..begin + (0.5 * rate_hz) as usize] {
                    *value += change_us;
                }
            }
            let span = Span { begin_ns: 0, end_ns: 120_000_000_000 };
            let whole = recorded(&signal, rate_hz, &Settings::default());
            let (events, analysis) = live(&signal, rate_hz, 1);
            let counts = [whole.events.len(), events.len()];
            assert_eq!(counts, [0, 0], "{change_us} µS at {rate_hz} Hz");
            for measured in [whole.windows.measure(span), analysis.measure(span)] {
                assert!((0.6..0.8).contains(&measured.quality), "{}", measured.quality);
            }
        }
    }
}

#[test]
fn a_level_that_changes_at_once_is_no_response() {
    for rate_hz in [4.0, 32.0, 128.0] {
        for step_us in [0.3, 1.0, 3.0] {
            let mut signal = with_truth(rate_hz);
            let begin = (145.5 * rate_hz) as usize;
            signal[begin..].iter_mut().for_each(|value| *value += step_us);
            let is_there = |event: &Event| (event.sample / rate_hz - 145.5).abs() < 2.0;
            let found = recorded(&signal, rate_hz, &Settings::default()).events;
            assert!(!found.iter().any(is_there), "{step_us} µS at {rate_hz} Hz");
            let (found, _) = live(&signal, rate_hz, 1);
            assert!(!found.iter().any(|(event, _)| is_there(event)), "{step_us} at {rate_hz} Hz");
        }
    }
}

#[test]
fn noise_has_a_level_and_no_responses() {
    let mut state = 1_u64;
    let mut noise_us = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        0.05 * ((state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    };
    let measured = minute(&(0..240).map(|_| 5.0 + noise_us()).collect::<Vec<f64>>());
    assert!(measured.quality < 0.1, "{}", measured.quality);
    assert!(measured.values[0].is_ok_and(|level_us| (level_us - 5.0).abs() < 0.02));
    assert_eq!(measured.values[3..], vec![Err(Reason::Quality); 9]);
}

#[test]
fn steps_of_a_walk_are_too_many_responses() {
    let step = |k: u32| 5.0 + 0.2 * (std::f64::consts::TAU * 1.8 * f64::from(k) / 32.0).sin();
    let signal: Vec<f64> = (0..1920).map(step).collect();
    let span = Span { begin_ns: 0, end_ns: 60_000_000_000 };
    let whole = recorded(&signal, 32.0, &Settings::default());
    for measured in [whole.windows.measure(span), live(&signal, 32.0, 1).1.measure(span)] {
        assert!(measured.quality < 0.05, "{}", measured.quality);
        assert!(measured.values[0].is_ok() && measured.values[4] == Err(Reason::Quality));
    }
}

#[test]
fn windows_give_level_and_responses() {
    let rate_hz = 32.0;
    let analysed = recorded(&signal(rate_hz, 120.0), rate_hz, &Settings::default());
    let measured = analysed.windows.measure(Span { begin_ns: 0, end_ns: 120_000_000_000 });
    let value = |name: &str| {
        let place = analysed.windows.values().iter().position(|value| value.name == name);
        measured.values[place.unwrap()]
    };
    assert_eq!((measured.coverage, measured.quality), (1.0, 1.0));
    assert!((value("EDA_Tonic_SD").unwrap() - golden::TONIC_SD).abs() < 1e-9);
    assert_eq!(value("SCR_Peaks_N"), Ok(10.0));
    assert_eq!(value("SCR_Peaks_Rate"), Ok(5.0));
    let amplitudes = analysed.events.iter().map(|event| detail(event, "amplitude_us"));
    let sum = value("SCR_Peaks_Amplitude_Sum").unwrap();
    assert!((sum - amplitudes.sum::<f64>()).abs() < 1e-12);
    assert!((value("SCR_Peaks_Amplitude_Mean").unwrap() - sum / 10.0).abs() < 1e-12);
    assert!((1.0..1.5).contains(&value("SCR_RiseTime_Mean").unwrap()));
    assert!((1.0..3.0).contains(&value("SCR_RecoveryTime_Mean").unwrap()));
    assert!(value("EDA_Sympathetic").unwrap() > 0.0);
    // A minute is too short for the slow rhythm, five seconds for slope and rate.
    let minute = analysed.windows.measure(Span { begin_ns: 0, end_ns: 60_000_000_000 });
    assert_eq!(minute.values[10..], [Err(Reason::Short); 2]);
    let short = analysed.windows.measure(Span { begin_ns: 0, end_ns: 5_000_000_000 });
    assert_eq!([short.values[2], short.values[4]], [Err(Reason::Short); 2]);
}

fn minute(signal: &[f64]) -> Measured {
    let span = Span { begin_ns: 0, end_ns: 60_000_000_000 };
    let (_, causal) = live(signal, 4.0, 7);
    let whole = recorded(signal, 4.0, &Settings::default()).windows.measure(span);
    let live = causal.measure(span);
    assert_eq!((live.coverage, live.quality), (whole.coverage, whole.quality));
    let why =
        |measured: &Measured| measured.values.iter().map(|each| each.err()).collect::<Vec<_>>();
    assert_eq!(why(&live)[..2], why(&whole)[..2]);
    whole
}

#[test]
fn what_is_no_skin_has_no_values() {
    for level in [0.0, 3.0, 4095.0, -1.0] {
        assert_eq!(minute(&[level; 240]).values, vec![Err(Reason::Quality); 12], "{level}");
    }
    let mut gap = signal(4.0, 60.0);
    gap[20..180].fill(f64::NAN);
    assert_eq!(minute(&gap).values, vec![Err(Reason::Gap); 12]);
}

#[test]
fn cold_skin_lowers_the_quality() {
    let signal = signal(4.0, 60.0);
    let mut celsius = vec![33.0; 240];
    celsius[..160].fill(24.0);
    let channels = [signal, celsius];
    let recording = Recording { rate_hz: 4.0, begin_ns: 0, channels: &channels };
    let analysed = whole(&Settings::default(), &recording).unwrap();
    let measured = analysed.windows.measure(recording.span());
    assert!((measured.quality - 0.25).abs() < 0.01, "{}", measured.quality);
    assert_eq!(measured.values, vec![Err(Reason::Quality); 12]);
}

#[test]
fn a_gap_makes_no_response() {
    let mut broken = with_truth(8.0);
    // From 100 to 130 s; then on at another level.
    broken[800..1040].fill(f64::NAN);
    broken[1040..].iter_mut().for_each(|value| *value += 3.0);
    let outside = truth().iter().filter(|(_, onset)| !(98.0..130.0).contains(onset)).count();
    assert_eq!(recorded(&broken, 8.0, &Settings::default()).events.len(), outside);
    assert_eq!(live(&broken, 8.0, 1).0.len(), outside);
}

#[test]
fn chunks_of_any_length_give_the_same_bits() {
    let signal = signal(64.0, 100.0);
    let span = Span { begin_ns: 20_000_000_000, end_ns: 100_000_000_000 };
    let (expected, analysis) = live(&signal, 64.0, 1);
    let bits = |measured: Measured| -> Vec<Result<u64, Reason>> {
        measured.values.into_iter().map(|value| value.map(f64::to_bits)).collect()
    };
    for chunk in [2, 7, 64, 1000, 4096] {
        let (events, other) = live(&signal, 64.0, chunk);
        let reported = |events: &[(Event, usize)]| {
            format!("{:?}", events.iter().map(|(event, _)| event).collect::<Vec<_>>())
        };
        assert!(reported(&events) == reported(&expected), "{chunk}");
        assert_eq!(bits(other.measure(span)), bits(analysis.measure(span)));
    }
}

#[test]
fn what_was_forgotten_is_not_needed() {
    let signal = signal(16.0, 300.0);
    let span = Span { begin_ns: 200_000_000_000, end_ns: 300_000_000_000 };
    let (_, all) = live(&signal, 16.0, 16);
    let (_, mut forgetful) = live(&signal, 16.0, 16);
    forgetful.forget(200_000_000_000);
    assert_eq!(forgetful.measure(span), all.measure(span));
}

#[test]
fn absurd_rates_and_thresholds_are_refused() {
    let channels = [vec![1.0; 100]];
    for rate_hz in [0.0, -1.0, 1e-9, 0.5, 1e9, f64::NAN, f64::INFINITY] {
        let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
        assert!(whole(&Settings::default(), &recording).is_err());
        assert!(causal(&Settings::default(), rate_hz).is_err());
        assert!(cvx_eda(&channels[0], rate_hz).is_err() && clean(&channels[0], rate_hz).is_err());
        assert!(ResponseDetector::new(rate_hz, 0.05).is_err());
        assert!(thinned(&channels[0], rate_hz, 4.0).is_err());
        assert!(sympathetic(&channels[0], rate_hz).is_err());
    }
    for threshold in
        [Threshold::Absolute(f64::NAN), Threshold::Absolute(0.0), Threshold::Relative(-1.0)]
    {
        assert!(find_responses(&channels[0], 4.0, threshold).is_err());
        assert!(causal(&Settings { threshold, ..Settings::default() }, 4.0).is_err());
    }
    let relative = Settings { threshold: Threshold::Relative(0.1), ..Settings::default() };
    assert!(causal(&relative, 4.0).is_err());
}

#[test]
fn too_little_is_refused() {
    for signal in [&[][..], &[1.0], &[f64::NAN; 50]] {
        let channels = [signal.to_vec()];
        let recording = Recording { rate_hz: 4.0, begin_ns: 0, channels: &channels };
        for phasic in [Phasic::HighPass, Phasic::CvxEda] {
            assert!(whole(&Settings { phasic, ..Settings::default() }, &recording).is_err());
        }
    }
    assert!(
        whole(&Settings::default(), &Recording { rate_hz: 4.0, begin_ns: 0, channels: &[] })
            .is_err()
    );
}

#[test]
fn cvx_eda_leaves_out_what_is_missing() {
    let mut broken = signal(4.0, 300.0);
    let all = cvx_eda(&broken, 4.0).unwrap();
    broken.iter_mut().step_by(5).for_each(|value| *value = f64::NAN);
    broken[600..640].fill(f64::INFINITY);
    let split = cvx_eda(&broken, 4.0).unwrap();
    let off = |from: usize, to: usize| {
        (from..to).map(|k| (split.phasic[k] - all.phasic[k]).abs()).fold(0.0, f64::max)
    };
    assert!(off(100, 580) < 0.02 && off(700, 1100) < 0.02, "{} {}", off(100, 580), off(700, 1100));
}

fn anything() -> impl Strategy<Value = Vec<f64>> {
    let sample = prop_oneof![
        4 => -1.0..100.0f64,
        1 => prop::num::f64::ANY,
        1 => Just(3.0),
        1 => Just(f64::NAN),
    ];
    prop::collection::vec(sample, 0..400)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_input_gives_finite_numbers_or_a_reason(
        signal in anything(),
        celsius in anything(),
        rate_hz in prop_oneof![1.0..10.0f64, 10.0..2000.0f64],
        share in 0.0..1.0f64,
    ) {
        let threshold = Threshold::Relative(share);
        let channels = [signal.clone(), celsius];
        let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
        for settings in [
            Settings::default(),
            Settings { threshold, ..Settings::default() },
            Settings { phasic: Phasic::CvxEda, ..Settings::default() },
        ] {
            let Ok(analysed) = whole(&settings, &recording) else { continue };
            let measured = analysed.windows.measure(recording.span());
            prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
            prop_assert!((0.0..=1.0).contains(&measured.quality));
            let last = signal.len() as f64;
            prop_assert!(analysed.events.iter().all(|event| (0.0..last).contains(&event.sample)));
        }
        let (events, analysis) = live(&signal, rate_hz, 13);
        prop_assert!(events.iter().all(|(event, _)| event.sample.is_finite()));
        let measured = analysis.measure(recording.span());
        prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
        prop_assert_eq!(valid_samples(&signal, &[], rate_hz).len(), signal.len());
        prop_assert!(quality(&signal, &[], rate_hz).is_none_or(|share| (0.0..=1.0).contains(&share)));
    }

    #[test]
    fn cvx_eda_survives_anything(signal in anything(), rate_hz in 1.0..2000.0f64) {
        if let Ok(split) = cvx_eda(&signal, rate_hz) {
            prop_assert!(split.tonic.iter().chain(&split.phasic).all(|value| value.is_finite()));
        }
    }
}
