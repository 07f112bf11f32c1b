//! Breaths of a whole recording.

use std::ops::Range;

use super::band;
use super::breath::{Assembly, Breath};
use super::causal::{LONGEST_GAP_SECS, SMOOTH_HZ};
use super::grouping::Grouping;
use super::scale::thresholds;
use super::turns::{Turn, Turns, placed};
use crate::error::SignalError;
use crate::filter::{butterworth, zero_phase};
use crate::gaps::bridged;

/// The shortest piece between gaps in which breaths are detected [s].
const SHORTEST_PIECE_SECS: f64 = 5.0;
/// The search range around a turning point [s].
const REFINE_SECS: f64 = 0.25;

/// Finds the breaths of a whole signal at 5 to 2000 Hz, in any unit; inhalation goes up.
///
/// Troughs and peaks are the turning points from which the signal between 0.05 and 1 Hz (zero-phase) returns by a
/// quarter of its range (10th to 90th percentile of the 30 s around, at least a third of the recording's median),
/// placed with subsample resolution; their heights are those of the [clean](super::clean) signal. A breath counts from
/// a trough that the signal has fallen to by that much, to the next trough that is followed by a peak; breaths that
/// begin or end with the data, or at a gap, do not count. After Khodadad et al. (2018), doi:10.1088/1361-6579/aad7e6,
/// who require a share of the usual vertical distance, but between zero crossings, which drift and pauses shift.
///
/// Gaps of up to 1 s are bridged; longer ones separate breaths. A breath of more than 20 s is rejected.
/// Returns an error for another rate.
pub fn find_breaths(signal: &[f64], rate_hz: f64) -> Result<Vec<Breath>, SignalError> {
    band::band(rate_hz)?;
    let grouping = Grouping::new(rate_hz);
    let rate_hz = rate_hz / grouping.length() as f64;
    let means = grouping.clone().all(signal);
    of_means(&means, rate_hz, &grouping)
}

/// The breaths of the means of groups.
pub(super) fn of_means(
    means: &[f64],
    rate_hz: f64,
    grouping: &Grouping,
) -> Result<Vec<Breath>, SignalError> {
    let mut breaths = Vec::new();
    for piece in pieces(means, (LONGEST_GAP_SECS * rate_hz) as usize) {
        if (piece.len() as f64) < SHORTEST_PIECE_SECS * rate_hz {
            continue;
        }
        let found = breaths_of(&means[piece.clone()], rate_hz)?;
        let sampled = |breath: Breath| grouping.sampled(&breath.later(piece.start as f64));
        breaths.extend(found.into_iter().map(sampled));
    }
    Ok(breaths)
}

/// The stretches between gaps of more than `longest_gap` samples.
fn pieces(means: &[f64], longest_gap: usize) -> Vec<Range<usize>> {
    let mut pieces: Vec<Range<usize>> = Vec::new();
    for (place, _) in means.iter().enumerate().filter(|(_, mean)| !mean.is_nan()) {
        match pieces.last_mut() {
            Some(piece) if place - piece.end <= longest_gap => piece.end = place + 1,
            _ => pieces.push(place..place + 1),
        }
    }
    pieces
}

/// The breaths of one piece.
fn breaths_of(means: &[f64], rate_hz: f64) -> Result<Vec<Breath>, SignalError> {
    let means = bridged(means)?;
    let clean = zero_phase(&band::band(rate_hz)?, &means)?;
    let smooth = zero_phase(&butterworth::low_pass(2, SMOOTH_HZ, rate_hz)?, &clean)?;
    let thresholds = thresholds(&means, &smooth, rate_hz)?;
    let reach = (REFINE_SECS * rate_hz).round() as usize;
    let mut turns = Turns::default();
    let mut assembly = Assembly::new(rate_hz);
    let mut breaths = Vec::new();
    for (place, (&height, &threshold)) in smooth.iter().zip(&thresholds).enumerate() {
        let Some(turn) = turns.push(place, height, threshold) else { continue };
        let middle = turn.place.round() as usize;
        let around = middle.saturating_sub(reach)..(middle + reach + 1).min(smooth.len());
        let turn = placed(turn, around.start, &smooth[around]);
        let height = clean[(turn.place.round() as usize).min(clean.len() - 1)];
        let turn = Turn { height, ..turn };
        breaths.extend(assembly.push(turn, 0, &smooth));
    }
    Ok(breaths)
}
