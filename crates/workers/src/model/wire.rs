//! What goes between a session and the process that runs its models: a line of JSON before each picture, and one back.

use serde::{Deserialize, Serialize};

/// The line before a message with a picture.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Announced {
    /// The type of the message.
    #[serde(rename = "type")]
    pub(super) type_name: String,
    /// Its length.
    pub(super) bytes: usize,
}

/// A line back.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Reply {
    /// The models are loaded.
    Ready {
        /// What runs them.
        engine: String,
    },
    /// What was found in a picture.
    Seen {
        /// The numbers of each stream of each model; null for NaN.
        numbers: Vec<Vec<Option<f64>>>,
        /// All faces: left, top, width and height [px].
        faces: Vec<[f32; 4]>,
    },
    /// Why a picture can't be decoded.
    Unreadable(String),
    /// Why it ends.
    Failed(String),
}
