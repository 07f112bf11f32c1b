//! The worst level of a robot's diagnostics.

use std::fmt;
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::data::{Data, Event, EventKind, Reason};
use teampulse_core::feature::{Extractor, Feature, OutputId, Outputs};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sample::Sample;
use teampulse_core::stream::{Channel, Origin, Shape, Signal, Stream, StreamId, Window};
use teampulse_core::time::Time;
use teampulse_messages::readout::Readout;
use teampulse_signal::estimate::Estimate;

use crate::context::{FeatureContext, duration_setting};
use crate::value::{moment, window_of};
use crate::windows::Windows;

/// The number of entries of an array that are read.
const MOST_ENTRIES: usize = 64;

/// The worst level of a robot's diagnostics, and its changes.
///
/// - Measures: the highest level of all statuses in all messages of the window.
/// - Formula: maximum of `status[*].level`.
/// - Unit: 1; 0 ok, 1 warning, 2 error, 3 stale.
/// - Window: `window_secs`, once a second, as each part of a robot publishes its own messages.
/// - Reference: `diagnostic_msgs/msg/DiagnosticStatus`; REP-107.
/// - Limits: only the first 64 statuses of each message are read. Without messages the level is unknown,
///   not ok.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DiagnosticsLevel {
    /// The length of the window [s].
    pub window_secs: f64,
}

impl Default for DiagnosticsLevel {
    fn default() -> DiagnosticsLevel {
        DiagnosticsLevel { window_secs: 10.0 }
    }
}

impl Component<dyn Feature, FeatureContext> for DiagnosticsLevel {
    const EXAMPLE: &'static str = "window_secs = 10";

    fn build(self, _: &FeatureContext) -> Result<Box<dyn Feature>, SettingsError> {
        duration_setting("window_secs", self.window_secs)?;
        Ok(Box::new(self))
    }
}

impl Feature for DiagnosticsLevel {
    fn accepts(&self, stream: &Stream) -> bool {
        stream.signal == Signal::Diagnostics
            && stream.origin == Origin::Raw
            && !stream.channels.is_empty()
    }

    fn start(&self, _: &Stream) -> Box<dyn Extractor> {
        Box::new(Worst {
            window_secs: self.window_secs,
            windows: Windows::new(&[self.window_secs]),
            readout: None,
            name: String::new(),
            outputs: None,
            reported: Level::Ok,
        })
    }
}

struct Worst {
    window_secs: f64,
    windows: Windows<Level>,
    readout: Option<Readout>,
    name: String,
    outputs: Option<(OutputId, OutputId)>,
    reported: Level,
}

/// The level of a status, as `diagnostic_msgs/msg/DiagnosticStatus` numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Level {
    Ok = 0,
    Warning = 1,
    Error = 2,
    Stale = 3,
}

impl Extractor for Worst {
    fn join(&mut self, _: StreamId, stream: &Stream, out: &mut Outputs) {
        self.readout = readout(stream);
        self.name.clone_from(&stream.name);
        let state = out.declare(state_stream(stream, self.window_secs));
        let events = out.declare(events_stream(stream, self.window_secs));
        self.outputs = Some((state, events));
    }

    fn push(&mut self, sample: &Sample, _: &mut Outputs) {
        let numbers = self.readout.as_mut().and_then(|readout| readout.read(&sample.data));
        let levels = numbers.into_iter().flatten().filter_map(|&number| Level::of(number));
        if let Some(worst) = levels.max() {
            self.windows.insert_merged(sample.measured, worst, Level::max);
        }
    }

    fn push_late(&mut self, sample: &Sample, out: &mut Outputs) {
        self.push(sample, out);
    }

    fn tick(&mut self, now: Time, out: &mut Outputs) {
        let (Some(end), Some((state, events))) = (self.windows.due(now), self.outputs) else {
            return;
        };
        let Some(view) = self.windows.views(end).next() else { return };
        let worst = view.readings.iter().map(|(_, level)| **level).max();
        let value = worst.map(|level| Estimate::unstated(f64::from(level as u8)));
        let quality = view.share(|_| true);
        let window = window_of(view.secs, view.coverage, quality, &[value.ok_or(Reason::Gap)]);
        out.emit(state, end, window);
        if let Some(level) = worst.filter(|level| *level != self.reported) {
            out.emit(events, end, Data::Event(Arc::new(self.change_to(level))));
            self.reported = level;
        }
    }
}

impl Worst {
    fn change_to(&self, level: Level) -> Event {
        let kind = if level > self.reported { EventKind::Fault } else { EventKind::Marker };
        let change = moment(kind, format!("{}: {level}", self.name));
        Event { value: f64::from(level as u8), ..change }
    }
}

impl Level {
    fn of(number: f64) -> Option<Level> {
        let levels = [Level::Ok, Level::Warning, Level::Error, Level::Stale];
        levels.into_iter().find(|level| f64::from(*level as u8).total_cmp(&number).is_eq())
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Level::Ok => "ok",
            Level::Warning => "warning",
            Level::Error => "error",
            Level::Stale => "stale",
        })
    }
}

/// Reads the declared channels, or all entries where a channel names the first entry of an array.
fn readout(stream: &Stream) -> Option<Readout> {
    let entries = |channel: &Channel| -> Vec<Channel> {
        let entries = if channel.name.contains("[0]") { MOST_ENTRIES } else { 1 };
        let name = |k| channel.name.replace("[0]", &format!("[{k}]"));
        (0..entries).map(|k| Channel { name: name(k), ..channel.clone() }).collect()
    };
    match stream.shape {
        Shape::Message(_) => {
            let channels: Vec<Channel> = stream.channels.iter().flat_map(entries).collect();
            Readout::of_channels(stream, &channels)
        }
        _ => Readout::of(stream),
    }
}

fn state_stream(input: &Stream, secs: f64) -> Stream {
    Stream {
        signal: Signal::Diagnostics,
        device: input.device.clone(),
        rate_hz: 1.0,
        method: format!("highest level of all statuses in {secs} s"),
        doc: format!("The worst level of {}: 0 ok, 1 warning, 2 error, 3 stale.", input.name),
        ..Stream::derived(input, "level", Shape::Feature)
            .over(Window::of_secs(secs))
            .with_channels(&[("level", "1")])
    }
}

fn events_stream(input: &Stream, secs: f64) -> Stream {
    Stream {
        signal: Signal::Event,
        device: input.device.clone(),
        method: format!("changes of the highest level of all statuses in {secs} s"),
        doc: format!("When the worst level of {} changes.", input.name),
        ..Stream::derived(input, "level", Shape::Event).below("events")
    }
}

#[cfg(test)]
mod tests {
    use teampulse_messages::standard::Message;
    use teampulse_messages::standard::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};

    use super::*;
    use crate::drive::{Drive, built, messages, plain};

    fn drive() -> Drive {
        let channels = [("a", "1"), ("b", "1"), ("c", "1")];
        let stream = plain("/r1/diagnostics", Signal::Diagnostics, &channels);
        Drive::new(built::<DiagnosticsLevel>("").as_ref(), &stream)
    }

    #[test]
    fn the_worst_of_all_statuses_counts_for_a_window() {
        let mut drive = drive();
        drive.at(0.5, &[0.0, 0.0, f64::NAN]);
        drive.at(1.5, &[0.0, 0.0, 0.0]);
        drive.at(1.502, &[0.0, 2.0, 1.0]);
        drive.at(1.504, &[0.0, 0.0, 0.0]);
        (2..30).for_each(|secs| drive.at(f64::from(secs) + 0.5, &[0.0, 0.0, 0.0]));
        let windows = drive.features("/r1/diagnostics/level/w10");
        let levels: Vec<f64> = windows.iter().take(13).map(|(_, each)| each.values[0]).collect();
        assert_eq!(levels, [0., 2., 2., 2., 2., 2., 2., 2., 2., 2., 2., 0., 0.]);
    }

    #[test]
    fn a_change_is_reported_once_in_each_direction() {
        let mut drive = drive();
        drive.at(1.5, &[0.0, 2.0, 1.0]);
        (2..30).for_each(|secs| drive.at(f64::from(secs) + 0.5, &[0.0, 0.0, 0.0]));
        let events = drive.events("/r1/diagnostics/level/events");
        let reported: Vec<_> = events.iter().map(|(_, e)| (e.kind, e.label.as_str())).collect();
        assert_eq!(
            reported,
            [
                (EventKind::Fault, "/r1/diagnostics: error"),
                (EventKind::Marker, "/r1/diagnostics: ok")
            ]
        );
    }

    #[test]
    fn silence_is_unknown_and_not_ok() {
        let mut drive = drive();
        drive.at(0.5, &[1.0, 0.0, 0.0]);
        drive.until(30.0);
        assert_eq!(drive.last("/r1/diagnostics/level/w10").reasons, [Reason::Gap]);
        assert_eq!(drive.labels("/r1/diagnostics/level/events").len(), 1);
    }

    #[test]
    fn numbers_that_are_no_level_are_left_out() {
        let mut drive = drive();
        drive.at(0.5, &[255.0, -1.0, 0.5]);
        drive.until(3.0);
        assert!(drive.features("/r1/diagnostics/level/w10").is_empty());
    }

    #[test]
    fn every_status_of_a_message_is_read() {
        let channels = [("status[0].level", "1")];
        let stream = messages::<DiagnosticArray>("/r1/diagnostics", Signal::Diagnostics, &channels);
        let mut drive = Drive::new(built::<DiagnosticsLevel>("").as_ref(), &stream);
        let status = |level| DiagnosticStatus { level, name: "wheel".into(), ..Default::default() };
        for (at, levels) in [(0.5, vec![]), (1.5, vec![0, 1]), (2.5, vec![0, 1, 0, 0, 2])] {
            let status = levels.into_iter().map(status).collect();
            let array = DiagnosticArray { status, ..DiagnosticArray::default() };
            drive.take(at, Data::Message(array.encode()));
        }
        drive.until(3.0);
        let levels = drive.features("/r1/diagnostics/level/w10").into_iter();
        assert_eq!(levels.map(|(_, each)| each.values[0]).collect::<Vec<_>>(), [1.0, 2.0]);
    }
}
