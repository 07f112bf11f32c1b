//! What analyses of points in pictures share: where the points are among the channels, and how fast they move.

mod path;
mod place;

pub(crate) use path::{Stay, speed};
pub(crate) use place::{Place, between, middle};

/// How far the line between a person's right and left point is tilted to the right shoulder [rad]. The right one of
/// somebody who looks at the camera is on the left of the picture.
pub(crate) fn tilt([right, left]: [[f64; 2]; 2]) -> f64 {
    (right[1] - left[1]).atan2(left[0] - right[0])
}
