//! The bag: everything, in rosbag2's MCAP layout.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_bag::{BagSink, Compression, Options, Version};
use teampulse_core::registry::{Component, SettingsError};
use teampulse_core::sink::{Delivery, Inbox, Sink, SinkError};

use crate::{Ended, SinkContext};

/// A bag with everything of the session, in rosbag2's MCAP layout: it opens in `ros2 bag`,
/// Foxglove, Lichtblick, PlotJuggler and `rosbags`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Bag {
    /// How it is compressed: `zstd` (smallest), `lz4` or `none`.
    pub compression: Compressed,
    /// A file of this size is followed by another [MiB].
    pub split_mib: Option<u64>,
    /// A file that spans so much time is followed by another [s].
    pub split_secs: Option<f64>,
    /// For which ROS 2 `metadata.yaml` is written: 9 (Jazzy and later) or 5 (Humble).
    pub metadata_version: u8,
    /// The recording ends, and says so, when the disk has less room than this [MiB].
    pub keep_free_mib: u64,
    /// Whether tidy files stand in its folder: events, features, heart intervals and a summary, as
    /// the sink `tidy` writes them.
    pub tidy: bool,
}

/// How a bag is compressed.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Compressed {
    /// Zstandard, level 1.
    Zstd,
    /// LZ4: faster, larger.
    Lz4,
    /// Not at all.
    None,
}

impl Default for Bag {
    fn default() -> Bag {
        Bag {
            compression: Compressed::Zstd,
            split_mib: None,
            split_secs: None,
            metadata_version: 9,
            keep_free_mib: 64,
            tidy: true,
        }
    }
}

impl Component<dyn Sink, SinkContext> for Bag {
    const EXAMPLE: &'static str = r#"compression = "zstd"
split_mib   = 4096"#;

    fn build(self, context: &SinkContext) -> Result<Box<dyn Sink>, SettingsError> {
        if context.bag.exists() {
            let message = format!("the bag's folder {} exists already", context.bag.display());
            return Err(SettingsError::new(message).with_hint("give another --out"));
        }
        let metadata_version = match self.metadata_version {
            9 => Version::V9,
            5 => Version::V5,
            other => {
                let message = format!("metadata_version is {other}, expected 9 or 5");
                return Err(SettingsError::new(message));
            }
        };
        let options = Options {
            session: context.session.clone(),
            compression: match self.compression {
                Compressed::Zstd => Compression::Zstd,
                Compressed::Lz4 => Compression::Lz4,
                Compressed::None => Compression::None,
            },
            split_bytes: self.split_mib.map(|mib| mib << 20),
            split_secs: self.split_secs,
            metadata_version,
            keep_free_bytes: self.keep_free_mib << 20,
            ..Options::default()
        };
        let (folder, study) = (context.bag.clone(), context.study.clone());
        let bag = BagSink { folder, study, options };
        Ok(Box::new(Telling { bag, ended: context.bag_ended.clone() }))
    }
}

/// A bag that tells the tidy files beside it when it ends early, so that they end with it.
#[derive(Debug)]
pub struct Telling {
    /// The bag.
    pub bag: BagSink,
    /// Whom it tells.
    pub ended: Ended,
}

impl Sink for Telling {
    fn name(&self) -> &'static str {
        self.bag.name()
    }

    fn delivery(&self) -> Delivery {
        self.bag.delivery()
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        let Telling { bag, ended } = *self;
        let recorded = Box::new(bag).run(inbox);
        if recorded.is_err() {
            ended.tell();
        }
        recorded
    }
}
