use bytes::Bytes;
use teampulse_core::data::{Data, Event, FeatureValues, Wave};
use teampulse_core::sample::Sample;
use teampulse_core::status::StreamStatus;

use crate::standard::std_msgs::Header;
use crate::standard::{Message, teampulse_msgs as msgs};

/// Encodes the sample as a ROS message: CDR with its four-byte header. A sample that was received as a
/// message is unchanged.
pub fn encode(sample: &Sample) -> Bytes {
    match &sample.data {
        Data::Sample(values) => reading(sample, values).encode(),
        Data::Wave(run) => wave(sample, run).encode(),
        Data::Feature(values) => feature(sample, values).encode(),
        Data::Event(what) => event(sample, what).encode(),
        Data::Status(health) => status(sample, health).encode(),
        Data::Description(stream) => {
            msgs::StreamDescription::of(stream, Header::at(sample.log_time)).encode()
        }
        Data::Message(cdr) => cdr.clone(),
    }
}

fn reading(sample: &Sample, values: &[f64]) -> msgs::Sample {
    msgs::Sample {
        header: Header::at(sample.measured),
        device_time: device_time(sample),
        index: sample.index,
        values: values.to_vec(),
    }
}

fn wave(sample: &Sample, wave: &Wave) -> msgs::Wave {
    msgs::Wave {
        header: Header::at(sample.measured),
        device_time: device_time(sample),
        index: sample.index,
        period_ns: wave.period_ns,
        channels: wave.channels,
        samples: wave.samples.to_vec(),
    }
}

fn feature(sample: &Sample, feature: &FeatureValues) -> msgs::Feature {
    msgs::Feature {
        header: Header::at(sample.measured),
        window_secs: feature.window_secs,
        coverage: feature.coverage,
        quality: feature.quality,
        values: feature.values.clone(),
        sigmas: feature.sigmas.clone(),
        reasons: feature.reasons.iter().map(|reason| *reason as u8).collect(),
    }
}

fn event(sample: &Sample, event: &Event) -> msgs::Event {
    msgs::Event {
        header: Header::at(sample.measured),
        device_time: device_time(sample),
        kind: event.kind.word().to_owned(),
        label: event.label.clone(),
        value: event.value,
        duration_secs: event.duration_secs,
    }
}

fn status(sample: &Sample, status: &StreamStatus) -> msgs::StreamStatus {
    let lost_source = status
        .lost_source
        .map_or(msgs::StreamStatus::LOST_UNKNOWN, |lost| i64::try_from(lost).unwrap_or(i64::MAX));
    msgs::StreamStatus {
        header: Header::at(sample.measured),
        name: status.name.clone(),
        state: status.state as u8,
        reason: status.reason.clone(),
        rate_hz: status.rate_hz,
        age_secs: status.age_secs,
        received: status.received,
        lost_source,
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
    }
}

fn device_time(sample: &Sample) -> i64 {
    sample.device_time.unwrap_or(msgs::NO_DEVICE_TIME)
}
