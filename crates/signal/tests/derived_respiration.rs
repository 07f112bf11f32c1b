//! Laws of the breathing rate that is derived from beats and pulses, on made-up modulations.

use std::f64::consts::TAU;

use proptest::prelude::*;
use teampulse_signal::analysis::Reason;
use teampulse_signal::respiration::derived::{Derived, rate_from_beats, rate_from_pulses};

/// A body that breathes: how fast, and what that does to its beats.
#[derive(Clone, Copy)]
struct Body {
    breaths_per_min: f64,
    beats_per_min: f64,
    /// Share of the heart rate that comes and goes with a breath.
    arrhythmia: f64,
    /// Share of the heart rate that comes and goes with the waves of blood pressure, 5.7 a minute.
    pressure_waves: f64,
    /// Share of the amplitude that comes and goes with a breath.
    amplitude: f64,
    noise: f64,
    seed: u32,
}

const BODY: Body = Body {
    breaths_per_min: 15.0,
    beats_per_min: 70.0,
    arrhythmia: 0.03,
    pressure_waves: 0.03,
    amplitude: 0.08,
    noise: 0.02,
    seed: 1,
};

struct Beats {
    times_secs: Vec<f64>,
    amplitudes: Vec<f64>,
    baselines: Vec<f64>,
}

/// Even noise with a standard deviation of 1.
fn noise(seed: u32) -> impl FnMut() -> f64 {
    let mut state = u64::from(seed).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        ((state >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    }
}

/// Integral pulse frequency modulation: a beat each time that the heart rate adds up to one.
fn beats(body: Body, length_secs: f64) -> Beats {
    let mut noise = noise(body.seed);
    let breath = |secs: f64| (TAU * body.breaths_per_min / 60.0 * secs).sin();
    let mut beats = Beats { times_secs: vec![], amplitudes: vec![], baselines: vec![] };
    let mut sum = 0.0;
    for millis in 0..(length_secs * 1000.0) as u32 {
        let secs = f64::from(millis) / 1000.0;
        let waves = body.pressure_waves * (TAU * 0.095 * secs + 1.0).sin();
        sum += body.beats_per_min / 60e3 * (1.0 + body.arrhythmia * breath(secs) + waves);
        if sum >= 1.0 {
            sum -= 1.0;
            beats.times_secs.push(secs + 0.003 * noise());
            let drift = 0.3 * (TAU * secs / 97.0).sin();
            beats.amplitudes.push(1.0 + body.amplitude * breath(secs - 0.4) + body.noise * noise());
            beats
                .baselines
                .push(drift + 2.0 * body.amplitude * breath(secs - 0.8) + body.noise * noise());
        }
    }
    beats
}

fn of_beats(body: Body, length_secs: f64) -> Result<Derived, Reason> {
    let Beats { times_secs, amplitudes, .. } = beats(body, length_secs);
    rate_from_beats(&times_secs, &amplitudes, 0.0..length_secs)
}

fn of_pulses(body: Body, length_secs: f64) -> Result<Derived, Reason> {
    let Beats { times_secs, amplitudes, baselines } = beats(body, length_secs);
    rate_from_pulses(&times_secs, &amplitudes, &baselines, 0.0..length_secs)
}

#[test]
fn the_rate_of_breathing_bodies_is_found_or_refused_and_its_uncertainty_holds() {
    let (mut found, mut all, mut beyond) = (0, 0, 0);
    for seed in 1..=60 {
        let body = Body {
            breaths_per_min: 8.0 + f64::from(seed * 7 % 19),
            beats_per_min: 62.0 + f64::from(seed * 11 % 31),
            seed,
            ..BODY
        };
        for length_secs in [30.0, 60.0, 150.0] {
            for derived in [of_beats(body, length_secs), of_pulses(body, length_secs)] {
                all += 1;
                let Ok(derived) = derived else { continue };
                found += 1;
                let off = derived.rate_per_min.value - body.breaths_per_min;
                assert!(off.abs() < 2.0, "{off} of {} at {length_secs} s", body.breaths_per_min);
                beyond += u32::from(off.abs() > 2.0 * derived.rate_per_min.sigma);
            }
        }
    }
    assert!(f64::from(found) > 0.9 * f64::from(all), "{found} of {all}");
    assert!(f64::from(beyond) < 0.05 * f64::from(found), "{beyond} of {found}");
}

#[test]
fn waves_of_blood_pressure_are_no_breathing() {
    for seed in 1..=20 {
        let body = Body { pressure_waves: 0.06, arrhythmia: 0.01, seed, ..BODY };
        if let Ok(derived) = of_beats(body, 60.0) {
            assert!((derived.rate_per_min.value - 15.0).abs() < 1.0, "{derived:?}");
        }
    }
    let derived = of_beats(Body { pressure_waves: 0.04, ..BODY }, 60.0).unwrap();
    assert!((derived.rate_per_min.value - 15.0).abs() < 1.0, "{derived:?}");
}

#[test]
fn breaths_that_beats_are_too_slow_for_are_no_slower_ones() {
    for (beats_per_min, breaths_per_min) in [(50.0, 28.0), (45.0, 30.0), (56.0, 32.0)] {
        let body = Body { beats_per_min, breaths_per_min, pressure_waves: 0.01, ..BODY };
        assert_eq!(of_beats(body, 60.0), Err(Reason::Quality));
        assert_eq!(of_pulses(body, 60.0), Err(Reason::Quality));
    }
    let slow = of_beats(Body { beats_per_min: 50.0, breaths_per_min: 13.0, ..BODY }, 60.0);
    assert!((slow.unwrap().rate_per_min.value - 13.0).abs() < 1.0);
}

#[test]
fn without_a_common_rhythm_there_is_no_rate() {
    let body = Body { arrhythmia: 0.0, pressure_waves: 0.0, amplitude: 0.0, noise: 0.1, ..BODY };
    let found = |length_secs| {
        (1..=100).filter(|&seed| of_beats(Body { seed, ..body }, length_secs).is_ok()).count()
    };
    // Chance has its share: noise may have one rhythm for 30 s, rarely for longer.
    let found = [30.0, 60.0, 120.0].map(found);
    assert!(found[0] <= 20 && found[1] <= 4 && found[2] <= 1, "{found:?}");
}

#[test]
fn a_premature_beat_does_not_matter() {
    let Beats { mut times_secs, mut amplitudes, .. } = beats(BODY, 60.0);
    times_secs[30] -= 0.3;
    amplitudes[30] = 2.5;
    let derived = rate_from_beats(&times_secs, &amplitudes, 0.0..60.0).unwrap();
    assert!((derived.rate_per_min.value - 15.0).abs() < 0.7, "{derived:?}");
}

#[test]
fn what_cannot_be_reported_has_its_reason() {
    let Beats { times_secs, amplitudes, .. } = beats(BODY, 60.0);
    let reported =
        |times: &[f64], amplitudes: &[f64], length| rate_from_beats(times, amplitudes, 0.0..length);
    assert_eq!(reported(&times_secs, &amplitudes, 20.0), Err(Reason::Short));
    assert_eq!(reported(&times_secs, &amplitudes, f64::NAN), Err(Reason::Short));
    assert_eq!(reported(&times_secs, &amplitudes, f64::INFINITY), Err(Reason::Short));
    assert_eq!(reported(&times_secs, &amplitudes, 1e12), Err(Reason::Gap));
    assert_eq!(reported(&times_secs, &[], 60.0), Err(Reason::Missing));
    assert_eq!(reported(&times_secs, &[f64::NAN; 70], 60.0), Err(Reason::Missing));
    assert_eq!(reported(&[], &[], 60.0), Err(Reason::Gap));
    assert_eq!(reported(&times_secs[..20], &amplitudes, 60.0), Err(Reason::Gap));
    let even: Vec<f64> = (0..70).map(|k| f64::from(k) * 0.8).collect();
    assert_eq!(reported(&even, &[1.0; 70], 56.0), Err(Reason::Quality));
}

#[test]
fn the_unit_of_amplitudes_and_the_beginning_of_time_do_not_matter() {
    let Beats { times_secs, amplitudes, .. } = beats(BODY, 60.0);
    let one = rate_from_beats(&times_secs, &amplitudes, 0.0..60.0).unwrap();
    let later: Vec<f64> = times_secs.iter().map(|secs| secs + 1e6).collect();
    let millis: Vec<f64> = amplitudes.iter().map(|each| 1e3 * each - 7.0).collect();
    let other = rate_from_beats(&later, &millis, 1e6..1e6 + 60.0).unwrap();
    assert!((one.rate_per_min.value - other.rate_per_min.value).abs() < 1e-6);
    assert!((one.rate_per_min.sigma - other.rate_per_min.sigma).abs() < 1e-4);
}

proptest! {
    #[test]
    fn any_numbers_give_a_rate_or_a_reason(
        times in prop::collection::vec(prop::num::f64::ANY, 0..80),
        others in prop::collection::vec(prop::num::f64::ANY, 0..80),
        window in (prop::num::f64::ANY, prop::num::f64::ANY),
    ) {
        let even: Vec<f64> = (0..80).map(|k| f64::from(k) * 0.8).collect();
        let derived = [
            rate_from_beats(&times, &others, window.0..window.1),
            rate_from_beats(&even, &others, 0.0..60.0),
            rate_from_pulses(&even, &others, &times, 0.0..64.0),
        ];
        for derived in derived.into_iter().flatten() {
            prop_assert!((4.0..=45.0).contains(&derived.rate_per_min.value));
            prop_assert!(derived.rate_per_min.sigma >= 0.0);
            prop_assert!((0.0..=1.0).contains(&derived.clarity));
        }
    }
}
