//! The bag: everything, in rosbag2's MCAP layout.

mod commanded;
mod continuing;
mod kept;
#[cfg(test)]
mod testing;

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use teampulse_bag::{BagSink, Compression, Options, Place, Version};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::Sink;

use commanded::CommandedBag;
pub use continuing::{Continuation, ContinuingBag};
use kept::Limits;

use crate::SinkContext;

/// A bag with all data of the session, in rosbag2's MCAP layout: it opens in `ros2 bag`, Foxglove, Lichtblick,
/// PlotJuggler and `rosbags`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bag {
    /// The compression: `zstd` (smallest), `lz4` or `none`.
    pub compression: Compressed,
    /// The size of a file after which another is started [MiB]; 0 for never, as in rosbag2.
    pub split_mib: Option<u64>,
    /// The time span of a file after which another is started [s]; 0 for never.
    pub split_secs: Option<f64>,
    /// The version of `metadata.yaml`: 9 (ROS 2 Jazzy and later) or 5 (Humble).
    pub metadata_version: u8,
    /// The free disk space below which the recording ends, with a report [MiB].
    pub keep_free_mib: u64,
    /// What happens when the recording fails, as on a full disk: `retry` (it continues in a new bag as soon as one can
    /// be created, in a numbered folder beside the first) or `end`.
    pub on_failure: OnFailure,
    /// Another folder, preferably on another disk, in which the recording continues when it fails in its own folder, or
    /// starts when it can't be started there.
    pub fallback: Option<PathBuf>,
    /// Whether the recording starts paused, as with `ros2 bag record --start-paused`: nothing is recorded until the
    /// command `start_recording`.
    pub start_paused: bool,
    /// How much is kept in memory while the recording is paused, before it starts or after `stop_recording` [s]: the
    /// next recording starts with it, and the command `snapshot` writes it into a separate bag. 0 keeps nothing.
    pub snapshot_secs: f64,
    /// The maximum size of the data kept in memory [MiB]; if `snapshot_secs` need more, fewer seconds are kept.
    pub snapshot_mib: usize,
    /// Whether tidy files are written into the bag's folder: events, features, heart intervals and a summary, as the
    /// sink `tidy` writes them.
    pub tidy: bool,
}

/// The longest time that can be kept while a recording is paused [s].
const MOST_KEPT_SECS: f64 = 3600.0;

/// How a bag is compressed.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Compressed {
    /// Zstandard, level 1.
    Zstd,
    /// LZ4: faster, larger.
    Lz4,
    /// No compression.
    None,
}

/// What happens when a recording fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum OnFailure {
    /// The recording continues in a new bag, as soon as one can be created.
    Retry,
    /// The recording ends; the session continues.
    End,
}

impl Default for Bag {
    fn default() -> Bag {
        Bag {
            compression: Compressed::Zstd,
            split_mib: None,
            split_secs: None,
            metadata_version: 9,
            keep_free_mib: 64,
            on_failure: OnFailure::Retry,
            fallback: None,
            start_paused: false,
            snapshot_secs: 30.0,
            snapshot_mib: 256,
            tidy: true,
        }
    }
}

impl Component<dyn Sink, SinkContext> for Bag {
    const EXAMPLE: &'static str = r#"compression = "zstd"
split_mib   = 4096"#;

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        let is_claimed = is_vacant(&context.bag);
        if context.bag.exists() && !is_claimed {
            let message = format!("the bag's folder {} already exists", context.bag.display());
            return Err(SettingsError::new(message).with_hint("give another folder with --out"));
        }
        let metadata_version = match self.metadata_version {
            9 => Version::V9,
            5 => Version::V5,
            other => {
                let message = format!("metadata_version is {other}, expected 9 or 5");
                return Err(SettingsError::new(message));
            }
        };
        if !(0.0..=MOST_KEPT_SECS).contains(&self.snapshot_secs) {
            let message = format!("snapshot_secs is {}, expected 0 to 3600", self.snapshot_secs);
            return Err(SettingsError::new(message).at("snapshot_secs"));
        }
        if let Some(secs) = self.split_secs.filter(|secs| !(secs.is_finite() && *secs >= 0.0)) {
            let error = SettingsError::new(format!("split_secs is {secs}, expected 0 or more"));
            return Err(error.at("split_secs").with_hint("0 never splits"));
        }
        if self.fallback.as_ref().is_some_and(|folder| folder.as_os_str().is_empty()) {
            let error = SettingsError::new("fallback is empty").at("fallback");
            return Err(error.with_hint("give a folder on another disk, or omit it"));
        }
        let (split_bytes, split_secs) = self.splits();
        let options = Options {
            session: context.session.clone(),
            compression: match self.compression {
                Compressed::Zstd => Compression::Zstd,
                Compressed::Lz4 => Compression::Lz4,
                Compressed::None => Compression::None,
            },
            split_bytes,
            split_secs,
            metadata_version,
            place: if is_claimed { Place::Claimed } else { Place::New },
            keep_free_bytes: self.keep_free_mib.saturating_mul(1 << 20),
            growth: context.growth.clone(),
            ..Options::default()
        };
        let (folder, study) = (context.bag.clone(), context.study.clone());
        let bag = BagSink { folder, study, options };
        let again = match self.on_failure {
            OnFailure::Retry => Continuation::Beside { fallback: self.fallback },
            OnFailure::End => Continuation::Never,
        };
        let ended = context.bag_ended.clone();
        if self.start_paused {
            ended.begins_later();
        }
        let limits =
            Limits { secs: self.snapshot_secs, bytes: self.snapshot_mib.saturating_mul(1 << 20) };
        let bag = ContinuingBag { bag, ended, again, ends_by_command: true };
        Ok(Box::new(CommandedBag { bag, is_paused: self.start_paused, limits }))
    }
}

/// Whether a folder exists and is empty, as one that was created for this session.
fn is_vacant(folder: &Path) -> bool {
    std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none())
}

impl Bag {
    /// The size [bytes] and the duration [s] at which a file is split; `None` for never.
    fn splits(&self) -> (Option<u64>, Option<f64>) {
        let bytes = self.split_mib.filter(|mib| *mib > 0).map(|mib| mib.saturating_mul(1 << 20));
        (bytes, self.split_secs.filter(|secs| *secs > 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_of_zero_never_splits() {
        let splits = |mib, secs| {
            Bag { split_mib: Some(mib), split_secs: Some(secs), ..Bag::default() }.splits()
        };
        assert_eq!(splits(0, 0.0), (None, None));
        assert_eq!(splits(3, 0.5), (Some(3 << 20), Some(0.5)));
    }
}
