use v4l::format::FourCC;

use super::Wish;

/// What a camera gives, of what is read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Files of JPEG.
    Jpeg,
    /// Two pixels in four bytes, Y U Y V.
    Yuyv,
    /// Red, green, blue.
    Rgb,
    /// Grey.
    Grey,
    /// Distances of 16 bits, the lower byte first.
    Depth,
}

impl Format {
    /// The formats that fit a wish, the best first.
    pub fn wished(wish: Wish) -> Vec<Format> {
        match wish {
            Wish::Auto => vec![Format::Jpeg, Format::Yuyv, Format::Rgb, Format::Grey],
            Wish::Mjpeg => vec![Format::Jpeg],
            Wish::Yuyv => vec![Format::Yuyv],
            Wish::Grey => vec![Format::Grey],
            Wish::Depth => vec![Format::Depth],
        }
    }

    /// The format that the kernel calls so.
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

    /// The length of a pixel [bytes]; `None` of files.
    pub fn pixel_bytes(self) -> Option<usize> {
        match self {
            Format::Jpeg => None,
            Format::Grey => Some(1),
            Format::Yuyv | Format::Depth => Some(2),
            Format::Rgb => Some(3),
        }
    }

    /// The type of its messages.
    pub fn type_name(self) -> &'static str {
        match self {
            Format::Depth => "sensor_msgs/msg/Image",
            _ => "sensor_msgs/msg/CompressedImage",
        }
    }

    /// The name of its topic below that of the camera, by the conventions of `image_transport`.
    pub fn leaf(self) -> &'static str {
        match self {
            Format::Depth => "image_rect_raw",
            _ => "image_raw/compressed",
        }
    }

    /// What it is, for people.
    pub fn doc(self) -> &'static str {
        match self {
            Format::Jpeg => "JPEG as the camera compressed it",
            Format::Yuyv | Format::Rgb => "JPEG of its pixels, compressed here (quality 85)",
            Format::Grey => "grey JPEG of its pixels, compressed here (quality 85)",
            Format::Depth => "distances of 16 bits",
        }
    }
}
