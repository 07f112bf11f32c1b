//! The heart rate around events.

use crate::analysis::Reason;
use crate::error::{SignalError, checked};

/// The plausible intervals between neighbouring beats [s]; a longer one is a hole.
const INTERVALS_SECS: std::ops::RangeInclusive<f64> = 0.24..=2.5;
/// The longest baseline and the longest time after an event [s].
const LONGEST_SECS: f64 = 120.0;

/// The spans around an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventSpans {
    /// The length of the baseline, which ends with the event [s], 1 to 120.
    pub baseline_secs: f64,
    /// The time after the event [s], 1 to 120; only whole seconds count.
    pub after_secs: f64,
}

impl Default for EventSpans {
    /// A baseline of 2 s and 6 s after the event: the deceleration of orienting and the acceleration after it lie
    /// within 6 s.
    fn default() -> EventSpans {
        EventSpans { baseline_secs: 2.0, after_secs: 6.0 }
    }
}

/// The heart rate around one event.
#[derive(Clone, Debug, PartialEq)]
pub struct EventRate {
    /// The rate before the event [1/min].
    pub baseline_per_min: f64,
    /// The change of the rate from the baseline in each second after the event [1/min].
    pub changes_per_min: Vec<f64>,
}

impl EventRate {
    /// The mean change from the baseline [1/min].
    pub fn mean_change_per_min(&self) -> f64 {
        self.changes_per_min.iter().sum::<f64>() / self.changes_per_min.len() as f64
    }

    /// The change in the second with the highest rate [1/min], and the start of that second after the event [s].
    pub fn most_change(&self) -> (f64, f64) {
        self.extreme(|one, other| one > other)
    }

    /// The change in the second with the lowest rate [1/min], and the start of that second after the event [s].
    pub fn least_change(&self) -> (f64, f64) {
        self.extreme(|one, other| one < other)
    }

    fn extreme(&self, is_beyond: fn(f64, f64) -> bool) -> (f64, f64) {
        let mut found = (self.changes_per_min[0], 0.0);
        for (second, &change) in self.changes_per_min.iter().enumerate() {
            if is_beyond(change, found.0) {
                found = (change, second as f64);
            }
        }
        found
    }
}

impl EventSpans {
    /// Computes the heart rate around each event, second by second.
    ///
    /// - *What*: how the heart responds to an event: it slows down when something is noticed, and speeds up
    ///   with effort and arousal.
    /// - *Formula*: the rate of a span is the mean of 60 over each interval between beats that overlaps it,
    ///   weighted by the length of the overlap (Graham 1978, Psychophysiology 15, 492), which needs no
    ///   interpolation between beats; changes are differences from the span before the event.
    /// - *Unit*: 1/min.
    /// - *Limits*: at rest an interval lasts about as long as a second of the result, so neighbouring
    ///   seconds share beats. Breathing alone changes the rate by 5 to 10 a minute: average over events.
    ///
    /// `beats_secs` must be in order of time; premature and missed beats should be
    /// [corrected](crate::intervals::Correction). The reason for an event is `Gap` where an interval of the spans is
    /// missing or implausible (below 0.24 or above 2.5 s), as at the ends of a recording, and `Undefined` for an event
    /// that is not a finite number. Returns an error for spans out of range.
    ///
    /// ```
    /// use teampulse_signal::hrv::EventSpans;
    ///
    /// // 60 a minute; from 30 s on, 75.
    /// let beats_secs: Vec<f64> = (0..=30).map(f64::from).chain((1..40).map(|k| 30.0 + 0.8 * f64::from(k))).collect();
    /// let around = EventSpans::default().around(&beats_secs, &[20.0, 30.0, 500.0])?;
    /// assert_eq!(around[0].as_ref().map(|rate| rate.mean_change_per_min().round()), Ok(0.0));
    /// assert_eq!(around[1].as_ref().map(|rate| rate.baseline_per_min.round()), Ok(60.0));
    /// assert_eq!(around[1].as_ref().map(|rate| rate.mean_change_per_min().round()), Ok(15.0));
    /// assert!(around[2].is_err());
    /// # Ok::<(), teampulse_signal::error::SignalError>(())
    /// ```
    pub fn around(
        &self,
        beats_secs: &[f64],
        events_secs: &[f64],
    ) -> Result<Vec<Result<EventRate, Reason>>, SignalError> {
        checked("the baseline [s]", self.baseline_secs, (1.0, LONGEST_SECS))?;
        checked("the time after the event [s]", self.after_secs, (1.0, LONGEST_SECS))?;
        let of_event = |&event_secs: &f64| self.of_event(beats_secs, event_secs);
        Ok(events_secs.iter().map(of_event).collect())
    }

    fn of_event(&self, beats_secs: &[f64], event_secs: f64) -> Result<EventRate, Reason> {
        if !event_secs.is_finite() {
            return Err(Reason::Undefined);
        }
        let baseline_per_min = rate_of(beats_secs, event_secs - self.baseline_secs, event_secs)?;
        let change = |second: usize| {
            let begin_secs = event_secs + second as f64;
            rate_of(beats_secs, begin_secs, begin_secs + 1.0).map(|rate| rate - baseline_per_min)
        };
        let changes = (0..self.after_secs as usize).map(change);
        Ok(EventRate { baseline_per_min, changes_per_min: changes.collect::<Result<_, _>>()? })
    }
}

/// The rate of a span, from the intervals that overlap it, weighted by the overlap [1/min].
fn rate_of(beats_secs: &[f64], begin_secs: f64, end_secs: f64) -> Result<f64, Reason> {
    let after = beats_secs.partition_point(|beat| *beat <= begin_secs);
    let mut weighted = 0.0;
    for pair in beats_secs[after.checked_sub(1).ok_or(Reason::Gap)?..].windows(2) {
        let interval_secs = pair[1] - pair[0];
        // This also rejects NaN.
        if !INTERVALS_SECS.contains(&interval_secs) {
            return Err(Reason::Gap);
        }
        let overlap_secs = pair[1].min(end_secs) - pair[0].max(begin_secs);
        weighted += 60.0 / interval_secs * overlap_secs;
        if pair[1] >= end_secs {
            return Reason::unless_finite(weighted / (end_secs - begin_secs));
        }
    }
    Err(Reason::Gap)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Beats of a heart that slows down from 75 to 60 a minute for 3 s after each event, 20 s apart.
    fn slowing() -> Vec<f64> {
        let (mut beats, mut at) = (Vec::new(), 0.0);
        while at < 200.0 {
            beats.push(at);
            at += if at % 20.0 < 3.0 { 1.0 } else { 0.8 };
        }
        beats
    }

    #[test]
    fn a_heart_that_slows_down_after_events_shows_it() {
        let events: Vec<f64> = (1..9).map(|k| 20.0 * f64::from(k)).collect();
        let around = EventSpans::default().around(&slowing(), &events).unwrap();
        for rate in around.into_iter().map(Result::unwrap) {
            assert!((rate.baseline_per_min - 75.0).abs() < 1e-6);
            let (least, after_secs) = rate.least_change();
            assert!((least + 15.0).abs() < 1e-6 && (1.0..3.0).contains(&after_secs));
            assert!(rate.most_change().0.abs() < 1e-6 && rate.changes_per_min.len() == 6);
        }
    }

    #[test]
    fn a_hole_between_beats_is_no_slow_heart() {
        let mut beats = slowing();
        beats.retain(|at| !(63.0..66.5).contains(at));
        let around = EventSpans::default().around(&beats, &[40.0, 60.0, 80.0]).unwrap();
        assert!(around[0].is_ok() && around[2].is_ok());
        assert_eq!(around[1], Err(Reason::Gap));
    }

    #[test]
    fn events_at_the_ends_have_no_rate() {
        let around = EventSpans::default().around(&slowing(), &[1.0, 198.0, f64::NAN]).unwrap();
        assert_eq!(around, [Err(Reason::Gap), Err(Reason::Gap), Err(Reason::Undefined)]);
        assert_eq!(EventSpans::default().around(&[], &[1.0]).unwrap(), [Err(Reason::Gap)]);
    }

    #[test]
    fn spans_out_of_range_are_refused() {
        for (baseline_secs, after_secs) in [(0.0, 6.0), (2.0, 0.5), (2.0, 1e9), (f64::NAN, 6.0)] {
            assert!(EventSpans { baseline_secs, after_secs }.around(&[], &[]).is_err());
        }
    }

    proptest! {
        #[test]
        fn no_beats_give_nonsense(
            mut beats in prop::collection::vec(prop_oneof![prop::num::f64::ANY, 0.0..60.0], 0..200),
            sorted in any::<bool>(),
            event in prop_oneof![prop::num::f64::ANY, 0.0..60.0],
        ) {
            if sorted {
                beats.sort_unstable_by(f64::total_cmp);
            }
            let around = EventSpans::default().around(&beats, &[event]).unwrap();
            if let Ok(rate) = &around[0] {
                prop_assert!(rate.baseline_per_min.is_finite() && rate.mean_change_per_min().is_finite());
                prop_assert!(rate.least_change().0 <= rate.most_change().0);
            }
        }
    }
}
