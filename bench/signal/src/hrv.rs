//! Heart rate variability and the correction of intervals, against plain formulas and NeuroKit2.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use serde_json::Value;
use teampulse_signal::hrv::{
    Measure, asymmetry, detrended_fluctuation, dfa_alpha, entropies, fragmentation, geometric,
    poincare, time_domain,
};
use teampulse_signal::intervals::{Artefacts, Beats, Correction, Kind};

use crate::golden::{Worst, golden, number, numbers, verdict};
use crate::records::{RATE_HZ, column};

/// Of the golden records of MIT-BIH.
const RECORDS: [&str; 6] = ["100", "105", "106", "119", "203", "208"];
/// What NeuroKit2 lacks, or defines otherwise.
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
/// How often the nonlinear features are computed; the best time counts.
const RUNS: usize = 50;
/// Of the nonlinear features of five minutes.
const MOST_MS: f64 = 5.0;

/// Prints figures with their bars; whether all were met.
pub fn measure(data: &Path) -> Result<bool, Box<dyn Error>> {
    let rest = golden(data, "rest_rri_ms.json")?;
    let rr_ms = column(&data.join("rr_rest/rest_rri_ms.txt"))?;
    let met = [
        formulas(data, &rest, &rr_ms)?,
        neurokit(&rest["neurokit_hrv_first300"], &rr_ms[..300])?,
        exponents(&rest["neurokit_hrv_first300"], &rr_ms[..300])?,
        artefacts(&rest["kubios_artifacts"], &rr_ms),
        injected(&rr_ms)?,
        speed(&rr_ms),
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

/// What NeuroKit2 defines as we do: all but pNN, SD2 and what follows from it, TINN and scales.
fn neurokit(values: &Value, rr_ms: &[f64]) -> Result<bool, Box<dyn Error>> {
    let mut worst = Worst::default();
    for Measure { name, value, .. } in measures(rr_ms) {
        if !OURS_ALONE.contains(&name) {
            worst.see(name, value, number(values, name)?);
        }
    }
    Ok(worst.print("NeuroKit2 where its definitions are ours", 1e-9))
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

/// At NeuroKit2's scales: 4 to 11, and 12 to a tenth of the beats.
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
    verdict(same, &format!("artefacts at rest: {counts}, beat for beat those of NeuroKit2"))
}

/// Missed, extra, early and late beats in turn, one after each 40.
fn injected(rr_ms: &[f64]) -> Result<bool, Box<dyn Error>> {
    let natural = Correction::default().correct(&Beats::detected(&beats_secs(rr_ms)));
    let clean = natural.beats;
    let mut times = clean.times_secs().to_vec();
    let mut at_secs = Vec::new();
    let places: Vec<usize> = (20..times.len() - 20).step_by(40).collect();
    for (turn, place) in places.into_iter().enumerate().rev() {
        at_secs.push(times[place]);
        match turn % 4 {
            0 => drop(times.remove(place)),
            1 => times.insert(place, times[place - 1] + 0.4 * (times[place] - times[place - 1])),
            2 => times[place] -= 0.3,
            _ => times[place] += 0.3,
        }
    }
    let artefacts = Artefacts::among(&times);
    let near = |at: &&f64| artefacts.found.iter().any(|each| (times[each.beat] - **at).abs() < 1.5);
    let found = at_secs.iter().filter(near).count();
    let corrected = Correction::default().correct(&Beats::detected(&times));
    let rmssd = |beats: &Beats| time_domain(&beats.intervals_ms()).map(|each| each.rmssd_ms);
    let before = rmssd(&clean).ok_or("find intervals")?;
    let with = rmssd(&Beats::detected(&times)).ok_or("find intervals")?;
    let after = rmssd(&corrected.beats).ok_or("find intervals")?;
    let off = 100.0 * (after / before - 1.0);
    let count = at_secs.len();
    let all_found = verdict(
        found as f64 >= 0.95 * count as f64,
        &format!("injected artefacts: {found} of {count} found (bar 95 %)"),
    );
    let restored = verdict(
        off.abs() < 5.0,
        &format!(
            "RMSSD {before:.2} ms, {with:.2} with artefacts, {after:.2} corrected: {off:+.1} % (bar 5 %)"
        ),
    );
    Ok(all_found && restored)
}

#[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
fn speed(rr_ms: &[f64]) -> bool {
    let beats = rr_ms.iter().scan(0.0, |sum, each| {
        *sum += each;
        Some(*sum)
    });
    let five_minutes = beats.take_while(|&end_ms| end_ms <= 300_000.0).count();
    let mut best_ms = f64::INFINITY;
    for _ in 0..RUNS {
        let begin = Instant::now();
        let features = nonlinear(&rr_ms[..five_minutes]);
        let exponents = detrended_fluctuation(&rr_ms[..five_minutes]);
        std::hint::black_box((features, exponents));
        best_ms = best_ms.min(begin.elapsed().as_secs_f64() * 1000.0);
    }
    verdict(
        best_ms <= MOST_MS,
        &format!(
            "nonlinear features of 5 minutes, {five_minutes} beats: {best_ms:.3} ms (bar {MOST_MS} ms; NeuroKit2 241 ms)"
        ),
    )
}
