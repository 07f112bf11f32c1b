//! Responses of a whole recording.

use super::fall::Fall;
use super::onset::{LONGEST_RISE_SECS, nearest_trough, onset};
use super::response::{Response, Threshold};
use super::sharpened::{LATER_SECS, SHARPER, Sharpener};
use super::{checked_rate, checked_threshold};
use crate::error::SignalError;
use crate::peaks::{Peak, Rules, find_peaks};

/// Finds the skin conductance responses in the phasic part of a recording [µS].
///
/// Peaks count if their prominence reaches the threshold.
///
/// - Relative threshold: onsets, peaks and recoveries equal those of NeuroKit2's `eda_peaks`, sample for
///   sample. The onset is the nearest trough.
/// - Absolute threshold: the amplitude, too, must reach the threshold. It is measured from the extrapolated
///   recovery of an earlier response. A response superimposed on such a recovery, or on the rise of another
///   response, counts: its prominence is that in the signal after a lead filter (1.5 s over 0.5 s), and
///   must reach 1.2 times the threshold. The onset is where the rise bends upwards, at most four and a half
///   seconds before the peak; ripples smaller than the threshold do not split a rise, and a level that
///   creeps upwards before it does not belong to it.
///
/// The recovery is searched for up to the next peak: with an absolute threshold it is the first sample at or
/// below half of the amplitude. A response that began before the recording is left
/// out, as its amplitude is unknown. Boucsein et al. (2012), doi:10.1111/j.1469-8986.2012.01384.x.
///
/// Returns an error for a rate outside 1 to 2000 Hz or an invalid threshold. Samples that are not usable
/// numbers split the signal.
pub fn find_responses(
    phasic: &[f64],
    rate_hz: f64,
    threshold: Threshold,
) -> Result<Vec<Response>, SignalError> {
    checked_rate(rate_hz)?;
    checked_threshold(threshold)?;
    let found = match threshold {
        Threshold::Absolute(least_us) => return Ok(absolute(phasic, rate_hz, least_us)),
        Threshold::Relative(share) => {
            let all = peaks(phasic, f64::NEG_INFINITY);
            let greatest = all.iter().map(|peak| peak.prominence).fold(0.0, f64::max);
            // The quotient, as in NeuroKit2: a product would round differently.
            let is_high = |peak: &&Peak| peak.prominence / greatest >= share;
            let high: Vec<Peak> = all.iter().filter(is_high).copied().collect();
            found(phasic, &high, |peak| nearest_trough(phasic, peak))
        }
    };
    let ends = found.iter().skip(1).map(|&(_, peak)| peak).chain([phasic.len()]);
    let response = |(&(onset, peak), end): (&(usize, usize), usize)| {
        let amplitude_us = phasic[peak] - phasic[onset];
        let recovery = closest(&phasic[peak..end], phasic[peak] - amplitude_us * 0.5);
        response(rate_hz, [onset, peak], amplitude_us, recovery)
    };
    Ok(found.iter().zip(ends).map(response).collect())
}

/// The rises of the sharpened signal whose amplitude in the phasic signal reaches the threshold.
fn absolute(phasic: &[f64], rate_hz: f64, least_us: f64) -> Vec<Response> {
    let mut sharpener = Sharpener::new(rate_hz);
    let sharp: Vec<f64> = phasic.iter().map(|&value| sharpener.push(value)).collect();
    let (reach, least) = ((LONGEST_RISE_SECS * rate_hz) as usize, SHARPER * least_us);
    let rises = found(&sharp, &peaks(&sharp, least), |peak| {
        let begin = peak.saturating_sub(reach);
        Some(begin + onset(&sharp[begin..=peak], peak - begin, rate_hz, least)?)
    });
    let ends = rises.iter().skip(1).map(|&(onset, _)| onset).chain([phasic.len()]);
    let later = (LATER_SECS * rate_hz) as usize;
    let highest = |(&(onset, peak), end): (&(usize, usize), usize)| {
        let fall = Fall::before(&phasic[..=onset], rate_hz, least_us);
        let end = (end.max(onset).min(peak + later) + 1).min(phasic.len());
        let (samples, amplitude_us) = fall.highest(&phasic[onset..end]);
        (amplitude_us >= least_us).then_some((onset, onset + samples, amplitude_us))
    };
    let found: Vec<(usize, usize, f64)> = rises.iter().zip(ends).filter_map(highest).collect();
    let ends = found.iter().skip(1).map(|&(_, peak, _)| peak).chain([phasic.len()]);
    let response = |(&(onset, peak, amplitude_us), end): (&(usize, usize, f64), usize)| {
        let half = phasic[peak] - amplitude_us * 0.5;
        let recovery = phasic[peak..end].iter().position(|&value| value <= half);
        response(rate_hz, [onset, peak], amplitude_us, recovery)
    };
    found.iter().zip(ends).map(response).collect()
}

fn peaks(phasic: &[f64], least_us: f64) -> Vec<Peak> {
    find_peaks(phasic, &Rules { prominence: least_us..=f64::INFINITY, ..Rules::default() })
}

/// The onsets and peaks of those peaks whose onset is known.
fn found(
    phasic: &[f64],
    peaks: &[Peak],
    onset: impl Fn(usize) -> Option<usize>,
) -> Vec<(usize, usize)> {
    let is_usable = |place: usize| crate::gaps::is_usable(phasic[place]);
    let usable = peaks.iter().map(|peak| peak.index).filter(|&peak| is_usable(peak));
    let with_onset = usable.filter_map(|peak| Some((onset(peak)?, peak)));
    with_onset.filter(|&(onset, _)| is_usable(onset)).collect()
}

fn response(
    rate_hz: f64,
    [onset, peak]: [usize; 2],
    amplitude_us: f64,
    recovery: Option<usize>,
) -> Response {
    Response {
        onset: onset as f64,
        peak: peak as f64,
        amplitude_us,
        rise_secs: (peak - onset) as f64 / rate_hz,
        half_recovery_secs: recovery.map(|samples| samples as f64 / rate_hz),
    }
}

/// The recovery as in NeuroKit2: the highest sample at or below a level, if there is a lower one before the
/// minimum. Where the phasic part swings back after a response, that may be much later than the first one.
fn closest(fall: &[f64], level: f64) -> Option<usize> {
    let lowest = (0..fall.len()).reduce(|a, b| if fall[b] < fall[a] { b } else { a })?;
    let fall = &fall[..lowest];
    let below = (0..fall.len()).filter(|&place| fall[place] <= level);
    let reached = below.reduce(|a, b| if fall[b] > fall[a] { b } else { a })?;
    fall.iter().any(|&value| value < fall[reached]).then_some(reached)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eda::high_pass_split;

    #[test]
    fn equal_responses_recover_in_equal_times_however_the_phasic_part_swings_back() {
        let form = |secs: f64| {
            if secs > 0.0 { (-secs / 5.0).exp() - (-secs / 0.75).exp() } else { 0.0 }
        };
        let at = |k: u32| {
            let secs = f64::from(k) / 16.0;
            // Noise decides which sample after the undershoot is closest to half.
            let noise = f64::from(k * 7919 % 1009) / 1009.0 - 0.5;
            5.0 + 0.004 * noise
                + (0..6).map(|n| form(secs - 6.0 - 40.0 * f64::from(n))).sum::<f64>()
        };
        let signal: Vec<f64> = (0..4000).map(at).collect();
        let split = high_pass_split(&signal, 16.0).unwrap();
        let found = find_responses(&split.phasic, 16.0, Threshold::default()).unwrap();
        let times = found.iter().filter_map(|response| response.half_recovery_secs);
        let inner: Vec<f64> = times.take(5).collect();
        assert_eq!((found.len(), inner.len()), (6, 5));
        assert!(inner.iter().all(|secs| (secs - inner[1]).abs() < 0.2 && *secs < 4.5), "{inner:?}");
    }
}
