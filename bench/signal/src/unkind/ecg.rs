//! Synthetic ECGs that are hard to analyse.

use std::f64::consts::TAU;

use super::heart::{Beat, SECS, add_beat, add_wave, cycle_secs, ecg, narrow, rhythm, wide};
use super::noise::{add, deviation, hum, mains_wander, mixed, pink, wander, white};
use super::random::Random;
use super::{Make, Unkind};

pub const KINDS: [(&str, Make); 24] = [
    ("ecg plain", plain),
    ("ecg rail", rail),
    ("ecg electrode steps", steps),
    ("ecg alternating heights", alternating),
    ("ecg bigeminy, wide", bigeminy),
    ("ecg heights swing", swinging),
    ("ecg slow", slow),
    ("ecg fast", fast),
    ("ecg samples missing", missing),
    ("ecg pauses", pauses),
    ("ecg mains only", mains_only),
    ("ecg no heart", no_heart),
    ("ecg cadence", cadence),
    ("ecg inverted", inverted),
    ("ecg 1/f noise -3 dB", pink_noise),
    ("ecg wander 3 mV", wandering),
    ("ecg saturated", saturated),
    ("ecg muscles", muscles),
    ("ecg fibrillation", fibrillation),
    ("ecg high T waves", high_t),
    ("ecg hum", humming),
    ("ecg electrode off", electrode_off),
    ("ecg paced", paced),
    ("ecg quantized", quantized),
];

pub fn usual_rate(random: &mut Random) -> f64 {
    random.within(48.0..110.0)
}

/// Makes an ECG with a rate and noise typical of devices, and a little wander.
pub fn of(
    random: &mut Random,
    kind: &'static str,
    rate_hz: f64,
    signal: Vec<f64>,
    beats_secs: Vec<f64>,
) -> Unkind {
    let mut signal = signal;
    let (fast, slow) = (white(random, signal.len()), wander(random, signal.len(), rate_hz));
    add(&mut signal, &fast, random.within(0.002..0.02));
    add(&mut signal, &slow, random.within(0.0..0.3));
    Unkind::new(kind, rate_hz, signal, beats_secs)
}

pub fn device_hz(random: &mut Random) -> f64 {
    random.one_of(&[125.0, 130.0, 200.0, 250.0, 256.0, 360.0, 500.0])
}

pub fn beating(random: &mut Random, kind: &'static str, rate_per_min: f64) -> Unkind {
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate_per_min));
    let form = narrow(random);
    of(random, kind, rate_hz, ecg(rate_hz, &beats, &form, |_| 1.0), beats)
}

pub fn plain(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(45.0..180.0);
    beating(random, kind, rate)
}

fn rail(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(40.0..220.0);
    let mut made = beating(random, kind, rate);
    let count = random.one_of(&[1, 1, 2, 3]);
    for number in 0..count {
        let begin = SECS * (0.1 + 0.8 * (f64::from(number) + random.share()) / f64::from(count));
        let secs = random.within(0.05..1.2);
        let level = random.sign() * random.one_of(&[3.3, 5.0, 10.0, 30.0, 400.0]);
        made.over(begin, secs, |value| *value = level);
        made.glitches_secs.push((begin, begin + secs));
    }
    made
}

fn steps(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    for _ in 0..random.one_of(&[2, 5, 10]) {
        let (at, height) =
            (random.within(5.0..SECS - 5.0), random.sign() * random.within(1.0..15.0));
        let decay = random.within(0.05..1.5);
        let rate_hz = made.rate_hz;
        for (k, value) in made.signal.iter_mut().enumerate().skip((at * rate_hz) as usize) {
            *value += height * (-(k as f64 / rate_hz - at) / decay).exp();
        }
        made.glitches_secs.push((at, at + 0.05));
    }
    made
}

fn alternating(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..150.0);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let (form, low) = (narrow(random), random.within(0.25..0.7));
    let signal = ecg(rate_hz, &beats, &form, |place| if place % 2 == 0 { 1.0 } else { low });
    of(random, kind, rate_hz, signal, beats)
}

fn bigeminy(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(60.0..110.0);
    let (rate_hz, mut beats) = (device_hz(random), rhythm(random, rate));
    let form = narrow(random);
    let other = wide(random, form.qrs[1].0);
    let each = random.one_of(&[2usize, 2, 3]);
    let early = random.within(0.15..0.35);
    for place in 1..beats.len() {
        if place % each == each - 1 {
            beats[place] -= early * (beats[place] - beats[place - 1]);
        }
    }
    let mut signal = vec![0.0; (SECS * rate_hz) as usize];
    for (place, &at_secs) in beats.iter().enumerate() {
        let form = if place % each == each - 1 { &other } else { &form };
        let beat = Beat { at_secs, cycle_secs: cycle_secs(&beats, place), gain: 1.0 };
        add_beat(&mut signal, rate_hz, beat, form);
    }
    of(random, kind, rate_hz, signal, beats)
}

fn swinging(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let (form, depth, hz) = (narrow(random), random.within(0.3..0.75), random.within(0.1..0.4));
    let gain = |place: usize| 1.0 + depth * (TAU * hz * beats[place]).sin();
    let signal = ecg(rate_hz, &beats, &form, gain);
    of(random, kind, rate_hz, signal, beats.clone())
}

fn slow(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(25.0..45.0);
    beating(random, kind, rate)
}

fn fast(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(180.0..250.0);
    beating(random, kind, rate)
}

fn missing(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(50.0..130.0);
    let mut made = beating(random, kind, rate);
    let hides = random.within(0.05..0.4);
    for at in made.beats_secs.clone() {
        let secs = random.within(0.03..0.1);
        let at =
            if random.share() < hides { at - secs * random.within(0.3..0.7) } else { at + 0.3 };
        if random.share() < 0.7 {
            made.over(at, secs, |value| *value = f64::NAN);
        }
    }
    // Beats that are missing in the data can be interpolated, but not in every pattern.
    made.is_fair = hides < 0.15;
    made
}

fn pauses(random: &mut Random, kind: &'static str) -> Unkind {
    let (rate_hz, rate) = (device_hz(random), usual_rate(random));
    let mut beats = rhythm(random, rate);
    for _ in 0..random.one_of(&[1, 2, 4]) {
        let (from, secs) = (random.within(10.0..SECS - 15.0), random.within(3.1..7.0));
        beats.retain(|&at| at < from || at > from + secs);
    }
    let form = narrow(random);
    let mut signal = vec![0.0; (SECS * rate_hz) as usize];
    for &at_secs in &beats {
        let beat = Beat { at_secs, cycle_secs: 60.0 / rate, gain: 1.0 };
        add_beat(&mut signal, rate_hz, beat, &form);
    }
    let mut made = of(random, kind, rate_hz, signal, beats);
    made.is_fair = false;
    made
}

fn mains_only(random: &mut Random, kind: &'static str) -> Unkind {
    let rate_hz = device_hz(random);
    let count = (SECS * rate_hz) as usize;
    let slow = random.within(0.8..10.0);
    let hz = random.one_of(&[50.0, 60.0, slow]);
    let mut signal = hum(random, count, rate_hz, hz, mains_wander(hz));
    let third = hum(random, count, rate_hz, 3.0 * hz, mains_wander(hz));
    add(&mut signal, &third, 0.2);
    of(random, kind, rate_hz, signal, Vec::new())
}

fn no_heart(random: &mut Random, kind: &'static str) -> Unkind {
    let rate_hz = device_hz(random);
    let count = (SECS * rate_hz) as usize;
    let signal = mixed(random, count, 2.0);
    of(random, kind, rate_hz, signal, Vec::new())
}

/// Makes an ECG with steps that look like damped oscillations of an electrode.
fn cadence(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(70.0..170.0);
    let mut made = beating(random, kind, rate);
    let (cadence_hz, height) = (random.within(1.4..3.0), random.within(0.3..2.0));
    let (width, other) = (random.within(0.02..0.06), random.within(-0.8..0.8));
    let mut at = random.share();
    while at < SECS {
        let gain = height * (1.0 + 0.15 * random.normal());
        add_wave(&mut made.signal, made.rate_hz, at, gain, width);
        add_wave(&mut made.signal, made.rate_hz, at + 2.5 * width, gain * other, width);
        at += (1.0 + 0.02 * random.normal()) / cadence_hz;
    }
    made.is_fair = height < 0.5 && width > 0.04;
    made
}

fn inverted(random: &mut Random, kind: &'static str) -> Unkind {
    let mut made = plain(random, kind);
    made.signal.iter_mut().for_each(|value| *value = -*value);
    made
}

fn pink_noise(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let size = deviation(&made.signal);
    let noise = pink(random, made.signal.len());
    add(&mut made.signal, &noise, size * 10f64.powf(random.within(0.0..6.0) / 20.0));
    made.is_fair = false;
    made
}

fn wandering(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let slow = wander(random, made.signal.len(), made.rate_hz);
    add(&mut made.signal, &slow, random.within(1.0..5.0));
    made
}

fn saturated(random: &mut Random, kind: &'static str) -> Unkind {
    let mut made = wandering(random, kind);
    let (low, high) = (random.within(-2.5..-0.5), random.within(0.3..2.5));
    made.signal.iter_mut().for_each(|value| *value = value.clamp(low, high));
    made.is_fair = low < -1.5 && high > 1.8;
    made
}

fn muscles(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let noise = white(random, made.signal.len());
    let (height, rate_hz) = (random.within(0.05..0.8), made.rate_hz);
    let period = random.within(5.0..40.0);
    for (k, value) in made.signal.iter_mut().enumerate() {
        let on = (TAU * k as f64 / rate_hz / period).sin() > 0.2;
        *value += if on { height * noise[k] } else { 0.0 };
    }
    made.is_fair = height < 0.2;
    made
}

fn fibrillation(random: &mut Random, kind: &'static str) -> Unkind {
    let rate_hz = device_hz(random);
    let mean = 60.0 / random.within(60.0..150.0);
    let (mut at, mut beats) = (0.4, Vec::new());
    while at < SECS - 0.3 {
        beats.push(at);
        at += (mean * (1.0 + 0.22 * random.normal())).clamp(0.3, 2.0);
    }
    let mut form = narrow(random);
    form.p.0 = 0.0;
    let heights: Vec<f64> = beats.iter().map(|_| 1.0 + 0.08 * random.normal()).collect();
    let signal = ecg(rate_hz, &beats, &form, |place| heights[place]);
    of(random, kind, rate_hz, signal, beats)
}

fn high_t(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let mut form = narrow(random);
    form.t.0 = form.qrs[1].0 * random.within(0.5..1.3);
    form.t.2 = random.within(0.035..0.05);
    of(random, kind, rate_hz, ecg(rate_hz, &beats, &form, |_| 1.0), beats)
}

fn humming(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let hz = random.one_of(&[50.0, 60.0]);
    let noise = hum(random, made.signal.len(), made.rate_hz, hz, 0.001);
    let height = random.within(0.05..1.0);
    add(&mut made.signal, &noise, height);
    made.is_fair = height < 0.3;
    made
}

fn electrode_off(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let (begin, secs) = (random.within(10.0..60.0), random.within(5.0..50.0));
    let noise = pink(random, made.signal.len());
    let (height, level) = (random.within(0.02..1.0), random.within(-2.0..2.0));
    let mut next = 0;
    made.over(begin, secs, |value| {
        *value = level + height * noise[next];
        next += 1;
    });
    made.is_fair = false;
    made.glitches_secs.push((begin, begin + secs));
    made
}

/// Makes an ECG with a pacemaker spike before each wide beat.
fn paced(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = random.within(55.0..90.0);
    let (rate_hz, beats) = (device_hz(random), rhythm(random, rate));
    let mut form = wide(random, 1.0);
    form.t.0 *= 0.7;
    let mut signal = ecg(rate_hz, &beats, &form, |_| 1.0);
    let (height, before) = (random.sign() * random.within(0.5..4.0), random.within(0.06..0.1));
    for &at in &beats {
        add_wave(&mut signal, rate_hz, at - before, height, 0.6 / rate_hz);
    }
    of(random, kind, rate_hz, signal, beats)
}

fn quantized(random: &mut Random, kind: &'static str) -> Unkind {
    let mut made = plain(random, kind);
    let step = random.within(0.02..0.25);
    made.signal.iter_mut().for_each(|value| *value = (*value / step).round() * step);
    made.is_fair = step < 0.12;
    made
}
