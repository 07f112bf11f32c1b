//! Encoded values decode unchanged, and no bytes make a decoder panic.

use std::sync::Arc;

use bytes::Bytes;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason, Wave};
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::status::{State, StreamStatus};
use teampulse_core::stream::{About, Channel, Origin, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_messages::convert::{decode, encode, schema_of};
use teampulse_messages::standard::teampulse_msgs as msgs;
use teampulse_messages::standard::{Message, std_msgs};

const OURS: [&str; 6] = [
    msgs::Sample::NAME,
    msgs::Wave::NAME,
    msgs::Feature::NAME,
    msgs::Event::NAME,
    msgs::StreamDescription::NAME,
    msgs::StreamStatus::NAME,
];

/// Any time that fits a ROS stamp.
fn moments() -> impl Strategy<Value = Time> {
    (any::<i32>(), 0..1_000_000_000_u32).prop_map(|(secs, nanos)| Time::from_stamp(secs, nanos))
}

fn device_times() -> impl Strategy<Value = Option<i64>> {
    proptest::option::of(i64::MIN + 1..)
}

fn waves() -> impl Strategy<Value = Wave> {
    (1..9_u32, 0..50_usize, 0.0..1e12).prop_flat_map(|(channels, count, period_ns)| {
        vec(any::<f64>(), count * channels as usize).prop_map(move |samples| Wave {
            period_ns,
            channels,
            samples: samples.into(),
        })
    })
}

fn features() -> impl Strategy<Value = FeatureValues> {
    let reason = prop::sample::select(Reason::ALL.to_vec());
    let rows = vec((any::<f64>(), any::<f64>(), reason), 0..20);
    (any::<f64>(), any::<f32>(), any::<f32>(), any::<bool>(), rows).prop_map(
        |(window_secs, coverage, quality, with_sigmas, rows)| FeatureValues {
            window_secs,
            coverage,
            quality,
            values: rows.iter().map(|row| row.0).collect(),
            sigmas: rows.iter().map(|row| row.1).filter(|_| with_sigmas).collect(),
            reasons: rows.iter().map(|row| row.2).collect(),
        },
    )
}

fn events() -> impl Strategy<Value = Event> {
    (select(EventKind::ALL), ".*", any::<f64>(), any::<f64>())
        .prop_map(|(kind, label, value, duration_secs)| Event { kind, label, value, duration_secs })
}

fn statuses() -> impl Strategy<Value = StreamStatus> {
    let state = (0..5_u8).prop_map(|code| State::from_code(code).expect("a code"));
    let lost_source = proptest::option::of(0..=i64::MAX as u64);
    let counts = any::<[u64; 4]>();
    (".*", state, ".*", lost_source, counts, any::<[f64; 7]>(), any::<(u8, u32)>()).prop_map(
        |(name, state, reason, lost_source, counts, numbers, (clock, epoch))| StreamStatus {
            name,
            state,
            reason,
            rate_hz: numbers[0],
            age_secs: numbers[1],
            received: counts[0],
            lost_source,
            lost_queue: counts[1],
            late: counts[2],
            duplicates: counts[3],
            clock,
            epoch,
            offset_secs: numbers[2],
            skew_ppm: numbers[3],
            jitter_secs: numbers[4],
            sigma_secs: numbers[5],
            latency_secs: numbers[6],
        },
    )
}

fn shapes() -> impl Strategy<Value = Shape> {
    let ours = select(vec![
        Shape::Sample,
        Shape::Wave,
        Shape::Feature,
        Shape::Event,
        Shape::Status,
        Shape::Description,
    ]);
    let unknown = "[a-z]{1,9}_msgs/msg/[A-Z][a-z]{0,9}".prop_map(|name| {
        let (encoding, text, hash) = ("ros2msg".into(), String::new(), String::new());
        let schema = teampulse_core::stream::Schema { name, encoding, text, hash };
        Shape::Message(Arc::new(schema))
    });
    prop_oneof![ours, unknown]
}

fn streams() -> impl Strategy<Value = Stream> {
    let about = select(vec![About::Person, About::Robot, About::Team, About::Session]);
    let origin = select(vec![Origin::Raw, Origin::Derived]);
    let words = (".*", ".*", ".*", ".*", ".*", vec(".*", 0..4));
    let channels = vec((".*", ".*"), 0..5);
    let signal = select(Signal::ALL);
    (words, about, origin, signal, shapes(), channels, any::<(f64, f64)>()).prop_map(
        |(
            (name, id, device, method, doc, inputs),
            about,
            origin,
            signal,
            shape,
            channels,
            numbers,
        )| {
            let mut stream = Stream::raw(name, Subject { about, id }, shape);
            stream.signal = signal;
            stream.origin = origin;
            stream.device = device;
            stream.method = method;
            stream.doc = doc;
            stream.inputs = inputs;
            let scale = if numbers.0 == 0.0 { 1.0 } else { numbers.0 };
            let channel = |(place, (name, unit))| Channel {
                name,
                unit,
                scale: if place == 1 { scale } else { 1.0 },
            };
            stream.channels = channels.into_iter().enumerate().map(channel).collect();
            stream.rate_hz = numbers.1;
            stream
        },
    )
}

fn any_data() -> impl Strategy<Value = (Shape, Data)> {
    prop_oneof![
        vec(any::<f64>(), 0..40).prop_map(|values| (Shape::Sample, Data::Sample(values.into()))),
        waves().prop_map(|wave| (Shape::Wave, Data::Wave(wave))),
        features().prop_map(|values| (Shape::Feature, Data::Feature(Arc::new(values)))),
        events().prop_map(|event| (Shape::Event, Data::Event(Arc::new(event)))),
        statuses().prop_map(|status| (Shape::Status, Data::Status(Arc::new(status)))),
        streams().prop_map(|stream| (Shape::Description, Data::Description(Arc::new(stream)))),
    ]
}

fn sample(measured: Time, log_time: Time, device_time: Option<i64>, data: Data) -> Sample {
    let (stream, source_time, turn) = (StreamId(0), None, Turn::OnTime);
    Sample {
        stream,
        measured,
        log_time,
        device_time,
        source_time,
        period_ns: 0.0,
        index: 7,
        turn,
        data,
    }
}

/// The data with its texts as received: short and clean.
fn cleaned(data: Data) -> Data {
    match data {
        Data::Description(stream) => Data::Description(Arc::new(Stream::clone(&stream).cleaned())),
        other => other.cleaned(),
    }
}

proptest! {
    #[test]
    fn what_is_encoded_comes_back_as_it_was(
        (shape, data) in any_data(),
        measured in moments(),
        log_time in moments(),
        device_time in device_times(),
    ) {
        let sent = sample(measured, log_time, device_time, data);
        let decoded = decode(&schema_of(&shape).name, &encode(&sent)).unwrap();
        let is_description = matches!(sent.data, Data::Description(_));
        prop_assert_eq!(decoded.stamp, if is_description { log_time } else { measured });
        if matches!(sent.data, Data::Sample(_) | Data::Wave(_)) {
            prop_assert_eq!(decoded.index, Some(7));
        }
        if matches!(sent.data, Data::Sample(_) | Data::Wave(_) | Data::Event(_)) {
            prop_assert_eq!(decoded.device_time, device_time);
        }
        // As text, for NaN is not equal to itself.
        prop_assert_eq!(format!("{:?}", decoded.data), format!("{:?}", cleaned(sent.data)));
    }

    #[test]
    fn any_bytes_are_a_message_or_an_error(bytes in vec(any::<u8>(), 0..400), big in any::<bool>()) {
        for header in [&[][..], &[0, u8::from(!big), 0, 0]] {
            let cdr = [header, &bytes].concat();
            for name in OURS {
                drop(decode(name, &cdr));
            }
        }
    }

    #[test]
    fn a_message_cut_short_is_an_error((shape, data) in any_data(), cut in 1..64_usize) {
        let cdr = encode(&sample(Time::EPOCH, Time::EPOCH, None, data));
        let cut = cdr.len().saturating_sub(cut);
        prop_assert!(decode(&schema_of(&shape).name, &cdr[..cut]).is_err());
    }
}

#[test]
fn a_message_from_elsewhere_stays_as_it_is() {
    let cdr = Bytes::from_static(b"\0\0\0\0anything");
    let sent = sample(Time::EPOCH, Time::EPOCH, None, Data::Message(cdr.clone()));
    assert_eq!(encode(&sent), cdr);
}

#[test]
fn a_wave_that_is_no_whole_number_of_samples_is_refused() {
    let header = std_msgs::Header::at(Time::EPOCH);
    for (channels, count) in [(0, 0), (0, 3), (2, 3)] {
        let samples = vec![0.0; count];
        let wave = msgs::Wave { header: header.clone(), channels, samples, ..Default::default() };
        assert!(decode(msgs::Wave::NAME, &wave.encode()).is_err());
    }
}

#[test]
fn an_absurd_count_is_an_error_and_not_an_allocation() {
    let mut cdr = msgs::Sample::default().encode().to_vec();
    let count = cdr.len() - 4;
    cdr[count..].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = decode(msgs::Sample::NAME, &cdr).unwrap_err().to_string();
    assert_eq!(error, "read 34359738360 bytes at byte 36 of a message: 0 are left");
}
