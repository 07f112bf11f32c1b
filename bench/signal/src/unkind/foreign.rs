//! ECGs with foreign components: another heart, clicks, intermittent contacts.

use super::ecg::{beating, device_hz, of, usual_rate};
use super::heart::{Beat, SECS, add_beat, add_wave, cycle_secs, ecg, narrow, rhythm};
use super::random::Random;
use super::{Make, Unkind};

/// Each kind with the share of windows that may be trusted and wrong; there is no such bar if the foreign component
/// keeps a steady pace like a heart.
pub const KINDS: [(&str, Make, Option<f64>); 4] = [
    ("ecg second heart", second_heart, None),
    ("ecg clicks at random", random_clicks, Some(0.005)),
    ("ecg clicks at a pace", paced_clicks, None),
    ("ecg contact plateaus", plateaus, Some(0.005)),
];

/// Makes an ECG with the heart of a neighbour, or of a child before birth, lower than the measured one.
fn second_heart(random: &mut Random, kind: &'static str) -> Unkind {
    let (rate, rate_hz) = (usual_rate(random), device_hz(random));
    let beats = rhythm(random, rate);
    let (form, mut other) = (narrow(random), narrow(random));
    let mut other_rate = random.within(50.0..170.0);
    if (other_rate / rate - 1.0).abs() < 0.15 {
        other_rate = 1.4 * rate;
    }
    let (height, sign) = (random.within(0.2..0.9), random.sign());
    for wave in other.qrs.iter_mut().chain([&mut other.p, &mut other.t]) {
        wave.0 *= sign;
    }
    let gain = height * form.qrs[1].0 / other.qrs[1].0.abs();
    let mut signal = ecg(rate_hz, &beats, &form, |_| 1.0);
    let others = rhythm(random, other_rate);
    for (place, &at_secs) in others.iter().enumerate() {
        let beat = Beat { at_secs, cycle_secs: cycle_secs(&others, place), gain };
        add_beat(&mut signal, rate_hz, beat, &other);
    }
    let mut made = of(random, kind, rate_hz, signal, beats);
    made.is_fair = height < 0.25;
    made
}

/// Makes clicks of 5 to 15 ms, from half to several times as high as a beat.
fn clicking(random: &mut Random, kind: &'static str, next: impl Fn(&mut Random) -> f64) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let height = random.sign() * 0.4 * 8f64.powf(random.share());
    let (width, spread) = (random.within(0.001..0.004), random.within(0.0..0.3));
    let mut at = random.within(0.2..1.2);
    while at < SECS {
        let gain = height * (1.0 + spread * random.normal());
        add_wave(&mut made.signal, made.rate_hz, at, gain, width.max(0.4 / made.rate_hz));
        at += next(random);
    }
    made.is_fair = false;
    made
}

fn random_clicks(random: &mut Random, kind: &'static str) -> Unkind {
    let mean_secs = random.within(0.7..5.0);
    clicking(random, kind, |random| 0.1 - mean_secs * (1.0 - random.share()).ln())
}

fn paced_clicks(random: &mut Random, kind: &'static str) -> Unkind {
    let period_secs = random.within(0.35..2.5);
    clicking(random, kind, |random| period_secs * (1.0 + 0.002 * random.normal()))
}

/// Makes electrodes that rest at another level for a moment.
fn plateaus(random: &mut Random, kind: &'static str) -> Unkind {
    let rate = usual_rate(random);
    let mut made = beating(random, kind, rate);
    let (height, mean_secs) = (random.within(0.3..3.0), random.within(1.0..6.0));
    let mut at = random.within(0.2..3.0);
    while at < SECS {
        let (secs, level) = (random.within(0.3..1.0), random.sign() * height);
        made.over(at, secs, |value| *value += level);
        at += secs + 0.2 - mean_secs * (1.0 - random.share()).ln();
    }
    made.is_fair = false;
    made
}
