//! Heart rate variability and the correction of intervals, compared with plain formulas and NeuroKit2.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use serde_json::Value;
use teampulse_signal::analysis::{Span, Windows};
use teampulse_signal::hrv::{
    Domain, HeartWindows, Measure, asymmetry, detrended_fluctuation, dfa_alpha, entropies,
    fragmentation, geometric, poincare, time_domain,
};
use teampulse_signal::intervals::{Artefacts, Beats, Correction, Kind};

use crate::golden::{Worst, golden, number, numbers, verdict};
use crate::records::{RATE_HZ, column};

/// The golden records of MIT-BIH.
const RECORDS: [&str; 6] = ["100", "105", "106", "119", "203", "208"];
/// Features that NeuroKit2 lacks or defines differently.
const OURS_ALONE: [&str; 14] = [
    "HRV_NN50",
    "HRV_pNN50",
    "HRV_pNN20",
    "HRV_MeanHR",
    "HRV_StdHR",
    "HRV_TINN",
    "HRV_SD2",
    "HRV_SD1SD2",
    "HRV_S",
    "HRV_CSI",
    "HRV_CVI",
    "HRV_CSI_Modified",
    "HRV_DFA_alpha1",
    "HRV_DFA_alpha2",
];
/// The number of times the nonlinear features are computed; the best time counts.
const RUNS: usize = 50;
/// The bar for the nonlinear features of five minutes [ms].
const MOST_MS: f64 = 5.0;
/// The bar for live windows [% of a core].
const MOST_LIVE_PERCENT: f64 = 0.5;

/// Prints the figures with their bars; returns whether all bars were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let rest = golden(data, "rest_rri_ms.json")?;
    let rr_ms = column(&data.join("rr_rest/rest_rri_ms.txt"))?;
    let met = [
        formulas(data, &rest, &rr_ms)?,
        neurokit(&rest["neurokit_hrv_first300"], &rr_ms[..300])?,
        exponents(&rest["neurokit_hrv_first300"], &rr_ms[..300])?,
        artefacts(&rest["kubios_artifacts"], &rr_ms),
        injected(&rr_ms)?,
        spared(data)?,
        disturbed(data)?,
        speed(&rr_ms),
        live(&rr_ms),
    ];
    Ok(met.iter().all(|&each| each))
}

fn formulas(data: &Path, rest: &Value, rr_ms: &[f64]) -> Result<bool, Box<dyn Error>> {
    let mut worst = Worst::default();
    see_formulas(&mut worst, &rest["formulas"], rr_ms)?;
    for record in RECORDS {
        let table = std::fs::read_to_string(data.join(format!("ecg_mitdb/{record}.beats.csv")))?;
        let beats = table.lines().skip(1).filter_map(|line| line.split(',').next()?.parse().ok());
        let beats: Vec<f64> = beats.collect();
        let rr_ms: Vec<f64> =
            beats.windows(2).map(|pair| (pair[1] - pair[0]) / RATE_HZ * 1000.0).collect();
        let values = golden(data, &format!("mitdb_{record}.json"))?;
        see_formulas(&mut worst, &values["hrv_from_expert_beats"], &rr_ms)?;
    }
    Ok(worst.print("formulas, at rest and of six records of MIT-BIH", 1e-9))
}

fn see_formulas(worst: &mut Worst, values: &Value, rr_ms: &[f64]) -> Result<(), Box<dyn Error>> {
    let time = time_domain(rr_ms).ok_or("find intervals")?;
    let ellipse = poincare(rr_ms).ok_or("find intervals")?;
    let ours = [
        ("n", time.n as f64),
        ("MeanNN", time.mean_nn_ms),
        ("MedianNN", time.median_nn_ms),
        ("SDNN", time.sdnn_ms),
        ("RMSSD", time.rmssd_ms),
        ("SDSD", time.sdsd_ms),
        ("NN50", time.nn50 as f64),
        ("pNN50_over_diffs", time.pnn50_percent),
        ("pNN20_over_diffs", time.pnn20_percent),
        ("MeanHR_from_mean", time.hr_of_mean_nn_bpm),
        ("MeanHR_inst", time.mean_hr_bpm),
        ("CVNN", time.cvnn),
        ("SD1", ellipse.sd1_ms),
        ("SD2", ellipse.sd2_ms),
    ];
    for (name, value) in ours {
        worst.see(name, value, number(values, name)?);
    }
    Ok(())
}

/// Compares the features that NeuroKit2 defines as we do: all but pNN, SD2 and what depends on it, TINN and scales.
fn neurokit(values: &Value, rr_ms: &[f64]) -> Result<bool, Box<dyn Error>> {
    let mut worst = Worst::default();
    for Measure { name, value, .. } in measures(rr_ms) {
        if !OURS_ALONE.contains(&name) {
            worst.see(name, value, number(values, name)?);
        }
    }
    Ok(worst.print("NeuroKit2, features with the same definition", 1e-9))
}

fn measures(rr_ms: &[f64]) -> Vec<Measure> {
    let time = time_domain(rr_ms).map(|each| each.measures());
    let shape = geometric(rr_ms).map(|each| each.measures());
    let fluctuation = detrended_fluctuation(rr_ms).map(|each| each.measures());
    [time, shape, fluctuation].into_iter().flatten().flatten().chain(nonlinear(rr_ms)).collect()
}

fn nonlinear(rr_ms: &[f64]) -> Vec<Measure> {
    let all = [
        poincare(rr_ms).map(|each| each.measures()),
        asymmetry(rr_ms).map(|each| each.measures()),
        fragmentation(rr_ms).map(|each| each.measures()),
        entropies(rr_ms).map(|each| each.measures()),
    ];
    all.into_iter().flatten().flatten().collect()
}

/// Compares the exponents at NeuroKit2's scales: 4 to 11, and 12 to a tenth of the beats.
fn exponents(values: &Value, rr_ms: &[f64]) -> Result<bool, Box<dyn Error>> {
    let mut worst = Worst::default();
    let long = 12..=(rr_ms.len() + 1) / 10;
    for (name, scales) in [("HRV_DFA_alpha1", 4..=11), ("HRV_DFA_alpha2", long)] {
        let ours = dfa_alpha(rr_ms, &scales).ok_or("find fluctuation")?;
        worst.see(name, ours, number(values, name)?);
    }
    Ok(worst.print("fluctuation exponents of NeuroKit2 at its scales", 1e-6))
}

fn beats_secs(rr_ms: &[f64]) -> Vec<f64> {
    let mut time_ms = 0.0;
    let beat = |interval: f64| {
        time_ms += interval;
        time_ms / 1000.0
    };
    std::iter::once(0.0).chain(rr_ms.iter().copied()).map(beat).collect()
}

fn artefacts(values: &Value, rr_ms: &[f64]) -> bool {
    let artefacts = Artefacts::among(&beats_secs(rr_ms));
    let kinds = [
        ("ectopic", Kind::Ectopic),
        ("missed", Kind::Missed),
        ("extra", Kind::Extra),
        ("longshort", Kind::LongShort),
    ];
    let same = kinds.iter().all(|(name, kind)| {
        let ours = artefacts.found.iter().filter(|each| each.kind == *kind);
        ours.map(|each| each.beat as f64).eq(numbers(&values[*name]))
    });
    let counts = kinds.map(|(name, kind)| format!("{} {name}", artefacts.count(kind))).join(", ");
    verdict(same, &format!("artefacts at rest: {counts}, the same for each beat as NeuroKit2's"))
}

/// The artefacts that are injected: an interval is halved (missed, extra), a beat is shifted by a share of its
/// interval, or all beats after it are.
const WRONG: [(&str, Wrong); 8] = [
    ("missed", Wrong::Missed),
    ("extra", Wrong::Extra),
    ("early by 35 %", Wrong::Astray(-0.35)),
    ("early by 20 %", Wrong::Astray(-0.2)),
    ("late by 20 %", Wrong::Astray(0.2)),
    ("long by 60 %", Wrong::Longer(0.6)),
    ("long by 30 %", Wrong::Longer(0.3)),
    ("short by 30 %", Wrong::Longer(-0.3)),
];

#[derive(Clone, Copy)]
enum Wrong {
    Missed,
    Extra,
    Astray(f64),
    Longer(f64),
}

impl Wrong {
    /// Applies the artefact to the beat at an index.
    fn happen(self, times: &mut Vec<f64>, place: usize) {
        let interval = times[place] - times[place - 1];
        match self {
            Wrong::Missed => drop(times.remove(place)),
            Wrong::Extra => times.insert(place, times[place - 1] + 0.4 * interval),
            Wrong::Astray(share) => times[place] += share * interval,
            Wrong::Longer(share) => {
                times[place..].iter_mut().for_each(|each| *each += share * interval);
            }
        }
    }
}

/// Injects one kind of artefact after every 40 beats, into beats at rest and of a simulated heart.
fn injected(rr_ms: &[f64]) -> Result<bool, Box<dyn Error>> {
    let natural = Correction::default().correct(&Beats::detected(&beats_secs(rr_ms)));
    let present = natural.beats.intervals_ms().into_iter().filter(|each| each.is_finite());
    let series = [("at rest", present.collect()), ("simulated", simulated_ms(1000))];
    let mut met = true;
    for (of, clean_ms) in series {
        for (what, wrong) in WRONG {
            met &= inject(&format!("{what}, {of}"), wrong, &beats_secs(&clean_ms))?;
        }
    }
    Ok(met)
}

/// Corrects segments of five minutes of beats that experts call normal; there, whatever the correction removes is true
/// variability.
fn spared(data: &Path) -> Result<bool, Box<dyn Error>> {
    let mut changes = Vec::new();
    for segment in all_normal_segments(data)? {
        let beats = Beats::detected(&segment);
        let corrected = Correction::default().correct(&beats).beats;
        let (before, after) = rmssd(&beats).zip(rmssd(&corrected)).ok_or("find intervals")?;
        changes.push(100.0 * (after / before - 1.0));
    }
    changes.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| changes[((changes.len() - 1) as f64 * share) as usize];
    let (median, tenth) = (at(0.5), at(0.1));
    Ok(verdict(
        median.abs() <= 2.0 && tenth.abs() <= 5.0,
        &format!(
            "correction of {} normal segments: median change of RMSSD {median:+.1} % (bar 2 %), \
             {tenth:+.1} % in the lowest tenth (bar 5 %)",
            changes.len()
        ),
    ))
}

/// Injects one artefact per 20 beats into the same segments, with kinds in turn; measures how far the corrected RMSSD
/// is from the RMSSD without artefacts.
fn disturbed(data: &Path) -> Result<bool, Box<dyn Error>> {
    let mut errors = Vec::new();
    for segment in all_normal_segments(data)? {
        let mut times = segment.clone();
        let places: Vec<usize> = (10..times.len() - 10).step_by(20).collect();
        for (turn, &place) in places.iter().enumerate().rev() {
            WRONG[turn % WRONG.len()].1.happen(&mut times, place);
        }
        let corrected = Correction::default().correct(&Beats::detected(&times)).beats;
        let clean = rmssd(&Beats::detected(&segment));
        let (clean, after) = clean.zip(rmssd(&corrected)).ok_or("find intervals")?;
        errors.push(100.0 * (after / clean - 1.0).abs());
    }
    errors.sort_unstable_by(f64::total_cmp);
    let median = errors[errors.len() / 2];
    Ok(verdict(
        median <= 5.0,
        &format!(
            "injected, one in 20 of {} normal segments: median error of RMSSD {median:.1} % (bar 5 %)",
            errors.len()
        ),
    ))
}

fn rmssd(beats: &Beats) -> Option<f64> {
    time_domain(&beats.intervals_ms()).map(|each| each.rmssd_ms)
}

fn all_normal_segments(data: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let mut segments = Vec::new();
    for entry in std::fs::read_dir(data.join("ecg_mitdb"))? {
        let path = entry?.path();
        if path.to_string_lossy().ends_with(".beats.csv") {
            segments.extend(normal_segments(&std::fs::read_to_string(path)?));
        }
    }
    Ok(segments)
}

/// Returns the times [s] of normal beats with no other beats between them, 128 to 400 at a time.
fn normal_segments(table: &str) -> Vec<Vec<f64>> {
    let beats = table.lines().skip(1).filter_map(|line| line.split_once(','));
    let beats: Vec<(f64, bool)> = beats
        .filter_map(|(sample, kind)| Some((sample.parse::<f64>().ok()? / RATE_HZ, kind == "N")))
        .collect();
    let runs = beats.chunk_by(|one, other| one.1 && other.1);
    let pieces = runs.flat_map(|run| run.chunks(400)).filter(|piece| piece.len() >= 128);
    pieces.map(|piece| piece.iter().map(|beat| beat.0).collect()).collect()
}

fn inject(what: &str, wrong: Wrong, clean: &[f64]) -> Result<bool, Box<dyn Error>> {
    let mut times = clean.to_vec();
    let places: Vec<usize> = (20..times.len() - 20).step_by(40).collect();
    places.iter().rev().for_each(|&place| wrong.happen(&mut times, place));
    let now = |(turn, place): (usize, &usize)| match wrong {
        Wrong::Missed => place - turn,
        Wrong::Extra => place + turn,
        Wrong::Astray(_) | Wrong::Longer(_) => *place,
    };
    let artefacts = Artefacts::among(&times);
    let is_found =
        |place: &usize| artefacts.found.iter().any(|each| each.beat.abs_diff(*place) <= 1);
    let found = places.iter().enumerate().map(now).filter(is_found).count();
    let corrected = Correction::default().correct(&Beats::detected(&times));
    let before = rmssd(&Beats::detected(clean)).ok_or("find intervals")?;
    let with = rmssd(&Beats::detected(&times)).ok_or("find intervals")?;
    let after = rmssd(&corrected.beats).ok_or("find intervals")?;
    let (off, count) = (100.0 * (after / before - 1.0), places.len());
    Ok(verdict(
        found as f64 >= 0.95 * count as f64 && off.abs() < 5.0,
        &format!(
            "injected, {what}: {found} of {count} found (bar 95 %), RMSSD {before:.1} ms, \
             {with:.1} with them, {after:.1} corrected: {off:+.1} % (bar 5 %)"
        ),
    ))
}

/// Simulates a heart at rest with breathing and Mayer waves, and 4 ms of jitter.
fn simulated_ms(count: u32) -> Vec<f64> {
    let (mut secs, mut state) = (0.0, 1u32);
    let mut interval = |_| {
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
        };
        let jitter: f64 = (0..12).map(|_| uniform()).sum();
        let wave = |hz: f64| (std::f64::consts::TAU * hz * secs).sin();
        let interval = 880.0 + 45.0 * wave(0.25) + 30.0 * wave(0.095) + 4.0 * jitter;
        secs += interval / 1000.0;
        interval
    };
    (0..count).map(&mut interval).collect()
}

fn speed(rr_ms: &[f64]) -> bool {
    let beats = rr_ms.iter().scan(0.0, |sum, each| {
        *sum += each;
        Some(*sum)
    });
    let five_minutes = beats.take_while(|&end_ms| end_ms <= 300_000.0).count();
    let best_ms = best_ms(|| {
        let features = nonlinear(&rr_ms[..five_minutes]);
        let exponents = detrended_fluctuation(&rr_ms[..five_minutes]);
        std::hint::black_box((features, exponents));
    });
    verdict(
        best_ms <= MOST_MS,
        &format!(
            "nonlinear features of 5 minutes, {five_minutes} beats: {best_ms:.3} ms (bar {MOST_MS} ms; NeuroKit2 241 ms)"
        ),
    )
}

/// Measures the time domain of 30, 60 and 300 s each second, and all features every ten seconds.
fn live(rr_ms: &[f64]) -> bool {
    let mut heart = HeartWindows::causal();
    for at_secs in beats_secs(rr_ms) {
        heart.push((at_secs * 1e9) as i64);
    }
    let spans = [30, 60, 300]
        .map(|secs| Span { begin_ns: (400 - secs) * 1_000_000_000, end_ns: 400 * 1_000_000_000 });
    let [time_ms, all_ms] = [
        best_ms(|| {
            for span in spans {
                std::hint::black_box(heart.measure_domain(span, Domain::Time));
            }
        }),
        best_ms(|| {
            for span in spans {
                std::hint::black_box(heart.measure(span));
            }
        }),
    ];
    let percent = (time_ms + all_ms / 10.0) / 1000.0 * 100.0;
    verdict(
        percent < MOST_LIVE_PERCENT,
        &format!(
            "windows of 30, 60 and 300 s: time domain {time_ms:.3} ms, everything {all_ms:.3} ms; \
             each second and each ten {percent:.3} % of a core (bar {MOST_LIVE_PERCENT} %)"
        ),
    )
}

#[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
fn best_ms(work: impl Fn()) -> f64 {
    let mut best_ms = f64::INFINITY;
    for _ in 0..RUNS {
        let begin = Instant::now();
        work();
        best_ms = best_ms.min(begin.elapsed().as_secs_f64() * 1000.0);
    }
    best_ms
}
