//! Blinks of a whole recording.

use super::candidates::{Candidate, Candidates};
use super::noise::Noise;
use super::polarity::Polarity;
use super::{Blink, low_pass, thinning};
use crate::error::SignalError;
use crate::filter::zero_phase;
use crate::gaps::is_usable;

/// Finds the blinks of a whole frontal EEG [µV] at 100 to 5000 Hz.
///
/// Works like [`BlinkDetector`](super::BlinkDetector), but with a zero-phase filter, the usual variation of half a
/// minute before and after, and the polarity of most blinks in the recording. Returns an error for another rate, and
/// for a signal that is too short or has no usable sample.
pub fn find_blinks(signal: &[f64], rate_hz: f64) -> Result<Vec<Blink>, SignalError> {
    let thinning = thinning(rate_hz);
    let slow = zero_phase(&low_pass(2, rate_hz)?, signal)?;
    let slow: Vec<f64> = slow.into_iter().step_by(thinning).collect();
    let is_there = signal.iter().step_by(thinning).map(|&sample| is_usable(sample));
    let is_there: Vec<bool> = is_there.collect();
    let found = standing_out(&slow, &is_there, rate_hz / thinning as f64);
    let reach = Candidates::new(rate_hz / thinning as f64).reach();
    let mut polarity = Polarity::default();
    let (most, _): (Vec<Candidate>, Vec<Candidate>) =
        found.iter().partition(|candidate| polarity.fits(candidate, reach));
    let sum_uv: f64 = most.iter().map(|candidate| candidate.height_uv).sum();
    let fits = |candidate: &&Candidate| candidate.height_uv * sum_uv.signum() > 0.0;
    let blink = |candidate: &Candidate| Blink {
        sample: candidate.place * thinning as f64,
        amplitude_uv: candidate.height_uv.abs(),
        duration_secs: candidate.duration_secs,
    };
    Ok(found.iter().filter(fits).map(blink).collect())
}

/// The candidates above the usual variation around them.
fn standing_out(slow: &[f64], is_there: &[bool], rate_hz: f64) -> Vec<Candidate> {
    let mut candidates = Candidates::new(rate_hz);
    let mut noise = Noise::new(rate_hz);
    let ahead = noise.length() / 2;
    let reach = candidates.reach();
    let value = |index: usize| match is_there.get(index) {
        Some(true) => slow[index],
        _ => f64::NAN,
    };
    (0..ahead).for_each(|index| noise.push(value(index)));
    // The signal is extended at both ends, so that candidates there have a reference.
    let (first, last) = (slow.first().copied(), slow.last().copied());
    let before = first.into_iter().flat_map(|first| std::iter::repeat_n(first, reach));
    let after = last.into_iter().flat_map(|last| std::iter::repeat_n(last, reach));
    let mut found = Vec::new();
    for (index, sample) in before.chain(slow.iter().copied()).chain(after).enumerate() {
        if index >= 2 * reach {
            noise.push(value(index - 2 * reach + ahead));
        }
        let Some(candidate) = candidates.push(sample) else { continue };
        if noise.is_surpassed_by(candidate.height_uv) {
            found.push(Candidate { place: candidate.place - reach as f64, ..candidate });
        }
    }
    found.retain(|candidate| (0.0..slow.len() as f64).contains(&candidate.place));
    found
}
