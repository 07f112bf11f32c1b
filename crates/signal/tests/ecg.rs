//! Laws of the detectors of heart beats, on made-up ECGs.

#[path = "synthetic/ecg.rs"]
mod synthetic;

use proptest::prelude::*;
use synthetic::{beat_secs, ecg};
use teampulse_signal::ecg::{Beat, BeatDetector, Found, find_beats};
use teampulse_signal::error::SignalError;

fn causal(signal: &[f64], rate_hz: f64) -> Vec<Beat> {
    let mut detector = BeatDetector::new(rate_hz).expect("a usual rate");
    signal.iter().filter_map(|&sample| detector.push(sample)).collect()
}

fn whole(signal: &[f64], rate_hz: f64) -> Vec<Beat> {
    find_beats(signal, rate_hz).expect("a usual rate")
}

fn assert_are(found: &[Beat], beats: &[f64], rate_hz: f64, tolerance_secs: f64) {
    assert_eq!(found.len(), beats.len(), "at {rate_hz} Hz: {found:?}");
    for (found, beat) in found.iter().zip(beats) {
        let error_secs = found.sample / rate_hz - beat;
        assert!(error_secs.abs() < tolerance_secs, "at {rate_hz} Hz: {error_secs} s at {beat} s");
    }
}

#[test]
fn beats_are_found_at_any_rate_between_samples() {
    let beats = beat_secs(30);
    for rate_hz in [100.0, 128.0, 130.0, 250.0, 256.0, 360.0, 499.9, 512.0, 1000.0, 2000.0] {
        let signal = ecg(&beats, 26.0, rate_hz);
        // A quarter of a sample at 100 Hz, and what the waves beside R shift its peak by.
        assert_are(&whole(&signal, rate_hz), &beats, rate_hz, 0.0025);
        assert_are(&causal(&signal, rate_hz), &beats, rate_hz, 0.0025);
    }
}

#[test]
fn hum_hardly_shifts_beats() {
    let beats = beat_secs(30);
    for rate_hz in [130.0, 250.0, 500.0] {
        let clean = ecg(&beats, 26.0, rate_hz);
        let high = clean.iter().copied().fold(0.0, f64::max);
        let hum = |k: usize| 0.3 * high * (std::f64::consts::TAU * 50.0 * k as f64 / rate_hz).sin();
        let humming: Vec<f64> = clean.iter().enumerate().map(|(k, value)| value + hum(k)).collect();
        assert_are(&whole(&humming, rate_hz), &beats, rate_hz, 0.004);
    }
}

#[test]
fn polarity_and_unit_do_not_matter() {
    let beats = beat_secs(30);
    let signal = ecg(&beats, 26.0, 250.0);
    for factor in [-1.0, 1e-6, -1e6] {
        let other: Vec<f64> = signal.iter().map(|sample| factor * sample).collect();
        let found = whole(&other, 250.0);
        assert_are(&found, &beats, 250.0, 0.002);
        assert!(found.iter().all(|beat| beat.upright == (factor > 0.0)));
        assert_are(&causal(&other, 250.0), &beats, 250.0, 0.002);
    }
}

#[test]
fn of_two_equal_deflections_the_same_is_marked_from_the_first_seconds_on() {
    let rate_hz = 360.0;
    let beats = beat_secs(40);
    let mut state = 1u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
    };
    let mut slow = 0.0;
    let sample = |k: u32| {
        let secs = f64::from(k) / rate_hz;
        let bell = |middle: f64| (-((secs - middle) / 0.012).powi(2) / 2.0).exp();
        slow += 0.2 * (noise() - slow);
        beats.iter().map(|beat| bell(*beat) - bell(beat + 0.04)).sum::<f64>() + 0.6 * slow
    };
    let signal: Vec<f64> = (0..(34.0 * rate_hz) as u32).map(sample).collect();
    for found in [whole(&signal, rate_hz), causal(&signal, rate_hz)] {
        let marked: Vec<bool> = found.iter().skip(6).map(|beat| beat.upright).collect();
        assert_eq!(marked.len(), 34);
        assert!(marked.iter().all(|&upright| upright == marked[0]), "{marked:?}");
    }
}

#[test]
fn a_beat_is_reported_within_a_quarter_of_a_second() {
    let signal = ecg(&beat_secs(60), 50.0, 130.0);
    let mut detector = BeatDetector::new(130.0).expect("a usual rate");
    for (place, &sample) in signal.iter().enumerate() {
        if let Some(beat) = detector.push(sample).filter(|beat| beat.found == Found::InTime) {
            assert!((place as f64 - beat.sample) / 130.0 < 0.25);
        }
    }
}

#[test]
fn a_flat_line_has_no_beats() {
    for level in [0.0, 1000.0, f64::NAN] {
        assert!(whole(&vec![level; 5000], 250.0).is_empty());
        assert!(causal(&vec![level; 5000], 250.0).is_empty());
    }
}

#[test]
fn a_gap_costs_its_own_beats_only() {
    let beats = beat_secs(60);
    let mut signal = ecg(&beats, 50.0, 250.0);
    // From 20 to 25 s, and then on at another level.
    signal[5000..6250].fill(f64::NAN);
    signal[6250..].iter_mut().for_each(|sample| *sample += 50.0);
    let outside: Vec<f64> =
        beats.iter().copied().filter(|beat| !(19.9..25.1).contains(beat)).collect();
    assert_are(&whole(&signal, 250.0), &outside, 250.0, 0.002);
    assert_are(&causal(&signal, 250.0), &outside, 250.0, 0.002);
}

#[test]
fn single_lost_samples_cost_nothing() {
    let beats = beat_secs(60);
    let mut signal = ecg(&beats, 50.0, 250.0);
    signal.iter_mut().step_by(17).for_each(|sample| *sample = f64::NAN);
    assert_are(&whole(&signal, 250.0), &beats, 250.0, 0.008);
}

#[test]
fn beats_cut_off_by_saturation_are_found() {
    let beats = beat_secs(60);
    let cut: Vec<f64> = ecg(&beats, 50.0, 250.0).iter().map(|v| v.clamp(-0.6, 0.6)).collect();
    assert_are(&whole(&cut, 250.0), &beats, 250.0, 0.012);
}

#[test]
fn a_loose_electrode_does_not_deafen_for_good() {
    let beats = beat_secs(120);
    let mut signal = ecg(&beats, 100.0, 250.0);
    signal[0..2500].iter_mut().for_each(|sample| *sample *= 30.0);
    let late = causal(&signal, 250.0).iter().filter(|beat| beat.sample > 25.0 * 250.0).count();
    let truth = beats.iter().filter(|&&beat| beat > 25.0).count();
    assert_eq!(late, truth);
}

#[test]
fn an_absurd_rate_is_refused() {
    for rate_hz in [0.0, -1.0, 1.0, 1e9, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            find_beats(&[0.0], rate_hz),
            Err(SignalError::Rate { .. } | SignalError::Setting { .. })
        ));
        assert!(BeatDetector::new(rate_hz).is_err());
    }
}

#[test]
fn too_little_has_no_beats() {
    assert!(whole(&[], 250.0).is_empty());
    assert!(whole(&[1.0], 250.0).is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn chunks_of_any_length_give_the_same_beats(chunk in 1..4097usize, rate_hz in 100.0..600.0) {
        let mut signal = ecg(&beat_secs(40), 33.0, rate_hz);
        signal[2000..2400].fill(f64::NAN);
        let mut detector = BeatDetector::new(rate_hz).expect("a usual rate");
        let mut beats = Vec::new();
        for chunk in signal.chunks(chunk) {
            // Whatever is done between chunks: the detector goes on as a copy of itself.
            detector = detector.clone();
            beats.extend(chunk.iter().filter_map(|&sample| detector.push(sample)));
        }
        prop_assert_eq!(beats, causal(&signal, rate_hz));
    }

    #[test]
    fn beats_of_any_input_ascend_and_lie_within_it(
        signal in prop::collection::vec(prop_oneof![prop::num::f64::ANY, -1.0..1.0], 0..3000),
        rate_hz in 80.0..4000.0,
    ) {
        let last = signal.len() as f64 - 1.0;
        let found = whole(&signal, rate_hz);
        prop_assert!(found.iter().all(|beat| (0.0..=last).contains(&beat.sample)));
        prop_assert!(found.is_sorted_by(|a, b| a.sample <= b.sample));
        prop_assert!(causal(&signal, rate_hz).iter().all(|beat| beat.sample.is_finite()));
    }
}

#[test]
fn a_loud_hum_that_breaks_off_is_no_beat() {
    let beats_secs: Vec<f64> = (0..40).map(|beat| 0.5 + 0.85 * f64::from(beat)).collect();
    for rate_hz in [130.0, 250.0, 500.0] {
        for phase in [0.0, 0.7, 1.4, 2.1, 2.8] {
            let sample = |k: usize| {
                let secs = k as f64 / rate_hz;
                let beat = |at: &f64| (-((secs - at) / 0.012).powi(2) / 2.0).exp();
                let hum = (std::f64::consts::TAU * 50.0 * secs + phase).sin();
                beats_secs.iter().map(beat).sum::<f64>() + hum
            };
            let mut signal: Vec<f64> = (0..(30.0 * rate_hz) as usize).map(sample).collect();
            let gap = (20.0 * rate_hz) as usize..(21.5 * rate_hz) as usize;
            signal[gap].fill(f64::NAN);
            let found = find_beats(&signal, rate_hz).unwrap();
            let is_false = |secs: &f64| !beats_secs.iter().any(|at| (at - secs).abs() < 0.1);
            let of_none: Vec<f64> =
                found.iter().map(|beat| beat.sample / rate_hz).filter(is_false).collect();
            assert!(of_none.is_empty(), "{rate_hz} Hz, {phase}: {of_none:?}");
        }
    }
}
