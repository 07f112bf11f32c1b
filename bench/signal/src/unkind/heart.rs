//! Heartbeats, and how electrodes and light record them.

use std::f64::consts::TAU;

use super::random::Random;

/// The length of each signal [s].
pub const SECS: f64 = 120.0;

/// Makes the times of beats at a mean rate [1/min] whose intervals vary with breathing, slow waves and chance.
pub fn rhythm(random: &mut Random, rate_per_min: f64) -> Vec<f64> {
    let (breath_hz, breath) = (random.within(0.15..0.35), random.within(0.005..0.05));
    let (slow_hz, slow) = (random.within(0.06..0.12), random.within(0.0..0.03));
    let chance = random.within(0.003..0.015);
    // Fast hearts vary little.
    let depth = (80.0 / rate_per_min).min(1.0);
    let mut at_secs = random.within(0.2..1.0);
    let mut times = Vec::new();
    while at_secs < SECS - 0.3 {
        times.push(at_secs);
        let waves =
            breath * (TAU * breath_hz * at_secs).sin() + slow * (TAU * slow_hz * at_secs).sin();
        at_secs += 60.0 / rate_per_min * (1.0 + depth * (waves + chance * random.normal()));
    }
    times
}

/// The form of a beat in an ECG: waves with a height [mV], a time from the main deflection [s] and a standard deviation
/// [s].
#[derive(Clone)]
pub struct Form {
    pub qrs: Vec<(f64, f64, f64)>,
    pub p: (f64, f64, f64),
    pub t: (f64, f64, f64),
}

/// Makes a narrow beat.
pub fn narrow(random: &mut Random) -> Form {
    let width = random.within(0.008..0.014);
    let r = random.within(0.7..1.6);
    Form {
        qrs: vec![
            (-r * random.within(0.0..0.15), -2.6 * width, 0.8 * width),
            (r, 0.0, width),
            (-r * random.within(0.05..0.45), 2.6 * width, width),
        ],
        p: (r * random.within(0.05..0.15), -0.16, 0.02),
        t: (r * random.within(0.1..0.4), 0.27, 0.045),
    }
}

/// Makes a wide beat without a P wave and with an inverted T wave.
pub fn wide(random: &mut Random, r: f64) -> Form {
    let (width, height) = (random.within(0.025..0.05), r * random.within(0.8..1.8));
    Form {
        qrs: vec![(height, 0.0, width), (-height * random.within(0.0..0.6), 2.4 * width, width)],
        p: (0.0, -0.16, 0.02),
        t: (-height * random.within(0.2..0.45), 0.32, 0.05),
    }
}

/// The time of a beat [s], the length of its cycle [s], and its height as a multiple of its form's.
#[derive(Clone, Copy)]
pub struct Beat {
    pub at_secs: f64,
    pub cycle_secs: f64,
    pub gain: f64,
}

/// Adds a beat; the waves before and after the QRS complex are closer to it when beats follow fast.
pub fn add_beat(signal: &mut [f64], rate_hz: f64, beat: Beat, form: &Form) {
    let Beat { at_secs, cycle_secs, gain } = beat;
    let pull = cycle_secs.clamp(0.22, 1.2).sqrt();
    for &(height, secs, width) in &form.qrs {
        add_wave(signal, rate_hz, at_secs + secs, gain * height, width);
    }
    let (height, secs, width) = form.t;
    add_wave(signal, rate_hz, at_secs + secs * pull, gain * height, width * pull);
    let (height, secs, width) = form.p;
    if cycle_secs > 0.35 {
        add_wave(signal, rate_hz, at_secs + secs * pull.min(1.0), gain * height, width);
    }
}

pub fn add_wave(signal: &mut [f64], rate_hz: f64, at_secs: f64, height: f64, width_secs: f64) {
    add_sides(signal, rate_hz, at_secs, height, (width_secs, width_secs));
}

/// Adds a wave whose width before its crest differs from the one after it [s].
fn add_sides(
    signal: &mut [f64],
    rate_hz: f64,
    at_secs: f64,
    height: f64,
    (rise_secs, fall_secs): (f64, f64),
) {
    let (from, to) = (at_secs - 4.5 * rise_secs, at_secs + 4.5 * fall_secs);
    let end = ((to * rate_hz).ceil().max(0.0) as usize).min(signal.len());
    let begin = ((from * rate_hz).floor().max(0.0) as usize).min(end);
    for (k, value) in signal[begin..end].iter_mut().enumerate() {
        let secs = (begin + k) as f64 / rate_hz - at_secs;
        let width_secs = if secs < 0.0 { rise_secs } else { fall_secs };
        *value += height * (-(secs / width_secs).powi(2) / 2.0).exp();
    }
}

/// Makes an ECG of beats that differ only in height.
pub fn ecg(rate_hz: f64, beats_secs: &[f64], form: &Form, gain: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut signal = vec![0.0; (SECS * rate_hz) as usize];
    for (place, &at_secs) in beats_secs.iter().enumerate() {
        let beat = Beat { at_secs, cycle_secs: cycle_secs(beats_secs, place), gain: gain(place) };
        add_beat(&mut signal, rate_hz, beat, form);
    }
    signal
}

/// Returns the time from a beat to the next one, or else since the one before [s].
pub fn cycle_secs(beats_secs: &[f64], place: usize) -> f64 {
    let secs = |place: usize| Some(beats_secs.get(place + 1)? - beats_secs.get(place)?);
    secs(place).or_else(|| secs(place.checked_sub(1)?)).unwrap_or(0.8)
}

/// A pulse wave: how fast its systolic wave rises and falls, the height of its diastolic wave, and how long after the
/// systolic one that comes, at most 0.45 s even in slow cycles. Times are for a cycle of 1 s [s].
pub struct Wave {
    /// The standard deviations of the front and of the back of the systolic wave.
    pub rise: f64,
    pub fall: f64,
    pub dicrotic: f64,
    pub after: f64,
}

/// Makes a PPG whose pulses arrive at the times of their beats.
pub fn ppg(rate_hz: f64, beats_secs: &[f64], wave: &Wave, gain: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut signal = vec![0.0; (SECS * rate_hz) as usize];
    for (place, &at_secs) in beats_secs.iter().enumerate() {
        let cycle = cycle_secs(beats_secs, place);
        let (height, pull) = (gain(place), cycle.clamp(0.2, 1.6));
        // Systole lasts nearly as long at any rate; the remainder of the cycle adapts.
        let width = |secs: f64| (secs * pull.sqrt()).min(0.17 * cycle);
        let (rise, fall) = (width(wave.rise), width(wave.fall));
        add_sides(&mut signal, rate_hz, at_secs, height, (rise, fall));
        let after = (wave.after * pull.sqrt()).min(0.45);
        add_wave(&mut signal, rate_hz, at_secs + after, height * wave.dicrotic, 1.2 * fall);
    }
    signal
}
