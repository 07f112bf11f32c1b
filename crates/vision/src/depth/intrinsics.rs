//! How a camera maps space to its pictures.

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
    /// The width and height of the pictures that they are for [px].
    size: [f64; 2],
    /// The focal lengths along rows and along columns [px].
    focal: [f64; 2],
    /// Where the optical axis meets the picture [px]; the centre of the first pixel is 0, 0.
    centre: [f64; 2],
}

/// Why a message has no intrinsics that can be used. It fits after "failed to".
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IntrinsicsError {
    /// It is cut off, or of another type.
    #[error("read the calibration of a camera: {0}")]
    Message(#[from] CdrError),
    /// All zeros, as of a camera that nobody calibrated, or no numbers of a camera.
    #[error(
        "use the calibration of a camera: its K has the focal lengths {fx} and {fy} px for {width} × {height} pixels"
    )]
    Uncalibrated {
        /// The focal length along rows [px].
        fx: f64,
        /// That along columns [px].
        fy: f64,
        /// The width of the pictures [px].
        width: u32,
        /// Their height [px].
        height: u32,
    },
    /// Pictures that are cut out of those of the sensor.
    #[error(
        "use the calibration of a camera: it is for a region of interest; publish whole pictures"
    )]
    Part,
}

impl Intrinsics {
    /// Reads K and the size of the pictures in a `sensor_msgs/msg/CameraInfo`.
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
        // A region of no size is the whole picture.
        let is_whole = [left, top] == [0, 0]
            && [0, width].contains(&region_width)
            && [0, height].contains(&region_height);
        if !is_whole {
            return Err(IntrinsicsError::Part);
        }
        Ok(Intrinsics { size, focal: [fx, fy], centre: [cx, cy] })
    }

    /// The same for smaller or larger pictures of the same view; `None` for pictures of other proportions.
    pub fn of_pictures(&self, size: [f64; 2]) -> Option<Intrinsics> {
        is_alike(self.size, size).then(|| Intrinsics {
            size,
            focal: [0, 1].map(|axis| self.focal[axis] * size[axis] / self.size[axis]),
            centre: scaled(self.centre, self.size, size),
        })
    }

    /// What is seen at a place of a picture at a distance along the optical axis [m], in the camera's optical frame: x
    /// to the right, y down, z forward [m].
    pub fn in_space(&self, place: [f64; 2], distance_m: f64) -> [f64; 3] {
        let [x, y] =
            [0, 1].map(|axis| (place[axis] - self.centre[axis]) / self.focal[axis] * distance_m);
        [x, y, distance_m]
    }

    /// The width and height of the pictures that they are for [px].
    pub fn size(&self) -> [f64; 2] {
        self.size
    }
}
