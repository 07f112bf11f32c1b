//! Each signal of a person fails in turn: the others are not affected, and no value is invented.

mod living;

use std::collections::BTreeMap;

use bytes::Bytes;
use teampulse_core::data::{Data, FeatureValues, Reason};
use teampulse_core::sample::Record;
use teampulse_core::stream::{Channel, Origin};
use teampulse_emulators::body::{Fault, Scene, Sensor, Settings};

/// The baseline is long enough for z.
const PHASES: [(&str, f64); 2] = [("baseline", 0.0), ("task", 150.0)];
const SECS: f64 = 195.0;
const BAD_FROM_SECS: f64 = 153.0;
const BACK_SECS: f64 = 167.0;
/// The time after the start of a fault in which earlier results may still be reported [s].
const SETTLING_SECS: f64 = 3.0;
const WINDOW_SECS: f64 = 30.0;

/// A session in which one sensor fails, if any.
struct Lived {
    sensor: Sensor,
    records: Vec<Record>,
}

/// A window or a phase.
struct Window<'a> {
    end_secs: f64,
    values: &'a FeatureValues,
    channels: &'a [Channel],
}

impl Lived {
    fn with(sensor: Sensor, script: Vec<Scene>) -> Lived {
        let settings = Settings { script, ..Settings::default() };
        let chunks = living::lived(&settings, &PHASES, SECS);
        Lived { sensor, records: living::kept(chunks, &PHASES) }
    }

    fn bad(sensor: Sensor, what: Fault, to_secs: Option<f64>) -> Lived {
        let from_secs = BAD_FROM_SECS;
        Lived::with(sensor, vec![Scene { sensor: Some(sensor), from_secs, to_secs, what }])
    }

    /// The results from the other sensors, by stream: in order, as stored.
    fn others(&self) -> BTreeMap<&str, Vec<&Bytes>> {
        let mut streams = BTreeMap::<&str, Vec<&Bytes>>::new();
        let bad = living::name(self.sensor);
        for Record { stream, cdr, .. } in &self.records {
            let of_sensor = stream.name.starts_with(living::WORN);
            if stream.origin == Origin::Derived && of_sensor && !stream.name.starts_with(&bad) {
                streams.entry(&stream.name).or_default().push(cdr);
            }
        }
        streams
    }

    /// The results of the sensor's own features: windows (`w30`), or phases.
    fn reported(&self, leaf: &str) -> Vec<Window<'_>> {
        let (name, statistics) = (living::name(self.sensor), "/statistics/");
        let of_sensor = self.records.iter().filter(|Record { stream, .. }| {
            let stream = &stream.name;
            stream.starts_with(&name) && stream.ends_with(leaf) && !stream.contains(statistics)
        });
        let windows = of_sensor.filter_map(|record| {
            let Data::Feature(values) = &record.sample.data else { return None };
            let end_secs = record.sample.measured.secs_since(living::after(0.0));
            Some(Window { end_secs, values, channels: &record.stream.channels })
        });
        windows.collect()
    }

    /// Values of the person's last state, by name.
    fn state(&self) -> BTreeMap<&str, Result<f64, Reason>> {
        let is_state = |record: &&Record| record.stream.name.ends_with("p1/state/w30");
        let last = self.records.iter().rfind(is_state).expect("a state");
        let Data::Feature(values) = &last.sample.data else { panic!("no feature") };
        let values = values.values.iter().zip(&values.reasons);
        let values = values.map(|(value, reason)| match reason {
            Reason::Ok => Ok(*value),
            reason => Err(*reason),
        });
        last.stream.channels.iter().map(|channel| &*channel.name).zip(values).collect()
    }

    /// The times of the sensor's events, such as beats [s].
    fn events_secs(&self) -> Vec<f64> {
        let name = living::name(self.sensor);
        let of_sensor = self.records.iter().filter(|record| {
            record.stream.name.starts_with(&name) && matches!(record.sample.data, Data::Event(_))
        });
        of_sensor.map(|record| record.sample.measured.secs_since(living::after(0.0))).collect()
    }
}

impl Window<'_> {
    fn begins_after(&self, secs: f64) -> bool {
        self.end_secs - self.values.window_secs >= secs
    }

    /// The results about the person, except those about the signal itself.
    fn of_person(&self) -> Vec<String> {
        let lacking = self.channels.iter().zip(&self.values.reasons);
        let lacking = lacking
            .filter(|(_, reason)| **reason == Reason::Ok)
            .map(|(channel, _)| channel.name.clone());
        let of_signal = |name: &str| OF_SIGNAL.iter().any(|word| name.contains(word));
        lacking.filter(|name| !of_signal(name)).collect()
    }
}

/// Values that only describe the signal; `PPG_Peaks_N` does not count flagged pulses.
const OF_SIGNAL: [&str; 14] = [
    "Quality",
    "SQI",
    "Flat",
    "Saturated",
    "Motion",
    "LeadOff",
    "Flagged",
    "Skewness",
    "Mains",
    "Outside",
    "Clipped",
    "Implausible",
    "Artefact",
    "PPG_Peaks_N",
];

/// Whether the signal alone can show a fault: it can't distinguish a thermometer in the air of a warm room from one on
/// a cold hand, a wrist at rest from a table, a resting muscle from an electrode in a quiet place, or white noise from
/// the muscles of a clenched jaw (which shows only in the quality).
fn is_detectable(sensor: Sensor, what: Fault) -> bool {
    match what {
        Fault::Stuck => sensor != Sensor::Temperature,
        _ => !OF_WHICH_THE_AIR_IS_LIKE_THE_BODY.contains(&sensor),
    }
}

const OF_WHICH_THE_AIR_IS_LIKE_THE_BODY: [Sensor; 4] =
    [Sensor::Temperature, Sensor::Acceleration, Sensor::Emg, Sensor::Eeg];

fn assert_others_are_untouched(good: &Lived, bad: &Lived, fault: &str) {
    let (expected, others) = (good.others(), bad.others());
    assert!(expected.len() > 8, "{:?}", expected.keys());
    assert!(expected.keys().eq(others.keys()), "{fault}: {:?}", others.keys());
    for (stream, samples) in expected {
        assert!(others[stream] == samples, "{fault} changes {stream}");
    }
}

/// Asserts that a sensor that dies reports nothing more, and too little data for the phase.
fn assert_dies(dead: &Lived) {
    let windows = dead.reported("w30");
    assert!(windows.iter().all(|window| window.end_secs <= BAD_FROM_SECS));
    assert!(windows.last().is_some_and(|window| window.end_secs > BAD_FROM_SECS - 2.0));
    assert!(dead.events_secs().iter().all(|secs| *secs <= BAD_FROM_SECS));
    let phases = dead.reported("phases");
    let [baseline, task] = &phases[..] else { panic!("{} phases", phases.len()) };
    assert!(baseline.values.coverage > 0.9 && !baseline.of_person().is_empty());
    assert!(task.values.coverage < 0.2);
    assert!(task.values.reasons.iter().all(|reason| *reason != Reason::Ok));
}

/// Asserts that a sensor that comes back reports for which part of each window it was present, and then works as
/// before.
fn assert_comes_back(back: &Lived) {
    let windows = back.reported("w30");
    assert!(windows.last().is_some_and(|window| window.end_secs > SECS - 2.0));
    for Window { end_secs, values, .. } in &windows {
        let begin_secs = (end_secs - values.window_secs).max(0.0);
        let there_secs = end_secs
            - begin_secs
            - (end_secs.min(BACK_SECS) - begin_secs.max(BAD_FROM_SECS)).max(0.0);
        let (share, coverage) = (there_secs / WINDOW_SECS, f64::from(values.coverage));
        // An EEG is judged in segments of four seconds, of which a gap takes those that it touches.
        let tolerance = if back.sensor == Sensor::Eeg { 0.25 } else { 0.1 };
        assert!((coverage - share).abs() < tolerance, "{coverage} of {share} at {end_secs}");
        if coverage < 0.5 {
            assert!(values.reasons.iter().all(|reason| *reason != Reason::Ok), "at {end_secs}");
        }
    }
    assert!(!back.reported("phases")[1].of_person().is_empty());
}

/// Asserts that the state reports which values are missing, and its other values are unchanged.
fn assert_state_knows(good: &Lived, dead: &Lived) {
    let known_by = |name: &str| match dead.sensor {
        Sensor::Ecg => name.starts_with("heart_rate") || name.starts_with("ln_rmssd"),
        Sensor::Respiration => name.starts_with("breathing_rate"),
        // Only one of the two is checked: both values behave alike.
        Sensor::EdaWrist | Sensor::EdaFingers => {
            let of_skin = name.starts_with("skin_level") || name.starts_with("response_rate");
            of_skin && dead.state()[name].is_err()
        }
        _ => false,
    };
    let (expected, state) = (good.state(), dead.state());
    assert!(expected.values().filter(|value| value.is_ok()).count() >= 12, "{expected:?}");
    for (name, value) in expected {
        if known_by(name) {
            assert!(state[name].is_err(), "{name}");
        } else {
            assert_eq!(state[name], value, "{name}");
        }
    }
}

/// Asserts that nothing is reported about a person once the sensor delivers nothing.
fn assert_nothing_is_made_up(bad: &Lived) {
    let windows = bad.reported("w30");
    let inside = |window: &&Window<'_>| window.begins_after(BAD_FROM_SECS + SETTLING_SECS);
    assert!(windows.iter().any(|window| inside(&window)));
    for window in windows.iter().filter(inside) {
        assert!(window.values.quality < 0.4, "{} at {}", window.values.quality, window.end_secs);
        assert_eq!(window.of_person(), [""; 0], "at {}", window.end_secs);
    }
}

fn goes_bad(sensor: Sensor) {
    let good = Lived::with(sensor, Vec::new());
    assert!(good.reported("w30").last().is_some_and(|window| !window.of_person().is_empty()));
    let bad = |what, to_secs| {
        let bad = Lived::bad(sensor, what, to_secs);
        assert_others_are_untouched(&good, &bad, &format!("{sensor:?} {what:?}"));
        bad
    };
    let dead = bad(Fault::Dead, None);
    assert_dies(&dead);
    assert_state_knows(&good, &dead);
    assert_comes_back(&bad(Fault::Dead, Some(BACK_SECS)));
    for what in [Fault::Stuck, Fault::OffBody] {
        let bad = bad(what, None);
        if is_detectable(sensor, what) {
            assert_nothing_is_made_up(&bad);
        }
    }
}

#[test]
fn an_ecg_goes_bad() {
    goes_bad(Sensor::Ecg);
}

#[test]
fn a_pulse_goes_bad() {
    goes_bad(Sensor::Ppg);
}

#[test]
fn a_wrist_s_conductance_goes_bad() {
    goes_bad(Sensor::EdaWrist);
}

#[test]
fn fingers_conductance_goes_bad() {
    goes_bad(Sensor::EdaFingers);
}

#[test]
fn muscles_go_bad() {
    goes_bad(Sensor::Emg);
}

#[test]
fn an_eeg_goes_bad() {
    goes_bad(Sensor::Eeg);
}

#[test]
fn a_breathing_belt_goes_bad() {
    goes_bad(Sensor::Respiration);
}

#[test]
fn a_thermometer_goes_bad() {
    goes_bad(Sensor::Temperature);
}

#[test]
fn an_accelerometer_goes_bad() {
    goes_bad(Sensor::Acceleration);
}
