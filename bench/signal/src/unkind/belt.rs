//! Belts that record more than the breath: steps, heartbeats, and rectified breath.

use std::error::Error;
use std::f64::consts::TAU;

use teampulse_signal::analysis::{Recording, Span, Windows};
use teampulse_signal::respiration::analysis::{Settings, causal, whole};

use super::Seeds;
use super::noise::{add, white};
use super::random::Random;
use super::windows::How;

const RATE_HZ: f64 = 25.0;
const SECS: f64 = 120.0;
const WINDOW_SECS: f64 = 60.0;
/// The quality above which a rate is trusted, and the relative error above which it is wrong.
const TRUSTED: f64 = 0.8;
const TOLERANCE: f64 = 0.1;

/// A belt whose breathing rate is known.
struct Belt {
    signal: Vec<f64>,
    rate_per_min: f64,
}

type Make = fn(&mut Random) -> Belt;

/// The largest number of trusted and wrong windows, and the smallest number of trusted and right ones, per hundred
/// windows.
#[derive(Clone, Copy)]
struct Bar {
    most_wrong: u64,
    least_right: u64,
}

/// Kinds in which the breath is the largest component have a bar; in the others, a single belt can seldom distinguish
/// it from larger components.
const KINDS: [(&str, Make, Option<Bar>); 6] = [
    (
        "breath alone",
        |random| breathing(random, 8.0..30.0),
        Some(Bar { most_wrong: 1, least_right: 95 }),
    ),
    ("motion above the breath", moving, None),
    ("rectified", rectified, None),
    (
        "heart beside fast breath",
        |random| with_heart(random, 25.0..42.0, 50.0..80.0),
        Some(Bar { most_wrong: 1, least_right: 0 }),
    ),
    (
        "slow heart beside slow breath",
        |random| with_heart(random, 8.0..20.0, 40.0..55.0),
        Some(Bar { most_wrong: 1, least_right: 0 }),
    ),
    ("motion without a breath", still, None),
];

/// Makes breaths with pauses that vary in length and depth.
fn breathing(random: &mut Random, rates_per_min: std::ops::Range<f64>) -> Belt {
    let rate = random.within(rates_per_min);
    let (chance, depth, inhalation) =
        (random.within(0.01..0.08), random.within(0.0..0.2), random.within(0.35..0.5));
    let mut signal = vec![0.0; (SECS * RATE_HZ) as usize];
    let (mut at, mut times) = (-random.share() * 60.0 / rate, Vec::new());
    while at < SECS {
        times.push(at);
        let secs = 60.0 / rate * (1.0 + chance * random.normal());
        let height = 1.0 + depth * random.normal();
        for (k, value) in signal.iter_mut().enumerate() {
            let share = (k as f64 / RATE_HZ - at) / secs;
            if (0.0..1.0).contains(&share) {
                let phase = if share < inhalation {
                    share / inhalation
                } else {
                    1.0 + (share - inhalation) / (1.0 - inhalation)
                };
                *value += height * (1.0 - (TAU * phase / 2.0).cos()) / 2.0;
            }
        }
        at += secs;
    }
    let last = times[times.len() - 1] - times[0];
    Belt { signal, rate_per_min: 60.0 * (times.len() - 1) as f64 / last }
}

/// Adds a wave whose rate and height wander.
fn add_wave(random: &mut Random, belt: &mut Belt, rate_per_min: f64, height: f64) {
    let (mut phase, second, chance) =
        (TAU * random.share(), random.within(0.0..0.5), random.within(0.0..0.15));
    for value in &mut belt.signal {
        *value += height * (phase.sin() + second * (2.0 * phase).sin());
        phase += TAU * rate_per_min / 60.0 / RATE_HZ * (1.0 + chance * random.normal());
    }
}

fn moving(random: &mut Random) -> Belt {
    let mut belt = breathing(random, 8.0..30.0);
    let (rate, height) = (random.within(20.0..130.0), 0.3 * 20f64.powf(random.share()));
    add_wave(random, &mut belt, rate, height);
    belt
}

fn still(random: &mut Random) -> Belt {
    let mut belt = Belt { signal: vec![0.0; (SECS * RATE_HZ) as usize], rate_per_min: f64::NAN };
    let rate = random.within(20.0..130.0);
    add_wave(random, &mut belt, rate, 1.0);
    belt
}

/// Makes a belt whose signal rises in both directions of breathing.
fn rectified(random: &mut Random) -> Belt {
    let mut belt = breathing(random, 6.0..25.0);
    let level = random.within(0.35..0.6);
    belt.signal.iter_mut().for_each(|value| *value = (*value - level).abs());
    belt
}

fn with_heart(
    random: &mut Random,
    breaths: std::ops::Range<f64>,
    hearts: std::ops::Range<f64>,
) -> Belt {
    let mut belt = breathing(random, breaths);
    let (rate, height) = (random.within(hearts), random.within(0.02..0.35));
    add_wave(random, &mut belt, rate, height);
    belt
}

/// The results for the windows of a kind.
#[derive(Default)]
struct Outcome {
    all: u64,
    trusted_right: u64,
    trusted_wrong: u64,
}

/// Prints the results for this many belts of each kind; returns whether all bars were met.
pub fn belts(seeds: Seeds, count: u64) -> Result<bool, Box<dyn Error>> {
    let mut met = true;
    for (turn, (kind, make, bar)) in KINDS.into_iter().enumerate() {
        for how in [How::Whole, How::Causal] {
            let mut outcome = Outcome::default();
            for number in 0..count {
                let seed = seeds.first() + 1_000_000 + 1000 * turn as u64 + number;
                take(&mut outcome, &mut Random::new(seed), make, how)?;
            }
            met &= report(&format!("{how:?}, belt, {kind}"), bar, &outcome);
        }
    }
    Ok(met)
}

fn take(
    outcome: &mut Outcome,
    random: &mut Random,
    make: Make,
    how: How,
) -> Result<(), Box<dyn Error>> {
    let mut belt = make(random);
    let noise = white(random, belt.signal.len());
    add(&mut belt.signal, &noise, random.within(0.001..0.03));
    for (rate, quality) in rates(belt.signal, how)? {
        let is_right = (rate / belt.rate_per_min - 1.0).abs() <= TOLERANCE;
        outcome.all += 1;
        outcome.trusted_right += u64::from(is_right && quality > TRUSTED);
        outcome.trusted_wrong += u64::from(!is_right && quality > TRUSTED);
    }
    Ok(())
}

fn report(what: &str, bar: Option<Bar>, outcome: &Outcome) -> bool {
    let Outcome { all, trusted_right, trusted_wrong } = *outcome;
    let text = format!(
        "unkind, {what}: {trusted_wrong} of {all} windows above quality {TRUSTED} and more than 10 % off, {trusted_right} above it and right"
    );
    let Some(Bar { most_wrong, least_right }) = bar else {
        println!("      {text}");
        return true;
    };
    let met = 100 * trusted_wrong <= most_wrong * all && 100 * trusted_right >= least_right * all;
    let verdict = if met { "pass" } else { "FAIL" };
    println!("{verdict}  {text} (bars at most {most_wrong} % and at least {least_right} %)");
    met
}

/// Returns the rate of each minute, and its quality; both are 0 if there is no rate.
fn rates(signal: Vec<f64>, how: How) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let settings = Settings::default();
    let channels = [signal];
    let recording = Recording { rate_hz: RATE_HZ, begin_ns: 0, channels: &channels };
    let of = |windows: &dyn Windows| {
        let place = windows.values().iter().position(|value| value.name == "RSP_Rate_Mean");
        let place = place.unwrap_or_default();
        [0.0, 30.0, 60.0].map(|begin_secs| {
            let ns = |secs: f64| (secs * 1e9) as i64;
            let span = Span { begin_ns: ns(begin_secs), end_ns: ns(begin_secs + WINDOW_SECS) };
            let measured = windows.measure(span);
            measured.values[place].map_or((0.0, 0.0), |rate| (rate, measured.quality))
        })
    };
    Ok(match how {
        How::Whole => of(&*whole(&settings, &recording)?.windows).to_vec(),
        How::Causal => {
            let mut analysis = causal(&settings, RATE_HZ)?;
            for (place, &sample) in channels[0].iter().enumerate() {
                analysis.push(recording.time_ns(place as f64), &[sample]);
            }
            of(&*analysis).to_vec()
        }
    })
}
