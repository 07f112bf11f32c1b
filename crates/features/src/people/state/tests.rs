//! Laws of states, on windows as the families publish them.

use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;
use teampulse_core::data::{Event, EventKind, FeatureValues, Reason};
use teampulse_core::session_streams::END;
use teampulse_core::stream::{Shape, Subject, Window};

use super::*;
use crate::drive::{Drive, built};

const EVENTS: StreamId = StreamId(0);
const HEART: StreamId = StreamId(1);
const SKIN: StreamId = StreamId(2);
const STATE: &str = "/humans/persons/p1/state/w15";

fn person() -> Subject {
    Subject { about: About::Person, id: "p1".into() }
}

const W15: Window = Window::Of(Duration::from_secs(15));

fn windows(of: &str, family: &str, window: Window, channels: &[(&str, &str)]) -> Stream {
    let input = Stream::raw(format!("/humans/persons/p1/{of}"), person(), Shape::Wave);
    Stream::derived(&input, family, Shape::Feature).over(window).with_channels(channels)
}

fn heart(window: Window) -> Stream {
    let channels = [("ECG_Quality", "1"), ("HRV_MeanHR", "bpm"), ("HRV_RMSSD", "ms")];
    windows("strap/ecg", "heart", window, &channels)
}

fn skin(device: &str, window: Window) -> Stream {
    let channels = [("EDA_Tonic_Mean", "µS"), ("SCR_Peaks_Rate", "1/min")];
    windows(&format!("{device}/eda"), "skin", window, &channels)
}

fn values(window_secs: f64, quality: f32, values: &[f64]) -> Data {
    let reason = |value: &f64| if value.is_nan() { Reason::Quality } else { Reason::Ok };
    Data::Feature(Arc::new(FeatureValues {
        window_secs,
        coverage: 1.0,
        quality,
        values: values.to_vec(),
        sigmas: Vec::new(),
        reasons: values.iter().map(reason).collect(),
    }))
}

fn event(kind: EventKind, label: &str) -> Data {
    let label = label.to_owned();
    Data::Event(Arc::new(Event { kind, label, value: f64::NAN, duration_secs: f64::NAN }))
}

/// A value that varies by 2 about a centre, as windows of the baseline do.
fn around(centre: f64, secs: u32) -> f64 {
    centre + 2.0 * (f64::from(secs) * 0.7).sin()
}

/// A strap and a glove, and the phases of the session.
fn begun() -> Drive {
    let mut drive = Drive::new(built::<State>("").as_ref(), &session_events());
    drive.join(HEART, &heart(W15));
    drive.join(SKIN, &skin("glove", W15));
    drive
}

fn heart_window(drive: &mut Drive, secs: u32, rate: f64) {
    drive.take_on(
        HEART,
        f64::from(secs),
        values(15.0, 0.9, &[0.9, rate, 40.0 - around(0.0, secs)]),
    );
}

fn skin_window(drive: &mut Drive, secs: u32, level: f64) {
    drive.take_on(SKIN, f64::from(secs), values(15.0, 0.8, &[level, around(6.0, secs)]));
}

fn phase(drive: &mut Drive, secs: u32, label: &str) {
    drive.take_on(EVENTS, f64::from(secs), event(EventKind::Phase, label));
}

/// A baseline from 10 s to 100 s at 70 beats per minute and 5 µS.
fn after_baseline() -> Drive {
    let mut drive = begun();
    phase(&mut drive, 10, "baseline");
    for secs in 11..100 {
        // Windows that began before the baseline do not count.
        let rate = if secs < 25 { 120.0 } else { around(70.0, secs) };
        heart_window(&mut drive, secs, rate);
        skin_window(&mut drive, secs, around(5.0, secs));
    }
    phase(&mut drive, 100, "task");
    drive
}

fn value(drive: &mut Drive, name: &str) -> Result<f64, Reason> {
    value_of(drive, STATE, name)
}

fn value_of(drive: &mut Drive, output: &str, name: &str) -> Result<f64, Reason> {
    let stream = drive.outputs().iter().find(|stream| stream.name == output).unwrap();
    let place = stream.place_of(name).unwrap();
    let last = drive.last(output);
    if last.reasons[place] == Reason::Ok {
        Ok(last.values[place])
    } else {
        Err(last.reasons[place])
    }
}

#[test]
fn a_person_without_a_baseline_has_no_state() {
    let mut drive = begun();
    phase(&mut drive, 5, "task");
    for secs in 10..200 {
        heart_window(&mut drive, secs, around(70.0, secs));
    }
    assert!(drive.outputs().is_empty());
}

#[test]
fn a_baseline_that_goes_on_is_not_used_yet() {
    let mut drive = begun();
    phase(&mut drive, 0, "baseline");
    for secs in 1..200 {
        heart_window(&mut drive, secs, around(70.0, secs));
    }
    assert!(drive.outputs().is_empty());
}

#[test]
fn the_same_values_as_in_the_baseline_are_no_difference() {
    let mut drive = after_baseline();
    for secs in 100..160 {
        heart_window(&mut drive, secs, around(70.0, secs));
        skin_window(&mut drive, secs, around(5.0, secs));
    }
    for name in ["heart_rate_z", "ln_rmssd_z", "skin_level_z", "response_rate_robust_z"] {
        let z = value(&mut drive, name).unwrap();
        assert!(z.abs() < 2.0, "{name} {z}");
    }
}

#[test]
fn only_windows_that_lie_wholly_in_the_baseline_count() {
    let mut drive = after_baseline();
    heart_window(&mut drive, 103, 80.0);
    drive.until(104.0);
    let difference = value(&mut drive, "heart_rate_difference").unwrap();
    assert!((difference - 10.0).abs() < 0.3, "{difference}");
}

#[test]
fn against_a_baseline_too_short_there_are_differences_and_no_z() {
    let mut drive = begun();
    phase(&mut drive, 0, "baseline");
    (1..60).for_each(|secs| heart_window(&mut drive, secs, around(70.0, secs)));
    phase(&mut drive, 60, "task");
    heart_window(&mut drive, 63, 80.0);
    drive.until(64.0);
    assert!(value(&mut drive, "heart_rate_difference").unwrap() > 9.0);
    for name in ["heart_rate_z", "heart_rate_robust_z"] {
        assert_eq!(value(&mut drive, name), Err(Reason::BriefBaseline), "{name}");
    }
    assert!(drive.outputs()[0].method.contains("too short for z: 59 s, needs 75 s"));
}

#[test]
fn a_sensor_that_reported_too_little_of_the_baseline_has_not_even_differences() {
    let mut drive = begun();
    phase(&mut drive, 0, "baseline");
    (15..60).for_each(|secs| heart_window(&mut drive, secs, around(70.0, secs)));
    (50..60).for_each(|secs| skin_window(&mut drive, secs, around(5.0, secs)));
    phase(&mut drive, 60, "task");
    drive.until(64.0);
    assert_eq!(value(&mut drive, "skin_level_difference"), Err(Reason::BriefBaseline));
}

#[test]
fn an_unmeasured_value_is_missing() {
    let mut drive = after_baseline();
    drive.until(105.0);
    assert_eq!(value(&mut drive, "breathing_rate_z"), Err(Reason::Missing));
    assert_eq!(value(&mut drive, "input_rate_difference"), Err(Reason::Missing));
}

#[test]
fn a_stream_that_stops_becomes_unknown_and_the_others_go_on() {
    let mut drive = after_baseline();
    heart_window(&mut drive, 102, 75.0);
    for secs in 103..120 {
        skin_window(&mut drive, secs, 6.0);
    }
    drive.until(120.0);
    assert_eq!(value(&mut drive, "heart_rate_z"), Err(Reason::Gap));
    assert!(value(&mut drive, "skin_level_z").is_ok());
    let windows = drive.features(STATE);
    let known = |secs: f64| windows.iter().find(|(at, _)| *at == secs).unwrap().1.coverage;
    assert!(known(104.0) > known(120.0));
}

#[test]
fn the_reason_of_a_window_is_that_of_the_state() {
    let mut drive = after_baseline();
    heart_window(&mut drive, 103, f64::NAN);
    drive.until(104.0);
    assert_eq!(value(&mut drive, "heart_rate_z"), Err(Reason::Quality));
    assert!(value(&mut drive, "ln_rmssd_z").is_ok());
}

#[test]
fn a_sensor_without_data_in_the_baseline_has_no_differences() {
    let mut drive = after_baseline();
    let breath = windows("belt/respiration", "breath", W15, &[("RSP_Rate_Mean", "1/min")]);
    drive.join(StreamId(3), &breath);
    drive.take_on(StreamId(3), 103.0, values(15.0, 1.0, &[15.0]));
    drive.until(104.0);
    assert_eq!(value(&mut drive, "breathing_rate_z"), Err(Reason::NoBaseline));
}

#[test]
fn of_two_devices_the_better_one_is_taken_and_named() {
    for (qualities, expected) in
        [([0.5, 0.9], "wrist"), ([0.9, 0.5], "glove"), ([0.7, 0.7], "glove")]
    {
        let mut drive = begun();
        drive.join(StreamId(3), &skin("wrist", W15));
        phase(&mut drive, 0, "baseline");
        for secs in 30..100 {
            for (id, quality) in [SKIN, StreamId(3)].into_iter().zip(qualities) {
                let window = values(15.0, quality, &[around(5.0, secs), around(6.0, secs)]);
                drive.take_on(id, f64::from(secs), window);
            }
        }
        phase(&mut drive, 100, "task");
        drive.until(110.0);
        let state = drive.outputs()[0].clone();
        let skin = format!("/humans/persons/p1/{expected}/eda/skin/w15");
        assert_eq!(state.inputs, [skin.clone(), session_events().name], "{qualities:?}");
        assert!(state.method.contains(&format!("skin_level: EDA_Tonic_Mean of {skin}")));
    }
}

#[test]
fn a_pulse_is_used_where_there_is_no_electrocardiogram() {
    let mut drive = begun();
    let pulse = windows("watch/ppg", "pulse", W15, &[("HRV_MeanHR", "bpm"), ("HRV_RMSSD", "ms")]);
    drive.join(StreamId(3), &pulse);
    phase(&mut drive, 0, "baseline");
    for secs in 30..100 {
        heart_window(&mut drive, secs, f64::NAN);
        let window = values(15.0, 0.9, &[around(70.0, secs), around(40.0, secs)]);
        drive.take_on(StreamId(3), f64::from(secs), window);
    }
    phase(&mut drive, 100, "task");
    drive.take_on(StreamId(3), 103.0, values(15.0, 0.9, &[80.0, 30.0]));
    drive.until(104.0);
    assert!(value(&mut drive, "heart_rate_z").unwrap() > 3.0);
    // Measures that the electrocardiogram has are still its own.
    assert!(drive.outputs()[0].method.contains("ln_rmssd: HRV_RMSSD of /humans/persons/p1/strap"));
}

#[test]
fn a_later_baseline_replaces_the_first() {
    let mut drive = after_baseline();
    phase(&mut drive, 200, "baseline");
    (201..300).for_each(|secs| heart_window(&mut drive, secs, around(90.0, secs)));
    assert!(value(&mut drive, "heart_rate_difference").unwrap() > 15.0);
    phase(&mut drive, 300, "task");
    (300..305).for_each(|secs| heart_window(&mut drive, secs, 90.0));
    assert!(value(&mut drive, "heart_rate_difference").unwrap().abs() < 1.0);
    assert_eq!(value(&mut drive, "skin_level_z"), Err(Reason::NoBaseline));
}

/// The same phases as whole phases, reported by a strap and a glove.
fn with_phases(phases: &[(u32, f64)]) -> Drive {
    let (heart_phases, skin_phases) = (StreamId(3), StreamId(4));
    let mut drive = after_baseline();
    drive.join(heart_phases, &heart(Window::Phases));
    drive.join(skin_phases, &skin("glove", Window::Phases));
    for &(secs, rate) in phases {
        let of_heart = values(60.0, 0.9, &[0.9, rate, 35.0]);
        drive.take_on(heart_phases, f64::from(secs), of_heart);
        drive.take_on(skin_phases, f64::from(secs), values(60.0, 0.9, &[5.0, 6.0]));
    }
    drive
}

const PHASES: &str = "/humans/persons/p1/state/phases";

#[test]
fn a_phase_is_compared_with_the_baseline_as_one_phase() {
    let mut drive = with_phases(&[(100, 71.0)]);
    phase(&mut drive, 160, "rest");
    drive.take_on(StreamId(3), 160.0, values(60.0, 0.9, &[0.9, 78.0, 30.0]));
    drive.take_on(StreamId(4), 160.0, values(60.0, 0.9, &[5.5, 7.0]));
    drive.until(161.0);
    let windows = drive.features(PHASES);
    assert_eq!(windows.iter().map(|(secs, _)| *secs).collect::<Vec<_>>(), [160.0]);
    assert_eq!(value_of(&mut drive, PHASES, "heart_rate_difference"), Ok(7.0));
    assert!(value_of(&mut drive, PHASES, "heart_rate_z").unwrap() > 3.0);
    let inputs = &drive.outputs().iter().find(|stream| stream.name == PHASES).unwrap().inputs;
    assert!(inputs.iter().any(|name| name.ends_with("heart/phases")));
    assert!(inputs.iter().any(|name| name.ends_with("heart/w15")));
}

#[test]
fn a_phase_is_reported_without_the_stream_that_stopped() {
    let mut drive = with_phases(&[(100, 71.0)]);
    phase(&mut drive, 160, "rest");
    drive.take_on(StreamId(4), 160.0, values(60.0, 0.9, &[5.5, 7.0]));
    drive.until(165.0);
    assert!(drive.outputs().iter().all(|stream| stream.name != PHASES));
    drive.until(175.0);
    assert_eq!(value_of(&mut drive, PHASES, "heart_rate_z"), Err(Reason::Gap));
    assert_eq!(value_of(&mut drive, PHASES, "skin_level_difference"), Ok(0.5));
}

#[test]
fn the_last_phase_is_reported_as_the_session_ends() {
    let mut drive = with_phases(&[(100, 71.0)]);
    drive.take_on(EVENTS, 160.0, event(EventKind::Clock, END));
    drive.take_on(StreamId(3), 160.0, values(60.0, 0.9, &[0.9, 78.0, 30.0]));
    drive.take_on(StreamId(4), 160.0, values(60.0, 0.9, &[5.5, 7.0]));
    assert_eq!(value_of(&mut drive, PHASES, "heart_rate_difference"), Ok(7.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_windows_give_a_state_is_sound(
        values in prop::collection::vec(prop::num::f64::ANY, 150),
        end in 31_u32..150,
    ) {
        let mut drive = begun();
        phase(&mut drive, 0, "baseline");
        for (secs, value) in (1..).zip(values) {
            heart_window(&mut drive, secs, value);
            if secs == end {
                phase(&mut drive, secs, "task");
            }
        }
        let windows = drive.outputs().iter().map(|stream| stream.name.clone()).collect::<Vec<_>>();
        for (_, values) in windows.iter().flat_map(|name| drive.features(name)).collect::<Vec<_>>() {
            for (value, reason) in values.values.iter().zip(&values.reasons) {
                prop_assert_eq!(value.is_finite(), *reason == Reason::Ok);
            }
            prop_assert!(values.sigmas.iter().all(|sigma| sigma.is_nan() || *sigma >= 0.0));
        }
    }
}
