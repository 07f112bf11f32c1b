//! The mapping from space to a camera's pictures.

use teampulse_messages::cdr::{CdrError, Reader};
use teampulse_messages::standard::std_msgs::Header;
use thiserror::Error;

use super::{is_alike, scaled};

/// The type of messages with the calibration of a camera.
pub const CAMERA_INFO: &str = "sensor_msgs/msg/CameraInfo";

/// The largest side of a calibrated picture [px].
const MOST_SIDE: f64 = 65_536.0;

/// The focal lengths and the principal point of a camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// The width and height of the pictures that the intrinsics are for [px].
    size: [f64; 2],
    /// The focal lengths along rows and along columns [px].
    focal: [f64; 2],
    /// Where the optical axis meets the picture [px]; the centre of the first pixel is 0, 0.
    centre: [f64; 2],
}

/// Why a message has no usable intrinsics. The text fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IntrinsicsError {
    /// The message is truncated, or of another type.
    #[error("read the calibration of a camera: {0}")]
    Message(#[from] CdrError),
    /// The calibration is all zeros, as for an uncalibrated camera, or otherwise impossible.
    #[error(
        "use the calibration of a camera: its K has the focal lengths {fx} and {fy} px for {width} × {height} pixels"
    )]
    Uncalibrated {
        /// The focal length along rows [px].
        fx: f64,
        /// The focal length along columns [px].
        fy: f64,
        /// The width of the pictures [px].
        width: u32,
        /// The height of the pictures [px].
        height: u32,
    },
    /// The calibration is for pictures cropped from those of the sensor.
    #[error(
        "use the calibration of a camera: it is for a region of interest; publish whole pictures"
    )]
    Part,
}

impl Intrinsics {
    /// Reads K and the picture size from a `sensor_msgs/msg/CameraInfo`.
    pub fn read(message: &[u8]) -> Result<Intrinsics, IntrinsicsError> {
        let mut reader = Reader::new(message)?;
        reader.read::<Header>()?;
        let (height, width): (u32, u32) = (reader.read()?, reader.read()?);
        reader.text()?;
        reader.read::<Vec<f64>>()?;
        let [fx, _, cx, _, fy, cy, ..] = reader.read::<[f64; 9]>()?;
        reader.read::<[f64; 9]>()?;
        reader.read::<[f64; 12]>()?;
        reader.read::<[u32; 2]>()?;
        let [left, top, region_height, region_width] = reader.read::<[u32; 4]>()?;
        let size = [width, height].map(f64::from);
        let is_calibrated = [fx, fy].iter().all(|focal| (1e-3..=1e9).contains(focal))
            && [cx, cy].iter().all(|place| place.abs() <= 1e9)
            && size.iter().all(|side| (1.0..=MOST_SIDE).contains(side));
        if !is_calibrated {
            return Err(IntrinsicsError::Uncalibrated { fx, fy, width, height });
        }
        // A region of size zero is the whole picture.
        let is_whole = [left, top] == [0, 0]
            && [0, width].contains(&region_width)
            && [0, height].contains(&region_height);
        if !is_whole {
            return Err(IntrinsicsError::Part);
        }
        Ok(Intrinsics { size, focal: [fx, fy], centre: [cx, cy] })
    }

    /// Returns the intrinsics for smaller or larger pictures of the same view; `None` if their proportions differ.
    pub fn of_pictures(&self, size: [f64; 2]) -> Option<Intrinsics> {
        is_alike(self.size, size).then(|| Intrinsics {
            size,
            focal: [0, 1].map(|axis| self.focal[axis] * size[axis] / self.size[axis]),
            centre: scaled(self.centre, self.size, size),
        })
    }

    /// Returns the position in space of a place in a picture, at a distance along the optical axis [m]. The position is
    /// in the camera's optical frame: x to the right, y down, z forward [m].
    pub fn in_space(&self, place: [f64; 2], distance_m: f64) -> [f64; 3] {
        let [x, y] =
            [0, 1].map(|axis| (place[axis] - self.centre[axis]) / self.focal[axis] * distance_m);
        [x, y, distance_m]
    }

    /// The width and height of the pictures that the intrinsics are for [px].
    pub fn size(&self) -> [f64; 2] {
        self.size
    }
}
