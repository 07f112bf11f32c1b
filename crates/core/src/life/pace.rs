//! The rate of a stream, from the times between its arrivals.

use std::collections::VecDeque;

use crate::time::Time;

/// The span over which a rate is counted [s], and the minimum number of arrivals, for slower streams.
const WINDOW_SECS: f64 = 10.0;
const FEWEST_ARRIVALS: u64 = 5;
/// Counting restarts after a pause that is longer than this many usual intervals and than this many seconds [s].
const PAUSE_INTERVALS: f64 = 10.0;
const PAUSE_SECS: f64 = 5.0;
/// Samples within this time count as one arrival: networks and radios deliver in bursts [s].
const BURST_SECS: f64 = 0.02;
/// The first arrival counts as a backlog if it has more than this many times the samples of a usual arrival.
const BACKLOG: f64 = 2.0;

/// The rate of a stream: the number of samples between its first recent arrival and its last.
///
/// The counted time ends with the last arrival, whose samples belong to the next interval, so the rate is right from
/// the second arrival on. A backlog at the start counts as one usual arrival.
#[derive(Clone, Debug, Default)]
pub(super) struct Pace {
    stretches: VecDeque<Stretch>,
    /// The number of samples of the last arrival, and of the one before it.
    last_samples: u64,
    before_samples: Option<u64>,
}

/// The arrivals of about a second.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    first: Time,
    last: Time,
    arrivals: u64,
    samples: u64,
    /// The samples of its first arrival.
    first_samples: u64,
}

impl Pace {
    /// Takes in the arrival of this many samples at a time.
    pub(super) fn arrived(&mut self, samples: u64, at: Time) {
        let pause_secs = self.last().map_or(0.0, |last| at.secs_since(last));
        let is_anew = self.interval_secs().is_some_and(|usual_secs| {
            pause_secs > f64::max(PAUSE_INTERVALS * usual_secs, PAUSE_SECS)
        });
        if is_anew {
            self.stretches.clear();
        }
        let is_burst = self.last().is_some_and(|last| at.secs_since(last) < BURST_SECS);
        if !is_burst {
            self.before_samples = self.last().map(|_| self.last_samples);
            self.last_samples = 0;
        }
        self.last_samples = self.last_samples.saturating_add(samples);
        match self.stretches.back_mut() {
            Some(stretch) if is_burst || at.secs_since(stretch.first) < 1.0 => {
                stretch.samples = stretch.samples.saturating_add(samples);
                if !is_burst {
                    stretch.last = at;
                    stretch.arrivals += 1;
                } else if stretch.arrivals == 1 {
                    stretch.first_samples = stretch.samples;
                }
            }
            _ => self.stretches.push_back(Stretch {
                first: at,
                last: at,
                arrivals: 1,
                samples,
                first_samples: samples,
            }),
        }
        let is_old = |stretch: &Stretch| at.secs_since(stretch.first) > WINDOW_SECS;
        while let Some(first) = self.stretches.front().copied().filter(is_old)
            && self.arrivals() - first.arrivals >= FEWEST_ARRIVALS
        {
            self.stretches.pop_front();
        }
    }

    /// The number of samples per arrival: the smaller one of the last two arrivals, as an arrival after silence may be
    /// a backlog.
    pub(super) fn run(&self) -> u64 {
        self.before_samples.unwrap_or(u64::MAX).min(self.last_samples).max(1)
    }

    /// The rate at `now` [Hz]; 0 before the second arrival, and after a long silence.
    ///
    /// The rate falls as soon as a stream is silent for longer than usual.
    pub(super) fn rate_hz(&self, now: Time) -> f64 {
        let (Some(first), Some(last)) = (self.stretches.front(), self.last()) else { return 0.0 };
        let Some(usual_secs) = self.interval_secs() else { return 0.0 };
        let silent_secs = now.secs_since(last);
        if silent_secs > f64::max(WINDOW_SECS, PAUSE_INTERVALS * usual_secs) {
            return 0.0;
        }
        let secs = last.secs_since(first.first) + (silent_secs - usual_secs).max(0.0);
        self.counted_samples(first.first_samples) / secs
    }

    /// The samples of all arrivals except the last; a backlog in the first counts as a usual arrival.
    fn counted_samples(&self, first_samples: u64) -> f64 {
        let samples = self.stretches.iter().map(|each| each.samples).fold(0, u64::saturating_add);
        let counted = samples.saturating_sub(self.last_samples);
        let between = counted.saturating_sub(first_samples) as f64;
        // The second arrival may be incomplete until there is a third.
        let usual = match self.arrivals() {
            ..3 => f64::INFINITY,
            arrivals => between / (arrivals - 2) as f64,
        };
        let is_backlog = first_samples as f64 > BACKLOG * usual;
        between + if is_backlog { usual } else { first_samples as f64 }
    }

    fn last(&self) -> Option<Time> {
        self.stretches.back().map(|stretch| stretch.last)
    }

    fn arrivals(&self) -> u64 {
        self.stretches.iter().map(|stretch| stretch.arrivals).sum()
    }

    /// The mean time from one arrival to the next [s]; `None` before the second.
    fn interval_secs(&self) -> Option<f64> {
        let intervals = self.arrivals().checked_sub(1).filter(|count| *count > 0)?;
        let first = self.stretches.front()?.first;
        Some(self.last()?.secs_since(first) / intervals as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(secs: f64) -> Time {
        Time::from_nanos((secs * 1e9).round() as i64)
    }

    /// Advances from one second to another with this many arrivals a second.
    fn come(pace: &mut Pace, from_secs: f64, to_secs: f64, hz: f64) {
        let count = ((to_secs - from_secs) * hz).round() as usize;
        (0..count).for_each(|k| pace.arrived(1, at(from_secs + k as f64 / hz)));
    }

    fn assert_rate(pace: &Pace, now_secs: f64, expected_hz: f64) {
        let rate_hz = pace.rate_hz(at(now_secs));
        let off = (rate_hz / expected_hz - 1.0).abs();
        assert!(off < 1e-6, "{rate_hz} Hz at {now_secs} s, expected {expected_hz} Hz");
    }

    #[test]
    fn a_rate_is_right_from_the_second_arrival_on() {
        for hz in [0.05, 0.2, 1.0, 3.0, 130.0, 1000.0] {
            let mut pace = Pace::default();
            for k in 0..200 {
                let now_secs = f64::from(k) / hz;
                pace.arrived(1, at(now_secs));
                match k {
                    0 => assert!(pace.rate_hz(at(now_secs)) < 1e-12),
                    // One arrival so far.
                    _ if now_secs < 2.0 * BURST_SECS => {}
                    _ => assert_rate(&pace, now_secs + 0.9 / hz, hz),
                }
            }
        }
    }

    #[test]
    fn a_run_counts_for_the_time_before_it() {
        let mut pace = Pace::default();
        for k in 1..30 {
            pace.arrived(73, at(f64::from(k) * 73.0 / 130.0));
            if k > 1 {
                assert_rate(&pace, f64::from(k) * 73.0 / 130.0 + 0.2, 130.0);
            }
        }
    }

    #[test]
    fn a_backlog_at_the_start_does_not_count() {
        for (held, hz) in [(275_u64, 250.0), (1_100, 1000.0), (5, 1.0)] {
            let mut pace = Pace::default();
            // It is handed over piece by piece.
            (0..held).for_each(|k| pace.arrived(1, at(k as f64 * 1e-6)));
            for k in 1..3000 {
                let now_secs = f64::from(k) / hz;
                pace.arrived(1, at(now_secs));
                if now_secs > 1.0 {
                    let rate_hz = pace.rate_hz(at(now_secs));
                    assert!((rate_hz / hz - 1.0).abs() < 0.05, "{rate_hz} Hz at {now_secs} s");
                }
            }
        }
    }

    #[test]
    fn bursts_are_one_arrival_each() {
        let mut pace = Pace::default();
        for k in 0..60 {
            pace.arrived(1, at(f64::from(k / 10) + f64::from(k % 10) / 1e4));
            if k > 10 {
                assert_rate(&pace, f64::from(k / 10) + 0.5, 10.0);
            }
        }
    }

    #[test]
    fn after_a_pause_the_rate_is_right_again_at_once() {
        let mut pace = Pace::default();
        come(&mut pace, 0.0, 20.0, 10.0);
        assert!(pace.rate_hz(at(40.0)) < 1e-12);
        come(&mut pace, 60.0, 60.5, 10.0);
        assert_rate(&pace, 60.5, 10.0);
    }

    #[test]
    fn a_single_message_long_before_the_others_is_soon_forgotten() {
        let mut pace = Pace::default();
        pace.arrived(1, at(0.0));
        come(&mut pace, 60.0, 61.0, 10.0);
        assert_rate(&pace, 61.0, 10.0);
    }

    #[test]
    fn a_silence_lowers_the_rate() {
        let mut pace = Pace::default();
        come(&mut pace, 0.0, 10.0, 10.0);
        let rates_hz = [10.0, 12.0, 15.0, 19.0].map(|secs| pace.rate_hz(at(secs)));
        assert!(rates_hz.is_sorted_by(|a, b| a > b), "{rates_hz:?}");
    }

    #[test]
    fn a_change_of_the_rate_is_known_after_ten_seconds() {
        let mut pace = Pace::default();
        come(&mut pace, 0.0, 20.0, 10.0);
        come(&mut pace, 20.0, 32.0, 4.0);
        assert_rate(&pace, 32.0, 4.0);
    }
}
