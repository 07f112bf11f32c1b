//! An LSL stream in a session: its topic, signal, channels and units.

use teampulse_core::stream::{Channel, Origin, Shape, Signal, Stream, Subject};
use teampulse_core::units;
use teampulse_devices::lsl::{Format, StreamInfo};

use super::Lsl;

/// Stream types in lower case, as used in XDF's metadata and by common programs, with their signals.
const TYPES: &[(&str, Signal)] = &[
    ("eeg", Signal::Eeg),
    ("ecg", Signal::Ecg),
    ("ekg", Signal::Ecg),
    ("emg", Signal::Emg),
    ("eda", Signal::Eda),
    ("gsr", Signal::Eda),
    ("ppg", Signal::Ppg),
    ("bvp", Signal::Ppg),
    ("resp", Signal::Respiration),
    ("respiration", Signal::Respiration),
    ("temp", Signal::Temperature),
    ("temperature", Signal::Temperature),
    ("acc", Signal::Acceleration),
    ("accel", Signal::Acceleration),
    ("accelerometer", Signal::Acceleration),
    ("acceleration", Signal::Acceleration),
    ("rr", Signal::Interval),
    ("ibi", Signal::Interval),
];
/// Units as spelt in descriptions, with their spelling in teampulse.
const UNITS: &[(&[&str], &str)] = &[
    (&["microvolts", "microvolt", "uv", "µv", "μv"], "uV"),
    (&["millivolts", "millivolt"], "mV"),
    (&["volts", "volt"], "V"),
    (&["microsiemens", "us", "µs", "μs"], "uS"),
    (&["celsius", "degrees celsius"], "degC"),
    (&["milliseconds", "millisecond"], "ms"),
    (&["seconds", "second"], "s"),
    (&["degrees", "degree"], "deg"),
    (&["percent"], "%"),
    (&["normalized", "normalised"], "1"),
];
/// The text before the name and before the type in a stream's description.
const DESCRIBED: &str = "LSL stream ";
const OF_TYPE: &str = " of the type ";
const MARKERS: [&str; 3] = ["markers", "marker", "trigger"];

/// The kind of readings that a stream's samples become.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Waves with a rate.
    Regular,
    /// Samples, each with its own time.
    Irregular,
    /// Markers.
    Markers,
}

/// Returns the kind of readings that a stream's samples become.
pub(super) fn kind(info: &StreamInfo) -> Kind {
    let is_marker = MARKERS.contains(&info.kind.to_lowercase().as_str());
    if info.format == Format::String || (is_marker && info.rate_hz == 0.0) {
        Kind::Markers
    } else if info.rate_hz > 0.0 {
        Kind::Regular
    } else {
        Kind::Irregular
    }
}

/// Returns the session's stream for an LSL stream; `device` is the device in its topic.
pub(super) fn stream(info: &StreamInfo, person: Option<&str>, device: &str) -> Stream {
    let kind = kind(info);
    let subject = person.map_or_else(Subject::session, Subject::person);
    let root = person.map_or("/session".to_owned(), |id| format!("/humans/persons/{id}"));
    let shape = match kind {
        Kind::Regular => Shape::Wave,
        Kind::Irregular => Shape::Sample,
        Kind::Markers => Shape::Event,
    };
    let mut stream = Stream::raw(format!("{root}/{device}/{}", leaf(info)), subject, shape);
    stream.doc = format!("{} from {}", described(&info.name, &info.kind), info.hostname);
    if !info.source_id.is_empty() {
        stream.doc.push_str(&of_source(&info.source_id));
    }
    device.clone_into(&mut stream.device);
    stream.rate_hz = info.rate_hz;
    if kind == Kind::Markers {
        stream.signal = Signal::Event;
        return stream;
    }
    stream.signal = signal(&info.kind);
    stream.channels = channels(info);
    stream
}

/// Returns the start of a stream's description.
fn described(name: &str, kind: &str) -> String {
    format!("{DESCRIBED}{name}{OF_TYPE}{kind}")
}

/// Returns the end of the description of a stream whose source has an id.
fn of_source(id: &str) -> String {
    format!(", source_id {id}")
}

/// Whether a stream of a session is one that these settings read.
pub(super) fn is_read(settings: &Lsl, stream: &Stream) -> bool {
    let subject = settings.person.as_deref().map_or_else(Subject::session, Subject::person);
    let is_named = |name: &String| stream.doc.starts_with(&described(name, ""));
    let is_typed = |kind: &String| stream.doc.contains(&format!("{OF_TYPE}{kind} from "));
    let is_of = |id: &String| stream.doc.ends_with(&of_source(id));
    stream.origin == Origin::Raw
        && stream.subject() == subject
        && stream.doc.starts_with(DESCRIBED)
        && settings.name.as_ref().is_none_or(is_named)
        && settings.stream_type.as_ref().is_none_or(is_typed)
        && settings.source_id.as_ref().is_none_or(is_of)
}

/// Returns the last token of a stream's topic: `eeg`, `markers`, `gaze`.
pub fn leaf(info: &StreamInfo) -> String {
    let signal = signal(&info.kind);
    match kind(info) {
        Kind::Markers => "markers".to_owned(),
        _ if signal == Signal::Other && info.kind.is_empty() => "samples".to_owned(),
        _ if signal == Signal::Other => slug(&info.kind),
        _ => signal.to_string(),
    }
}

fn signal(kind: &str) -> Signal {
    let kind = kind.to_lowercase();
    TYPES.iter().find(|(known, _)| *known == kind).map_or(Signal::Other, |(_, signal)| *signal)
}

fn channels(info: &StreamInfo) -> Vec<Channel> {
    let count = info.channel_count;
    let name = |index: usize| {
        let label =
            info.channels.get(index).map(|channel| channel.label.as_str()).unwrap_or_default();
        if label.is_empty() { format!("channel_{}", index + 1) } else { label.to_owned() }
    };
    let unit = |index: usize| unit(info.channels.get(index).map_or("", |channel| &channel.unit));
    let mut channels: Vec<Channel> =
        (0..count).map(|index| Channel::new(name(index), unit(index))).collect();
    // Features need distinct channel names.
    let mut known = std::collections::BTreeSet::new();
    for (channel, number) in channels.iter_mut().zip(1..) {
        if !known.insert(channel.name.clone()) {
            channel.name = format!("{}_{number}", channel.name);
        }
    }
    channels
}

fn unit(of_sender: &str) -> String {
    let plain = of_sender.trim();
    let lower = plain.to_lowercase();
    let known = UNITS.iter().find(|(spellings, _)| spellings.contains(&lower.as_str()));
    known.map_or_else(|| units::spelt(plain), |(_, unit)| (*unit).to_owned())
}

/// Returns a text as a token of a topic: `biosemi_a` for `BioSemi A`.
pub fn slug(text: &str) -> String {
    const LONGEST: usize = 60;
    let mut token = String::new();
    for each in text.chars().take(LONGEST) {
        let lower = each.to_ascii_lowercase();
        if lower.is_ascii_alphanumeric() {
            token.push(lower);
        } else if !token.is_empty() && !token.ends_with('_') {
            token.push('_');
        }
    }
    let token = token.trim_end_matches('_');
    if token.starts_with(|each: char| each.is_ascii_lowercase()) {
        token.to_owned()
    } else {
        format!("lsl_{token}").trim_end_matches('_').to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(kind: &str, rate_hz: f64, format: &str) -> StreamInfo {
        let document = format!(
            "<info><name>BioSemi A</name><type>{kind}</type><channel_count>3</channel_count><nominal_srate>{rate_hz}\
             </nominal_srate><channel_format>{format}</channel_format><uid>u</uid><v4data_port>1</v4data_port>\
             <v4service_port>1</v4service_port><desc><channels><channel><label>C3</label><unit>microvolts</unit></channel>\
             <channel><label>C3</label><unit>µV</unit></channel><channel/></channels></desc></info>"
        );
        StreamInfo::parse(&document).expect("a description")
    }

    #[test]
    fn a_type_is_a_signal_and_units_are_spelt_as_ours() {
        let eeg = stream(&info("EEG", 500.0, "float32"), Some("p001"), "biosemi_a");
        assert_eq!(
            (eeg.name.as_str(), eeg.signal),
            ("/humans/persons/p001/biosemi_a/eeg", Signal::Eeg)
        );
        assert_eq!((eeg.shape, eeg.rate_hz), (Shape::Wave, 500.0));
        let channels: Vec<(&str, &str)> = eeg
            .channels
            .iter()
            .map(|channel| (channel.name.as_str(), channel.unit.as_str()))
            .collect();
        assert_eq!(channels, [("C3", "uV"), ("C3_2", "uV"), ("channel_3", "")]);
        let gaze = stream(&info("Gaze", 0.0, "double64"), None, "tobii");
        assert_eq!((gaze.name.as_str(), gaze.shape), ("/session/tobii/gaze", Shape::Sample));
    }

    #[test]
    fn texts_and_numbers_of_markers_are_events() {
        for marker in [
            info("Markers", 0.0, "string"),
            info("Markers", 0.0, "int32"),
            info("x", 0.0, "string"),
        ] {
            let stream = stream(&marker, None, "psychopy");
            assert_eq!(
                (stream.name.as_str(), stream.shape),
                ("/session/psychopy/markers", Shape::Event)
            );
        }
    }

    #[test]
    fn a_stream_is_read_by_the_settings_that_it_matches() {
        let info = StreamInfo { source_id: "a1".to_owned(), ..info("EEG", 500.0, "float32") };
        let eeg = stream(&info, Some("p001"), "biosemi_a");
        let is_read =
            |settings: &str| is_read(&toml::from_str(settings).expect("settings that read"), &eeg);
        for settings in ["name = 'BioSemi A'", "stream_type = 'EEG'", "source_id = 'a1'"] {
            assert!(is_read(&format!("person = 'p001'\n{settings}")), "{settings}");
            assert!(!is_read(settings), "it is about a person");
        }
        for settings in ["name = 'BioSemi'", "stream_type = 'EE'", "source_id = '1'"] {
            assert!(!is_read(&format!("person = 'p001'\n{settings}")), "{settings}");
        }
    }

    #[test]
    fn any_name_is_a_token() {
        for (name, token) in
            [("BioSemi A", "biosemi_a"), ("3D!", "lsl_3d"), ("µ", "lsl"), ("", "lsl")]
        {
            assert_eq!(slug(name), token, "{name}");
        }
    }
}
