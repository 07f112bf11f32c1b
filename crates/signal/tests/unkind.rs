//! Signals that are unkind, but of which the truth is plain: no number is wrong and looks well.

use std::f64::consts::TAU;

use teampulse_signal::analysis::{Recording, Span, Whole};
use teampulse_signal::ecg::{BeatDetector, find_beats};
use teampulse_signal::{ecg, ppg, respiration};

const RATE_HZ: f64 = 250.0;
const SECS: f64 = 60.0;

/// Beats a minute at a height each, with a T wave.
fn ecg(rate_per_min: f64, height: impl Fn(usize) -> f64) -> Vec<f64> {
    let cycle_secs = 60.0 / rate_per_min;
    let wave = |secs: f64, at: f64, width: f64| (-((secs - at) / width).powi(2) / 2.0).exp();
    let sample = |k: usize| {
        let secs = k as f64 / RATE_HZ;
        let beat = (secs / cycle_secs) as usize;
        let since = secs - beat as f64 * cycle_secs;
        let t_at = 0.1 + 0.27 * cycle_secs.min(1.0).sqrt();
        let t_wave = 0.2 * wave(since, t_at, 0.045 * cycle_secs.min(1.0).sqrt());
        height(beat) * (wave(since, 0.1, 0.011) - 0.2 * wave(since, 0.13, 0.011) + t_wave)
    };
    (0..(SECS * RATE_HZ) as usize).map(sample).collect()
}

fn causal(signal: &[f64]) -> usize {
    let mut detector = BeatDetector::new(RATE_HZ).expect("a rate");
    signal.iter().filter(|&&sample| detector.push(sample).is_some()).count()
}

fn reported(whole: &Whole, secs: f64, name: &str) -> (f64, Option<f64>) {
    let measured = whole.windows.measure(Span { begin_ns: 0, end_ns: (secs * 1e9) as i64 });
    let place = whole.windows.values().iter().position(|value| value.name == name).expect(name);
    (measured.quality, measured.values[place].ok())
}

fn pulse_rate(signal: Vec<f64>, rate_hz: f64) -> (f64, Option<f64>) {
    let secs = signal.len() as f64 / rate_hz;
    let channels = [signal];
    let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
    let whole =
        ppg::analysis::whole(&ppg::analysis::Settings::default(), &recording).expect("a recording");
    reported(&whole, secs, "PPG_Rate_Mean")
}

#[test]
fn a_glitch_costs_the_beats_under_it_and_no_others() {
    for rate in [60.0, 160.0, 180.0] {
        let mut signal = ecg(rate, |_| 1.0);
        signal[5000..5100].fill(5.0);
        let beats = SECS * rate / 60.0;
        assert!(find_beats(&signal, RATE_HZ).unwrap().len() as f64 > beats - 4.0, "{rate}");
        assert!(causal(&signal) as f64 > beats - 4.0, "{rate} causally");
    }
}

#[test]
fn beats_that_are_high_and_low_in_turn_are_all_beats() {
    let signal = ecg(75.0, |beat| if beat % 2 == 0 { 1.0 } else { 0.3 });
    assert!((73..=75).contains(&find_beats(&signal, RATE_HZ).unwrap().len()));
    assert!((71..=75).contains(&causal(&signal)));
}

#[test]
fn two_hundred_and_forty_five_beats_a_minute_are_no_half_of_a_whole_recording() {
    let signal = ecg(245.0, |_| 1.0);
    assert!((240..=245).contains(&find_beats(&signal, RATE_HZ).unwrap().len()));
}

#[test]
fn beats_that_are_missing_do_not_lower_the_rate() {
    let mut signal = ecg(92.5, |_| 1.0);
    for beat in (5..90).step_by(6) {
        let at = ((f64::from(beat) * 60.0 / 92.5 + 0.1) * RATE_HZ) as usize;
        signal[at - 12..at + 12].fill(f64::NAN);
    }
    let channels = [signal];
    let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels: &channels };
    let whole =
        ecg::analysis::whole(&ecg::analysis::Settings::default(), &recording).expect("a recording");
    let (_, rate) = reported(&whole, SECS, "ECG_Rate_Mean");
    assert!((rate.unwrap() - 92.5).abs() < 2.0, "{rate:?}");
}

#[test]
fn a_sine_is_no_pulse() {
    let sine = (0..3840).map(|k| (TAU * 2.15 * f64::from(k) / 64.0).sin()).collect();
    let (quality, rate) = pulse_rate(sine, 64.0);
    assert!(quality < 0.1 && rate.is_none(), "{rate:?} at {quality}");
}

#[test]
fn strong_diastolic_waves_are_no_pulses() {
    let wave = |secs: f64, at: f64| (-((secs - at) / 0.09).powi(2) / 2.0).exp();
    let sample = |k: u32| {
        let secs = f64::from(k) / 64.0 % 1.0;
        wave(secs, 0.3) + 0.75 * wave(secs, 0.7)
    };
    let (quality, rate) = pulse_rate((0..3840).map(sample).collect(), 64.0);
    assert!(rate.is_none_or(|rate| (rate - 60.0).abs() < 3.0), "{rate:?} at {quality}");
}

#[test]
fn a_random_walk_does_not_breathe() {
    let mut state = 1u64;
    let mut level = 0.0;
    let mut step = || {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 40) as f64 / f64::from(1u32 << 24) - 0.5
        };
        level += (0..6).map(|_| uniform()).sum::<f64>();
        level
    };
    let channels = [(0..3000).map(|_| step()).collect::<Vec<f64>>()];
    let recording = Recording { rate_hz: 50.0, begin_ns: 0, channels: &channels };
    let settings = respiration::analysis::Settings::default();
    let whole = respiration::analysis::whole(&settings, &recording).expect("a recording");
    let (quality, _) = reported(&whole, SECS, "RSP_Rate_Mean");
    assert!(quality < 0.4, "{quality}");
}
