//! Laws of pulse waves, and pulses that NeuroKit2 simulated.

#![expect(clippy::unwrap_used, reason = "a test fails by it")]

#[path = "golden/ppg.rs"]
mod golden;

use std::f64::consts::TAU;

use proptest::prelude::*;
use teampulse_signal::agreement::matched;
use teampulse_signal::analysis::{Causal, Event, Measured, Reason, Recording, Span, Windows};
use teampulse_signal::error::SignalError;
use teampulse_signal::ppg::analysis::{Settings, causal, whole};
use teampulse_signal::ppg::{Pulse, PulseDetector, Quality, clean, find_pulses};

const RATE_HZ: f64 = 64.0;

/// When the pulses of a minute are, at this many a minute, a little uneven.
fn times_secs(per_min: f64) -> Vec<f64> {
    let secs = |k: u32| (f64::from(k) + 0.05 * f64::from(k * k % 7) / 7.0 + 0.7) * 60.0 / per_min;
    (0..300).map(secs).take_while(|&secs| secs < 59.3).collect()
}

/// Pulses of height 1 on a constant part of 50, each with a lower wave after it.
fn wave(times_secs: &[f64], rate_hz: f64) -> Vec<f64> {
    let bump = |secs: f64, at: f64, width: f64| (-((secs - at) / width).powi(2) / 2.0).exp();
    let sample = |k: usize| {
        let secs = k as f64 / rate_hz;
        let near = times_secs.partition_point(|&at| at < secs - 1.5);
        let near = times_secs[near..].iter().take_while(|&&at| at < secs + 0.5);
        50.0 + near.map(|&at| bump(secs, at, 0.08) + 0.2 * bump(secs, at + 0.32, 0.07)).sum::<f64>()
    };
    (0..(60.0 * rate_hz) as usize).map(sample).collect()
}

fn found(signal: &[f64], rate_hz: f64) -> Vec<Pulse> {
    find_pulses(signal, rate_hz).unwrap()
}

fn causally(signal: &[f64], rate_hz: f64) -> Vec<Pulse> {
    let mut detector = PulseDetector::new(rate_hz).unwrap();
    signal.iter().filter_map(|&sample| detector.push(sample)).collect()
}

fn secs(begin: f64, end: f64) -> Span {
    Span { begin_ns: (begin * 1e9) as i64, end_ns: (end * 1e9) as i64 }
}

fn recording(channels: &[Vec<f64>]) -> Recording<'_> {
    Recording { rate_hz: RATE_HZ, begin_ns: 0, channels }
}

fn value(windows: &dyn Windows, measured: &Measured, name: &str) -> Result<f64, Reason> {
    measured.values[windows.values().iter().position(|value| value.name == name).unwrap()]
}

fn measured_whole(signal: Vec<f64>, span: Span) -> impl Fn(&str) -> Result<f64, Reason> {
    let whole = whole(&Settings::default(), &recording(&[signal])).unwrap();
    let measured = whole.windows.measure(span);
    move |name| value(&*whole.windows, &measured, name)
}

/// Something that no heart does, more than as high as the pulses.
fn motion(k: usize) -> f64 {
    let secs = k as f64 / RATE_HZ;
    2.0 * (TAU * 1.7 * secs).sin() + 1.5 * (TAU * 2.9 * secs + 1.0).sin() + (TAU * 0.9 * secs).sin()
}

#[test]
fn simulated_pulses_are_found() {
    for (rate_hz, per_min, thousandths, peaks) in golden::SIMULATED {
        let signal: Vec<f64> = thousandths.iter().map(|&each| f64::from(each) / 1e3).collect();
        let truth: Vec<f64> = peaks.iter().map(|&each| f64::from(each)).collect();
        for pulses in [found(&signal, rate_hz), causally(&signal, rate_hz)] {
            let places: Vec<f64> = pulses.iter().map(|pulse| pulse.sample).collect();
            // A sample and a half of 32 Hz.
            let agreement = matched(&truth, &places, 0.05 * rate_hz);
            assert!(agreement.f1() >= 0.99, "{per_min} a minute at {rate_hz} Hz: {agreement:?}");
        }
    }
}

#[test]
fn pulses_are_found_where_they_are_at_any_rate() {
    for rate_hz in [20.0, 25.0, 64.0, 100.0, 128.0, 250.0, 1000.0, 2000.0] {
        for per_min in [40.0, 75.0, 150.0] {
            let truth: Vec<f64> = times_secs(per_min).iter().map(|secs| secs * rate_hz).collect();
            let signal = wave(&times_secs(per_min), rate_hz);
            for pulses in [found(&signal, rate_hz), causally(&signal, rate_hz)] {
                let places: Vec<f64> = pulses.iter().map(|pulse| pulse.sample).collect();
                // The lower wave moves the peak after it by up to 11 ms.
                let agreement = matched(&truth, &places, 0.015 * rate_hz);
                // Causally the last one may not be known yet.
                let last =
                    places.last().is_some_and(|last| last + 0.5 * rate_hz < truth[truth.len() - 1]);
                let missed = agreement.missed - usize::from(last);
                assert_eq!((agreement.extra, missed), (0, 0), "{per_min} a minute at {rate_hz} Hz");
            }
        }
    }
}

#[test]
fn the_shape_of_a_pulse_is_its_own() {
    for rate_hz in [64.0, 100.0, 1000.0] {
        let pulses = found(&wave(&times_secs(60.0), rate_hz), rate_hz);
        for pulse in &pulses[1..] {
            // A Gaussian of 80 ms is 2.355 · 80 ms wide, and rises from where its tangent is 0:
            // 2 · 80 ms before the peak. Smoothing widens it and takes 3 % of its height.
            assert!((pulse.amplitude - 1.0).abs() < 0.04, "{rate_hz}: {pulse:?}");
            assert!((pulse.width_ms - 188.0).abs() < 8.0, "{rate_hz}: {pulse:?}");
            assert!((pulse.rise_ms - 160.0).abs() < 15.0, "{rate_hz}: {pulse:?}");
        }
    }
}

#[test]
fn a_pulse_is_known_within_half_a_second() {
    let signal = wave(&times_secs(70.0), RATE_HZ);
    let mut detector = PulseDetector::new(RATE_HZ).unwrap();
    for (place, &sample) in signal.iter().enumerate() {
        let late = detector.push(sample).map(|pulse| (place as f64 - pulse.sample) / RATE_HZ);
        // Those of the first second wait for its end.
        assert!(late.is_none_or(|secs| secs < 0.45 || place < 70), "{late:?}");
    }
}

#[test]
fn a_flat_line_has_no_pulses() {
    for level in [0.0, -3.0, 1e100] {
        let flat = vec![level; 2000];
        assert!(found(&flat, RATE_HZ).is_empty() && causally(&flat, RATE_HZ).is_empty());
    }
    assert!(found(&[f64::NAN; 2000], RATE_HZ).is_empty());
    assert!(found(&[], RATE_HZ).is_empty() && found(&[1.0], RATE_HZ).is_empty());
}

#[test]
fn a_gap_is_no_pulse() {
    let mut signal = wave(&times_secs(60.0), RATE_HZ);
    signal[1280..1600].fill(f64::NAN);
    for pulses in [found(&signal, RATE_HZ), causally(&signal, RATE_HZ)] {
        assert!(pulses.iter().all(|pulse| !(1285.0..1595.0).contains(&pulse.sample)));
        assert!(pulses.len() >= 52, "{}", pulses.len());
    }
}

#[test]
fn no_interval_spans_a_gap() {
    let mut signal = wave(&times_secs(60.0), RATE_HZ);
    signal[1280..1600].fill(f64::NAN);
    let mut live = causal(&Settings::default(), RATE_HZ).unwrap();
    let mut events = Vec::new();
    for (k, &sample) in signal.iter().enumerate() {
        live.push((k as f64 / RATE_HZ * 1e9) as i64, &[sample]);
        events.extend(std::iter::from_fn(|| live.next_event()));
    }
    let recorded = whole(&Settings::default(), &recording(&[signal])).unwrap();
    let interval_ms = |event: &Event| {
        event.details.iter().find(|(name, _)| *name == "pp_ms").map_or(0.0, |(_, ms)| *ms)
    };
    for events in [events, recorded.events] {
        let (unknown, known): (Vec<f64>, Vec<f64>) =
            events.iter().map(interval_ms).partition(|ms| ms.is_nan());
        assert_eq!(unknown.len(), 2, "the first one, and the one after the gap");
        assert!(known.len() > 45, "{}", known.len());
        assert!(known.iter().all(|ms| (500.0..1100.0).contains(ms)), "{known:?}");
    }
}

#[test]
fn cleaning_takes_out_drift_and_noise() {
    let wave = |k: usize, hz: f64| (TAU * hz * k as f64 / RATE_HZ).sin();
    let signal: Vec<f64> =
        (0..3840).map(|k| 9.0 + wave(k, 0.05) + wave(k, 1.2) + wave(k, 20.0)).collect();
    let clean = clean(&signal, RATE_HZ).unwrap();
    assert!((640..3200).all(|k| (clean[k] - wave(k, 1.2)).abs() < 0.1));
}

#[test]
fn motion_is_flagged_and_what_is_clean_is_not() {
    let clean = wave(&times_secs(70.0), RATE_HZ);
    let (begin, end) = (20 * 64, 28 * 64);
    let disturbed: [fn(usize, f64) -> f64; 5] = [
        |k, value| value + motion(k),
        |k, value| value + 3.0 * ((k / 45 * 7 % 5) as f64 - 2.0),
        |_, _| 50.3,
        |_, _| f64::NAN,
        |_, value| (value + 5.0).min(55.2),
    ];
    for (index, disturb) in disturbed.into_iter().enumerate() {
        let mut signal = clean.clone();
        (begin..end).for_each(|k| signal[k] = disturb(k, signal[k]));
        let quality = Quality::of(&signal, RATE_HZ, &found(&signal, RATE_HZ)).unwrap();
        let flagged = quality.flagged(begin as f64, end as f64);
        assert!(flagged >= 0.8, "{index}: {flagged}");
        let before = quality.flagged(128.0, begin as f64 - 96.0);
        let after = quality.flagged(end as f64 + 96.0, 3700.0);
        assert!(before < 0.05 && after < 0.05, "{index}: {before} {after}");
        assert!(quality.mean(end as f64 + 96.0, 3700.0) > 0.95);
    }
}

#[test]
fn the_more_noise_the_less_quality() {
    let noise = |k: usize| ((k * k) as f64 * 0.7).sin();
    let clean = wave(&times_secs(70.0), RATE_HZ);
    let qualities = [0.0, 0.2, 0.4, 0.8, 1.6].map(|height| {
        let noisy: Vec<f64> =
            clean.iter().enumerate().map(|(k, value)| value + height * noise(k)).collect();
        let quality = Quality::of(&noisy, RATE_HZ, &found(&noisy, RATE_HZ)).unwrap();
        quality.mean(128.0, 3700.0)
    });
    assert!(qualities.is_sorted_by(|a, b| a > b), "{qualities:?}");
}

#[test]
fn a_window_reports_its_pulses() {
    let signal = wave(&times_secs(66.0), RATE_HZ);
    let value = measured_whole(signal, secs(0.0, 60.0));
    assert!((value("PPG_Rate_Mean").unwrap() - 66.0).abs() < 0.1);
    assert!((value("PPG_PP_Mean").unwrap() - 60_000.0 / 66.0).abs() < 2.0);
    assert!((value("PPG_Amplitude_Mean").unwrap() - 1.0).abs() < 0.04);
    assert!((value("PPG_Perfusion").unwrap() - 2.0).abs() < 0.1);
    assert!((value("PPG_Width_Mean").unwrap() - 188.0).abs() < 8.0);
    assert!(value("PPG_Quality").unwrap() > 0.95 && value("PPG_Flagged").unwrap() < 0.05);
    assert!(value("PPG_Skewness").unwrap() > 0.5);
    assert!((value("HRV_MeanNN").unwrap() - 60_000.0 / 66.0).abs() < 2.0);
}

#[test]
fn variability_that_may_be_noise_is_not_reported() {
    let noise = |k: usize| ((k * k % 977 * 31 % 1009) as f64 / 1009.0 - 0.5) * 0.4;
    let clean = wave(&times_secs(66.0), RATE_HZ);
    let noisy = clean.iter().enumerate().map(|(k, value)| value + noise(k)).collect();
    let [clean, noisy] = [clean, noisy].map(|signal| measured_whole(signal, secs(0.0, 60.0)));
    // Not all of it is a heart's, but of the clean signal the intervals are known.
    let beats_ms: Vec<f64> = times_secs(66.0).iter().map(|secs| 1e3 * secs).collect();
    let changes = beats_ms.windows(3).map(|at| (at[0] - 2.0 * at[1] + at[2]).powi(2));
    let rmssd_ms = (changes.sum::<f64>() / (beats_ms.len() - 2) as f64).sqrt();
    let found_ms = clean("HRV_RMSSD").unwrap();
    assert!((found_ms / rmssd_ms - 1.0).abs() < 0.1, "{found_ms} for {rmssd_ms}");
    assert_eq!(noisy("HRV_RMSSD"), Err(Reason::Quality));
    assert!(noisy("PPG_Rate_Mean").is_ok() && noisy("HRV_MeanNN").is_ok());
    assert!(noisy("HRV_Corrected").is_ok(), "counts are what they are");
}

#[test]
fn breathing_is_read_off_pulses() {
    // 15 breaths a minute move amplitudes, baseline and intervals.
    let breath = |secs: f64| (TAU * 0.25 * secs).sin();
    let times: Vec<f64> = times_secs(70.0).iter().map(|&at| at + 0.03 * breath(at)).collect();
    let breathing = |(k, value): (usize, &f64)| {
        let breath = breath(k as f64 / RATE_HZ);
        50.0 + (value - 50.0) * (1.0 + 0.2 * breath) + 0.2 * breath
    };
    let signal = wave(&times, RATE_HZ).iter().enumerate().map(breathing).collect();
    let value = measured_whole(signal, secs(0.0, 60.0));
    assert!((value("PPG_RSP_Rate").unwrap() - 15.0).abs() < 0.5);
}

#[test]
fn without_its_constant_part_light_has_no_perfusion() {
    let signal = wave(&times_secs(66.0), RATE_HZ).iter().map(|value| value - 50.2).collect();
    assert_eq!(measured_whole(signal, secs(0.0, 60.0))("PPG_Perfusion"), Err(Reason::Missing));
}

#[test]
fn what_is_missing_or_poor_is_not_reported() {
    let mut signal = wave(&times_secs(66.0), RATE_HZ);
    signal[1920..].fill(f64::NAN);
    let gap = measured_whole(signal.clone(), secs(32.0, 60.0));
    assert_eq!(gap("PPG_Rate_Mean"), Err(Reason::Gap));
    (1920..3840).for_each(|k| signal[k] = 50.0 + motion(k * k % 4001));
    let poor = measured_whole(signal.clone(), secs(32.0, 60.0));
    assert_eq!(poor("PPG_Rate_Mean"), Err(Reason::Quality));
    assert_eq!(poor("HRV_RMSSD"), Err(Reason::Quality));
    assert!(poor("PPG_Flagged").unwrap() > 0.8);
    let short = measured_whole(signal, secs(10.0, 12.0));
    assert_eq!(short("PPG_Rate_Mean"), Err(Reason::Short));
}

#[test]
fn what_moves_is_flagged_where_an_accelerometer_says_so() {
    let signal = wave(&times_secs(66.0), RATE_HZ);
    let level = (0..signal.len()).map(|k| if k < 1920 { 0.01 } else { 0.5 }).collect();
    let channels = [signal, level];
    let settings = Settings { motion_limit: Some(0.2), ..Settings::default() };
    let whole = whole(&settings, &recording(&channels)).unwrap();
    let flagged = |span| {
        let measured = whole.windows.measure(span);
        value(&*whole.windows, &measured, "PPG_Flagged").unwrap()
    };
    assert!(flagged(secs(0.0, 29.0)) < 0.1 && flagged(secs(31.0, 60.0)) > 0.95);
}

/// Events, and the values of windows of 20 s that begin every 5 s, asked for as soon as they are over.
fn live(signal: &[f64], forgets: bool) -> (Vec<Event>, Vec<Measured>) {
    let mut ppg: Box<dyn Causal + Send> = causal(&Settings::default(), RATE_HZ).unwrap();
    let (mut events, mut windows) = (Vec::new(), Vec::new());
    for (k, &sample) in signal.iter().enumerate() {
        let at_ns = k as i64 * 15_625_000;
        ppg.push(at_ns, &[sample]);
        events.extend(std::iter::from_fn(|| ppg.next_event()));
        if k % 320 == 0 && k >= 1280 {
            windows.push(ppg.measure(Span { begin_ns: at_ns - 20_000_000_000, end_ns: at_ns }));
            if forgets {
                ppg.forget(at_ns - 20_000_000_000);
            }
        }
    }
    (events, windows)
}

#[test]
fn letting_go_changes_nothing() {
    let signal: Vec<f64> =
        std::iter::repeat_n(wave(&times_secs(63.0), RATE_HZ), 4).flatten().collect();
    let (kept, forgotten) = (live(&signal, false), live(&signal, true));
    assert!(format!("{kept:?}") == format!("{forgotten:?}"));
    assert!(kept.0.len() > 240 && kept.0.iter().all(|event| event.kind == "pulse"));
}

#[test]
fn causal_windows_give_what_whole_ones_give() {
    let signal: Vec<f64> =
        std::iter::repeat_n(wave(&times_secs(63.0), RATE_HZ), 3).flatten().collect();
    let whole = whole(&Settings::default(), &recording(std::slice::from_ref(&signal))).unwrap();
    let (_, windows) = live(&signal, true);
    let causal = causal(&Settings::default(), RATE_HZ).unwrap();
    for (index, live) in windows.iter().enumerate() {
        let begin = 5.0 * index as f64;
        let afterwards = whole.windows.measure(secs(begin, begin + 20.0));
        for name in ["PPG_Rate_Mean", "PPG_Amplitude_Mean", "PPG_RiseTime_Mean", "PPG_Width_Mean"] {
            let [live, afterwards] = [live, &afterwards].map(|m| value(&*causal, m, name).unwrap());
            assert!(
                (live / afterwards - 1.0).abs() < 0.02,
                "{name} at {begin}: {live} {afterwards}"
            );
        }
    }
    let names = |windows: &dyn Windows| -> Vec<_> {
        windows.values().iter().map(|value| (value.name.clone(), value.unit.clone())).collect()
    };
    assert_eq!(names(&*causal), names(&*whole.windows));
}

#[test]
fn absurd_rates_and_settings_are_refused() {
    for rate_hz in [0.0, -1.0, 1e-9, 19.0, 1e9, f64::NAN, f64::INFINITY] {
        let refused =
            |error| matches!(error, SignalError::Rate { .. } | SignalError::Setting { .. });
        assert!(refused(find_pulses(&[0.0], rate_hz).unwrap_err()));
        assert!(refused(PulseDetector::new(rate_hz).unwrap_err()));
        assert!(refused(clean(&[0.0], rate_hz).unwrap_err()));
        assert!(causal(&Settings::default(), rate_hz).is_err());
        let recording = Recording { rate_hz, begin_ns: 0, channels: &[vec![0.0; 9]] };
        assert!(whole(&Settings::default(), &recording).is_err());
        assert!(Quality::of(&[0.0], rate_hz, &[]).is_none());
    }
    let settings = Settings { motion_limit: Some(f64::NAN), ..Settings::default() };
    assert!(causal(&settings, RATE_HZ).is_err());
}

#[test]
fn a_recording_without_channels_has_no_pulses() {
    let whole = whole(&Settings::default(), &recording(&[])).unwrap();
    assert!(whole.events.is_empty());
    assert!(whole.windows.measure(secs(0.0, 1.0)).values.iter().all(Result::is_err));
}

fn any_signal() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(prop_oneof![prop::num::f64::ANY, -1.0..1.0, Just(f64::NAN)], 0..2000)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn pulses_of_any_input_ascend_and_lie_within_it(signal in any_signal(), rate_hz in 20.0..2000.0) {
        let last = signal.len() as f64 - 1.0;
        for pulses in [found(&signal, rate_hz), causally(&signal, rate_hz)] {
            prop_assert!(pulses.iter().all(|pulse| (0.0..=last).contains(&pulse.sample)));
            prop_assert!(pulses.iter().all(|pulse| pulse.onset <= pulse.sample));
            prop_assert!(pulses.is_sorted_by(|a, b| a.sample < b.sample));
        }
    }

    #[test]
    fn quality_of_any_input_lies_between_0_and_1(
        signal in any_signal(),
        places in prop::collection::vec(prop::num::f64::ANY, 0..20),
    ) {
        let pulse = |&sample: &f64| Pulse { sample, onset: sample - 9.0, middle: sample - 5.0, amplitude: 1.0, rise_ms: 1.0, width_ms: 1.0 };
        let pulses: Vec<Pulse> = places.iter().map(pulse).collect();
        if let Some(quality) = Quality::of(&signal, RATE_HZ, &pulses) {
            prop_assert!(quality.cycles().iter().all(|cycle| (0.0..=1.0).contains(&cycle.quality)));
            prop_assert!((0.0..=1.0).contains(&quality.mean(0.0, 100.0)));
            prop_assert!((0.0..=1.0).contains(&quality.flagged(f64::NAN, 100.0)));
        }
    }

    #[test]
    fn any_input_gives_numbers_or_reasons(signal in any_signal(), begin in -10.0..40.0f64, length in -1.0..70.0f64) {
        let span = secs(begin, begin + length);
        let whole = whole(&Settings::default(), &recording(std::slice::from_ref(&signal))).unwrap();
        let mut ppg = causal(&Settings::default(), RATE_HZ).unwrap();
        for (k, &sample) in signal.iter().enumerate() {
            ppg.push(k as i64 * 15_625_000, &[sample]);
        }
        for measured in [whole.windows.measure(span), ppg.measure(span)] {
            prop_assert_eq!(measured.values.len(), ppg.values().len());
            prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
            prop_assert!((0.0..=1.0).contains(&measured.quality) && (0.0..=1.0).contains(&measured.coverage));
        }
    }

    #[test]
    fn an_offset_moves_no_pulse(offset in -1e4..1e4f64) {
        let signal = wave(&times_secs(72.0), RATE_HZ);
        let moved: Vec<f64> = signal.iter().map(|value| value + offset).collect();
        let (one, other) = (found(&signal, RATE_HZ), found(&moved, RATE_HZ));
        prop_assert_eq!(one.len(), other.len());
        prop_assert!(one.iter().zip(&other).all(|(a, b)| (a.sample - b.sample).abs() < 1e-3));
    }
}
