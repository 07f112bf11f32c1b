//! Streams of Lab Streaming Layer in range.

use serde::Serialize;
use teampulse_core::counted::counted;
use teampulse_sources::lsl::FoundStream;

use crate::output;

/// A stream that a source can read.
#[derive(Debug, PartialEq, Serialize)]
pub struct LslStream {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    source_id: String,
    hostname: String,
    channels: usize,
    rate_hz: f64,
    format: &'static str,
}

impl LslStream {
    /// Describes a stream in range.
    pub fn of(found: &FoundStream) -> LslStream {
        let info = &found.info;
        LslStream {
            name: info.name.clone(),
            kind: info.kind.clone(),
            source_id: info.source_id.clone(),
            hostname: info.hostname.clone(),
            channels: info.channel_count,
            rate_hz: info.rate_hz,
            format: info.format.word(),
        }
    }

    fn line(&self) -> String {
        let LslStream { name, kind, hostname, channels, rate_hz, format, .. } = self;
        let rate = if *rate_hz > 0.0 { format!("{rate_hz} Hz") } else { "irregular".to_owned() };
        let line = format!(
            "  {name:<38} {kind:<12} {channels:>4} x {format:<8} {rate:>10}  on {hostname}"
        );
        // Names come from the network.
        teampulse_core::text::on_one_line(&line).into_owned()
    }

    fn source(&self) -> String {
        let person = if self.format == "string" { "" } else { "person = \"p001\"\n" };
        // Written as a TOML string, since it may contain anything.
        let name = toml::Value::from(self.name.as_str());
        format!("[[sources]]\ntype   = \"lsl\"\n{person}name   = {name}\n")
    }
}

/// Prints streams, with the lines of a study that read them.
pub fn show(streams: &[LslStream]) {
    output::line(format!("LSL: {}", counted(streams.len(), "stream", "streams")));
    output::lines(streams.iter().map(LslStream::line));
    if !streams.is_empty() {
        output::line("\nlines for a study; name the person whom a stream is about:");
    }
    output::lines(streams.iter().map(LslStream::source));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_a_stream_are_a_source() {
        let stream = LslStream {
            name: "Amp \"left\"\u{1b}[2J".into(),
            kind: "EEG".into(),
            source_id: "amp".into(),
            hostname: "lab".into(),
            channels: 32,
            rate_hz: 500.0,
            format: "float32",
        };
        assert!(stream.line().contains("32 x float32      500 Hz  on lab"), "{}", stream.line());
        assert!(!stream.line().contains('\u{1b}'));
        let study: toml::Table = toml::from_str(&stream.source()).expect("lines of a study");
        let source = &study["sources"][0];
        assert_eq!(source["type"].as_str(), Some("lsl"));
        assert_eq!(source["name"].as_str(), Some("Amp \"left\"\u{1b}[2J"));
        assert_eq!(source["person"].as_str(), Some("p001"));
    }
}
