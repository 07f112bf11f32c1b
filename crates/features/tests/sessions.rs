//! Laws for every feature that reads several streams of a session, whatever they contain.

#![expect(clippy::unwrap_used, reason = "a test")]

use std::sync::Arc;

use proptest::prelude::*;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs, Scope, StandaloneExtractor};
use teampulse_core::registry::Settings;
use teampulse_core::sample::{Sample, Turn};
use teampulse_core::session_streams::session_events;
use teampulse_core::stream::{About, Origin, Shape, Signal, Stream, StreamId, Subject, Window};
use teampulse_core::time::Time;
use teampulse_features::FEATURES;
use teampulse_features::context::FeatureContext;

const TICK_NS: i64 = 100_000_000;
const WINDOW_SECS: f64 = 30.0;

/// One step of a session.
#[derive(Clone, Debug)]
enum Step {
    /// A reading of the stream with this index, with these numbers.
    Tells(usize, [f64; 6]),
    Ticks(u16),
}

fn features() -> impl Iterator<Item = (&'static str, Box<dyn Feature>)> {
    let built = FEATURES.iter().map(|entry| {
        let feature = (entry.build)(Settings::empty(), &FeatureContext::default());
        (entry.kind, feature.unwrap())
    });
    built.filter(|(_, feature)| feature.scope() != Scope::Stream)
}

fn person() -> Subject {
    Subject { about: About::Person, id: "p1".into() }
}

fn of_person(name: &str, shape: Shape, channels: &[&str]) -> Stream {
    let united: Vec<_> = channels.iter().map(|channel| (*channel, "1")).collect();
    Stream::raw(format!("/humans/persons/p1/{name}"), person(), shape).with_channels(&united)
}

/// The streams of a session with one person and a robot.
fn streams() -> Vec<Stream> {
    let windows = |name: &str, family: &str, window: Window, channels: &[&str]| {
        let stream = of_person(name, Shape::Feature, channels);
        Stream { origin: Origin::Derived, family: family.into(), ..stream }.over(window)
    };
    let w30 = Window::of_secs(30.0);
    let z = ["heart_rate_z", "heart_rate_robust_z", "skin_level_z", "skin_level_robust_z"];
    let input = of_person("task/presses", Shape::Event, &[]);
    vec![
        session_events(),
        of_person("task/events", Shape::Event, &[]),
        Stream { signal: Signal::Input, ..input }.with_channels(&[("reaction_time", "s")]),
        windows("strap/ecg/heart", "heart", w30, &["HRV_MeanHR", "HRV_RMSSD"]),
        windows("glove/eda/skin", "skin", w30, &["EDA_Tonic_Mean", "SCR_Peaks_Rate"]),
        windows("strap/ecg/heart", "heart", Window::Phases, &["HRV_MeanHR", "HRV_RMSSD"]),
        windows("state", "state", w30, &z),
        windows("state", "state", Window::Phases, &z),
        Stream::raw("/r1/load", Subject::robot("r1"), Shape::Sample).with_channels(&[("x", "1")]),
    ]
}

fn reported(stream: &Stream, numbers: [f64; 6]) -> Data {
    match stream.shape {
        Shape::Event => event(numbers),
        Shape::Feature => {
            let values = numbers[..stream.channels.len()].to_vec();
            let reason = |value: &f64| if value.is_nan() { Reason::Gap } else { Reason::Ok };
            Data::Feature(Arc::new(FeatureValues {
                window_secs: WINDOW_SECS,
                coverage: 1.0,
                quality: numbers[5].abs().min(1.0) as f32,
                sigmas: Vec::new(),
                reasons: values.iter().map(reason).collect(),
                values,
            }))
        }
        _ => Data::Sample(numbers[..stream.channels.len()].into()),
    }
}

fn event(numbers: [f64; 6]) -> Data {
    let kinds = [
        (EventKind::Phase, "baseline"),
        (EventKind::Phase, "task"),
        (EventKind::Report, "isa"),
        (EventKind::Report, "isa p1"),
        (EventKind::Marker, "press"),
    ];
    let (kind, label) = kinds[numbers[0].abs() as usize % kinds.len()];
    let (label, value, duration_secs) = (label.to_owned(), numbers[1], numbers[2]);
    Data::Event(Arc::new(Event { kind, label, value, duration_secs }))
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![prop::num::f64::ANY, 0.0..6.0, 60.0..80.0, Just(f64::NAN)]
}

/// A baseline with readings on every stream, and then arbitrary steps.
fn steps() -> impl Strategy<Value = Vec<Step>> {
    let count = streams().len();
    let gives = (0..count, prop::array::uniform6(number()));
    let gives = gives.prop_map(|(place, numbers)| Step::Tells(place, numbers));
    let step = prop_oneof![3 => gives, 1 => (1_u16..200).prop_map(Step::Ticks)];
    prop::collection::vec(step, 0..60).prop_map(|anything| {
        let mut steps = vec![Step::Tells(0, [0.0, f64::NAN, 90.0, 0.0, 0.0, 0.0])];
        for secs in 0..95 {
            let value = 60.0 + f64::from(secs * 7 % 11);
            steps.push(Step::Ticks(10));
            steps.extend((2..streams().len()).map(|place| Step::Tells(place, [value; 6])));
        }
        steps.extend(anything);
        steps
    })
}

/// Runs a session; every sample is measured and taken at the time of the last tick.
fn run(feature: &dyn Feature, steps: &[Step]) -> Option<Outputs> {
    let streams = streams();
    let heard = |place: &usize| feature.accepts(&streams[*place]);
    let first = (0..streams.len()).find(heard)?;
    let (mut extractor, mut out) =
        (StandaloneExtractor::new(feature.start(&streams[first])), Outputs::new());
    for place in (0..streams.len()).filter(heard) {
        extractor.join(StreamId(place as u32), &streams[place], &mut out);
    }
    let mut now = Time::EPOCH;
    for step in steps {
        match step {
            Step::Tells(place, numbers) if heard(place) => {
                extractor
                    .push(&sample(*place, now, reported(&streams[*place], *numbers)), &mut out);
            }
            Step::Tells(..) => {}
            Step::Ticks(count) => (0..*count).for_each(|_| {
                now = Time::from_nanos(now.nanos() + TICK_NS);
                extractor.tick(now, &mut out);
            }),
        }
    }
    Some(out)
}

fn sample(place: usize, at: Time, data: Data) -> Sample {
    Sample {
        stream: StreamId(place as u32),
        measured: at,
        log_time: at,
        device_time: None,
        source_time: None,
        period_ns: 0.0,
        index: 0,
        turn: Turn::OnTime,
        data,
    }
}

fn emitted(out: &Outputs) -> Vec<(OutputId, Time, Data)> {
    out.samples().map(|(id, measured, data)| (id, measured, data.clone())).collect()
}

fn assert_sound(kind: &str, values: &FeatureValues) {
    assert!((0.0..=1.0).contains(&values.coverage), "{kind}: {values:?}");
    assert!((0.0..=1.0).contains(&values.quality), "{kind}: {values:?}");
    for (value, reason) in values.values.iter().zip(&values.reasons) {
        assert_eq!(value.is_finite(), *reason == Reason::Ok, "{kind}: {values:?}");
    }
    for sigma in &values.sigmas {
        assert!(sigma.is_nan() || *sigma >= 0.0 && sigma.is_finite(), "{kind}: {values:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn whatever_is_reported_a_window_is_sound(steps in steps()) {
        for (kind, feature) in features() {
            for (_, _, data) in run(feature.as_ref(), &steps).iter().flat_map(emitted) {
                if let Data::Feature(values) = data {
                    assert_sound(kind, &values);
                }
            }
        }
    }

    #[test]
    fn the_future_does_not_change_the_past(steps in steps(), cut in 0_usize..900) {
        let cut = cut.min(steps.len());
        for (kind, feature) in features() {
            let Some(whole) = run(feature.as_ref(), &steps) else { continue };
            let (whole, begun) = (emitted(&whole), run(feature.as_ref(), &steps[..cut]).unwrap());
            let begun = emitted(&begun);
            let same = format!("{:?}", &whole[..begun.len()]);
            prop_assert_eq!(same, format!("{begun:?}"), "{}", kind);
        }
    }

    #[test]
    fn every_output_is_derived_from_named_inputs_and_says_how(steps in steps()) {
        let names: Vec<String> = streams().into_iter().map(|stream| stream.name).collect();
        let mut kinds = Vec::new();
        for (kind, feature) in features() {
            let Some(out) = run(feature.as_ref(), &steps) else { continue };
            for output in out.streams() {
                kinds.push(kind);
                prop_assert!(!output.inputs.is_empty(), "{}", output.name);
                prop_assert!(output.inputs.iter().all(|input| names.contains(input)), "{output:?}");
                prop_assert!(!output.method.is_empty() && !output.doc.is_empty(), "{}", output.name);
                prop_assert!(output.origin == Origin::Derived);
                prop_assert!(!feature.accepts(output), "{kind} feeds on itself");
            }
        }
        for kind in ["input", "state", "estimates"] {
            prop_assert!(kinds.contains(&kind), "{kind} is in no event");
        }
    }
}
