//! Heart rate variability in noise: the error of the RMSSD of a minute, if it is reported.

use std::collections::BTreeMap;
use std::error::Error;

use teampulse_signal::analysis::{Recording, Span};
use teampulse_signal::hrv::Domain;
use teampulse_signal::{ecg, ppg};

use super::heart::SECS;
use super::noise::{add, hum, mains_wander, pink, wander, white};
use super::random::Random;
use super::{Seeds, Unkind, ecg as ecgs, ppg as ppgs};
use crate::golden::verdict;

/// The length of a window, and its distance from the next [s].
const WINDOW_SECS: f64 = 60.0;
const HOP_SECS: f64 = 30.0;
/// An RMSSD is wrong if its error exceeds both this share and this value [ms].
const TOLERANCE: f64 = 0.2;
const TOLERANCE_MS: f64 = 3.0;
/// The quality above which a wrong number looks trustworthy.
const TRUSTED: f64 = 0.8;
/// The largest share of reported values that may be wrong.
const MOST_WRONG: f64 = 0.05;

/// The noises that are added to a signal; each has a height of 1 if the signal's waves are about that high.
const NOISES: [&str; 4] = ["white noise", "1/f noise", "slow wander", "hum"];

fn noise(random: &mut Random, kind: &str, count: usize, rate_hz: f64) -> Vec<f64> {
    match kind {
        "white noise" => white(random, count),
        "1/f noise" => pink(random, count),
        "slow wander" => wander(random, count, rate_hz).iter().map(|value| 10.0 * value).collect(),
        _ => hum(random, count, rate_hz, 50.0, mains_wander(50.0)),
    }
}

/// Makes a heart signal with noise of a kind.
fn made(random: &mut Random, is_ppg: bool, kind: &'static str) -> Unkind {
    let mut made = if is_ppg { ppgs::plain(random, kind) } else { ecgs::plain(random, kind) };
    let added = noise(random, kind, made.signal.len(), made.rate_hz);
    let height = 10f64.powf(random.within(-3.0..-0.3));
    add(&mut made.signal, &added, height);
    made
}

/// Returns the RMSSD of successive beats in a window [ms].
fn rmssd_ms(beats_secs: &[f64], begin_secs: f64) -> f64 {
    let inside =
        beats_secs.iter().filter(|&&at| (begin_secs..begin_secs + WINDOW_SECS).contains(&at));
    let inside: Vec<f64> = inside.copied().collect();
    let changes: Vec<f64> =
        inside.windows(3).map(|beats| 1e3 * (beats[2] - 2.0 * beats[1] + beats[0])).collect();
    (changes.iter().map(|change| change * change).sum::<f64>() / changes.len() as f64).sqrt()
}

#[derive(Default)]
struct Outcome {
    windows: usize,
    wrong: usize,
    /// The ratios of reported to true values.
    ratios: Vec<f64>,
}

/// Prints the figures with their bars for this many signals of each kind; returns whether all bars were met.
pub fn measure(seeds: &str, count: &str) -> Result<bool, Box<dyn Error>> {
    let (seeds, count): (Seeds, usize) = (seeds.parse()?, count.parse()?);
    let mut outcomes: BTreeMap<(bool, &str), Outcome> = BTreeMap::new();
    for number in 0..count {
        for (turn, kind) in NOISES.into_iter().enumerate() {
            for is_ppg in [false, true] {
                let number = (number * NOISES.len() + turn) * 2 + usize::from(is_ppg);
                let seed = seeds.first() + number as u64;
                let made = made(&mut Random::new(seed), is_ppg, kind);
                take(outcomes.entry((is_ppg, kind)).or_default(), &made)?;
            }
        }
    }
    let lines = outcomes.into_iter().map(|((is_ppg, kind), outcome)| {
        let of = if is_ppg { "PPG" } else { "ECG" };
        report(&format!("{of} with {kind}"), outcome)
    });
    Ok(lines.fold(true, |met, passed| met & passed))
}

fn report(what: &str, outcome: Outcome) -> bool {
    let Outcome { windows, wrong, mut ratios } = outcome;
    ratios.sort_unstable_by(f64::total_cmp);
    let count = ratios.len();
    let off_percent = |share: f64| {
        let ratio = ratios.get((share * count as f64) as usize).copied().unwrap_or(f64::NAN);
        100.0 * (ratio - 1.0)
    };
    verdict(
        wrong as f64 <= MOST_WRONG * count as f64,
        &format!(
            "variability, {what}: RMSSD of {count} of {windows} minutes reported, {wrong} off by more than 20 % and 3 ms (bar 5 %); a tenth below {:+.1} %, half below {:+.1} %, nine tenths below {:+.1} %",
            off_percent(0.1),
            off_percent(0.5),
            off_percent(0.9)
        ),
    )
}

fn take(outcome: &mut Outcome, made: &Unkind) -> Result<(), Box<dyn Error>> {
    let channels = [made.signal.clone()];
    let recording = Recording { rate_hz: made.rate_hz, begin_ns: 0, channels: &channels };
    let domains = vec![Domain::Time];
    let whole = if made.is_ppg {
        ppg::analysis::whole(
            &ppg::analysis::Settings { domains, ..Default::default() },
            &recording,
        )?
    } else {
        ecg::analysis::whole(
            &ecg::analysis::Settings { domains, ..Default::default() },
            &recording,
        )?
    };
    let place = whole
        .windows
        .values()
        .iter()
        .position(|value| value.name == "HRV_RMSSD")
        .ok_or("find RMSSD")?;
    let begins =
        (0..).map(|k| f64::from(k) * HOP_SECS).take_while(|begin| begin + WINDOW_SECS <= SECS);
    for begin_secs in begins {
        let ns = |secs: f64| (secs * 1e9) as i64;
        let span = Span { begin_ns: ns(begin_secs), end_ns: ns(begin_secs + WINDOW_SECS) };
        let measured = whole.windows.measure(span);
        outcome.windows += 1;
        let Ok(found_ms) = measured.values[place] else { continue };
        if measured.quality <= TRUSTED {
            continue;
        }
        let true_ms = rmssd_ms(&made.beats_secs, begin_secs);
        let off_ms = (found_ms - true_ms).abs();
        outcome.wrong += usize::from(off_ms > TOLERANCE_MS && off_ms > TOLERANCE * true_ms);
        outcome.ratios.push(found_ms / true_ms);
    }
    Ok(())
}
