//! Skin conductance compared with NeuroKit2, and found responses compared with synthetic ones.

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;

use serde_json::Value;
use teampulse_signal::analysis::{Event, Recording};
use teampulse_signal::eda::analysis::{Phasic, Settings, causal, whole};
use teampulse_signal::eda::{Split, Threshold, clean, cvx_eda, find_responses, high_pass_split};

use crate::golden::{golden, numbers, verdict};
use crate::records::column;

/// Files of golden values, with the recordings that they were computed from.
const RECORDED: [&str; 2] = ["eda_1000hz.json", "bio100_eda.json"];
/// The bars for the phasic part of cvxEDA: 1 − r, and the greatest difference as a share of the range.
const CVX_BARS: (f64, f64) = (1e-5, 1e-3);
/// The bar for the high-pass split; golden values have twelve digits.
const HIGH_PASS_BAR: f64 = 1e-9;
/// The rate of the golden responses [Hz].
const GOLDEN_HZ: f64 = 50.0;
const LEAST_FOUND: f64 = 0.95;
const MOST_OFF: f64 = 0.1;

/// Prints the figures with their bars; returns whether all bars were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let mut met = true;
    for name in RECORDED {
        met &= splits(name, &golden(data, name)?)?;
    }
    let bio = &golden(data, "bio100_eda.json")?;
    let table = std::fs::read_to_string(data.join("multi_bio_100hz/bio_100Hz.csv"))?;
    let cell = |line: &str| line.split(',').nth(1)?.trim().parse().ok();
    let signal: Vec<f64> = table.lines().filter_map(cell).collect();
    met &= responses("bio_100Hz.csv at 50 Hz", &signal, 100.0, &bio["nk_default"])?;
    let counts = &golden(data, "eda_1000hz.json")?["nk_default"];
    let signal = column(&data.join("eda/eda_1000hz.txt"))?;
    met &= responses("eda_1000hz.txt at 50 Hz", &signal, 1000.0, counts)?;
    met &= wristband(&column(&data.join("e4_devicely/EDA.csv"))?[2..])?;
    for rate_hz in [4.0, 32.0, 128.0] {
        for noise_us in [0.0, 0.002, 0.005] {
            met &= made_up(rate_hz, noise_us)?;
        }
    }
    Ok(met)
}

fn splits(name: &str, values: &Value) -> Result<bool, Box<dyn Error>> {
    let input = numbers(&values["input_4hz"]);
    let cvx = cvx_eda(&input, 4.0)?;
    let high_pass = high_pass_split(&input, 4.0)?;
    let [off, high_off] = [(&cvx, "cvxeda"), (&high_pass, "highpass")].map(|(split, method)| {
        let tonic = numbers(&values[format!("tonic_{method}")]);
        let phasic = numbers(&values[format!("phasic_{method}")]);
        differences(split, &Split { tonic, phasic })
    });
    let (unlike, most) = CVX_BARS;
    let figure = |(unlike, share): (f64, f64)| {
        format!("1 - r = {unlike:.1e}, at most {share:.1e} of the range off")
    };
    let met = [
        verdict(
            off.0 <= unlike && off.1 <= most,
            &format!("{name}: cvxEDA {} (bars {unlike:.0e}, {most:.0e})", figure(off)),
        ),
        verdict(
            high_off.1 <= HIGH_PASS_BAR,
            &format!("{name}: high-pass {} (bar {HIGH_PASS_BAR:.0e})", figure(high_off)),
        ),
    ];
    Ok(met == [true; 2])
}

/// Returns 1 − the correlation of the phasic parts, and the greatest difference of both parts as a share of the range
/// of the phasic one.
fn differences(ours: &Split, theirs: &Split) -> (f64, f64) {
    let range = theirs.phasic.iter().copied().fold(f64::MIN, f64::max)
        - theirs.phasic.iter().copied().fold(f64::MAX, f64::min);
    let most = |ours: &[f64], theirs: &[f64]| {
        let off = ours.iter().zip(theirs).map(|(ours, theirs)| (ours - theirs).abs());
        if ours.len() == theirs.len() { off.fold(0.0, f64::max) } else { f64::NAN }
    };
    let off = most(&ours.phasic, &theirs.phasic).max(most(&ours.tonic, &theirs.tonic));
    (1.0 - correlation(&ours.phasic, &theirs.phasic), off / range)
}

fn correlation(left: &[f64], right: &[f64]) -> f64 {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let (a, b) = (mean(left), mean(right));
    let sum = |x: &[f64], y: &[f64], (a, b): (f64, f64)| {
        x.iter().zip(y).map(|(x, y)| (x - a) * (y - b)).sum::<f64>()
    };
    sum(left, right, (a, b)) / (sum(left, left, (a, a)) * sum(right, right, (b, b))).sqrt()
}

/// Compares the responses with NeuroKit2's, which was given the signal resampled to 50 Hz by SciPy's `resample_poly`.
fn responses(
    what: &str,
    signal: &[f64],
    rate_hz: f64,
    theirs: &Value,
) -> Result<bool, Box<dyn Error>> {
    let few = every_so_often(signal, (rate_hz / GOLDEN_HZ) as usize);
    let split = high_pass_split(&clean(&few, GOLDEN_HZ)?, GOLDEN_HZ)?;
    let found = find_responses(&split.phasic, GOLDEN_HZ, Threshold::Relative(0.1))?;
    let list = |name: &str| -> Vec<Option<f64>> {
        theirs[name].as_array().into_iter().flatten().map(Value::as_f64).collect()
    };
    let peaks = list("SCR_Peaks").into_iter().zip(list("SCR_Onsets"));
    let peaks: Vec<(f64, f64)> = peaks.filter_map(|(peak, onset)| Some((peak?, onset?))).collect();
    let most = found
        .iter()
        .zip(&peaks)
        .map(|(ours, (peak, onset))| (ours.peak - peak).abs().max((ours.onset - onset).abs()));
    let most = most.fold(0.0, f64::max);
    Ok(verdict(
        found.len() == peaks.len() && most == 0.0,
        &format!(
            "{what}: {} responses, NeuroKit2 {}, at most {most} samples apart (bar 0)",
            found.len(),
            peaks.len()
        ),
    ))
}

/// Resamples like SciPy's `resample_poly(signal, 1, every)`: 20·every + 1 weights, a Kaiser window with β = 5, zeros
/// beyond the ends.
fn every_so_often(signal: &[f64], every: usize) -> Vec<f64> {
    let half = 10 * every;
    let weight = |k: usize| {
        let place = k as f64 - half as f64;
        let x = std::f64::consts::PI * place / every as f64;
        let sinc = if k == half { 1.0 } else { x.sin() / x };
        sinc * bessel_0(5.0 * (1.0 - (place / half as f64).powi(2)).max(0.0).sqrt())
    };
    let weights: Vec<f64> = (0..=2 * half).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    let at = |middle: usize| {
        let terms = weights
            .iter()
            .enumerate()
            .filter_map(|(k, weight)| Some(weight * signal.get((middle + k).checked_sub(half)?)?));
        terms.sum::<f64>() / sum
    };
    (0..signal.len()).step_by(every).map(at).collect()
}

/// Returns the modified Bessel function of the first kind and order 0.
fn bessel_0(x: f64) -> f64 {
    let term = |term: &mut f64, k: u32| {
        *term *= (x / 2.0 / f64::from(k)).powi(2);
        Some(*term)
    };
    1.0 + (1..60).scan(1.0, term).sum::<f64>()
}

/// Analyses half a minute before and after a wristband was put on, which is too short for most features.
fn wristband(signal: &[f64]) -> Result<bool, Box<dyn Error>> {
    let channels = [signal.to_vec()];
    let recording = Recording { rate_hz: 4.0, begin_ns: 0, channels: &channels };
    let mut figures = Vec::new();
    let mut met = true;
    for phasic in [Phasic::HighPass, Phasic::CvxEda] {
        let analysed = whole(&Settings { phasic, ..Settings::default() }, &recording)?;
        let measured = analysed.windows.measure(recording.span());
        met &= measured.values.iter().flatten().all(|value| value.is_finite());
        figures.push(format!(
            "{} responses, quality {:.2}",
            analysed.events.len(),
            measured.quality
        ));
    }
    Ok(verdict(met, &format!("e4_devicely: {} by high-pass and cvxEDA", figures.join(", "))))
}

/// The onset [s] and amplitude [µS] of a synthetic response.
struct MadeUp {
    onset_secs: f64,
    amplitude_us: f64,
}

/// Analyses twenty minutes with responses 12 to 25 s apart, of 0.1 to 1 µS, on a level that drifts.
fn made_up(rate_hz: f64, noise_us: f64) -> Result<bool, Box<dyn Error>> {
    let mut random = Random(1);
    let mut truth = Vec::new();
    let mut onset_secs = 10.0;
    while onset_secs < 1180.0 {
        truth.push(MadeUp { onset_secs, amplitude_us: 0.1 + 0.9 * random.share() });
        onset_secs += 12.0 + 13.0 * random.share();
    }
    let sample = |k: u32| {
        let secs = f64::from(k) / rate_hz;
        let near = truth.iter().filter(|each| (0.0..60.0).contains(&(secs - each.onset_secs)));
        let responses = near.map(|each| each.amplitude_us * bateman(secs - each.onset_secs));
        5.0 + (TAU * secs / 300.0).sin()
            + 0.001 * secs
            + responses.sum::<f64>()
            + noise_us * random.normal()
    };
    let signal: Vec<f64> = (0..(1200.0 * rate_hz) as u32).map(sample).collect();
    let channels = [signal];
    let recording = Recording { rate_hz, begin_ns: 0, channels: &channels };
    let cvx = Settings { phasic: Phasic::CvxEda, ..Settings::default() };
    let kinds = [
        ("high-pass", whole(&Settings::default(), &recording)?.events),
        ("cvxEDA", whole(&cvx, &recording)?.events),
        ("causal", live(&recording)?),
    ];
    let scores = kinds.map(|(kind, events)| {
        score(&truth, &events, rate_hz, &format!("{rate_hz} Hz, {noise_us} µS noise, {kind}"))
    });
    Ok(scores == [true; 3])
}

fn live(recording: &Recording<'_>) -> Result<Vec<Event>, Box<dyn Error>> {
    let mut analysis = causal(&Settings::default(), recording.rate_hz)?;
    let mut events = Vec::new();
    for (place, sample) in recording.channels[0].iter().enumerate() {
        analysis.push(recording.time_ns(place as f64), &[*sample]);
        events.extend(analysis.next_event());
    }
    Ok(events)
}

/// Scores found responses. A true response counts as found if a found one peaks within a second of its peak; of these,
/// the mean error of the amplitudes is computed.
fn score(truth: &[MadeUp], events: &[Event], rate_hz: f64, what: &str) -> bool {
    let peak_secs = (2.0f64 / 0.7).ln() * 2.0 * 0.7 / 1.3;
    let found = truth.iter().filter_map(|each| {
        let off = |event: &&Event| (event.sample / rate_hz - each.onset_secs - peak_secs).abs();
        let nearest = events.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        let amplitude_us = nearest.details.iter().find(|(name, _)| *name == "amplitude_us")?.1;
        (off(&nearest) < 1.0).then(|| (amplitude_us / each.amplitude_us - 1.0).abs())
    });
    let off: Vec<f64> = found.collect();
    let (share, mean) =
        (off.len() as f64 / truth.len() as f64, off.iter().sum::<f64>() / off.len() as f64);
    let (others, most) = (events.len() - off.len(), off.iter().copied().fold(0.0, f64::max));
    verdict(
        share >= LEAST_FOUND && mean < MOST_OFF,
        &format!(
            "{what}: {} of {} responses (bar 95 %), {others} others, amplitude {:.1} % off (bar 10 %), at most {:.1} %",
            off.len(),
            truth.len(),
            100.0 * mean,
            100.0 * most
        ),
    )
}

/// Returns a response of height 1.
fn bateman(secs: f64) -> f64 {
    ((-secs / 2.0).exp() - (-secs / 0.7).exp()) / 0.368_9
}

/// Pseudo-random numbers, the same each time.
struct Random(u64);

impl Random {
    fn share(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.share()).ln()).sqrt() * (TAU * self.share()).cos()
    }
}
