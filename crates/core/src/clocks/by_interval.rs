//! The latency of a device over links with a known connection interval.

use teampulse_timefilter::clock::{ClockState, ConnectionInterval, Latency};

use super::IntervalLatency;

/// How fast the applied latency moves to a new one: 5 ms per second, so that samples stay in order.
const SLEW: f64 = 5e-3;

/// Recognises the connection interval of a link, and moves to the latency for this interval.
pub(super) struct ByInterval {
    /// The latency that the device's clock model already subtracts.
    base: Latency,
    intervals: Vec<IntervalLatency>,
    link: ConnectionInterval,
    /// The latency for the link's interval; the base latency while the interval is unknown.
    latency: Latency,
    /// The additional latency that is applied [s], and when it was last updated [ns].
    more_secs: f64,
    at: Option<i64>,
}

impl ByInterval {
    pub(super) fn new(base: Latency, intervals: Vec<IntervalLatency>) -> ByInterval {
        let link = ConnectionInterval::default();
        ByInterval { base, intervals, link, latency: base, more_secs: 0.0, at: None }
    }

    /// Takes in the arrival of a packet [ns]; returns the latency to subtract in addition to the base latency [s].
    pub(super) fn more_secs(&mut self, arrival: i64) -> f64 {
        self.link.push(arrival);
        let of_link = self.link.secs().and_then(|secs| {
            self.intervals
                .iter()
                .find(|interval| interval.is_of(secs))
                .map(IntervalLatency::latency)
        });
        self.latency = of_link.unwrap_or(self.base);
        let last = self.at.replace(arrival).unwrap_or(arrival);
        let most = SLEW * arrival.saturating_sub(last).max(0) as f64 / 1e9;
        self.more_secs += self.lacking_secs().clamp(-most, most);
        self.more_secs
    }

    /// Converts the state of a model that subtracts the base latency to the state with the link's latency.
    pub(super) fn state(&self, state: ClockState) -> ClockState {
        let (base, now) = (self.base.uncertainty_secs, self.latency.uncertainty_secs);
        let of_model = (state.uncertainty_secs.powi(2) - base.powi(2)).max(0.0).sqrt();
        let uncertainty_secs = if state.uncertainty_secs.is_nan() {
            f64::NAN
        } else {
            of_model.hypot(now) + self.lacking_secs().abs()
        };
        ClockState { offset_secs: state.offset_secs + self.more_secs, uncertainty_secs, ..state }
    }

    /// How far the applied latency is still below the link's latency [s].
    fn lacking_secs(&self) -> f64 {
        self.latency.secs - self.base.secs - self.more_secs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn of_links() -> ByInterval {
        let of = |interval_secs, latency_secs| IntervalLatency {
            interval_secs,
            latency_secs,
            uncertainty_secs: Some(0.002),
        };
        ByInterval::new(Latency::new(0.05, 0.05), vec![of(0.015, 0.045), of(0.05, 0.06)])
    }

    /// Packets at 52 Hz wait for the next event; the largest step of the subtracted latency [s].
    fn feed(by_interval: &mut ByInterval, interval_secs: f64, from_secs: i64) -> f64 {
        let mut steepest = 0.0_f64;
        for number in 0..52 * 20 {
            let sent = f64::from(number) / 52.0;
            let taken = (sent / interval_secs).ceil() * interval_secs;
            let before = by_interval.more_secs;
            let more = by_interval.more_secs(from_secs * SECOND + (taken * 1e9) as i64);
            steepest = steepest.max((more - before).abs());
        }
        steepest
    }

    #[test]
    fn the_latency_is_that_of_the_link_once_it_is_recognised() {
        let mut by_interval = of_links();
        assert!(feed(&mut by_interval, 0.05, 1_000) < 0.001, "samples stay in order");
        assert!((by_interval.more_secs - 0.01).abs() < 1e-9);
        feed(&mut by_interval, 0.015, 1_100);
        assert!((by_interval.more_secs + 0.005).abs() < 1e-9);
    }

    #[test]
    fn a_link_with_an_unlisted_interval_keeps_the_base_latency() {
        let mut by_interval = of_links();
        feed(&mut by_interval, 0.03, 1_000);
        assert!(by_interval.more_secs.abs() < f64::EPSILON);
    }

    #[test]
    fn the_uncertainty_is_that_of_the_latency_in_force() {
        let mut by_interval = of_links();
        let model = ClockState { uncertainty_secs: 0.05_f64.hypot(0.001), ..super::super::UNKNOWN };
        assert!((by_interval.state(model).uncertainty_secs - 0.05_f64.hypot(0.001)).abs() < 1e-9);
        feed(&mut by_interval, 0.05, 1_000);
        assert!((by_interval.state(model).uncertainty_secs - 0.002_f64.hypot(0.001)).abs() < 1e-9);
        assert!(by_interval.state(super::super::UNKNOWN).uncertainty_secs.is_nan());
    }
}
