//! What is done with faces before pictures are recorded.

use schemars::JsonSchema;
use serde::Deserialize;
use teampulse_core::stream::{Audience, Signal, Stream};

/// The types of messages with pictures, beside those of `sensor_msgs`; of packages that send videos all.
const OF_PICTURES: [&str; 4] = [
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/CompressedImage",
    "foxglove_msgs/msg/CompressedVideo",
    "foxglove_msgs/msg/CompressedImage",
];
/// Packages whose messages are pictures.
const PACKAGES_OF_PICTURES: [&str; 3] =
    ["ffmpeg_image_transport_msgs/", "theora_image_transport/", "stereo_msgs/"];

/// What is done with faces before pictures are recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Faces {
    /// Nothing.
    #[default]
    Keep,
    /// They are hidden by the worker of the type `blur`. Pictures that it has not looked at are neither recorded nor
    /// shown.
    Blur,
}

impl Faces {
    /// A stream of pictures, for those who may see its faces.
    #[must_use]
    pub fn hidden_in(self, pictures: Stream) -> Stream {
        match self {
            Faces::Keep => pictures,
            Faces::Blur => {
                Stream { signal: Signal::Image, audience: Audience::Workers, ..pictures }
            }
        }
    }

    /// The same of a stream whose messages have this type, which may be no pictures.
    #[must_use]
    pub fn hidden_in_any(self, stream: Stream, type_name: &str) -> Stream {
        let is_of_pictures = OF_PICTURES.contains(&type_name)
            || PACKAGES_OF_PICTURES.iter().any(|package| type_name.starts_with(package));
        if is_of_pictures { self.hidden_in(stream) } else { stream }
    }
}
