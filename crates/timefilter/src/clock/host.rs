//! The clock model of a source whose timestamps come from this host's clock.

use super::{ClockKind, ClockModel, ClockState, Corrected, Stamps};

/// How far a timestamp may be from its arrival and still be accepted [ns].
const BELIEVED_NANOS: u64 = 1_000_000_000;

/// How long after the first arrival stored samples for a late joiner may arrive [ns].
const KEPT_NANOS: i64 = 2_000_000_000;

/// The model of a source that uses the host's clock, or no timestamps at all.
///
/// A timestamp within one second of its arrival is used unchanged; any other, and a missing one, is
/// replaced by the arrival time.
#[derive(Clone, Debug, Default)]
pub struct Host {
    disbelieved: u64,
    history: History,
}

/// Whether a source delivers samples from before the subscription.
#[derive(Clone, Copy, Debug, Default)]
enum History {
    /// The source delivers none.
    #[default]
    None,
    /// The source may deliver some; nothing has arrived yet.
    Expected,
    /// The source delivers them until this time [ns since the Unix epoch].
    Until(i64),
}

impl Host {
    /// Creates the model of a source that stores samples for late joiners and delivers them at once:
    /// samples that arrive in the first two seconds may have timestamps of any age.
    pub fn with_history() -> Host {
        Host { history: History::Expected, ..Host::default() }
    }

    /// Creates the model of a source whose timestamps refer to earlier events: there is no limit on their
    /// age.
    pub fn that_takes_long() -> Host {
        Host { history: History::Until(i64::MAX), ..Host::default() }
    }

    /// The number of rejected timestamps.
    pub fn disbelieved(&self) -> u64 {
        self.disbelieved
    }
}

impl ClockModel for Host {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let arrival = stamps.arrival;
        if matches!(self.history, History::Expected) {
            self.history = History::Until(arrival.saturating_add(KEPT_NANOS));
        }
        let tells_history = matches!(self.history, History::Until(end) if arrival <= end);
        let believed = |source: &i64| {
            let is_history = tells_history && *source <= arrival;
            is_history || source.abs_diff(arrival) <= BELIEVED_NANOS
        };
        let disbelieved = stamps.source.is_some_and(|source| !believed(&source));
        self.disbelieved += u64::from(disbelieved);
        Corrected {
            measured: stamps.source.filter(believed).unwrap_or(arrival),
            period_nanos: stamps.period_nanos,
            disbelieved,
        }
    }

    fn state(&self) -> ClockState {
        ClockState {
            kind: ClockKind::Host,
            epoch: 0,
            offset_secs: 0.0,
            skew_ppm: 0.0,
            jitter_secs: f64::NAN,
            uncertainty_secs: f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_near_its_arrival_is_believed_and_no_other() {
        let mut host = Host::default();
        for (source, measured) in
            [(Some(5), 5), (None, 100), (Some(2_000_000_000), 100), (Some(i64::MIN), 100)]
        {
            let stamps = Stamps { source, ..Stamps::arrived(100) };
            assert_eq!(host.correct(&stamps).measured, measured);
        }
        assert_eq!(host.disbelieved(), 2);
    }

    #[test]
    fn stored_samples_are_accepted_only_when_a_late_joiner_joins() {
        const SECOND: i64 = 1_000_000_000;
        let mut host = Host::with_history();
        let now = 600 * SECOND;
        for (arrival, source, measured) in [
            (now, 0, 0),
            (now + 1, 90 * SECOND, 90 * SECOND),
            (now + 2, 700 * SECOND, now + 2),
            (now + 3 * SECOND, 91 * SECOND, now + 3 * SECOND),
        ] {
            let stamps = Stamps { source: Some(source), ..Stamps::arrived(arrival) };
            assert_eq!(host.correct(&stamps).measured, measured);
        }
        assert_eq!(host.disbelieved(), 2);
    }
}
