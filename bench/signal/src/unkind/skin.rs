//! Skin conductance with many responses, contact glitches, and electrodes that hardly touch.

use std::error::Error;

use teampulse_signal::analysis::{Event, Recording};
use teampulse_signal::eda::analysis::{Settings, causal, whole};

use super::Seeds;
use super::random::Random;
use super::windows::How;

const SECS: f64 = 300.0;
/// The distance within which a found response matches a true one by its peak, and the distance from a peak within which
/// a glitch may hide it [s].
const FOUND_SECS: f64 = 1.0;
const HIDDEN_SECS: f64 = 0.5;
/// The bars for sensitivity and precision with 8 responses per minute.
const LEAST_SENSITIVITY: f64 = 0.9;
const LEAST_PRECISION: f64 = 0.95;
/// The share of found responses that may be caused by 6 glitches per minute, with 4 responses per minute.
const MOST_OF_GLITCHES: f64 = 0.02;
/// The quality that electrodes that hardly touch must not exceed.
const MOST_QUALITY: f64 = 0.4;
/// The quality above which values are believed.
const BELIEVED: f64 = 0.8;
/// The rate of found responses above which noise without a response counts as wrong [1/min].
const MOST_OF_NOISE_PER_MIN: f64 = 1.0;

/// A skin conductance whose truth is known.
struct Skin {
    rate_hz: f64,
    signal: Vec<f64>,
    /// The times at which the responses would peak if each were alone [s].
    peaks_secs: Vec<f64>,
}

/// Prints the figures with their bars for this many skins of each kind; returns whether all bars were met.
pub fn skins(seeds: Seeds, count: u64) -> Result<bool, Box<dyn Error>> {
    let mut met = true;
    for how in [How::Whole, How::Causal] {
        for (per_min, glitches_per_min) in [(2.0, 0.0), (8.0, 0.0), (12.0, 0.0), (4.0, 6.0)] {
            let (mut found, mut true_count, mut reported) = (0, 0, 0);
            let near_secs = FOUND_SECS + if glitches_per_min > 0.0 { HIDDEN_SECS } else { 0.0 };
            for number in 0..count {
                let mut random = Random::new(seeds.first() + 600_000 + number);
                let mut skin = Skin::new(&mut random, per_min);
                skin.lose_contact(&mut random, glitches_per_min);
                let peaks_secs = skin.found(how)?.0;
                found += matches(&skin.peaks_secs, &peaks_secs, near_secs);
                true_count += skin.peaks_secs.len();
                reported += peaks_secs.len();
            }
            let (sensitivity, precision) =
                (found as f64 / true_count as f64, found as f64 / reported as f64);
            let (passed, bar) = match (per_min, glitches_per_min) {
                (8.0, _) => (
                    sensitivity >= LEAST_SENSITIVITY && precision >= LEAST_PRECISION,
                    " (bars 90 and 95 %)",
                ),
                (_, 0.0) => (true, ""),
                _ => (1.0 - precision <= MOST_OF_GLITCHES, " (bar of precision 98 %)"),
            };
            met &= passed;
            println!(
                "{}  unkind, {how:?}, skin with {per_min} responses and {glitches_per_min} glitches per minute: sensitivity {:.1} %, precision {:.1} % of {true_count}{bar}",
                if passed { "pass" } else { "FAIL" },
                100.0 * sensitivity,
                100.0 * precision
            );
        }
        met &= hardly_touching(seeds, count, how)?;
        met &= noise_alone(seeds, count, how)?;
    }
    Ok(met)
}

/// Analyses electrodes through which almost no current flows.
fn hardly_touching(seeds: Seeds, count: u64, how: How) -> Result<bool, Box<dyn Error>> {
    let mut qualities = Vec::new();
    for number in 0..count {
        let mut random = Random::new(seeds.first() + 700_000 + number);
        let mut skin = Skin::new(&mut random, 2.0);
        let (level_us, gain) = (random.within(0.06..0.1), 0.005);
        let middle = skin.signal.iter().sum::<f64>() / skin.signal.len() as f64;
        skin.signal.iter_mut().for_each(|value| *value = level_us + gain * (*value - middle));
        qualities.push(skin.found(how)?.1);
    }
    let most = qualities.iter().copied().fold(0.0, f64::max);
    let met = most < MOST_QUALITY;
    println!(
        "{}  unkind, {how:?}, skin of 0.06 to 0.1 µS: quality {most:.2} at most (bar {MOST_QUALITY})",
        if met { "pass" } else { "FAIL" }
    );
    Ok(met)
}

/// Analyses amplifiers whose noise sometimes exceeds the threshold of a response: no response is true.
fn noise_alone(seeds: Seeds, count: u64, how: How) -> Result<bool, Box<dyn Error>> {
    let (mut believed, mut wrong) = (0, 0);
    for number in 0..10 * count {
        let mut random = Random::new(seeds.first() + 800_000 + number);
        let mut skin = Skin::new(&mut random, 0.0);
        let noise_us = 0.002 * 50f64.powf(random.share()) * (skin.rate_hz / 4.0).sqrt();
        skin.signal.iter_mut().for_each(|value| *value += noise_us * random.normal());
        let (peaks_secs, quality) = skin.found(how)?;
        if quality >= BELIEVED {
            believed += 1;
            wrong += u32::from(peaks_secs.len() as f64 * 60.0 / SECS > MOST_OF_NOISE_PER_MIN);
        }
    }
    let met = wrong == 0 && believed > 0;
    println!(
        "{}  unkind, {how:?}, noise of 0.002 to 0.1 µS without a response: {believed} of {} with quality above {BELIEVED}, {wrong} of them with more than {MOST_OF_NOISE_PER_MIN} responses per minute (bar 0)",
        if met { "pass" } else { "FAIL" },
        10 * count
    );
    Ok(met)
}

impl Skin {
    fn new(random: &mut Random, per_min: f64) -> Skin {
        let rate_hz = random.one_of(&[4.0, 8.0, 32.0, 64.0, 128.0]);
        let (rise_secs, fall_secs) = (random.within(0.5..1.0), random.within(1.5..5.0));
        let peak_secs =
            (fall_secs / rise_secs).ln() * fall_secs * rise_secs / (fall_secs - rise_secs);
        let form = |secs: f64| (-secs / fall_secs).exp() - (-secs / rise_secs).exp();
        let (level_us, drift_us) = (random.within(1.5..15.0), random.within(-0.3..0.3));
        let noise_us = random.within(0.0005..0.004);
        let mut signal: Vec<f64> = (0..(SECS * rate_hz) as usize)
            .map(|k| level_us + drift_us * k as f64 / rate_hz / 60.0 + noise_us * random.normal())
            .collect();
        // Glands rest for a moment after a response; then they fire at random.
        let (dead_secs, mut at_secs) = (1.2, random.within(3.0..8.0));
        let mut peaks_secs = Vec::new();
        while per_min > 0.0 && at_secs + peak_secs + 2.0 < SECS {
            let amplitude_us = 0.08 * 12f64.powf(random.share());
            peaks_secs.push(at_secs + peak_secs);
            for (k, value) in signal.iter_mut().enumerate().skip((at_secs * rate_hz) as usize) {
                let secs = (k as f64 / rate_hz - at_secs).max(0.0);
                *value += amplitude_us * form(secs) / form(peak_secs);
            }
            at_secs += dead_secs - (60.0 / per_min - dead_secs) * (1.0 - random.share()).ln();
        }
        Skin { rate_hz, signal, peaks_secs }
    }

    /// Changes the current for half a second now and then, up or down.
    fn lose_contact(&mut self, random: &mut Random, per_min: f64) {
        for number in 0..(per_min * SECS / 60.0) as u32 {
            let at_secs = (f64::from(number) + random.within(0.2..0.8)) * 60.0 / per_min;
            let begin = (at_secs * self.rate_hz) as usize;
            let change_us = random.one_of(&[-1.0, -1.0, 1.0]) * random.within(0.1..2.0);
            let end = (begin + (0.5 * self.rate_hz) as usize).min(self.signal.len());
            for value in &mut self.signal[begin..end] {
                *value = (*value + change_us).max(0.0);
            }
        }
    }

    /// Returns the times of the found peaks [s], and the quality of the whole.
    fn found(&self, how: How) -> Result<(Vec<f64>, f64), Box<dyn Error>> {
        let channels = [self.signal.clone()];
        let recording = Recording { rate_hz: self.rate_hz, begin_ns: 0, channels: &channels };
        let secs = |event: &Event| event.sample / self.rate_hz;
        match how {
            How::Whole => {
                let analysed = whole(&Settings::default(), &recording)?;
                let quality = analysed.windows.measure(recording.span()).quality;
                Ok((analysed.events.iter().map(secs).collect(), quality))
            }
            How::Causal => {
                let mut analysis = causal(&Settings::default(), self.rate_hz)?;
                let mut found = Vec::new();
                for (place, &sample) in self.signal.iter().enumerate() {
                    analysis.push(recording.time_ns(place as f64), &[sample]);
                    while let Some(event) = analysis.next_event() {
                        found.push(secs(&event));
                    }
                }
                Ok((found, analysis.measure(recording.span()).quality))
            }
        }
    }
}

/// Returns how many of the true times have a matching found one.
fn matches(true_secs: &[f64], found_secs: &[f64], near_secs: f64) -> usize {
    let mut left = found_secs.iter().peekable();
    let mut count = 0;
    for &at in true_secs {
        while left.next_if(|&&found| found < at - near_secs).is_some() {}
        count += usize::from(left.next_if(|&&found| found <= at + near_secs).is_some());
    }
    count
}
