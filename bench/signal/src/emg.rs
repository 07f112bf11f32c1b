//! Muscle activity compared with plain formulas, and with what is known of recordings.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use teampulse_signal::analysis::{Causal, Event, Recording, Span, Windows};
use teampulse_signal::emg::analysis::{Channel, Settings, causal, whole};
use teampulse_signal::emg::{Frames, clean};

use crate::golden::{Worst, golden, numbers, verdict};
use crate::records::column;

const MYO_HZ: f64 = 200.0;
const MYO_CHANNELS: usize = 8;
/// The rounding error of golden values, which have nine decimals.
const HALF_A_DIGIT: f64 = 5e-10;
/// The bar for an hour of eight channels at 200 Hz: all features, with a frame every 50 ms.
const MOST_SECS_AN_HOUR: f64 = 0.5;
const RUNS: usize = 5;

/// Prints the figures with their bars; returns whether all bars were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let rest = myo(data, 0)?;
    let extension = myo(data, 2)?;
    let fist = myo(data, 7)?;
    let met = [
        formulas(data, &[(0, &rest), (2, &extension), (7, &fist)])?,
        louder("wrist extension", &extension, 2.0)?,
        louder("fist", &fist, 1.0)?,
        bursts(data)?,
        gestures(&extension)?,
        resting(&rest)?,
        speed(&extension)?,
    ];
    Ok(met.iter().all(|&each| each))
}

/// Eight channels, and the requested gesture at each sample.
struct Myo {
    channels: Vec<Vec<f64>>,
    labels: Vec<f64>,
}

impl Myo {
    fn recording(&self) -> Recording<'_> {
        Recording { rate_hz: MYO_HZ, begin_ns: 0, channels: &self.channels }
    }
}

fn myo(data: &Path, gesture: u32) -> Result<Myo, Box<dyn Error>> {
    let path = data.join(format!("myo_emg/10000-1_gesture{gesture}.txt"));
    let text = std::fs::read_to_string(path)?;
    let mut channels = vec![Vec::new(); MYO_CHANNELS + 1];
    for line in text.lines() {
        let row: Vec<f64> = line.split(',').filter_map(|cell| cell.trim().parse().ok()).collect();
        if row.len() == channels.len() {
            channels.iter_mut().zip(row).for_each(|(channel, value)| channel.push(value));
        }
    }
    let labels = channels.pop().ok_or("find labels")?;
    Ok(Myo { channels, labels })
}

fn armband() -> Settings {
    let channel = |k: usize| Channel { name: format!("ch{k}"), mvc: Some(50.0) };
    let antagonists = vec![[0, 4]];
    Settings {
        channels: (0..MYO_CHANNELS).map(channel).collect(),
        unit: "count".into(),
        antagonists,
        ..Settings::default()
    }
}

fn formulas(data: &Path, myo: &[(u32, &Myo)]) -> Result<bool, Box<dyn Error>> {
    let volts = |adc: f64| (adc / 65536.0 - 0.5) * 3.0;
    let bursts: Vec<f64> = raw_bursts(data)?.into_iter().map(volts).collect();
    let mut amplitudes = Worst::default();
    let mut frequencies = Worst::default();
    let mut see = |name: &str, signal: &[f64], rate_hz: f64| -> Result<(), Box<dyn Error>> {
        let values = golden(data, name)?;
        let rows = values["features"].as_array().ok_or("find features")?;
        let features = Frames::new(rate_hz, 0.25, 0.125)?.of(&clean(signal, rate_hz)?);
        if features.len() != rows.len() {
            return Err(format!("{name}: {} frames, not {}", features.len(), rows.len()).into());
        }
        for (features, row) in features.into_iter().zip(rows) {
            let (features, row) = (features.ok_or("find features")?, numbers(row));
            let ours = [features.rms, features.mav, features.wl, features.zc];
            for (ours, theirs) in ours.into_iter().zip(&row) {
                amplitudes.see(name, unrounded(ours, *theirs), *theirs);
            }
            for (ours, theirs) in [features.mnf_hz, features.mdf_hz].into_iter().zip(&row[4..]) {
                frequencies.see(name, unrounded(ours, *theirs), *theirs);
            }
        }
        Ok(())
    };
    see("emg_1000hz.json", &column(&data.join("emg/emg_1000hz.txt"))?, 1000.0)?;
    see("emg_bursts.json", &bursts, 1000.0)?;
    for (gesture, myo) in myo {
        see(&format!("myo_10000-1_gesture{gesture}_ch0.json"), &myo.channels[0], MYO_HZ)?;
    }
    let both = [
        amplitudes.print("EMG: RMS, MAV, WL and ZC", 1e-9),
        frequencies.print("EMG: mean and median frequency", 1e-6),
    ];
    Ok(both == [true; 2])
}

/// Returns our value without differences that the rounding of the other value explains.
fn unrounded(ours: f64, theirs: f64) -> f64 {
    if (ours - theirs).abs() <= HALF_A_DIGIT * 1.01 { theirs } else { ours }
}

fn raw_bursts(data: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
    column(&data.join("emg_bursts/emg_bursts.csv"))
}

/// Returns the spans with the same label, each with that label.
fn spans(myo: &Myo) -> Vec<(Span, f64)> {
    let mut begin = 0;
    let runs = myo.labels.chunk_by(|a, b| a.total_cmp(b).is_eq());
    let of_run = |run: &[f64]| {
        let recording = myo.recording();
        let (begin_ns, end) = (recording.time_ns(begin as f64), begin + run.len());
        begin = end;
        (Span { begin_ns, end_ns: recording.time_ns(end as f64) }, run[0])
    };
    runs.map(of_run).collect()
}

/// Returns the root mean square over channels and spans.
fn loudness(windows: &dyn Windows, spans: impl Iterator<Item = Span>) -> f64 {
    let places: Vec<usize> = (0..windows.values().len())
        .filter(|&k| windows.values()[k].name.starts_with("EMG_RMS/"))
        .collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for span in spans {
        let measured = windows.measure(span);
        for rms in places.iter().filter_map(|&place| measured.values[place].ok()) {
            (sum, count) = (sum + rms * rms, count + 1.0);
        }
    }
    (sum / count).sqrt()
}

fn louder(what: &str, myo: &Myo, bar: f64) -> Result<bool, Box<dyn Error>> {
    let all = whole(&armband(), &myo.recording())?;
    let spans = spans(myo);
    let of = |rest: bool| spans.iter().filter(move |(_, label)| (*label == 0.0) == rest);
    let [quiet, loud] =
        [true, false].map(|rest| loudness(&*all.windows, of(rest).map(|(span, _)| *span)));
    let quality = all.windows.measure(myo.recording().span()).quality;
    let text = format!("EMG, {what}: RMS {quiet:.1} at rest, {loud:.1} in the gesture");
    Ok(verdict(loud > bar * quiet, &format!("{text} (bar ×{bar}), quality {quality:.2}")))
}

/// Checks that as many obvious contractions are found live as afterwards, at the same times.
fn bursts(data: &Path) -> Result<bool, Box<dyn Error>> {
    let channels = [raw_bursts(data)?];
    let recording = Recording { rate_hz: 1000.0, begin_ns: 0, channels: &channels };
    let all = whole(&Settings::default(), &recording)?;
    let mut running = causal(&Settings::default(), 1000.0)?;
    let causal = run(&mut *running, &recording);
    let nearest = |event: &Event| {
        let apart = |other: &Event| event.at_ns.abs_diff(other.at_ns) as f64 / 1e6;
        causal.iter().map(apart).fold(f64::INFINITY, f64::min)
    };
    let mut apart: Vec<f64> = all.events.iter().map(nearest).collect();
    apart.sort_unstable_by(f64::total_cmp);
    let median = apart.get(apart.len() / 2).copied().unwrap_or(f64::INFINITY);
    let text = format!("{} bursts whole, {} causal", all.events.len(), causal.len());
    let met = all.events.len().abs_diff(causal.len()) <= 1 && median <= 50.0;
    Ok(verdict(met, &format!("EMG: {text}, onsets {median:.0} ms apart (median; bar 50 ms)")))
}

fn run(running: &mut dyn Causal, recording: &Recording<'_>) -> Vec<Event> {
    let mut events = Vec::new();
    let mut row = vec![0.0; recording.channels.len()];
    for sample in 0..recording.len() {
        for (value, channel) in row.iter_mut().zip(recording.channels) {
            *value = channel[sample];
        }
        running.push(recording.time_ns(sample as f64), &row);
        events.extend(std::iter::from_fn(|| running.next_event()));
    }
    events
}

/// Checks that each gesture has a burst of some muscle.
fn gestures(myo: &Myo) -> Result<bool, Box<dyn Error>> {
    let all = whole(&armband(), &myo.recording())?;
    let gestures: Vec<Span> =
        spans(myo).into_iter().filter(|(_, label)| *label != 0.0).map(|(span, _)| span).collect();
    let has_burst = |span: &&Span| all.events.iter().any(|event| span.holds(event.at_ns));
    let found = gestures.iter().filter(has_burst).count();
    let text = format!("EMG, wrist extension: bursts in {found} of {} gestures", gestures.len());
    Ok(verdict(found == gestures.len(), &format!("{text} (bar all)")))
}

fn resting(myo: &Myo) -> Result<bool, Box<dyn Error>> {
    let all = whole(&armband(), &myo.recording())?;
    let secs: f64 = all.events.iter().map(|event| event.details[1].1).sum();
    let share = 100.0 * secs / (MYO_CHANNELS as f64 * myo.recording().span().secs());
    let text = format!("EMG, at rest: {} bursts, {share:.1} % of the time", all.events.len());
    Ok(verdict(share < 10.0, &format!("{text} (bar 10 %)")))
}

fn speed(myo: &Myo) -> Result<bool, Box<dyn Error>> {
    let hour = (3600.0 * MYO_HZ) as usize;
    let repeated = |channel: &Vec<f64>| channel.iter().copied().cycle().take(hour).collect();
    let channels: Vec<Vec<f64>> = myo.channels.iter().map(repeated).collect();
    let mut frames = 0;
    let secs = least_secs(|| {
        let mut features = Frames::new(MYO_HZ, 0.25, 0.05)?;
        frames = 0;
        for channel in &channels {
            frames += std::hint::black_box(features.of(&clean(channel, MYO_HZ)?)).len();
        }
        Ok(())
    })?;
    let recording = Recording { rate_hz: MYO_HZ, begin_ns: 0, channels: &channels };
    let causal_secs = least_secs(|| {
        run(&mut *causal(&armband(), MYO_HZ)?, &recording);
        Ok(())
    })?;
    let whole_secs = least_secs(|| {
        std::hint::black_box(whole(&armband(), &recording)?);
        Ok(())
    })?;
    println!(
        "      EMG, 8 × 200 Hz: analysis {causal_secs:.3} s per hour causal, {whole_secs:.3} whole"
    );
    let text = format!("EMG, 8 × 200 Hz: band and all features of {frames} frames, 50 ms apart");
    let text = format!("{text}: {secs:.3} s per hour (bar {MOST_SECS_AN_HOUR} s)");
    Ok(verdict(secs <= MOST_SECS_AN_HOUR, &text))
}

#[expect(clippy::disallowed_methods, reason = "a benchmark reads the machine's time")]
fn least_secs(mut job: impl FnMut() -> Result<(), Box<dyn Error>>) -> Result<f64, Box<dyn Error>> {
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let begin = Instant::now();
        job()?;
        least = least.min(begin.elapsed().as_secs_f64());
    }
    Ok(least)
}
