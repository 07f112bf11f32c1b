//! Heartbeats compared with experts' annotations: the MIT-BIH arrhythmia database, channel 0, whole records, beats
//! only, matched one to one.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use teampulse_signal::agreement::{self, Agreement};
use teampulse_signal::analysis::{Recording, Span};
use teampulse_signal::ecg::analysis::{Settings, whole as whole_analysis};
use teampulse_signal::ecg::{Beat, BeatDetector, Found, clean, find_beats, quality};
use teampulse_signal::error::SignalError;
use teampulse_signal::filter::{butterworth, zero_phase};

use crate::noise::Noise;
use crate::records::{RATE_HZ, Record, column, mitdb};
use crate::resampling::resampled;

const NARROW_SECS: f64 = 0.05;
const WIDE_SECS: f64 = 0.15;
const LOW_RATE_HZ: f64 = 130.0;
const FAST_RATE_HZ: f64 = 512.0;

/// Prints the figures with their bars; returns whether all bars were met.
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
    bars.noise(&data.join("ecg_noise"), &records)?;
    bars.rest(&data.join("ecg_rest_5min"))?;
    let signal = &records[0].signal;
    for rate_hz in [LOW_RATE_HZ, FAST_RATE_HZ] {
        speed(&mut bars, &resampled(signal, RATE_HZ, rate_hz), rate_hz)?;
    }
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

/// The delays between beats and their reports.
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

fn matched(truth: &[f64], found: &[f64], tolerance: f64) -> Score {
    let Agreement { hits, extra, missed, .. } = agreement::matched(truth, found, tolerance);
    Score { hits, extra, missed }
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
        self.line(wide >= 99.9, &format!("{what}: F1 at 150 ms {:?} (bar 99.9 %)", scores.wide));
        self.line(narrow >= 99.6, &format!("{what}: F1 at 50 ms {narrow:.2} % (bar 99.6 %)"));
        let (worst, name) = &scores.worst;
        self.line(*worst >= 98.0, &format!("{what}: worst record {worst:.2} %, {name} (bar 98 %)"));
    }

    fn near(&mut self, what: &str, scores: &Scores, of: &str, other: &Scores) {
        let pairs = [(150, scores.wide, other.wide), (50, scores.narrow, other.narrow)];
        for (millis, score, other) in pairs {
            let less = other.f1_percent() - score.f1_percent();
            let text = format!("{what}: F1 at {millis} ms {score:?}, {less:.2} points below {of}");
            self.line(less <= 0.1, &format!("{text} (bar 0.1)"));
        }
        let (worst, name) = &scores.worst;
        self.line(*worst >= 98.0, &format!("{what}: worst record {worst:.2} %, {name} (bar 98 %)"));
    }

    fn delays(&mut self, delays: &mut Delays) {
        delays.in_time_ms.sort_unstable_by(f64::total_cmp);
        let count = delays.in_time_ms.len();
        let at = |share: f64| delays.in_time_ms[((count - 1) as f64 * share) as usize];
        let (median, p99) = (at(0.5), at(0.99));
        let text = format!("causal: reported {p99:.0} ms after the beat (p99; median {median:.0})");
        self.line(p99 <= 250.0, &format!("{text} (bar 250)"));
        let percent = 100.0 * delays.later as f64 / (count + delays.later) as f64;
        self.line(percent <= 1.0, &format!("causal: {percent:.2} % found later (bar 1 %)"));
    }

    /// Measures the record that comes with noise, and other records with the same noise added.
    fn noise(&mut self, folder: &Path, records: &[Record]) -> Result<(), Box<dyn Error>> {
        let noise = Noise::read(folder)?;
        let mut before = 0.0;
        // The F1 that the best of other programs reaches with its defaults, computed from its counts.
        for (decibels, bar) in [(0.0, 70.0), (6.0, 85.0), (12.0, 92.0), (24.0, 99.0)] {
            let record = noise.own(decibels);
            let found = find_beats(&record.signal, RATE_HZ)?;
            let places: Vec<f64> = found.iter().map(|beat| beat.sample).collect();
            let score = matched(&record.beats, &places, WIDE_SECS * RATE_HZ);
            let index = quality(&record.signal, RATE_HZ, &places).unwrap_or(0.0);
            let what = format!("noise at {decibels} dB");
            let f1 = score.f1_percent();
            self.line(f1 >= bar, &format!("{what}: F1 at 150 ms {score:?} (bar {bar} %)"));
            let text = format!("{what}: quality {index:.3} (bar: above {before:.3})");
            self.line(index > before, &text);
            before = index;
        }
        // The F1 of NeuroKit2 0.2.13's default (ecg_clean, ecg_peaks) on the same signals, by the same rule.
        for (decibels, bar) in [(0.0, 69.62), (6.0, 82.63), (12.0, 89.94)] {
            let others = noise.others(records, decibels);
            let whole = Scores::of(&others, RATE_HZ, whole)?;
            let causal =
                Scores::of(&others, RATE_HZ, |s, rate_hz| Delays::default().run(s, rate_hz))?;
            let what = format!("other records in noise at {decibels} dB");
            let text = format!("{what}: F1 at 150 ms {:?} (bar {bar} %, NeuroKit2's)", whole.wide);
            self.line(whole.wide.f1_percent() >= bar, &text);
            println!("      beats, {what}: causal {:?}", causal.wide);
        }
        Ok(())
    }

    /// Measures five minutes at rest, with the beats marked by the recorder's own program, which are 10 to 11 ms before
    /// the R peaks.
    fn rest(&mut self, folder: &Path) -> Result<(), Box<dyn Error>> {
        let truth = column(&folder.join("ecg_5_min.opensignals_rpeaks.csv"))?;
        let signal = column(&folder.join("ecg_5_min.csv"))?;
        let found = find_beats(&signal, 1000.0)?;
        let places: Vec<f64> = found.iter().map(|beat| beat.sample).collect();
        let score = matched(&truth, &places, NARROW_SECS * 1000.0);
        let text = format!("at rest: {} of {} within 50 ms", score.hits, truth.len());
        self.line(score.missed == 0, &format!("{text}, {} extra (bar: all)", score.extra));
        Ok(())
    }
}

/// Compares the cost of cleaning and finding beats with the bare filter on the same signal, and with the whole
/// analysis.
fn speed(bars: &mut Bars, signal: &[f64], rate_hz: f64) -> Result<(), Box<dyn Error>> {
    let hours = signal.len() as f64 / rate_hz / 3600.0;
    let band = butterworth::band_pass(4, 0.5, 40.0, rate_hz)?;
    let channels = [signal.to_vec()];
    let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
    let (mut filter, mut beats, mut all) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    for _ in 0..20 {
        filter = filter.min(secs(|| zero_phase(&band, signal))?);
        let clean_and_beats = || Ok((clean(signal, rate_hz, 50.0)?, find_beats(signal, rate_hz)?));
        beats = beats.min(secs(clean_and_beats)?);
        all = all.min(secs(|| analyse(&recording))?);
    }
    let times = beats / filter;
    let what = format!("whole at {rate_hz} Hz");
    let text = format!("{what}: clean and beats {:.4} s per hour", beats / hours);
    bars.line(times <= 10.0, &format!("{text}, {times:.1} times the bare filter (bar 10)"));
    println!("      beats, {what}: bare filter {:.4} s per hour", filter / hours);
    let per_hour = all / hours;
    let text = format!("{what}: analysis with all values of each 60 s {per_hour:.3} s per hour");
    if rate_hz > LOW_RATE_HZ {
        println!("      beats, {text}");
    } else {
        bars.line(per_hour <= 0.15, &format!("{text} (bar 0.15)"));
    }
    Ok(())
}

fn analyse(recording: &Recording<'_>) -> Result<(), SignalError> {
    let whole = whole_analysis(&Settings::default(), recording)?;
    let Span { begin_ns, end_ns } = recording.span();
    for begin_ns in (begin_ns..end_ns).step_by(60_000_000_000) {
        let span = Span { begin_ns, end_ns: begin_ns + 60_000_000_000 };
        std::hint::black_box(whole.windows.measure(span));
    }
    Ok(())
}

fn secs<T>(work: impl FnOnce() -> Result<T, SignalError>) -> Result<f64, SignalError> {
    #[expect(clippy::disallowed_methods, reason = "a benchmark reads the machine's time")]
    let begin = Instant::now();
    std::hint::black_box(work()?);
    Ok(begin.elapsed().as_secs_f64())
}
