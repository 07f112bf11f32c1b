//! How accurately the beats of a strap without a clock are timed.

use std::collections::VecDeque;

use teampulse_timefilter::clock::ClockState;

/// The device name of straps whose clock is the sum of the intervals between beats.
pub(super) const STRAP: &str = "heart_rate_strap";
/// The number of measurements whose bounds are kept: about a minute, in which no two clocks drift far apart.
const REMEMBERED: usize = 64;
/// The longest interval between beats \[s\]: the largest possible error of the clock before the second measurement.
const LONGEST_SECS: f64 = 2.0;
/// A clock that goes back by at least this much was restarted after missing intervals \[ns\].
const BACK_NANOS: i64 = 1_000_000_000;

/// The bounds between which the time of the beats is known.
///
/// A strap reports a beat in the first measurement after it, so the beat came after the previous measurement arrived
/// and before this one did. The clock model does not use the earlier bound. Its error arises because beats rarely fall
/// just before a measurement, and does not show in the scatter of delays.
#[derive(Debug, Default)]
pub(super) struct ByBeats {
    /// The latency that the model subtracts \[s\].
    latency_secs: f64,
    /// When this measurement and the previous one arrived \[ns\].
    arrivals: [Option<i64>; 2],
    /// Whether this measurement has already delivered a beat.
    has_beats: bool,
    /// The time of the last beat, by the strap \[ns\].
    last: Option<i64>,
    /// The minimum and maximum lead of the session's clock over the strap's, for each measurement \[s\].
    ahead: VecDeque<(f64, f64)>,
    /// The lead according to the model \[s\].
    model_secs: f64,
}

impl ByBeats {
    /// Creates the bounds for a clock whose model subtracts a latency \[s\].
    pub(super) fn new(latency_secs: f64) -> ByBeats {
        ByBeats { latency_secs, ..ByBeats::default() }
    }

    /// Takes in a measurement, which arrives before its beats do \[ns\].
    pub(super) fn measurement(&mut self, arrival: i64) {
        self.arrivals = [Some(arrival), self.arrivals[0]];
        self.has_beats = false;
    }

    /// Takes in a beat of the last measurement: its time by the strap and its time by the model \[ns\].
    pub(super) fn beat(&mut self, device: i64, placed: i64) {
        let [Some(arrival), before] = self.arrivals else { return };
        let continues = self.last.is_some_and(|last| device > last.saturating_sub(BACK_NANOS));
        if !continues {
            self.ahead.clear();
        }
        let most_secs = secs_between(device, arrival);
        if let Some(bounds) = self.ahead.back_mut().filter(|_| self.has_beats) {
            bounds.1 = bounds.1.min(most_secs);
        } else {
            let least_secs = before.filter(|_| continues);
            let least_secs = least_secs.map_or(f64::NEG_INFINITY, |at| secs_between(device, at));
            self.ahead.push_back((least_secs, most_secs));
        }
        (self.has_beats, self.last) = (true, Some(device));
        self.model_secs = secs_between(device, placed) + self.latency_secs;
        self.forget();
    }

    /// Adds the largest possible error to the uncertainty of a clock's state.
    pub(super) fn state(&self, state: ClockState) -> ClockState {
        let uncertainty_secs = state.uncertainty_secs.hypot(self.off_secs());
        ClockState { uncertainty_secs, ..state }
    }

    /// The largest possible error of the model \[s\].
    fn off_secs(&self) -> f64 {
        let (least_secs, most_secs) = self.bounds();
        if !most_secs.is_finite() {
            return LONGEST_SECS;
        }
        let least_secs = least_secs.max(most_secs - LONGEST_SECS);
        (most_secs - self.model_secs).max(self.model_secs - least_secs).max(0.0)
    }

    fn bounds(&self) -> (f64, f64) {
        let all = self.ahead.iter();
        all.fold((f64::NEG_INFINITY, f64::INFINITY), |(least, most), each| {
            (least.max(each.0), most.min(each.1))
        })
    }

    /// Drops the oldest bounds: those beyond the limit, and those that contradict newer ones, as clocks drift apart and
    /// packets are sometimes late.
    fn forget(&mut self) {
        let is_contradicted = |(least_secs, most_secs): (f64, f64)| least_secs > most_secs;
        while self.ahead.len() > REMEMBERED
            || (self.ahead.len() > 1 && is_contradicted(self.bounds()))
        {
            self.ahead.pop_front();
        }
    }
}

/// The session's time minus the strap's time \[s\].
fn secs_between(device: i64, session: i64) -> f64 {
    session.saturating_sub(device) as f64 / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLI: i64 = 1_000_000;

    /// The stated uncertainty of a model that is `off_ms`, after this many measurements, one a second, of beats that
    /// begin at `phase_ms`.
    fn stated_ms(measurements: i64, phase_ms: i64, off_ms: i64) -> f64 {
        let mut by_beats = ByBeats::default();
        let (mut beat_ms, mut number) = (phase_ms, 13 * phase_ms);
        for second in 1..=measurements {
            by_beats.measurement(second * 1000 * MILLI);
            while beat_ms <= second * 1000 {
                by_beats.beat(beat_ms * MILLI, (beat_ms + off_ms) * MILLI);
                number += 1;
                beat_ms += 600 + number * 7919 % 300;
            }
        }
        by_beats.off_secs() * 1e3
    }

    #[test]
    fn the_truth_is_within_what_is_stated_and_that_becomes_narrow() {
        for phase_ms in 0..60 {
            for off_ms in [-30, 0, 30, 100] {
                for measurements in 2..60 {
                    let stated_ms = stated_ms(measurements, 17 * phase_ms, off_ms);
                    assert!(stated_ms >= off_ms.abs() as f64, "{stated_ms} ms of {off_ms} ms");
                }
            }
            let stated_ms = stated_ms(60, 17 * phase_ms, 0);
            assert!(stated_ms < 100.0, "{stated_ms} ms");
        }
    }

    #[test]
    fn bounds_begin_again_with_the_clock() {
        let mut by_beats = ByBeats::default();
        for second in 1..=60 {
            by_beats.measurement(second * 1000 * MILLI);
            by_beats.beat((second * 1000 - 300) * MILLI, (second * 1000 - 300) * MILLI);
        }
        by_beats.measurement(61_000 * MILLI);
        by_beats.beat(-172_800_000 * MILLI, 60_900 * MILLI);
        assert_eq!(by_beats.ahead.len(), 1);
        assert!(by_beats.off_secs() > 1.0);
    }
}
