//! The truth of the body against what `signal` finds in its signals: a check of our pipeline, not of nature.

#![expect(clippy::unwrap_used, reason = "a test")]

use teampulse_emulators::body::{Body, Fault, Rates, Record, Scene, Sensor, Settings, Traits};
use teampulse_signal::agreement::matched;
use teampulse_signal::ecg::{BeatDetector, find_beats};
use teampulse_signal::eda::{Threshold, clean, find_responses, high_pass_split};
use teampulse_signal::eeg::find_blinks;
use teampulse_signal::emg::find_bursts;
use teampulse_signal::hrv::time_domain;
use teampulse_signal::intervals::{Beats, Correction};
use teampulse_signal::ppg::find_pulses;
use teampulse_signal::respiration::derived::rate_from_beats;
use teampulse_signal::respiration::{Pattern, find_breaths};
use teampulse_signal::robust::median;
use teampulse_signal::spectrum::{Rule, Welch};

/// The number of simulated people, and for how long [s].
const PEOPLE: u64 = 6;
const SECS: f64 = 300.0;

fn only(sensor: Sensor) -> Settings {
    let rate_hz = sensor.usual_rate_hz();
    let rates = match sensor {
        Sensor::Ecg => Rates { ecg_hz: rate_hz, ..Rates::NONE },
        Sensor::Ppg => Rates { ppg_hz: rate_hz, ..Rates::NONE },
        Sensor::EdaWrist => Rates { eda_wrist_hz: rate_hz, ..Rates::NONE },
        Sensor::EdaFingers => Rates { eda_fingers_hz: rate_hz, ..Rates::NONE },
        Sensor::Emg => Rates { emg_hz: rate_hz, ..Rates::NONE },
        Sensor::Eeg => Rates { eeg_hz: rate_hz, ..Rates::NONE },
        Sensor::Respiration => Rates { respiration_hz: rate_hz, ..Rates::NONE },
        Sensor::Temperature => Rates { temperature_hz: rate_hz, ..Rates::NONE },
        Sensor::Acceleration => Rates { acceleration_hz: rate_hz, ..Rates::NONE },
    };
    Settings { rates, ..Settings::default() }
}

/// Five minutes of one sensor at a workload that has been reached, from 120 s on.
fn recorded(sensor: Sensor, seed: u64, workload: f64) -> Record {
    let mut body = Body::wearing(&Traits::of_seed(seed), seed, &only(sensor)).unwrap();
    body.state(workload, workload, 0.5);
    body.until(120.0);
    body.until(120.0 + SECS).clone()
}

fn beat_times(record: &Record) -> Vec<f64> {
    record.truth.beats.iter().map(|beat| beat.secs).collect()
}

/// Everyone, both calm and under workload.
fn everyone() -> impl Iterator<Item = (u64, f64)> {
    (0..PEOPLE).flat_map(|seed| [(seed, 0.0), (seed, 1.0)])
}

#[test]
fn beats_of_an_ecg_are_found_where_they_are() {
    for (seed, workload) in everyone() {
        let record = recorded(Sensor::Ecg, seed, workload);
        let wave = record.wave(Sensor::Ecg);
        let truth = beat_times(&record);
        let secs = |sample: f64| wave.first_secs() + sample / wave.rate_hz;
        let whole: Vec<f64> = find_beats(&wave.samples, wave.rate_hz)
            .unwrap()
            .iter()
            .map(|b| secs(b.sample))
            .collect();
        let mut detector = BeatDetector::new(wave.rate_hz).unwrap();
        let causal = wave.samples.iter().filter_map(|&sample| detector.push(sample));
        let causal: Vec<f64> = causal.map(|beat| secs(beat.sample)).collect();
        for (method, found) in [("whole", whole), ("causal", causal)] {
            let agreement = matched(&truth, &found, 0.010);
            let f1 = agreement.f1();
            assert!(f1 >= 0.995, "person {seed} at {workload}, {method}: {agreement:?}");
        }
    }
}

#[test]
fn variability_is_that_of_the_true_beats() {
    for (seed, workload) in everyone() {
        let record = recorded(Sensor::Ecg, seed, workload);
        let wave = record.wave(Sensor::Ecg);
        let found = find_beats(&wave.samples, wave.rate_hz).unwrap();
        let found: Vec<f64> = found.iter().map(|beat| beat.sample / wave.rate_hz).collect();
        let rmssd_ms = |times_secs: &[f64]| {
            let corrected = Correction::default().correct(&Beats::detected(times_secs));
            time_domain(&corrected.beats.intervals_ms()).unwrap().rmssd_ms
        };
        let (truth_ms, found_ms) = (rmssd_ms(&beat_times(&record)), rmssd_ms(&found));
        assert!(
            (found_ms / truth_ms - 1.0).abs() < 0.05,
            "{seed} {workload}: {found_ms} {truth_ms}"
        );
    }
}

#[test]
fn the_breathing_rate_stands_in_the_beats() {
    for (seed, workload) in everyone() {
        let record = recorded(Sensor::Ecg, seed, workload);
        let wave = record.wave(Sensor::Ecg);
        let beats = find_beats(&wave.samples, wave.rate_hz).unwrap();
        let secs: Vec<f64> =
            beats.iter().map(|beat| wave.first_secs() + beat.sample / wave.rate_hz).collect();
        let strengths: Vec<f64> = beats.iter().map(|beat| beat.strength).collect();
        let window_secs = 120.0..120.0 + SECS;
        let found = rate_from_beats(&secs, &strengths, window_secs).unwrap().rate_per_min;
        let truth_per_min = breaths_per_min(&record);
        let off = (found.value - truth_per_min).abs();
        assert!(off < 2.0, "person {seed} at {workload}: {found:?}, truly {truth_per_min}");
    }
}

#[test]
fn breaths_are_found_on_a_belt_where_they_are() {
    for (seed, workload) in everyone() {
        let record = recorded(Sensor::Respiration, seed, workload);
        let wave = record.wave(Sensor::Respiration);
        let found = find_breaths(&wave.samples, wave.rate_hz).unwrap();
        let pattern = Pattern::of(&found, wave.rate_hz, 0.0..wave.count() as f64).unwrap();
        let off = (pattern.rate_mean_per_min - breaths_per_min(&record)).abs();
        assert!(off < 0.5, "person {seed} at {workload}: {off} a minute off");
    }
}

#[test]
fn pulses_are_found_where_they_are() {
    for (seed, workload) in everyone() {
        let record = recorded(Sensor::Ppg, seed, workload);
        let wave = record.wave(Sensor::Ppg);
        let found = find_pulses(&wave.samples, wave.rate_hz).unwrap();
        let found: Vec<f64> =
            found.iter().map(|pulse| wave.first_secs() + pulse.sample / wave.rate_hz).collect();
        let truth: Vec<f64> = record.truth.pulses.iter().map(|pulse| pulse.peak_secs).collect();
        let agreement = matched(&truth, &found, 0.05);
        assert!(agreement.f1() >= 0.98, "person {seed} at {workload}: {agreement:?}");
    }
}

fn breaths_per_min(record: &Record) -> f64 {
    let breaths = &record.truth.breaths;
    let (first, last) = (breaths[0], breaths[breaths.len() - 1]);
    60.0 * (breaths.len() - 1) as f64 / (last.inhale_secs - first.inhale_secs)
}

#[test]
fn contractions_are_found_where_they_are() {
    for seed in 0..PEOPLE {
        let record = recorded(Sensor::Emg, seed, 0.0);
        let wave = record.wave(Sensor::Emg);
        let flexor: Vec<f64> = wave.channel(0).collect();
        let found = find_bursts(&flexor, wave.rate_hz).unwrap();
        let onsets: Vec<f64> =
            found.iter().map(|burst| wave.first_secs() + burst.onset / wave.rate_hz).collect();
        let contractions = &record.truth.contractions;
        let strong = contractions.iter().filter(|each| each.flexes && each.strength_uv > 25.0);
        let truth: Vec<f64> = strong.map(|each| each.from_secs).collect();
        let agreement = matched(&truth, &onsets, 0.1);
        assert_eq!(agreement.missed, 0, "person {seed}: {agreement:?}");
        let lasts = |secs: f64| {
            contractions.iter().any(|c| (c.from_secs - 0.1..c.to_secs + 0.1).contains(&secs))
        };
        assert!(onsets.iter().all(|&secs| lasts(secs)), "person {seed}: {onsets:?}");
    }
}

/// Responses isolated for this time [s] and clearly above noise [µS].
const ALONE_SECS: f64 = 6.0;
const SURE_US: f64 = 0.08;

#[test]
fn responses_of_the_skin_are_found_where_they_are() {
    for seed in 0..PEOPLE {
        let (mut sure, mut hits, mut offs) = (0, 0, Vec::new());
        for sensor in [Sensor::EdaWrist, Sensor::EdaFingers] {
            let record = recorded(sensor, seed, 0.0);
            let wave = record.wave(sensor);
            let clean = clean(&wave.samples, wave.rate_hz).unwrap();
            let split = high_pass_split(&clean, wave.rate_hz).unwrap();
            let found = find_responses(&split.phasic, wave.rate_hz, Threshold::default()).unwrap();
            let begins: Vec<f64> =
                record.truth.responses.iter().map(|each| each.onset_secs).collect();
            let is_alone = |secs: f64| {
                begins.iter().filter(|other| (**other - secs).abs() < ALONE_SECS).count() == 1
            };
            for response in &record.truth.responses {
                let is_sure = response.amplitude_us > SURE_US && is_alone(response.onset_secs);
                let ends_within = response.onset_secs < 120.0 + SECS - ALONE_SECS;
                if !(is_sure && ends_within) {
                    continue;
                }
                sure += 1;
                let at = |sample: f64| wave.first_secs() + sample / wave.rate_hz;
                let hit =
                    found.iter().find(|each| (at(each.peak) - response.peak_secs).abs() < 1.0);
                hits += u32::from(hit.is_some());
                offs.extend(hit.map(|hit| hit.amplitude_us / response.amplitude_us - 1.0));
            }
        }
        assert!(sure > 0 && f64::from(hits) >= 0.95 * f64::from(sure), "{seed}: {hits} of {sure}");
        let off = median(&offs).unwrap();
        assert!(off.abs() < 0.1, "person {seed}: amplitudes are off by {off}");
    }
}

#[test]
fn blinks_are_found_where_they_are() {
    for seed in 0..PEOPLE {
        let record = recorded(Sensor::Eeg, seed, 0.0);
        let wave = record.wave(Sensor::Eeg);
        let forehead: Vec<f64> = wave.channel(1).collect();
        let found = find_blinks(&forehead, wave.rate_hz).unwrap();
        let found: Vec<f64> =
            found.iter().map(|each| wave.first_secs() + each.sample / wave.rate_hz).collect();
        let truth: Vec<f64> = record.truth.blinks.iter().map(|blink| blink.peak_secs).collect();
        let agreement = matched(&truth, &found, 0.05);
        assert!(agreement.f1() >= 0.98, "person {seed}: {agreement:?}");
    }
}

#[test]
fn alpha_falls_with_workload_and_rises_when_the_eyes_close() {
    let alpha_uv2 = |record: &Record| {
        let wave = record.wave(Sensor::Eeg);
        let behind: Vec<f64> = wave.channel(0).collect();
        let spectrum = Welch::new(wave.rate_hz, 1024).of(&behind).unwrap();
        spectrum.band_power(8.0, 13.0, Rule::Simpson).unwrap()
    };
    for seed in 0..PEOPLE {
        let (calm, busy) = (recorded(Sensor::Eeg, seed, 0.0), recorded(Sensor::Eeg, seed, 1.0));
        assert!(busy.truth.blinks.len() < calm.truth.blinks.len());
        assert!(alpha_uv2(&busy) < 0.85 * alpha_uv2(&calm), "person {seed}");
        let mut body = Body::wearing(&Traits::of_seed(seed), seed, &only(Sensor::Eeg)).unwrap();
        body.close_eyes();
        let resting = body.until(SECS);
        assert!(resting.truth.blinks.is_empty());
        assert!(alpha_uv2(resting) > 1.5 * alpha_uv2(&calm), "person {seed}");
    }
}

#[test]
fn movement_is_felt_by_the_wrist_and_shakes_the_pulse() {
    let quiet = Traits { movements_per_min: 0.0, ..Traits::of_seed(1) };
    let deviations = |what: Fault| {
        let scene = Scene { sensor: None, from_secs: 30.0, to_secs: Some(60.0), what };
        let settings = Settings { script: vec![scene], ..Settings::default() };
        let mut body = Body::wearing(&quiet, 1, &settings).unwrap();
        body.until(30.0);
        let record = body.until(60.0);
        [Sensor::Acceleration, Sensor::Ppg, Sensor::Ecg, Sensor::EdaFingers]
            .map(|sensor| deviation(&record.wave(sensor).channel(0).collect::<Vec<_>>()))
    };
    let [still, moved] = [Fault::MovementG(0.0), Fault::MovementG(0.5)].map(deviations);
    for (still, moved) in still.into_iter().zip(moved) {
        assert!(moved > 1.2 * still, "{still} {moved}");
    }
}

fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}
