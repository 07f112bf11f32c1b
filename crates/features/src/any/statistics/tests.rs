use std::sync::Arc;

use proptest::prelude::*;
use teampulse_core::data::{Data, Event, EventKind, FeatureValues, Reason, Wave};
use teampulse_core::sample::Turn;
use teampulse_core::session_streams::{END, session_events};
use teampulse_core::stream::{Signal, Subject};
use teampulse_messages::standard::Message;
use teampulse_messages::standard::sensor_msgs::BatteryState;
use teampulse_signal::descriptive::describe;

use super::*;
use crate::drive::{alone, messages};

const INPUT: StreamId = StreamId(0);
const EVENTS: StreamId = StreamId(1);
const RATE_HZ: f64 = 10.0;
const NAME: &str = "/humans/persons/p1/device/signal";

/// A stream of a person in a session with phases.
struct Scene {
    extractor: Box<dyn Extractor>,
    out: Outputs,
}

fn input(channels: &[(&str, &str)]) -> Stream {
    let subject = Subject { about: About::Person, id: "p1".into() };
    let stream = Stream::raw(NAME, subject, Shape::Wave).with_channels(channels);
    Stream { rate_hz: RATE_HZ, ..stream }
}

fn feature(windows_secs: &[f64]) -> Box<dyn Feature> {
    let feature = Statistics { windows_secs: Some(windows_secs.to_vec()) };
    feature.build(&FeatureContext::default()).unwrap()
}

impl Scene {
    fn new(stream: &Stream) -> Scene {
        Scene::in_windows(stream, &[10.0])
    }

    fn in_windows(stream: &Stream, windows_secs: &[f64]) -> Scene {
        let feature = feature(windows_secs);
        let (mut extractor, mut out) = (alone(&*feature, stream), Outputs::new());
        for (id, stream) in [(INPUT, stream), (EVENTS, &session_events())] {
            assert!(feature.accepts(stream));
            extractor.join(id, stream, &mut out);
        }
        Scene { extractor, out }
    }

    fn sample(secs: f64, stream: StreamId, data: Data) -> Sample {
        let measured = Time::from_nanos((secs * 1e9).round() as i64);
        Sample {
            stream,
            measured,
            log_time: measured,
            device_time: None,
            source_time: None,
            period_ns: 1e9 / RATE_HZ,
            index: 0,
            turn: Turn::OnTime,
            data,
        }
    }

    fn take(&mut self, secs: f64, data: Data) {
        self.extractor.push(&Self::sample(secs, INPUT, data), &mut self.out);
    }

    fn wave(&mut self, secs: f64, channels: usize, samples: &[f64]) {
        let wave = Wave { period_ns: 1e8, channels: channels as u32, samples: samples.into() };
        self.take(secs, Data::Wave(wave));
    }

    /// Pushes a sample every 100 ms.
    fn run(&mut self, tenths: std::ops::Range<i32>, number: impl Fn(i32) -> f64) {
        for tenth in tenths {
            self.wave(f64::from(tenth) / 10.0, 1, &[number(tenth)]);
        }
    }

    fn happen(&mut self, secs: f64, kind: EventKind, label: &str, duration_secs: f64) {
        let event = Event { kind, label: label.to_owned(), value: f64::NAN, duration_secs };
        let sample = Self::sample(secs, EVENTS, Data::Event(Arc::new(event)));
        self.extractor.push(&sample, &mut self.out);
    }

    /// The end [s] and the values of each window, or of each phase.
    fn reported(&mut self, leaf: &str) -> Vec<(f64, FeatureValues)> {
        let is_it = |stream: &&Stream| stream.name.ends_with(&format!("/statistics/{leaf}"));
        let Some(stream) = self.out.streams().iter().find(is_it).cloned() else {
            return Vec::new();
        };
        let id = self.out.declare(stream);
        let of = self.out.samples().filter(|(stream, ..)| *stream == id);
        of.map(|(_, at, data)| {
            let Data::Feature(values) = data else { panic!("no feature") };
            (at.secs(), (**values).clone())
        })
        .collect()
    }
}

/// A sawtooth with the given heights.
fn saw(height: f64) -> impl Fn(i32) -> f64 {
    move |tenth| height * f64::from(tenth * 7 % 13)
}

#[test]
fn a_window_is_reported_each_second_by_its_samples() {
    let mut scene = Scene::new(&input(&[("x", "uS")]));
    scene.run(0..300, saw(0.25));
    let windows = scene.reported("w10");
    assert_eq!(windows.len(), 29);
    for (end_secs, window) in windows {
        let end = (end_secs * 10.0).round() as i32;
        let numbers: Vec<f64> = ((end - 100).max(0)..end).map(saw(0.25)).collect();
        let secs: Vec<f64> = (0..numbers.len()).map(|k| k as f64 / RATE_HZ).collect();
        let exact = describe(&secs, &numbers).unwrap();
        assert_eq!(f64::from(window.coverage), f64::from((numbers.len() as f32) / 100.0));
        if end < 50 {
            assert!(window.reasons.iter().all(|reason| *reason == Reason::Short));
            continue;
        }
        assert_eq!(window.values[2..6], [exact.median, exact.mad, exact.least, exact.greatest]);
        let rest = [exact.mean, exact.sd.unwrap(), exact.slope_per_sec.unwrap()];
        let values = [window.values[0], window.values[1], window.values[6]];
        assert!(values.iter().zip(rest).all(|(value, exact)| (value - exact).abs() < 1e-12));
        assert!(window.reasons[7..].iter().all(|reason| *reason == Reason::NoBaseline));
    }
}

#[test]
fn a_long_window_is_reported_more_seldom() {
    let mut scene = Scene::in_windows(&input(&[("x", "uS")]), &[60.0, 10.0]);
    scene.run(0..1000, saw(0.25));
    let windows = scene.reported("w60");
    let ends: Vec<f64> = windows.iter().map(|(end, _)| *end).collect();
    assert_eq!(ends, (1..50).map(|k| 2.0 * f64::from(k)).collect::<Vec<_>>());
    let (end_secs, window) = windows.last().unwrap();
    let end = (end_secs * 10.0).round() as i32;
    let numbers: Vec<f64> = (end - 600..end).map(saw(0.25)).collect();
    let exact = describe(&vec![0.0; numbers.len()], &numbers).unwrap();
    assert_eq!(window.values[2..6], [exact.median, exact.mad, exact.least, exact.greatest]);
    assert_eq!(scene.reported("w10").len(), 99);
}

#[test]
fn a_phase_differs_from_the_newest_baseline_that_is_over() {
    let mut scene = Scene::new(&input(&[("x", "uS")]));
    scene.happen(0.0, EventKind::Phase, "baseline", 20.0);
    scene.run(0..300, saw(1.0));
    scene.happen(30.0, EventKind::Phase, "task", f64::NAN);
    scene.run(300..500, saw(3.0));
    scene.happen(50.0, EventKind::Phase, "baseline", 20.0);
    scene.run(500..720, saw(2.0));
    scene.happen(72.0, EventKind::Phase, "task", f64::NAN);
    scene.run(720..900, saw(2.0));
    scene.happen(90.0, EventKind::Clock, END, f64::NAN);
    let phases = scene.reported("phases");
    let ends: Vec<f64> = phases.iter().map(|(end, _)| *end).collect();
    assert_eq!(ends, [20.0, 50.0, 70.0, 90.0]);
    let lengths = phases.iter().map(|(_, phase)| phase.window_secs).collect::<Vec<_>>();
    assert_eq!(lengths, [20.0, 20.0, 20.0, 18.0]);
    let of = |phase: usize, place: usize| phases[phase].1.values[place];
    for place in 0..7 {
        assert_eq!(of(0, 7 + place), 0.0);
        assert_eq!(of(1, 7 + place), of(1, place) - of(0, place));
        assert_eq!(of(2, 7 + place), 0.0);
        assert_eq!(of(3, 7 + place), of(3, place) - of(2, place));
    }
    // The standard deviation of the task less that of the baseline.
    assert!(of(1, 8) > 5.0 && of(1, 1) > 2.9 * of(0, 1));
    let windows = scene.reported("w10");
    let window = |end_secs: f64| &windows.iter().find(|(end, _)| *end == end_secs).unwrap().1;
    assert_eq!(window(19.0).reasons[7], Reason::NoBaseline);
    assert_eq!(window(20.0).reasons[7], Reason::Ok);
    assert_eq!(window(45.0).values[8], window(45.0).values[1] - of(0, 1));
    assert_eq!(window(80.0).values[8], window(80.0).values[1] - of(2, 1));
}

#[test]
fn a_baseline_with_few_samples_gives_no_differences() {
    let mut scene = Scene::new(&input(&[("x", "uS")]));
    scene.happen(0.0, EventKind::Phase, "baseline", 20.0);
    scene.run(0..300, |tenth| if tenth < 150 { f64::NAN } else { 1.0 });
    let window = scene.reported("w10").pop().unwrap().1;
    assert_eq!((window.reasons[0], window.reasons[7]), (Reason::Ok, Reason::NoBaseline));
}

#[test]
fn a_phase_that_is_reported_late_is_the_same() {
    let reported = |lag: i32| {
        let mut scene = Scene::new(&input(&[("x", "uS")]));
        scene.happen(0.0, EventKind::Phase, "baseline", f64::NAN);
        scene.run(0..600 + lag, saw(1.0));
        scene.happen(60.0, EventKind::Phase, "task", f64::NAN);
        scene.run(600 + lag..700, saw(1.0));
        format!("{:?}", scene.reported("phases"))
    };
    assert_eq!(reported(0), reported(70));
}

#[test]
fn a_late_sample_counts_from_then_on() {
    let mut scene = Scene::new(&input(&[("x", "uS")]));
    scene.run(0..100, |_| 1.0);
    let late = Data::Wave(Wave { period_ns: 1e8, channels: 1, samples: [99.0].into() });
    scene.extractor.push_late(&Scene::sample(7.55, INPUT, late), &mut scene.out);
    scene.run(100..190, |_| 1.0);
    let maxima: Vec<f64> =
        scene.reported("w10").iter().skip(8).map(|(_, window)| window.values[5]).collect();
    assert_eq!(maxima, [1.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 99.0, 1.0]);
}

#[test]
fn irregular_numbers_are_reported_with_the_next_one() {
    let mut scene = Scene::new(&Stream { rate_hz: 0.0, ..input(&[("x", "uS")]) });
    for secs in [0.0, 2.0, 4.5, 6.5, 9.0, 14.0] {
        scene.wave(secs, 1, &[secs]);
    }
    let windows = scene.reported("w10");
    let ends: Vec<f64> = windows.iter().map(|(end, _)| *end).collect();
    assert_eq!(ends, (1..=14).map(f64::from).collect::<Vec<_>>());
    assert_eq!(windows[9].1.values[4..6], [0.0, 9.0]);
    assert_eq!(windows[13].1.values[4..6], [4.5, 9.0]);
}

#[test]
fn the_fields_of_a_message_are_numbers_too() {
    let battery = messages::<BatteryState>("/r1/battery", Signal::Battery, &[("voltage", "V")]);
    let mut scene = Scene::new(&battery);
    for secs in 0..20 {
        let voltage = 24.0 - secs as f32;
        let message = BatteryState { voltage, ..BatteryState::default() }.encode();
        scene.take(f64::from(secs), Data::Message(message));
    }
    let window = scene.reported("w10").pop().unwrap().1;
    let stream = scene.out.streams()[0].clone();
    assert_eq!((&*stream.channels[6].name, &*stream.channels[6].unit), ("slope", "V/s"));
    assert_eq!((window.values[0], window.values[6]), (10.5, -1.0));
}

#[test]
fn a_new_rate_continues_and_new_channels_start_again() {
    let mut scene = Scene::new(&input(&[("x", "uS")]));
    scene.run(0..100, |_| 1.0);
    let faster = Stream { rate_hz: 2.0 * RATE_HZ, ..input(&[("x", "uS")]) };
    scene.extractor.join(INPUT, &faster, &mut scene.out);
    scene.run(100..112, |_| 1.0);
    assert_eq!(scene.reported("w10").pop().unwrap().1.coverage, 0.5);
    scene.extractor.join(INPUT, &input(&[("x", "uS"), ("y", "uS")]), &mut scene.out);
    scene.wave(12.0, 2, &[1.0, 2.0]);
    scene.wave(13.0, 2, &[1.0, 2.0]);
    let window = scene.reported("w10").pop().unwrap().1;
    assert_eq!((window.values.len(), window.reasons[0]), (28, Reason::Short));
}

#[test]
fn a_sample_with_another_number_of_channels_is_missing() {
    let mut scene = Scene::new(&input(&[("x", "uS"), ("y", "uS")]));
    (0..30).for_each(|secs| scene.wave(f64::from(secs), 1, &[1.0; 10]));
    let window = scene.reported("w10").pop().unwrap().1;
    assert_eq!((window.values.len(), window.reasons[0]), (28, Reason::Gap));
}

#[test]
fn derived_streams_and_those_without_subject_or_numbers_are_ignored() {
    let feature = feature(&[10.0]);
    let stream = input(&[("x", "uS")]);
    assert!(feature.accepts(&stream));
    for other in [
        Stream { origin: Origin::Derived, ..stream.clone() },
        Stream { about: About::Session, ..stream.clone() },
        Stream { channels: Vec::new(), ..stream.clone() },
        Stream { shape: Shape::Feature, ..stream.clone() },
    ] {
        assert!(!feature.accepts(&other));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn waves_of_any_length_give_the_same(
        lengths in prop::collection::vec(1usize..60, 1..8),
        numbers in prop::collection::vec(prop_oneof![9 => -1.0..1.0f64, 1 => Just(f64::NAN)], 300),
    ) {
        let reported = |lengths: &[usize]| {
            let mut scene = Scene::new(&input(&[("x", "uS"), ("y", "uS")]));
            scene.happen(0.0, EventKind::Phase, "baseline", 6.0);
            let mut begin = 0;
            for length in lengths.iter().cycle() {
                let end = (begin + length).min(numbers.len() / 2);
                if begin == end {
                    break;
                }
                scene.wave(begin as f64 / RATE_HZ, 2, &numbers[2 * begin..2 * end]);
                begin = end;
            }
            format!("{:?} {:?}", scene.reported("w10"), scene.reported("phases"))
        };
        prop_assert_eq!(reported(&lengths), reported(&[1]));
    }
}

#[test]
fn a_window_with_too_many_numbers_is_left_out_and_reported() {
    let channels: Vec<String> = (0..1000).map(|channel| format!("c{channel}")).collect();
    let channels: Vec<(&str, &str)> = channels.iter().map(|name| (name.as_str(), "1")).collect();
    let mut scene = Scene::in_windows(&input(&channels), &[10.0, 1000.0]);
    // Ten thousand numbers a second: those of 800 s are held.
    for secs in 0..1100 {
        scene.wave(f64::from(secs), 1000, &vec![1.0; 10_000]);
    }
    let ends = |scene: &mut Scene, leaf| scene.reported(leaf).len();
    assert_eq!(ends(&mut scene, "w10"), 1099);
    // Each 33 s, until more than 800 s were there.
    assert_eq!(ends(&mut scene, "w1000"), 24);
    let faults: Vec<Event> = scene
        .out
        .samples()
        .filter_map(|(.., data)| match data {
            Data::Event(event) => Some(Event::clone(event)),
            _ => None,
        })
        .collect();
    let [fault] = &faults[..] else { panic!("{faults:?}") };
    assert_eq!((fault.kind, fault.value.round()), (EventKind::Fault, 10_000.0));
    assert!(fault.label.contains("windows of 1000 s and more are left out"), "{}", fault.label);
}
