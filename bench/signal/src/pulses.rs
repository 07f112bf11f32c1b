//! Synthetic pulse waves.

use std::f64::consts::TAU;

/// Returns the wave of beats [s] at a rate, with breathing, drift and a little noise, and the positions of its peaks
/// [samples].
///
/// A pulse is a Gaussian rise and fall with a lower diastolic wave and a run-off. The shorter the interval before a
/// beat, the weaker its pulse, because the heart was less full.
pub fn waves(beats_secs: &[f64], rate_hz: f64) -> (Vec<f64>, Vec<f64>) {
    let peaks_secs: Vec<f64> = beats_secs.iter().map(|beat| beat + 0.25).collect();
    let mut gaps: Vec<f64> = beats_secs.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.insert(0, 0.8);
    let mut sorted = gaps.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let usual = sorted[sorted.len() / 2];
    let strength = |place: usize| {
        let breath = 1.0 + 0.15 * (TAU * 0.25 * beats_secs[place]).sin();
        (0.4 + 0.75 * gaps[place] / usual).clamp(0.35, 1.4) * breath
    };
    let count = beats_secs.last().map_or(0, |last| ((last + 1.0) * rate_hz) as usize);
    let mut signal: Vec<f64> = (0..count).map(|k| background(k as f64 / rate_hz, k)).collect();
    for (place, &peak) in peaks_secs.iter().enumerate() {
        let begin = ((peak - 0.6).max(0.0) * rate_hz) as usize;
        let end = (((peak + 1.2) * rate_hz) as usize).min(count);
        for (k, value) in signal.iter_mut().enumerate().take(end).skip(begin) {
            *value += strength(place) * pulse(k as f64 / rate_hz - peak);
        }
    }
    let places = peaks_secs.iter().map(|peak| peak * rate_hz);
    (signal, places.filter(|&place| place < count as f64).collect())
}

fn background(secs: f64, k: usize) -> f64 {
    let wave = |hz: f64, phase: f64| (TAU * hz * secs + phase).sin();
    let noise = (k * k % 977 * 31 % 1009) as f64 / 1009.0 - 0.5;
    0.3 * wave(0.07, 0.0) + 0.2 * wave(0.25, 1.0) + 0.2 * wave(0.11, 2.0) + 0.1 * noise
}

fn pulse(secs: f64) -> f64 {
    let bump = |at: f64, width: f64| (-((secs - at) / width).powi(2) / 2.0).exp();
    let width = if secs < 0.0 { 0.07 } else { 0.12 };
    let after = secs.max(0.0);
    let run_off = 0.35 * (-after / 0.35).exp() * (1.0 - (-after / 0.08).exp());
    bump(0.0, width) + 0.2 * bump(0.32, 0.09) + run_off
}
