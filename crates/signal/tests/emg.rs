//! Laws of the electromyogram's features, and their values against plain formulas.

#![expect(clippy::float_cmp, reason = "tests compare exactly where the arithmetic is exact")]

#[expect(clippy::unreadable_literal, reason = "printed by a script")]
#[path = "golden/emg.rs"]
mod golden;

use proptest::prelude::*;
use teampulse_signal::analysis::{Causal, Measured, Reason, Recording, Span, Windows};
use teampulse_signal::emg::analysis::{Channel, Settings, causal, whole};
use teampulse_signal::emg::{Frames, Thresholds, clean};

/// As the golden script makes it.
fn signal(count: i64) -> Vec<f64> {
    let sample = |k: i64| {
        let noise = (k * k % 977 * 31 % 1009) as f64 / 1009.0 - 0.5 + 3.0;
        noise + 0.25 * (k / 300 % 2) as f64 * ((k * 7919 % 1000) as f64 / 500.0 - 1.0)
    };
    (0..count).map(sample).collect()
}

/// Noise that is ten times as loud in every other span of two seconds.
fn bursts(count: i64, rate_hz: f64) -> Vec<f64> {
    let gain = |k: i64| if (k as f64 / rate_hz / 2.0) as i64 % 2 == 1 { 1.0 } else { 0.1 };
    (0..count).map(|k| gain(k) * ((k * k % 977 * 31 % 1009) as f64 / 1009.0 - 0.5)).collect()
}

fn settings(count: usize) -> Settings {
    let channel = |k: usize| Channel { name: format!("ch{}", k + 1), mvc: Some(0.5) };
    let channels = (0..count).map(channel).collect();
    Settings { channels, antagonists: vec![[0, count - 1]], ..Settings::default() }
}

fn secs(begin: f64, end: f64) -> Span {
    Span { begin_ns: (begin * 1e9) as i64, end_ns: (end * 1e9) as i64 }
}

fn value(windows: &dyn Windows, measured: &Measured, name: &str) -> Result<f64, Reason> {
    let index = windows.values().iter().position(|value| value.name == name);
    measured.values[index.unwrap_or_else(|| panic!("no value {name}"))]
}

fn feed(analysis: &mut dyn Causal, channels: &[Vec<f64>], rate_hz: f64) {
    for sample in 0..channels[0].len() {
        let row: Vec<f64> = channels.iter().map(|channel| channel[sample]).collect();
        analysis.push((sample as f64 / rate_hz * 1e9).round() as i64, &row);
    }
}

#[test]
fn features_are_those_of_plain_formulas() {
    for &(rate_hz, threshold, rows) in golden::FRAMES {
        // As many samples as the script took.
        let count = if rate_hz < 300.0 { 200 } else { (0.8 * rate_hz) as i64 };
        let thresholds = Thresholds { zero_crossing: threshold, slope_change: threshold };
        let mut frames = Frames::new(rate_hz, 0.25, 0.125).unwrap().with_thresholds(thresholds);
        let found = frames.of(&clean(&signal(count), rate_hz).unwrap());
        assert_eq!(found.len(), rows.len());
        for (found, row) in found.into_iter().zip(rows) {
            let of = found.unwrap();
            let amplitudes = [of.rms, of.mav, of.iemg, of.var, of.wl, of.zc, of.ssc];
            // Relative: 1e-9 for amplitudes, 1e-6 for frequencies.
            for (ours, theirs) in amplitudes.into_iter().zip(row) {
                assert!((ours - theirs).abs() <= 1e-9 * theirs, "{rate_hz} Hz: {ours} {theirs}");
            }
            for (ours, theirs) in [of.mnf_hz, of.mdf_hz].into_iter().zip(&row[7..]) {
                assert!((ours - theirs).abs() <= 1e-6 * theirs, "{rate_hz} Hz: {ours} {theirs}");
            }
        }
    }
}

#[test]
fn a_window_of_one_frame_has_the_features_of_that_frame() {
    let channels = [signal(2000)];
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(1), &recording).unwrap();
    let frames =
        Frames::new(1000.0, 0.25, 0.125).unwrap().of(&clean(&channels[0], 1000.0).unwrap());
    for (k, frame) in frames.iter().enumerate() {
        let begin = 0.125 * k as f64;
        let measured = all.windows.measure(secs(begin, begin + 0.25));
        let get = |name: &str| value(&*all.windows, &measured, name).unwrap();
        let frame = frame.unwrap();
        assert!((get("EMG_RMS/ch1") - frame.rms).abs() < 1e-12);
        assert_eq!(get("EMG_WL/ch1"), frame.wl);
        assert_eq!(get("EMG_MDF/ch1"), frame.mdf_hz);
        assert_eq!(measured.coverage, 1.0);
    }
}

#[test]
fn causal_and_whole_agree_on_bursts_and_loudness() {
    let channels = vec![bursts(16_000, 200.0), bursts(16_000, 200.0)];
    let recording = Recording { rate_hz: 200.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(2), &recording).unwrap();
    let mut running = causal(&settings(2), 200.0).unwrap();
    feed(&mut *running, &channels, 200.0);
    let mut causal = Vec::new();
    while let Some(event) = running.next_event() {
        causal.push(event);
    }
    // Twenty bursts in each channel; the last one is cut off by the end.
    assert_eq!((all.events.len(), causal.len()), (40, 38));
    for event in causal.iter().chain(&all.events) {
        let since = (event.at_ns as f64 / 1e9).rem_euclid(4.0);
        assert!((since - 2.0).abs() < 0.1, "{event:?}");
        let [channel, duration] = [event.details[0].1, event.details[1].1];
        assert!(channel < 2.0 && (duration - 2.0).abs() < 0.15, "{event:?}");
    }
    for name in
        ["EMG_RMS/ch1", "EMG_MNF/ch2", "EMG_Amplitude_Mean/ch1", "EMG_MVC/ch2", "EMG_CCI/ch1+ch2"]
    {
        let span = secs(20.0, 60.0);
        let [one, other] = [&*all.windows as &dyn Windows, &*running]
            .map(|windows| value(windows, &windows.measure(span), name).unwrap());
        assert!((one / other - 1.0).abs() < 0.1, "{name}: {one} {other}");
    }
    let measured = all.windows.measure(secs(0.0, 80.0));
    assert_eq!(value(&*all.windows, &measured, "EMG_Activation_N/ch2"), Ok(20.0));
}

#[test]
fn equal_envelopes_cocontract_by_twice_their_share_of_the_maximum() {
    let channels = vec![bursts(8000, 200.0), bursts(8000, 200.0)];
    let recording = Recording { rate_hz: 200.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(2), &recording).unwrap();
    let measured = all.windows.measure(secs(0.0, 40.0));
    let mvc = value(&*all.windows, &measured, "EMG_MVC/ch1").unwrap();
    let index = value(&*all.windows, &measured, "EMG_CCI/ch1+ch2").unwrap();
    assert!((index - 2.0 * mvc / 100.0).abs() < 1e-12, "{index} {mvc}");
}

#[test]
fn what_was_not_measured_is_missing() {
    let mut settings = settings(2);
    settings.channels[1].mvc = None;
    let channels = vec![bursts(8000, 200.0), vec![f64::NAN; 8000]];
    let recording = Recording { rate_hz: 200.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings, &recording).unwrap();
    let measured = all.windows.measure(recording.span());
    let get = |name: &str| value(&*all.windows, &measured, name);
    assert!(get("EMG_MVC/ch1").is_ok() && get("EMG_RMS/ch1").is_ok());
    assert_eq!(get("EMG_RMS/ch2"), Err(Reason::Gap));
    assert_eq!(get("EMG_CCI/ch1+ch2"), Err(Reason::Missing));
    assert_eq!(measured.coverage, 1.0);
    settings.channels[0].mvc = None;
    let all = whole(&settings, &recording).unwrap();
    let measured = all.windows.measure(recording.span());
    assert_eq!(value(&*all.windows, &measured, "EMG_MVC/ch1"), Err(Reason::Missing));
}

#[test]
fn a_flat_channel_is_too_poor_and_says_so() {
    let channels = vec![vec![5.0; 4000]];
    let recording = Recording { rate_hz: 200.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(1), &recording).unwrap();
    let measured = all.windows.measure(recording.span());
    assert!(measured.quality < 0.05);
    assert_eq!(value(&*all.windows, &measured, "EMG_RMS/ch1"), Err(Reason::Quality));
    assert!(value(&*all.windows, &measured, "EMG_Flat/ch1").unwrap() > 0.95);
}

#[test]
fn a_window_shorter_than_a_frame_is_too_short() {
    let mut running = causal(&settings(1), 1000.0).unwrap();
    feed(&mut *running, &[signal(3000)], 1000.0);
    let measured = running.measure(secs(1.0, 1.2));
    assert_eq!(value(&*running, &measured, "EMG_RMS/ch1"), Err(Reason::Short));
    assert!((measured.coverage - 1.0).abs() < 0.01);
    assert_eq!(running.measure(secs(1.0, 1.0)).coverage, 0.0);
}

#[test]
fn half_a_window_of_gap_is_reported() {
    let mut channels = [signal(8000)];
    channels[0][2000..5000].fill(f64::NAN);
    let mut running = causal(&settings(1), 1000.0).unwrap();
    feed(&mut *running, &channels, 1000.0);
    let measured = running.measure(secs(0.0, 8.0));
    assert!((measured.coverage - 5.0 / 8.0).abs() < 1e-3, "{}", measured.coverage);
    assert_eq!(value(&*running, &running.measure(secs(2.0, 5.0)), "EMG_MAV/ch1"), Err(Reason::Gap));
    assert!(value(&*running, &running.measure(secs(5.0, 8.0)), "EMG_MAV/ch1").is_ok());
}

#[test]
fn a_muscle_that_tires_has_a_falling_median_frequency() {
    // The band's centre falls from 150 to 90 Hz in a minute.
    let mut phase = 0.0f64;
    let tiring = (0..60_000).map(|k| {
        let jitter = (f64::from(k * 7919 % 1000) / 500.0 - 1.0) * 30.0;
        phase += std::f64::consts::TAU * (150.0 - f64::from(k) / 1000.0 + jitter) / 1000.0;
        phase.sin()
    });
    let channels = [tiring.collect::<Vec<f64>>()];
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(1), &recording).unwrap();
    let measured = all.windows.measure(recording.span());
    let slope = value(&*all.windows, &measured, "EMG_MDF_Slope/ch1").unwrap();
    assert!((slope + 60.0).abs() < 6.0, "{slope}");
    let short = all.windows.measure(secs(0.0, 5.0));
    assert_eq!(value(&*all.windows, &short, "EMG_MDF_Slope/ch1"), Err(Reason::Short));
}

/// Contractions of two seconds in every five whose band falls from 150 to 140 Hz in a minute; at rest, noise
/// around 85 Hz that a frame of contraction and rest would mix in.
fn tiring_contractions(secs: usize) -> Vec<f64> {
    let (mut phase, mut quiet) = (0.0f64, 0.0f64);
    let sample = |k: usize| {
        let jitter = ((k * 7919 % 1000) as f64 / 500.0 - 1.0) * 30.0;
        phase += std::f64::consts::TAU * (150.0 - k as f64 / 6000.0 + jitter) / 1000.0;
        quiet += std::f64::consts::TAU * (85.0 + jitter) / 1000.0;
        let rest = 0.05 * quiet.sin();
        if k % 5000 < 3000 { rest } else { rest + phase.sin() }
    };
    (0..secs * 1000).map(sample).collect()
}

#[test]
fn fatigue_is_that_of_contractions_without_rest() {
    let channels = [tiring_contractions(120)];
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(1), &recording).unwrap();
    let mut live = causal(&settings(1), 1000.0).unwrap();
    feed(&mut *live, &channels, 1000.0);
    for windows in [&*all.windows as &dyn Windows, &*live] {
        for span in [secs(0.0, 120.0), secs(60.0, 120.0), secs(31.0, 88.0)] {
            let slope = value(windows, &windows.measure(span), "EMG_MDF_Slope/ch1").unwrap();
            assert!((slope + 10.0).abs() < 1.5, "{slope}");
        }
        // Between contractions, and within one.
        for span in [secs(50.0, 53.0), secs(53.0, 55.0)] {
            let slope = value(windows, &windows.measure(span), "EMG_MDF_Slope/ch1");
            assert_eq!(slope, Err(Reason::Short));
        }
    }
}

#[test]
fn a_muscle_that_rests_in_a_window_has_no_fatigue_there() {
    let mut signal = tiring_contractions(60);
    for (sample, rest) in signal[30_000..].iter_mut().zip(contracting(30, 1.0)) {
        *sample = 0.1 * rest;
    }
    let channels = [signal];
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(1), &recording).unwrap();
    let measured = all.windows.measure(secs(31.0, 60.0));
    assert_eq!(value(&*all.windows, &measured, "EMG_MDF_Slope/ch1"), Err(Reason::Short));
    assert_eq!(value(&*all.windows, &measured, "EMG_MDF/ch1"), Err(Reason::Nothing));
}

#[test]
fn what_is_forgotten_changes_nothing_later() {
    let channels = [bursts(8000, 200.0), bursts(8000, 200.0)];
    let mut all = causal(&settings(2), 200.0).unwrap();
    feed(&mut *all, &channels, 200.0);
    let mut forgetful = causal(&settings(2), 200.0).unwrap();
    for (sample, (&one, &other)) in channels[0].iter().zip(&channels[1]).enumerate() {
        forgetful.push((sample as f64 / 200.0 * 1e9).round() as i64, &[one, other]);
        forgetful.forget((sample as i64 - 3000) * 5_000_000);
    }
    let span = secs(30.0, 40.0);
    assert_eq!(all.measure(span), forgetful.measure(span));
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let usual = settings(2);
    let bad = [
        Settings { channels: Vec::new(), ..Settings::default() },
        Settings { channels: vec![Channel::default(); 1000], ..Settings::default() },
        Settings { antagonists: vec![[0, 2]], ..usual.clone() },
        Settings {
            thresholds: Thresholds { zero_crossing: f64::NAN, slope_change: 0.0 },
            ..usual.clone()
        },
        Settings {
            channels: vec![Channel { mvc: Some(0.0), ..Channel::default() }],
            ..Settings::default()
        },
    ];
    for settings in bad {
        assert!(causal(&settings, 1000.0).is_err());
    }
    for rate_hz in [0.0, 1e-9, 1e9, f64::NAN, f64::INFINITY, -1.0] {
        assert!(causal(&usual, rate_hz).is_err());
        let recording = Recording { rate_hz, begin_ns: 0, channels: &[] };
        assert!(whole(&usual, &recording).is_err());
    }
}

#[test]
fn an_empty_recording_has_gaps_only() {
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &[] };
    let all = whole(&settings(2), &recording).unwrap();
    assert!(all.events.is_empty());
    let measured = all.windows.measure(secs(0.0, 10.0));
    assert_eq!(measured.values.len(), all.windows.values().len());
    assert_eq!((measured.coverage, measured.quality), (0.0, 0.0));
    let is_empty = |value: &Result<f64, Reason>| matches!(value, Err(Reason::Gap));
    assert!(measured.values.iter().all(is_empty));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn no_input_gives_nonsense(
        signal in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -1.0..1.0], 0..2000),
        rate_hz in 100.0..1000.0,
        begin in -1.0..5.0,
        length in prop_oneof![-1.0..20.0, Just(f64::INFINITY)],
    ) {
        let channels = [signal.clone(), signal];
        let mut running = causal(&settings(2), rate_hz).unwrap();
        feed(&mut *running, &channels, rate_hz);
        let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
        let all = whole(&settings(2), &recording).unwrap();
        let span = secs(begin, begin + length);
        for measured in [running.measure(span), all.windows.measure(span)] {
            prop_assert!((0.0..=1.0).contains(&measured.coverage));
            prop_assert!((0.0..=1.0).contains(&measured.quality));
            prop_assert_eq!(measured.values.len(), running.values().len());
            prop_assert!(measured.values.iter().flatten().all(|value| value.is_finite()));
        }
        prop_assert!(all.events.is_sorted_by_key(|event| event.at_ns));
    }
}

/// Noise of a muscle at 1000 Hz, in bursts of `share` of four seconds, sixty times as loud as rest.
fn contracting(secs: u32, share: f64) -> Vec<f64> {
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1u32 << 23) - 1.0
    };
    let white: Vec<f64> = (0..secs * 1000 + 3).map(|_| noise()).collect();
    let muscle = white.windows(4).map(|part| part.iter().sum::<f64>() / 4.0);
    let gain = |k: usize| if ((k % 4000) as f64) < 4000.0 * share { 1.0 } else { 0.0 };
    muscle
        .enumerate()
        .map(|(k, muscle)| gain(k) * muscle + 0.01 * white[(k * 7 + 3) % white.len()])
        .collect()
}

#[test]
fn the_frequency_of_a_muscle_does_not_depend_on_how_long_it_rests() {
    let channels = [0.75, 0.5, 0.25].map(|share| contracting(40, share));
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
    let all = whole(&settings(3), &recording).unwrap();
    let span = all.windows.measure(recording.span());
    let get = |name: &str| value(&*all.windows, &span, name).unwrap();
    for name in ["EMG_MDF", "EMG_MNF"] {
        let [most, half, least] = [1, 2, 3].map(|k| get(&format!("{name}/ch{k}")));
        assert!((half / most - 1.0).abs() < 0.1, "{name}: {most} {half}");
        assert!((least / most - 1.0).abs() < 0.1, "{name}: {most} {least}");
    }
    let rest = all.windows.measure(secs(1.5, 3.9));
    assert_eq!(value(&*all.windows, &rest, "EMG_MDF/ch3"), Err(Reason::Nothing));
    assert!(value(&*all.windows, &rest, "EMG_RMS/ch3").is_ok());
}

#[test]
fn a_tone_and_single_wrong_samples_are_no_muscle() {
    let hum = |at_hz: f64, gain: f64| {
        let both = |(k, rest): (usize, &f64)| {
            rest + gain * (std::f64::consts::TAU * at_hz * k as f64 / 1000.0).sin()
        };
        contracting(20, 1.0).iter().enumerate().map(both).collect::<Vec<f64>>()
    };
    let of = |signal: Vec<f64>| {
        let channels = [signal];
        let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
        whole(&Settings::default(), &recording).unwrap().windows.measure(recording.span()).quality
    };
    let quality = |at_hz: f64, gain: f64| of(hum(at_hz, gain));
    let mut clicks = contracting(20, 0.0);
    (500..20_000).step_by(1000).for_each(|k| clicks[k] += 1.5);
    assert!(of(contracting(20, 0.0)) > 0.9 && of(clicks) < 0.4);
    assert!(quality(100.0, 0.0) > 0.9, "{}", quality(100.0, 0.0));
    for at_hz in [49.5, 100.0, 137.0, 180.0] {
        assert!(quality(at_hz, 0.02) > 0.9, "{at_hz}: {}", quality(at_hz, 0.02));
        assert!(quality(at_hz, 2.0) < 0.3, "{at_hz}: {}", quality(at_hz, 2.0));
    }
}
