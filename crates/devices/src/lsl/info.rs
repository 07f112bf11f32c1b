//! The description of a stream.

use super::xml::{self, Element};
use super::{Format, LslError};

/// The most channels.
const MOST_CHANNELS: u32 = 16_384;
/// The longest text that is kept [characters].
const LONGEST: usize = 512;
/// The version of the protocol, as written in descriptions.
const VERSION: &str = "1.10";

/// The description of a stream, and where its sender serves it.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamInfo {
    /// Its name.
    pub name: String,
    /// Its type: `EEG`, `Markers`, `Gaze`.
    pub kind: String,
    /// The number of its channels.
    pub channel_count: usize,
    /// The rate of its samples [Hz]; 0 where they are irregular.
    pub rate_hz: f64,
    /// The format of its values.
    pub format: Format,
    /// The id of its origin, which stays the same when the sender restarts; may be empty.
    pub source_id: String,
    /// The id of this particular outlet.
    pub uid: String,
    /// The session; by default `default`.
    pub session_id: String,
    /// The computer of the sender.
    pub hostname: String,
    /// The TCP port of its samples.
    pub data_port: u16,
    /// The UDP port of its services.
    pub service_port: u16,
    /// When it was created, by the sender's clock [s].
    pub created_secs: f64,
    /// The descriptions of its channels: all of them, or none.
    pub channels: Vec<ChannelInfo>,
}

/// A channel of a stream; each text may be empty.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChannelInfo {
    /// Its label: `Fp1`.
    pub label: String,
    /// Its unit, as the sender spells it: `microvolts`.
    pub unit: String,
    /// Its type: `EEG`.
    pub kind: String,
}

impl StreamInfo {
    /// Reads a description.
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

    /// The description without its channels, as discovery sends it.
    pub fn short_xml(&self) -> String {
        self.xml("")
    }

    /// The whole description.
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

    /// The elements of a description, in their order, with their texts.
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
    // A list of another length does not say which channel is which.
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
