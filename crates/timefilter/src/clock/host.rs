//! The clock model of a source that stamps by this host's clock.

use super::{ClockKind, ClockModel, ClockState, Corrected, Stamps};

/// How far a stamp may be from its arrival and still be believed [ns].
const BELIEVED_NANOS: u64 = 1_000_000_000;

/// A source that stamps by the host's clock, or not at all.
///
/// A stamp within one second of its arrival is taken as it is; any other, and a missing one, is
/// replaced by the arrival.
#[derive(Clone, Debug, Default)]
pub struct Host {
    disbelieved: u64,
}

impl Host {
    /// How many stamps were not believed.
    pub fn disbelieved(&self) -> u64 {
        self.disbelieved
    }
}

impl ClockModel for Host {
    fn correct(&mut self, stamps: &Stamps) -> Corrected {
        let arrival = stamps.arrival;
        let believed = |source: &i64| source.abs_diff(arrival) <= BELIEVED_NANOS;
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
}
