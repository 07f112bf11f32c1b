//! Responses while the skin conductance comes in.

use super::onset::{LONGEST_RISE_SECS, onset};
use super::response::{Response, Threshold};
use super::{checked_rate, checked_threshold};
use crate::error::{SignalError, checked};
use crate::gaps::is_usable;

/// How long a peak must stay unsurpassed [s].
pub(super) const WAIT_SECS: f64 = 0.5;

/// Finds responses in a phasic signal that comes in sample by sample.
///
/// A response is reported half a second after its peak (at the first sample then), if nothing higher has
/// come: a rise that halts for longer counts as two. Its recovery is not yet known then. The output is the
/// same bit for bit for any chunking, and no sample allocates. After a value that is not a [usable
/// number](crate::gaps::is_usable) it starts anew.
#[derive(Clone, Debug)]
pub struct ResponseDetector {
    rate_hz: f64,
    threshold_us: f64,
    wait: usize,
    reach: usize,
    /// The newest values, at least as many as a rise and the wait take.
    newest: Vec<f64>,
    /// How many samples came in.
    count: u64,
    /// The highest value since the last response or trough, if it may still become a peak.
    highest: Option<(u64, f64)>,
    lowest: f64,
    /// Where the last response had its peak: no other one begins before that.
    last_peak: u64,
}

impl ResponseDetector {
    /// A detector for samples at a rate of 1 to 2000 Hz and an absolute threshold [µS].
    pub fn new(rate_hz: f64, threshold_us: f64) -> Result<ResponseDetector, SignalError> {
        ResponseDetector::waiting(rate_hz, threshold_us, WAIT_SECS)
    }

    /// A detector that waits otherwise.
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
        let newest = Vec::with_capacity(2 * (reach + wait + 2));
        Ok(ResponseDetector {
            rate_hz,
            threshold_us,
            wait,
            reach,
            newest,
            count: 0,
            highest: None,
            lowest: f64::INFINITY,
            last_peak: 0,
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
        self.keep(phasic);
        if phasic < self.lowest {
            (self.lowest, self.highest) = (phasic, None);
        } else if self.highest.is_none_or(|(_, highest)| phasic > highest) {
            self.highest = Some((place, phasic));
        }
        let (peak, height) = self.highest?;
        if place - peak < self.wait as u64 {
            return None;
        }
        let back = (place - peak) as usize;
        (self.highest, self.lowest) = (None, self.newest_lowest(back));
        let response = self.response(peak, height, back)?;
        self.last_peak = peak;
        Some(response)
    }

    /// Forgets what was before.
    pub fn begin_anew(&mut self) {
        self.newest.clear();
        (self.highest, self.lowest) = (None, f64::INFINITY);
    }

    fn keep(&mut self, phasic: f64) {
        let most = self.reach + self.wait + 2;
        if self.newest.len() == 2 * most {
            self.newest.copy_within(most.., 0);
            self.newest.truncate(most);
        }
        self.newest.push(phasic);
    }

    fn newest_lowest(&self, count: usize) -> f64 {
        let begin = self.newest.len().saturating_sub(count);
        self.newest[begin..].iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn response(&self, peak: u64, height: f64, back: usize) -> Option<Response> {
        let last = self.newest.len().checked_sub(back + 1)?;
        let since_last = usize::try_from(peak - self.last_peak).unwrap_or(usize::MAX);
        let begin = last.saturating_sub(self.reach.min(since_last));
        let onset = begin
            + onset(&self.newest[begin..=last], last - begin, self.rate_hz, self.threshold_us)?;
        Some(Response {
            onset: peak as f64 - (last - onset) as f64,
            peak: peak as f64,
            amplitude_us: height - self.newest[onset],
            rise_secs: (last - onset) as f64 / self.rate_hz,
            half_recovery_secs: None,
        })
    }
}
