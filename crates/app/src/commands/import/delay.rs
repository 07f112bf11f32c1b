//! How much later a recording shows an event than a session does, which no clock can show.

use teampulse_core::stream::Signal;
use teampulse_timefilter::clock::Latency;

/// Events, by what they are and what saw them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen<'a> {
    pub kind: Kind,
    /// As a token of a topic; empty where it is unknown.
    pub device: &'a str,
}

impl Seen<'_> {
    /// Whether the pulses on both sides are of one kind of device.
    pub(super) fn is_as(self, other: Seen<'_>) -> bool {
        self == other && self.kind == Kind::Pulses && !self.device.is_empty()
    }
}

/// How much later a recording shows an event than a session, where the person's pulse arrival time may be known.
pub(super) fn delay(
    session: Seen<'_>,
    recording: Seen<'_>,
    pulse_arrival: Option<Latency>,
) -> Latency {
    if session.is_as(recording) {
        return SAME_DEVICE;
    }
    let arrival = pulse_arrival.unwrap_or(PULSE_ARRIVAL);
    let uncertainty_secs = arrival.uncertainty_secs.hypot(PULSE_RISE.uncertainty_secs);
    let to_peak = Latency::new(arrival.secs + PULSE_RISE.secs, uncertainty_secs);
    match (session.kind, recording.kind) {
        (Kind::Marks, _) => Latency::new(0.0, 0.0),
        (Kind::Movement, _) => BETWEEN_SENSORS,
        (Kind::Beats, Kind::Pulses) => arrival,
        (Kind::Beats, Kind::PulseIntervals) => to_peak,
        (Kind::Beats, _) => BETWEEN_ECGS,
        // The session's pulses are known by their peaks, like those of the recording.
        (Kind::Pulses, Kind::Pulses) => BETWEEN_PLACES,
        (_, Kind::Pulses | Kind::PulseIntervals) => Latency::new(0.0, PULSE_RISE.uncertainty_secs),
        (_, _) => Latency::new(-to_peak.secs, to_peak.uncertainty_secs),
    }
}

/// From the R wave to the foot of the pulse at the wrist or finger: 200 to 300 ms in 95 % of adults at rest.
const PULSE_ARRIVAL: Latency = Latency::new(0.250, 0.050);
/// From there to the systolic peak, of which a device stamps its own intervals, and what its filters add.
const PULSE_RISE: Latency = Latency::new(0.140, 0.100);
/// Two places on the body whose pulses are compared.
const BETWEEN_PLACES: Latency = Latency::new(0.0, 0.060);
/// The pulses of one kind of wristband, which are mostly the same samples, found once as they came and once as a
/// whole; a second one on the other wrist sees them up to some milliseconds apart.
pub(super) const SAME_DEVICE: Latency = Latency::new(0.0, 0.010);
/// A detector's systematic difference between two kinds of ECG.
const BETWEEN_ECGS: Latency = Latency::new(0.0, 0.005);
/// Two places on the body to which a movement spreads: a step takes tens of milliseconds from the foot to the head.
const BETWEEN_SENSORS: Latency = Latency::new(0.0, 0.025);

/// What events are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// R waves.
    Beats,
    /// Pulses; of the recording both the foot and the peak are known, of the session the peak.
    Pulses,
    /// Beats by the intervals of a device that sees the pulse.
    PulseIntervals,
    /// Samples of acceleration.
    Movement,
    Marks,
}

impl Kind {
    /// What a signal of the heart that a device measures shows; `None` for any other signal.
    pub(super) fn of(signal: Signal, device: &str) -> Option<Kind> {
        match signal {
            Signal::Ppg => Some(Kind::Pulses),
            Signal::Interval if sees_pulses(device) => Some(Kind::PulseIntervals),
            Signal::Ecg | Signal::Interval => Some(Kind::Beats),
            _ => None,
        }
    }

    /// Whether it is known by the peaks of pulses.
    pub(super) fn is_of_pulses(self) -> bool {
        matches!(self, Kind::Pulses | Kind::PulseIntervals)
    }
}

/// Whether the intervals that a device reports lie between pulses: those of straps lie between R waves.
fn sees_pulses(device: &str) -> bool {
    ["empatica", "embrace", "polar_verity_sense", "polar_oh1"]
        .iter()
        .any(|name| device.starts_with(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ECG: Seen<'_> = Seen { kind: Kind::Beats, device: "polar_h10" };
    const E4: Seen<'_> = Seen { kind: Kind::Pulses, device: "empatica_e4" };

    #[test]
    fn the_pulses_of_one_device_are_no_later_than_themselves() {
        assert_eq!(delay(E4, E4, None), SAME_DEVICE);
        let other = Seen { device: "polar_oh1", ..E4 };
        assert_eq!(delay(other, E4, None), BETWEEN_PLACES);
        let unknown = Seen { device: "", ..E4 };
        assert_eq!(delay(unknown, unknown, None), BETWEEN_PLACES);
    }

    #[test]
    fn a_pulse_is_later_than_its_beat_and_a_beat_earlier_than_its_pulse() {
        let own = Latency::new(0.22, 0.01);
        assert_eq!(delay(ECG, E4, Some(own)), own);
        let back = delay(E4, ECG, Some(own));
        assert!((back.secs + own.secs + PULSE_RISE.secs).abs() < 1e-9, "{back:?}");
        assert!(back.uncertainty_secs > PULSE_RISE.uncertainty_secs);
    }

    #[test]
    fn intervals_of_what_sees_pulses_are_between_pulses() {
        for device in ["empatica_e4", "embrace_plus", "polar_oh1"] {
            assert_eq!(Kind::of(Signal::Interval, device), Some(Kind::PulseIntervals));
        }
        assert_eq!(Kind::of(Signal::Interval, "polar_h10"), Some(Kind::Beats));
        assert_eq!(Kind::of(Signal::Eda, "empatica_e4"), None);
    }
}
