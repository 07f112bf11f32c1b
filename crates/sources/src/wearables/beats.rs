//! The times of beats from straps that report only intervals.

use std::collections::VecDeque;

/// How far the beat clock is set back when intervals are missing \[ms\]: two days, so that this is recognised as a
/// restart, however long the clock ran.
const RESTART_MS: f64 = 172_800_000.0;
/// The number of notifications whose bounds are kept: about a minute, in which no two clocks drift far apart.
const REMEMBERED: usize = 64;
/// The most that the estimate stays below the upper bound; once the bounds are closer than twice this, it is their
/// middle \[ms\].
const MIDDLE_MS: f64 = 20.0;

/// A clock that advances by each interval, which is all that a strap reports about the time of its beats.
///
/// Its reading when a notification is sent is bounded on two sides: it is past the last beat in the notification and
/// not yet at the next one. As beats are irregular relative to notifications, a minute of notifications narrows this to
/// some milliseconds. When intervals are missing, the clock restarts, as their sum is unknown.
#[derive(Clone, Debug, Default)]
pub(super) struct BeatClock {
    /// The time of the last beat \[ms\]; `None` before the first, and when intervals are missing.
    beat: Option<f64>,
    /// The total time set back so far \[ms\].
    set_back: f64,
    /// When the last two notifications arrived \[ms\], the newest first.
    arrivals: [Option<f64>; 2],
    /// The smallest and the largest lead of arrivals over this clock, from each notification \[ms\].
    ahead: VecDeque<(f64, f64)>,
}

impl BeatClock {
    /// Handles a notification; returns the time of this clock when it was sent \[ns\].
    pub fn notified(&mut self, arrival_ms: f64) -> i64 {
        self.arrivals = [Some(arrival_ms), self.arrivals[0]];
        self.nanos(arrival_ms - self.ahead_ms())
    }

    /// Returns the times of the beats that end the intervals in the last notification \[ns\].
    pub fn beats(&mut self, intervals_ms: &[f64]) -> Vec<i64> {
        let [Some(arrival_ms), before_ms] = self.arrivals else { return Vec::new() };
        let sum_ms: f64 = intervals_ms.iter().sum();
        let is_first = self.beat.is_none();
        let mut beat_ms = self.beat.unwrap_or(arrival_ms - sum_ms);
        let first_ms = beat_ms + intervals_ms.first().copied().unwrap_or(0.0);
        let next = |interval_ms: &f64| {
            beat_ms += interval_ms;
            beat_ms
        };
        let beats: Vec<f64> = intervals_ms.iter().map(next).collect();
        self.beat = Some(beat_ms);
        let least_ms = before_ms.filter(|_| !is_first).map(|before_ms| before_ms - first_ms);
        self.bound(least_ms.unwrap_or(f64::NEG_INFINITY), arrival_ms - beat_ms);
        beats.into_iter().map(|beat_ms| self.nanos(beat_ms)).collect()
    }

    /// Returns the times of a notification's beats by the clock of arrivals \[ms\].
    pub fn arrived(&mut self, arrival_ms: f64, intervals_ms: &[f64]) -> Vec<f64> {
        self.notified(arrival_ms);
        let beats = self.beats(intervals_ms);
        let now = self.nanos(arrival_ms - self.ahead_ms());
        beats.into_iter().map(|beat| arrival_ms - (now - beat) as f64 / 1e6).collect()
    }

    /// Restarts the clock, as intervals are missing before the next one.
    pub fn restart(&mut self) {
        let set_back = self.set_back - RESTART_MS;
        *self = BeatClock { set_back, arrivals: self.arrivals, ..BeatClock::default() };
    }

    fn bound(&mut self, least_ms: f64, most_ms: f64) {
        self.ahead.push_back((least_ms, most_ms));
        while self.ahead.len() > REMEMBERED {
            self.ahead.pop_front();
        }
        // Clocks drift apart, and packets are sometimes late: bounds older than a contradiction do not count.
        while self.ahead.len() > 1 && self.bounds().0 > self.bounds().1 {
            self.ahead.pop_front();
        }
    }

    fn bounds(&self) -> (f64, f64) {
        let all = self.ahead.iter();
        all.fold((f64::NEG_INFINITY, f64::INFINITY), |(least, most), each| {
            (least.max(each.0), most.min(each.1))
        })
    }

    /// The lead of arrivals over this clock. The time filter keeps the smallest value, so a large one is used at first.
    fn ahead_ms(&self) -> f64 {
        match self.bounds() {
            (_, f64::INFINITY) => 0.0,
            (least_ms, most_ms) => most_ms - ((most_ms - least_ms) / 2.0).min(MIDDLE_MS),
        }
    }

    fn nanos(&self, ms: f64) -> i64 {
        ((ms + self.set_back) * 1e6).round() as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beats_are_as_far_apart_as_their_intervals() {
        let mut clock = BeatClock::default();
        clock.notified(5000.0);
        assert_eq!(clock.beats(&[800.0, 750.5]), [4_249_500_000, 5_000_000_000]);
        clock.notified(6000.0);
        assert_eq!(clock.beats(&[600.0]), [5_600_000_000]);
    }

    #[test]
    fn where_intervals_are_missing_the_clock_starts_again() {
        let mut clock = BeatClock::default();
        clock.notified(1e8);
        let before = clock.beats(&[1000.0])[0];
        clock.restart();
        clock.notified(2e8);
        assert!(clock.beats(&[1000.0])[0] < before - 60_000_000_000_000);
    }

    /// Beats 0.6 to 0.9 s apart, with a notification every second, 20 ms late, whose last beat was up to 0.9 s earlier.
    #[test]
    fn a_minute_of_notifications_shows_when_beats_were() {
        let mut clock = BeatClock::default();
        let beats = (0..100_u32).scan(0.0, |beat_ms, at| {
            *beat_ms += 600.0 + f64::from(at * 7919 % 300);
            Some(*beat_ms)
        });
        let beats: Vec<f64> = beats.collect();
        let mut ahead_ms = f64::NAN;
        for second in 1..60 {
            let sent_ms = f64::from(second) * 1000.0;
            let since = beats.partition_point(|beat_ms| *beat_ms <= sent_ms - 1000.0);
            let until = beats.partition_point(|beat_ms| *beat_ms <= sent_ms);
            let intervals: Vec<f64> =
                (since.max(1)..until).map(|at| beats[at] - beats[at - 1]).collect();
            let shown_ms = clock.notified(sent_ms + 20.0) as f64 / 1e6;
            if let Some(last) = clock.beats(&intervals).last() {
                // By this clock the notification was so long after the last beat; and in truth.
                let (by_clock, truly) = (shown_ms - *last as f64 / 1e6, sent_ms - beats[until - 1]);
                ahead_ms = by_clock - truly;
            }
        }
        assert!(ahead_ms.abs() < 20.0, "{ahead_ms} ms");
    }
}
