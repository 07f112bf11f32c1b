//! The protocol between a session and the process that runs its models: a line of JSON before each picture, and a line
//! in reply.

use serde::{Deserialize, Serialize};

/// The header line before a picture message.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Announced {
    /// The type of the message.
    #[serde(rename = "type")]
    pub(super) type_name: String,
    /// The length of the message [bytes].
    pub(super) bytes: usize,
}

/// A reply line.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Reply {
    /// The models are loaded.
    Ready {
        /// The name of the engine that runs the models.
        engine: String,
    },
    /// The findings in a picture.
    Seen {
        /// The values of each stream of each model; null for NaN.
        numbers: Vec<Vec<Option<f64>>>,
        /// All faces: left, top, width and height [px].
        faces: Vec<[f32; 4]>,
    },
    /// The reason why a picture cannot be decoded.
    Unreadable(String),
    /// The reason why the process exits.
    Failed(String),
}
