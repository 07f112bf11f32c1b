//! Band powers of EEGs compared with SciPy, the effect of closed eyes, blinks, and speed.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use serde_json::Value;
use teampulse_signal::agreement::matched;
use teampulse_signal::analysis::{Measured, Recording, Span, Windows};
use teampulse_signal::eeg::analysis::{Settings, causal, whole};
use teampulse_signal::eeg::{Band, Powers, Quality, alpha_frequency, spectrum};
use teampulse_signal::error::SignalError;
use teampulse_signal::filter::{butterworth, zero_phase};

use crate::golden::{Worst, golden, number, verdict};
use crate::records::column;

/// The rates of the recordings with open and closed eyes, and of the `OpenBCI` board [Hz].
const EYES_HZ: f64 = 125.0;
const OPENBCI_HZ: f64 = 250.0;
/// Blinks read off a plot of the first two channels [s]. They were not annotated by an expert, and were looked at while
/// the detector was made: this checks that it works at all, not how well it works elsewhere.
const SEEN_SECS: [f64; 26] = [
    4.28, 4.95, 5.17, 5.37, 5.6, 5.78, 6.0, 6.22, 13.88, 15.43, 15.65, 15.84, 16.05, 16.25, 16.47,
    78.5, 79.85, 80.1, 80.3, 80.5, 80.8, 86.24, 86.73, 87.26, 87.78, 88.29,
];
const NEAR_SECS: f64 = 0.08;
/// The time that SciPy's Welch takes for an hour of four channels at 256 Hz [s].
const SCIPY_SECS: f64 = 0.077;
const HEADBAND_HZ: f64 = 256.0;
/// The number of runs; the best time counts.
const RUNS: usize = 5;

/// Prints the figures with their bars; returns whether all bars were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let eyes = |state: &str| column(&data.join(format!("eeg_eyes/eeg_eyes_{state}_125hz.txt")));
    let (closed, open) = (eyes("closed")?, eyes("open")?);
    let board = channels(&data.join("eeg_openbci/OpenBCI_GUI-v6-blinks-jawClench-alpha.txt"))?;
    let met = [
        powers(data, &closed, &open, &board[0])?,
        closing_the_eyes(&closed, &open)?,
        blinks(&board)?,
        noise(&closed)?,
        speed()?,
    ];
    Ok(met.iter().all(|&each| each))
}

/// Reads the channels of a recording of an `OpenBCI` board [µV].
fn channels(path: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let column = |index: usize| {
        let numbers = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        numbers.filter_map(|line| line.split(',').nth(index)?.trim().parse().ok()).collect()
    };
    Ok((1..=8).map(column).collect())
}

fn powers(
    data: &Path,
    closed: &[f64],
    open: &[f64],
    board: &[f64],
) -> Result<bool, Box<dyn Error>> {
    let mut worst = Worst::default();
    see(&mut worst, &golden(data, "eeg_eyes_closed.json")?, closed, EYES_HZ)?;
    see(&mut worst, &golden(data, "eeg_eyes_open.json")?, open, EYES_HZ)?;
    let high_pass = butterworth::high_pass(2, 1.0, OPENBCI_HZ)?;
    let filtered = zero_phase(&high_pass, board)?;
    see(&mut worst, &golden(data, "openbci_ch0.json")?, &filtered, OPENBCI_HZ)?;
    Ok(worst.print("band powers and indices of SciPy, three recordings", 1e-6))
}

fn see(
    worst: &mut Worst,
    golden: &Value,
    signal: &[f64],
    rate_hz: f64,
) -> Result<(), Box<dyn Error>> {
    let spectrum = spectrum(signal, rate_hz)?;
    let powers = Powers::of(&spectrum).ok_or("find bands")?;
    for band in Band::ALL {
        let name = format!("{band:?}").to_lowercase();
        worst.see(&name, powers.uv2(band), number(golden, &name)?);
        let relative = powers.relative(band).ok_or("find power")?;
        worst.see(&name, relative, number(&golden["rel"], &name)?);
    }
    let [engagement, theta_alpha] = [powers.engagement(), powers.theta_over_alpha()];
    let theirs = number(golden, "engagement_beta_over_alpha_theta")?;
    worst.see("engagement", engagement.ok_or("find alpha")?, theirs);
    worst.see("theta/alpha", theta_alpha.ok_or("find alpha")?, number(golden, "theta_alpha")?);
    let peak_hz = alpha_frequency(&spectrum).and_then(|alpha| alpha.peak_hz);
    worst.see("peak", peak_hz.ok_or("find a peak")?, number(golden, "iaf_peak_7_13")?);
    Ok(())
}

fn named(windows: &dyn Windows, measured: &Measured, name: &str) -> Result<f64, Box<dyn Error>> {
    let index = windows.values().iter().position(|value| value.name == name);
    let value = measured.values[index.ok_or_else(|| format!("find {name}"))?];
    value.map_err(|reason| format!("compute {name}: {reason}").into())
}

/// Checks that alpha rises and engagement falls, also window by window as in a live session.
fn closing_the_eyes(closed: &[f64], open: &[f64]) -> Result<bool, Box<dyn Error>> {
    let of = |signal: &[f64], name: &str| -> Result<f64, Box<dyn Error>> {
        let channels = [signal.to_vec()];
        let recording = Recording { rate_hz: EYES_HZ, begin_ns: 0, channels: &channels };
        let whole = whole(&Settings::default(), &recording)?;
        named(&*whole.windows, &whole.windows.measure(recording.span()), name)
    };
    let alpha = (of(closed, "EEG_AlphaRel")?, of(open, "EEG_AlphaRel")?);
    let engagement = (of(closed, "EEG_Engagement")?, of(open, "EEG_Engagement")?);
    let live = (live_alpha(closed)?, live_alpha(open)?);
    let above = |what: &str, (closed, open): (f64, f64)| {
        verdict(
            closed > open,
            &format!("{what}, eyes closed {closed:.3} (bar above {open:.3} open)"),
        )
    };
    let below =
        format!("engagement, eyes closed {:.2} (bar below {:.2} open)", engagement.0, engagement.1);
    Ok(above("relative alpha", alpha)
        & above("relative alpha live, median window of 30 s", live)
        & verdict(engagement.0 < engagement.1, &below))
}

/// Returns the median relative alpha over windows of 30 s, requested each second as samples arrive.
fn live_alpha(signal: &[f64]) -> Result<f64, Box<dyn Error>> {
    let mut live = causal(&Settings::default(), EYES_HZ)?;
    let mut values = Vec::new();
    for (k, &sample) in signal.iter().enumerate() {
        let at_ns = (k as f64 / EYES_HZ * 1e9) as i64;
        live.push(at_ns, &[sample]);
        if k % 125 == 0 && k >= 30 * 125 {
            let span = Span { begin_ns: at_ns - 30_000_000_000, end_ns: at_ns };
            values.extend(named(&*live, &live.measure(span), "EEG_AlphaRel"));
            live.forget(span.begin_ns);
        }
    }
    teampulse_signal::robust::median(&values).ok_or_else(|| "measure a window".into())
}

fn blinks(board: &[Vec<f64>]) -> Result<bool, Box<dyn Error>> {
    let names = ["Fp1", "Fp2", "C3", "C4", "T5", "T6", "O1", "O2"].map(ToString::to_string);
    let settings = Settings { channels: names.to_vec(), ..Settings::default() };
    let recording = Recording { rate_hz: OPENBCI_HZ, begin_ns: 0, channels: board };
    let after = whole(&settings, &recording)?.events;
    let mut live = causal(&settings, OPENBCI_HZ)?;
    let mut events = Vec::new();
    for k in 0..recording.len() {
        let sample: Vec<f64> = board.iter().map(|channel| channel[k]).collect();
        live.push(recording.time_ns(k as f64), &sample);
        events.extend(std::iter::from_fn(|| live.next_event()));
    }
    let mut met = true;
    for (how, events) in [("whole", after), ("causal", events)] {
        let found: Vec<f64> = events.iter().map(|event| event.sample / OPENBCI_HZ).collect();
        let agreement = matched(&SEEN_SECS, &found, NEAR_SECS);
        let between = found.iter().filter(|&&secs| (20.0..75.0).contains(&secs)).count();
        let f1 = 100.0 * agreement.f1();
        met &= verdict(
            f1 >= 90.0 && between == 0,
            &format!(
                "blinks read off a plot, {how}: F1 {f1:.1} % ({} of {}, {} more; bar 90 %), in a minute of alpha {between} (bar 0)",
                agreement.hits,
                SEEN_SECS.len(),
                agreement.extra,
            ),
        );
    }
    Ok(met)
}

/// Checks that the more white noise is added to a recording, the lower its quality is.
fn noise(signal: &[f64]) -> Result<bool, Box<dyn Error>> {
    let mean = signal.iter().sum::<f64>() / signal.len() as f64;
    let rms = (signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / signal.len() as f64).sqrt();
    let mut qualities = Vec::new();
    for decibel in [-6.0, 0.0, 6.0, 12.0, 24.0] {
        let scale = rms / 10f64.powf(decibel / 20.0) * 3f64.sqrt();
        let noisy: Vec<f64> =
            signal.iter().enumerate().map(|(k, value)| value + scale * even_noise(k)).collect();
        qualities.push(Quality::of(&noisy, EYES_HZ)?.combined());
    }
    let texts: Vec<String> = qualities.iter().map(|quality| format!("{quality:.3}")).collect();
    Ok(verdict(
        qualities.is_sorted_by(|a, b| a < b),
        &format!("quality at −6, 0, 6, 12, 24 dB: {} (bar rising)", texts.join(" ")),
    ))
}

/// Returns uniform noise between −1 and 1.
fn even_noise(k: usize) -> f64 {
    let bits = (k as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((bits ^ (bits >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 40) as f64 / 8_388_608.0 - 1.0
}

/// Measures an hour of four channels at 256 Hz: its spectra, and the whole live analysis.
fn speed() -> Result<bool, Box<dyn Error>> {
    let noise =
        |channel: usize| (0..3600 * 256).map(|k| 40.0 * even_noise(4 * k + channel)).collect();
    let channels = [0, 1, 2, 3].map(noise);
    let mut welch_secs = f64::INFINITY;
    for _ in 0..RUNS {
        let spectra = || {
            channels.iter().try_for_each(|channel: &Vec<f64>| {
                spectrum(channel, HEADBAND_HZ).map(|spectrum| drop(black_box(spectrum)))
            })
        };
        welch_secs = welch_secs.min(secs_of(spectra)?);
    }
    let percent = secs_of(|| live_hour(&channels))? / 3600.0 * 100.0;
    let live = "live, 4 × 256 Hz, windows of 30, 60 and 300 s each second";
    Ok(verdict(
        welch_secs <= SCIPY_SECS,
        &format!("Welch of an hour of 4 × 256 Hz: {welch_secs:.3} s (bar SciPy's {SCIPY_SECS} s)"),
    ) & verdict(percent < 1.0, &format!("{live}: {percent:.3} % of a core (bar 1 %)")))
}

#[expect(clippy::disallowed_methods, reason = "measures how long a computation takes")]
fn secs_of(job: impl FnOnce() -> Result<(), SignalError>) -> Result<f64, SignalError> {
    let begin = Instant::now();
    job()?;
    Ok(begin.elapsed().as_secs_f64())
}

fn live_hour(channels: &[Vec<f64>; 4]) -> Result<(), SignalError> {
    let names = ["TP9", "AF7", "AF8", "TP10"].map(ToString::to_string);
    let settings = Settings { channels: names.to_vec(), ..Settings::default() };
    let mut live = causal(&settings, HEADBAND_HZ)?;
    let [one, two, three, four] = channels;
    let samples = one.iter().zip(two).zip(three.iter().zip(four));
    for (k, ((one, two), (three, four))) in samples.enumerate() {
        let end_ns = k as i64 * 1_000_000_000 / 256;
        live.push(end_ns, &[*one, *two, *three, *four]);
        if k % 256 == 0 {
            let begin_ns = |secs: i64| end_ns - secs * 1_000_000_000;
            for secs in [30, 60, 300] {
                black_box(live.measure(Span { begin_ns: begin_ns(secs), end_ns }));
            }
            live.forget(begin_ns(300));
        }
    }
    Ok(())
}
