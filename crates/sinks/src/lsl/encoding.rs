//! Encodes samples of the session as LSL bytes.

use bytes::Bytes;
use teampulse_core::data::{Data, EventKind};
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::{Shape, Stream};
use teampulse_devices::lsl::{self, Format, SampleWriter, Values};
use teampulse_messages::readout::Readout;

/// Encodes the samples of a stream.
#[derive(Debug)]
pub(super) struct Encoder {
    writer: SampleWriter,
    channels: usize,
    /// Reads the numbers; `None` for events.
    readout: Option<Readout>,
}

impl Encoder {
    /// An encoder for a stream; `None` if the numbers of its messages can't be read.
    pub fn new(stream: &Stream, numbers: Format) -> Option<Encoder> {
        let is_event = stream.shape == Shape::Event;
        let (format, channels) =
            if is_event { (Format::String, 1) } else { (numbers, stream.channels.len()) };
        let readout = Readout::of(stream);
        if readout.is_none() && !is_event {
            return None;
        }
        Some(Encoder { writer: SampleWriter::of(format, channels), channels, readout })
    }

    /// Encodes a sample; `None` if it is not offered to others. The session's clock is `ahead_nanos` ahead of the
    /// monotonic clock.
    pub fn encode(&mut self, sample: &Sample, ahead_nanos: i64) -> Option<Bytes> {
        if sample.turn == Turn::Duplicate {
            return None;
        }
        let measured = sample.measured.nanos().saturating_sub(ahead_nanos);
        let mut out = Vec::new();
        if let Data::Event(event) = &sample.data {
            let text = match event.kind {
                EventKind::Fault | EventKind::Clock | EventKind::Command => return None,
                EventKind::Marker => event.label.clone(),
                kind => format!("{kind}: {}", event.label),
            };
            let values = Values::Texts(vec![text]);
            self.writer.write(&lsl::Sample { stamp_secs: secs(measured), values }, &mut out);
            return Some(out.into());
        }
        let numbers = self.readout.as_mut()?.read(&sample.data)?;
        for (values, place) in numbers.chunks_exact(self.channels).zip(0_u32..) {
            let later_nanos = (f64::from(place) * sample.period_ns).round() as i64;
            let stamp_secs = secs(measured.saturating_add(later_nanos));
            let values = Values::Numbers(values.to_vec());
            self.writer.write(&lsl::Sample { stamp_secs, values }, &mut out);
        }
        Some(out.into())
    }
}

/// Converts to seconds, exact to the nanosecond while the computer has been on for less than a month.
fn secs(nanos: i64) -> f64 {
    nanos as f64 * 1e-9
}
