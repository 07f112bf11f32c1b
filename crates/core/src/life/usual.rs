//! The rate that a stream usually has: declared, or learned in its first minute.

use std::collections::VecDeque;

use crate::time::Time;

/// The minimum number of samples for a learned rate, the shortest time that they cover [s], and the
/// time after the first sample in which it is learned [s].
const LEARNED_FROM: u64 = 5;
const LEARNED_FROM_SECS: f64 = 2.0;
const LEARNED_WITHIN_SECS: f64 = 60.0;
/// The number of seconds for which a rate must last to be learned: a burst after a pause raises it for less time.
const KEPT_UP_SECS: usize = 13;
/// The rate that is expected of a stream.
#[derive(Clone, Debug)]
pub(super) enum UsualRate {
    /// The rate that was declared [Hz].
    Declared(f64),
    /// A rate that is being learned, or was learned.
    Learned {
        /// The rate learned so far [Hz].
        expected_hz: Option<f64>,
        /// The rates of the last seconds, while the usual one is learned [Hz].
        held_hz: VecDeque<f64>,
    },
}

/// The arrivals of a stream so far.
pub(super) struct Heard {
    /// When the first sample arrived.
    pub(super) first: Time,
    /// When the newest sample arrived.
    pub(super) newest: Time,
    /// The number of samples.
    pub(super) received: u64,
    /// The second that has just passed.
    pub(super) now: Time,
}

impl UsualRate {
    /// A declared rate [Hz], or one that is to be learned when that is 0.
    pub(super) fn of(declared_hz: f64) -> UsualRate {
        if declared_hz > 0.0 {
            UsualRate::Declared(declared_hz)
        } else {
            UsualRate::Learned { expected_hz: None, held_hz: VecDeque::new() }
        }
    }

    /// The expected rate [Hz]; `None` while it is unknown.
    pub(super) fn expected_hz(&self) -> Option<f64> {
        match self {
            UsualRate::Declared(expected_hz) => Some(*expected_hz),
            UsualRate::Learned { expected_hz, .. } => *expected_hz,
        }
    }

    /// Learns the rate in the first minute: the fastest rate that lasted, so that silence does not lower it. `rate_hz`
    /// is the current rate.
    pub(super) fn learn(&mut self, heard: &Heard, rate_hz: impl FnOnce() -> f64) {
        let UsualRate::Learned { expected_hz, held_hz } = self else { return };
        let between_secs = heard.newest.secs_since(heard.first);
        let enough = heard.received >= LEARNED_FROM && between_secs >= LEARNED_FROM_SECS;
        if !enough || heard.now.secs_since(heard.first) > LEARNED_WITHIN_SECS {
            return;
        }
        let silent_secs = heard.now.secs_since(heard.newest);
        if expected_hz.is_some_and(|hz| is_stale(silent_secs, hz)) {
            return;
        }
        held_hz.push_back(rate_hz());
        let kept_up_hz = held_hz.iter().copied().fold(f64::INFINITY, f64::min);
        if held_hz.len() <= KEPT_UP_SECS {
            *expected_hz = Some(kept_up_hz);
        } else {
            held_hz.pop_front();
            *expected_hz = expected_hz.map(|known| known.max(kept_up_hz));
        }
    }
}

/// Whether a stream with this rate [Hz] has been silent for longer than it should be.
pub(super) fn is_stale(silent_secs: f64, expected_hz: f64) -> bool {
    silent_secs > f64::max(3.0 / expected_hz, 1.0)
}
