//! The description of a bag, `metadata.yaml`, as rosbag2 writes it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

use teampulse_core::qos::Qos;
use teampulse_core::time::Time;

use crate::qos_yaml;

/// The name of the file in a bag's folder.
pub(crate) const FILE_NAME: &str = "metadata.yaml";
/// What a bag without a distribution of its own says; its formats are those of this one.
pub(crate) const ROS_DISTRO: &str = "jazzy";

/// A version of `metadata.yaml`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// What ROS 2 Humble reads: without custom data.
    V5,
    /// What ROS 2 Jazzy and later read and write.
    #[default]
    V9,
}

/// What `metadata.yaml` says about a bag.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Metadata {
    pub version: Version,
    pub topics: Vec<Topic>,
    pub files: Vec<FileSpan>,
    pub custom: BTreeMap<String, String>,
}

/// A topic with one type.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Topic {
    pub name: String,
    pub type_name: String,
    pub type_hash: String,
    pub qos: Vec<Qos>,
    pub messages: u64,
}

/// What one file of a bag spans.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FileSpan {
    pub path: String,
    pub span: Span,
}

/// A count of messages and the times of the first and the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Span {
    pub messages: u64,
    pub first: Time,
    pub last: Time,
}

impl Span {
    /// Counts a message.
    pub(crate) fn take(&mut self, at: Time) {
        if self.messages == 0 {
            (self.first, self.last) = (at, at);
        }
        self.messages += 1;
        self.first = self.first.min(at);
        self.last = self.last.max(at);
    }

    /// Both spans as one.
    pub(crate) fn join(self, other: Span) -> Span {
        match (self.messages, other.messages) {
            (_, 0) => self,
            (0, _) => other,
            (ours, theirs) => Span {
                messages: ours + theirs,
                first: self.first.min(other.first),
                last: self.last.max(other.last),
            },
        }
    }
}

impl Metadata {
    /// What is in all files together.
    pub(crate) fn span(&self) -> Span {
        self.files.iter().fold(Span::default(), |all, file| all.join(file.span))
    }

    /// The text of `metadata.yaml`.
    pub(crate) fn to_yaml(&self) -> String {
        let mut text = String::from("rosbag2_bagfile_information:\n");
        for line in self.body().lines() {
            writeln!(text, "  {line}").expect("a string takes what is written to it");
        }
        text
    }

    /// The same without its one top key, as it stands in an MCAP file.
    pub(crate) fn body(&self) -> String {
        let mut out = Lines::default();
        let number = if self.version == Version::V9 { 9 } else { 5 };
        out.line(0, format_args!("version: {number}"));
        out.line(0, format_args!("storage_identifier: mcap"));
        out.span(0, self.span());
        out.list("topics_with_message_count", &self.topics, |out, topic| {
            topic.write(self.version, out);
        });
        out.line(0, format_args!("compression_format: \"\""));
        out.line(0, format_args!("compression_mode: \"\""));
        out.list("relative_file_paths", &self.files, |out, file| {
            out.line(1, format_args!("- {}", scalar(&file.path)));
        });
        out.list("files", &self.files, |out, file| {
            out.line(1, format_args!("- path: {}", scalar(&file.path)));
            out.span(2, file.span);
        });
        if self.version == Version::V9 {
            self.write_custom(&mut out);
        }
        out.0
    }

    fn write_custom(&self, out: &mut Lines) {
        let empty = if self.custom.is_empty() { " {}" } else { "" };
        out.line(0, format_args!("custom_data:{empty}"));
        for (key, value) in &self.custom {
            out.line(1, format_args!("{}: {}", scalar(key), scalar(value)));
        }
        out.line(0, format_args!("ros_distro: {ROS_DISTRO}"));
    }

    /// Writes `metadata.yaml` into the bag's folder, all or nothing.
    pub(crate) fn save(&self, folder: &Path) -> io::Result<()> {
        let unfinished = folder.join(".metadata.yaml.new");
        let mut file = File::create(&unfinished)?;
        file.write_all(self.to_yaml().as_bytes())?;
        file.sync_data()?;
        fs::rename(&unfinished, folder.join(FILE_NAME))?;
        File::open(folder)?.sync_all()
    }
}

impl Topic {
    fn write(&self, version: Version, out: &mut Lines) {
        out.line(1, format_args!("- topic_metadata:"));
        out.line(3, format_args!("name: {}", scalar(&self.name)));
        out.line(3, format_args!("type: {}", scalar(&self.type_name)));
        out.line(3, format_args!("serialization_format: cdr"));
        let qos = qos_yaml::write(&self.qos, version);
        if version == Version::V5 {
            out.line(3, format_args!("offered_qos_profiles: {}", scalar(&qos)));
        } else if self.qos.is_empty() {
            out.line(3, format_args!("offered_qos_profiles: []"));
        } else {
            out.line(3, format_args!("offered_qos_profiles:"));
            for line in qos.lines() {
                out.line(4, format_args!("{line}"));
            }
        }
        if version == Version::V9 {
            out.line(3, format_args!("type_description_hash: {}", scalar(&self.type_hash)));
        }
        out.line(2, format_args!("message_count: {}", self.messages));
    }
}

/// YAML being written, two spaces a level.
#[derive(Default)]
struct Lines(String);

impl Lines {
    fn line(&mut self, level: usize, text: std::fmt::Arguments<'_>) {
        writeln!(self.0, "{:indent$}{text}", "", indent = 2 * level)
            .expect("a string takes what is written to it");
    }

    fn span(&mut self, level: usize, span: Span) {
        self.line(level, format_args!("duration:"));
        self.line(level + 1, format_args!("nanoseconds: {}", span.last.nanos_since(span.first)));
        self.line(level, format_args!("starting_time:"));
        self.line(level + 1, format_args!("nanoseconds_since_epoch: {}", span.first.nanos()));
        self.line(level, format_args!("message_count: {}", span.messages));
    }

    fn list<T>(&mut self, key: &str, items: &[T], write: impl Fn(&mut Lines, &T)) {
        let empty = if items.is_empty() { " []" } else { "" };
        self.line(0, format_args!("{key}:{empty}"));
        for item in items {
            write(self, item);
        }
    }
}

/// A string as a YAML scalar on one line: plain where that is safe, else in double quotes.
fn scalar(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/_.-".contains(c);
    let is_plain = text.starts_with(|c: char| c == '/' || c.is_ascii_alphabetic())
        && text.chars().all(plain)
        && !["true", "false", "yes", "no", "on", "off", "null", "y", "n"]
            .contains(&text.to_ascii_lowercase().as_str());
    if is_plain { text.to_owned() } else { quoted(text) }
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            '\n' => quoted.push_str("\\n"),
            '\t' => quoted.push_str("\\t"),
            // Control characters and the line breaks of Unicode, which YAML would fold.
            c if c.is_control() || "\u{2028}\u{2029}\u{feff}".contains(c) => {
                write!(quoted, "\\u{:04x}", c as u32).expect("a string takes what is written");
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// What a reader takes from the `metadata.yaml` of any writer: the rest is in the files themselves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Told {
    /// The version of the description.
    pub version: Version,
    /// The storage plugin: `mcap` or `sqlite3`.
    pub storage: String,
    /// What rosbag2 compressed beside the storage: nothing, `FILE` or `MESSAGE`.
    pub compression_mode: String,
    /// The bag's files, in order, relative to its folder.
    pub files: Vec<String>,
    /// What its writer added.
    pub custom: BTreeMap<String, String>,
}

impl Told {
    /// Reads what is needed out of block-style YAML, and skips the rest.
    pub(crate) fn read(text: &str) -> Told {
        let mut told = Told::default();
        let mut section = String::new();
        for line in text.lines() {
            let indent = line.len() - line.trim_start().len();
            let line = line.trim();
            if let Some(item) = line.strip_prefix("- ") {
                if section == "relative_file_paths" {
                    told.files.push(unquoted(item));
                }
            } else if let Some((key, value)) = split_entry(line) {
                if indent <= 2 {
                    told.take(&key, &value);
                    section = key;
                } else if section == "custom_data" {
                    told.custom.insert(key, value);
                }
            }
        }
        told
    }

    fn take(&mut self, key: &str, value: &str) {
        match key {
            "version" if value == "5" => self.version = Version::V5,
            "storage_identifier" => value.clone_into(&mut self.storage),
            "compression_mode" => value.clone_into(&mut self.compression_mode),
            _ => {}
        }
    }
}

/// Key and value of a line; the key may be quoted.
fn split_entry(line: &str) -> Option<(String, String)> {
    let end_of_key = if line.starts_with('"') { closing_quote(line)? + 1 } else { line.find(':')? };
    let (key, rest) = line.split_at(end_of_key);
    Some((unquoted(key), unquoted(rest.trim_start().strip_prefix(':')?)))
}

fn closing_quote(line: &str) -> Option<usize> {
    let mut escaped = false;
    line.char_indices().skip(1).find_map(|(at, c)| {
        let closes = c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        closes.then_some(at)
    })
}

fn unquoted(text: &str) -> String {
    let text = text.trim();
    let inside = |quote: char| text.strip_prefix(quote)?.strip_suffix(quote);
    if let Some(single) = inside('\'') {
        return single.replace("''", "'");
    }
    let Some(double) = inside('"') else { return text.to_owned() };
    let mut plain = String::new();
    let mut chars = double.chars();
    while let Some(c) = chars.next() {
        plain.push(if c == '\\' { unescaped(&mut chars) } else { c });
    }
    plain
}

fn unescaped(rest: &mut std::str::Chars<'_>) -> char {
    match rest.next() {
        Some('n') => '\n',
        Some('t') => '\t',
        Some('u') => {
            let code: String = rest.take(4).collect();
            let code = u32::from_str_radix(&code, 16).ok().and_then(char::from_u32);
            code.unwrap_or(char::REPLACEMENT_CHARACTER)
        }
        Some(c) => c,
        None => '\\',
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn metadata(version: Version) -> Metadata {
        let at = |nanos| Time::from_nanos(nanos);
        Metadata {
            version,
            topics: vec![
                Topic {
                    name: "/r1/battery_state".into(),
                    type_name: "sensor_msgs/msg/BatteryState".into(),
                    type_hash: "RIHS01_00".into(),
                    qos: vec![Qos::best_effort(5)],
                    messages: 3,
                },
                Topic {
                    name: "/x".into(),
                    type_name: "a/msg/X".into(),
                    type_hash: String::new(),
                    qos: vec![],
                    messages: 1,
                },
            ],
            files: vec![
                FileSpan {
                    path: "b_0.mcap".into(),
                    span: Span { messages: 3, first: at(10), last: at(30) },
                },
                FileSpan {
                    path: "b_1.mcap".into(),
                    span: Span { messages: 1, first: at(40), last: at(40) },
                },
            ],
            custom: [("session".into(), "two: \"words\"\n".into())].into(),
        }
    }

    #[test]
    fn a_description_reads_as_jazzy_writes_it() {
        insta::assert_snapshot!(metadata(Version::V9).to_yaml());
    }

    #[test]
    fn a_description_reads_as_humble_writes_it() {
        insta::assert_snapshot!(metadata(Version::V5).to_yaml());
    }

    #[test]
    fn what_a_reader_needs_comes_back() {
        let told = Told::read(&metadata(Version::V9).to_yaml());
        assert_eq!(told.storage, "mcap");
        assert_eq!(told.compression_mode, "");
        assert_eq!(told.files, ["b_0.mcap", "b_1.mcap"]);
        assert_eq!(told.custom, metadata(Version::V9).custom);
    }

    proptest! {
        #[test]
        fn any_custom_data_comes_back(custom: BTreeMap<String, String>) {
            let yaml = Metadata { custom: custom.clone(), ..Metadata::default() }.to_yaml();
            prop_assert_eq!(Told::read(&yaml).custom, custom);
        }

        #[test]
        fn any_text_is_read_without_a_panic(text: String) {
            Told::read(&text);
            qos_yaml::read(&text);
        }
    }
}
