//! Causal breath detection.

use super::band;
use super::breath::{Assembly, Breath, LONGEST_SECS};
use super::grouping::Grouping;
use super::history::History;
use super::scale::Scale;
use super::turns::{Turn, Turns, placed};
use crate::error::SignalError;
use crate::filter::{Cascade, butterworth};

/// The low-pass before the detection [Hz].
pub(super) const SMOOTH_HZ: f64 = 1.0;
/// The longest gap within a breath [s].
pub(super) const LONGEST_GAP_SECS: f64 = 1.0;
/// The frequency at which the filter's delay is compensated [Hz]; the delay is 5 ms less at 0.1 Hz, and 15 ms more at
/// 0.5 Hz.
const USUAL_HZ: f64 = 0.25;

/// Detects breaths in a signal sample by sample.
///
/// A breath is reported after the next inhalation, because only then is it known when the inhalation began: when the
/// signal, filtered causally between 0.05 and 1 Hz, has fallen by a quarter of its usual range (10th to 90th percentile
/// of the last 30 s; at least a third of what was usual in the last 5 minutes) below the peak. This is about 0.2 s plus
/// a fifth of a breath after that peak, or about 2.5 s after the end of a breath of 4 s. Nothing is reported in the
/// first 5 s. Times and heights are those of the signal below 1 Hz, with its delay removed. A shallow breath right
/// after a deep one may be missed: the causal high-pass makes it shallower still.
///
/// The output is bit-identical for any chunking, and no sample allocates. Samples that are not [usable
/// numbers](crate::gaps::is_usable) are bridged up to 1 s; a longer gap separates breaths.
#[derive(Clone, Debug)]
pub struct BreathDetector {
    grouping: Grouping,
    rate_hz: f64,
    /// The filters for detection and for placement of turning points.
    band: Cascade,
    low: Cascade,
    lows: History,
    /// The delay of the placement filter [samples at the working rate].
    late: f64,
    scale: Scale,
    turns: Turns,
    assembly: Assembly,
    /// The previous turning point, in the signal used for placement.
    before: Option<Turn>,
    place: usize,
    missing: usize,
}

impl BreathDetector {
    /// Creates a detector for samples at 5 to 2000 Hz, in any unit; inhalation goes up.
    ///
    /// Returns an error for another rate.
    pub fn new(rate_hz: f64) -> Result<BreathDetector, SignalError> {
        band::band(rate_hz)?;
        let grouping = Grouping::new(rate_hz);
        let rate_hz = rate_hz / grouping.length() as f64;
        let low = butterworth::low_pass(2, SMOOTH_HZ, rate_hz)?;
        Ok(BreathDetector {
            grouping,
            rate_hz,
            band: Cascade::settled(&band::within(SMOOTH_HZ, rate_hz)?),
            late: low.group_delay_secs(USUAL_HZ) * rate_hz,
            low: Cascade::settled(&low),
            lows: History::new((LONGEST_SECS * rate_hz) as usize + 1),
            scale: Scale::new(rate_hz)?,
            turns: Turns::default(),
            assembly: Assembly::new(rate_hz),
            before: None,
            place: 0,
            missing: 0,
        })
    }

    /// Takes in the next sample, and returns a breath if one became known.
    pub fn push(&mut self, sample: f64) -> Option<Breath> {
        let mean = self.grouping.push(sample)?;
        self.push_mean(mean)
    }

    /// Takes in the mean of the next group.
    pub(super) fn push_mean(&mut self, mean: f64) -> Option<Breath> {
        let place = self.place;
        self.place += 1;
        let goes_on = self.goes_on(mean);
        let low = self.low.push(mean);
        self.lows.push(low);
        if !goes_on {
            return None;
        }
        let smooth = self.band.push(mean);
        let threshold = self.scale.push(mean, smooth);
        let turn = self.turns.push(place, smooth, threshold)?;
        let begin = self.before.map_or(turn.place, |before| before.place).max(0.0) as usize;
        let (first, lows) = self.lows.at(begin..place + 1);
        let turn = placed(turn, first, lows);
        let breath = self.assembly.push(turn, first, lows);
        self.before = Some(turn);
        Some(self.grouping.sampled(&breath?.later(-self.late)))
    }

    /// Whether there is a signal; resets the detector after a long gap.
    fn goes_on(&mut self, mean: f64) -> bool {
        let longest = LONGEST_GAP_SECS * self.rate_hz;
        if mean.is_nan() {
            self.missing += 1;
            return self.missing as f64 <= longest;
        }
        if self.missing as f64 > longest {
            self.band.settle(mean);
            self.low.settle(mean);
            self.turns = Turns::default();
            self.assembly.restart();
            self.before = None;
        }
        self.missing = 0;
        true
    }
}
