//! Finds the beats of a person in a session.

use teampulse_bag::{Bag, BagStream};
use teampulse_core::stream::{Origin, Shape, Signal};

use super::delay::{Kind, Seen};
use super::hearts::shown_by;
use super::imported::DeviceRecording;

/// Beats detected in a session, and the signal in which they were detected.
pub(super) struct FoundBeats<'a> {
    pub known: &'a BagStream,
    signal: Signal,
    kind: Kind,
}

impl<'a> FoundBeats<'a> {
    /// Returns the beats in a stream; `None` if the stream holds anything else.
    pub(super) fn of(bag: &Bag, known: &'a BagStream) -> Option<FoundBeats<'a>> {
        let stream = &known.stream;
        let is_beats = stream.shape == Shape::Event
            && stream.origin == Origin::Derived
            && matches!(stream.name.rsplit('/').next(), Some("beats" | "pulses"))
            && known.messages > 0;
        let input = stream.inputs.first().filter(|_| is_beats)?;
        let input = bag.streams().iter().find(|other| other.stream.name == *input);
        let signal = input.map_or(Signal::Other, |input| input.stream.signal);
        let kind = Kind::of(signal, &stream.device).unwrap_or(Kind::Beats);
        Some(FoundBeats { known, signal, kind })
    }

    pub(super) fn name(&self) -> &str {
        &self.known.stream.name
    }

    pub(super) fn seen(&self) -> Seen<'a> {
        Seen { kind: self.kind, device: &self.known.stream.device }
    }

    /// Whether the recording is from the same kind of device as these beats.
    pub(super) fn is_of(&self, device: &DeviceRecording) -> bool {
        shown_by(device)
            .is_some_and(|kind| self.seen().is_as(Seen { kind, device: &device.device }))
    }

    /// Ranks the kind of signal: lower is closer to the heart.
    pub(super) fn rank(&self) -> u8 {
        match (self.signal, self.kind) {
            (Signal::Ecg, _) => 0,
            (Signal::Interval, Kind::Beats) => 1,
            (Signal::Ppg, _) => 2,
            _ => 3,
        }
    }
}
