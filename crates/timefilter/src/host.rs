//! The clock model of a source that stamps by this host's clock.

/// How far a stamp may be from its arrival and still be believed [ns].
const BELIEVED_NANOS: u64 = 1_000_000_000;

/// The stamps of one sample [ns since the Unix epoch].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamps {
    /// The stamp that its source put on it; `None` when it put none.
    pub source: Option<i64>,
    /// When it arrived, by the session's clock.
    pub arrival: i64,
}

/// A sample's place in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corrected {
    /// When it was measured [ns since the Unix epoch].
    pub measured: i64,
    /// Whether the source's stamp was too far from the arrival to be believed.
    pub disbelieved: bool,
}

/// A source that stamps by the host's clock, or not at all.
///
/// A stamp within one second of its arrival is taken as it is; any other, and a missing one, is
/// replaced by the arrival.
#[derive(Clone, Debug, Default)]
pub struct Host {
    disbelieved: u64,
}

impl Host {
    /// The place in time of the next sample.
    pub fn correct(&mut self, stamps: Stamps) -> Corrected {
        let arrival = stamps.arrival;
        match stamps.source {
            Some(source) if source.abs_diff(arrival) <= BELIEVED_NANOS => {
                Corrected { measured: source, disbelieved: false }
            }
            Some(_) => {
                self.disbelieved += 1;
                Corrected { measured: arrival, disbelieved: true }
            }
            None => Corrected { measured: arrival, disbelieved: false },
        }
    }

    /// How many stamps were not believed.
    pub fn disbelieved(&self) -> u64 {
        self.disbelieved
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
            assert_eq!(host.correct(Stamps { source, arrival: 100 }).measured, measured);
        }
        assert_eq!(host.disbelieved(), 2);
    }
}
