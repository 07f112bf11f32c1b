//! Causal detection of skin conductance responses.

use super::fall::Fall;
use super::onset::{LONGEST_RISE_SECS, onset};
use super::response::{Response, Threshold};
use super::sharpened::{LATER_SECS, SHARPER, Sharpener};
use super::{checked_rate, checked_threshold};
use crate::error::{SignalError, checked};
use crate::gaps::is_usable;

/// How long a peak must remain the highest [s].
pub(super) const WAIT_SECS: f64 = 0.5;

/// Detects responses in a phasic signal sample by sample.
///
/// Equal to [`find_responses`](super::find_responses) with an absolute threshold. A response is reported half
/// a second after its peak (at the first sample from then on), or when the next one begins earlier; a rise
/// that pauses for longer counts as two. Its recovery is not yet known then. The output is bit-identical for
/// any chunking, and no sample allocates. A value that is not a [usable number](crate::gaps::is_usable)
/// resets the detector.
#[derive(Clone, Debug)]
pub struct ResponseDetector {
    rate_hz: f64,
    threshold_us: f64,
    wait: usize,
    reach: usize,
    /// The newest values, enough for two rises and the wait, and these values sharpened.
    newest: Vec<f64>,
    sharp: Vec<f64>,
    sharpener: Sharpener,
    /// The number of samples so far.
    count: u64,
    /// The maximum of the sharpened signal since the last rise or trough, if it may still become a peak.
    highest: Option<(u64, f64)>,
    lowest: f64,
    /// The peak of the last rise; no other onset lies before it.
    last_peak: u64,
    rising: Option<Rising>,
}

/// A response that may still rise.
#[derive(Clone, Copy, Debug)]
struct Rising {
    onset: u64,
    fall: Fall,
    latest: u64,
    peak: u64,
    amplitude_us: f64,
}

impl ResponseDetector {
    /// Creates a detector with an absolute threshold [µS] for samples at `rate_hz`, which must be from 1 to 2000.
    pub fn new(rate_hz: f64, threshold_us: f64) -> Result<ResponseDetector, SignalError> {
        ResponseDetector::waiting(rate_hz, threshold_us, WAIT_SECS)
    }

    /// Creates a detector with another wait.
    pub(super) fn waiting(
        rate_hz: f64,
        threshold_us: f64,
        wait_secs: f64,
    ) -> Result<ResponseDetector, SignalError> {
        checked_rate(rate_hz)?;
        checked_threshold(Threshold::Absolute(threshold_us))?;
        checked("wait", wait_secs, (0.0, 10.0))?;
        let wait = (wait_secs * rate_hz).ceil().max(1.0) as usize;
        let reach = (LONGEST_RISE_SECS * rate_hz) as usize;
        let most = most_kept(reach, wait);
        Ok(ResponseDetector {
            rate_hz,
            threshold_us,
            wait,
            reach,
            newest: Vec::with_capacity(2 * most),
            sharp: Vec::with_capacity(2 * most),
            sharpener: Sharpener::new(rate_hz),
            count: 0,
            highest: None,
            lowest: f64::INFINITY,
            last_peak: 0,
            rising: None,
        })
    }

    /// Takes in the next phasic value [µS], and returns a response if one became known.
    pub fn push(&mut self, phasic: f64) -> Option<Response> {
        let place = self.count;
        self.count += 1;
        if !is_usable(phasic) {
            self.begin_anew();
            return None;
        }
        let sharp = self.sharpener.push(phasic);
        self.keep(phasic, sharp);
        self.climb(place, phasic);
        let next = self.rise(place, sharp);
        if let Some((onset, peak)) = next {
            let known = self.rising.take().and_then(|rising| self.cut(rising, onset));
            self.rising = Some(self.begun(onset, peak));
            return known;
        }
        let rising = self.rising.take_if(|rising| place - rising.peak >= self.wait as u64)?;
        self.response(rising)
    }

    /// Resets the detector.
    pub fn begin_anew(&mut self) {
        self.newest.clear();
        self.sharp.clear();
        self.sharpener.begin_anew();
        (self.highest, self.lowest, self.rising) = (None, f64::INFINITY, None);
    }

    fn keep(&mut self, phasic: f64, sharp: f64) {
        let most = most_kept(self.reach, self.wait);
        for (kept, value) in [(&mut self.newest, phasic), (&mut self.sharp, sharp)] {
            if kept.len() == 2 * most {
                kept.copy_within(most.., 0);
                kept.truncate(most);
            }
            kept.push(value);
        }
    }

    /// Updates the peak of the rising response.
    fn climb(&mut self, place: u64, phasic: f64) {
        let Some(rising) = &mut self.rising else { return };
        let samples = (place - rising.onset) as usize;
        let amplitude_us = phasic - rising.fall.level_us(samples);
        if place <= rising.latest && amplitude_us > rising.amplitude_us {
            (rising.peak, rising.amplitude_us) = (place, amplitude_us);
        }
    }

    /// Takes in a sharpened value; returns the onset and peak of a rise that became known.
    fn rise(&mut self, place: u64, sharp: f64) -> Option<(u64, u64)> {
        if sharp < self.lowest {
            (self.lowest, self.highest) = (sharp, None);
        } else if self.highest.is_none_or(|(_, highest)| sharp > highest) {
            self.highest = Some((place, sharp));
        }
        let (peak, _) = self.highest?;
        if place - peak < self.wait as u64 {
            return None;
        }
        let back = (place - peak) as usize;
        let lowest = self.sharp[self.sharp.len().saturating_sub(back)..].iter().copied();
        (self.highest, self.lowest) = (None, lowest.fold(f64::INFINITY, f64::min));
        let last = self.sharp.len().checked_sub(back + 1)?;
        let since_last = usize::try_from(peak - self.last_peak).unwrap_or(usize::MAX);
        let begin = last.saturating_sub(self.reach.min(since_last));
        let least = SHARPER * self.threshold_us;
        let onset = onset(&self.sharp[begin..=last], last - begin, self.rate_hz, least)?;
        self.last_peak = peak;
        Some((peak - (last - begin - onset) as u64, peak))
    }

    /// The index of a position among the newest values; 0 for older ones.
    fn kept(&self, place: u64) -> usize {
        self.newest.len().saturating_sub((self.count - place) as usize)
    }

    fn begun(&self, onset: u64, peak: u64) -> Rising {
        let at = self.kept(onset);
        let fall = Fall::before(&self.newest[..=at], self.rate_hz, self.threshold_us);
        let latest = peak + (LATER_SECS * self.rate_hz) as u64;
        let (samples, amplitude_us) =
            fall.highest(&self.newest[at..=self.kept(latest.min(self.count - 1))]);
        Rising { onset, fall, latest, peak: onset + samples as u64, amplitude_us }
    }

    /// Ends a response where the next one begins.
    fn cut(&self, mut rising: Rising, end: u64) -> Option<Response> {
        if rising.peak > end {
            let risen = &self.newest[self.kept(rising.onset)..=self.kept(end)];
            let (samples, amplitude_us) = rising.fall.highest(risen);
            (rising.peak, rising.amplitude_us) = (rising.onset + samples as u64, amplitude_us);
        }
        self.response(rising)
    }

    fn response(&self, rising: Rising) -> Option<Response> {
        let Rising { onset, peak, amplitude_us, .. } = rising;
        (amplitude_us >= self.threshold_us).then(|| Response {
            onset: onset as f64,
            peak: peak as f64,
            amplitude_us,
            rise_secs: (peak - onset) as f64 / self.rate_hz,
            half_recovery_secs: None,
        })
    }
}

/// The number of values kept: enough for two rises, one of them known late.
fn most_kept(reach: usize, wait: usize) -> usize {
    2 * (reach + wait + 1)
}
