//! The signals of a file as streams of a person, still in the time of the device's clock.

use std::path::Path;

use teampulse_core::counted::counted;
use teampulse_core::stream::{About, Channel, Shape, Signal as Measured, Stream, Subject};
use teampulse_core::text::on_one_line;
use teampulse_core::units::{spelt, worked_in};
use teampulse_formats::{Content, Quantity, Recording, Signal, StatedDate, read};
use teampulse_sources::ros_people::NAMESPACE;

use super::overlaps::{append, without_overlaps};
use super::tables::{Asked, Tables};
use crate::failure::Failure;
use crate::output;

/// The largest file that is read into memory [bytes].
const MOST_BYTES: u64 = 2 << 30;

/// A signal with its stream.
pub struct Imported {
    /// The stream of the signal, without a description of its times.
    pub stream: Stream,
    /// The samples, timed by the device's clock.
    pub content: Content,
}

/// A recording from one device.
pub struct DeviceRecording {
    /// The names of its files, for messages.
    pub name: String,
    /// The device, as a token of a topic.
    pub device: String,
    /// Whether the device's clock states the date.
    pub is_dated: bool,
    /// The date that the file states, if the device's clock does not state one.
    pub date: Option<StatedDate>,
    /// The signals.
    pub signals: Vec<Imported>,
}

impl DeviceRecording {
    /// Reads files of devices; files of one device that contain dates become one recording.
    pub fn of_files(
        files: &[impl AsRef<Path>],
        asked: &Asked,
    ) -> Result<Vec<DeviceRecording>, Failure> {
        let mut recordings = Vec::<(String, Recording)>::new();
        for path in files {
            let path = path.as_ref();
            let recording = recording(path)?;
            let is_same = |(_, known): &&mut (String, Recording)| {
                known.is_dated && recording.is_dated && known.device == recording.device
            };
            match recordings.iter_mut().find(is_same) {
                Some((_, known)) => add(known, recording, path),
                None => recordings.push((path.display().to_string(), recording)),
            }
        }
        for (name, recording) in &mut recordings {
            for signal in &mut recording.signals {
                let count = without_overlaps(signal);
                note_repeated(name, &signal.name, count);
            }
        }
        let mut taken = Vec::new();
        let device = |(name, recording)| DeviceRecording::of(name, recording, asked, &mut taken);
        Ok(recordings.into_iter().map(device).collect())
    }

    /// Reads tables that all started together or contain dates.
    pub fn of_tables(tables: Tables) -> Result<DeviceRecording, Failure> {
        let (name, device) = (tables.name(), tables.device());
        let is_dated = tables.is_dated();
        let signals = tables.collected()?;
        Ok(DeviceRecording { name, device, is_dated, date: None, signals })
    }

    /// When the first sample was measured, by the device's clock [ns].
    pub fn first_ns(&self) -> i64 {
        let firsts = self.signals.iter().filter_map(|signal| signal.content.first_ns());
        firsts.min().unwrap_or_default()
    }

    fn of(
        name: String,
        recording: Recording,
        asked: &Asked,
        taken: &mut Vec<String>,
    ) -> DeviceRecording {
        let own = if recording.device.is_empty() { "file" } else { &recording.device };
        let device = asked.device_or(own).to_owned();
        let signals = recording.signals.into_iter().map(|signal| {
            let name = unused(&token(&signal.name), &device, taken);
            Imported {
                stream: stream(&signal, &name, asked.person(), &device),
                content: signal.content,
            }
        });
        let signals = signals.collect();
        let (is_dated, date) = (recording.is_dated, recording.date);
        DeviceRecording { name, device, is_dated, date, signals }
    }
}

/// Whether a file that starts with these bytes has one of the formats of devices and recorders: zip (E4), Avro, XDF, EDF
/// or BDF.
pub fn is_of_device(start: &[u8]) -> bool {
    ["PK\x03\x04", "Obj\x01", "XDF:", "0       "]
        .iter()
        .any(|magic| start.starts_with(magic.as_bytes()))
        || start.starts_with(b"\xffBIOSEMI")
}

fn recording(path: &Path) -> Result<Recording, Failure> {
    let shown = path.display();
    let unreadable = |error| Failure::to(format!("read {shown}: {error}"));
    if std::fs::metadata(path).map_err(unreadable)?.len() > MOST_BYTES {
        return Err(Failure::to(format!("read {shown}: it is larger than 2 GiB"))
            .hint("export a shorter part of the recording"));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    let recording =
        read(&bytes).ok_or_else(|| Failure::to(format!("read {shown}: its format is unknown")))?;
    let recording = recording
        .map_err(|error| Failure::to(format!("read {shown}: {error}")).hint(error.hint()))?;
    recording.notes.iter().for_each(|note| output::note(format!("note: {shown}: {note}")));
    Ok(recording)
}

/// Adds the samples of another file of the same device.
fn add(known: &mut Recording, more: Recording, path: &Path) {
    for signal in more.signals {
        let is_same = |one: &&mut Signal| {
            one.name == signal.name
                && one.channels == signal.channels
                && one.quantity == signal.quantity
        };
        let width = signal.channels.len().max(1);
        let same = known.signals.iter_mut().find(is_same);
        match same.and_then(|one| append(&mut one.content, &signal.content, width)) {
            Some(count) => note_repeated(&path.display().to_string(), &signal.name, count),
            None => known.signals.push(signal),
        }
    }
}

fn note_repeated(file: &str, signal: &str, count: usize) {
    if count > 0 {
        output::note(format!(
            "note: {file}: left out {} of {signal} with times that other samples already have",
            counted(count, "sample", "samples")
        ));
    }
}

/// Turns a name into a token of a topic.
fn token(name: &str) -> String {
    let fits =
        |each: char| if each.is_ascii_alphanumeric() { each.to_ascii_lowercase() } else { '_' };
    let name: String = name.chars().map(fits).take(40).collect();
    let name = name.trim_matches('_');
    if name.starts_with(|each: char| each.is_ascii_lowercase()) {
        name.to_owned()
    } else {
        format!("signal_{name}")
    }
}

/// Appends a number to a name that another signal of the device already has.
fn unused(name: &str, device: &str, taken: &mut Vec<String>) -> String {
    let mut number = 1;
    let mut free = name.to_owned();
    while taken.contains(&format!("{device}/{free}")) {
        number += 1;
        free = format!("{name}_{number}");
    }
    taken.push(format!("{device}/{free}"));
    free
}

/// Appends a number to each name that another channel already has.
pub fn unlike(names: impl Iterator<Item = String>) -> impl Iterator<Item = String> {
    let mut taken = Vec::new();
    names.map(move |name| unused(&name, "", &mut taken))
}

fn stream(signal: &Signal, name: &str, person: &str, device: &str) -> Stream {
    let subject = Subject { about: About::Person, id: person.to_owned() };
    let shape = match &signal.content {
        Content::Even(_) => Shape::Wave,
        Content::Uneven { .. } => Shape::Sample,
        Content::Marks(_) => Shape::Event,
    };
    let persons = NAMESPACE.trim_end_matches('*');
    let mut stream = Stream::raw(format!("{persons}{person}/{device}/{name}"), subject, shape);
    stream.signal = measured(signal.quantity);
    stream.rate_hz = if matches!(signal.content, Content::Even(_)) { signal.rate_hz } else { 0.0 };
    let unit = |unit: &str| match worked_in(stream.signal) {
        Some(usual) if unit.is_empty() => usual.to_owned(),
        _ => spelt(unit),
    };
    let channels = signal.channels.iter();
    let names = channels.clone().map(|each| on_one_line(&each.name).into_owned());
    stream.channels = unlike(names)
        .zip(channels)
        .map(|(name, each)| Channel::new(name, unit(&each.unit)))
        .collect();
    stream
}

fn measured(quantity: Quantity) -> Measured {
    match quantity {
        Quantity::Ecg => Measured::Ecg,
        Quantity::Ppg => Measured::Ppg,
        Quantity::Eda => Measured::Eda,
        Quantity::Emg => Measured::Emg,
        Quantity::Eeg => Measured::Eeg,
        Quantity::Respiration => Measured::Respiration,
        Quantity::Temperature => Measured::Temperature,
        Quantity::Acceleration => Measured::Acceleration,
        Quantity::Interval => Measured::Interval,
        Quantity::Mark => Measured::Event,
        Quantity::Other => Measured::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_of_one_name_are_numbered() {
        let names = ["ECG", "EDA", "ECG", "ECG"].map(str::to_owned);
        let unlike: Vec<String> = unlike(names.into_iter()).collect();
        assert_eq!(unlike, ["ECG", "EDA", "ECG_2", "ECG_3"]);
    }
}
