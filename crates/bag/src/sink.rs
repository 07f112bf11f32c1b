//! The bag as a sink: records all output of the pump to the disk.

use std::path::PathBuf;

use teampulse_core::sink::{Delivery, Inbox, Sink, SinkError};

use crate::recording::Recording;
use crate::write::Options;

/// The name of the attachment that contains the study.
pub const STUDY_NAME: &str = "study.toml";

/// The key of the note that states why a bag ended before its session.
pub const ENDED_NOTE: &str = "teampulse.ended_early";
/// The key of the note with the folder of the bag that a recording continues.
pub const CONTINUES_NOTE: &str = "teampulse.continues";

/// The key of the note that states that the session was already running when the bag began.
pub const JOINED_NOTE: &str = "teampulse.joined";

/// Records a session into a bag.
#[derive(Clone, Debug)]
pub struct BagSink {
    /// The bag's folder; it must not exist yet.
    pub folder: PathBuf,
    /// The text of the study, attached to the bag; may be empty.
    pub study: String,
    /// The options for writing the bag.
    pub options: Options,
}

impl Sink for BagSink {
    fn name(&self) -> &'static str {
        "bag"
    }

    fn delivery(&self) -> Delivery {
        Delivery::Lossless
    }

    fn carries_out(&self) -> &'static [&'static str] {
        &["split"]
    }

    fn run(self: Box<Self>, inbox: Inbox) -> Result<(), SinkError> {
        self.begin()?.record(&inbox).map(drop).map_err(|broken| broken.error)
    }
}

impl BagSink {
    /// Creates the bag. If this fails, no bag is left behind.
    pub fn begin(self) -> Result<Recording, SinkError> {
        Recording::begin(self)
    }
}
