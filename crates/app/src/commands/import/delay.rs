//! How much later an event appears in a recording than in a session, which no clock can show.

use teampulse_core::stream::Signal;
use teampulse_timefilter::clock::Latency;

/// A kind of event, and the device that recorded it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen<'a> {
    pub kind: Kind,
    /// The device as a token of a topic; empty if it is unknown.
    pub device: &'a str,
}

impl Seen<'_> {
    /// Whether both are pulses from the same kind of device.
    pub(super) fn is_as(self, other: Seen<'_>) -> bool {
        self == other && self.kind == Kind::Pulses && !self.device.is_empty()
    }
}

/// Returns how much later an event appears in the recording than in the session, given the person's pulse arrival time,
/// if it is known.
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
        // The session's pulses are timed at their peaks, and so are the recording's.
        (Kind::Pulses, Kind::Pulses) => BETWEEN_PLACES,
        (_, Kind::Pulses | Kind::PulseIntervals) => Latency::new(0.0, PULSE_RISE.uncertainty_secs),
        (_, _) => Latency::new(-to_peak.secs, to_peak.uncertainty_secs),
    }
}

/// From the R wave to the foot of the pulse at the wrist or finger: 200 to 300 ms in 95 % of adults at rest.
const PULSE_ARRIVAL: Latency = Latency::new(0.250, 0.050);
/// From the foot of the pulse to the systolic peak, at which a device stamps its intervals, including the delay of its
/// filters.
const PULSE_RISE: Latency = Latency::new(0.140, 0.100);
/// Between pulses measured at two places on the body.
const BETWEEN_PLACES: Latency = Latency::new(0.0, 0.060);
/// Between the pulses of one kind of wristband. They mostly come from the same samples, detected once live and once in
/// the whole recording; a second wristband on the other wrist differs by up to some milliseconds.
pub(super) const SAME_DEVICE: Latency = Latency::new(0.0, 0.010);
/// The systematic difference of a detector between two kinds of ECG.
const BETWEEN_ECGS: Latency = Latency::new(0.0, 0.005);
/// Between movements measured at two places on the body: a step takes tens of milliseconds from the foot to the head.
const BETWEEN_SENSORS: Latency = Latency::new(0.0, 0.025);

/// The kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// R waves.
    Beats,
    /// Pulses: in the recording both the foot and the peak are known, in the session only the peak.
    Pulses,
    /// Beats from the intervals of a device that measures the pulse.
    PulseIntervals,
    /// Samples of acceleration.
    Movement,
    Marks,
}

impl Kind {
    /// Returns what a device's heart signal shows; `None` for any other signal.
    pub(super) fn of(signal: Signal, device: &str) -> Option<Kind> {
        match signal {
            Signal::Ppg => Some(Kind::Pulses),
            Signal::Interval if sees_pulses(device) => Some(Kind::PulseIntervals),
            Signal::Ecg | Signal::Interval => Some(Kind::Beats),
            _ => None,
        }
    }

    /// Whether these events are timed at the peaks of pulses.
    pub(super) fn is_of_pulses(self) -> bool {
        matches!(self, Kind::Pulses | Kind::PulseIntervals)
    }
}

/// Whether the intervals that a device reports lie between pulses; those of chest straps lie between R waves.
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
