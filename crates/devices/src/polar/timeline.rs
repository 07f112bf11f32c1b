use std::collections::VecDeque;
use std::time::Duration;

/// If the device's clock departs from the caller's by more than this, it was set \[ns\].
const CLOCK_SET_NS: i64 = 10_000_000_000;

/// The number of recent frames whose periods are remembered.
const REMEMBERED: usize = 7;

/// Places frames that are stamped at their last sample: finds the period, and lost or repeated frames.
///
/// A lost frame never stretches the samples after it: they keep the period of the previous frames.
#[derive(Debug)]
pub(super) struct Timeline {
    nominal_ns: f64,
    nominal_is_true: bool,
    periods_ns: VecDeque<f64>,
    last: Option<Last>,
    smallest_frame: u64,
    next_index: u64,
    /// Whether the link was lost since the last frame.
    lost_link: bool,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    timestamp_ns: i64,
    arrival: Duration,
}

/// The place of a frame in the timeline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub index: u64,
    pub first_ns: i64,
    pub period_ns: f64,
    pub before: Before,
}

/// What happened between a frame and the previous one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Before {
    Nothing,
    Lost(u64),
    ClockSet,
}

impl Timeline {
    /// Creates a timeline; `nominal_is_true` states that the nominal rate is right within a few percent.
    pub fn new(rate_hz: f64, nominal_is_true: bool) -> Self {
        Self {
            nominal_ns: 1e9 / rate_hz,
            nominal_is_true,
            periods_ns: VecDeque::new(),
            last: None,
            smallest_frame: u64::MAX,
            next_index: 0,
            lost_link: false,
        }
    }

    /// Records that the link was lost: the device may have been switched off and on meanwhile, which resets its clock.
    pub fn lose_link(&mut self) {
        self.lost_link = self.last.is_some();
    }

    /// Sets another rate; numbering continues.
    pub fn set_rate(&mut self, rate_hz: f64) {
        if (1e9 / rate_hz - self.nominal_ns).abs() > 1.0 {
            self.nominal_ns = 1e9 / rate_hz;
            self.periods_ns.clear();
        }
    }

    /// Places a frame; `None` if it is not stamped later than the last one.
    pub fn place(&mut self, timestamp_ns: i64, samples: u64, now: Duration) -> Option<Place> {
        let last = self.last.unwrap_or(Last { timestamp_ns, arrival: now });
        let elapsed = timestamp_ns.saturating_sub(last.timestamp_ns);
        let waited = nanos(now).saturating_sub(nanos(last.arrival));
        let is_anew = std::mem::take(&mut self.lost_link) && elapsed <= 0;
        let clock_set = is_anew || elapsed.saturating_sub(waited).saturating_abs() > CLOCK_SET_NS;
        let is_first = self.last.is_none();
        if elapsed <= 0 && !is_first && !clock_set {
            return None;
        }
        self.last = Some(Last { timestamp_ns, arrival: now });
        self.smallest_frame = self.smallest_frame.min(samples);
        let (period_ns, before) = if clock_set {
            (self.period_ns(), Before::ClockSet)
        } else if is_first {
            (self.period_ns(), Before::Nothing)
        } else {
            self.since_last(elapsed as f64, samples)
        };
        let lost = if let Before::Lost(lost) = before { lost } else { 0 };
        let index = self.next_index.saturating_add(lost);
        self.next_index = index.saturating_add(samples);
        let length = (samples.saturating_sub(1)) as f64 * period_ns;
        let first_ns = timestamp_ns.saturating_sub(length.round() as i64);
        Some(Place { index, first_ns, period_ns, before })
    }

    fn since_last(&mut self, elapsed_ns: f64, samples: u64) -> (f64, Before) {
        let period_ns = elapsed_ns / samples.max(1) as f64;
        let knows = self.nominal_is_true || !self.periods_ns.is_empty();
        let lost = (elapsed_ns / self.period_ns()).round() as u64;
        let lost = lost.saturating_sub(samples);
        if knows && lost.saturating_mul(2) > self.smallest_frame {
            return (self.period_ns(), Before::Lost(lost));
        }
        if period_ns < 0.67 * self.period_ns() {
            self.periods_ns.clear();
        }
        if self.periods_ns.len() == REMEMBERED {
            self.periods_ns.pop_front();
        }
        self.periods_ns.push_back(period_ns);
        (period_ns, Before::Nothing)
    }

    /// Returns the median period of the last frames.
    fn period_ns(&self) -> f64 {
        let mut sorted: Vec<f64> = self.periods_ns.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(self.nominal_ns)
    }
}

pub(super) fn nanos(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}
