use v4l::format::FourCC;

use super::Wish;

/// A supported camera format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// JPEG files.
    Jpeg,
    /// Four bytes per two pixels, Y U Y V.
    Yuyv,
    /// Red, green, blue.
    Rgb,
    /// Grey.
    Grey,
    /// 16-bit distances, little-endian.
    Depth,
}

impl Format {
    /// Returns the formats that match a request, the best first.
    pub fn wished(wish: Wish) -> Vec<Format> {
        match wish {
            Wish::Auto => vec![Format::Jpeg, Format::Yuyv, Format::Rgb, Format::Grey],
            Wish::Mjpeg => vec![Format::Jpeg],
            Wish::Yuyv => vec![Format::Yuyv],
            Wish::Grey => vec![Format::Grey],
            Wish::Depth => vec![Format::Depth],
        }
    }

    /// Returns the format with this `FourCC` code.
    pub fn of(code: FourCC) -> Option<Format> {
        Some(match &code.repr {
            b"MJPG" | b"JPEG" => Format::Jpeg,
            b"YUYV" => Format::Yuyv,
            b"RGB3" => Format::Rgb,
            b"GREY" => Format::Grey,
            b"Z16 " => Format::Depth,
            _ => return None,
        })
    }

    /// The size of a pixel [bytes]; `None` for JPEG.
    pub fn pixel_bytes(self) -> Option<usize> {
        match self {
            Format::Jpeg => None,
            Format::Grey => Some(1),
            Format::Yuyv | Format::Depth => Some(2),
            Format::Rgb => Some(3),
        }
    }

    /// The ROS type of the format's messages.
    pub fn type_name(self) -> &'static str {
        match self {
            Format::Depth => "sensor_msgs/msg/Image",
            _ => "sensor_msgs/msg/CompressedImage",
        }
    }

    /// The last token of the topic name, following `image_transport`.
    pub fn leaf(self) -> &'static str {
        match self {
            Format::Depth => "image_rect_raw",
            _ => "image_raw/compressed",
        }
    }

    /// A description for users.
    pub fn doc(self) -> &'static str {
        match self {
            Format::Jpeg => "JPEG, as compressed by the camera",
            Format::Yuyv | Format::Rgb => "JPEG, compressed here from raw pixels (quality 85)",
            Format::Grey => "grey JPEG, compressed here from raw pixels (quality 85)",
            Format::Depth => "16-bit distances",
        }
    }
}
