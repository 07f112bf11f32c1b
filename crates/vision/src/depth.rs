//! Depth pictures, and where in space the points of a picture are.
//!
//! ```text
//! point [px] ──► patch of the depth picture ──► median distance [m] ──► x, y, z [m] in the camera's optical frame
//! ```

mod intrinsics;
mod patch;

use bytes::Bytes;
use teampulse_messages::cdr::{CdrError, Reader};
use teampulse_messages::standard::std_msgs::Header;
use thiserror::Error;

use crate::picture::MOST_PIXELS;

pub use intrinsics::{CAMERA_INFO, Intrinsics, IntrinsicsError};
pub use patch::{Patch, Unplaced};

/// A millimetre, the unit of 16-bit distances (REP 118) [m].
const MILLIMETRE: f64 = 0.001;
/// How much the proportions of two pictures may differ that show the same view: a pixel of rounding in a small one.
const MOST_SKEW: f64 = 0.02;
/// The longest name of an encoding that is repeated in an error [bytes].
const SHOWN_BYTES: usize = 60;

/// A picture whose pixels are distances from the plane of the camera, in a message that it shares.
#[derive(Clone, Debug, PartialEq)]
pub struct Depth {
    width: usize,
    height: usize,
    /// The length of a row [bytes].
    step: usize,
    number: Number,
    rows: Bytes,
}

/// How a distance is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    /// 16 bits [mm]: `16UC1`, `mono16`.
    Millimetres { is_big_endian: bool },
    /// A 32-bit float [m]: `32FC1`.
    Metres { is_big_endian: bool },
}

/// Why a message has no depth picture that can be used. It fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DepthError {
    /// It is cut off, or no picture.
    #[error("read a depth picture: {0}")]
    Message(#[from] CdrError),
    /// Pixels that are no distances.
    #[error(
        "read distances in pixels of `{0}`; 16UC1 (millimetres) and 32FC1 (metres) can be read"
    )]
    Encoding(String),
    /// Fewer pixels than announced, none, or too many.
    #[error(
        "read a depth picture: {width} × {height} pixels were announced, in rows of {step} bytes; {bytes} bytes arrived"
    )]
    Rows {
        /// The announced columns.
        width: u32,
        /// The announced rows.
        height: u32,
        /// The announced length of a row [bytes].
        step: u32,
        /// The number of bytes received.
        bytes: usize,
    },
}

impl Number {
    fn named(name: &[u8], is_big_endian: bool) -> Option<Number> {
        match name {
            b"16UC1" | b"mono16" => Some(Number::Millimetres { is_big_endian }),
            b"32FC1" => Some(Number::Metres { is_big_endian }),
            _ => None,
        }
    }

    /// The length of a pixel [bytes].
    fn bytes(self) -> usize {
        match self {
            Number::Millimetres { .. } => 2,
            Number::Metres { .. } => 4,
        }
    }

    /// The distance in the bytes of a pixel [m].
    fn metres(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Number::Millimetres { is_big_endian } => {
                let bytes = *bytes.first_chunk()?;
                let number = if is_big_endian {
                    u16::from_be_bytes(bytes)
                } else {
                    u16::from_le_bytes(bytes)
                };
                f64::from(number) * MILLIMETRE
            }
            Number::Metres { is_big_endian } => {
                let bytes = *bytes.first_chunk()?;
                let number = if is_big_endian {
                    f32::from_be_bytes(bytes)
                } else {
                    f32::from_le_bytes(bytes)
                };
                f64::from(number)
            }
        })
    }
}

impl Depth {
    /// Reads the distances in a `sensor_msgs/msg/Image`.
    pub fn read(message: &Bytes) -> Result<Depth, DepthError> {
        let mut reader = Reader::new(message)?;
        reader.read::<Header>()?;
        let (height, width): (u32, u32) = (reader.read()?, reader.read()?);
        let name = reader.text()?;
        let is_big_endian = reader.read::<u8>()? != 0;
        let step: u32 = reader.read()?;
        let count = reader.count(1)?;
        let rows = reader.bytes(count)?;
        let number = Number::named(name, is_big_endian).ok_or_else(|| {
            let shown = &name[..name.len().min(SHOWN_BYTES)];
            DepthError::Encoding(String::from_utf8_lossy(shown).into_owned())
        })?;
        let pixels = u64::from(width) * u64::from(height);
        let is_whole = (1..=MOST_PIXELS as u64).contains(&pixels)
            && u64::from(step) >= u64::from(width) * number.bytes() as u64
            && rows.len() as u64 >= u64::from(step) * u64::from(height);
        if !is_whole {
            return Err(DepthError::Rows { width, height, step, bytes: rows.len() });
        }
        let (width, height, step) = (width as usize, height as usize, step as usize);
        Ok(Depth { width, height, step, number, rows: message.slice_ref(rows) })
    }

    /// Its width and height [px].
    pub fn size(&self) -> [f64; 2] {
        [self.width as f64, self.height as f64]
    }

    /// The distance at a pixel [m]; `None` for a hole, and outside of the picture.
    pub fn at(&self, column: i64, row: i64) -> Option<f64> {
        let column = usize::try_from(column).ok().filter(|column| *column < self.width)?;
        let row = usize::try_from(row).ok().filter(|row| *row < self.height)?;
        let pixel = self.rows.get(row * self.step + column * self.number.bytes()..)?;
        self.number.metres(pixel).filter(|distance| distance.is_finite() && *distance > 0.0)
    }
}

/// A place in one picture as a place in another picture of the same view [px]; the centre of the first pixel is 0, 0.
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
