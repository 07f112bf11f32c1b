//! Laws of a simulated body: the same for any chunking, exact, and with the magnitudes it is designed for.

#![expect(clippy::unwrap_used, reason = "a test")]
#![expect(clippy::float_cmp, reason = "these are exact")]

use proptest::prelude::*;
use teampulse_emulators::body::{
    Body, Fault, Origin, Rates, Record, Scene, Sensor, Settings, Traits, Truth,
};
use teampulse_signal::hrv::time_domain;

const PEOPLE: u64 = 30;

fn join(all: &mut [Vec<u64>], record: &Record) {
    for (joined, wave) in all.iter_mut().zip(record.waves()) {
        let channels = wave.sensor.channels().len();
        assert_eq!(joined.len() / channels, wave.first as usize, "{:?}", wave.sensor);
        joined.extend(wave.samples.iter().map(|sample| sample.to_bits()));
    }
}

fn lived(times_secs: &[f64], settings: &Settings) -> (Vec<Vec<u64>>, String) {
    let mut body = Body::wearing(&Traits::of_seed(3), 9, settings).unwrap();
    body.state(0.8, 0.6, 0.2);
    let (mut waves, mut beats) = (vec![Vec::new(); Sensor::ALL.len()], Vec::new());
    let mut truths = Vec::new();
    for &secs in times_secs {
        let record = body.until(secs);
        join(&mut waves, record);
        beats.extend(record.truth.beats.iter().map(|beat| beat.secs.to_bits()));
        let Truth { pulses, responses, blinks, breaths, contractions, swings, .. } = &record.truth;
        truths.extend(pulses.iter().map(|x| format!("{x:?}")));
        truths.extend(responses.iter().map(|x| format!("{x:?}")));
        truths.extend(blinks.iter().map(|x| format!("{x:?}")));
        truths.extend(breaths.iter().map(|x| format!("{x:?}")));
        truths.extend(contractions.iter().map(|x| format!("{x:?}")));
        truths.extend(swings.iter().map(|x| format!("{x:?}")));
    }
    truths.sort();
    (waves, format!("{beats:?} {truths:?}"))
}

fn faults() -> Settings {
    let scene =
        |sensor, from_secs, what| Scene { sensor, from_secs, to_secs: Some(from_secs + 3.0), what };
    Settings {
        script: vec![
            scene(None, 2.0, Fault::MovementG(0.5)),
            scene(Some(Sensor::Ecg), 6.0, Fault::MainsHum(0.2)),
            scene(Some(Sensor::Ecg), 7.0, Fault::MuscleNoise(0.1)),
            scene(Some(Sensor::Emg), 7.0, Fault::Saturated(10.0)),
            scene(Some(Sensor::Ppg), 5.0, Fault::OffBody),
            scene(Some(Sensor::EdaWrist), 5.0, Fault::Stuck),
            scene(Some(Sensor::Eeg), 5.0, Fault::Dead),
        ],
        ..Settings::default()
    }
}

#[test]
fn a_body_is_the_same_bit_for_bit_however_time_is_cut() {
    let odd: Vec<f64> = (0..1459).map(|k| 0.0137 * f64::from(k)).collect();
    let odd = [odd, vec![20.0]].concat();
    for settings in [Settings::default(), faults()] {
        let whole = lived(&[20.0], &settings);
        assert!(whole == lived(&odd, &settings), "cut into pieces it is another");
        assert!(whole == lived(&[3.0, 3.0, 0.0, -5.0, f64::NAN, 20.0], &settings));
    }
}

#[test]
fn a_fault_of_one_sensor_leaves_the_others_and_the_truth_as_they_were() {
    let healthy = lived(&[20.0], &Settings::default());
    for what in [
        Fault::Dead,
        Fault::Stuck,
        Fault::OffBody,
        Fault::MainsHum(1.0),
        Fault::MuscleNoise(1.0),
        Fault::Saturated(0.1),
    ] {
        let sensor = Some(Sensor::Ppg);
        let scene = Scene { sensor, from_secs: 5.0, to_secs: Some(8.0), what };
        let script = vec![scene];
        let faulty = lived(&[20.0], &Settings { script, ..Settings::default() });
        assert!(faulty.1 == healthy.1, "{what:?} changed the truth");
        for (place, sensor) in Sensor::ALL.into_iter().enumerate() {
            let same = faulty.0[place] == healthy.0[place];
            assert_eq!(same, sensor != Sensor::Ppg, "{what:?} and {sensor:?}");
        }
        let ppg = Sensor::Ppg as usize;
        assert!(faulty.0[ppg][..5 * 64] == healthy.0[ppg][..5 * 64]);
        assert!(faulty.0[ppg][8 * 64..] == healthy.0[ppg][8 * 64..]);
    }
}

#[test]
fn every_sensor_gives_as_many_samples_as_its_rate_says() {
    let mut body = Body::new(&Traits::of_seed(1), 1);
    let record = body.until(60.0);
    for wave in record.waves() {
        assert_eq!(wave.count() as f64, 60.0 * wave.sensor.usual_rate_hz(), "{:?}", wave.sensor);
        assert!(wave.samples.iter().all(|sample| sample.is_finite()));
    }
    let gravity: Vec<f64> =
        (0..3).map(|axis| record.wave(Sensor::Acceleration).channel(axis).sum::<f64>()).collect();
    let mean_g = gravity.iter().map(|sum| (sum / 1920.0).powi(2)).sum::<f64>().sqrt();
    assert!((mean_g - 1.0).abs() < 0.05, "{mean_g}");
}

#[test]
fn no_time_and_no_rate_makes_a_body_panic_or_live_for_ever() {
    let mut body = Body::wearing(&Traits::of_seed(1), 1, &silent()).unwrap();
    body.until(f64::INFINITY);
    assert_eq!(body.secs(), 3600.0);
    body.until(f64::NEG_INFINITY);
    body.state(f64::NAN, f64::INFINITY, -1.0);
    body.press(f64::NAN);
    body.startle(f64::NAN, f64::NAN);
    body.startle(f64::INFINITY, 1.0);
    body.until(3610.0);
    for rate_hz in [f64::NAN, f64::INFINITY, -1.0, 1e-9, 1e9] {
        let rates = Rates { emg_hz: rate_hz, ..Rates::default() };
        let settings = Settings { rates, ..Settings::default() };
        assert!(Body::wearing(&Traits::of_seed(1), 1, &settings).is_err());
    }
}

/// A body without sensors: the truth alone.
fn silent() -> Settings {
    Settings { rates: Rates::NONE, ..Settings::default() }
}

/// What happened in five minutes at a workload, once that is reached.
fn truth_at(workload: f64, seed: u64) -> Truth {
    let mut body = Body::wearing(&Traits::of_seed(seed), seed, &silent()).unwrap();
    body.state(workload, 0.8 * workload, 0.5);
    body.until(120.0);
    body.until(420.0).truth.clone()
}

/// Intervals between beats of the sinus node [ms]; NaN where another lies between.
fn nn_ms(truth: &Truth) -> Vec<f64> {
    let pair = |pair: &[teampulse_emulators::body::Beat]| {
        let is_nn = pair.iter().all(|beat| beat.origin == Origin::Sinus);
        if is_nn { 1000.0 * (pair[1].secs - pair[0].secs) } else { f64::NAN }
    };
    truth.beats.windows(2).map(pair).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn a_group_is_of_the_size_it_was_designed_for() {
    // MeanNN and RMSSD [ms] of 30 people for 300 s each, by workload.
    let design = [(0.0, 881.0, 40.2), (0.35, 842.0, 33.3), (0.65, 812.0, 26.4), (1.0, 779.0, 17.5)];
    let mut last_breaths = 0.0;
    let mut last_responses = 0.0;
    let mut last_level_us = 0.0;
    for (workload, mean_nn_ms, rmssd_ms) in design {
        let truths: Vec<Truth> = (0..PEOPLE).map(|seed| truth_at(workload, seed)).collect();
        let hrv: Vec<_> = truths.iter().map(|truth| time_domain(&nn_ms(truth)).unwrap()).collect();
        let group_nn_ms = mean(hrv.iter().map(|hrv| hrv.mean_nn_ms));
        let group_rmssd_ms = mean(hrv.iter().map(|hrv| hrv.rmssd_ms));
        let breaths = mean(truths.iter().map(|truth| truth.breaths.len() as f64 / 5.0));
        let responses = mean(truths.iter().map(|truth| truth.responses.len() as f64 / 5.0));
        let level_us =
            mean(truths.iter().flat_map(|truth| truth.moments.iter().map(|m| m.skin_level_us)));
        assert!((group_nn_ms / mean_nn_ms - 1.0).abs() < 0.10, "{workload}: {group_nn_ms}");
        assert!((group_rmssd_ms / rmssd_ms - 1.0).abs() < 0.20, "{workload}: {group_rmssd_ms}");
        assert!(breaths > last_breaths && responses > last_responses && level_us > last_level_us);
        (last_breaths, last_responses, last_level_us) = (breaths, responses, level_us);
    }
}

fn any_fault() -> impl Strategy<Value = Fault> {
    let any = any::<f64>;
    prop_oneof![
        Just(Fault::Dead),
        Just(Fault::Stuck),
        Just(Fault::OffBody),
        any().prop_map(Fault::MovementG),
        any().prop_map(Fault::MainsHum),
        any().prop_map(Fault::MuscleNoise),
        any().prop_map(Fault::Saturated),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_script_makes_a_body_panic_or_lose_a_sample(
        whats in prop::collection::vec((any_fault(), any::<f64>(), any::<Option<f64>>()), 0..6),
        cuts_secs in prop::collection::vec(-1.0..4.0, 0..6),
        state in any::<[f64; 3]>(),
    ) {
        let scene = |(what, from_secs, to_secs)| Scene { sensor: None, from_secs, to_secs, what };
        let script = whats.into_iter().map(scene).collect();
        let settings = Settings { script, ..Settings::default() };
        let mut body = Body::wearing(&Traits::of_seed(1), 1, &settings).unwrap();
        body.state(state[0], state[1], state[2]);
        let mut count = 0;
        for secs in cuts_secs {
            count += body.until(secs).wave(Sensor::Ecg).count();
        }
        count += body.until(4.0).wave(Sensor::Ecg).count();
        prop_assert_eq!(count, 4 * 130);
    }
}
