//! Disturbances of sensors: motion, and loss of contact.

use std::f64::consts::TAU;

type Disturb = fn(&mut [f64], f64, f64, usize);

/// Each disturbance changes a span of a signal at a rate [Hz] with pulses of an amplitude; the turn makes each one
/// different from the next.
pub const DISTURBANCES: [(&str, Disturb); 7] = [
    ("arm swings", swing),
    ("noise like of an accelerometer", shake),
    ("steps", step),
    ("held value", hold),
    ("a little noise instead of the signal", hiss),
    ("saturation", saturate),
    ("missing samples", lose),
];

/// Returns pseudo-random numbers between −1 and 1.
fn random(place: usize, turn: usize) -> f64 {
    let mixed = (place as u64 + 1)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(turn as u64 * 0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Adds six waves between 0.6 and 4 Hz, together one to four times as high as the pulses.
fn swing(span: &mut [f64], rate_hz: f64, amplitude: f64, turn: usize) {
    let height = amplitude * (1.0 + turn as f64);
    for wave in 0..6 {
        let hz = 2.3 + 1.7 * random(wave, turn);
        let (phase, share) = (TAU * random(wave + 10, turn), 0.65 + 0.35 * random(wave + 20, turn));
        for (k, value) in span.iter_mut().enumerate() {
            *value += height * share / 2.0 * (TAU * hz * k as f64 / rate_hz + phase).sin();
        }
    }
}

/// Adds noise with two corner frequencies: a walk that is pulled back, twice as high as the pulses.
fn shake(span: &mut [f64], rate_hz: f64, amplitude: f64, turn: usize) {
    let (slow, fast) = (TAU * 0.7 / rate_hz, (TAU * 4.0 / rate_hz).min(1.0));
    let (mut walk, mut drift) = (0.0, 0.0);
    for (k, value) in span.iter_mut().enumerate() {
        walk += fast * (random(k, turn) - walk);
        drift += slow * (walk - drift);
        *value += 2.0 * amplitude * (walk - drift) / fast.sqrt() * 1.7;
    }
}

/// Adds a step of two to four amplitudes, up or down, about every 0.6 s.
fn step(span: &mut [f64], rate_hz: f64, amplitude: f64, turn: usize) {
    let each = (0.6 * rate_hz) as usize;
    let mut level = 0.0;
    for (index, part) in span.chunks_mut(each).enumerate() {
        let draw = random(index, turn);
        level += amplitude * (2.0 * draw.signum() + 2.0 * draw);
        for value in part {
            *value += level;
        }
    }
}

fn hold(span: &mut [f64], _: f64, _: f64, _: usize) {
    let held = span[0];
    span.fill(held);
}

fn hiss(span: &mut [f64], _: f64, amplitude: f64, turn: usize) {
    let level = span[0] - 3.0 * amplitude;
    for (k, value) in span.iter_mut().enumerate() {
        *value = level + 0.02 * amplitude * random(k, turn);
    }
}

/// Lifts the signal until the upper half of the pulses is cut off.
fn saturate(span: &mut [f64], _: f64, amplitude: f64, _: usize) {
    let mut sorted = span.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let middle = sorted[0].midpoint(sorted[sorted.len() - 1]);
    for value in span {
        *value = value.min(middle) + 3.0 * amplitude;
    }
}

fn lose(span: &mut [f64], _: f64, _: f64, _: usize) {
    span.fill(f64::NAN);
}
