//! Synthetic PPGs that are hard to analyse.

use std::f64::consts::TAU;
use std::ops::Range;

use super::heart::{SECS, Wave, add_wave, ppg, rhythm};
use super::noise::{add, deviation, hum, mains_wander, mixed, pink, wander, white};
use super::random::Random;
use super::{Make, Unkind};

pub const KINDS: [(&str, Make); 16] = [
    ("ppg plain", plain),
    ("ppg strong diastolic wave", strong),
    ("ppg fast", fast),
    ("ppg mains only", mains_only),
    ("ppg no pulse", no_pulse),
    ("ppg cadence", cadence),
    ("ppg inverted", inverted),
    ("ppg alternating heights", alternating),
    ("ppg bigeminy", bigeminy),
    ("ppg heights swing", swinging),
    ("ppg samples missing", missing),
    ("ppg wander", wandering),
    ("ppg saturated", saturated),
    ("ppg bursts of motion", bursts),
    ("ppg 1/f noise", pink_noise),
    ("ppg steps", steps),
];

fn device_hz(random: &mut Random) -> f64 {
    random.one_of(&[25.0, 32.0, 50.0, 64.0, 100.0, 125.0])
}

fn of(
    random: &mut Random,
    kind: &'static str,
    rate_hz: f64,
    signal: Vec<f64>,
    beats_secs: Vec<f64>,
) -> Unkind {
    let mut signal = signal;
    let (fast, slow) = (white(random, signal.len()), wander(random, signal.len(), rate_hz));
    add(&mut signal, &fast, random.within(0.002..0.03));
    add(&mut signal, &slow, random.within(0.0..0.5));
    let mut made = Unkind::new(kind, rate_hz, signal, beats_secs);
    made.is_ppg = true;
    made
}

/// Makes a wave whose second crest does not stand out much.
fn usual_wave(random: &mut Random) -> Wave {
    wave(random, 0.15..0.5, 0.27..0.36)
}

/// Makes a wave as sharp or as round as recorded ones.
fn wave(random: &mut Random, dicrotic: Range<f64>, after: Range<f64>) -> Wave {
    let rise = random.within(0.04..0.12);
    let fall = rise * random.within(1.0..2.0);
    Wave { rise, fall, dicrotic: random.within(dicrotic), after: random.within(after) }
}

fn beating(random: &mut Random, kind: &'static str, rate_per_min: f64) -> Unkind {
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate_per_min));
    let wave = usual_wave(random);
    of(random, kind, rate_hz, ppg(rate_hz, &beats, &wave, |_| 1.0), beats)
}

pub fn plain(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(45.0..170.0);
    beating(random, kind, rate)
}

fn strong(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(38.0..75.0);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let wave = wave(random, 0.4..0.9, 0.35..0.48);
    of(random, kind, rate_hz, ppg(rate_hz, &beats, &wave, |_| 1.0), beats)
}

fn fast(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(170.0..240.0);
    beating(random, kind, rate)
}

fn mains_only(random: &mut Random, kind: &'static str) -> Unkind {
    let rate_hz = device_hz(random);
    let count = (SECS * rate_hz) as usize;
    let hz = random.within(0.6..4.0);
    let signal = hum(random, count, rate_hz, hz, mains_wander(hz));
    of(random, kind, rate_hz, signal, Vec::new())
}

fn no_pulse(random: &mut Random, kind: &'static str) -> Unkind {
    let rate_hz = device_hz(random);
    let count = (SECS * rate_hz) as usize;
    let signal = mixed(random, count, 1.0);
    of(random, kind, rate_hz, signal, Vec::new())
}

fn cadence(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(60.0..170.0);
    let mut made = beating(random, kind, rate);
    let (cadence_hz, height) = (random.within(1.3..3.0), random.within(0.2..4.0));
    let (phase, second) = (random.share(), random.within(0.0..0.5));
    let (mut turn, rate_hz) = (phase * TAU, made.rate_hz);
    for value in &mut made.signal {
        turn += TAU * cadence_hz / rate_hz * (1.0 + 0.2 * random.normal());
        *value += height / 2.0 * (turn.sin() + second * (2.0 * turn + phase).sin());
    }
    made.is_fair = height < 0.4;
    made
}

fn inverted(random: &mut Random, kind: &'static str) -> Unkind {
    let mut made = plain(random, kind);
    made.signal.iter_mut().for_each(|value| *value = -*value);
    made.is_fair = false;
    made
}

fn alternating(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(55.0..130.0);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let (wave, low) = (usual_wave(random), random.within(0.4..0.8));
    let signal = ppg(rate_hz, &beats, &wave, |place| if place % 2 == 0 { 1.0 } else { low });
    let mut made = of(random, kind, rate_hz, signal, beats);
    made.is_fair = low > 0.6;
    made
}

fn bigeminy(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(60.0..100.0);
    let (rate_hz, mut beats) = (device_hz(random), rhythm(random, rate));
    let (wave, low) = (usual_wave(random), random.within(0.15..0.8));
    let early = random.within(0.15..0.35);
    for place in (1..beats.len()).step_by(2) {
        beats[place] -= early * (beats[place] - beats[place - 1]);
    }
    let signal = ppg(rate_hz, &beats, &wave, |place| if place % 2 == 0 { 1.0 } else { low });
    let mut made = of(random, kind, rate_hz, signal, beats);
    made.is_fair = false;
    made
}

fn swinging(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let (wave, depth, hz) = (usual_wave(random), random.within(0.2..0.7), random.within(0.1..0.4));
    let signal = ppg(rate_hz, &beats, &wave, |place| 1.0 + depth * (TAU * hz * beats[place]).sin());
    let mut made = of(random, kind, rate_hz, signal, beats.clone());
    made.is_fair = depth < 0.4;
    made
}

fn missing(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let mut made = beating(random, kind, rate);
    for at in made.beats_secs.clone() {
        let secs = random.within(0.03..0.1);
        if random.share() < 0.5 {
            made.over(at + random.within(-0.3..0.3), secs, |value| *value = f64::NAN);
        }
    }
    made
}

fn wandering(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let mut made = beating(random, kind, rate);
    let slow = wander(random, made.signal.len(), made.rate_hz);
    add(&mut made.signal, &slow, random.within(1.0..8.0));
    made.is_fair = false;
    made
}

fn saturated(random: &mut Random, kind: &'static str) -> Unkind {
    let mut made = wandering(random, kind);
    let (low, high) = (random.within(-2.5..-0.3), random.within(0.3..2.5));
    made.signal.iter_mut().for_each(|value| *value = value.clamp(low, high));
    made
}

fn bursts(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..150.0);
    let mut made = beating(random, kind, rate);
    for _ in 0..random.one_of(&[2, 6, 15]) {
        let begin = random.within(0.0..SECS);
        for _ in 0..random.one_of(&[3, 8, 20]) {
            let (at, width) = (begin + random.within(0.0..6.0), random.within(0.05..0.4));
            let height = random.sign() * random.within(0.3..4.0);
            add_wave(&mut made.signal, made.rate_hz, at, height, width);
        }
    }
    made.is_fair = false;
    made
}

fn pink_noise(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let mut made = beating(random, kind, rate);
    let size = deviation(&made.signal);
    let noise = pink(random, made.signal.len());
    add(&mut made.signal, &noise, size * 10f64.powf(random.within(-12.0..6.0) / 20.0));
    made.is_fair = false;
    made
}

fn steps(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let mut made = beating(random, kind, rate);
    for _ in 0..random.one_of(&[1, 3, 8]) {
        let (at, height) =
            (random.within(5.0..SECS - 5.0), random.sign() * random.within(1.0..30.0));
        let from = (at * made.rate_hz) as usize;
        made.signal[from..].iter_mut().for_each(|value| *value += height);
        made.glitches_secs.push((at, at + 0.1));
    }
    made.is_fair = false;
    made
}
