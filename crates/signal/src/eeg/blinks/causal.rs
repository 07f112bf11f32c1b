//! Causal blink detection.

use super::candidates::Candidates;
use super::noise::Noise;
use super::polarity::Polarity;
use super::{BLINK_HZ, Blink, low_pass, thinning};
use crate::error::SignalError;
use crate::filter::Cascade;
use crate::gaps::is_usable;

/// Detects blinks in a frontal EEG sample by sample.
///
/// A blink is a peak of the signal below 7 Hz that exceeds the signal both 0.4 s before and 0.4 s after it by at least
/// 30 µV and 5 times the usual variation (0.7413 · the interquartile range, over the last minute, of a sample's
/// deviation from the mean of the samples 0.15 s before and after it); the lower side must be at least a quarter of the
/// higher. A blink is 0.05 to 0.5 s wide at half height and has the polarity of most blinks, which depends on the
/// reference electrode. Electrode steps and eye movements rise on one side only, and continuous activity raises its own
/// threshold. After BLINKER (Kleifges et al. 2017, doi:10.3389/fnins.2017.00012), which also looks for peaks of more
/// than 0.05 s above robust deviations.
///
/// A blink is reported less than half a second after its peak, from the third second on. The output is
/// bit-identical for any chunking, and no sample allocates. Samples that are not [usable
/// numbers](crate::gaps::is_usable) repeat the one before. Strong voluntary blinks, head jerks and loose
/// electrodes can look the same in one channel.
pub struct BlinkDetector {
    filter: Cascade,
    thinning: usize,
    until_next: usize,
    candidates: Candidates,
    noise: Noise,
    polarity: Polarity,
    /// The delay of a peak in the filter [samples].
    delay: f64,
}

impl BlinkDetector {
    /// Creates a detector for samples [µV] at 100 to 5000 Hz; an error for another rate.
    pub fn new(rate_hz: f64) -> Result<BlinkDetector, SignalError> {
        let low_pass = low_pass(4, rate_hz)?;
        let thinning = thinning(rate_hz);
        let working_rate_hz = rate_hz / thinning as f64;
        Ok(BlinkDetector {
            filter: Cascade::settled(&low_pass),
            thinning,
            until_next: 0,
            candidates: Candidates::new(working_rate_hz),
            noise: Noise::new(working_rate_hz),
            polarity: Polarity::default(),
            delay: low_pass.group_delay_secs(BLINK_HZ) * rate_hz,
        })
    }

    /// Takes in the next sample, and returns a blink if one became known.
    pub fn push(&mut self, sample: f64) -> Option<Blink> {
        let value = self.filter.push(sample);
        if self.until_next > 0 {
            self.until_next -= 1;
            return None;
        }
        self.until_next = self.thinning - 1;
        self.noise.push(if is_usable(sample) { value } else { f64::NAN });
        let candidate = self.candidates.push(value)?;
        let stands_out = self.noise.is_surpassed_by(candidate.height_uv);
        let is_blink = stands_out && self.polarity.fits(&candidate, self.candidates.reach());
        is_blink.then(|| Blink {
            sample: (candidate.place * self.thinning as f64 - self.delay).max(0.0),
            amplitude_uv: candidate.height_uv.abs(),
            duration_secs: candidate.duration_secs,
        })
    }
}
