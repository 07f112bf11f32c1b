//! The header of a stream.

use crate::recording::{Channel, Quantity};

/// The most channels of a stream.
const MOST_CHANNELS: usize = 4096;

/// The header of a stream.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) name: String,
    pub(super) quantity: Quantity,
    pub(super) channels: Vec<Channel>,
    pub(super) format: Format,
    pub(super) rate_hz: f64,
}

/// The format in which a value is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Float32,
    Double64,
    Int8,
    Int16,
    Int32,
    Int64,
    Text,
}

impl Header {
    /// Parses a header; `None` if its format, its rate or its number of channels is missing.
    pub(super) fn parse(xml: &str) -> Option<Header> {
        let info = element(xml, "info")?.0;
        let count: usize = element(info, "channel_count")?.0.trim().parse().ok()?;
        let format = Format::parse(element(info, "channel_format")?.0.trim())?;
        let rate_hz: f64 = element(info, "nominal_srate")?.0.trim().parse().ok()?;
        if !(1..=MOST_CHANNELS).contains(&count) || !(0.0..=1e6).contains(&rate_hz) {
            return None;
        }
        let text = |name| element(info, name).map(|(text, _)| unescaped(text.trim()));
        let name = text("name").unwrap_or_default();
        let mut channels = described(info);
        channels.truncate(count);
        while channels.len() < count {
            channels.push(Channel::new(format!("channel_{}", channels.len() + 1), ""));
        }
        let quantity = quantity(&text("type").unwrap_or_default(), format);
        Some(Header { name, quantity, channels, format, rate_hz })
    }

    /// The time from one sample to the next [s]; 0 if it is not constant.
    pub(super) fn period_secs(&self) -> f64 {
        if self.rate_hz > 0.0 { 1.0 / self.rate_hz } else { 0.0 }
    }
}

impl Format {
    fn parse(word: &str) -> Option<Format> {
        Some(match word {
            "float32" => Format::Float32,
            "double64" => Format::Double64,
            "int8" => Format::Int8,
            "int16" => Format::Int16,
            "int32" => Format::Int32,
            "int64" => Format::Int64,
            "string" => Format::Text,
            _ => return None,
        })
    }
}

/// The quantity of a stream, from its type, as listed in <https://github.com/sccn/xdf/wiki/Meta-Data> or in common use.
fn quantity(kind: &str, format: Format) -> Quantity {
    match &*kind.to_ascii_lowercase() {
        "ecg" | "ekg" => Quantity::Ecg,
        "eeg" => Quantity::Eeg,
        "emg" => Quantity::Emg,
        "ppg" | "bvp" => Quantity::Ppg,
        "eda" | "gsr" => Quantity::Eda,
        "acc" | "accelerometer" | "acceleration" => Quantity::Acceleration,
        "resp" | "respiration" => Quantity::Respiration,
        "temp" | "temperature" => Quantity::Temperature,
        "rr" | "rri" | "ppi" => Quantity::Interval,
        _ if format == Format::Text => Quantity::Mark,
        _ => Quantity::Other,
    }
}

/// The channels as described; the description is optional.
fn described(info: &str) -> Vec<Channel> {
    let mut channels = Vec::new();
    let Some((mut rest, _)) = element(info, "desc").and_then(|(desc, _)| element(desc, "channels"))
    else {
        return channels;
    };
    while let Some((channel, after)) =
        element(rest, "channel").filter(|_| channels.len() < MOST_CHANNELS)
    {
        let text = |name| element(channel, name).map(|(text, _)| unescaped(text.trim()));
        let label = text("label").unwrap_or_else(|| format!("channel_{}", channels.len() + 1));
        channels.push(Channel::new(label, unit(&text("unit").unwrap_or_default())));
        rest = after;
    }
    channels
}

/// The short form of a unit.
fn unit(unit: &str) -> &str {
    match unit {
        "microvolts" => "uV",
        "millivolts" => "mV",
        "volts" => "V",
        other => other,
    }
}

/// The content of the first XML element with a name, and the text after the element.
pub(super) fn element<'a>(xml: &'a str, name: &str) -> Option<(&'a str, &'a str)> {
    let (opening, closing) = (format!("<{name}"), format!("</{name}>"));
    let mut rest = xml;
    loop {
        rest = &rest[rest.find(&opening)? + opening.len()..];
        match rest.chars().next()? {
            '>' => break,
            '/' if rest.starts_with("/>") => return Some(("", &rest[2..])),
            each if each.is_whitespace() => {
                rest = &rest[rest.find('>')?..];
                break;
            }
            // An element with a longer name.
            _ => {}
        }
    }
    let inside = &rest[1..];
    let end = inside.find(&closing)?;
    Some((&inside[..end], &inside[end + closing.len()..]))
}

fn unescaped(text: &str) -> String {
    let known = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    known.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}
