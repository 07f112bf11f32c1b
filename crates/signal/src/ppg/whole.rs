//! Pulses of a whole recording.

use super::blocks::{Blocks, Candidate};
use super::clean::clean;
use super::judge::{Judge, Turns, is_diastolic, is_noise, refractory_secs};
use super::pulse::Pulse;
use super::shape::{SHORTEST_RISE_SECS, Wave};
use super::smooth::Smoothing;
use super::working::Grouping;
use crate::error::SignalError;
use crate::gaps::bridged;
use crate::recent::{MEMORY, median};

/// Finds the pulses of a whole PPG at 20 to 2000 Hz, in any unit, with pulses upwards.
///
/// Candidates are detected in the [clean](clean()) signal. A first pass judges them as
/// [`PulseDetector`](super::PulseDetector) does; in the second pass, usual values are known from both sides of each
/// candidate, and of two candidates that are too close the higher is kept. Samples that are not [usable
/// numbers](crate::gaps::is_usable) are bridged; a recording without pulses returns none.
///
/// Returns an error for another rate.
pub fn find_pulses(signal: &[f64], rate_hz: f64) -> Result<Vec<Pulse>, SignalError> {
    let mut grouping = Grouping::new(rate_hz)?;
    let group = grouping.group();
    let working: Vec<f64> = signal.iter().filter_map(|&sample| grouping.push(sample)).collect();
    let pulses = pulses_of(&working, grouping.rate_hz());
    Ok(pulses.into_iter().map(|pulse| pulse.in_groups_of(group)).collect())
}

/// The pulses of a signal at the working rate.
pub(super) fn pulses_of(working: &[f64], rate_hz: f64) -> Vec<Pulse> {
    let (Ok(bridged), Ok(clean)) = (bridged(working), clean(working, rate_hz)) else {
        return Vec::new();
    };
    let candidates = candidates(&clean, rate_hz);
    let chosen = second_pass(&candidates, rate_hz);
    let smoothed = Smoothing::new(rate_hz).smoothed(&bridged);
    let wave = Wave { smoothed: &smoothed, rate_hz };
    let mut floor = 0;
    let pulse = |candidate: &Candidate| {
        let pulse = wave.pulse_near(candidate.place as usize, floor)?;
        floor = pulse.sample.round() as usize;
        let has_risen = pulse.sample >= SHORTEST_RISE_SECS * rate_hz && pulse.amplitude > 0.0;
        has_risen.then_some(pulse)
    };
    chosen.iter().filter_map(pulse).collect()
}

fn candidates(clean: &[f64], rate_hz: f64) -> Vec<Candidate> {
    let mut blocks = Blocks::new(rate_hz);
    let beyond = std::iter::repeat_n(0.0, 2 * blocks.lag() as usize);
    let samples = clean.iter().copied().chain(beyond);
    samples.filter_map(|sample| blocks.push(sample)).collect()
}

fn second_pass(candidates: &[Candidate], rate_hz: f64) -> Vec<Candidate> {
    let mut judge = Judge::new(rate_hz);
    let first: Vec<Candidate> =
        candidates.iter().copied().filter(|candidate| judge.take(*candidate)).collect();
    let heights: Vec<(i64, f64)> = first.iter().map(|each| (each.place, each.height)).collect();
    let cycle =
        |pair: &[Candidate]| (pair[1].place, (pair[1].place - pair[0].place) as f64 / rate_hz);
    let cycles_secs: Vec<(i64, f64)> = first.windows(2).map(cycle).collect();
    let mut chosen: Vec<Candidate> = Vec::with_capacity(first.len());
    let mut turns = Turns::new(rate_hz);
    for candidate in candidates {
        let is_second = turns.take(candidate);
        let usual = median_around(&heights, candidate.place).unwrap_or(0.0);
        if is_noise(candidate.height, usual) {
            continue;
        }
        let Some(last) = chosen.last_mut() else {
            chosen.push(*candidate);
            continue;
        };
        let secs = (candidate.place - last.place) as f64 / rate_hz;
        let cycle_secs = median_around(&cycles_secs, candidate.place).unwrap_or(f64::INFINITY);
        if secs < refractory_secs(cycle_secs) {
            if candidate.height > last.height {
                *last = *candidate;
            }
        } else if !is_second && !is_diastolic(candidate, last, secs, cycle_secs) {
            chosen.push(*candidate);
        }
    }
    chosen
}

/// The median of the `MEMORY` values around a position.
fn median_around(points: &[(i64, f64)], place: i64) -> Option<f64> {
    let middle = points.partition_point(|point| point.0 < place);
    let near = middle.saturating_sub(MEMORY)..(middle + MEMORY).min(points.len());
    let mut values = [0.0; 2 * MEMORY];
    let values = &mut values[..near.len()];
    values.iter_mut().zip(&points[near]).for_each(|(value, point)| *value = point.1);
    median(values)
}
