//! Laws of breathing signals, and golden values of NeuroKit2.

use std::f64::consts::TAU;

use proptest::prelude::*;
use teampulse_signal::analysis::{Event, Measured, Reason, Recording, Span};
use teampulse_signal::error::SignalError;
use teampulse_signal::respiration::analysis::{Inhalation, Settings, causal, whole};
use teampulse_signal::respiration::derived::rate_from_beats;
use teampulse_signal::respiration::rsa::{RrInterval, peak_to_trough};
use teampulse_signal::respiration::{
    Breath, BreathDetector, Pattern, clean, find_breaths, quality, spectral_rate_per_min,
    variability,
};

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/respiration.rs"]
mod golden;

/// 15 breaths a minute, inhaled in 1.5 s and exhaled in 2.5 s, on a drift.
fn belt(length_secs: f64, rate_hz: f64) -> Vec<f64> {
    let height = |k: usize| {
        let secs = k as f64 / rate_hz;
        let at = (secs - 0.5).rem_euclid(4.0);
        let turn = if at < 1.5 { at / 1.5 * 0.5 } else { 0.5 + (at - 1.5) / 2.5 * 0.5 };
        2.0 - (TAU * turn).cos() + 0.5 * (TAU * secs / 80.0).sin()
    };
    (0..(length_secs * rate_hz) as usize).map(height).collect()
}

fn live(signal: &[f64], rate_hz: f64) -> Vec<Breath> {
    let mut detector = BreathDetector::new(rate_hz).expect("a usual rate");
    signal.iter().filter_map(|&sample| detector.push(sample)).collect()
}

fn found(signal: &[f64], rate_hz: f64) -> Vec<Breath> {
    find_breaths(signal, rate_hz).expect("a usual rate")
}

/// The breaths of `belt` are where and as they are.
fn assert_breaths(breaths: &[Breath], rate_hz: f64, within_secs: f64) {
    for breath in breaths {
        let begin_secs = breath.begin / rate_hz;
        let number = ((begin_secs - 0.5) / 4.0).round();
        let off = begin_secs - (0.5 + 4.0 * number);
        assert!(off.abs() < within_secs, "at {rate_hz} Hz: {off} s at {begin_secs} s");
        assert!((breath.inhalation() / rate_hz - 1.5).abs() < 2.0 * within_secs, "{breath:?}");
        assert!((breath.amplitude - 2.0).abs() < 0.15, "{breath:?}");
    }
}

#[test]
fn breaths_are_found_at_any_rate() {
    for rate_hz in [5.0, 12.5, 25.0, 32.0, 49.9, 50.0, 100.0, 128.0, 250.0, 1000.0, 2000.0] {
        let signal = belt(61.0, rate_hz);
        let (whole, causal) = (found(&signal, rate_hz), live(&signal, rate_hz));
        assert!((13..=14).contains(&whole.len()), "{} at {rate_hz} Hz", whole.len());
        assert_breaths(&whole[1..whole.len() - 1], rate_hz, 0.1);
        assert!((11..=14).contains(&causal.len()), "{} at {rate_hz} Hz", causal.len());
        assert_breaths(&causal[1..], rate_hz, 0.15);
    }
}

#[test]
fn a_breath_is_reported_soon_after_the_next_inhalation() {
    let signal = belt(120.0, 50.0);
    let mut detector = BreathDetector::new(50.0).unwrap();
    for (place, &sample) in signal.iter().enumerate() {
        if let Some(breath) = detector.push(sample) {
            let later_secs = (place as f64 - breath.end) / 50.0;
            assert!((1.5..3.0).contains(&later_secs), "{later_secs}");
        }
    }
}

#[test]
fn a_unit_does_not_matter() {
    let signal = belt(60.0, 50.0);
    let breaths = found(&signal, 50.0);
    for factor in [1e-9, 1e9] {
        let other: Vec<f64> = signal.iter().map(|sample| factor * sample).collect();
        let others = found(&other, 50.0);
        assert_eq!(others.len(), breaths.len());
        assert!((others[3].begin - breaths[3].begin).abs() < 1e-6);
        assert!((others[3].amplitude / factor - breaths[3].amplitude).abs() < 1e-6);
    }
}

#[test]
fn a_flat_line_has_no_breaths() {
    for level in [0.0, 5.0, -1e9] {
        let flat = vec![level; 3000];
        assert_eq!(found(&flat, 50.0), []);
        assert_eq!(live(&flat, 50.0), []);
        assert_eq!(quality(&flat, 50.0, &[]), Some(0.0));
        assert_eq!(spectral_rate_per_min(&flat, 50.0), None);
    }
}

#[test]
fn a_pause_is_no_breathing_and_belongs_to_the_exhalation() {
    let mut signal = belt(120.0, 50.0);
    // From the end of an exhalation at 60.5 s on, with a little noise.
    for k in 3025..3425 {
        signal[k] = signal[3025] + 0.02 * (k as f64 * 1.7).sin();
    }
    let rest = signal.split_off(3425);
    signal.extend(&rest[200..]);
    let breaths = found(&signal, 50.0);
    let pause = breaths.iter().find(|breath| breath.end > 3100.0).expect("a breath before it");
    assert!((pause.begin / 50.0 - 56.5).abs() < 0.2 && pause.duration() > 9.0 * 50.0, "{pause:?}");
    assert!((pause.inhalation() / 50.0 - 1.5).abs() < 0.2, "{pause:?}");
}

#[test]
fn a_lost_second_is_bridged_and_a_long_gap_parts_breaths() {
    let mut signal = belt(120.0, 50.0);
    let all = found(&signal, 50.0).len();
    signal[1000..1045].fill(f64::NAN);
    assert_eq!(found(&signal, 50.0).len(), all);
    signal[3000..3500].fill(f64::NAN);
    for breaths in [found(&signal, 50.0), live(&signal, 50.0)] {
        assert!(breaths.iter().all(|breath| breath.end <= 3000.0 || breath.begin >= 3500.0));
        assert!(breaths.last().unwrap().begin > 5000.0);
    }
}

/// A sine at 0.25 Hz and 25 Hz that starts at a phase [degrees], with noise of 1 %.
fn sine(degrees: f64, length_secs: f64) -> Vec<f64> {
    let noise = |k: usize| {
        let bits = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64
            / (1u64 << 53) as f64
            - 0.5
    };
    let sample = |k: usize| (TAU * 0.25 * k as f64 / 25.0 + degrees.to_radians()).sin();
    (0..(length_secs * 25.0) as usize).map(|k| sample(k) + 0.01 * 12f64.sqrt() * noise(k)).collect()
}

#[test]
fn a_breath_that_the_edge_of_the_data_cuts_off_does_not_count() {
    for (degrees, gap) in [0.0, 90.0, 180.0, 270.0]
        .into_iter()
        .flat_map(|degrees| [(degrees, 0..0), (degrees, 1480..1580)])
    {
        let mut signal = sine(degrees, 120.0);
        signal[gap.clone()].fill(f64::NAN);
        let channels = [signal];
        let recording = Recording { rate_hz: 25.0, begin_ns: 0, channels: &channels };
        let analysis = whole(&Settings::default(), &recording).unwrap();
        let measured = analysis.windows.measure(recording.span());
        let named = |name: &str| {
            let at = analysis.windows.values().iter().position(|value| value.name == name);
            measured.values[at.unwrap()].unwrap()
        };
        let (rate, rmssd) = (named("RSP_Rate_Mean"), named("RRV_RMSSD"));
        assert!((rate / 15.0 - 1.0).abs() < 0.005, "{rate} at {degrees} degrees, {gap:?}");
        assert!(rmssd < 15.0, "{rmssd} at {degrees} degrees, {gap:?}");
        assert!((named("RSP_Amplitude_Mean") - 2.0).abs() < 0.03, "{degrees} degrees, {gap:?}");
    }
}

#[test]
fn a_spectrum_gives_the_same_rate() {
    for rate_hz in [5.0, 50.0, 1000.0] {
        let rate = spectral_rate_per_min(&belt(60.0, rate_hz), rate_hz).unwrap();
        assert!((rate - 15.0).abs() < 0.3, "{rate}");
    }
    assert_eq!(spectral_rate_per_min(&belt(5.0, 50.0), 50.0), None);
}

#[test]
fn quality_falls_with_noise_saturation_and_motion() {
    let of = |signal: &[f64]| quality(signal, 50.0, &found(signal, 50.0)).unwrap();
    let noise = |k: usize| ((k * k) as f64 * 0.7).sin();
    let noisy = |height: f64| -> Vec<f64> {
        belt(60.0, 50.0).into_iter().enumerate().map(|(k, v)| v + height * noise(k)).collect()
    };
    let qualities = [0.0, 0.2, 0.6, 2.0, 10.0].map(|height| of(&noisy(height)));
    assert!(qualities.is_sorted_by(|a, b| a > b), "{qualities:?}");
    assert!(qualities[0] > 0.85 && qualities[4] < 0.4, "{qualities:?}");
    let saturated: Vec<f64> = belt(60.0, 50.0).into_iter().map(|v| v.clamp(1.5, 2.6)).collect();
    assert!(of(&saturated) < 0.7 * qualities[0], "{}", of(&saturated));
    let mut moved = belt(60.0, 50.0);
    moved[1200..1300].iter_mut().for_each(|v| *v += 30.0);
    assert!(of(&moved) < 0.9 * qualities[0], "{}", of(&moved));
    let mut lost = belt(60.0, 50.0);
    lost[1500..].fill(2.0);
    assert!(of(&lost) < 0.6 * qualities[0], "{}", of(&lost));
}

#[test]
fn cleaning_is_that_of_neurokit2() {
    let sample = |k: usize| {
        let t = k as f64 / 20.0;
        3.0 + 0.2 * t + (TAU * 0.25 * t).sin() + 0.3 * (TAU * 4.0 * t).sin()
    };
    let cleaned = clean(&(0..600).map(sample).collect::<Vec<_>>(), 20.0).unwrap();
    for (ours, theirs) in cleaned.iter().step_by(50).zip(golden::CLEAN) {
        assert!((ours - theirs).abs() < 1e-9, "{ours} {theirs}");
    }
}

/// The golden breaths, at 100 Hz.
fn golden_breaths() -> Vec<Breath> {
    let pairs = golden::TROUGHS.windows(2).zip(golden::PEAKS);
    let breath = |(pair, peak): (&[u32], u32)| {
        let [begin, peak, end] = [pair[0], peak, pair[1]].map(f64::from);
        Breath { begin, peak, end, amplitude: 1.0 }
    };
    pairs.map(breath).collect()
}

#[test]
fn variability_is_that_of_neurokit2() {
    let found = variability(&golden_breaths(), 100.0).unwrap();
    let ours = [
        found.rmssd_ms,
        found.mean_bb_ms,
        found.sdbb_ms,
        found.sdsd_ms,
        found.cvbb,
        found.cvsd,
        found.median_bb_ms,
        found.mad_bb_ms,
        found.mcvbb,
        found.sd1_ms,
        found.sd2_ms,
        found.sd2_sd1,
    ];
    for (ours, theirs) in ours.into_iter().zip(golden::VARIABILITY) {
        assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
    }
}

#[test]
fn sinus_arrhythmia_from_peak_to_trough_is_that_of_neurokit2() {
    let beats_secs: Vec<f64> = golden::BEATS.iter().map(|&beat| f64::from(beat) / 100.0).collect();
    let found =
        peak_to_trough(&golden_breaths(), 100.0, &RrInterval::between(&beats_secs)).unwrap();
    let [mean, log, sd, unreported] = golden::PEAK_TO_TROUGH;
    assert!((found.mean_ms - mean).abs() < 1e-6 && (found.sd_ms - sd).abs() < 1e-6, "{found:?}");
    assert!((found.mean_log - log).abs() < 1e-9, "{found:?}");
    assert!((found.unreported as f64 - unreported).abs() < 1e-9);
    assert_eq!(found.breaths + found.unreported, golden::PEAKS.len());
    assert_eq!(peak_to_trough(&golden_breaths(), 100.0, &[]), None);
}

#[test]
fn the_rate_of_a_simulated_ecg_is_the_one_it_was_made_with() {
    let times_secs: Vec<f64> =
        golden::SIMULATED_BEATS.iter().map(|&beat| f64::from(beat) / 250.0).collect();
    let derived = rate_from_beats(&times_secs, &golden::SIMULATED_HEIGHTS, 0.0..60.0).unwrap();
    // NeuroKit2's ecgsyn breathes at 0.25 Hz.
    assert!((derived.rate_per_min.value - 15.0).abs() < 2.0, "{derived:?}");
}

const SECOND_NS: i64 = 1_000_000_000;

/// The events, and the values of each minute.
fn run_live(signal: &[f64], rate_hz: f64) -> (Vec<Event>, Vec<Measured>) {
    let mut analysis = causal(&Settings::default(), rate_hz).expect("a usual rate");
    let (mut events, mut windows) = (Vec::new(), Vec::new());
    for (k, &sample) in signal.iter().enumerate() {
        let at_ns = (k as f64 / rate_hz * 1e9).round() as i64;
        let before_ns = ((k as f64 - 1.0) / rate_hz * 1e9).round() as i64;
        analysis.push(at_ns, &[sample]);
        events.extend(std::iter::from_fn(|| analysis.next_event()));
        if at_ns / SECOND_NS != before_ns / SECOND_NS && at_ns >= 60 * SECOND_NS {
            let end_ns = at_ns / SECOND_NS * SECOND_NS;
            windows.push(analysis.measure(Span { begin_ns: end_ns - 60 * SECOND_NS, end_ns }));
            analysis.forget(end_ns - 60 * SECOND_NS);
        }
    }
    (events, windows)
}

#[test]
fn causal_and_whole_give_the_same_of_a_steady_belt() {
    let signal = belt(180.0, 50.0);
    let (events, windows) = run_live(&signal, 50.0);
    let channels = [signal];
    let recording = Recording { rate_hz: 50.0, begin_ns: 0, channels: &channels };
    let all = whole(&Settings::default(), &recording).unwrap();
    assert!(events.len() + 4 >= all.events.len() && events.iter().all(|e| e.kind == "breath"));
    let span = Span { begin_ns: 60 * SECOND_NS, end_ns: 120 * SECOND_NS };
    let (causal, whole) = (&windows[60], all.windows.measure(span));
    assert_eq!(causal.values.len(), all.windows.values().len());
    assert!(causal.quality > 0.8 && whole.quality > 0.8);
    for (value, (causal, whole)) in
        all.windows.values().iter().zip(causal.values.iter().zip(&whole.values))
    {
        let (causal, whole) = (causal.unwrap(), whole.unwrap());
        let is_spread = value.name.ends_with("SD") || value.name.starts_with("RRV");
        let within = if is_spread { 200.0 } else { 0.15 * whole.abs() };
        assert!((causal - whole).abs() < within, "{}: {causal} {whole}", value.name);
    }
    let rate = windows[60].values[0].unwrap();
    assert!((rate - 15.0).abs() < 0.1, "{rate}");
}

#[test]
fn forgetting_changes_nothing_that_is_asked_for() {
    let signal = belt(200.0, 50.0);
    let mut analysis = causal(&Settings::default(), 50.0).unwrap();
    for (k, &sample) in signal.iter().enumerate() {
        analysis.push(k as i64 * SECOND_NS / 50, &[sample]);
    }
    let span = Span { begin_ns: 130 * SECOND_NS, end_ns: 190 * SECOND_NS };
    let before = analysis.measure(span);
    analysis.forget(span.begin_ns);
    assert_eq!(analysis.measure(span), before);
}

#[test]
fn a_thermistor_falls_with_inhalation() {
    let signal = belt(60.0, 50.0);
    let turned = [signal.iter().map(|sample| -sample).collect::<Vec<_>>()];
    let recording = Recording { rate_hz: 50.0, begin_ns: 0, channels: &turned };
    let settings = Settings { inhalation: Inhalation::Falls, unit: "degC".into() };
    let analysis = whole(&settings, &recording).unwrap();
    let events: Vec<f64> = analysis.events.iter().map(|event| event.sample).collect();
    assert_eq!(events, found(&signal, 50.0).iter().map(|each| each.begin).collect::<Vec<_>>());
    let values = analysis.windows.values();
    let unit = |name: &str| &values.iter().find(|value| value.name == name).unwrap().unit;
    assert_eq!((unit("RSP_Amplitude_Mean").as_ref(), unit("RSP_RVT").as_ref()), ("degC", "degC/s"));
}

#[test]
fn what_cannot_be_reported_has_its_reason() {
    let mut channels = [belt(120.0, 50.0)];
    channels[0][3000..].fill(f64::NAN);
    let recording = Recording { rate_hz: 50.0, begin_ns: 0, channels: &channels };
    let analysis = whole(&Settings::default(), &recording).unwrap();
    let reported = |begin: i64, end: i64| {
        let span = Span { begin_ns: begin * SECOND_NS, end_ns: end * SECOND_NS };
        analysis.windows.measure(span).values
    };
    assert!(reported(60, 120).iter().all(|value| *value == Err(Reason::Gap)));
    assert!(reported(20, 22).iter().all(|value| *value == Err(Reason::Short)));
    assert!(reported(20, 20).iter().all(Result::is_err));
    assert!(reported(0, 60).iter().all(Result::is_ok));
    let noise = (0..6000).map(|k| (f64::from(k * k) * 0.7).sin()).collect::<Vec<_>>();
    let channels = [noise];
    let recording = Recording { channels: &channels, ..recording };
    let analysis = whole(&Settings::default(), &recording).unwrap();
    let span = Span { begin_ns: 0, end_ns: 60 * SECOND_NS };
    assert!(analysis.windows.measure(span).values.contains(&Err(Reason::Quality)));
}

#[test]
fn absurd_rates_are_refused() {
    for rate_hz in [0.0, -1.0, 1e-9, 4.9, 2001.0, 1e9, f64::NAN, f64::INFINITY] {
        assert!(BreathDetector::new(rate_hz).is_err());
        assert!(find_breaths(&[0.0; 100], rate_hz).is_err());
        assert!(clean(&[0.0; 100], rate_hz).is_err());
        assert!(causal(&Settings::default(), rate_hz).is_err());
        let recording = Recording { rate_hz, begin_ns: 0, channels: &[] };
        assert!(whole(&Settings::default(), &recording).is_err());
        assert_eq!(quality(&[0.0; 100], rate_hz, &[]), None);
        assert_eq!(spectral_rate_per_min(&[0.0; 100], rate_hz), None);
    }
    assert!(matches!(BreathDetector::new(0.0), Err(SignalError::Rate { .. })));
}

#[test]
fn a_recording_without_samples_has_no_breaths() {
    for channels in [vec![], vec![vec![]], vec![vec![1.0]], vec![vec![f64::NAN; 500]]] {
        let recording = Recording { rate_hz: 50.0, begin_ns: 0, channels: &channels };
        let analysis = whole(&Settings::default(), &recording).unwrap();
        assert!(analysis.events.is_empty());
        let measured = analysis.windows.measure(Span { begin_ns: 0, end_ns: 60 * SECOND_NS });
        assert!(measured.values.iter().all(Result::is_err));
    }
    assert_eq!(found(&[], 50.0), []);
    assert_eq!(Pattern::of(&[], 50.0, 0.0..1.0), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_samples_are_survived(
        samples in prop::collection::vec(prop::num::f64::ANY, 0..800),
        rate_hz in 5.0..60.0f64,
        begin in any::<i64>(),
    ) {
        let channels = [samples];
        let recording = Recording { rate_hz, begin_ns: begin, channels: &channels };
        let analysis = whole(&Settings::default(), &recording).unwrap();
        let mut live = causal(&Settings::default(), rate_hz).unwrap();
        for (k, &sample) in channels[0].iter().enumerate() {
            live.push(begin.saturating_add((k as f64 / rate_hz * 1e9) as i64), &[sample]);
            if let Some(event) = live.next_event() {
                prop_assert!(event.sample.is_finite());
            }
        }
        for span in [recording.span(), Span { begin_ns: i64::MIN, end_ns: i64::MAX }] {
            for measured in [analysis.windows.measure(span), live.measure(span)] {
                prop_assert!((0.0..=1.0).contains(&measured.quality));
                prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
            }
        }
        live.forget(i64::MAX);
        for breath in find_breaths(&channels[0], rate_hz).unwrap() {
            prop_assert!(breath.begin < breath.peak && breath.peak < breath.end);
        }
    }

    #[test]
    fn any_breaths_are_survived(
        places in prop::collection::vec(prop::num::f64::ANY, 0..40),
        rate_hz in prop::num::f64::ANY,
    ) {
        let breaths: Vec<Breath> = places
            .windows(4)
            .map(|p| Breath { begin: p[0], peak: p[1], end: p[2], amplitude: p[3] })
            .collect();
        let beats: Vec<RrInterval> =
            places.windows(2).map(|p| RrInterval { end_secs: p[0], rr_ms: p[1] }).collect();
        let _ = Pattern::of(&breaths, rate_hz, 0.0..1e4);
        let _ = variability(&breaths, rate_hz);
        let _ = peak_to_trough(&breaths, rate_hz, &beats);
        let quality = quality(&belt(20.0, 25.0), 25.0, &breaths).unwrap();
        prop_assert!((0.0..=1.0).contains(&quality));
    }
}

/// The quality and the rate of a minute of sines on a belt: frequency [Hz] and height.
fn of_sines(sines: &[(f64, f64)]) -> (f64, Result<f64, Reason>) {
    let at = |k: u32| sines.iter().map(|(hz, a)| a * (TAU * hz * f64::from(k) / 25.0).sin()).sum();
    let channels = [(0..1500).map(at).collect::<Vec<f64>>()];
    let recording = Recording { rate_hz: 25.0, begin_ns: 0, channels: &channels };
    let measured = whole(&Settings::default(), &recording)
        .expect("a recording")
        .windows
        .measure(recording.span());
    (measured.quality, measured.values[0])
}

#[test]
fn breath_mixed_with_motion_or_the_heart_is_not_trusted() {
    for (hz, height) in [(0.9, 1.5), (0.9, 2.5), (0.45, 0.8), (0.6, 1.5)] {
        let (quality, rate) = of_sines(&[(0.23, 1.0), (hz, height)]);
        let is_right = rate.is_ok_and(|rate| (rate - 13.8).abs() < 0.7);
        assert!(is_right || quality < 0.8, "{rate:?} at {quality} with {height} at {hz} Hz");
    }
    for per_min in [6.0, 15.0, 30.0, 50.0, 58.0] {
        let (quality, rate) = of_sines(&[(per_min / 60.0, 1.0)]);
        assert!(quality > 0.65 && (rate.unwrap() - per_min).abs() < 0.5, "{per_min}: {quality}");
    }
}

#[test]
fn shallow_breaths_between_deep_ones_make_a_rate_doubtful() {
    let height = |k: u32| {
        let secs = f64::from(k) / 25.0;
        let depth = if secs % 8.0 < 4.0 { 1.0 } else { 0.15 };
        depth * (1.0 - (TAU * secs / 4.0).cos())
    };
    let channels = [(0..1500).map(height).collect::<Vec<f64>>()];
    let recording = Recording { rate_hz: 25.0, begin_ns: 0, channels: &channels };
    let measured =
        whole(&Settings::default(), &recording).unwrap().windows.measure(recording.span());
    assert!(measured.quality < 0.3, "{}", measured.quality);
    assert_eq!(measured.values[0], Err(Reason::Quality));
}

#[test]
fn the_heart_in_a_belt_withholds_variability_and_phases_and_no_rate() {
    let with = |heart: f64| {
        let mut channel = belt(120.0, 50.0);
        for (k, sample) in channel.iter_mut().enumerate() {
            *sample += heart * (TAU * 1.15 * k as f64 / 50.0).sin();
        }
        let channels = [channel];
        let recording = Recording { rate_hz: 50.0, begin_ns: 0, channels: &channels };
        let whole = whole(&Settings::default(), &recording).unwrap();
        let measured = whole.windows.measure(recording.span());
        let value = |name: &str| {
            let place = whole.windows.values().iter().position(|value| value.name == name);
            measured.values[place.unwrap()]
        };
        ["RSP_Rate_Mean", "RRV_MeanBB", "RSP_Phase_Duration_Ratio", "RRV_SDBB"].map(value)
    };
    assert!(with(0.0)[..3].iter().all(Result::is_ok));
    let [rate, mean, ratio, spread] = with(0.3);
    assert!((rate.unwrap() - 15.0).abs() < 0.3 && (mean.unwrap() - 4000.0).abs() < 80.0);
    assert_eq!((ratio, spread), (Err(Reason::Quality), Err(Reason::Quality)));
}
