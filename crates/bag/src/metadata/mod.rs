//! The description of a bag, `metadata.yaml`, as rosbag2 writes it.

mod yaml;
pub(crate) mod qos;
mod parsed;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

use teampulse_core::qos::Qos;
use teampulse_core::time::Time;

use yaml::{YamlWriter, scalar};

use crate::private;
use crate::read::DAMAGE_NOTE;

pub(crate) use parsed::ParsedMetadata;

/// The name of the file in a bag's folder.
pub(crate) const FILE_NAME: &str = "metadata.yaml";
/// The metadata record in which rosbag2 stores the text of `metadata.yaml`.
pub(crate) const ROSBAG2_RECORD: &str = "rosbag2";
/// The key of the text of `metadata.yaml` in [`ROSBAG2_RECORD`].
pub(crate) const SERIALIZED_KEY: &str = "serialized_metadata";
/// The ROS distribution that our bags state, as they use its formats.
const ROS_DISTRO: &str = "jazzy";

/// A version of `metadata.yaml`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// The version that ROS 2 Humble reads: without custom data, except for a note on damage.
    V5,
    /// The version that ROS 2 Jazzy and later read and write.
    #[default]
    V9,
}

/// The contents of `metadata.yaml`.
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

/// The times and the message count of one file of a bag.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FileSpan {
    pub path: String,
    pub span: Span,
}

/// A message count, and the times of the first and the last message.
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

    /// Combines both spans.
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
    /// The span of all files together.
    pub(crate) fn span(&self) -> Span {
        self.files.iter().fold(Span::default(), |all, file| all.join(file.span))
    }

    /// Serialises the metadata as the text of `metadata.yaml`.
    pub(crate) fn to_yaml(&self) -> String {
        let mut text = String::from("rosbag2_bagfile_information:\n");
        for line in self.body().lines() {
            writeln!(text, "  {line}").expect("writing to a string never fails");
        }
        text
    }

    /// Serialises the metadata without the single top-level key, as stored in an MCAP file.
    pub(crate) fn body(&self) -> String {
        let mut out = YamlWriter::default();
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
        match (self.version, self.custom.get(DAMAGE_NOTE)) {
            (Version::V9, _) => self.write_custom(&mut out),
            // Humble ignores what it doesn't know.
            (Version::V5, Some(damage)) => {
                out.line(0, format_args!("custom_data:"));
                out.line(1, format_args!("{}: {}", scalar(DAMAGE_NOTE), scalar(damage)));
            }
            (Version::V5, None) => {}
        }
        out.0
    }

    fn write_custom(&self, out: &mut YamlWriter) {
        let empty = if self.custom.is_empty() { " {}" } else { "" };
        out.line(0, format_args!("custom_data:{empty}"));
        for (key, value) in &self.custom {
            out.line(1, format_args!("{}: {}", scalar(key), scalar(value)));
        }
        out.line(0, format_args!("ros_distro: {ROS_DISTRO}"));
    }

    /// Writes `metadata.yaml` into the bag's folder, atomically.
    pub(crate) fn save(&self, folder: &Path) -> io::Result<()> {
        let unfinished = folder.join(".metadata.yaml.new");
        let mut file = private::create(&unfinished)?;
        file.write_all(self.to_yaml().as_bytes())?;
        file.sync_data()?;
        fs::rename(&unfinished, folder.join(FILE_NAME))?;
        File::open(folder)?.sync_all()
    }
}

impl Topic {
    fn write(&self, version: Version, out: &mut YamlWriter) {
        out.line(1, format_args!("- topic_metadata:"));
        out.line(3, format_args!("name: {}", scalar(&self.name)));
        out.line(3, format_args!("type: {}", scalar(&self.type_name)));
        out.line(3, format_args!("serialization_format: cdr"));
        let qos = qos::write(&self.qos, version);
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
        let parsed = ParsedMetadata::read(&metadata(Version::V9).to_yaml());
        assert_eq!(parsed.storage, "mcap");
        assert_eq!(parsed.compression_mode, "");
        assert_eq!(parsed.files, ["b_0.mcap", "b_1.mcap"]);
        assert_eq!(parsed.custom, metadata(Version::V9).custom);
    }

    proptest! {
        #[test]
        fn any_custom_data_comes_back(custom: BTreeMap<String, String>) {
            let yaml = Metadata { custom: custom.clone(), ..Metadata::default() }.to_yaml();
            prop_assert_eq!(ParsedMetadata::read(&yaml).custom, custom);
        }

        #[test]
        fn any_text_is_read_without_a_panic(text: String) {
            ParsedMetadata::read(&text);
            qos::read(&text);
        }
    }
}
