//! The streams of a simulated person.

use teampulse_core::data::EventKind;
use teampulse_core::qos::Qos;
use teampulse_core::stream::{About, Shape, Signal, Stream, Subject};
use teampulse_emulators::body::{Rates, Sensor};

/// The history depth for slow subscribers: enough for half a minute.
const DEPTH: u32 = 120;

/// The number of phases kept for late joiners.
const KEPT_DEPTH: u32 = 1000;

/// One stream of a simulated person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worn {
    /// The readings of a sensor.
    Sensor(Sensor),
    /// The phases of the task.
    Phases,
    /// The letters shown.
    Stimuli,
    /// The keys that are pressed; the value is the reaction time [s].
    Presses,
    /// Commands to robots; the value is the robot's number, from 1.
    Commands,
    /// Self-reports (ISA, 1 to 5).
    Reports,
    /// The true state of the body, once a second.
    TrueState,
    /// The true beats of the heart.
    TrueBeats,
    /// The true skin conductance responses; the value is the amplitude [µS].
    TrueResponses,
    /// The true breaths; the value is the depth.
    TrueBreaths,
}

impl Worn {
    /// All streams of a simulated person.
    pub const ALL: [Worn; 18] = [
        Worn::Sensor(Sensor::Ecg),
        Worn::Sensor(Sensor::Ppg),
        Worn::Sensor(Sensor::EdaWrist),
        Worn::Sensor(Sensor::EdaFingers),
        Worn::Sensor(Sensor::Emg),
        Worn::Sensor(Sensor::Eeg),
        Worn::Sensor(Sensor::Respiration),
        Worn::Sensor(Sensor::Temperature),
        Worn::Sensor(Sensor::Acceleration),
        Worn::Phases,
        Worn::Stimuli,
        Worn::Presses,
        Worn::Commands,
        Worn::Reports,
        Worn::TrueState,
        Worn::TrueBeats,
        Worn::TrueResponses,
        Worn::TrueBreaths,
    ];

    /// Returns the stream to declare; `None` for a sensor that is not worn. The ground truth has no signal, so that no
    /// feature runs on it.
    pub fn stream(self, person: &str, rates: &Rates) -> Option<Stream> {
        let (device, name, doc) = self.named();
        let subject = Subject { about: About::Person, id: person.to_owned() };
        let topic = format!("/humans/persons/{person}/{device}/{name}");
        let bare = |shape| Stream {
            device: device.to_owned(),
            doc: doc.to_owned(),
            qos: vec![Qos::reliable(DEPTH)],
            ..Stream::raw(topic, subject, shape)
        };
        Some(match self {
            Worn::Sensor(sensor) if rates.of(sensor) > 0.0 => {
                worn(bare(Shape::Wave), sensor, rates.of(sensor))
            }
            Worn::Sensor(_) => return None,
            Worn::TrueState => Stream { rate_hz: 1.0, ..bare(Shape::Sample) }.with_channels(&[
                ("workload", "1"),
                ("arousal", "1"),
                ("valence", "1"),
                ("heart_rate", "1/min"),
                ("breathing_rate", "1/min"),
                ("skin_conductance_level", "uS"),
                ("skin_temperature", "degC"),
            ]),
            Worn::Phases => Stream {
                signal: Signal::Event,
                qos: vec![Qos::latched(KEPT_DEPTH)],
                ..bare(Shape::Event)
            },
            Worn::Presses => Stream { signal: Signal::Input, ..bare(Shape::Event) }
                .with_channels(&[("reaction_time", "s")]),
            Worn::Commands => Stream { signal: Signal::Input, ..bare(Shape::Event) }
                .with_channels(&[("robot", "1")]),
            _ => Stream { signal: Signal::Event, ..bare(Shape::Event) },
        })
    }

    /// The kind of the stream's events.
    pub fn happens(self) -> EventKind {
        match self {
            Worn::Phases => EventKind::Phase,
            Worn::Reports => EventKind::Report,
            Worn::TrueBeats => EventKind::Beat,
            Worn::TrueResponses => EventKind::Response,
            Worn::TrueBreaths => EventKind::Breath,
            _ => EventKind::Marker,
        }
    }

    /// Returns the stream's device, its name within the device, and its description.
    fn named(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Worn::Sensor(sensor) => {
                let (name, doc) = sensor_named(sensor);
                ("simulated", name, doc)
            }
            Worn::Phases => ("task", "phases", "phases of a simulated task as they begin"),
            Worn::Stimuli => ("task", "stimuli", "letters shown to a simulated person"),
            Worn::Presses => ("task", "presses", "key presses of a simulated person"),
            Worn::Commands => ("task", "commands", "commands of a simulated person to robots"),
            Worn::Reports => ("task", "reports", "workload reported by a simulated person"),
            Worn::TrueState => ("truth", "state", "true state of a simulated person"),
            Worn::TrueBeats => ("truth", "beats", "true beats of a simulated heart"),
            Worn::TrueResponses => {
                ("truth", "responses", "true skin conductance responses of a simulated person")
            }
            Worn::TrueBreaths => ("truth", "breaths", "true breaths of a simulated person"),
        }
    }
}

fn worn(stream: Stream, sensor: Sensor, rate_hz: f64) -> Stream {
    let unit = |channel: &&'static str| (*channel, sensor.unit());
    let channels: Vec<_> = sensor.channels().iter().map(unit).collect();
    Stream { signal: signal(sensor), rate_hz, ..stream.with_channels(&channels) }
}

fn signal(sensor: Sensor) -> Signal {
    match sensor {
        Sensor::Ecg => Signal::Ecg,
        Sensor::Ppg => Signal::Ppg,
        Sensor::EdaWrist | Sensor::EdaFingers => Signal::Eda,
        Sensor::Emg => Signal::Emg,
        Sensor::Eeg => Signal::Eeg,
        Sensor::Respiration => Signal::Respiration,
        Sensor::Temperature => Signal::Temperature,
        Sensor::Acceleration => Signal::Acceleration,
    }
}

fn sensor_named(sensor: Sensor) -> (&'static str, &'static str) {
    match sensor {
        Sensor::Ecg => ("ecg", "electrocardiogram of a simulated person"),
        Sensor::Ppg => ("ppg", "pulse wave at a simulated finger"),
        Sensor::EdaWrist => ("eda_wrist", "skin conductance at a simulated wrist"),
        Sensor::EdaFingers => ("eda_fingers", "skin conductance at simulated fingers"),
        Sensor::Emg => ("emg", "muscle activity of a simulated forearm"),
        Sensor::Eeg => ("eeg", "electroencephalogram of a simulated person"),
        Sensor::Respiration => ("respiration", "respiration, from a belt around a simulated chest"),
        Sensor::Temperature => ("temperature", "skin temperature of a simulated person"),
        Sensor::Acceleration => ("acceleration", "acceleration of a simulated wrist"),
    }
}
