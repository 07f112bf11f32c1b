//! Heart beats against experts' annotations: the MIT-BIH arrhythmia database, channel 0, whole
//! records, beats only, matched one to one.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use teampulse_signal::ecg::{Beat, BeatDetector, Found, find_beats, quality};

use crate::records::{RATE_HZ, Record, column, mitdb};
use crate::resampling::resampled;

const NARROW_SECS: f64 = 0.05;
const WIDE_SECS: f64 = 0.15;
const LOW_RATE_HZ: f64 = 130.0;

/// Prints figures with their bars; whether all were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let records = mitdb(&data.join("ecg_mitdb"))?;
    let slow: Vec<Record> = records.iter().map(at_low_rate).collect();
    let mut bars = Bars { met: true };
    let whole = Scores::of(&records, RATE_HZ, whole)?;
    bars.scores("whole", &whole);
    let mut delays = Delays::default();
    let causal = Scores::of(&records, RATE_HZ, |signal, rate_hz| delays.run(signal, rate_hz))?;
    bars.near("causal", &causal, "whole", &whole);
    bars.delays(&mut delays);
    let slow_whole = Scores::of(&slow, LOW_RATE_HZ, self::whole)?;
    bars.near("whole at 130 Hz", &slow_whole, "whole", &whole);
    let mut slow_delays = Delays::default();
    let run = |signal: &[f64], rate_hz| slow_delays.run(signal, rate_hz);
    let slow_causal = Scores::of(&slow, LOW_RATE_HZ, run)?;
    bars.near("causal at 130 Hz", &slow_causal, "causal", &causal);
    bars.delays(&mut slow_delays);
    bars.noise(&data.join("ecg_noise"))?;
    print_speed(&records, RATE_HZ)?;
    print_speed(&slow, LOW_RATE_HZ)?;
    Ok(bars.met)
}

/// Prints each record's scores.
pub fn list(data: &Path) -> Result<bool, Box<dyn Error>> {
    for record in mitdb(&data.join("ecg_mitdb"))? {
        let mut delays = Delays::default();
        let one = std::slice::from_ref(&record);
        let both = [
            Scores::of(one, RATE_HZ, whole)?,
            Scores::of(one, RATE_HZ, |signal, rate_hz| delays.run(signal, rate_hz))?,
        ];
        let [whole, causal] = both.map(|scores| format!("{:?} {:?}", scores.wide, scores.narrow));
        println!("{}: whole {whole}; causal {causal}", record.name);
    }
    Ok(true)
}

fn at_low_rate(record: &Record) -> Record {
    Record {
        name: record.name.clone(),
        signal: resampled(&record.signal, RATE_HZ, LOW_RATE_HZ),
        beats: record.beats.iter().map(|beat| beat / RATE_HZ * LOW_RATE_HZ).collect(),
    }
}

fn whole(signal: &[f64], rate_hz: f64) -> Result<Vec<Beat>, Box<dyn Error>> {
    Ok(find_beats(signal, rate_hz)?)
}

/// How long after them beats were reported.
#[derive(Default)]
struct Delays {
    in_time_ms: Vec<f64>,
    later: usize,
}

impl Delays {
    fn run(&mut self, signal: &[f64], rate_hz: f64) -> Result<Vec<Beat>, Box<dyn Error>> {
        let mut detector = BeatDetector::new(rate_hz)?;
        let mut beats = Vec::new();
        for (place, &sample) in signal.iter().enumerate() {
            if let Some(beat) = detector.push(sample) {
                match beat.found {
                    Found::InTime => {
                        self.in_time_ms.push((place as f64 - beat.sample) / rate_hz * 1e3);
                    }
                    Found::Later => self.later += 1,
                }
                beats.push(beat);
            }
        }
        Ok(beats)
    }
}

#[derive(Clone, Copy, Default)]
struct Score {
    hits: usize,
    extra: usize,
    missed: usize,
}

impl Score {
    fn f1_percent(self) -> f64 {
        200.0 * self.hits as f64 / (2 * self.hits + self.extra + self.missed).max(1) as f64
    }

    fn plus(self, other: Score) -> Score {
        Score {
            hits: self.hits + other.hits,
            extra: self.extra + other.extra,
            missed: self.missed + other.missed,
        }
    }
}

impl std::fmt::Debug for Score {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} % ({} extra, {} missed)", self.f1_percent(), self.extra, self.missed)
    }
}

struct Scores {
    wide: Score,
    narrow: Score,
    worst: (f64, String),
}

impl Scores {
    fn of(
        records: &[Record],
        rate_hz: f64,
        mut find: impl FnMut(&[f64], f64) -> Result<Vec<Beat>, Box<dyn Error>>,
    ) -> Result<Scores, Box<dyn Error>> {
        let (wide, narrow) = (Score::default(), Score::default());
        let mut scores = Scores { wide, narrow, worst: (100.0, String::new()) };
        for record in records {
            let found = find(&record.signal, rate_hz)?;
            let places: Vec<f64> = found.iter().map(|beat| beat.sample).collect();
            let wide = matched(&record.beats, &places, WIDE_SECS * rate_hz);
            scores.wide = scores.wide.plus(wide);
            let narrow = matched(&record.beats, &places, NARROW_SECS * rate_hz);
            scores.narrow = scores.narrow.plus(narrow);
            if wide.f1_percent() < scores.worst.0 {
                scores.worst = (wide.f1_percent(), record.name.clone());
            }
        }
        Ok(scores)
    }
}

/// Pairs true beats and found ones, each at most once, that lie near enough; the rule by which the
/// figures of other detectors were made.
fn matched(truth: &[f64], found: &[f64], tolerance: f64) -> Score {
    let (mut true_index, mut index, mut hits) = (0, 0, 0);
    while let (Some(beat), Some(place)) = (truth.get(true_index), found.get(index)) {
        let away = place - beat;
        let next_is_nearer = found.get(index + 1).is_some_and(|n| (n - beat).abs() < away.abs());
        if away.abs() > tolerance {
            if away < 0.0 { index += 1 } else { true_index += 1 }
        } else if next_is_nearer {
            index += 1;
        } else {
            (true_index, index, hits) = (true_index + 1, index + 1, hits + 1);
        }
    }
    Score { hits, extra: found.len() - hits, missed: truth.len() - hits }
}

struct Bars {
    met: bool,
}

impl Bars {
    fn line(&mut self, met: bool, text: &str) {
        println!("{}  beats, {text}", if met { "pass" } else { "FAIL" });
        self.met &= met;
    }

    fn scores(&mut self, what: &str, scores: &Scores) {
        let (wide, narrow) = (scores.wide.f1_percent(), scores.narrow.f1_percent());
        self.line(wide >= 99.2, &format!("{what}: F1 at 150 ms {:?} (bar 99.2 %)", scores.wide));
        self.line(narrow >= 98.95, &format!("{what}: F1 at 50 ms {narrow:.2} % (bar 98.95 %)"));
        let (worst, name) = &scores.worst;
        self.line(*worst >= 92.0, &format!("{what}: worst record {worst:.2} %, {name} (bar 92 %)"));
    }

    fn near(&mut self, what: &str, scores: &Scores, of: &str, other: &Scores) {
        let pairs = [(150, scores.wide, other.wide), (50, scores.narrow, other.narrow)];
        for (millis, score, other) in pairs {
            let less = other.f1_percent() - score.f1_percent();
            let text = format!("{what}: F1 at {millis} ms {score:?}, {less:.2} points below {of}");
            self.line(less <= 0.3, &format!("{text} (bar 0.3)"));
        }
        println!("      beats, {what}: worst record {:.2} %, {}", scores.worst.0, scores.worst.1);
    }

    fn delays(&mut self, delays: &mut Delays) {
        delays.in_time_ms.sort_unstable_by(f64::total_cmp);
        let count = delays.in_time_ms.len();
        let at = |share: f64| delays.in_time_ms[((count - 1) as f64 * share) as usize];
        let (median, p99) = (at(0.5), at(0.99));
        let text = format!("causal: told of {p99:.0} ms later (p99; median {median:.0})");
        self.line(p99 <= 250.0, &format!("{text} (bar 250)"));
        let percent = 100.0 * delays.later as f64 / (count + delays.later) as f64;
        self.line(percent <= 1.0, &format!("causal: {percent:.2} % found later (bar 1 %)"));
    }

    /// The two recordings differ in nothing but the height of the same noise: from them follow those
    /// of less noise.
    fn noise(&mut self, folder: &Path) -> Result<(), Box<dyn Error>> {
        let truth = column(&folder.join("118e00_ann.csv"))?;
        let loud = column(&folder.join("118e00.csv"))?;
        let soft = column(&folder.join("118e06.csv"))?;
        let mixed = |decibels: f64| -> Vec<f64> {
            let share = (1.0 - gain(decibels)) / (1.0 - gain(6.0));
            loud.iter().zip(&soft).map(|(loud, soft)| loud + share * (soft - loud)).collect()
        };
        let mut before = 0.0;
        // What the best known of other programs' defaults reaches, from its own counts.
        for (decibels, bar) in [(0.0, 70.0), (6.0, 85.0), (12.0, 92.0), (24.0, 99.0)] {
            let signal = mixed(decibels);
            let found = find_beats(&signal, RATE_HZ)?;
            let places: Vec<f64> = found.iter().map(|beat| beat.sample).collect();
            let score = matched(&truth, &places, WIDE_SECS * RATE_HZ);
            let index = quality(&signal, RATE_HZ, &places).unwrap_or(0.0);
            let what = format!("noise at {decibels} dB");
            let f1 = score.f1_percent();
            self.line(f1 >= bar, &format!("{what}: F1 at 150 ms {score:?} (bar {bar} %)"));
            let text = format!("{what}: quality {index:.3} (bar: above {before:.3})");
            self.line(index > before, &text);
            before = index;
        }
        Ok(())
    }
}

fn gain(decibels: f64) -> f64 {
    10f64.powf(-decibels / 20.0)
}

fn print_speed(records: &[Record], rate_hz: f64) -> Result<(), Box<dyn Error>> {
    let signal = &records[0].signal;
    let hours = signal.len() as f64 / rate_hz / 3600.0;
    let mut least_secs = f64::INFINITY;
    for _ in 0..5 {
        #[expect(clippy::disallowed_methods, reason = "a benchmark reads the machine's time")]
        let begin = Instant::now();
        find_beats(signal, rate_hz)?;
        least_secs = least_secs.min(begin.elapsed().as_secs_f64());
    }
    println!("      beats, whole at {rate_hz} Hz: {:.4} s an hour", least_secs / hours);
    Ok(())
}
