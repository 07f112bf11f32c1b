//! Laws of every feature, for any input.

use std::collections::BTreeSet;

use proptest::prelude::*;
use teampulse_core::data::{Data, FeatureValues, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, StandaloneExtractor};
use teampulse_core::registry::Settings;
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::stream::{About, Shape, Signal, Stream, StreamId, Subject};
use teampulse_core::time::Time;
use teampulse_core::units;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;
use toml::Spanned;
use toml::de::DeValue;

const TICK_NS: i64 = 100_000_000;
const CHANNELS: usize = 6;

/// One step of a session.
#[derive(Clone, Debug)]
enum Step {
    Push(Sample),
    PushLate(Sample),
    Ticks(u8),
}

fn features() -> impl Iterator<Item = (&'static str, Box<dyn Feature>)> {
    FEATURES.iter().map(|entry| {
        let empty = Spanned::new(0..0, DeValue::Table(toml::de::DeTable::default()));
        let built = (entry.build)(Settings::new(empty), &FeatureContext::default());
        (entry.kind, built.expect("a feature without settings"))
    })
}

/// A stream of each signal that reads as many numbers as the samples have.
fn streams() -> Vec<Stream> {
    let battery = [
        ("voltage", "V"),
        ("current", "A"),
        ("percentage", "1"),
        ("charge", "Ah"),
        ("capacity", "Ah"),
        ("power_supply_status", "1"),
    ];
    let link = [("level", "dBm"), ("q", "1"), ("a", "1"), ("b", "1"), ("c", "1"), ("d", "1")];
    let other = [("x", "m"), ("y", "m"), ("v", "m/s"), ("w", "rad/s"), ("q", "%"), ("e", "J")];
    let channels = |signal| match signal {
        Signal::Battery => battery,
        Signal::Link => link,
        _ => other,
    };
    let stream = |signal: &Signal| {
        let stream = Stream::raw(format!("/r1/{signal}"), Subject::robot("r1"), Shape::Sample);
        Stream { signal: *signal, ..stream.with_channels(&channels(*signal)) }
    };
    Signal::ALL.iter().map(stream).collect()
}

/// A stream of each signal of a person, in units as spelt by devices.
fn worn() -> Vec<Stream> {
    let of_person = |signal: &Signal| {
        let person = Subject { about: About::Person, id: "p1".into() };
        let channels: &[(&str, &str)] = match signal {
            Signal::Ecg => &[("ecg", "mV")],
            Signal::Eda => &[("eda", "uS")],
            Signal::Emg => &[("flexor", "uV"), ("extensor", "uV")],
            Signal::Eeg => &[("F3", "uV"), ("F4", "uV"), ("Pz", "uV")],
            Signal::Temperature => &[("skin", "degC")],
            Signal::Acceleration => &[("x", "m/s^2"), ("y", "m/s^2"), ("z", "m/s^2")],
            Signal::Interval => &[("rr", "ms")],
            Signal::Input => &[("reaction_time", "s")],
            _ => &[("value", "1")],
        };
        let shape = match signal {
            Signal::Input | Signal::Event => Shape::Event,
            Signal::Interval => Shape::Sample,
            _ => Shape::Wave,
        };
        let stream = Stream::raw(format!("/humans/persons/p1/worn/{signal}"), person, shape);
        Stream { signal: *signal, rate_hz: 128.0, ..stream.with_channels(channels) }
    };
    Signal::ALL.iter().map(of_person).collect()
}

#[test]
fn every_declared_unit_is_in_the_table_of_units() {
    let mut unknown = BTreeSet::new();
    let mut known = BTreeSet::new();
    for (kind, feature) in features() {
        for stream in streams().into_iter().chain(worn()).filter(|each| feature.accepts(each)) {
            let out = run(feature.as_ref(), &stream, &[]);
            for unit in out
                .streams()
                .iter()
                .flat_map(|output| &output.channels)
                .map(|channel| &channel.unit)
            {
                known.insert(unit.clone());
                if !units::is_known(unit) {
                    unknown.insert((kind, unit.clone()));
                }
            }
        }
    }
    assert!(unknown.is_empty(), "{unknown:?}");
    assert!(known.len() > 20, "{known:?}");
}

/// Numbers as devices report them, and others.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        prop::num::f64::ANY,
        (-2i32..=105).prop_map(f64::from),
        -100.0..100.0,
        0.0..1.0,
        Just(f64::NAN),
    ]
}

fn sample() -> impl Strategy<Value = Sample> {
    let measured = prop_oneof![
        20 => 0i64..100_000_000_000,
        1 => any::<i64>(),
    ];
    (measured, prop::collection::vec(number(), CHANNELS)).prop_map(|(measured_ns, numbers)| {
        Sample {
            stream: StreamId(0),
            measured: Time::from_nanos(measured_ns),
            log_time: Time::EPOCH,
            device_time: None,
            source_time: None,
            period_ns: 0.0,
            index: 0,
            turn: Turn::OnTime,
            data: Data::Sample(numbers.into()),
        }
    })
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        5 => sample().prop_map(Step::Push),
        1 => sample().prop_map(Step::PushLate),
        5 => (1u8..30).prop_map(Step::Ticks),
    ];
    prop::collection::vec(step, 0..80)
}

/// Runs a session; every sample is taken at the time of the last tick.
fn run(feature: &dyn Feature, stream: &Stream, steps: &[Step]) -> Outputs {
    let mut out = Outputs::new();
    let mut extractor = StandaloneExtractor::new(feature.start(stream));
    extractor.join(StreamId(0), stream, &mut out);
    let mut now_ns = 0;
    for step in steps {
        take(&mut extractor, step, &mut now_ns, &mut out);
    }
    out
}

fn take(extractor: &mut dyn Extractor, step: &Step, now_ns: &mut i64, out: &mut Outputs) {
    let now = |sample: &Sample, now_ns: i64| Sample {
        log_time: Time::from_nanos(now_ns),
        ..sample.clone()
    };
    match step {
        Step::Push(sample) => extractor.push(&now(sample, *now_ns), out),
        Step::PushLate(sample) => extractor.push_late(&now(sample, *now_ns), out),
        Step::Ticks(count) => (0..*count).for_each(|_| {
            *now_ns += TICK_NS;
            extractor.tick(Time::from_nanos(*now_ns), out);
        }),
    }
}

fn emitted(out: &Outputs) -> Vec<(OutputId, Time, Data)> {
    out.samples().map(|(id, measured, data)| (id, measured, data.clone())).collect()
}

fn channels_of(out: &mut Outputs, id: OutputId) -> usize {
    let streams = out.streams().to_vec();
    let stream = streams.into_iter().find(|stream| out.declare(stream.clone()) == id);
    stream.expect("an output is declared before it is used").channels.len()
}

fn assert_sound(kind: &str, values: &FeatureValues, channels: usize) {
    assert_eq!(values.values.len(), channels, "{kind}");
    assert_eq!(values.reasons.len(), channels, "{kind}");
    assert!(values.sigmas.is_empty() || values.sigmas.len() == channels, "{kind}");
    assert!((0.0..=1.0).contains(&values.coverage), "{kind}: {values:?}");
    assert!((0.0..=1.0).contains(&values.quality), "{kind}: {values:?}");
    for (value, reason) in values.values.iter().zip(&values.reasons) {
        assert_eq!(value.is_nan(), *reason != Reason::Ok, "{kind}: {values:?}");
        assert!(!value.is_infinite(), "{kind}: {values:?}");
    }
    for sigma in &values.sigmas {
        assert!(sigma.is_nan() || *sigma >= 0.0 && sigma.is_finite(), "{kind}: {values:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_comes_a_window_is_sound(steps in steps()) {
        for (kind, feature) in features() {
            for stream in streams().iter().filter(|stream| feature.accepts(stream)) {
                let mut out = run(feature.as_ref(), stream, &steps);
                for (id, _, data) in emitted(&out) {
                    if let Data::Feature(values) = data {
                        assert_sound(kind, &values, channels_of(&mut out, id));
                    }
                }
            }
        }
    }

    #[test]
    fn the_same_input_gives_the_same_output(steps in steps()) {
        for (_, feature) in features() {
            for stream in streams().iter().filter(|stream| feature.accepts(stream)) {
                let once = emitted(&run(feature.as_ref(), stream, &steps));
                let twice = emitted(&run(feature.as_ref(), stream, &steps));
                prop_assert_eq!(format!("{once:?}"), format!("{twice:?}"));
            }
        }
    }

    #[test]
    fn the_future_does_not_change_the_past(steps in steps(), cut in 0usize..80) {
        let cut = cut.min(steps.len());
        for (_, feature) in features() {
            for stream in streams().iter().filter(|stream| feature.accepts(stream)) {
                let whole = emitted(&run(feature.as_ref(), stream, &steps));
                let begun = emitted(&run(feature.as_ref(), stream, &steps[..cut]));
                let same = format!("{:?}", &whole[..begun.len()]);
                prop_assert_eq!(same, format!("{begun:?}"));
            }
        }
    }
}

#[test]
fn every_output_names_its_input_and_its_method() {
    for (kind, feature) in features() {
        for stream in streams().iter().filter(|stream| feature.accepts(stream)) {
            let out = run(feature.as_ref(), stream, &[]);
            for output in out.streams() {
                assert_eq!(output.inputs, std::slice::from_ref(&stream.name), "{kind}");
                assert!(!output.method.is_empty() && !output.doc.is_empty(), "{kind}");
                assert!(!feature.accepts(output), "{kind} feeds on itself");
            }
        }
    }
}
