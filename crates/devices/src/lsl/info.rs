//! The description of a stream.

use super::xml::{self, Element};
use super::{Format, LslError};

/// The largest number of channels.
const MOST_CHANNELS: u32 = 16_384;
/// The length to which texts are truncated [characters].
const LONGEST: usize = 512;
/// The version of the protocol, as written in descriptions.
const VERSION: &str = "1.10";

/// The description of a stream, and where its sender serves it.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamInfo {
    /// The name of the stream.
    pub name: String,
    /// The type of the stream: `EEG`, `Markers`, `Gaze`.
    pub kind: String,
    /// The number of channels.
    pub channel_count: usize,
    /// The sampling rate [Hz]; 0 for irregular samples.
    pub rate_hz: f64,
    /// The format of the values.
    pub format: Format,
    /// The id of the source, which stays the same when the sender restarts; may be empty.
    pub source_id: String,
    /// The id of this particular outlet.
    pub uid: String,
    /// The id of the LSL session; by default `default`.
    pub session_id: String,
    /// The host name of the sender's computer.
    pub hostname: String,
    /// The TCP port that serves samples.
    pub data_port: u16,
    /// The UDP port that serves probes of the clock.
    pub service_port: u16,
    /// When the outlet was created, by the sender's clock [s].
    pub created_secs: f64,
    /// The descriptions of the channels: all of them, or none.
    pub channels: Vec<ChannelInfo>,
}

/// A channel of a stream; each text may be empty.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChannelInfo {
    /// The label of the channel: `Fp1`.
    pub label: String,
    /// The unit as the sender spells it: `microvolts`.
    pub unit: String,
    /// The type of the channel: `EEG`.
    pub kind: String,
}

impl StreamInfo {
    /// Parses a description.
    pub fn parse(document: &str) -> Result<StreamInfo, LslError> {
        let root = Element::parse(document)?;
        if root.name != "info" {
            return Err(LslError::Description("it does not describe a stream"));
        }
        let text = |name| kept(root.text_of(name));
        let channel_count: u32 = number(&root, "channel_count")?;
        let rate_hz: f64 = number(&root, "nominal_srate")?;
        let format = Format::from_word(root.text_of("channel_format"))
            .ok_or_else(|| wrong("channel_format", root.text_of("channel_format")))?;
        if !(1..=MOST_CHANNELS).contains(&channel_count) {
            return Err(wrong("channel_count", root.text_of("channel_count")));
        }
        if !(0.0..=1e9).contains(&rate_hz) {
            return Err(wrong("nominal_srate", root.text_of("nominal_srate")));
        }
        let (name, uid) = (text("name"), text("uid"));
        if name.is_empty() || uid.is_empty() {
            return Err(wrong(if name.is_empty() { "name" } else { "uid" }, ""));
        }
        let channel_count = channel_count as usize;
        Ok(StreamInfo {
            name,
            uid,
            kind: text("type"),
            channel_count,
            rate_hz,
            format,
            source_id: text("source_id"),
            session_id: text("session_id"),
            hostname: text("hostname"),
            data_port: number(&root, "v4data_port")?,
            service_port: number(&root, "v4service_port")?,
            created_secs: number(&root, "created_at").unwrap_or(0.0),
            channels: channels(&root, channel_count),
        })
    }

    /// Returns the description without its channels, as sent in discovery.
    pub fn short_xml(&self) -> String {
        self.xml("")
    }

    /// Returns the full description.
    pub fn full_xml(&self) -> String {
        let mut channels = String::new();
        for ChannelInfo { label, unit, kind } in &self.channels {
            channels.push_str("<channel>");
            xml::write(&mut channels, "label", label);
            xml::write(&mut channels, "unit", unit);
            xml::write(&mut channels, "type", kind);
            channels.push_str("</channel>");
        }
        self.xml(&format!("<channels>{channels}</channels>"))
    }

    fn xml(&self, desc: &str) -> String {
        let mut out = String::from("<?xml version=\"1.0\"?>\n<info>");
        for (name, text) in self.fields() {
            xml::write(&mut out, name, &text);
        }
        out.extend(["<desc>", desc, "</desc></info>\n"]);
        out
    }

    /// Returns the elements of a description, in order, with their texts.
    pub(super) fn fields(&self) -> [(&'static str, String); 17] {
        [
            ("name", self.name.clone()),
            ("type", self.kind.clone()),
            ("channel_count", self.channel_count.to_string()),
            ("channel_format", self.format.word().to_owned()),
            ("source_id", self.source_id.clone()),
            ("nominal_srate", self.rate_hz.to_string()),
            ("version", VERSION.to_owned()),
            ("created_at", self.created_secs.to_string()),
            ("uid", self.uid.clone()),
            ("session_id", self.session_id.clone()),
            ("hostname", self.hostname.clone()),
            ("v4address", String::new()),
            ("v4data_port", self.data_port.to_string()),
            ("v4service_port", self.service_port.to_string()),
            ("v6address", String::new()),
            ("v6data_port", "0".to_owned()),
            ("v6service_port", "0".to_owned()),
        ]
    }
}

fn channels(root: &Element, count: usize) -> Vec<ChannelInfo> {
    let listed = root.child("desc").and_then(|desc| desc.child("channels"));
    let Some(listed) = listed else { return Vec::new() };
    let channels = listed.children.iter().filter(|child| child.name == "channel");
    let channels = channels.map(|channel| ChannelInfo {
        label: kept(channel.text_of("label")),
        unit: kept(channel.text_of("unit")),
        kind: kept(channel.text_of("type")),
    });
    let channels: Vec<ChannelInfo> = channels.take(count + 1).collect();
    // If the list has a different length, it is unknown which channel is which.
    if channels.len() == count { channels } else { Vec::new() }
}

fn number<T: std::str::FromStr>(root: &Element, field: &'static str) -> Result<T, LslError> {
    let text = root.text_of(field);
    text.parse().map_err(|_not_one| wrong(field, text))
}

fn wrong(field: &'static str, got: &str) -> LslError {
    LslError::Field { field, got: kept(got).chars().take(60).collect() }
}

fn kept(text: &str) -> String {
    text.chars().take(LONGEST).collect()
}
