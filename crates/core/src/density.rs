//! Detects waves that overlap in time: samples that arrive faster than stated.
//!
//! A wave states its sampling period, and a description states the rate of its stream. If more samples than that lie
//! between the stamps of the first wave and the last, waves overlap in time, and features computed from them have a
//! wrong time base. The result depends only on corrected times and log times, so a replay has the same result.

use std::collections::VecDeque;

use crate::time::Time;

/// The minimum span of a stream that is examined [s], and its minimum number of waves.
const LEAST_SECS: f64 = 10.0;
const LEAST_WAVES: u64 = 8;
/// The length of the stretches in which waves are counted [s].
const STRETCH_SECS: f64 = 1.0;
/// The tolerated ratio of the counted rate to the stated one: device clocks are off by less than a thousandth, and
/// waves that are stamped on arrival jitter.
const TOLERATED: f64 = 1.1;
/// The largest number of stretches that are kept.
const MOST_STRETCHES: usize = 256;

/// The density of the samples in a stream of waves.
#[derive(Clone, Debug, Default)]
pub(crate) struct Density {
    stretches: VecDeque<Stretch>,
    /// The rates over the newest complete stretches, if the stated rate is exceeded.
    exceeded: Option<Exceeded>,
}

/// The waves of about a second, by log time or by their stamps, whichever passes sooner.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    measured: Time,
    log_time: Time,
    waves: u64,
    samples: u64,
}

/// A counted rate that exceeds the stated rate [Hz].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Exceeded {
    rate_hz: f64,
    stated_hz: f64,
}

impl Density {
    /// Takes in a wave of this many samples, in order; the stated rate [Hz] comes from its period or from the stream's
    /// description, whichever is lower.
    pub(crate) fn came(&mut self, samples: u64, measured: Time, log_time: Time, stated_hz: f64) {
        let goes_on = self.stretches.back_mut().filter(|stretch| {
            measured.secs_since(stretch.measured) < STRETCH_SECS
                && log_time.secs_since(stretch.log_time) < STRETCH_SECS
        });
        if let Some(stretch) = goes_on {
            stretch.waves += 1;
            stretch.samples = stretch.samples.saturating_add(samples);
            return;
        }
        self.judge(measured, stated_hz);
        self.stretches.push_back(Stretch { measured, log_time, waves: 1, samples });
    }

    /// Compares the rate over the stretches before `until`, the time of the next wave, with the stated rate.
    fn judge(&mut self, until: Time, stated_hz: f64) {
        let (mut waves, mut samples) = (0_u64, 0_u64);
        let enough = self.stretches.iter().rposition(|stretch| {
            waves += stretch.waves;
            samples = samples.saturating_add(stretch.samples);
            waves >= LEAST_WAVES && until.secs_since(stretch.measured) >= LEAST_SECS
        });
        let Some(first) = enough else {
            if self.stretches.len() >= MOST_STRETCHES {
                self.stretches.pop_front();
            }
            return;
        };
        self.stretches.drain(..first);
        let secs = until.secs_since(self.stretches[0].measured);
        let rate_hz = samples as f64 / secs;
        let is_exceeded = stated_hz > 0.0 && rate_hz > TOLERATED * stated_hz;
        self.exceeded = is_exceeded.then_some(Exceeded { rate_hz, stated_hz });
    }

    /// The current fault of the stream, if any.
    pub(crate) fn complaint(&self) -> Option<String> {
        let Exceeded { rate_hz, stated_hz } = self.exceeded?;
        let [comes, stated] = [rate_hz, stated_hz].map(|hz| format!("{hz:.0}"));
        Some(format!(
            "its waves overlap: {comes} samples/s arrive instead of the stated {stated}/s"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEGIN: Time = Time::from_stamp(1_700_000_000, 0);

    fn at(secs: f64) -> Time {
        Time::from_nanos(BEGIN.nanos() + (secs * 1e9).round() as i64)
    }

    /// The reported fault after this many seconds of waves of 128 samples that arrive this many times as fast as their
    /// period of 1 ms states.
    fn said(times: f64, secs: f64) -> Option<String> {
        let mut density = Density::default();
        let every_secs = 0.128 / times;
        for k in 0..(secs / every_secs) as u32 {
            let now = at(f64::from(k) * every_secs);
            density.came(128, now, now, 1000.0);
        }
        density.complaint()
    }

    #[test]
    fn waves_that_overlap_are_marked_with_both_rates() {
        let expected = "its waves overlap: 2000 samples/s arrive instead of the stated 1000/s";
        assert_eq!(said(2.0, 15.0).as_deref(), Some(expected));
        for times in [1.25, 1.5, 3.9, 62.5] {
            assert!(said(times, 15.0).is_some(), "{times} times the rate");
        }
    }

    #[test]
    fn consecutive_waves_and_waves_with_gaps_are_not_marked() {
        for times in [0.1, 0.5, 0.999, 1.0, 1.001, 1.05] {
            assert_eq!(said(times, 100.0), None, "{times} times the rate");
        }
    }

    #[test]
    fn a_stored_burst_with_its_own_stamps_does_not_overlap() {
        let mut density = Density::default();
        for k in 0..1000 {
            // For a minute nothing arrives; then all of that comes within a millisecond.
            let (stamp, is_held) = (f64::from(k) * 0.128, (100..600).contains(&k));
            let arrival = if is_held { 76.8 + f64::from(k) * 1e-6 } else { stamp };
            density.came(128, at(stamp), at(arrival), 1000.0);
            assert_eq!(density.complaint(), None, "wave {k}");
        }
    }

    #[test]
    fn jittering_stamps_and_rare_waves_are_not_marked() {
        let mut density = Density::default();
        for k in 0..200_u32 {
            // A wave of 10 s each 10 s, stamped by its arrival, up to half a second late.
            let now = at(f64::from(k) * 10.0 + f64::from(k * 7919 % 500) / 1000.0);
            density.came(40, now, now, 4.0);
            assert_eq!(density.complaint(), None, "wave {k}");
        }
    }

    #[test]
    fn the_mark_goes_when_the_waves_follow_each_other_again() {
        let mut density = Density::default();
        let mut secs = 0.0;
        for k in 0..1000 {
            density.came(128, at(secs), at(secs), 1000.0);
            secs += if k < 300 { 0.064 } else { 0.128 };
        }
        assert_eq!(density.complaint(), None);
    }

    #[test]
    fn time_that_stands_still_takes_no_memory() {
        let mut density = Density::default();
        for k in 0..100_000 {
            density.came(1, BEGIN, at(f64::from(k) * 2.0), 1000.0);
        }
        assert!(density.stretches.len() <= MOST_STRETCHES);
    }
}
