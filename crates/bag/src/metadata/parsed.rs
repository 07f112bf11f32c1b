//! The parsed contents of a `metadata.yaml` by any writer.

use std::collections::BTreeMap;

use super::Version;
use super::yaml::{split_entry, unquoted};

/// The fields of a `metadata.yaml` that a reader needs; the rest is taken from the files themselves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ParsedMetadata {
    /// The version of the description.
    pub version: Version,
    /// The storage plugin: `mcap` or `sqlite3`.
    pub storage: String,
    /// The compression that rosbag2 applied in addition to the storage's own: none, `FILE` or `MESSAGE`.
    pub compression_mode: String,
    /// The compression format, usually `zstd`.
    pub compression_format: String,
    /// The bag's files, in order, relative to its folder.
    pub files: Vec<String>,
    /// The number of messages in each file, by its name.
    pub messages: BTreeMap<String, u64>,
    /// The custom data of the writer.
    pub custom: BTreeMap<String, String>,
}

impl ParsedMetadata {
    /// Parses the fields needed from block-style YAML, and skips the rest.
    pub(crate) fn read(text: &str) -> ParsedMetadata {
        let mut parsed = ParsedMetadata::default();
        let (mut section, mut file) = (String::new(), String::new());
        for line in text.lines() {
            let indent = line.len() - line.trim_start().len();
            let line = line.trim();
            if let Some(item) = line.strip_prefix("- ") {
                if section == "relative_file_paths" {
                    parsed.files.push(unquoted(item));
                } else if section == "files"
                    && let Some((_, path)) = split_entry(item).filter(|(key, _)| key == "path")
                {
                    path.rsplit('/').next().unwrap_or_default().clone_into(&mut file);
                }
            } else if let Some((key, value)) = split_entry(line) {
                if indent <= 2 {
                    parsed.take(&key, &value);
                    section = key;
                } else if section == "custom_data" {
                    parsed.custom.insert(key, value);
                } else if section == "files" && key == "message_count" {
                    parsed.messages.extend(value.parse().ok().map(|count| (file.clone(), count)));
                }
            }
        }
        parsed
    }

    /// Parses the text without its single top-level key, as stored in an MCAP file.
    pub(crate) fn read_body(body: &str) -> ParsedMetadata {
        let lines: Vec<String> = body.lines().map(|line| format!("  {line}")).collect();
        ParsedMetadata::read(&lines.join("\n"))
    }

    fn take(&mut self, key: &str, value: &str) {
        match key {
            "version" if value == "5" => self.version = Version::V5,
            "storage_identifier" => value.clone_into(&mut self.storage),
            "compression_format" => value.clone_into(&mut self.compression_format),
            "compression_mode" => value.clone_into(&mut self.compression_mode),
            _ => {}
        }
    }
}
