use std::sync::Arc;

use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason, Wave};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::text::label;

use super::{DecodeError, Decoded};
use crate::standard::std_msgs::Header;
use crate::standard::{Message, teampulse_msgs as msgs};

/// The largest message of ours that is decoded [bytes], as the decoded form is a few times as large. A wave of two
/// million numbers fits.
const LARGEST_BYTES: usize = 16 << 20;

/// The most characters of an unknown word that are shown.
const LONGEST_WORD: usize = 60;

/// Decodes a message of one of our six types into a sample, with [cut and cleaned](teampulse_core::text)
/// texts.
pub fn decode(type_name: &str, cdr: &[u8]) -> Result<Decoded, DecodeError> {
    if cdr.len() > LARGEST_BYTES {
        return Err(DecodeError::Large(cdr.len()));
    }
    match type_name {
        msgs::Sample::NAME => Ok(reading(msgs::Sample::decode(cdr)?)),
        msgs::Wave::NAME => wave(msgs::Wave::decode(cdr)?),
        msgs::Feature::NAME => feature(msgs::Feature::decode(cdr)?),
        msgs::Event::NAME => event(msgs::Event::decode(cdr)?),
        msgs::StreamStatus::NAME => status(msgs::StreamStatus::decode(cdr)?),
        msgs::StreamDescription::NAME => description(&msgs::StreamDescription::decode(cdr)?),
        other => Err(DecodeError::Type(other.to_owned())),
    }
}

fn reading(sample: msgs::Sample) -> Decoded {
    let mut decoded = plain(&sample.header, Data::Sample(sample.values.into()));
    decoded.device_time = device_time(sample.device_time);
    decoded.index = Some(sample.index);
    decoded
}

fn wave(wave: msgs::Wave) -> Result<Decoded, DecodeError> {
    if !(wave.period_ns.is_finite() && wave.period_ns >= 0.0) {
        return Err(DecodeError::Period(wave.period_ns));
    }
    if wave.channels == 0 || !wave.samples.len().is_multiple_of(wave.channels as usize) {
        let expected = format!("a multiple of {} channels", wave.channels);
        return Err(DecodeError::Length { field: "samples", length: wave.samples.len(), expected });
    }
    let data = Data::Wave(Wave {
        period_ns: wave.period_ns,
        channels: wave.channels,
        samples: wave.samples.into(),
    });
    let mut decoded = plain(&wave.header, data);
    decoded.device_time = device_time(wave.device_time);
    decoded.index = Some(wave.index);
    Ok(decoded)
}

fn feature(feature: msgs::Feature) -> Result<Decoded, DecodeError> {
    let count = feature.values.len();
    expect_length("reasons", feature.reasons.len(), count)?;
    if !feature.sigmas.is_empty() {
        expect_length("sigmas", feature.sigmas.len(), count)?;
    }
    let reasons = feature.reasons.iter().map(|code| {
        Reason::from_code(*code).ok_or(DecodeError::Code { field: "reason", code: *code })
    });
    let data = Data::Feature(Arc::new(FeatureValues {
        window_secs: feature.window_secs,
        coverage: feature.coverage,
        quality: feature.quality,
        reasons: reasons.collect::<Result<_, _>>()?,
        values: feature.values,
        sigmas: feature.sigmas,
    }));
    Ok(plain(&feature.header, data))
}

fn event(event: msgs::Event) -> Result<Decoded, DecodeError> {
    let kind = EventKind::from_word(&event.kind);
    let data = Data::Event(Arc::new(Event {
        kind: kind.ok_or_else(|| unknown_word("kind", &event.kind, EventKind::ALL))?,
        label: event.label,
        value: event.value,
        duration_secs: event.duration_secs,
    }));
    let mut decoded = plain(&event.header, data.cleaned());
    decoded.device_time = device_time(event.device_time);
    Ok(decoded)
}

fn status(status: msgs::StreamStatus) -> Result<Decoded, DecodeError> {
    let state = State::from_code(status.state);
    let data = Data::Status(Arc::new(StreamStatus {
        name: status.name,
        state: state.ok_or(DecodeError::Code { field: "state", code: status.state })?,
        reason: status.reason,
        rate_hz: status.rate_hz,
        age_secs: status.age_secs,
        received: status.received,
        lost_source: u64::try_from(status.lost_source).ok(),
        lost_queue: status.lost_queue,
        late: status.late,
        duplicates: status.duplicates,
        clock: status.clock,
        epoch: status.epoch,
        offset_secs: status.offset_secs,
        skew_ppm: status.skew_ppm,
        jitter_secs: status.jitter_secs,
        sigma_secs: status.sigma_secs,
        latency_secs: status.latency_secs,
    }));
    Ok(plain(&status.header, data.cleaned()))
}

fn description(description: &msgs::StreamDescription) -> Result<Decoded, DecodeError> {
    let data = Data::Description(Arc::new(description.stream()?));
    Ok(plain(&description.header, data))
}

fn plain(header: &Header, data: Data) -> Decoded {
    Decoded { stamp: header.stamp, device_time: None, index: None, data }
}

fn device_time(nanos: i64) -> Option<i64> {
    (nanos != msgs::NO_DEVICE_TIME).then_some(nanos)
}

pub(super) fn expect_length(
    field: &'static str,
    length: usize,
    expected: usize,
) -> Result<(), DecodeError> {
    let expected = if length == expected { return Ok(()) } else { expected.to_string() };
    Err(DecodeError::Length { field, length, expected })
}

pub(super) fn unknown_word<T: ToString>(field: &'static str, word: &str, all: &[T]) -> DecodeError {
    let expected = all.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    DecodeError::Word { field, word: label(word.to_owned(), LONGEST_WORD), expected }
}
