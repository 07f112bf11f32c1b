//! Depth pictures, and the positions in space of points in a picture.
//!
//! ```text
//! point [px] ──► patch of the depth picture ──► median distance [m] ──► x, y, z [m] in the camera's optical frame
//! ```

mod intrinsics;
mod patch;

use bytes::Bytes;
use teampulse_messages::pictures::{Encoding, PictureError, Pixels};
use thiserror::Error;

pub use intrinsics::{CAMERA_INFO, Intrinsics, IntrinsicsError};
pub use patch::{Patch, Unplaced};

/// A millimetre, the unit of 16-bit distances (REP 118) [m].
const MILLIMETRE: f64 = 0.001;
/// The largest difference between the proportions of two pictures of the same view: a pixel of rounding in a small one.
const MOST_SKEW: f64 = 0.02;

/// A picture whose pixels are distances from the plane of the camera. It shares the bytes of its message.
#[derive(Clone, Debug, PartialEq)]
pub struct Depth(Pixels);

/// Why a message has no usable depth picture. The text fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DepthError {
    /// The message is truncated, or not a picture.
    #[error("read a depth picture: {0}")]
    Message(#[from] PictureError),
    /// The pixels are not distances.
    #[error(
        "read distances in pixels of `{}`; 16UC1 (millimetres) and 32FC1 (metres) are supported", .0.name()
    )]
    Encoding(Encoding),
}

impl Depth {
    /// Reads the distances in a `sensor_msgs/msg/Image`.
    pub fn read(message: &Bytes) -> Result<Depth, DepthError> {
        let pixels = Pixels::read(message)?;
        match pixels.encoding {
            Encoding::Mono16 { .. } | Encoding::Float32 { .. } => Ok(Depth(pixels)),
            other => Err(DepthError::Encoding(other)),
        }
    }

    /// The width and height of the picture [px].
    pub fn size(&self) -> [f64; 2] {
        [self.0.width, self.0.height].map(f64::from)
    }

    /// Returns the distance at a pixel [m]; `None` for a hole, and outside the picture.
    pub fn at(&self, column: i64, row: i64) -> Option<f64> {
        let pixel = self.0.pixel(usize::try_from(column).ok()?, usize::try_from(row).ok()?)?;
        let distance = match self.0.encoding {
            Encoding::Float32 { is_big_endian: true } => {
                f32::from_be_bytes(*pixel.first_chunk()?).into()
            }
            Encoding::Float32 { .. } => f32::from_le_bytes(*pixel.first_chunk()?).into(),
            Encoding::Mono16 { is_big_endian: true } => {
                f64::from(u16::from_be_bytes(*pixel.first_chunk()?)) * MILLIMETRE
            }
            _ => f64::from(u16::from_le_bytes(*pixel.first_chunk()?)) * MILLIMETRE,
        };
        Some(distance).filter(|distance| distance.is_finite() && *distance > 0.0)
    }
}

/// Converts a place in one picture to the place in another picture of the same view [px]; the centre of the first pixel
/// is 0, 0.
pub fn scaled(place: [f64; 2], from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| (place[axis] + 0.5) * to[axis] / from[axis] - 0.5)
}

/// Whether pictures of these sizes have the same proportions, so that they may show the same view.
pub fn is_alike(a: [f64; 2], b: [f64; 2]) -> bool {
    let is_size = |size: [f64; 2]| size.iter().all(|side| (1.0..=1e6).contains(side));
    is_size(a) && is_size(b) && ((a[0] * b[1]) / (a[1] * b[0]) - 1.0).abs() <= MOST_SKEW
}

#[cfg(test)]
mod tests;
