//! Treatment of faces in pictures before they are recorded.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::stream::{Audience, Signal, Stream};

/// The types of picture messages in packages that also have other messages.
const OF_PICTURES: [&str; 4] = [
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CompressedImage",
    "foxglove_msgs/msg/CompressedVideo",
    "foxglove_msgs/msg/CompressedImage",
];
/// Packages whose messages are all pictures.
const PACKAGES_OF_PICTURES: [&str; 3] =
    ["ffmpeg_image_transport_msgs/", "theora_image_transport/", "stereo_msgs/"];

/// The treatment of faces in pictures before they are recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Faces {
    /// Faces are kept.
    #[default]
    Keep,
    /// Faces are hidden by the worker of type `blur`. Pictures that it has not processed are neither recorded nor
    /// shown.
    Blur,
}

impl Faces {
    /// Returns the stream of pictures, visible only to workers if faces are hidden.
    #[must_use]
    pub fn hidden_in(self, pictures: Stream) -> Stream {
        match self {
            Faces::Keep => pictures,
            Faces::Blur => {
                Stream { signal: Signal::Image, audience: Audience::Workers, ..pictures }
            }
        }
    }

    /// Returns the stream as [`hidden_in`](Self::hidden_in) does if messages of this type are pictures, or else
    /// unchanged.
    #[must_use]
    pub fn hidden_in_any(self, stream: Stream, type_name: &str) -> Stream {
        let is_of_pictures = OF_PICTURES.contains(&type_name)
            || PACKAGES_OF_PICTURES.iter().any(|package| type_name.starts_with(package));
        if is_of_pictures { self.hidden_in(stream) } else { stream }
    }
}
